"""Select the least expensive capacitance model that applies to a scene and meets a tolerance.

Models that take milliseconds always run: their bounds show whether more is needed. The others are ranked by their
expected time and error, and run one after the other. Both are scaled from measurements to the scene: all of
``models/expected.yaml``, made by ``bench/expected.py``.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from hashlib import sha256
from importlib import resources
from json import dumps
from math import hypot, inf
from typing import Any, NamedTuple

from sensorgen import models
from sensorgen.core import cache as cached
from sensorgen.core import yamlfile
from sensorgen.core.bounds import Disc, Interval
from sensorgen.core.display import Boundless
from sensorgen.core.errors import OutOfRange, SensorgenError, UnknownName
from sensorgen.core.lazy import by_key
from sensorgen.design.body import Cells
from sensorgen.models import capacitance_models
from sensorgen.prediction.plan import PlanCandidate
from sensorgen.scene.scene import FLOATING, Scene, content
from sensorgen.scene.sections import overlap, sections
from sensorgen.scene.slabs import is_open

FILE = "expected.yaml"


class MeasuredCost(NamedTuple):
    """A model on one scene.

    ``points`` are the widths of its bounds that it reached [-], each with its time [s]; the time grows with a power of
    the number of ``parts``, of the kind ``counted``. ``loading`` what it needs takes once [s].
    """

    scene: str
    counted: str
    parts: int
    power: float
    points: list[tuple[float, float]]
    loading: float = 0.0


class Size(NamedTuple):
    """Number of parts of the repeating cell of a scene, and whether the sensor's end cuts one."""

    parts: int
    is_cut: bool


def expected(model: str, scene: Scene, width: float) -> tuple[float | None, float | None]:
    """Width and seconds of the fastest measurement that did, or of the one that came nearest, scaled to a scene.

    Parameters
    ----------
    model : str
        Name of a model.
    scene : Scene
        Of any kind; where its parts cannot be counted, time is as measured.
    width : float
        That is wanted [-]; where any will do, nothing is scaled.

    Returns
    -------
    (float, float) or (None, None)
        Nothing where the model was never measured.

    Notes
    -----
    In a cross-section that is cut amid a cell the energy of its own length counts; the relative width is the root of
    the cell's.
    """
    if model not in measured():
        return None, None
    reachable = points(model, scene if width < inf else None)
    enough = [point for point in reachable if point[0] <= width]
    return min(enough, key=lambda p: p[1]) if enough else min(reachable)


def points(model: str, scene: Scene | None) -> list[tuple[float, float]]:
    """All widths that a model reached [-], each with its time [s], scaled to a scene if one is given."""
    cost = measured()[model]
    size = _size(scene, cost.counted) if scene else None
    root = 0.5 if size and size.is_cut else 1.0
    times = (size.parts / cost.parts) ** cost.power if size else 1.0
    return [(reached**root, seconds * times) for reached, seconds in cost.points]


@cache
def measured() -> dict[str, MeasuredCost]:
    """Each model on its scene."""
    data = yamlfile.parse((resources.files(models) / FILE).read_text("utf-8"), FILE)
    return {
        name: MeasuredCost(**{**entry, "points": [(width, seconds) for width, seconds in entry["points"]]})
        for name, entry in data.items()
    }


@lru_cache(maxsize=8)
def _size(scene: Scene, counted: str) -> Size | None:
    try:
        return COUNTED[counted](scene)
    except ValueError:  # a scene that the model does not apply to either
        return None


def _bands(scene: Scene) -> Size:
    """Pieces of one material in vertical strips without corners."""
    from sensorgen.scene.repetition import cell

    period = cell(sections(scene)[0], scene.size_mm[2])
    return Size(sum(len(s.bands) for s in period.slices), len(set(period.shares)) > 1)


def _boxes(scene: Scene) -> Size:
    """Boxes between the electrodes."""
    from sensorgen.solvers.electrostatics.boxes import grid

    return Size(int((grid(scene).fill > 1).sum()), is_cut=False)


COUNTED: dict[str, Callable[[Scene], Size]] = {
    "bands": _bands,
    "pieces": lambda scene: _bands(scene)._replace(is_cut=False),  # of a cell that is pressed by itself
    "boxes": _boxes,
    "cells": lambda _: Size(1, is_cut=False),  # a round one
}


