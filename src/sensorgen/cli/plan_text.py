"""A plan as lines of text: candidate models of each level, expected and reached error and time."""

from collections.abc import Iterator
from math import inf
from typing import TYPE_CHECKING

from sensorgen.cli.show import si

if TYPE_CHECKING:
    from sensorgen.prediction.plan import Candidate, Plan


def lines(plan: "Plan") -> Iterator[str]:
    """The plan, with the results where it was run."""
    yield f"plan for an accuracy of {plan.accuracy:g} of {plan.of}"
    yield f"  {'':28}{'expected':26}{'reached':20}"
    for level in plan.levels:
        yield f"  {level.name}: {level.measure}, tolerance {level.allowed:.2g}"
        for c in level.candidates:
            mark = ">" if c.model == level.chosen else " "
            reached = _of(c.width, c.seconds) if c.seconds is not None or c.width is not None else "not run"
            yield f"  {mark} {c.model:26}{expectation(c):26}{reached:20}{c.passed_over}".rstrip()
    if plan.width is not None:
        yield f"  all levels together: {_error(plan.width)}"


def shares(plan: "Plan") -> Iterator[str]:
    """Error that the chosen model of each level reached."""
    for level in plan.levels:
        for c in level.candidates:
            if c.model == level.chosen:
                yield f"{level.name} {_error(c.width)} ({c.model})"


def expectation(candidate: "Candidate") -> str:
    """Expected error and time."""
    if candidate.expected_seconds is None:
        return "" if candidate.passed_over else "always run"
    return _of(candidate.expected_width, candidate.expected_seconds)


def _of(width: float | None, seconds: float | None) -> str:
    time = "" if seconds is None else " instant" if seconds == 0 else f" in {si(float(f'{seconds:.2g}'), 's')}"
    return _error(width) + time


def _error(width: float | None) -> str:
    if width in (None, inf):
        return "error unknown"
    return "exact" if width == 0 else f"{width:.2g}"
