"""The capacitance of designs between bounds, one design or many: what ``sensorgen cell`` answers, as plain data."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any

from sensorgen.core.parallel import in_parallel, said
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction import losses
from sensorgen.prediction.capacitance import Answer, Unpredictable, default_width
from sensorgen.scene.scene import Scene


@dataclass(frozen=True)
class Asked:
    """What is asked about every design.

    Attributes
    ----------
    width : float or None
        Relative width of the bounds [-]; the default of :mod:`sensorgen.prediction.rest_state` if None.
    model : str
        The only model to ask, or "".
    keep : bool
        Take answers that are known from before, and keep new ones.
    frequency_hz : float or None
        Of the field, where dielectrics leak [Hz].
    """

    width: float | None = None
    model: str = ""
    keep: bool = True
    frequency_hz: float | None = None


def answer(body: Body, asked: Asked) -> dict[str, Any]:
    """Bounds of the capacitance per area of one body's most likely cell, unloaded.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    asked : Asked
        Accuracy and model.

    Raises
    ------
    Unpredictable, UnknownName, OutOfRange
        As :func:`sensorgen.prediction.capacitance.capacitance`.
    MissingValue
        A dielectric without a permittivity.
    """
    return _plain(body, _solved(*_inputs(body, asked)), asked)


def answers(bodies: Sequence[Body], asked: Asked, jobs: int, done: Callable[[], None]) -> list[dict[str, Any]]:
    """The same for many bodies, those that are not known from before in several processes.

    A design to which no model applies, or at which one fails, has a reason in place of numbers.

    Parameters
    ----------
    bodies : sequence of Body
        In the order of the answers.
    asked : Asked
        Accuracy and model.
    jobs : int
        How many processes at once, 1 or more.
    done : callable
        Called after each design.

    Raises
    ------
    UnknownName, OutOfRange, MissingValue
        As :func:`answer`.
    SensorgenError
        A process ended before its answer, as when the memory is full.
    """
    inputs = [_inputs(body, asked) for body in bodies]
    missing = [
        k for k, (scene, eps, of) in enumerate(inputs)
        if not (asked.keep and planner.is_known(scene, eps, _width(scene, of), of.model))
    ]  # fmt: skip
    found: dict[int, Answer | str] = {}
    for k in sorted(set(range(len(inputs))) - set(missing)):
        found[k] = _said(*inputs[k])
        done()
    # this process alone writes: the others may be ended at any moment
    anew = [(*inputs[k][:2], replace(inputs[k][2], keep=False)) for k in missing]
    for k, result in in_parallel(_said, anew, jobs):
        scene, eps, _ = inputs[missing[k]]
        if asked.keep and isinstance(result, Answer):
            planner.remember(scene, eps, asked.model, result)
        found[missing[k]] = result
        done()
    return [_plain(body, found[k], asked) for k, body in enumerate(bodies)]


def _inputs(body: Body, asked: Asked) -> tuple[Scene, dict[str, complex], Asked]:
    scene = body.cells.first()
    return scene, losses.permittivity(body.design, asked.frequency_hz)[0], replace(asked, width=_width(scene, asked))


def _width(scene: Scene, asked: Asked) -> float:
    return default_width(scene) if asked.width is None else asked.width


def _solved(scene: Scene, permittivity: dict[str, complex], asked: Asked) -> Answer:
    return planner.capacitance(scene, permittivity, _width(scene, asked), asked.model, asked.keep)


def _said(scene: Scene, permittivity: dict[str, complex], asked: Asked) -> Answer | str:
    """The answer, or why there is none."""
    return said(_solved, scene, permittivity, asked, refused=(Unpredictable,))


def _plain(body: Body, found: Answer | str, asked: Asked) -> dict[str, Any]:
    """Lines of an answer."""
    design = body.design
    data: dict[str, Any] = {
        "design": design.name,
        "body": body.provenance,
        "model": None,
        "lower_f_per_m2": None,
        "upper_f_per_m2": None,
    }
    if isinstance(found, str):
        return data | {"reason": found}
    found = found.times(body.cells.count)
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    per_area = found.capacitance_f.times(1 / area)
    return data | {
        "model": found.model,
        "lower_f_per_m2": per_area.lower,
        "upper_f_per_m2": per_area.upper,
        **_lost(found, area, asked),
        "relative_width": found.width(),
        "accuracy": found.wanted if found.wanted < inf else None,
        "reached": found.reached(),
        "seconds": found.seconds(),
        "known": found.known,
        "area_m2": area,
        "refused": list(found.refused),
        "plan": [asdict(c) for c in found.plan],
        "values": [vars(t) for t in losses.permittivity(design, asked.frequency_hz)[1]],
    }


def _lost(found: Answer, area_m2: float, asked: Asked) -> dict[str, Any]:
    """Where dielectrics lose: minus the imaginary part per area, and the tangent of the whole."""
    if found.loss_f is None:
        return {}
    real, loss = found.capacitance_f, found.loss_f
    ends = (real.lower, real.upper)
    return {
        "loss_lower_f_per_m2": loss.lower / area_m2,
        "loss_upper_f_per_m2": loss.upper / area_m2,
        "tan_delta": [loss.lower / ends[loss.lower > 0], loss.upper / ends[loss.upper < 0]] if real.lower > 0 else None,
        "frequency_hz": asked.frequency_hz,
    }
