"""The line-sensor model of a body: what the line and all that rests on it need, in numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import ENDS, MaterialValue, lead_ranges, of_all_materials, piezoresistance
from sensorgen.design.values import film as film_of
from sensorgen.models import pressure
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.compression_law import Law, gap_m, law_of
from sensorgen.prediction.mesh_ladder import PressedPiece
from sensorgen.prediction.query import FLAT, Tip
from sensorgen.prediction.rest_state import Lost, RestState, lost, rest_state
from sensorgen.scene.sections import square_to
from sensorgen.scene.slabs import is_open

_PEAK = 1.5  # pressure in the middle of a parabola over its mean; of a Hertzian one 4 / pi [-]


@dataclass(frozen=True)
class SensorModel:
    """A body's sensor in numbers, and what they rest on.

    Attributes
    ----------
    body : Body
        Drawn or printed.
    sensor : Sensor
        With the best value of the capacitance.
    rest : RestState
        Capacitance with its range, and resistivities.
    law : Law
        How the cell deforms under pressure, and its error.
    lost : Lost
        Dielectric losses, as far as the design sets them.
    piezoresistance : mapping of str to MaterialValue
        Rise of the electrodes' resistivity with pressure, where a value is known.
    """

    body: Body
    sensor: Sensor
    rest: RestState
    law: Law
    lost: Lost
    piezoresistance: Mapping[str, MaterialValue]

    @property
    def values(self) -> tuple[MaterialValue, ...]:
        """Material values, each once."""
        values = (*self.rest.values, *self.piezoresistance.values(), *self.lost.taken, *self.law.taken)
        return tuple(dict.fromkeys(values))

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why its numbers are to be taken with care."""
        return (*self.rest.doubts, *self.law.doubts, *self.lost.doubts)


def piece(body: Body) -> PressedPiece:
    """Piece of a body to press: its most likely cell, and the period of the pattern."""
    return PressedPiece(body.cells.first(), body.cells.period_mm)


def pressure_pa(body: Body, tip: Tip, force_n: float) -> float:
    """Largest pressure under a tip, a round one all touching [Pa]."""
    area_m2 = tip.length_m * body.design.params.width_mm * M_PER_MM
    return force_n / area_m2 * (1.0 if tip.profile == "uniform" else _PEAK)


def build_sensor(
    body: Body, law: str | Law = "", tip: Tip = FLAT, *, rest: RestState | None = None, until_pa: float = 0.0
) -> SensorModel:  # fmt: skip
    """The line-sensor model of a body.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    law : str or Law
        Of compression: one of :data:`sensorgen.prediction.query.LAWS`, or "" for the best that is known
        without solving a field; or itself.
    tip : Tip
        What presses.
    rest : RestState, optional
        What :func:`sensorgen.prediction.rest_state.rest_state` says, if it is at hand.
    until_pa : float
        Pressure up to which the law is wanted, if more than usual [Pa].

    Raises
    ------
    Unpredictable, MissingValue
        As :func:`sensorgen.prediction.rest_state.rest_state`.
    UnknownName, OutOfRange
        As :func:`sensorgen.prediction.compression_law.law_of`; a radius that is not above 0.
    BadInput
        A radius of a flat tip.
    """
    rest = rest or rest_state(body)
    if reason := _no_line(body, rest):
        raise OutOfRange(reason)
    p, gone, rises = body.design.params, lost(body.design), piezoresistance(body.design)
    (lead_f, *_), (lead_ohm, *_) = lead_ranges(body.design)
    pressed = piece(body)
    if not isinstance(law, Law):
        printed = None if body.is_drawn else pressed
        law = law_of(body.design, rest.answer, law, printed=printed, tip=tip, until_pa=until_pa)
    sensor = Sensor(
        length_m=p.length_mm * M_PER_MM,
        width_m=p.width_mm * M_PER_MM,
        electrode_m=_thickness_m(body, rest),
        resistivity_ohm_m=rest.resistivity_ohm_m,
        capacitance_f_per_m=rest.capacitance.value / (p.length_mm * M_PER_MM),
        compression=law.compression,
        tip_m=tip.length_m,
        profile=tip.profile,
        contact=None if tip.radius_m is None else _contact(body, law, pressed, tip.profile, tip.radius_m),
        tan_delta=gone.tan_delta,
        leak_s_per_m=gone.leak_s / (p.length_mm * M_PER_MM),
        piezoresistance_per_pa=tuple(rises[end].value if end in rises else 0.0 for end in ENDS),  # type: ignore[arg-type]
        lead_ohm=lead_ohm,
        lead_f=lead_f,
    )
    return SensorModel(body, sensor, rest, law, gone, rises)


def _no_line(body: Body, rest: RestState) -> str:
    """Why electrodes that do not cover the sensor are no line of equal cells, or ""."""
    scene = body.cells.first()
    if set(rest.resistance) != set(ENDS):
        return "an electrode does not run from end to end: the sensor at rest is predicted, not its response"
    if not is_open(scene):
        return ""
    ends = [replace(scene, bodies=tuple(b for b in scene.bodies if b.terminal == end)) for end in ENDS]
    if all(len(square_to(electrode, "x")) == 1 for electrode in ends):
        return ""
    return "an electrode changes along the sensor: the sensor at rest is predicted, not its response"


def _thickness_m(body: Body, rest: RestState) -> tuple[float, float]:
    """Of plates that have the electrodes' resistance, cogs included [m]."""
    p = body.design.params
    thickness_m = [
        rho * p.length_mm / (p.width_mm * rest.resistance[end].value) if rho else p.electrode_mm * M_PER_MM
        for end, rho in zip(ENDS, rest.resistivity_ohm_m, strict=True)
    ]
    return thickness_m[0], thickness_m[1]


def _contact(body: Body, law: Law, pressed: PressedPiece, profile: str, radius_m: float) -> pressure.RoundContact:
    """Growth of a round tip's contact: on the film as a thick body, or on the cell as a foundation of springs."""
    if profile == "hertz":
        soft = film_of(body.design)
        modulus, ratio = (of_all_materials(body.design, q)[soft].value for q in ("youngs_modulus_pa", "poisson_ratio"))
        return pressure.hertz(radius_m, modulus / (1 - ratio**2))
    if profile == "parabola":
        return pressure.bed(radius_m, law.compression.foundation_stiffness_pa_per_m(gap_m(pressed.scene)))
    raise BadInput(
        f"a tip with a pressure like a {profile!r} one is flat and has no radius; expected hertz or parabola"
    )
