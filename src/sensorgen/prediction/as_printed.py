"""Capacitance and electrode resistance of a design as printed, beside the same as drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil

import numpy as np

from sensorgen.asprinted.beads import Beads
from sensorgen.asprinted.printed import Printed, drawn_gap_mm
from sensorgen.asprinted.rectilinear import plate
from sensorgen.checks.volumes import Row
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities, resistivities
from sensorgen.models import traxels
from sensorgen.models.sensor import UNIFORM
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction import sensor_of_design as sensing
from sensorgen.prediction.capacitance import Unloaded, Unpredictable
from sensorgen.prediction.compression_law import Law
from sensorgen.prediction.mesh_ladder import Piece, drawn
from sensorgen.prediction.sensor_of_design import Sensed
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import sections
from sensorgen.solvers.network.lines import Lines

ACCURACY = 0.02  # of the capacitance: the conventions for a line's width differ by more
CONTACTS_OHM_M2 = (0.0, 1e-6, 1e-5, 1e-4)  # no source gives the contact resistivity of printed eTPU
DEGREES = 45.0  # direction of PrusaSlicer's infill in our profiles, turned by 90 from layer to layer
_CLAMP_LINES = 2.6  # the contacts hold what lies nearer to an end than this many lines: walls and turns of infill
_JOINED_MM = 1e-4
_SOLID = "electrodes as solid plates: the contacts between printed lines add to their resistance"
_LOSSES = "losses of the cell as drawn"


@dataclass(frozen=True)
class Range:
    """An interval and its middle."""

    lower: float
    middle: float
    upper: float


@dataclass(frozen=True)
class Gap:
    """Electrode gap as drawn, and the smallest and largest as printed [mm]."""

    drawn: float
    printed: tuple[float, float]


@dataclass(frozen=True)
class Capacitance:
    """Capacitance as drawn, as printed, and by convention for a line's width [F]; a reason where there is none."""

    drawn: Range | str
    printed: Range | None
    by_width: Mapping[str, Range | str]


@dataclass(frozen=True)
class Resistance:
    """Of each electrode, end to end: as drawn, and as printed by contact resistivity [ohm]; or why there is none."""

    drawn: Mapping[str, float] | None
    printed: Mapping[str, Sequence[float]] | None
    reason: str = ""


@dataclass(frozen=True)
class Comparison:
    """A design as drawn and as printed.

    Attributes
    ----------
    design, design_id : str
        Its name and hash.
    source : str
        Provenance of the print.
    estimate : bool
        Whether no slicer was asked.
    electrode_gap_mm, capacitance_f, electrode_resistance_ohm : Gap, Capacitance, Resistance
        Drawn and printed.
    contact_ohm_m2 : tuple of float
        Contact resistivities of the resistances [ohm m2].
    layers : tuple of Row
        Printed and drawn volume per body and layer.
    findings : tuple of Finding
        Rule 7.
    """

    design: str
    design_id: str
    source: str
    estimate: bool
    electrode_gap_mm: Gap
    capacitance_f: Capacitance
    electrode_resistance_ohm: Resistance
    contact_ohm_m2: tuple[float, ...]
    layers: tuple[Row, ...]
    findings: tuple[Finding, ...]

    def as_dict(self) -> dict[str, object]:
        """Plain data, for JSON: lengths in mm, all else in SI units."""
        rows, found = ([each.as_dict() for each in many] for many in (self.layers, self.findings))
        return asdict(self) | {"layers": rows, "findings": found}


def comparison(
    printed: Printed, accuracy: float = ACCURACY, contacts_ohm_m2: Sequence[float] = CONTACTS_OHM_M2
) -> Comparison:
    """Electrode gap, capacitance, electrode resistance and rule 7 of a design as drawn and as printed.

    Parameters
    ----------
    printed : Printed
        What is printed of it.
    accuracy : float
        How wide the bounds of a capacitance may be, relative to their middle [-].
    contacts_ohm_m2 : sequence of float
        Contact resistivities between lines [ohm m2].
    """
    design = printed.design
    by_width = capacitances_f(printed, accuracy)
    span = _span(by_width)
    capacitance = Capacitance(
        _range(_capacitance_f(design, design.in_use, accuracy)), span and _range(span),
        {name: _range(c) for name, c in by_width.items()},
    )  # fmt: skip
    try:
        resistance = Resistance(solid_ohm(design), resistance_ohm(printed, contacts_ohm_m2))
    except SensorgenError as error:
        resistance = Resistance(None, None, str(error))
    return Comparison(
        design.name, design.id(), printed.provenance, printed.lines is None,
        Gap(drawn_gap_mm(design), printed.gap_mm), capacitance, resistance, tuple(contacts_ohm_m2),
        tuple(printed.rows()), tuple(printed.findings()),
    )  # fmt: skip


def capacitances_f(printed: Printed, accuracy: float = ACCURACY) -> dict[str, Interval | str]:
    """Capacitance of the whole sensor by convention [F]; a reason where no model applies.

    Parameters
    ----------
    printed : Printed
        What is printed of a design.
    accuracy : float
        How wide the bounds may be, relative to their middle [-].
    """
    found: dict[str, Interval | str] = {}
    for name, cell in printed.cells.items():
        one = _capacitance_f(printed.design, cell.scene, accuracy)
        # Of a print that has shrunk back, as many cells make the sensor.
        found[name] = one if isinstance(one, str) else one.times(cell.count)
    return found


def _capacitance_f(design: Design, scene: Scene, accuracy: float) -> Interval | str:
    permittivity = {value.material: value.value for value in permittivities(design)}
    try:
        return planner.capacitance(scene, permittivity, accuracy).capacitance_f
    except Unpredictable as error:
        return str(error)