# Relative width of a capacitance's bounds where none is asked for: a cross-section, 3D, electrodes that do not cover
PLANE, SPATIAL, OPEN = 1e-3, 1e-2, 2.5e-2
_EXACT = 1e-9  # relative width of a capacitance's bounds below which the scene is a plate
_SOLID = 1e-6  # share of air in a plate, by rounding
_LOSSLESS, _LOSSY = "capacitance", "lossy"  # functions of a model
_CHEAP = 1  # up to this cost, a model is asked before it is weighed


class Unpredictable(SensorgenError):
    """No model applies to the scene; the message holds every reason."""


class Contradiction(SensorgenError):
    """Two models whose bounds exclude each other: a fault, and no result."""


def default_width(scene: Scene) -> float:
    """Relative width of a capacitance's bounds where none is asked for [-]."""
    if is_open(scene):
        return OPEN
    if any(body.terminal == FLOATING for body in scene.bodies):
        return SPATIAL
    try:
        return PLANE if len(sections(scene)) == 1 else SPATIAL
    except ValueError:  # no constant cross-section
        return SPATIAL


@dataclass(frozen=True)
class Answer(Boundless):
    """A model's capacitance, and what the models before it refused.

    Attributes
    ----------
    model : str
        Name of the model.
    capacitance_f : Interval
        Of the whole sensor [F]; its real part where dielectrics lose.
    refused : tuple of str
        Why other models do not apply to the scene.
    wanted : float
        How wide the interval might be, relative to its middle [-].
    plan : tuple of PlanCandidate
        All models, in the order in which they were weighed.
    known : bool
        Whether the answer was known from before.
    loss_f : Interval or None
        Minus the imaginary part, where dielectrics lose [F].
    """

    model: str
    capacitance_f: Interval
    refused: tuple[str, ...]
    wanted: float = inf
    plan: tuple[PlanCandidate, ...] = ()
    known: bool = False
    loss_f: Interval | None = None

    def reached(self) -> bool:
        """Test whether the interval is as narrow as wanted."""
        return self.width() <= self.wanted

    def width(self) -> float:
        """Distance of the bounds, relative to their middle; of a complex value, to its modulus [-]."""
        if self.loss_f is None:
            return self.capacitance_f.width()
        real, loss = self.capacitance_f, self.loss_f
        return (real.upper - real.lower) / hypot(real.upper + real.lower, loss.upper + loss.lower) * 2

    def times(self, count: float, error: float = 0.0) -> "Answer":
        """The capacitance of ``count`` such cells side by side, known to a relative ``error``."""

        def whole(cell: Interval) -> Interval:
            return Interval(cell.lower * count * max(1 - error, 0.0), cell.upper * count * (1 + error))

        loss = self.loss_f and whole(self.loss_f)
        return replace(self, capacitance_f=whole(self.capacitance_f), loss_f=loss)

    def plus(self, other: "Answer") -> "Answer":
        """The capacitance of both side by side."""

        def both(one: Interval, two: Interval) -> Interval:
            return Interval(one.lower + two.lower, one.upper + two.upper)

        loss = both(self.loss_f, other.loss_f) if self.loss_f and other.loss_f else None
        return replace(self, capacitance_f=both(self.capacitance_f, other.capacitance_f), loss_f=loss)

    def seconds(self) -> float:
        """Time that all models took together, imports left out [s]."""
        return sum(c.seconds or 0.0 for c in self.plan)


def of_sensor(
    cells: Cells, permittivity: Mapping[str, complex], width: float = inf, model: str = "", keep: bool = True
) -> Answer:
    """Capacitance of a whole sensor by its most likely cells; parameters and errors as of :func:`capacitance`."""
    whole = capacitance(cells.first(), permittivity, width, model, keep).times(cells.count, cells.count_error)
    for scene, count in cells.beside:
        try:
            rims = capacitance(scene, permittivity, width, model, keep)
        except Unpredictable as error:
            raise Unpredictable(f"rims that its cells leave; a sensor of whole cells has none: {error}") from None
        whole = whole.plus(rims.times(count, cells.count_error))
    return whole


