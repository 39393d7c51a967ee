"""The figures of a report, from what was compared."""

from collections import Counter
from math import exp, inf, isfinite

from sensorgen.analysis.comparison import Compared, Comparison
from sensorgen.analysis.report import charts, yields
from sensorgen.analysis.report.charts import Axis, Chart, Trace
from sensorgen.analysis.report.variants import bodies as bodies_of
from sensorgen.measure.signal.verdicts import ORDER, WORDS

_COLOURS = dict(
    zip(
        WORDS,
        (charts.PINK, charts.ORANGE, charts.YELLOW, charts.SKY, charts.GREEN, charts.GREY),
        strict=True,
    )
)
_SHAPES = {"tri": "circle", "rect": "square", "reference": "diamond", "double": "cross"}
_STRETCH = (1.0, 1.0, 10.0)
MOST_ROWS, MOST_POINTS = 200, 3000  # that anybody can read, and that a browser draws at once


def residuals(found: Comparison) -> tuple[Chart, ...]:
    """Measured over predicted, and both beside each other."""
    known = [row for row in found.rows if isfinite(row.residual)]
    every = sorted((row for row in known if row.verdict.electrode != "unknown"), key=lambda row: row.residual)
    if not every:
        return ()
    rows = every if len(every) <= MOST_ROWS else every[: MOST_ROWS // 2] + every[-MOST_ROWS // 2 :]
    low, more = len(known) - len(every), len(every) - len(rows)
    said = f" Left out: {low}, too low for an electrode." if low else ""
    said += f" Not drawn: {more} of residuals between the least and the largest." if more else ""
    return _ratios(rows, said), _beside(sorted(rows, key=lambda row: row.reading.number))


def _names(rows: list[Compared]) -> tuple[str, ...]:
    """Names of the rows; a specimen that was measured twice has the reading's number too."""
    count = Counter(row.reading.specimen for row in rows)
    return tuple(
        row.reading.specimen + (f" (no. {row.reading.number})" if count[row.reading.specimen] > 1 else "")
        for row in rows
    )


def _ratios(rows: list[Compared], left_out: str) -> Chart:
    names = _names(rows)
    bounds = [_relative(row) for row in rows]
    traces = (
        Trace("ranges", "prediction's bounds", [1.0] * len(rows), names, [b[0] for b in bounds], [b[1] for b in bounds],
              colour=charts.GREY),
        *_by_verdict(rows, names, [exp(row.residual) for row in rows]),
    )  # fmt: skip
    inside = sum(bool(row.inside) for row in rows)
    return Chart(
        "residuals", "Residuals: R_Y measured over predicted",
        f"{len(rows)} readings of R_Y over the middle of their prediction, on a logarithmic axis; {inside} lie within "
        f"the prediction's bounds. The table below has every number.{left_out}",
        {"": traces}, Axis("measured / predicted", log=True), (Axis("", names=names),),
    )  # fmt: skip


def _relative(row: Compared) -> tuple[float, float]:
    bounds = row.predicted.ry_ohm if row.predicted else None
    return (bounds.lower / bounds.middle(), bounds.upper / bounds.middle()) if bounds else (1.0, 1.0)


def _by_verdict(rows: list[Compared], names: tuple[str, ...], values: list[float]) -> list[Trace]:
    found = []
    for word in WORDS:
        here = [k for k, row in enumerate(rows) if row.verdict.word == word]
        if here:
            found.append(
                Trace("points", word, [values[k] for k in here], [names[k] for k in here],
                      text=["; ".join(rows[k].verdict.reasons) for k in here], colour=_COLOURS[word])
            )  # fmt: skip
    return found


def _beside(rows: list[Compared]) -> Chart:
    names = _names(rows)
    bounds = [row.predicted.ry_ohm for row in rows if row.predicted and row.predicted.ry_ohm]
    least, most = [min(r.evidence.ry_ohm) for r in rows], [max(r.evidence.ry_ohm) for r in rows]
    traces = (
        Trace("ranges", "predicted, between bounds", [b.middle() for b in bounds], names, [b.lower for b in bounds],
              [b.upper for b in bounds], colour=charts.GREY),
        Trace("points", "measured, with the spread of its readings", least, names, least, most),
    )  # fmt: skip
    return Chart(
        "resistance", "R_Y predicted and measured",
        "Resistance along an electrode for each specimen: the prediction as a bar between its bounds, the readings as "
        "points with their spread. The table below has every number.",
        {"": traces}, Axis("R_Y [ohm]", log=True), (Axis("", names=names),),
    )  # fmt: skip


def verdicts(found: Comparison) -> tuple[Chart, ...]:
    """What R_Z is beside R_Y, and how many specimens of each variant have which verdict."""
    return tuple(chart for chart in (_short(found), _counts(found), _shares(found)) if chart)


def _short(found: Comparison) -> Chart | None:
    rows = [r for r in found.rows if isfinite(r.verdict.ratio) and r.verdict.rz_ohm > 0]
    if not rows:
        return None
    every, rows = len(rows), rows[:: -(-len(rows) // MOST_POINTS)]
    low, high = min(r.verdict.ry_ohm for r in rows), max(r.verdict.ry_ohm for r in rows)
    ends = [low / 1.5, high * 1.5]
    traces = [
        Trace("line", f"R_Z = {factor:g} R_Y", ends, [factor * x for x in ends], colour=charts.GREY, dash=dash)
        for factor, dash in ((2.0, "solid"), (ORDER, "dash"))
    ]
    for shape in sorted({r.reading.shape for r in rows}):
        here = [r for r in rows if r.reading.shape == shape]
        traces.append(
            Trace("points", shape, [r.verdict.ry_ohm for r in here], [r.verdict.rz_ohm for r in here],
                  text=[f"{r.reading.specimen}: {r.verdict.word}" for r in here],
                  colour=charts.BLUE if shape == "tri" else charts.ORANGE, symbol=_SHAPES.get(shape, "x"))
        )  # fmt: skip
    zero, overload = (sum(r.verdict.rz_ohm == value for r in found.rows) for value in (0, inf))
    return Chart(
        "shorts", "R_Z beside R_Y",
        f"Resistance between the electrodes over that along one, both logarithmic, for {len(rows)} of {every} "
        "readings. Below the solid line a bridge can read that; below the dashed one R_Z is of the order of R_Y. "
        f"{zero} readings of 0 ohm and {overload} of overload have no place on the axis.",
        {"": tuple(traces)}, Axis("R_Y [ohm]", log=True), (Axis("R_Z [ohm]", log=True),),
    )  # fmt: skip


def _counts(found: Comparison) -> Chart:
    groups = yields.judged(found, "shape and film")
    names = tuple(", ".join(map(str, g.key)) for g in groups)
    traces = tuple(
        Trace("bars", word, [float(g.words.get(word, 0)) for g in groups], names, colour=_COLOURS[word])
        for word in WORDS
        if any(g.words.get(word) for g in groups)
    )
    return Chart(
        "verdict-counts", "Verdicts by shape and film", "How many specimens of each shape and film have which verdict.",
        {"": traces}, Axis("specimens"), (Axis("", names=names),),
    )  # fmt: skip


def _shares(found: Comparison) -> Chart | None:
    groups = [g for g in yields.judged(found, "shape and film") if g.shorted.total]
    if not groups:
        return None
    names = tuple(", ".join(map(str, g.key)) for g in groups)
    trace = Trace(
        "points", "share, with its interval of 95 %", [100 * g.shorted.share for g in groups], names,
        [100 * g.shorted.low for g in groups], [100 * g.shorted.high for g in groups],
        [f"{g.shorted.count} of {g.shorted.total}" for g in groups],
    )  # fmt: skip
    return Chart(
        "shorted", "R_Z of the order of R_Y, by shape and film",
        "Share of specimens whose R_Z is at most ten times R_Y, for each shape and film, with exact intervals; without "
        "those whose electrodes touch as drawn.",
        {"": (trace,)}, Axis("share [%]", low=0.0, high=102.0), (Axis("", names=names),),
    )  # fmt: skip


def bodies(found: Comparison) -> tuple[Chart, ...]:
    """The bodies of every variant, to be turned; one at a time."""
    if not found.designs:
        return ()
    return (
        Chart(
            "bodies", f"Bodies, height × {_STRETCH[2]:g}",
            "The bodies of the chosen variant in three dimensions, to be turned with the mouse; their height is drawn "
            "ten times as large. The drawings below show the same in section.",
            {name: tuple(bodies_of(design)) for name, design in found.designs.items()},
            Axis("x [mm]"), (Axis("y [mm]"), Axis("z [mm]")), "variant", _STRETCH,
        ),
    )  # fmt: skip
