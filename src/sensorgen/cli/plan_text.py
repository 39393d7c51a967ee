"""How plans are printed: what is expected of every candidate before, and what came of it after."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from sensorgen.cli import show

Data = Mapping[str, Any]


def planned(plan: Data) -> Iterator[str]:
    """A plan before anything is asked: :func:`sensorgen.prediction.plan.plain` of one, as lines."""
    yield f"plan for an accuracy of {plan['accuracy']:g} of {plan['of']}"
    yield from _levels(plan["levels"], expectation)
    yield "  the first that should do is taken, or else the one that should come nearest"


def measured(plan: Data) -> Iterator[str]:
    """What came of it."""
    yield "measured"
    yield from _levels(plan["levels"], lambda candidate, _: came(candidate))
    if plan["width"] is not None:
        yield f"  all levels together: {plan['width']:.2g} of {plan['accuracy']:g}"


def shares(plan: Data) -> Iterator[str]:
    """What each level came to, by whom, as far as it is known."""
    for level in plan["levels"]:
        for c in level["candidates"]:
            if c["model"] == level["chosen"]:
                width = "of no known error" if c["width"] is None else f"{c['width']:.2g}"
                yield f"{level['name']} {width} ({c['model']})"


def _levels(levels: Iterable[Data], told: Callable[[Data, float], str]) -> Iterator[str]:
    for level in levels:
        yield f"  {level['name']}: {level['measure']}, at most {level['allowed']:.2g}"
        for candidate in level["candidates"]:
            mark = ">" if candidate["model"] == level["chosen"] else " "
            words = told(candidate, level["allowed"])
            yield f"  {mark} {candidate['model']:26}{words:28}{candidate['passed_over']}".rstrip()


def expectation(candidate: Data, wanted: float) -> str:
    """What is expected of a candidate."""
    width, seconds = candidate["expected_width"], candidate["expected_seconds"]
    if seconds is None:
        return "" if candidate["passed_over"] else "in any case"
    time = "at once" if seconds == 0 else f"in about {_seconds(seconds)}"
    if width is None:
        return f"nobody knows how far, {time}"
    reach = "exact" if width == 0 else f"within {wanted:.3g}" if width <= wanted else f"about {width:.2g}"
    return f"{reach} {time}"


def came(candidate: Data) -> str:
    """What a candidate gave, or that it was not asked."""
    width, seconds = candidate["width"], candidate["seconds"]
    if seconds is None:
        return "not asked" if width is None else f"{width:.2g}"
    how = "nobody knows how far" if width is None else f"{width:.2g}"
    return f"{how} in {_seconds(seconds)}"


def _seconds(value: float) -> str:
    return show.si(float(f"{value:.2g}"), "s")
