"""The sensor that a design makes, in the numbers that the line and all that rests on it need."""

from dataclasses import dataclass
from math import inf

from sensorgen.celllaw import Law, law_of
from sensorgen.design import Design
from sensorgen.losses import Lost, lost
from sensorgen.planner import Taken, Unloaded, unloaded
from sensorgen.sensor import UNIFORM, Sensor
from sensorgen.units import M_PER_MM

TIP_M = 0.01  # thesis, Table C.1: L_press


@dataclass(frozen=True)
class Sensed:
    """A design's sensor in numbers, and what they rest on.

    Attributes
    ----------
    sensor : Sensor
        With the capacitance midway between its bounds.
    unloaded : Unloaded
        Capacitance with its bounds, and resistivities.
    law : Law
        How it gives way, and how surely.
    lost : Lost
        What its dielectrics lose, as far as the design sets it.
    """

    sensor: Sensor
    unloaded: Unloaded
    law: Law
    lost: Lost

    @property
    def taken(self) -> tuple[Taken, ...]:
        """Material values."""
        return (*self.unloaded.taken, *self.lost.taken, *self.law.taken)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why its answers are to be taken with care."""
        return (*self.law.doubts, *self.lost.doubts)


def sensor_of(
    design: Design, law: str = "", tip_m: float = TIP_M, *, profile: str = UNIFORM, accuracy: float = inf,
    known: Unloaded | None = None,
) -> Sensed:  # fmt: skip
    """The sensor that a design makes, for the line and all that rests on it.

    Parameters
    ----------
    design : Design
        As drawn.
    law : str
        Of compression: one of :data:`sensorgen.celllaw.LAWS`, or "" for the best that is known.
    tip_m : float
        Length of the tip along the sensor [m].
    profile : str
        How its pressure is spread: one of :data:`sensorgen.models.pressure.PROFILES`.
    accuracy : float
        Wanted of the capacitance, relative [-]; where one is, a cell that is not known is solved too.
    known : Unloaded
        What :func:`sensorgen.planner.unloaded` says to that accuracy, if it is at hand.

    Raises
    ------
    Unpredictable, MissingValue
        As :func:`sensorgen.planner.unloaded`.
    UnknownName, OutOfRange
        As :func:`sensorgen.celllaw.law_of`.
    """
    found, p = known or unloaded(design, accuracy), design.params
    gone = lost(design)
    how = law_of(design, found.answer, law, solve=accuracy < inf)
    sensor = Sensor(
        length_m=p.length_mm * M_PER_MM,
        width_m=p.width_mm * M_PER_MM,
        electrode_m=(p.electrode_mm * M_PER_MM,) * 2,
        resistivity_ohm_m=found.resistivity_ohm_m,
        capacitance_f_per_m=found.answer.capacitance_f.middle() / (p.length_mm * M_PER_MM),
        compression=how.compression,
        tip_m=tip_m,
        profile=profile,
        tan_delta=gone.tan_delta,
        leak_s_per_m=gone.leak_s / (p.length_mm * M_PER_MM),
    )
    return Sensed(sensor, found, how, gone)
