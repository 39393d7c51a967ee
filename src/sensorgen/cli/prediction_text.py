"""A prediction as lines of text."""

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

from sensorgen.cli import card_text
from sensorgen.cli.show import WIDTH, si
from sensorgen.core.units import PREFIXES

if TYPE_CHECKING:
    from sensorgen.core.bounds import Bounds
    from sensorgen.prediction.results import Changes, ErrorBudget, Prediction

_LABEL, _CELL = 21, 30


def table(found: "Prediction") -> Iterator[str]:
    """Quantities of the print beside the drawing's: the best value and the range with all errors."""
    columns = [found.drawn, found] if found.drawn else [found]
    yield _row("", [p.body.partition(",")[0] for p in columns])
    yield _row("electrode gap", [_bounds(p.gap) for p in columns])
    yield _row("capacitance", [_bounds(p.capacitance) if p.capacitance else p.status for p in columns])
    for end in found.resistance:
        yield _row(f"{end} electrode", [_bounds(p.resistance.get(end)) for p in columns])
    unit = " 1/kPa"
    yield _row("sensitivity [1/kPa]", [_bounds(p.sensitivity).replace(unit, "") for p in columns])
    yield _row("force resolution", [_value(p.force_resolution_n, "N") for p in columns])
    yield _row("position resolution", [_value(p.position_resolution_m, "m") for p in columns])
    load = f"resolution at {found.force_n:g} N and {found.position_m * 1e3:g} mm"
    yield from textwrap.wrap(f"({load}; {found.body})", WIDTH)


def _row(label: str, cells: list[str]) -> str:
    return (f"{label:{_LABEL}}" + "".join(f"{cell:{_CELL}}" for cell in cells)).rstrip()


def _bounds(bounds: "Bounds | None") -> str:
    """Best value, and the range in the same unit."""
    if bounds is None:
        return "-"
    prefix, scale = _prefix(bounds.value, bounds.unit)
    low, value, high = (end / scale for end in (bounds.lower, bounds.value, bounds.upper))
    unit = f"{prefix}{bounds.unit}"
    if f"{low:.2g}" == f"{high:.2g}":
        return f"{value:.4g} {unit}"
    return f"{value:.3g} {unit} ({_short(low)} to {_short(high)})"


def _prefix(value: float, unit: str) -> tuple[str, float]:
    """SI prefix for a value and its size; lengths in mm, and ratios and forces without one."""
    if unit == "m":
        return "m", 1e-3
    if unit in ("N", "1/kPa") or not value:
        return "", 1.0
    power = max((p for p in PREFIXES if abs(value) >= 10.0**p), default=min(PREFIXES))
    return PREFIXES[power], 10.0**power


def _short(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def _value(value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    prefix, scale = _prefix(value, unit)
    return f"{_short(value / scale)} {prefix}{unit}"


def impedance(found: "Prediction") -> Iterator[str]:
    """Impedance at rest: the best value, and the range with all errors."""
    yield f"{'at rest':>9} {'Re [ohm]':>9} {'range':^21} {'Im [ohm]':>11} {'range':^23}".rstrip()
    for row in found.impedance:
        re, im = (f"{part.lower:.3g} to {part.upper:.3g}" for part in (row.re, row.im))
        values = f"{row.re.value:9.5g} {re:^21} {row.im.value:11.5g} {im:^23}"
        yield f"{si(row.frequency_hz, 'Hz'):>9} {values}".rstrip()


def ranges(found: "Prediction") -> Iterator[str]:
    """What the ranges hold, each error alone."""
    c = found.capacitance
    certified = " (certified)" if c and c.certified else ""
    rows = {"capacitance": c, **{f"{end} electrode": r for end, r in found.resistance.items()}}
    yield f"{'range of':18}{'model' + certified:>20}{'print':>20}{'material':>20}"
    for name, bounds in rows.items():
        if bounds and bounds.value:
            parts = (bounds.model, bounds.print, bounds.material)
            cells = (f"{_percent(i.lower, bounds.value)} to {_percent(i.upper, bounds.value)} %" for i in parts)
            yield f"{name:18}" + "".join(f"{cell:>20}" for cell in cells)


def _percent(end: float, value: float) -> str:
    change = 100 * (end / value - 1)
    return f"{change:+.2g}" if abs(change) >= 0.005 else "0"


def whole(found: "Prediction") -> Iterator[str]:
    """The prediction, what its ranges hold, impedance, identifiability and error budget."""
    if found.capacitance is None:
        yield from textwrap.wrap(f"{found.design}: {found.reason}", WIDTH)
        if found.drawn and found.drawn.capacitance:
            yield from ("", *table(found))
        return
    yield f"{found.design}"
    yield from table(found)
    yield ""
    yield from ranges(found)
    yield f"corner frequency      {_bounds(found.corner_frequency)}"
    yield ""
    yield from impedance(found)
    yield ""
    yield from judgement(found)
    yield ""
    for assumption in found.assumptions:
        yield from textwrap.wrap(f"assumed: {assumption}", WIDTH, subsequent_indent="  ")


def judgement(found: "Prediction") -> Iterator[str]:
    """Identifiability and error budget; or why there are none."""
    if found.identifiability:
        yield from card_text.lines(found.identifiability)
    elif found.reason:
        yield from textwrap.wrap(f"no load: {found.reason}", WIDTH)
    if found.budget:
        yield from ("", *budget(found.budget))


def budget(found: "ErrorBudget") -> Iterator[str]:
    """The error budget as a table."""
    yield f"error budget at {found.force_n:g} N and {found.position_m * 1e3:g} mm, at the worst frequency:"
    yield f"  {'':22}{'|Z|':>11}{'R':>11}{'X':>11}{'dZ/dF':>11}"
    for term in found.terms:
        yield f"  {term.name:22}" + _shares(term.changes, at_least=term.at_least)
    if found.total:
        yield f"  {'all at their worst':22}" + _shares(found.total, at_least=found.at_least)
    largest = found.largest()
    yield from textwrap.wrap(f"largest: {largest.name} ({largest.what})", WIDTH, initial_indent="  ",
                             subsequent_indent="    ")  # fmt: skip
    if found.accuracy:
        yield from textwrap.wrap(_accuracy(found), WIDTH, initial_indent="  ", subsequent_indent="    ")


def _accuracy(found: "ErrorBudget") -> str:
    """Whether the accuracy of abs(Z) that was asked for is reached, by the models and by everything."""
    beyond = f"; larger alone: {', '.join(found.beyond())}" if found.beyond() else ""
    if found.met_by("model", "print", "material"):
        return f"accuracy {found.accuracy:g} of |Z| reached"
    if found.met_by("model"):
        return f"accuracy {found.accuracy:g} of |Z| reached by the models, not by print and material data{beyond}"
    return f"accuracy {found.accuracy:g} of |Z| not reached by the models{beyond}"


def _shares(changes: "Changes | None", *, at_least: bool) -> str:
    if changes is None:
        return "    unknown" * 4
    values = (changes.magnitude, changes.re, changes.im, changes.by_force)
    return "".join(f"{'>' * at_least + _share(v):>11}" for v in values)


def _share(value: float) -> str:
    return f"{100 * value:.2g} %" if 0 < 100 * value < 100 else f"{100 * value:.0f} %"
