"""Electrode resistance, reading by reading: predicted, measured, and the ratio of the two."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp, hypot, isfinite, nan, sqrt
from statistics import median, stdev
from typing import Annotated

import numpy as np

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.plots.figure import DARK, GREEN, GREY, ORANGE, PINK, SKY, YELLOW, Axis, Curve, Figure, Panel
from sensorgen.core.document import Column, Table
from sensorgen.core.lazy import Lazy
from sensorgen.measure import accuracy
from sensorgen.measure.signal.verdicts import WORDS

VERDICT_COLOURS = dict(zip(WORDS, (PINK, ORANGE, YELLOW, SKY, GREEN, DARK), strict=True))
MOST_ROWS = 200  # of a figure: more cannot be read
_ALIKE = 1.05  # ratio up to which two resistances are called alike
_LEAST, _HIGHEST = "the least reading along an electrode", "the highest of several readings along an electrode"
_UNCERTAINTY = "standard uncertainty: scatter, and the meter's limit of error"


@dataclass(frozen=True)
class ReadingRow:
    """A reading beside its prediction."""

    number: Annotated[int, Column("reading", "", "number in the log")]
    specimen: Annotated[str, Column("specimen")]
    design: Annotated[str, Column("design")]
    measured_ohm: Annotated[float, Column("electrode resistance measured", "ohm", _LEAST)]
    highest_ohm: Annotated[float, Column("highest reading", "ohm", _HIGHEST)]
    error_ohm: Annotated[float, Column("± electrode resistance", "ohm", _UNCERTAINTY)]
    lower_ohm: Annotated[float, Column("predicted from", "ohm", "lower bound")]
    predicted_ohm: Annotated[float, Column("predicted", "ohm", "most likely value")]
    upper_ohm: Annotated[float, Column("predicted to", "ohm", "upper bound")]
    ratio: Annotated[float, Column("measured / predicted")]
    within: Annotated[str, Column("within interval", "", "whether a reading lies between the bounds")]
    film_ohm: Annotated[float, Column("film resistance measured", "ohm", "the least reading between the electrodes")]
    film_highest_ohm: Annotated[float, Column("highest film reading", "ohm", "the highest of several readings")]
    film_ratio: Annotated[float, Column("film / electrode", "", "ratio of the two resistances")]
    leak_s: Annotated[float, Column("leak", "S", "conductance of a film that leaks evenly")]
    verdict: Annotated[str, Column("verdict")]


@dataclass(frozen=True)
class VerdictRow:
    """A verdict and its reasons."""

    number: Annotated[int, Column("reading", "", "number in the log")]
    specimen: Annotated[str, Column("specimen")]
    verdict: Annotated[str, Column("verdict")]
    electrode: Annotated[str, Column("electrode")]
    film: Annotated[str, Column("film")]
    remark: Annotated[str, Column("remark")]
    doubts: Annotated[str, Column("doubts")]


def readings(comparison: Comparison) -> Table:
    """A row for each reading, the largest deviation first."""

    def row_of(k: int) -> ReadingRow:
        row = comparison.direct[k]
        r, v, of = row.reading, row.verdict, row.evidence
        expected = row.expected_ohm
        bounds = (expected.lower, expected.value, expected.upper) if expected else (nan, nan, nan)
        along, across = ((min(ohm, default=nan), max(ohm, default=nan)) for ohm in (of.ry_ohm, of.rz_ohm))
        return ReadingRow(
            r.number, r.specimen, row.predicted.design if row.predicted else "", *along, _error(row), *bounds,
            exp(row.residual), {None: "", True: "yes", False: "no"}[row.inside], *across, v.ratio, v.leak_s, v.word,
        )  # fmt: skip

    off = np.array([-abs(row.residual) if isfinite(row.residual) else 1.0 for row in comparison.direct])
    rows = Lazy(row_of, range(len(off))).at(np.argsort(off, kind="stable").tolist())
    return Table.of("readings", "Every reading and its prediction; the largest deviation first", rows)


def _error(row: Compared) -> float:
    """Standard uncertainty of the readings along an electrode [ohm]; nan where nothing is known of it."""
    words, finite = row.reading.words, [value for value in row.evidence.ry_ohm if isfinite(value)]
    meter = accuracy.find(words.instrument) if words.instrument and finite else None
    limit = meter.dc_ohm(min(finite), words.wires) if meter else None
    scatter = stdev(finite) / sqrt(len(finite)) if len(finite) > 1 else 0.0
    return hypot(scatter, limit) if limit is not None else scatter or nan


def beyond_meter(comparison: Comparison) -> Iterator[str]:
    """DC resistances that are beyond the ranges of the meter that they were read from, in one sentence."""
    beyond = []
    for row in comparison.direct:
        words = row.reading.words
        meter = accuracy.find(words.instrument) if words.instrument else None
        values = (value for value in (*row.reading.y_ohm, *row.reading.z_ohm) if isfinite(value))
        if meter and meter.ranges and any(meter.dc_ohm(value, words.wires) is None for value in values):
            beyond.append(f"{row.reading.specimen} ({meter.name})")
    if beyond:
        yield f"Flagged: a resistance beyond the meter's ranges: {', '.join(dict.fromkeys(beyond))}."


def reasons(comparison: Comparison) -> Table:
    """Verdicts with reasons, remarks and doubts, in the order of the log."""

    def row_of(k: int) -> VerdictRow:
        row = comparison.direct[k]
        r, words, (electrode, film) = row.reading, row.reading.words, row.verdict.reasons
        doubts = "; ".join(words.doubts)
        return VerdictRow(r.number, r.specimen, row.verdict.word, electrode, film, words.remark, doubts)

    return Table.of("verdicts", "Verdicts and their reasons", Lazy(row_of, range(len(comparison.direct))))


def usable(comparison: Comparison) -> Lazy[Compared]:
    """Rows with a prediction, and an electrode that is neither open nor so low that a prefix k was lost."""
    return comparison.rows.where(lambda r: isfinite(r.residual) and r.verdict.electrode in ("sound", "dry joint"))


def headline(comparison: Comparison) -> Iterator[str]:
    """Measured against predicted, in one sentence."""
    rows = usable(comparison)
    if len(rows) == 1 and (expected := rows[0].expected_ohm):
        where = "within" if rows[0].inside else "outside"
        yield (
            f"Electrode resistance of {rows[0].reading.specimen}: measured {rows[0].verdict.ry_ohm:.4g} ohm, predicted "
            f"{expected.lower:.4g} to {expected.upper:.4g} ohm ({where} the interval)."
        )
    elif rows:
        ratio = median(exp(r.residual) for r in rows)
        off = max(ratio, 1 / ratio)
        words = "as predicted" if off < _ALIKE else f"{off:.3g} x {'higher' if ratio > 1 else 'lower'} than predicted"
        yield (
            f"Electrode resistance: measured {words} (median of {len(rows)} readings; "
            f"{sum(bool(r.inside) for r in rows)} within the predicted interval)."
        )
    elif comparison.direct:
        yield "Electrode resistance: no reading can be compared with a prediction."


def findings(comparison: Comparison) -> Iterator[str]:
    """When predictions were made, and which electrodes touch as drawn."""
    yield from _order(comparison)
    touching = Counter(r.predicted.design for r in comparison.rows if r.predicted and r.predicted.touches)
    if touching:
        names = ", ".join(f"{name} ({count})" for name, count in sorted(touching.items()))
        yield f"Shorted by design, the electrodes touch as printed: {names}; {touching.total()} readings."


def _order(comparison: Comparison) -> Iterator[str]:
    """When predictions were made: before or after the measurements."""
    every = [(bool(p.stored_at), p.before) for p in comparison.predictions.values()]
    before = every.count((True, True))
    late = {
        "by the clocks of the log alone": every.count((True, None)),
        "stored after a measurement": every.count((True, False)),
        "made after the measurement": sum(not stored for stored, _ in every),
    }
    if every:
        rest = "".join(f"; {count} {how}" for how, count in late.items() if count)
        order = "stored before anything was measured, by the order of the log's records"
        predictions = "prediction was" if len(every) == 1 else "predictions were"
        yield f"{before} of {len(every)} {predictions} {order}{rest}."


def figures(comparison: Comparison) -> tuple[Figure, ...]:
    """Measured over predicted, and both in ohm."""
    known = comparison.rows.where(lambda row: isfinite(row.residual))
    some = known.where(lambda row: row.verdict.electrode != "unknown")
    every = some.at(np.argsort([row.residual for row in some], kind="stable").tolist())
    if not every:
        return ()
    rows = [*every] if len(every) <= MOST_ROWS else [*every[: MOST_ROWS // 2], *every[-MOST_ROWS // 2 :]]
    low, more = len(known) - len(every), len(every) - len(rows)
    left_out = f" Left out: {low} readings too low for an electrode." if low else ""
    left_out += f" Not drawn: {more} readings of moderate ratio." if more else ""
    both = _resistances(sorted(rows, key=lambda row: row.reading.number))
    return (_ratios(rows, left_out), both) if len(rows) > 1 else (both,)


def _names(rows: Sequence[Compared]) -> tuple[str, ...]:
    """Names of the rows, with the reading's number where a specimen was measured twice."""
    count = Counter(row.reading.specimen for row in rows)
    named = ((row.reading.specimen, row.reading.number) for row in rows)
    return tuple(f"{name} (no. {number})" if count[name] > 1 else name for name, number in named)