def capacitance(
    scene: Scene, permittivity: Mapping[str, complex], width: float = inf, model: str = "", keep: bool = True
) -> Answer:
    """Capacitance of a scene by the least expensive model that suffices.

    Parameters
    ----------
    scene : Scene
        As drawn.
    permittivity : mapping of str to float or complex
        Relative permittivity of each dielectric, and of "air" [-]; complex where one loses.
    width : float
        How wide the interval may be, relative to its middle; the narrowest one where none is that narrow [-].
    model : str
        The only model to ask, or "".
    keep : bool
        Take an answer that is known from before, and keep a new one. Answers of any width are not kept where a model
        in milliseconds gives them; without such a model they are those of :func:`default_width`.

    Raises
    ------
    Unpredictable
        Bodies overlap; no model applies to the scene, or the one that is named does not.
    Contradiction
        The bounds of two models exclude each other.
    UnknownName
        No model of capacitance goes by that name.
    OutOfRange
        A width that is not above 0.

    Notes
    -----
    A known answer is given without loading any model.
    """
    if not width > 0:
        raise OutOfRange(f"an accuracy of {width:g}; expected a number above 0, as 1e-4")
    if width == inf and not model:
        kind = _kind(permittivity)
        if any(
            m.COST <= _CHEAP and hasattr(m, kind) and not m.why_not_applicable(scene)
            for m in capacitance_models().values()
        ):
            return _asked(scene, permittivity, width, model)
        width = default_width(scene)
    if not keep:
        return _asked(scene, permittivity, width, model)
    question = _question(scene, permittivity, width, model)
    known = cached.known(question) is not None
    answer = cached.record(question, Answer, partial(_asked, scene, permittivity, width, model))
    return replace(answer, known=known)


def weighed(scene: Scene, width: float) -> tuple[PlanCandidate, ...]:
    """The plan of a width before anything is asked: all models of capacitance in the order in which they would be."""
    return tuple(replace(c, passed_over=_unfit(c, scene, _LOSSLESS)) for c in _ordered(scene, width, ""))


def _ordered(scene: Scene, width: float, model: str) -> list[PlanCandidate]:
    loaded = capacitance_models()
    if model and model not in loaded:
        raise UnknownName("model of capacitance", model, loaded)
    candidates = [
        PlanCandidate(name, *expected(name, scene, width), "" if model in ("", name) else f"--model {model}")
        for name in loaded
    ]
    return sorted(candidates, key=lambda c: _rank(c, loaded[c.model].COST, width))


def _unfit(candidate: PlanCandidate, scene: Scene, kind: str) -> str:
    loaded = capacitance_models()
    if hasattr(loaded[candidate.model], kind):
        return loaded[candidate.model].why_not_applicable(scene) or ""
    able = " and ".join(name for name, model in loaded.items() if hasattr(model, kind))
    return f"dielectric losses are solved by {able} alone: leave the losses out to use it"


def _rank(candidate: PlanCandidate, cost: int, width: float) -> tuple[bool, float, float, float]:
    """Models in milliseconds first, then those that should suffice by cost and time, then others by expected width."""
    short = cost > _CHEAP and candidate.reach() > width
    loading = measured()[candidate.model].loading if candidate.model in measured() else 0.0
    return short, candidate.reach() if short else 0.0, cost, (candidate.expected_seconds or 0.0) + loading


def _asked(scene: Scene, permittivity: Mapping[str, complex], width: float, model: str) -> Answer:
    from sensorgen.solvers.electrostatics.bounds import Unsolved

    overlaps = overlap(scene)
    if overlaps:
        raise Unpredictable(f"{overlaps}; expected each place to belong to one body")
    plan: list[PlanCandidate] = []
    refused: list[str] = []
    bounds: dict[str, Interval | Disc] = {}
    kind = _kind(permittivity)
    for candidate in _ordered(scene, width, model):
        reason = candidate.passed_over or _idle(candidate, bounds, width)
        if not reason:
            reason = _unfit(candidate, scene, kind)
            refused += [f"{candidate.model}: {reason}"] if reason else []
        if reason:
            plan.append(replace(candidate, passed_over=reason))
            continue
        try:
            bound, seconds = _timed(candidate.model, kind, scene, permittivity, width)
        except Unsolved as error:  # the others answer as well as they can
            refused.append(f"{candidate.model}: {error}")
            plan.append(replace(candidate, passed_over=str(error)))
            continue
        bounds[candidate.model] = bound
        _refuse_contradiction(bounds)
        plan.append(replace(candidate, width=bound.width(), seconds=seconds))
    if not bounds:
        raise Unpredictable(_together(refused))
    best = min(bounds, key=lambda name: bounds[name].width())
    real, loss = _parts(bounds[best])
    return Answer(best, real, tuple(refused), width, tuple(plan), loss_f=loss)


