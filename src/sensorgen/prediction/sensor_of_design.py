"""The sensor that a design makes, in the numbers that the line and all that rests on it need."""

from dataclasses import dataclass
from math import inf

from sensorgen.core.errors import BadInput
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue, film, of_all_materials, piezoresistance
from sensorgen.models import pressure
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.capacitance import Unloaded, unloaded
from sensorgen.prediction.compression_law import Law, gap_m, law_of
from sensorgen.prediction.losses import Lost, lost
from sensorgen.prediction.mesh_ladder import Piece, drawn

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
    piece : Piece
        What of it is pressed: as drawn, or as printed.
    piezoresistance : tuple of MaterialValue
        How its electrodes' resistivity moves with pressure; empty where nobody says.
    caveats : tuple of str
        What else to know of it.
    """

    sensor: Sensor
    unloaded: Unloaded
    law: Law
    lost: Lost
    piece: Piece
    piezoresistance: tuple[MaterialValue, ...] = ()
    caveats: tuple[str, ...] = ()

    @property
    def taken(self) -> tuple[MaterialValue, ...]:
        """Material values."""
        return (*self.unloaded.taken, *self.piezoresistance, *self.lost.taken, *self.law.taken)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why its answers are to be taken with care."""
        return (*self.caveats, *self.law.doubts, *self.lost.doubts)


def sensor_of(
    design: Design, law: str | Law = "", tip_m: float = TIP_M, *, profile: str = UNIFORM, radius_m: float | None = None,
    accuracy: float = inf, known: Unloaded | None = None, printed: Piece | None = None,
) -> Sensed:  # fmt: skip
    """The sensor that a design makes, for the line and all that rests on it.

    Parameters
    ----------
    design : Design
        As drawn.
    law : str or Law
        Of compression: one of :data:`sensorgen.prediction.compression_law.LAWS`, or "" for the best that is known at
        once; or itself.
    tip_m : float
        Length of the tip along the sensor [m].
    profile : str
        How its pressure is spread: one of :data:`sensorgen.models.pressure.PROFILES`.
    radius_m : float, optional
        Of a hard round tip, whose contact grows with the force up to ``tip_m``; all of it touches if not given [m].
    accuracy : float
        Wanted of the capacitance, relative [-].
    known : Unloaded
        What :func:`sensorgen.prediction.capacitance.unloaded` says to that accuracy, if it is at hand.
    printed : Piece
        What is printed of it, where that is pressed and not the drawing.

    Raises
    ------
    Unpredictable, MissingValue
        As :func:`sensorgen.prediction.capacitance.unloaded`.
    UnknownName, OutOfRange
        As :func:`sensorgen.prediction.compression_law.law_of`; a radius that is not above 0.
    BadInput
        A radius of a flat tip.
    """
    found, p = known or unloaded(design, accuracy), design.params
    gone, rises = lost(design), piezoresistance(design)
    how = law if isinstance(law, Law) else law_of(design, found.answer, law, printed=printed)
    piece = printed or drawn(design)
    sensor = Sensor(
        length_m=p.length_mm * M_PER_MM,
        width_m=p.width_mm * M_PER_MM,
        electrode_m=(p.electrode_mm * M_PER_MM,) * 2,
        resistivity_ohm_m=found.resistivity_ohm_m,
        capacitance_f_per_m=found.answer.capacitance_f.middle() / (p.length_mm * M_PER_MM),
        compression=how.compression,
        tip_m=tip_m,
        profile=profile,
        contact=None if radius_m is None else _contact(design, how, piece, profile, radius_m),
        tan_delta=gone.tan_delta,
        leak_s_per_m=gone.leak_s / (p.length_mm * M_PER_MM),
        piezoresistance_per_pa=(_of("top", rises), _of("bottom", rises)),
    )
    return Sensed(sensor, found, how, gone, piece, tuple(rises.values()))


def _of(end: str, rises: dict[str, MaterialValue]) -> float:
    return rises[end].value if end in rises else 0.0


def _contact(design: Design, how: Law, piece: Piece, profile: str, radius_m: float) -> pressure.Contact:
    """How a round tip's contact grows: on the film as a thick body, or on the cell as a bed of springs."""
    if profile == "hertz":
        soft = film(design)
        modulus, ratio = (of_all_materials(design, key)[soft].value for key in ("youngs_modulus_pa", "poisson_ratio"))
        return pressure.hertz(radius_m, modulus / (1 - ratio**2))
    if profile == "parabola":
        return pressure.bed(radius_m, how.compression.bed_pa_per_m(gap_m(piece.scene)))
    raise BadInput(
        f"a tip with a pressure like a {profile!r} one is flat and has no radius; expected hertz or parabola"
    )
