"""The sensor that a design makes, in the numbers that the line and all that rests on it need."""

from dataclasses import dataclass

from sensorgen.design import Design
from sensorgen.errors import OutOfRange, UnknownName
from sensorgen.models import compression
from sensorgen.models.compression import Compression
from sensorgen.planner import Answer, Taken, is_plate, unloaded
from sensorgen.sensor import Sensor
from sensorgen.units import M_PER_MM

TIP_M = 0.01  # thesis, Table C.1: L_press
LAWS = ("unconfined", "bonded")  # of a plate's compression


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
        As :func:`sensorgen.planner.unloaded`.
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


def _moduli(design: Design) -> list[Taken]:
    """Young's modulus of every material in the sensor."""
    used, names = design.used(), sorted({body.material for body in design.in_use.bodies})
    found = [(name, design.material(name).value("youngs_modulus_pa", used[name])) for name in names]
    return [Taken(name, "youngs_modulus_pa", value.value, value.source) for name, value in found]