def _together(refused: Sequence[str]) -> str:
    """Refusals of models, each reason once."""
    names = by_key((reason, name) for name, _, reason in (line.partition(": ") for line in refused))
    return "; ".join(f"{', '.join(those)}: {reason}" for reason, those in names.items())


def _kind(permittivity: Mapping[str, complex]) -> str:
    """The function of a model for these permittivities."""
    return _LOSSY if any(isinstance(value, complex) for value in permittivity.values()) else _LOSSLESS


def _parts(bound: Interval | Disc) -> tuple[Interval, Interval | None]:
    """Bounds of a capacitance, and those of what it loses."""
    if isinstance(bound, Interval):
        return bound, None
    real, loss = bound.centre.real, -bound.centre.imag
    return Interval(real - bound.radius, real + bound.radius), Interval(loss - bound.radius, loss + bound.radius)


def _refuse_contradiction(bounds: Mapping[str, Interval | Disc]) -> None:
    """All of them hold the truth: any two overlap."""
    for part in zip(*(_parts(bound) for bound in bounds.values()), strict=True):
        named = [(name, bound) for name, bound in zip(bounds, part, strict=True) if bound]
        if not named:
            continue
        highest, low = max(named, key=lambda each: each[1].lower)
        lowest, high = min(named, key=lambda each: each[1].upper)
        if low.lower > high.upper * (1 + _EXACT):
            raise Contradiction(
                f"{highest} says at least {low.lower:.9g} F, {lowest} at most {high.upper:.9g} F: one of them fails on "
                "this scene; report it, and use neither"
            )


def _idle(candidate: PlanCandidate, bounds: Mapping[str, Interval | Disc], width: float) -> str:
    """Why a model that applies is not needed."""
    best = min((bound.width() for bound in bounds.values()), default=inf)
    if bounds and best <= width:
        return "not needed"
    return f"not expected to come nearer than {candidate.reach():.2g}" if candidate.reach() >= best else ""


def _timed(
    name: str, kind: str, scene: Scene, permittivity: Mapping[str, complex], width: float
) -> tuple[Interval | Disc, float]:
    """A model's bounds, or its disc, and how long they took once the model is loaded [s]."""
    model = capacitance_models()[name]
    given = (model.WIDTH if width == inf else width,) if hasattr(model, "WIDTH") else ()
    start = time.perf_counter()
    bound: Interval | Disc = getattr(model, kind)(scene, permittivity, *given)
    return bound, time.perf_counter() - start


def _question(scene: Scene, permittivity: Mapping[str, complex], width: float, model: str) -> dict[str, Any]:
    """Everything that decides an answer: the scene's content, materials, and what is wanted."""
    look = [(body.name, body.material, body.terminal, [content(p) for p in body.pieces]) for body in scene.bodies]
    return {
        "what": "capacitance",
        "scene": sha256(dumps([look, scene.size_mm]).encode()).hexdigest(),
        "permittivity": {name: [v.real, v.imag] if isinstance(v, complex) else v for name, v in permittivity.items()},
        "width": width if width < inf else None,
        "model": model,
    }


def is_plate(answer: Answer, scene: Scene) -> bool:
    """True of a solid plate, its electrodes flat or with cogs: no air in its cell.

    Where nothing stands between flat electrodes, all of a layer is air.
    """
    from sensorgen.scene.layers import is_solid

    widths = [c.width for c in answer.plan if c.model == answer.model and c.width is not None]
    if min(widths, default=answer.capacitance_f.width()) >= _EXACT:
        return is_solid(scene)
    from sensorgen.models import porous

    filling = porous.filling(scene, dict.fromkeys((body.material for body in scene.bodies), 1.0))
    return filling is not None and filling.share > 1 - _SOLID
