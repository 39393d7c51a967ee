"""The cheapest model that can speak of a design, for each thing that has to be known of it; and the sensor it makes."""

from dataclasses import dataclass
from types import ModuleType

from sensorgen import materials, models, registry
from sensorgen.design import Design
from sensorgen.errors import OutOfRange, SensorgenError, UnknownName
from sensorgen.interval import Interval
from sensorgen.models import compression
from sensorgen.models.compression import Compression
from sensorgen.scene import Scene
from sensorgen.sensor import Sensor
from sensorgen.units import M_PER_MM

TIP_M = 0.01  # thesis, Table C.1: L_press
LAWS = ("unconfined", "bonded")  # of a plate's compression
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


@dataclass(frozen=True)
class Sensed:
    """A design's sensor in numbers, and what they rest on.

    Attributes
    ----------
    sensor : Sensor
        With the capacitance midway between its bounds.
    taken : tuple of Taken
        Material values.
    doubts : tuple of str
        Why its answers are to be taken with care.
    """

    sensor: Sensor
    taken: tuple[Taken, ...]
    doubts: tuple[str, ...]


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


def sensor_of(design: Design, law: str = "", tip_m: float = TIP_M) -> Sensed:
    """The sensor that a design makes, for the line and all that rests on it.

    Parameters
    ----------
    design : Design
        As drawn.
    law : str
        Of compression: one of ``LAWS``, or "" for the best that is known.
    tip_m : float
        Length of the tip along the sensor [m].

    Raises
    ------
    Unpredictable, MissingValue
        As :func:`unloaded`.
    UnknownName, OutOfRange
        No such law; or a law that does not speak of this shape.
    """
    found, p = unloaded(design), design.params
    how, moduli, doubts = _compression(design, found.answer, law)
    sensor = Sensor(
        length_m=p.length_mm * M_PER_MM,
        width_m=p.width_mm * M_PER_MM,
        electrode_m=(p.electrode_mm * M_PER_MM,) * 2,
        resistivity_ohm_m=found.resistivity_ohm_m,
        capacitance_f_per_m=found.answer.capacitance_f.middle() / (p.length_mm * M_PER_MM),
        compression=how,
        tip_m=tip_m,
    )
    return Sensed(sensor, (*found.taken, *moduli), doubts)


def is_plate(answer: Answer) -> bool:
    """Whether a capacitance is that of a solid plate, which has no other bounds than itself."""
    return answer.capacitance_f.width() < _EXACT


def _compression(design: Design, answer: Answer, law: str) -> tuple[Compression, tuple[Taken, ...], tuple[str, ...]]:
    """The law of compression, the moduli that it rests on, and what to doubt about it."""
    if law not in ("", *LAWS):
        raise UnknownName("law of compression", law, LAWS)
    moduli = {t.material: t for t in _moduli(design)}
    film = moduli[design.materials.dielectric.partition("@")[0]]
    solved = compression.solved(design.shape, vars(design.params), {n: t.value for n, t in moduli.items()})
    if solved and not law:
        return solved, tuple(moduli.values()), ()
    if law == "bonded":
        if not is_plate(answer):
            raise OutOfRange(
                f"the law 'bonded' speaks of a solid plate; {design.shape} has gaps: expected 'unconfined'"
            )
        return compression.bonded(film.value, design.params.width_mm * M_PER_MM, _gap_m(design)), (film,), ()
    doubt = "a plate free to give way sideways: bonded to its electrodes it would be stiffer"
    if not is_plate(answer):
        doubt = (
            f"{design.shape} taken to give way as a free solid plate of {film.material} (B.49): its cell was not solved"
        )
    return compression.unconfined(film.value), (film,), (doubt,)


def _gap_m(design: Design) -> float:
    """Distance of the electrodes of a plate [m]."""
    spans = {
        end: [p.span("z") for b in design.in_use.bodies if b.terminal == end for p in b.prisms]
        for end in ("top", "bottom")
    }
    return (min(low for low, _ in spans["top"]) - max(high for _, high in spans["bottom"])) * M_PER_MM


def _permittivities(design: Design) -> list[Taken]:
    """Relative permittivity of every dielectric in the sensor, and of air."""
    used = design.used() | {"air": ""}
    names = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return [_take(materials.load(name), used[name], "relative_permittivity") for name in sorted(names)]


def _moduli(design: Design) -> list[Taken]:
    """Young's modulus of every material in the sensor."""
    used, names = design.used(), {body.material for body in design.in_use.bodies}
    return [_take(materials.load(name), used[name], "youngs_modulus_pa") for name in sorted(names)]


def _take(material: materials.Material, source: str, quantity: str) -> Taken:
    value = material.value(quantity, source)
    return Taken(material.name, quantity, value.value, value.source)
