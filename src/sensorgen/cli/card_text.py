"""How the identifiability card is printed."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import click

from sensorgen.cli.show import si

WIDTH = 80
_COLUMNS = (10, 11, 11, 13, 14, 9)
TONES = 7  # of more, those with most to tell of position are shown


def card(found: Mapping[str, Any]) -> None:
    """Print an identifiability card: less than thirty lines of at most ``WIDTH`` columns."""
    for line in lines(found):
        click.echo(line)


def of_prediction(predicted: Mapping[str, Any]) -> Iterator[str]:
    """The card that comes with a prediction, as lines; nothing where nothing is predicted."""
    found = predicted.get("identifiability")
    if found:
        yield ""
        yield from lines(found) if found["verdict"] else [f"no identifiability card: {found['reason']}"]


def lines(found: Mapping[str, Any]) -> Iterator[str]:
    """The card as lines of text."""
    yield from _paragraph("verdict", found["verdict"] + ".")
    for doubt in found.get("doubts", ()):
        yield from _paragraph("doubtful", doubt)
    if found["stiffest"]:
        yield from _paragraph("", found["stiffest"]["verdict"] + ".")
    press = found["press"]
    yield f"{'tones':12}at {press['force_n']:g} N and {press['position_m'] * 1e3:g} mm:"
    yield from _tones(found["tones"])
    yield from _paragraph("over all", "; ".join(_over(found)))
    yield from _paragraph("best tones", "; ".join(_best(found)))
    yield from _changes(found)


def _tones(tones: list[Mapping[str, Any]]) -> Iterator[str]:
    """Relative changes per newton and millimetre, to be held against the noise."""
    yield _row("frequency", "|Z|", "by force", "by place", "told of force", "of place")
    told = sorted(tones, key=lambda tone: -(tone["share_of_position_information"] or 0.0))[:TONES]
    for tone in sorted(told, key=lambda tone: float(tone["frequency_hz"])):
        by_force = 100 * abs(_complex(tone["relative_by_force_per_n"]))
        by_place = 100 * abs(_complex(tone["relative_by_position_per_m"])) * 1e-3
        shares = [_percent(tone[f"share_of_{what}_information"]) for what in ("force", "position")]
        magnitude = si(tone["magnitude_ohm"], "ohm")
        yield _row(si(tone["frequency_hz"], "Hz"), magnitude, f"{by_force:.2g} %/N", f"{by_place:.2g} %/mm", *shares)


def _row(*cells: str) -> str:
    return f"{'':4}" + " ".join(f"{cell:>{width}}" for cell, width in zip(cells, _COLUMNS, strict=True))


def _over(found: Mapping[str, Any]) -> Iterator[str]:
    """Medians, worst places, and how much of the sensor serves."""
    of = {"N": found["map"]["of_force"], "m": found["map"]["of_position"]}
    yield "median " + ", ".join(_short(row["median"], unit) for unit, row in of.items())
    yield "worst " + ", ".join(_short(row["worst"], unit) + _place(row["worst_at"]) for unit, row in of.items())
    need = found["required"]
    shares = [_percent(row["share_known"]) for row in of.values()]
    yield (
        f"of the presses from {of['N']['from_force_n']:g} N on {shares[0]} are known to "
        f"{_short(need['sigma_force_n'], 'N')}, {shares[1]} to {_short(need['sigma_position_m'], 'm')}"
    )
    if found["map"]["doubt"]:
        yield found["map"]["doubt"]


def _place(at: Mapping[str, float] | None) -> str:
    return f" (at {at['force_n']:g} N, {at['position_m'] * 1e3:g} mm)" if at else ""


def _best(found: Mapping[str, Any]) -> Iterator[str]:
    """The best of the given tones, and of all that the instrument can give."""
    better = found["advised_tones"]
    if better["pair"]["frequency_hz"] is None:
        yield "no tones tell both force and position"
        return
    yield from (_named(best) for best in found["best_tones"] if best["frequency_hz"])
    yield f"of all up to {si(better['highest_hz'], 'Hz')}: {_named(better['single'])}; {_named(better['pair'])}"


def _changes(found: Mapping[str, Any]) -> Iterator[str]:
    if not found["changes"]:
        yield f"{'would help':12}none of the changes that were tried"
        return
    for k, change in enumerate(found["changes"]):
        yield from _paragraph("" if k else "would help", f"{k + 1}. {change['change']}: {_known(change)}")
    if found["changes_together"] and len(found["changes"]) > 1:
        yield f"{'':12}all at once: {_known(found['changes_together'])}"


def _named(tones: Mapping[str, Any]) -> str:
    return f"{' + '.join(f'{f / 1e3:.3g}' for f in tones['frequency_hz'])} kHz ({_known(tones)})"


def _known(row: Mapping[str, Any]) -> str:
    return f"{_short(row['sigma_force_n'], 'N')}, {_short(row['sigma_position_m'], 'm')}"


def _short(value: float | None, unit: str) -> str:
    from sensorgen.prediction.identifiability.verdict import metres, newtons

    return (newtons if unit == "N" else metres)(float("nan") if value is None else value)


def _complex(parts: Mapping[str, float]) -> complex:
    return complex(parts["re"], parts["im"])


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f} %"


def _paragraph(head: str, text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=f"{head:12}", subsequent_indent=" " * 12)
