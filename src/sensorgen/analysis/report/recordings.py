"""What the bench recorded: impedance per tone beside the prediction, time series, differences as surfaces."""

from collections.abc import Iterator, Sequence
from math import hypot, pi

import numpy as np

from sensorgen.analysis.comparison import Comparison, Predicted
from sensorgen.analysis.comparison.runs import Run
from sensorgen.analysis.report import charts
from sensorgen.analysis.report.charts import Axis, Chart, Relief, Trace
from sensorgen.analysis.report.tables import Cell, Column, Table, table
from sensorgen.analysis.report.thinned import kept
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import frequency_text
from sensorgen.measure.recording.samples import Real
from sensorgen.measure.signal.surfaces import normalised, surface
from sensorgen.prediction.results import Impedance

_TONES = (
    Column("recording"), Column("design"), Column("tone", "Hz"),
    Column("R measured", "ohm"), Column("± R", "ohm", "standard error"), Column("R predicted", "ohm"),
    Column("R from", "ohm"), Column("R to", "ohm"),
    Column("X measured", "ohm"), Column("± X", "ohm", "standard error"), Column("X predicted", "ohm"),
    Column("X from", "ohm"), Column("X to", "ohm"),
    Column("residual R", "", "(measured - predicted) / abs(Z predicted)"), Column("residual X"),
    Column("C measured", "pF", "-1 / (omega X)"), Column("C from", "pF"), Column("C to", "pF"),
)  # fmt: skip
_SAME = 1e-6  # relative: tones nearer than this are the same
_POINTS = 40  # of a surface, to either side
_COLOURS = (charts.BLUE, charts.ORANGE, charts.GREEN, charts.PINK, charts.YELLOW, charts.SKY)
_SYMBOLS = ("circle", "square", "diamond", "cross", "x")


def predicted_of(run: Run, found: Comparison) -> Predicted | None:
    """What was predicted of a recording's specimen."""
    return found.predictions.get(found.names.get(run.entry.specimen, ""))


def tones(recorded: Sequence[Run], found: Comparison) -> Table:
    """Impedance at rest, tone by tone, beside the prediction."""
    rows = [row for run in recorded for row in _rows(run, predicted_of(run, found))]
    return table("tones", "Impedance at rest, tone by tone, beside its prediction", _TONES, rows)


def _rows(run: Run, of: Predicted | None) -> Iterator[list[Cell]]:
    for f, z, error in zip(run.recording.tones_hz.tolist(), run.rest_ohm, run.rest_error_ohm, strict=True):
        tone = next((t for t in of.prediction.impedance if abs(t.frequency_hz / f - 1) < _SAME), None) if of else None
        c = of.capacitance_f if of else None
        bounds = (c.lower * 1e12, c.upper * 1e12) if c else (None, None)
        yield [
            run.name, of.design if of else "", f, *_part(z.real, error.real, tone, "re"),
            *_part(z.imag, error.imag, tone, "im"), *_residual(complex(z), tone), -1e12 / (2 * pi * f * z.imag),
            *bounds,
        ]  # fmt: skip


def _part(value: float, error: float, tone: Impedance | None, part: str) -> tuple[Cell, ...]:
    if tone is None:
        return float(value), float(error), None, None, None
    expected = tone.re if part == "re" else tone.im
    return float(value), float(error), expected.value, expected.lower, expected.upper


def _residual(z: complex, tone: Impedance | None) -> tuple[Cell, Cell]:
    if tone is None:
        return None, None
    size = hypot(tone.re.value, tone.im.value)
    return (z.real - tone.re.value) / size, (z.imag - tone.im.value) / size


def facts(recorded: Sequence[Run]) -> Table:
    """What every recording is, and what was left out of it."""
    rows = [
        (run.name, run.recording.source.file, run.recording.source.format, run.recording.source.program,
         len(run.recording.time_s), int(run.recording.valid().sum()), float(run.recording.time_s[-1]),
         run.recording.source.rate_hz, len(run.pairs.time_s) if run.pairs else 0, "; ".join(run.notes))
        for run in recorded
    ]  # fmt: skip
    columns = (
        Column("recording"), Column("file"), Column("format"), Column("program"), Column("samples"), Column("valid"),
        Column("length", "s"), Column("rate", "1/s"), Column("presses"), Column("notes"),
    )  # fmt: skip
    return table("recordings", "Recordings of the bench", columns, rows)


def figures(recorded: Sequence[Run]) -> tuple[Chart, ...]:
    """Time series and surfaces of every recording."""
    return tuple(chart for run in recorded for chart in (_series(run), *_surfaces(run)))


def residuals(recorded: Sequence[Run], found: Comparison) -> Iterator[Chart]:
    """Of R and X, relative to the prediction's magnitude."""
    table_of, at = tones(recorded, found), {c.name: k for k, c in enumerate(_TONES)}
    rows = [row for row in table_of.rows if row[at["residual R"]] is not None]
    if not rows:
        return
    traces = []
    for row, part, colour in ((0, "R", charts.BLUE), (1, "X", charts.ORANGE)):
        x = [float(r[at["tone"]]) for r in rows]  # type: ignore[arg-type]
        y = [float(r[at[f"residual {part}"]]) for r in rows]  # type: ignore[arg-type]
        traces.append(
            Trace("points", f"residual of {part}", x, y, text=[str(r[0]) for r in rows], colour=colour, row=row)
        )
    yield Chart(
        "tone-residuals", "Residuals of the impedance at rest",
        "Measured less predicted, R above and X below, as a share of the magnitude of the predicted Z, over the tone. "
        "The table below has every number.",
        {"": tuple(traces)}, Axis("tone [Hz]", log=True), (Axis("residual of R / |Z|"), Axis("residual of X / |Z|")),
    )  # fmt: skip


