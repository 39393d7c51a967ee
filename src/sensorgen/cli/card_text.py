"""Identifiability as text."""

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from sensorgen.cli.show import si

if TYPE_CHECKING:
    from sensorgen.prediction.identifiability.results import (
        FrequencyChoice,
        FrequencyInformation,
        Identifiability,
        StandardErrors,
    )

WIDTH = 80
FREQUENCIES = 7  # of more, those with most information on position are shown
_COLUMNS = (10, 11, 11, 13, 14, 9)


def card(found: "Identifiability") -> None:
    """Print in less than thirty lines of at most ``WIDTH`` columns."""
    for line in lines(found):
        click.echo(line)


def lines(found: "Identifiability") -> Iterator[str]:
    """Lines of text."""
    yield from _paragraph("verdict", found.verdict + ".")
    for doubt in found.doubts:
        yield from _paragraph("doubtful", doubt)
    if found.stiffest:
        yield from _paragraph("", found.stiffest.verdict + ".")
    yield f"{'frequencies':12}at {found.press.force_n:g} N and {found.press.position_m * 1e3:g} mm:"
    yield _row("frequency", "|Z|", "per N", "per mm", "info on force", "position")
    known = sorted(found.frequencies, key=lambda row: -(row.share_of_position_information or 0.0))[:FREQUENCIES]
    yield from (_frequency(row) for row in sorted(known, key=lambda row: row.frequency_hz))
    yield from _paragraph("over all", "; ".join(_over(found)))
    yield from _paragraph("best", "; ".join(_best(found)))
    if not found.changes:
        yield f"{'to improve':12}none of the changes that were tried"
    for k, change in enumerate(found.changes):
        yield from _paragraph("" if k else "to improve", f"{k + 1}. {change.change}: {_known(change)}")
    if found.changes_together and len(found.changes) > 1:
        yield f"{'':12}all together: {_known(found.changes_together)}"


def _frequency(row: "FrequencyInformation") -> str:
    by_force = f"{100 * abs(row.relative_by_force_per_n):.2g} %/N"
    by_position = f"{100 * abs(row.relative_by_position_per_m) * 1e-3:.2g} %/mm"
    shares = (_percent(row.share_of_force_information), _percent(row.share_of_position_information))
    return _row(si(row.frequency_hz, "Hz"), si(row.magnitude_ohm, "ohm"), by_force, by_position, *shares)


def _row(*cells: str) -> str:
    return f"{'':4}" + " ".join(f"{cell:>{width}}" for cell, width in zip(cells, _COLUMNS, strict=True))


def _over(found: "Identifiability") -> Iterator[str]:
    """Medians, worst presses, and the share of presses that is known as required."""
    of = {"N": found.map.of_force, "m": found.map.of_position}
    yield "median " + ", ".join(_short(row.median, unit) for unit, row in of.items())
    worst = []
    for unit, row in of.items():
        at = row.worst_position_m
        worst.append(
            _short(row.worst, unit) + ("" if at is None else f" (at {row.worst_force_n:g} N, {at * 1e3:g} mm)")
        )
    yield "worst " + ", ".join(worst)
    need, (force, position) = found.required, of.values()
    yield (
        f"above {force.from_force_n:g} N, force is resolved to {_short(need.sigma_force_n, 'N')} in "
        f"{_percent(force.share_known)} of presses, position to {_short(need.sigma_position_m, 'm')} in "
        f"{_percent(position.share_known)}"
    )
    if found.map.doubt:
        yield found.map.doubt


def _best(found: "Identifiability") -> Iterator[str]:
    """The best of the given frequencies, and of all that the instrument can give."""
    better = found.advised_frequencies
    if not better.pair.frequency_hz:
        yield "no frequencies determine both force and position"
        return
    yield from (_named(best) for best in found.best_frequencies if best.frequency_hz)
    yield f"of all up to {si(better.highest_hz, 'Hz')}: {_named(better.single)}; {_named(better.pair)}"


def _named(chosen: "FrequencyChoice") -> str:
    return f"{' + '.join(f'{f / 1e3:.3g}' for f in chosen.frequency_hz)} kHz ({_known(chosen)})"


def _known(errors: "StandardErrors") -> str:
    return f"{_short(errors.sigma_force_n, 'N')}, {_short(errors.sigma_position_m, 'm')}"


def _short(value: float | None, unit: str) -> str:
    from sensorgen.prediction.identifiability.verdict import metres, newtons

    return (newtons if unit == "N" else metres)(float("nan") if value is None else value)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f} %"


def _paragraph(head: str, text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=f"{head:12}", subsequent_indent=" " * 12)
