"""Figures of predictions: response to a load and its inverse (thesis Ch. 6), identifiability, sweeps, cells, sheets.

Findings are shown in the section of a sensor.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.plots import pages, static
from sensorgen.analysis.plots.figure import (
    BLUE,
    COLOURS,
    GREY,
    ORANGE,
    Axis,
    Curve,
    Figure,
    Map,
    Panel,
    Values,
    frequency,
    look,
    needed,
    scale,
)
from sensorgen.checks.review import Review
from sensorgen.core.arrays import Complex, Mask, Real, Whole
from sensorgen.core.document import Cell, Table
from sensorgen.core.errors import OutOfRange
from sensorgen.core.lazy import by_key
from sensorgen.core.units import M_PER_MM
from sensorgen.models.sensor import Response, Sensor
from sensorgen.prediction.capacitance_answer import CellCapacitance
from sensorgen.prediction.compression import CompressionResult
from sensorgen.prediction.identifiability.fisher import LeastErrors, Setup, bounds, required, slopes
from sensorgen.prediction.identifiability.identify import surface
from sensorgen.prediction.inverse.verdict import PressAnswers
from sensorgen.prediction.query import FORCE_N, NOISE
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sweep import Sweep

if TYPE_CHECKING:
    from sensorgen.analysis.fit.estimates import Fit
    from sensorgen.solvers.sheet.parts import Port, Sheet
    from sensorgen.solvers.sheet.solve import PressErrors

_SEVERITIES = {"info": BLUE, "warning": ORANGE, "error": "#d1242f"}  # the most severe on top


def findings(review: Review) -> Figure:
    """Edges of the bodies from the side, with the places of findings."""
    curves = [
        Curve("line", name, *_from_side(mesh.vertices_mm[mesh.sharp_edges()]), colour=COLOURS[2:][k % len(COLOURS[2:])])
        for k, (name, mesh) in enumerate(review.meshes.items())
    ]
    panel = Panel((*curves, *_places(review)), Axis("x [mm]"), Axis("z [mm]"))
    alt = "Bodies of the sensor from the side, and where findings are."
    return Figure("findings", f"{review.verdict}: {review.source}", alt, {"": (panel,)})


def _places(review: Review) -> Iterator[Curve]:
    """Places of findings from the side, by severity."""
    for severity, colour in _SEVERITIES.items():
        there = [f for f in review.findings if f.severity == severity and not f.waiver]
        x, z = ([f.place_mm[k] for f in there if f.place_mm] for k in (0, 2))
        text = [f.message for f in there if f.place_mm]
        yield Curve("points", severity, x, z, text=text, colour=colour)


def _from_side(ends_mm: Any) -> tuple[Any, Any]:
    """X and z of edges as one line with gaps."""
    both = ends_mm[:, :, [0, 2]]
    gaps = np.full((len(both), 1, 2), np.nan)
    x, z = np.concatenate([both, gaps], axis=1).reshape(-1, 2).T
    return x, z


def ranges(prediction: Prediction) -> Figure:
    """Range of each quantity over its best value, whole and by each cause."""
    curves = {}
    for name, whole in prediction.quantities().items():
        if whole and 0.0 < whole.value < inf:
            causes = {"model": whole.model, "print": whole.print, "material": whole.material, "leads": whole.leads}
            for k, (cause, part) in enumerate({"all": whole, **causes}.items()):
                if part and part.lower < part.upper:
                    row, ends = f"{name}: {cause}", (part.lower / whole.value, part.upper / whole.value)
                    curves[row] = Curve("points", "", [1.0], [row], [ends[0]], [ends[1]], colour=COLOURS[k])
    panel = Panel(tuple(curves.values()), Axis("relative to the best value", log=True), Axis(names=tuple(curves)))
    alt = "Ranges of the predicted quantities, whole and by model, print, material and leads."
    return Figure("ranges", f"{prediction.design}, {prediction.body}", alt, {"": (panel,)})


def sweep(result: Sweep[Any]) -> Figure:
    """Each number of the results over the first setting, or, under load, over the load; a line for each other value."""
    table, keys = result.table(), len(result.settings()[0])
    x = keys if len(table.cells) > len(result.results) else 0
    panels = tuple(
        _panel(table, x, y, [k for k in range(keys) if k != x])
        for y in range(keys, len(table.columns))
        if y != x and _is_shown(table, y)
    )
    title = ", ".join(table.columns[k].name for k in range(keys))
    return Figure("sweep", f"Along {title}", "Results along settings.", {"": panels}, columns=2)


def _is_shown(table: Table, y: int) -> bool:
    """True for a column of numbers for people, other than times."""
    column = table.columns[y]
    return not column.hidden and column.unit != "s" and any(_is_number(row[y]) for row in table.cells)


def _panel(table: Table, x: int, y: int, others: Sequence[int]) -> Panel:
    """A line for each combination of the other settings; marks alone where the first setting is a name."""
    groups = _grouped(table, y, others)
    column, over = table.columns[y], Axis(table.columns[x].head)
    every = np.array([row[y] for rows in groups.values() for row in rows], float)
    divisor, unit = scale(every, column.unit) if column.unit.startswith("F/") else (1.0, column.unit)
    what = Axis(f"{column.name} [{unit}]" if unit else column.name)
    if _is_number(table.cells[0][x]):
        return Panel(tuple(_lines(table, x, y, groups, divisor)), over, what)
    names = tuple(dict.fromkeys(str(row[x]) for row in table.cells))
    marks = tuple(
        Curve("points", label, [row[y] / divisor for row in rows], [str(row[x]) for row in rows], **look(k))
        for k, (label, rows) in enumerate(groups.items())
    )
    return Panel(marks, what, replace(over, names=names))


def _grouped(table: Table, y: int, others: Sequence[int]) -> dict[str, list[tuple[Any, ...]]]:
    """Rows with a number in a column, by the other settings in words."""
    return by_key(
        (", ".join(f"{table.columns[k].name} {row[k]}" for k in others), row)
        for row in table.cells if _is_number(row[y])
    )  # fmt: skip


def _lines(
    table: Table, x: int, y: int, groups: Mapping[str, Sequence[tuple[Any, ...]]], divisor: float
) -> Iterator[Curve]:
    """Lines with marks, and dotted ends of the ranges where the table has them."""
    head = table.columns[y].name
    ends = [k for k, c in enumerate(table.columns) if c.name in (f"{head}, least", f"{head}, most")]
    for k, (label, rows) in enumerate(groups.items()):
        along = [row[x] for row in rows]
        for column, dash in ((y, "solid"), *((end, "dot") for end in ends)):
            values = [row[column] / divisor for row in rows]
            yield Curve("line", "", along, values, colour=look(k)["colour"], dash=dash)
        yield Curve("points", label, along, [row[y] / divisor for row in rows], **look(k))


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, float | int) and not isinstance(cell, bool)


def compression_figure(result: CompressionResult) -> Figure:
    """Displacement and capacitance of a result over stress."""
    stress, displacement = result.stress_kpa, [d for d in result.displacement_um if d is not None]
    x = Axis("stress [kPa]", low=0.0)
    solved = stress[: len(displacement)]
    curve = (Curve("line", "", solved, displacement), Curve("points", "", solved, displacement))
    panels = [Panel(curve, x, Axis("displacement of the top [µm]", low=0.0))]
    bounds = {"lower bound": (result.lower_f_per_m2, BLUE, "triangle-up"),
              "upper bound": (result.upper_f_per_m2, ORANGE, "triangle-down")}  # fmt: skip
    at = [p for p, value in zip(stress, result.lower_f_per_m2, strict=True) if value is not None]
    if at:
        curves = tuple(
            Curve("points", name, at, [1e9 * c for c in values if c is not None], colour=colour, symbol=symbol)
            for name, (values, colour, symbol) in bounds.items()
        )
        panels.append(Panel(curves, x, Axis("capacitance [nF/m²]")))
    conditions = ", ".join(f"{key} {value}" for key, value in result.held.items())
    alt = "Displacement of the top and capacitance per area over stress."
    return Figure("compression", f"{result.model}: {conditions}", alt, {"": tuple(panels)}, columns=2)


def tried(cell: CellCapacitance) -> Figure:
    """Time and accuracy of the models of a cell: of those that ran, and of others as their benchmarks let expect."""
    curves = []
    for colour, one in zip(COLOURS, cell.plan, strict=False):
        if one.seconds and one.width:
            curves.append(Curve("points", one.model, [one.seconds], [one.width], colour=colour))
        elif one.expected_seconds and one.expected_width:
            x, y = [one.expected_seconds], [one.expected_width]
            curves.append(Curve("points", f"{one.model}, expected", x, y, colour=colour, symbol="circle-open"))
    panel = Panel(tuple(curves), Axis("time [s]", log=True), Axis("width of the bounds, relative", log=True))
    alt = "Time and relative width of the bounds of each model."
    return Figure("models", f"{cell.design}, {cell.body}: by {cell.model}", alt, {"": (panel,)})


def fitted(fit: "Fit") -> Figure:
    """Fitted values with their intervals, relative to the values."""
    names = [f"{v.quantity} of {v.material}: {v.value:.3g}" for v in fit.values]
    low, high = ([getattr(v, end) / v.value for v in fit.values] for end in ("low", "high"))
    panel = Panel((Curve("points", "", [1.0] * len(names), names, low, high),), Axis("times the value", log=True),
                  Axis(names=tuple(names)))  # fmt: skip
    return Figure("values", f"Fitted to {fit.of}", "Values with their intervals.", {"": (panel,)})


_MOST_NAMES = 40  # readings that are numbered each


def presses(of: PressAnswers) -> Figure:
    """Force and position behind readings, with their 90 % intervals."""
    number: Values = np.arange(1.0, len(of.force_n) + 1)
    names = tuple(map(str, range(1, len(of.force_n) + 1))) if len(of.force_n) <= _MOST_NAMES else ()
    panels = tuple(
        Panel(
            (Curve("points", "", values, names or number, ends[:, 0], ends[:, 1]),),
            Axis(name),
            Axis("reading", names=names),
        )
        for name, values, ends in (
            ("force [N]", of.force_n, of.force_90_n),
            ("position [mm]", of.position_m / M_PER_MM, of.position_90_m / M_PER_MM),
        )
    )
    alt = "Force and position of each reading with the ends of their 90 % intervals."
    return Figure("presses", f"{len(number)} readings", alt, {"": panels}, columns=2)


_LEAST = 1 / 30  # of the error without information, at which the colours begin


def sheet(film: "Sheet", bounds: Mapping[str, "PressErrors"], ports: Mapping[str, Sequence["Port"]]) -> Figure:
    """Standard errors of x and y over the sheet, one column per set of contacts.

    The colours end at the error without a reading: of a uniform distribution over the sheet.

    Parameters
    ----------
    film : Sheet
        Under load.
    bounds : mapping of str to PressErrors
        By the name of the set of contacts.
    ports : mapping of str to sequence of Port
        The contacts of each set.
    """
    panels = tuple(_port_panel(film, name, bounds[name], ports[name], row) for row in (0, 1) for name in bounds)
    title = "Standard error of a load's position, outline known; contacts red; scale up to the error without a reading"
    alt = "Standard errors of x above and of y below, over the sheet, one column per set of contacts."
    return Figure("sheet", title, alt, {"": panels}, columns=len(bounds))


def _port_panel(film: "Sheet", name: str, bounds: "PressErrors", ports: Sequence["Port"], row: int) -> Panel:
    none_mm = bounds.guess_m[row] / M_PER_MM
    sigma_mm = bounds.sigma(outline=True)[..., 1 + row].T / M_PER_MM
    shown = np.clip(sigma_mm, none_mm * _LEAST, none_mm)
    drawn = Map(bounds.x_m / M_PER_MM, bounds.y_m / M_PER_MM, shown, f"error of {'xy'[row]} [mm]", none_mm * _LEAST,
                none_mm, log=True)  # fmt: skip
    contacts = []
    for plus, _ in ports:
        (left, right), (front, back) = ((a / M_PER_MM for a in span) for span in (plus.x_m, plus.y_m))
        outline = [left, right, right, left, left], [front, front, back, back, front]
        contacts.append(Curve("line", "", *outline, colour="#ff0000"))
    x, y = (Axis(f"{axis} [mm]", low=0.0, high=size / M_PER_MM)
            for axis, size in (("x", film.length_m), ("y", film.width_m)))  # fmt: skip
    return Panel((drawn, *contacts), x, y, title="" if row else name, equal=True)


FORCES, POSITIONS, FREQUENCIES = 60, 161, 121
HZ_PER_KHZ = 1e3


def identifiability_figure(
    sensor: Sensor, frequency_hz: Sequence[float], noise: float = NOISE, force_n: float = FORCE_N, title: str = ""
) -> Figure:
    """Maps of the standard errors of force and position, and both for a single frequency.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz : sequence of float
        Frequencies [Hz].
    noise : float
        As of :func:`sensorgen.prediction.identifiability.card` [-].
    force_n : float
        Greatest load [N].
    title : str
        Name of the sensor.
    """
    setup = Setup(sensor, tuple(frequency_hz), noise, force_n, sensor.length_m / 2)
    force, place = np.linspace(force_n / FORCES, force_n, FORCES), np.linspace(0.0, sensor.length_m, POSITIONS)
    limits, need = surface(setup, force, place), required(setup)
    panels = (
        _map("force", "N", place, force, limits.force_n, need.force_n),
        _map("position", "mm", place, force, limits.position_m / M_PER_MM, need.position_m / M_PER_MM),
        *_by_frequency(setup),
    )
    words = f"{title}{', ' if title else ''}{len(setup.frequency_hz)} frequencies, noise {noise * 100:g} %"
    alt = (
        "Standard errors of force and position over force and position (Cramér-Rao), and below them the error that one "
        "frequency alone would give. Solid line: the required error; dashed: ten times that."
    )
    return Figure("identifiability", f"Can it sense force and position? {words}", alt, {"": panels}, columns=2)


def _map(quantity: str, unit: str, place: Real, force: Real, sigma: Real, need: float) -> Panel:
    """Standard error on a logarithmic scale about the required one."""
    drawn = Map(place / M_PER_MM, force, sigma, f"standard error of {quantity} [{unit}]", need / 10, need * 1e3,
                log=True, levels=(need, 10 * need))  # fmt: skip
    x, y = Axis("position, centre of the tip [mm]"), Axis("force [N]")
    return Panel((drawn,), x, y, title=f"error of {quantity} (solid line: {need:g} {unit}, as required)")


def _by_frequency(setup: Setup) -> tuple[Panel, Panel]:
    """Standard errors that one frequency alone would give, those in use marked."""
    grid = np.geomspace(min(setup.frequency_hz), setup.highest_hz, FREQUENCIES)
    used = np.array(setup.frequency_hz)
    swept, marked = _single(setup, grid), _single(setup, used)
    corner = setup.sensor.corner_frequency_hz() / HZ_PER_KHZ if setup.sensor.resistance_ohm() else 0.0
    panels = []
    for quantity, unit, colour, pick in (("force", "N", BLUE, "force_n"), ("position", "mm", ORANGE, "position_m")):
        per = M_PER_MM if unit == "mm" else 1.0
        line, dots = getattr(swept, pick) / per, getattr(marked, pick) / per
        finite = line[np.isfinite(line) & (line > 0)]
        low, high = (finite.min() / 3, finite.max() * 3) if len(finite) else (1e-3, 1.0)  # a flat curve looks flat
        content = [
            Curve("line", "", grid / HZ_PER_KHZ, line, colour=colour),
            Curve("points", "", used / HZ_PER_KHZ, dots, colour=colour),
        ]
        if corner:
            content.append(Curve("line", "corner frequency", [corner, corner], [low, high], colour=GREY, dash="dot"))
        y = Axis(f"standard error of {quantity} [{unit}]", log=True, low=float(low), high=float(high))
        words = f"one frequency alone, {setup.force_n:g} N in the middle"
        panels.append(Panel(tuple(content), Axis("frequency [kHz]", log=True), y, title=words))
    return panels[0], panels[1]


def _single(setup: Setup, frequency_hz: Real) -> LeastErrors:
    by_press = slopes(setup.sensor, frequency_hz, setup.force_n, setup.position_m)
    return bounds(type(by_press)(*(slope[:, None] for slope in by_press)), setup.noise)


LARGEST = 500_000  # points that a page in a browser still draws at once
MOST_FREQUENCIES = 24  # panels that a picture still shows
LINES = 7  # of constant force, and of constant position
POSITION, FORCE = Axis("position [mm]"), Axis("force [N]")


@dataclass(frozen=True)
class RealQuantity:
    """A real quantity over force and position."""

    symbol: str
    title: str
    unit: str


QUANTITIES = {
    "resistance": RealQuantity("R", "Resistance R, real part of the impedance", "Ω"),
    "reactance": RealQuantity("X", "Reactance X, imaginary part of the impedance", "Ω"),
    "resistance-by-position": RealQuantity("dR/dx", "Change of resistance per position, dR/dx", "Ω/mm"),
    "resistance-by-force": RealQuantity("dR/dF", "Change of resistance per force, dR/dF", "Ω/N"),
    "reactance-by-position": RealQuantity("dX/dx", "Change of reactance per position, dX/dx", "Ω/mm"),
    "reactance-by-force": RealQuantity("dX/dF", "Change of reactance per force, dX/dF", "Ω/N"),
}


@dataclass(frozen=True)
class ResponseMap:
    """Impedance and its exact slopes; the axes of the arrays are frequency, force and position.

    Attributes
    ----------
    frequency_hz, force_n, position_mm : (n,) array
        Frequencies [Hz], forces [N], centres of the tip [mm].
    response : Response
        Over them.
    sensor : Sensor
        Under load.
    """

    frequency_hz: Real
    force_n: Real
    position_mm: Real
    response: Response
    sensor: Sensor

    def values(self, name: str) -> Real:
        """One of ``QUANTITIES``, over frequency, force and position, in the unit named there."""
        part, _, by = name.partition("-by-")
        z, by_force, by_position = self.response
        source = {"position": by_position * M_PER_MM, "force": by_force}.get(by, z)
        return np.asarray(source.real if part == "resistance" else source.imag)

    def on_sensor(self) -> Mask:
        """Positions where the whole tip rests on the sensor; all, where it does at none."""
        half = self.sensor.tip_m / M_PER_MM / 2 * (1 + 1e-9)  # where the tip just reaches an end, the slopes jump
        inside = (self.position_mm > half) & (self.position_mm < self.sensor.length_m / M_PER_MM - half)
        return inside if inside.any() else ~inside

    def folds(self) -> Mask:
        """Loads beyond which (F, x) -> (R, X) turns over: the sign of its determinant changes towards the next."""
        turning = (np.conj(self.response.by_force_ohm_per_n) * self.response.by_position_ohm_per_m).imag
        turning = np.sign(np.where(np.abs(turning) > 1e-12 * np.abs(turning).max(initial=0), turning, 0))
        folded = np.zeros(turning.shape, bool)
        folded[:, :-1] |= turning[:, :-1] * turning[:, 1:] < 0
        folded[:, :, :-1] |= turning[:, :, :-1] * turning[:, :, 1:] < 0
        return folded


def response(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> ResponseMap:
    """Work out what is drawn.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz, force_n, position_mm : sequence of float
        Frequencies [Hz], forces [N] and centres of the tip [mm], each rising.

    Raises
    ------
    OutOfRange
        Too little or too much to draw; a position or a force beyond the sensor's range.
    """
    f, force, at = (np.asarray(values, float) for values in (frequency_hz, force_n, position_mm))
    if min(len(force), len(at)) < 2:
        raise OutOfRange(f"{len(force)} force(s) and {len(at)} position(s) make no map; expected two or more of each")
    if len(f) > MOST_FREQUENCIES or math.prod(map(len, (f, force, at))) > LARGEST:
        raise OutOfRange(
            f"{len(f)} frequencies, {len(force)} forces and {len(at)} positions are too much to draw; "
            f"expected up to {MOST_FREQUENCIES} frequencies and {LARGEST} points in all: use larger steps"
        )
    return ResponseMap(f, force, at, sensor.response(f[:, None, None], force[:, None], at * M_PER_MM), sensor)


def lines(frequency_hz: Sequence[float], force_n: Real, position_mm: Real, impedance_ohm: Complex, name: str) -> Figure:
    """R and X as lines over the longer of force and position, for some values of the other, at two frequencies.

    Parameters
    ----------
    frequency_hz, force_n, position_mm : (f,), (n,), (m,) array
        Axes [Hz], [N], [mm].
    impedance_ohm : (f, n, m) complex array
        Over them [ohm].
    name : str
        Of the design.
    """
    over_force = len(force_n) > len(position_mm)
    x, others, unit = (force_n, position_mm, "mm") if over_force else (position_mm, force_n, "N")
    z = impedance_ohm.swapaxes(1, 2) if over_force else impedance_ohm  # the longer axis last
    panels = []
    for k in sorted({0, len(frequency_hz) - 1}):
        at = frequency(frequency_hz[k])
        for symbol, part in (("R", z[k].real), ("X", z[k].imag)):
            divisor, ohm = scale(part, "Ω")
            curves = tuple(
                Curve(kind, f"{others[j]:g} {unit}" if kind == "line" else "", x, part[j] / divisor, **look(n))
                for n, j in enumerate(_some(others)) for kind in ("line", "points")
            )  # fmt: skip
            panels.append(Panel(curves, FORCE if over_force else POSITION, Axis(f"{symbol} [{ohm}] at {at}")))
    along = "force" if over_force else "position"
    return Figure("response", f"{name} under load", f"R and X over {along}.", {"": tuple(panels)}, columns=2)


def _some(values: Real) -> Whole:
    """Numbers of some values, from the first to the last, for lines of each."""
    return np.unique(np.linspace(0, len(values) - 1, min(LINES, len(values))).round().astype(np.int64))


def quantity(of: ResponseMap, name: str) -> Figure:
    """One of ``QUANTITIES`` over force and position, at each frequency.

    The colours span the positions where the whole tip rests on the sensor, of slopes without the extreme 4 %, mostly
    those of the first touch: they are so large that they would hide all others.
    """
    about, values = QUANTITIES[name], of.values(name)
    loaded = np.ix_(of.force_n >= 0, of.on_sensor())

    def panels(k: int, at: str) -> Iterator[Panel]:
        divisor, unit = scale(values[k][loaded], about.unit)
        shown = values[k] / divisor
        low, high = np.percentile(shown[loaded], (2, 98) if "-by-" in name else (0, 100)).tolist()
        label = f"{about.symbol} [{unit}]"
        plain = Map(of.position_mm, of.force_n, shown, label, low, high)
        content = (replace(plain, levels=_levels(*plain.span)),)
        yield Panel(content, POSITION, FORCE, title=f"{label} at {at}")

    alt = f"{about.title}, over force and position; the colours span positions where the whole tip rests on the sensor."
    return Figure.by_frequency(name, about.title, alt, of.frequency_hz, panels, columns=4)


def _levels(low: float, high: float, count: int = 7) -> tuple[float, ...]:
    """Round numbers strictly between two others."""
    if not high > low:
        return ()
    step = 10.0 ** math.floor(math.log10((high - low) / count))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= count)
    return tuple(k * step for k in range(math.floor(low / step) + 1, math.ceil(high / step)))


def inverse(of: ResponseMap, which: str) -> Figure:
    """Inverse map: "position" or "force" over the plane of R and X, at each frequency (thesis Fig. 6.4).

    The plane is coloured where a load can lie. Where lines of constant force and of constant position run together,
    R and X do not determine both; where the map folds, two loads give the same R and X.
    """
    unit = {"position": "mm", "force": "N"}[which]
    colour = np.broadcast_to(of.position_mm if which == "position" else of.force_n[:, None], of.folds().shape[1:])
    forces, positions = _some(of.force_n), _some(of.position_mm)

    def panels(k: int, at: str) -> Iterator[Panel]:
        r, x = of.values("resistance")[k], of.values("reactance")[k]
        (r_divisor, r_unit), (x_divisor, x_unit) = scale(r, "Ω"), scale(x, "Ω")
        r, x = r / r_divisor, x / x_divisor
        folded = of.folds()[k]
        content: tuple[Curve | Map, ...] = (
            Map(r, x, colour, f"{which} [{unit}]"),
            *(Curve("line", "", r[j], x[j], colour="#000000") for j in forces),
            *(Curve("line", "", r[:, i], x[:, i], colour="#000000", dash="dash") for i in positions),
            *([Curve("points", "", r[folded], x[folded], colour="#ff0000")] if folded.any() else []),
        )
        yield Panel(content, Axis(f"R [{r_unit}]"), Axis(f"X [{x_unit}]"), title=at)

    folds = "; red: folds" if of.folds().any() else ""
    lines = of.force_n[forces], of.position_mm[positions]
    solid, dashed = (", ".join(f"{v:.3g}" for v in values) for values in lines)
    title = f"{which.capitalize()} from R and X\nsolid lines: {solid} N; dashed: {dashed} mm{folds}"
    alt = (
        f"{which.capitalize()} in colours over R and X. Lines of constant force are solid, of constant position dashed."
    )
    return Figure.by_frequency(f"inverse-{which}", title, alt, of.frequency_hz, panels, columns=4)


PAGE = "predict.html"
STEPS = ("identifiability.png", *(f"{name}.png" for name in QUANTITIES), "inverse-position.png", "inverse-force.png",
         PAGE)  # fmt: skip


def figures(of: ResponseMap) -> Iterator[Figure]:
    """All of them: quantities, then the inverse maps."""
    yield from (quantity(of, name) for name in QUANTITIES)
    yield from (inverse(of, which) for which in ("position", "force"))


def files(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float],
    title: str = "",
) -> Iterator[tuple[str, bytes]]:  # fmt: skip
    """All pictures of a sensor under load, by file name, in the order of ``STEPS``.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz, force_n, position_mm : sequence of float
        Frequencies [Hz], forces [N] and centres of the tip [mm], each rising; at least two forces and two positions.
    title : str
        Name of the design.

    Raises
    ------
    OutOfRange
        As :func:`response`.
    MissingValue
        Matplotlib or Plotly is not installed.
    """
    needed("matplotlib", "plotly")
    answer = response(sensor, frequency_hz, force_n, position_mm)
    drawn = [identifiability_figure(sensor, frequency_hz, force_n=force_n[-1], title=title), *figures(answer)]
    for figure in drawn:
        yield f"{figure.key}.png", static.png(figure)
    words = (
        f"{len(frequency_hz)} frequencies, {force_n[0]:g} to {force_n[-1]:g} N, "
        f"{position_mm[0]:g} to {position_mm[-1]:g} mm, tip {sensor.tip_m / M_PER_MM:g} mm."
    )
    sections = [pages.PageSection(figures=tuple(drawn))]
    yield PAGE, pages.page(f"{title or 'Sensor'} under load", [words], sections).encode()