def normalised_differences(recorded: Sequence[Run]) -> Iterator[Chart]:
    """What presses change in every recording, each on a scale of its own from 0 to 1 (figure 6.33 of the thesis)."""
    pressed = [run for run in recorded if run.pairs is not None and len(run.pairs.time_s) > 1]
    alike = [run for run in pressed if _same_tones(run, pressed[0])]
    if not alike:
        return
    tones_hz = alike[0].recording.tones_hz
    scaled = [normalised([_both(run)])[0] for run in alike]
    left_out = f" {len(pressed) - len(alike)} recordings of other tones are left out." if alike != pressed else ""
    yield Chart(
        "normalised", "Differences that presses make, each recording on a scale of its own",
        f"Change of R above and of X below by each press of {len(alike)} recordings over its force, at the chosen "
        "tone: 0 is the least and 1 the largest change of that recording, so that courses compare and sizes do not."
        f"{left_out}",
        {
            frequency_text(float(f)): tuple(
                _differences(run, values[:, k + row * len(tones_hz)], j, row)
                for row in (0, 1)
                for j, (run, values) in enumerate(zip(alike, scaled, strict=True))
            )
            for k, f in enumerate(tones_hz)
        },
        Axis("force [N]"), (Axis("ΔR, normalised"), Axis("ΔX, normalised")), "tone",
    )  # fmt: skip


def _same_tones(run: Run, other: Run) -> bool:
    ours, theirs = run.recording.tones_hz, other.recording.tones_hz
    return len(ours) == len(theirs) and bool(np.allclose(ours, theirs, rtol=_SAME))


def _differences(run: Run, values: Real, number: int, row: int) -> Trace:
    assert run.pairs is not None  # noqa: S101 - chosen so
    return Trace(
        "points", "" if row else run.name, run.pairs.force_n, values, colour=_COLOURS[number % len(_COLOURS)],
        symbol=_SYMBOLS[number // len(_COLOURS) % len(_SYMBOLS)], row=row,
        text=[f"{run.name}, at {x:.4g} mm" for x in run.pairs.position_mm],
    )  # fmt: skip


def _key(run: Run) -> str:
    return f"{run.entry.number}-{run.recording.source.lockin}"


def _series(run: Run) -> Chart:
    return Chart(
        f"series-{_key(run)}", f"Readings over time: {run.name}",
        "R above and X below over time, as recorded and low-passed. Of long recordings the least and the largest value "
        "of every stretch are drawn; everything is computed from all samples.",
        {frequency_text(float(f)): _tone_series(run, k) for k, f in enumerate(run.recording.tones_hz)},
        Axis("time [s]"), (Axis("R [ohm]"), Axis("X [ohm]")), "tone",
    )  # fmt: skip


def _tone_series(run: Run, k: int) -> tuple[Trace, ...]:
    valid = run.recording.valid()
    time, z = run.recording.time_s[valid], run.recording.impedance_ohm[valid, k]
    traces = []
    for row, part in enumerate(("real", "imag")):
        raw, smooth = getattr(z, part), getattr(run.filtered_ohm[:, k], part)
        traces += [
            _thin("raw" if row == 0 else "", time, raw, charts.SKY, row),
            _thin("filtered" if row == 0 else "", run.time_s, smooth, charts.ORANGE, row),
        ]
    return tuple(traces)


def _thin(name: str, time: Real, values: Real, colour: str, row: int) -> Trace:
    at = kept(values)
    return Trace("line", name, time[at], values[at], colour=colour, row=row)


def _surfaces(run: Run) -> Iterator[Chart]:
    """What presses change of R and of X, over force and position."""
    if run.pairs is None:
        return
    try:
        found = surface(run.pairs.force_n, run.pairs.position_mm, _both(run), _POINTS)
    except SensorgenError:
        return
    count = len(run.recording.tones_hz)
    names = [f"Δ{part} at {frequency_text(float(f))}" for part in "RX" for f in run.recording.tones_hz]
    yield Chart(
        f"surface-{_key(run)}", f"Difference that presses make [ohm]: {run.name}",
        f"Change of R or X at the chosen tone by {len(run.pairs.time_s)} presses, as a surface over force and "
        "position, straight between the presses.",
        {names[k]: (Relief(found.position_mm, found.force_n, found.values[:, :, k]),) for k in range(2 * count)},
        Axis("position [mm]"), (Axis("force [N]"), Axis("difference [ohm]")), "difference",
    )  # fmt: skip


def _both(run: Run) -> Real:
    assert run.pairs is not None  # noqa: S101 - asked before
    return np.hstack([run.pairs.difference_ohm.real, run.pairs.difference_ohm.imag])


def findings(recorded: Sequence[Run], found: Comparison) -> Iterator[str]:
    """What the recordings say, in a sentence each."""
    if not recorded:
        yield "No recording of the bench: impedances, time series and surfaces are left out."
        return
    at = {c.name: k for k, c in enumerate(_TONES)}
    sizes = [
        hypot(float(row[at["residual R"]]), float(row[at["residual X"]]))  # type: ignore[arg-type]
        for row in tones(recorded, found).rows
        if row[at["residual R"]] is not None
    ]
    if sizes:
        yield (
            f"Impedance at rest of {len(recorded)} recordings: off by {100 * float(np.median(sizes)):.3g} % of the "
            f"predicted |Z| (median of {len(sizes)} tones)."
        )
