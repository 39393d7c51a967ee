"""Recordings of the rig: impedance per frequency beside the prediction, readings over time, differences under load."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot, pi
from typing import Annotated

import numpy as np

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.comparison.measured import RecordedRun
from sensorgen.analysis.plots import recordings as plots
from sensorgen.analysis.plots.figure import BLUE, ORANGE, Axis, Curve, Figure, Panel
from sensorgen.analysis.report.alternating import F_PER_PF, at_text, capacitor_from, verdict
from sensorgen.core.bounds import Bounds
from sensorgen.core.document import Cell, Column, Table
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import si
from sensorgen.prediction.quantities import impedance_at
from sensorgen.prediction.results import Impedance

_SAME = 1e-6  # relative: frequencies nearer than this are the same
_SURE = 3.0  # standard errors by which a reading is beyond a range


@dataclass(frozen=True)
class ImpedanceRow:
    """Impedance at rest at one frequency, and its prediction."""

    recording: Annotated[str, Column("recording")]
    design: Annotated[str, Column("design")]
    frequency_hz: Annotated[float, Column("frequency", "Hz")]
    r_ohm: Annotated[float, Column("R measured", "ohm")]
    r_error_ohm: Annotated[float, Column("± R", "ohm", "standard error")]
    r_predicted_ohm: Annotated[Cell, Column("R predicted", "ohm")]
    r_from_ohm: Annotated[Cell, Column("R from", "ohm")]
    r_to_ohm: Annotated[Cell, Column("R to", "ohm")]
    x_ohm: Annotated[float, Column("X measured", "ohm")]
    x_error_ohm: Annotated[float, Column("± X", "ohm", "standard error")]
    x_predicted_ohm: Annotated[Cell, Column("X predicted", "ohm")]
    x_from_ohm: Annotated[Cell, Column("X from", "ohm")]
    x_to_ohm: Annotated[Cell, Column("X to", "ohm")]
    r_residual: Annotated[float | None, Column("residual of R", "", "(measured - predicted) / abs(Z predicted)")]
    x_residual: Annotated[float | None, Column("residual of X", "", "(measured - predicted) / abs(Z predicted)")]
    noise_percent: Annotated[float, Column("noise", "%", "standard deviation of R and of X of a sample, of |Z|")]
    verdict: Annotated[str, Column("verdict")]
    c_pf: Annotated[float, Column("Cs measured", "pF", "in series, -1 / (omega X)")]
    c_predicted_pf: Annotated[Cell, Column("C predicted", "pF")]
    c_from_pf: Annotated[Cell, Column("C from", "pF")]
    c_to_pf: Annotated[Cell, Column("C to", "pF")]


@dataclass(frozen=True)
class RecordingRow:
    """A recording, and what was left out of it."""

    recording: Annotated[str, Column("recording")]
    file: Annotated[str, Column("file")]
    format: Annotated[str, Column("format")]
    program: Annotated[str, Column("program")]
    samples: Annotated[int, Column("samples")]
    valid: Annotated[int, Column("valid")]
    length_s: Annotated[float, Column("length", "s")]
    rate_hz: Annotated[float, Column("rate", "1/s")]
    loads: Annotated[int, Column("loads")]
    notes: Annotated[str, Column("notes")]


def impedances(recorded: Sequence[RecordedRun], comparison: Comparison) -> list[ImpedanceRow]:
    """Impedance at rest, frequency by frequency, and its prediction."""
    rows: list[ImpedanceRow] = []
    for run in recorded:
        of = comparison.predictions.get(comparison.names.get(run.entry.specimen, ""))
        design, capacitance = (of.design, of.prediction.capacitance) if of else ("", None)
        c_pf = [None if c is None else c / F_PER_PF for c in _predicted(capacitance)]
        noise = np.hypot(run.noise_ohm.real, run.noise_ohm.imag) / np.abs(run.rest_ohm) / 2**0.5
        measured = zip(run.tones_hz.tolist(), run.rest_ohm, run.rest_error_ohm, noise.tolist(), strict=True)
        for f, z, error, share in measured:
            e = impedance_at(of.prediction, f, of.losses) if of else None
            re, im = (e.re, e.im) if e else (None, None)
            off = _residual(complex(z), e)
            rows.append(ImpedanceRow(
                run.name, design, f,
                float(z.real), float(error.real), *_predicted(re),
                float(z.imag), float(error.imag), *_predicted(im), *off, 100 * share, verdict(complex(z)),
                float(-1 / (2 * pi * f * z.imag)) / F_PER_PF, *c_pf,
            ))  # fmt: skip
    return rows


def _residual(z_ohm: complex, expected: Impedance | None) -> tuple[float | None, float | None]:
    """Residuals of R and X, relative to the prediction's magnitude."""
    if expected is None:
        return None, None
    middle = complex(expected.re.value, expected.im.value)
    off = (z_ohm - middle) / abs(middle)
    return off.real, off.imag


def _predicted(of: Bounds | None) -> tuple[float | None, float | None, float | None]:
    return (of.value, of.lower, of.upper) if of else (None, None, None)


def facts(recorded: Sequence[RecordedRun]) -> tuple[Table, ...]:
    """A row for each recording; no table without any."""
    rows = [
        RecordingRow(
            run.name, run.source.file, run.source.format, run.source.program, run.samples, run.valid, run.seconds,
            run.source.rate_hz, len(run.pairs.time_s) if run.pairs else 0, "; ".join(run.notes),
        )
        for run in recorded
    ]  # fmt: skip
    return Table.some("recordings", "Recordings of the rig", rows)


