"""The cheapest model that can speak of a design, for each thing that has to be known of it before it is pressed."""

from dataclasses import dataclass
from types import ModuleType

from sensorgen import materials, models, registry
from sensorgen.design import Design
from sensorgen.errors import SensorgenError
from sensorgen.interval import Interval
from sensorgen.scene import Scene

_EXACT = 1e-9  # relative width of a capacitance's bounds below which the scene is a plate


class Unpredictable(SensorgenError):
    """No model can speak of the scene; the message holds what each one said."""


@dataclass(frozen=True)
class Answer:
    """A model's capacitance, and what the models before it refused.

    Attributes
    ----------
    model : str
        Name of the model.
    capacitance_f : Interval
        Of the whole sensor [F].
    refused : tuple of str
        Why other models were passed over.
    """

    model: str
    capacitance_f: Interval
    refused: tuple[str, ...]


@dataclass(frozen=True)
class Taken:
    """A material value that a prediction rests on."""

    material: str
    quantity: str
    value: float
    source: str


@dataclass(frozen=True)
class Unloaded:
    """What is known of a design before anything presses on it.

    Attributes
    ----------
    answer : Answer
        Its capacitance.
    resistivity_ohm_m : (float, float)
        Of the top and the bottom electrode [ohm m].
    taken : tuple of Taken
        Material values that both rest on.
    """

    answer: Answer
    resistivity_ohm_m: tuple[float, float]
    taken: tuple[Taken, ...]


def capacitance(scene: Scene, permittivity: dict[str, float], width: float = float("inf")) -> Answer:
    """Ask the models, cheapest first, for the capacitance of a scene.

    Parameters
    ----------
    scene : Scene
        As drawn.
    permittivity : dict of str to float
        Relative permittivity of each dielectric, and of "air" [-].
    width : float
        How wide the interval may be, relative to its middle; the narrowest one where none is that narrow [-].

    Raises
    ------
    Unpredictable
        No model can speak of the scene.
    """
    refused: list[str] = []
    answers: list[tuple[Interval, str]] = []
    for name, model in _capacitance_models():
        reason = model.unfit(scene)
        if reason:
            refused.append(f"{name}: {reason}")
            continue
        answers.append((model.capacitance(scene, permittivity), name))
        if answers[-1][0].width() <= width:
            break
    if not answers:
        raise Unpredictable("; ".join(refused))
    best, name = min(answers, key=lambda answer: answer[0].width())
    return Answer(name, best, tuple(refused))


def _capacitance_models() -> list[tuple[str, ModuleType]]:
    loaded = [(name, registry.load(models, name)) for name in registry.names(models)]
    return sorted(((n, m) for n, m in loaded if hasattr(m, "capacitance")), key=lambda pair: pair[1].COST)


def unloaded(design: Design) -> Unloaded:
    """Capacitance and resistivities of a design, its support gone.

    Raises
    ------
    Unpredictable
        No model can speak of the scene, as of a short.
    MissingValue
        No source gives a material value that is needed.
    """
    permittivities = _permittivities(design)
    answer = capacitance(design.in_use, {t.material: t.value for t in permittivities})
    top, bottom = (_take(*design.slot(f"{end}_electrode"), "resistivity_ohm_m") for end in ("top", "bottom"))
    return Unloaded(answer, (top.value, bottom.value), (*permittivities, top, bottom))


def is_plate(answer: Answer) -> bool:
    """Whether a capacitance is that of a solid plate, which has no other bounds than itself."""
    return answer.capacitance_f.width() < _EXACT


def _permittivities(design: Design) -> list[Taken]:
    """Relative permittivity of every dielectric in the sensor, and of air."""
    used = design.used() | {"air": ""}
    names = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return [_take(materials.load(name), used[name], "relative_permittivity") for name in sorted(names)]


def _take(material: materials.Material, source: str, quantity: str) -> Taken:
    value = material.value(quantity, source)
    return Taken(material.name, quantity, value.value, value.source)
