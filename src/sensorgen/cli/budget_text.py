"""How the error budget is printed."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

WIDTH = 80
HEADS = {"magnitude": "|Z|", "re": "R", "im": "X", "by_force": "dZ/dF"}


def lines(found: Mapping[str, Any]) -> Iterator[str]:
    """What :func:`sensorgen.prediction.error_budget.budget` found, as lines of text."""
    press = found["press"]
    yield f"error budget at {press['force_n']:g} N and {press['position_m'] * 1e3:g} mm, at the worst tone:"
    yield f"{'':22}" + "".join(f"{name:>11}" for name in HEADS.values())
    for term in found["terms"]:
        yield f"  {term['name']:20}" + _row(term["shares"] or dict.fromkeys(HEADS), at_least=term["at_least"])
    yield f"  {'all at their worst':20}" + _row(found["total"], at_least=found["at_least"])
    largest = found["largest"]
    what = {term["name"]: term["what"] for term in found["terms"]}
    named = list(dict.fromkeys(largest.values()))
    of = "; ".join(f"{name} ({what[name]}) for {_measures(largest, name)}" for name in named)
    yield from _paragraph(f"largest: {of}")
    if found["accuracy"]:
        yield from _paragraph(_verdict(found["accuracy"]))


def _measures(largest: Mapping[str, str], name: str) -> str:
    return ", ".join(HEADS[m] for m, value in largest.items() if value == name)


def _row(shares: Mapping[str, float | None], *, at_least: bool) -> str:
    return "".join(f"{_percent(shares[m], '>' * at_least):>11}" for m in HEADS)


def _percent(share: float | None, before: str) -> str:
    if share is None:
        return "unknown"
    percent = 100 * share
    return f"{before}{percent:.0f} %" if percent >= 99.5 else f"{before}{percent:.2g} %"


def _verdict(asked: Mapping[str, Any]) -> str:
    if asked["met"]:
        return f"an accuracy of {asked['asked']:g} of |Z| is met"
    by_models = "by the models, but not by what the materials are known to" if asked["met_by_models"] else ""
    missed = f"; above it alone: {', '.join(asked['missed_by'])}" if asked["missed_by"] else ""
    return f"an accuracy of {asked['asked']:g} of |Z| is {f'met {by_models}' if by_models else 'not met'}{missed}"


def _paragraph(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ")
