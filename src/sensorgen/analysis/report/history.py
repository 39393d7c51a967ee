"""History of each specimen: bake, shrinkage and defects beside the change that they made, and its calibrations."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite, nan
from typing import TYPE_CHECKING, Annotated

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.report.alternating import BAKED, F_PER_PF, AcRow, at_text
from sensorgen.core.document import Cell, Column
from sensorgen.core.errors import BadInput
from sensorgen.core.lazy import Lazy, by_key
from sensorgen.measure.log import Calibration as Row
from sensorgen.measure.log import Log

if TYPE_CHECKING:
    from sensorgen.prediction.calibration.calibration import CalibratedValue, Calibration


@dataclass(frozen=True)
class CalibrationRow:
    """The latest calibration of a specimen."""

    specimen: Annotated[str, Column("specimen")]
    design: Annotated[str, Column("design")]
    presses: Annotated[int, Column("known presses")]
    r_ratio: Annotated[Cell, Column("R", "", "over the predicted one")]
    c_ratio: Annotated[Cell, Column("C", "", "over the predicted one")]
    rise_ratio: Annotated[Cell, Column("rise of C at 4 N", "", "over the predicted one")]
    scatter_percent: Annotated[float, Column("scatter of the rise", "%", digits=2)]
    force_covered: Annotated[str, Column("force covered")]
    position_covered: Annotated[str, Column("position covered")]
    force_width_n: Annotated[float | None, Column("width of force", "N", "median of the intervals", digits=3)]
    position_width_mm: Annotated[float | None, Column("width of position", "mm", "median of the intervals", digits=3)]


def latest(log: Log, specimens: Container[str], left_out: list[tuple[str, str]]) -> "list[Calibration]":
    """The latest calibration of each specimen; those that cannot be read go to ``left_out``."""
    rows = {row.specimen: row for row in log.entries(Row) if row.specimen in specimens}
    calibrated = []
    for row in rows.values():
        from sensorgen.prediction.calibration.calibration import from_json

        try:
            calibrated.append(from_json(row.data))
        except BadInput as error:
            left_out.append((f"calibration {row.number}, {row.specimen}", str(error)))
    return calibrated


def _ratios(one: "Calibration") -> "list[tuple[CalibratedValue, float]]":
    """R, C and the rise of C at 4 N, each with its prediction in the same unit."""
    known, sensor = {value.name: value for value in one.values()}, one.model.sensor
    c_pf = sensor.capacitance_f() / F_PER_PF
    predicted = {"resistance": sensor.resistance_ohm(), "capacitance": c_pf, "rise at 4 N": 1.0}
    return [(known[name], value) for name, value in predicted.items()]


def calibration_row(one: "Calibration") -> CalibrationRow:
    """Row of a calibration; of what its readings did not determine there is no ratio."""
    held_out = one.held_out
    r, c, rise = (known.value / value if known.by != "prediction" else None for known, value in _ratios(one))
    return CalibrationRow(
        one.specimen, one.design, one.posterior.presses, r, c, rise, 100 * one.posterior.scatter,
        f"{held_out.force} of {held_out.presses}" if held_out else "",
        f"{held_out.position} of {held_out.presses}" if held_out else "",
        held_out.force_width_n if held_out else None, held_out.position_width_m * 1e3 if held_out else None,
    )  # fmt: skip


def calibration_findings(calibrations: "Sequence[Calibration]") -> Iterator[str]:
    """A sentence for each specimen, of what its readings determine; and what is to be doubted of it."""
    for one in calibrations:
        told = (
            f"{known.name} {known.value / value:.3g} ({known.lower / value:.3g} to {known.upper / value:.3g})"
            for known, value in _ratios(one) if known.by != "prediction"
        )  # fmt: skip
        words = ", ".join(told) or "nothing that these readings determine"
        yield f"{one.specimen} is calibrated by {one.posterior.presses} known presses; over the prediction: {words}."
        yield from (f"{one.specimen}: {note}." for note in one.notes)


_State = tuple[bool | None, str, str]  # bake, defects and remark
_UNTOLD = None, "", ""  # of a reading of which none is known


@dataclass(frozen=True)
class _Before:
    """Last reading of a specimen, or its prediction: name, resistances [ohm], C by frequency in its state [pF]."""

    name: str
    electrode_ohm: float
    film_ohm: float
    c_pf: dict[float, float]
    state: _State | None = None


@dataclass(frozen=True)
class HistoryRow:
    """A reading in a new state of its specimen."""

    number: Annotated[int, Column("reading", "", "number in the log")]
    specimen: Annotated[str, Column("specimen")]
    bake: Annotated[str, Column("bake")]
    shrinkage_percent: Annotated[Cell, Column("shrinkage", "%", "of the bake in the plane, by the design")]
    defects: Annotated[str, Column("defects")]
    remark: Annotated[str, Column("remark")]
    against: Annotated[str, Column("compared with")]
    electrode_change: Annotated[float, Column("electrode resistance changed", "", "ratio")]
    film_change: Annotated[float, Column("film resistance changed", "", "ratio")]
    capacitance_change: Annotated[float, Column("C changed", "", "ratio, at the lowest common frequency")]
    at: Annotated[str, Column("at")]
    expected_change: Annotated[Cell, Column("C expected to change", "", "by the shrinkage")]
    verdict: Annotated[str, Column("verdict")]


def rows(comparison: Comparison, ac: Sequence[AcRow]) -> Lazy[HistoryRow]:
    """A row for each reading of which a bake, shrinkage, a defect or a remark is known and new."""
    measured = by_key((one.number, one) for one in ac)
    shrinkages = {name: body.design.shrinkage for name, body in comparison.bodies.items()}
    listed, before = [], dict[str, _Before]()
    for row in comparison.rows:
        words, ac_here = row.reading.words, measured.get(row.reading.number, ())
        shrinkage = shrinkages.get(comparison.names.get(words.specimen, ""), 0.0)
        was = before.get(words.specimen) or _of_prediction(row, ac_here)
        c_pf = {one.frequency_hz: one.c_pf for one in ac_here}
        state = words.baked, words.defects, words.remark
        earlier = was.c_pf if was.state else {}
        if (state != _UNTOLD or shrinkage) and state != was.state:
            listed.append(partial(_row, row, was, c_pf, shrinkage))
            earlier = {}
        name = f"reading {row.reading.number}"
        before[words.specimen] = _Before(name, row.verdict.ry_ohm, row.verdict.rz_ohm, earlier | c_pf, state)
    return Lazy(lambda k: listed[k](), range(len(listed)))


def _of_prediction(row: Compared, ac: Sequence[AcRow]) -> _Before:
    expected = row.predicted.ry_ohm if row.predicted else None
    c_pf = {one.frequency_hz: float(one.c_predicted_pf or nan) for one in ac}
    return _Before("prediction", expected.value if expected else nan, nan, c_pf)


def _row(row: Compared, was: _Before, c_pf: dict[float, float], shrinkage: float) -> HistoryRow:
    words, now = row.reading.words, row.verdict
    ratios = {f: pf / was.c_pf[f] for f, pf in c_pf.items() if f in was.c_pf}
    lowest, bake = min(ratios, default=None), "" if words.baked is None else BAKED[words.baked]
    shrunk = shrinkage and ((was.state or _UNTOLD)[0], words.baked) == (False, True)
    return HistoryRow(
        row.reading.number, row.reading.specimen, bake, 100 * shrinkage or None, words.defects, words.remark, was.name,
        _ratio(now.ry_ohm, was.electrode_ohm), _ratio(now.rz_ohm, was.film_ohm), ratios.get(lowest or nan, nan),
        at_text(lowest) if lowest else "", (1 - shrinkage) ** 2 if shrunk else None, now.word,
    )  # fmt: skip


def _ratio(now: float, before: float) -> float:
    return now / before if isfinite(now) and isfinite(before) and before > 0 else nan


def findings(rows: Sequence[HistoryRow]) -> Iterator[str]:
    """Sentences about changes by bakes and defects, where one specimen has them."""
    if any(row.specimen != rows[0].specimen for row in rows):
        return
    for row in rows:
        changes = {
            "electrode resistance": row.electrode_change, "film resistance": row.film_change,
            f"C at {row.at}": row.capacitance_change,
        }  # fmt: skip
        changed = ", ".join(f"{name} x {value:.3g}" for name, value in changes.items() if isfinite(value))
        state = ", ".join(filter(None, (row.bake, row.defects, row.remark)))
        shrunk = f"; its shrinkage alone makes C x {row.expected_change:.3g}" if row.expected_change else ""
        if changed and state:
            yield f"Reading {row.number} ({state}) against {row.against}: {changed}{shrunk}."
