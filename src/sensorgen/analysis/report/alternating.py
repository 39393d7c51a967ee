"""AC readings of specimens, frequency by frequency, beside the prediction of the print."""

from cmath import phase
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, nan, pi
from statistics import median
from typing import Annotated

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.comparison.expected import Predicted
from sensorgen.analysis.plots.figure import BLUE, GREY, Axis, Curve, Figure, Panel
from sensorgen.core.document import Cell, Column, some
from sensorgen.core.lazy import by_key
from sensorgen.core.units import frequency_text
from sensorgen.measure import accuracy
from sensorgen.measure.log import Reading
from sensorgen.prediction.quantities import parallel_range_f
from sensorgen.prediction.query import TONES_HZ

F_PER_PF = 1e-12
BAKED = {True: "baked", False: "not baked", None: "unknown"}


@dataclass(frozen=True)
class AcRow:
    """A reading at one frequency beside its prediction."""

    number: Annotated[int, Column("reading", "", "number in the log")]
    specimen: Annotated[str, Column("specimen")]
    design: Annotated[str, Column("design")]
    baked: Annotated[str, Column("bake")]
    frequency_hz: Annotated[float, Column("frequency", "Hz")]
    c_pf: Annotated[float, Column("Cp measured", "pF", "in parallel")]
    c_error_pf: Annotated[float, Column("± C", "pF", "standard uncertainty")]
    c_predicted_pf: Annotated[Cell, Column("C predicted", "pF", "as printed")]
    c_from_pf: Annotated[Cell, Column("C from", "pF")]
    c_to_pf: Annotated[Cell, Column("C to", "pF")]
    c_ratio: Annotated[float, Column("Cp measured / C predicted")]
    z_ohm: Annotated[float, Column("|Z| measured", "ohm")]
    z_error_ohm: Annotated[float, Column("± |Z|", "ohm", "standard uncertainty")]
    z_predicted_ohm: Annotated[Cell, Column("|Z| predicted", "ohm")]
    z_from_ohm: Annotated[Cell, Column("|Z| from", "ohm")]
    z_to_ohm: Annotated[Cell, Column("|Z| to", "ohm")]
    z_ratio: Annotated[float, Column("|Z| measured / predicted")]
    phase_deg: Annotated[float, Column("phase", "deg")]
    verdict: Annotated[str, Column("verdict")]
    flag: Annotated[str, Column("flag")]


def verdict(z: complex) -> str:
    """Verdict at one frequency.

    >>> verdict(100 - 1000j), verdict(1000 - 100j), verdict(50 + 0j), verdict(-3 - 10j)
    ('capacitor', 'leaking', 'short', 'negative resistance')
    """
    if z.real < 0:
        return "negative resistance"
    if z.imag >= 0:
        return "short"
    return "capacitor" if -z.imag >= z.real else "leaking"


def rows(comparison: Comparison) -> list[AcRow]:
    """A row for each reading and frequency, in the order of the log."""
    return [
        _row(reading, frequency_hz, comparison.predictions.get(comparison.names.get(reading.specimen, "")))
        for reading in comparison.alternating
        for frequency_hz in sorted(set(reading.frequency_hz))
    ]


def _row(reading: Reading, frequency_hz: float, of: Predicted | None) -> AcRow:
    at = accuracy.at_frequency(reading, frequency_hz)
    z = at.z_ohm if at.impedances else None
    c, size = at.value("Cp"), at.value("Z")
    c_range, z_range = _predicted(of, frequency_hz)
    in_pf = [None if each is None else each / F_PER_PF for each in c_range]
    return AcRow(
        reading.number, reading.specimen, of.design if of else "", BAKED[reading.baked], frequency_hz,
        c.value / F_PER_PF, c.error / F_PER_PF, in_pf[0], in_pf[1], in_pf[2],
        c.value / c_range[0] if c_range[0] else nan, size.value, size.error, *z_range,
        size.value / z_range[0] if z_range[0] else nan, degrees(phase(z)) if z else nan,
        verdict(z) if z is not None else "", "; ".join(_flags(at, frequency_hz)),
    )  # fmt: skip


def _flags(at: accuracy.At, frequency_hz: float) -> Iterator[str]:
    meter, z, c = at.meter, at.z_ohm, at.value("Cp")
    if (z.real if z is not None and at.impedances else at.value("R").value) < 0:
        yield "negative resistance"
    if meter and z is not None and meter.ac("Z", abs(z), frequency_hz, z) is None:
        yield f"outside the range of {meter.name}"
    if isfinite(c.value) and c.value <= 0:
        yield "no positive capacitance"


_Range = tuple[float | None, float | None, float | None]


def _predicted(of: Predicted | None, frequency_hz: float) -> tuple[_Range, _Range]:
    """Parallel capacitance [F] and magnitude [ohm], each with its range."""
    nothing: _Range = (None, None, None)
    z = of.impedance_at(frequency_hz) if of else None
    if of is None or z is None:
        return nothing, nothing
    c, by = (1 / z[0]).imag / (2 * pi * frequency_hz), parallel_range_f(of.prediction, frequency_hz)
    low, high = sorted((abs(z[1]), abs(z[2])))
    return (c, min(by.lower, c), max(by.upper, c)), (abs(z[0]), min(low, abs(z[0])), max(high, abs(z[0])))


def _compared(rows: Sequence[AcRow]) -> list[AcRow]:
    """Rows whose capacitance can be compared with a prediction; flagged ones where there are no others."""
    known = [row for row in rows if isfinite(row.c_ratio) and row.c_ratio > 0]
    return [row for row in known if not row.flag] or known