def _span(found: Mapping[str, Interval | str]) -> Interval | None:
    known = [c for c in found.values() if isinstance(c, Interval)]
    return Interval(min(c.lower for c in known), max(c.upper for c in known)) if known else None


def _range(found: Interval | str) -> Range | str:
    return found if isinstance(found, str) else Range(found.lower, found.middle(), found.upper)


def resistance_ohm(printed: Printed, contacts_ohm_m2: Sequence[float] = CONTACTS_OHM_M2) -> dict[str, list[float]]:
    """Resistance of each electrode from end to end, one for each contact resistivity [ohm].

    Parameters
    ----------
    printed : Printed
        What is printed; without lines, a plate of walls and infill as PrusaSlicer would lay them.
    contacts_ohm_m2 : sequence of float
        Contact resistivities between lines [ohm m2].

    Raises
    ------
    OutOfRange
        The sensor is too short for its contacts, or no line prints an electrode.
    MissingValue
        No source gives a resistivity.
    """
    design = printed.design
    length, width, _ = design.printed.size_mm
    clamp = _CLAMP_LINES * design.machine.line_mm()
    if length <= 4 * clamp:
        raise OutOfRange(f"an electrode of {length:g} mm; expected more than {4 * clamp:g} mm to tell its resistance")
    area, reach = design.params.electrode_mm * width * M_PER_MM**2, (length / 2 - clamp) * M_PER_MM
    rho, found = resistivities(design), {}
    for end, solid in solid_ohm(design).items():
        lines = _estimated_lines(design) if printed.lines is None else electrode(design, printed.lines, end)
        found[end] = [
            solid * traxels.resistance(lines, rho[end].value, contact, (-reach, reach), area).ratio
            for contact in contacts_ohm_m2
        ]
    return found


def solid_ohm(design: Design) -> dict[str, float]:
    """Of each electrode rho L / (H W) of its plate alone [ohm]."""
    p = design.params
    per_rho = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    return {end: rho.value * per_rho for end, rho in resistivities(design).items()}


def _estimated_lines(design: Design) -> Lines:
    length, width, _ = design.printed.size_mm
    count = max(ceil(design.params.electrode_mm / design.layers.layer_mm - 1e-9), 1)
    height = design.params.electrode_mm / count
    line = width / round(width / design.machine.line_mm())
    return plate(length, width, line, height, [DEGREES + 90 * (k % 2) for k in range(count)])


def electrode(design: Design, lines: Beads, end: str) -> Lines:
    """The lines of one electrode, its middle at the origin.

    Parameters
    ----------
    design : Design
        As drawn.
    lines : Beads
        Of the whole sensor.
    end : str
        "top" or "bottom".

    Raises
    ------
    OutOfRange
        None of it is printed.
    """
    mine = [k for k, body in enumerate(design.printed.bodies) if body.terminal == end]
    found = lines.of(np.isin(lines.body, mine))
    if not len(found.number):
        raise OutOfRange(f"no line prints the {end} electrode")
    middle = np.array(design.printed.size_mm[:2]) / 2
    start, stop = ((p - middle) * M_PER_MM for p in (found.start_mm, found.end_mm))
    meets = np.append(False, (np.abs(start[1:] - stop[:-1]) < _JOINED_MM * M_PER_MM).all(1))
    meets[1:] &= found.layer[1:] == found.layer[:-1]
    return Lines(start, stop, found.width_mm * M_PER_MM, found.height_mm * M_PER_MM, found.layer, meets)


def piece(printed: Printed) -> Piece:
    """One period of a print, by the first convention for a line's width."""
    scene = printed.cell.scene
    if drawn(printed.design).period_mm is None:
        return Piece(scene, None)
    return Piece(scene, scene.size_mm["xy".index(sections(scene)[0].across)])


def width_by(printed: Printed) -> str:
    """Provenance of a print, and how wide its lines are where it is pressed."""
    return f"{printed.provenance}, lines by {next(iter(printed.layers))}"


def unloaded(printed: Printed, accuracy: float = ACCURACY) -> Unloaded:
    """A print at rest; its capacitance between all conventions.

    Parameters
    ----------
    printed : Printed
        What is printed of a design.
    accuracy : float
        How wide the bounds by one convention may be, relative to their middle [-].

    Raises
    ------
    Unpredictable
        No model applies to what is printed, or to what is drawn.
    """
    found = capacitances_f(printed, accuracy)
    span = _span(found)
    if span is None:
        raise Unpredictable(f"as printed: {next(iter(found.values()))}")
    said = f"printed, lines by {', '.join(found)}"
    return replace(planner.unloaded(printed.design), answer=planner.Answer(said, span, (), wanted=accuracy))


def sensor_of(
    printed: Printed, law: str | Law = "", tip_m: float = sensing.TIP_M, *,
    profile: str = UNIFORM, radius_m: float | None = None, known: Unloaded | None = None,
) -> Sensed:  # fmt: skip
    """The sensor that is printed.

    Parameters
    ----------
    printed : Printed
        What is printed of a design.
    law, tip_m, profile, radius_m : str or Law, float, str, float
        As of :func:`sensorgen.prediction.sensor_of_design.sensor_of`; lengths in [m].
    known : Unloaded
        As of :func:`unloaded`, if it is at hand.

    Raises
    ------
    Unpredictable
        As :func:`unloaded`.
    MissingValue, UnknownName, OutOfRange
        As :func:`sensorgen.prediction.sensor_of_design.sensor_of`.
    """
    found = sensing.sensor_of(
        printed.design, law, tip_m, profile=profile, radius_m=radius_m, known=known or unloaded(printed),
        printed=piece(printed),
    )  # fmt: skip
    return replace(found, caveats=(width_by(printed), _SOLID, *([_LOSSES] if found.lost.taken else [])))