def headline(impedances: Sequence[ImpedanceRow]) -> Iterator[str]:
    """Measured impedance against the predicted one, in one sentence."""
    if rows := _compared(impedances):
        off = float(np.median(np.hypot(*np.array([(row.r_residual, row.x_residual) for row in rows], float).T)))
        names = {row.recording for row in rows}
        simulated = sum(name.endswith(", simulated") for name in names)
        kind = "simulated" if simulated == len(names) else "measured"
        beside = f", {simulated} of them simulated" if 0 < simulated < len(names) else ""
        yield (
            f"Impedance at rest: {kind} {100 * off:.3g} % of |Z| off the prediction (median of {len(rows)} "
            f"frequencies in {len(names)} recording{'s' * (len(names) > 1)}{beside})."
        )


def _compared(rows: Sequence[ImpedanceRow]) -> list[ImpedanceRow]:
    """Rows with a prediction."""
    return [row for row in rows if row.r_residual is not None]


def findings(recorded: Sequence[RecordedRun], rows: Sequence[ImpedanceRow]) -> Iterator[str]:
    """Impedance, noise and capacitance of recordings at rest; verdicts; what cannot be, or was not expected."""
    for run in recorded:
        mine = [row for row in rows if row.recording == run.name]
        verdicts = {row.frequency_hz: row.verdict for row in mine}
        yield from (f"Flagged: {run.name} {fault}." for fault in _faults(mine))
        if run.pairs is None and mine:
            yield _at_rest(run.name, min(mine, key=lambda row: row.frequency_hz), verdicts)


def _faults(rows: Sequence[ImpedanceRow]) -> Iterator[str]:
    """Impedances of a recording that cannot be, or were not expected."""
    if negative := [at_text(row.frequency_hz) for row in rows if row.verdict == "negative resistance"]:
        yield f"has a negative resistance at {', '.join(negative)}: check the bridge's calibration"
    if off := [f"{part} at {where}" for part in "RX" if (where := ", ".join(_outside(rows, part)))]:
        yield f"is outside the predicted range by its {' and '.join(off)}"


def _at_rest(name: str, low: ImpedanceRow, verdicts: dict[float, str]) -> str:
    c = f", C {low.c_pf:.4g} pF" if low.c_pf > 0 else ""
    return (
        f"{name}, nothing pressed: |Z| {si(hypot(low.r_ohm, low.x_ohm), 'ohm')} at {at_text(low.frequency_hz)}{c}; "
        f"noise of a sample {low.noise_percent:.2g} % of |Z|; {capacitor_from(verdicts)}."
    )


def _outside(rows: Sequence[ImpedanceRow], part: str) -> Iterator[str]:
    """Frequencies at which R or X is beyond its predicted range by more than its own error."""
    of = part.lower()
    for row in rows:
        low, high = getattr(row, f"{of}_from_ohm"), getattr(row, f"{of}_to_ohm")
        value, error = getattr(row, f"{of}_ohm"), _SURE * getattr(row, f"{of}_error_ohm")
        if low is not None and not low - error <= value <= high + error:
            yield at_text(row.frequency_hz)


def residuals(impedances: Sequence[ImpedanceRow]) -> Iterator[Figure]:
    """Of R and X, relative to the prediction's magnitude."""
    rows = _compared(impedances)
    if not rows:
        return
    x, names = [row.frequency_hz for row in rows], [row.recording for row in rows]
    both = np.array([(row.r_residual, row.x_residual) for row in rows], float).T.tolist()
    panels = tuple(
        Panel((Curve("points", "", x, values, text=names, colour=colour),), Axis("frequency [Hz]", log=True),
              Axis(f"residual of {part} / |Z|"))
        for part, values, colour in zip("RX", both, (BLUE, ORANGE), strict=True)
    )  # fmt: skip
    yield Figure(
        "impedance-residuals", "Impedance at rest: measured - predicted",
        "Difference of measured and predicted R above and X below, as a share of the predicted |Z|, over frequency.",
        {"": panels},
    )  # fmt: skip


def figures(recorded: Sequence[RecordedRun]) -> Iterator[Figure]:
    """Differences of all recordings on a scale of their own, then each recording over time and over loads."""
    yield from compared(recorded)
    for run in recorded:
        key = f"{run.entry.number}-{run.source.lockin}" + f"-{run.source.part}" * bool(run.source.part)
        yield plots.series(run, f"series-{key}", len(recorded))
        for part in plots.PARTS:
            try:
                yield plots.differences(run, part, f"{part}-{key}", len(recorded))
            except SensorgenError:  # no loads, or all on one line: there is no surface
                continue


def compared(recorded: Sequence[RecordedRun]) -> Iterator[Figure]:
    """Normalised differences under load, of recordings with the same frequencies (thesis Fig. 6.33)."""
    loaded = [run for run in recorded if run.pairs is not None and len(run.pairs.time_s) > 1]
    if not loaded:
        return
    tones_hz = loaded[0].tones_hz
    alike = {
        run.name: run.pairs for run in loaded if run.pairs is not None and len(run.tones_hz) == len(tones_hz)
        and np.allclose(run.tones_hz, tones_hz, rtol=_SAME)
    }  # fmt: skip
    rest = len(loaded) - len(alike)
    yield plots.compared(
        alike, tones_hz, left_out=f" Left out: {rest} recordings of other frequencies." if rest else ""
    )