def _by_verdict(rows: Sequence[Compared], names: Sequence[str]) -> Iterator[Curve]:
    """Ratios of the rows, each verdict in its colour."""
    for word in dict.fromkeys(row.verdict.word for row in rows):
        here = [(name, row) for name, row in zip(names, rows, strict=True) if row.verdict.word == word]
        points = [exp(row.residual) for _, row in here], [name for name, _ in here]
        text = ["; ".join(row.verdict.reasons) for _, row in here]
        yield Curve("points", word, *points, text=text, colour=VERDICT_COLOURS[word])


def _ratios(rows: Sequence[Compared], left_out: str) -> Figure:
    names = _names(rows)
    bounds = [row.expected_ohm for row in rows]
    low, high = ([getattr(b, end) / b.value if b else 1.0 for b in bounds] for end in ("lower", "upper"))
    interval = Curve("ranges", "predicted interval", [1.0] * len(rows), names, low, high, colour=GREY)
    panel = Panel((interval, *_by_verdict(rows, names)), Axis("measured / predicted", log=True), Axis(names=names))
    inside = sum(bool(row.inside) for row in rows)
    alt = (
        f"{len(rows)} readings over their predicted value, on a logarithmic axis; {inside} lie within the "
        f"predicted interval.{left_out}"
    )
    return Figure("residuals", "Electrode resistance: measured / predicted", alt, {"": (panel,)})


def _resistances(rows: Sequence[Compared]) -> Figure:
    names = _names(rows)
    bounds = [bounds for row in rows if (bounds := row.expected_ohm)]
    least, most = [min(r.evidence.ry_ohm) for r in rows], [max(r.evidence.ry_ohm) for r in rows]
    curves = (
        Curve("ranges", "predicted interval", [b.value for b in bounds], names, [b.lower for b in bounds],
              [b.upper for b in bounds], colour=GREY),
        Curve("points", "measured, with the spread of its readings", least, names, least, most),
    )  # fmt: skip
    panel = Panel(curves, Axis("electrode resistance [ohm]", log=True), Axis(names=names))
    alt = "Resistance along an electrode of each specimen: predicted interval as a bar, readings as points."
    return Figure("resistance", "Electrode resistance: measured and predicted", alt, {"": (panel,)})
