"""Specimen by specimen: predicted, measured, and how far apart."""

from collections import Counter
from collections.abc import Iterator
from math import exp, isfinite, nan
from statistics import median

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.report.tables import Cell, Column, Table, table

COLUMNS = (
    Column("no.", about="of the reading, in the log"),
    Column("specimen"),
    Column("design"),
    Column("R_Y measured", "ohm", "the least reading along an electrode"),
    Column("R_Y highest", "ohm", "the highest of several readings"),
    Column("R_Y from", "ohm", "lower bound of the prediction"),
    Column("R_Y predicted", "ohm", "middle of the prediction"),
    Column("R_Y to", "ohm", "upper bound of the prediction"),
    Column("ratio", "", "measured over the middle of the prediction"),
    Column("residual", "ln", "its natural logarithm"),
    Column("within", "", "whether a reading lies between the bounds"),
    Column("R_Z measured", "ohm", "the least reading between the electrodes"),
    Column("R_Z highest", "ohm", "the highest of several readings"),
    Column("R_Z / R_Y"),
    Column("leak", "S", "of a film that leaks evenly"),
    Column("verdict"),
)
_WORDS = (Column("no."), Column("specimen"), Column("verdict"), Column("electrode"), Column("film"), Column("remark"),
          Column("doubts"))  # fmt: skip


def table_of(found: Comparison) -> Table:
    """A row for each reading, the largest residual first."""
    rows = sorted(found.rows, key=lambda row: -abs(row.residual) if isfinite(row.residual) else 1.0)
    return table(
        "specimens", "Every reading beside its prediction; the largest residual first", COLUMNS, [_row(r) for r in rows]
    )


def _row(row: Compared) -> list[Cell]:
    r, v = row.reading, row.verdict
    expected = row.predicted.ry_ohm if row.predicted else None
    bounds = (expected.lower, expected.middle(), expected.upper) if expected else (nan, nan, nan)
    within = {None: "", True: "yes", False: "no"}[row.inside]
    return [
        r.number, r.specimen, row.predicted.design if row.predicted else "",
        v.ry_ohm, max(row.evidence.ry_ohm, default=nan), *bounds, exp(row.residual), row.residual, within,
        v.rz_ohm, max(row.evidence.rz_ohm, default=nan), v.ratio, v.leak_s, v.word,
    ]  # fmt: skip


def reasons(found: Comparison) -> Table:
    """Why each verdict is what it is, with remarks and doubts, in the order of the log."""
    return table("reasons", "Every verdict, and what it rests on", _WORDS, [_words(row) for row in found.rows])


def _words(row: Compared) -> list[Cell]:
    r = row.reading
    return [r.number, r.specimen, row.verdict.word, *row.verdict.reasons, r.remark, "; ".join(r.doubts)]


def usable(found: Comparison) -> list[Compared]:
    """Rows with a residual, of an electrode that is one: neither open, nor so low that a k was lost."""
    return [r for r in found.rows if isfinite(r.residual) and r.verdict.electrode in ("sound", "dry joint")]


def findings(found: Comparison) -> Iterator[str]:
    """What the residuals say, in sentences."""
    rows = usable(found)
    if rows:
        ratio = median(exp(r.residual) for r in rows)
        inside = sum(bool(r.inside) for r in rows)
        yield (
            f"Electrodes read {ratio:.3g} of the prediction's middle (median of {len(rows)} readings of R_Y); "
            f"{inside} of {len(rows)} lie within its bounds."
        )
    touching = Counter(r.predicted.design for r in found.rows if r.predicted and r.predicted.touches)
    if touching:
        names = ", ".join(f"{name} ({count})" for name, count in sorted(touching.items()))
        yield (
            f"As drawn, the electrodes of {len(touching)} variants touch, so that they are shorts by design: "
            f"{names}; {touching.total()} readings."
        )


def words(found: Comparison) -> tuple[str, ...]:
    """What the figures and the table rest on."""
    made = sum(not p.stored_at for p in found.predictions.values())
    stored = len(found.predictions) - made
    origin = f"{stored} of {len(found.predictions)} predictions were stored in the log when they were made"
    late = f"; {made} were made afterwards, for this report, and could have been tuned" if made else ""
    return (
        "The prediction of R_Y runs from the better electrode with all its cogs to the worse one without them: nobody "
        "wrote down which of the two was measured. A residual is ln(measured / middle of the prediction), of the least "
        "reading; the others show the spread.",
        f"{origin}{late}." if found.predictions else "No specimen's name tells its design: nothing is predicted.",
        "A film that leaks lets a part of the current take the other electrode: R_Y then reads up to half as much.",
    )