def headline(rows: Sequence[AcRow]) -> Iterator[str]:
    """Capacitance against the prediction, in one sentence."""
    known = _compared(rows)
    if not known:
        return
    counts = Counter(row.frequency_hz for row in known)
    lowest = min(counts, key=lambda f: (-counts[f], f))
    here = [row for row in known if row.frequency_hz == lowest]
    inside = sum(row.c_from_pf <= row.c_pf <= row.c_to_pf for row in here)  # type: ignore[operator]
    at = at_text(lowest)
    if len(here) == 1:
        yield _headline_of_one(here[0], at, inside=bool(inside))
        return
    specimens = len({row.specimen for row in here})
    yield (
        f"Capacitance at {at}: measured {median(row.c_ratio for row in here):.3g} times the prediction as printed "
        f"(median of {len(here)} readings of {specimens} specimens; {inside} within its range)."
    )


def _headline_of_one(row: AcRow, at: str, *, inside: bool) -> str:
    error = f" ± {row.c_error_pf:.2g}" if isfinite(row.c_error_pf) else ""
    return (
        f"Capacitance of {row.specimen} at {at}: measured {row.c_pf:.4g}{error} pF, predicted as printed "
        f"{row.c_predicted_pf:.4g} pF ({row.c_from_pf:.3g} to {row.c_to_pf:.3g}): ratio {row.c_ratio:.3g}, "
        f"{'within' if inside else 'outside'} the range."
    )


def at_text(frequency_hz: float) -> str:
    """Frequency for people.

    >>> at_text(3.000000000000001e6), at_text(10100.0)
    ('3MHz', '10.1kHz')
    """
    return frequency_text(float(f"{frequency_hz:.4g}"))


def findings(rows: Sequence[AcRow]) -> Iterator[str]:
    """From which frequency on each specimen is a capacitor, and how many values are flagged."""
    verdicts: dict[str, dict[float, str]] = {}
    for row in rows:
        if row.verdict:
            verdicts.setdefault(row.specimen, {})[row.frequency_hz] = row.verdict
    sentences = by_key((capacitor_from(of), specimen) for specimen, of in verdicts.items())
    yield from (f"By frequency: {some(names, 8)}: {words}." for words, names in sentences.items())
    if flagged := [row.flag for row in rows if row.flag]:
        kinds = Counter("; ".join(flagged).split("; "))
        counted = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        yield f"Flagged: {len(flagged)} of {len(rows)} AC values ({counted}): check contacts, compensation and range."


def capacitor_from(verdicts: dict[float, str]) -> str:
    """In words, from which frequency on all verdicts are "capacitor".

    >>> capacitor_from({1e3: "leaking", 5e3: "capacitor", 1e4: "capacitor"})
    'a capacitor from 5kHz on'
    """
    rising = sorted(verdicts)
    start = len(rising)
    while start and verdicts[rising[start - 1]] == "capacitor":
        start -= 1
    if start == len(rising):
        return f"no capacitor up to {at_text(rising[-1])}"
    if start == 0:
        span = at_text(rising[0]) + (f" to {at_text(rising[-1])}" if len(rising) > 1 else "")
        return f"a capacitor at {span}"
    return f"a capacitor from {at_text(rising[start])} on"


def behind_leak(comparison: Comparison) -> Iterator[str]:
    """Above which frequency a film that leaks at DC is a capacitor, if it has the predicted capacitance."""
    corners = [
        row.verdict.leak_s / (2 * pi * c.value) for row in comparison.last
        if row.verdict.film == "leak" and row.predicted and (c := row.predicted.prediction.capacitance)
        and isfinite(row.verdict.leak_s)
    ]  # fmt: skip
    if corners:
        within = sum(corner <= TONES_HZ[-1] for corner in corners)
        yield (
            f"By frequency: {within} of {len(corners)} films that leak at DC should be capacitors at "
            f"{at_text(TONES_HZ[-1])} with the predicted capacitance, the best from {at_text(min(corners))} on."
        )


def figures(rows: Sequence[AcRow]) -> Iterator[Figure]:
    """Measured over predicted capacitance, by frequency."""
    known = _compared(rows)
    if len(known) < 2:
        return
    at = sorted({row.frequency_hz for row in known})
    curves = (
        Curve("points", "measured / predicted", [row.frequency_hz for row in known], [row.c_ratio for row in known],
              text=[f"{row.specimen}, reading {row.number}" for row in known], colour=BLUE),
        Curve("line", "as predicted", [at[0], at[-1]], [1.0, 1.0], colour=GREY, dash="dash"),
        Curve("line", "ends of its range", at, _ends(known, "c_from_pf", min), colour=GREY, dash="dot"),
        Curve("line", "", at, _ends(known, "c_to_pf", max), colour=GREY, dash="dot"),
    )  # fmt: skip
    yield Figure(
        "capacitance", "Capacitance: measured / predicted as printed",
        "Measured over predicted capacitance by frequency, a point for each reading; dotted: the prediction's range.",
        {"": (Panel(curves, Axis("frequency [Hz]", log=True), Axis("measured / predicted")),)},
    )  # fmt: skip


def _ends(known: Iterable[AcRow], key: str, outermost: Callable[[float, float], float]) -> list[float]:
    """Outermost end of the predictions' ranges over their values, by rising frequency [-]."""
    ends: dict[float, float] = {}
    for row in known:
        over = getattr(row, key) / row.c_predicted_pf
        ends[row.frequency_hz] = outermost(over, ends.get(row.frequency_hz, over))
    return [ends[frequency_hz] for frequency_hz in sorted(ends)]
