"""Plans as databases print them: candidate models of each level, expected cost and error, and what they reached."""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any, TypeVar

from sensorgen.core.errors import SensorgenError

Found = TypeVar("Found")


@dataclass(frozen=True)
class Candidate:
    """A model in a plan: expected and reached error and time.

    Attributes
    ----------
    model : str
        Its name.
    expected_width, expected_seconds : float or None
        Error in the measure of its level [-] and time [s], scaled from the scene of its benchmark; None without one.
    passed_over : str
        Why it was not run, or "".
    width, seconds : float or None
        Error that it reached [-], and run time without imports [s].
    """

    model: str
    expected_width: float | None = None
    expected_seconds: float | None = None
    passed_over: str = ""
    width: float | None = None
    seconds: float | None = None

    def reach(self) -> float:
        """Expected error; 0 without a benchmark, so that it is tried."""
        return self.expected_width or 0.0


@dataclass(frozen=True)
class Level:
    """One level of models that a prediction rests on.

    Attributes
    ----------
    name : str
        "cell", "compression" or "line".
    measure : str
        What the errors of its candidates are of, in words.
    allowed : float
        Tolerance [-].
    candidates : tuple of Candidate
        The least expensive first.
    chosen : str
        The model whose answer is used, or that is expected to meet the tolerance; "" where none applies.
    """

    name: str
    measure: str
    allowed: float
    candidates: tuple[Candidate, ...]
    chosen: str = ""


@dataclass(frozen=True)
class Plan:
    """How a tolerance is met, level by level.

    Attributes
    ----------
    accuracy : float
        Wanted of the answer, relative [-].
    of : str
        Quantity and reference load, in words.
    levels : tuple of Level
        In the order in which they run.
    width : float or None
        Error of all levels together; infinite where one is unknown [-].
    """

    accuracy: float
    of: str
    levels: tuple[Level, ...]
    width: float | None = None


def without_times(plan: Plan) -> Plan:
    """The plan without run times, which differ from run to run."""
    levels = (
        replace(level, candidates=tuple(replace(c, seconds=None, expected_seconds=None) for c in level.candidates))
        for level in plan.levels
    )
    return replace(plan, levels=tuple(levels))


def plain(plan: Plan) -> dict[str, Any]:
    """A plan as plain data; unknown errors are None."""
    data = asdict(plan)
    for part in (data, *(c for level in data["levels"] for c in level["candidates"])):
        part |= {key: None for key in ("width", "expected_width") if part.get(key) == inf}
    return data


def of_plain(data: dict[str, Any]) -> Plan:
    """A plan from :func:`plain` data."""
    levels = (
        Level(**level | {"candidates": tuple(Candidate(**c) for c in level["candidates"])}) for level in data["levels"]
    )
    return Plan(**data | {"levels": tuple(levels)})


def cheapest(candidates: tuple[Candidate, ...], allowed: float) -> str:
    """Name of the first candidate expected within tolerance; else of the one with the least expected error."""
    able = [c for c in candidates if not c.passed_over]
    enough = [c for c in able if c.reach() <= allowed]
    nearest = sorted(able, key=Candidate.reach)
    return next((c.model for c in (*enough, *nearest)), "")


def run_until_within(
    level: Level, find: Mapping[str, Callable[[], Found]], width: Callable[[Found], float]
) -> tuple[Found, Level]:
    """Run candidates from the planned one upwards until one meets the tolerance, else fall back downwards.

    Parameters
    ----------
    level : Level
        As planned.
    find : mapping of str to function
        Runs a candidate, by its model; raises SensorgenError where it fails.
    width : function
        Error of a result in the measure of the level; infinite where unknown.

    Returns
    -------
    (answer, Level)
        The first result within tolerance, or the most accurate; and the level with every candidate's results.

    Raises
    ------
    SensorgenError
        Of the last candidate, where all fail.
    """
    names = [c.model for c in level.candidates if not c.passed_over]
    start = names.index(level.chosen)
    came = {c.model: c for c in level.candidates}
    found: dict[str, tuple[float, Found]] = {}
    said: SensorgenError | None = None
    for name in (*names[start:], *reversed(names[:start])):
        if found and (name in names[:start] or min(w for w, _ in found.values()) <= level.allowed):
            continue
        begun = time.perf_counter()
        try:
            answer = find[name]()
        except SensorgenError as error:
            said, came[name] = error, replace(came[name], passed_over=str(error))
            continue
        found[name] = width(answer), answer
        seconds = time.perf_counter() - begun
        came[name] = replace(came[name], width=found[name][0], seconds=seconds)
    if not found:
        raise said or SensorgenError(f"{level.name}: no model applies")
    best = min(found, key=lambda name: found[name][0])
    return found[best][1], replace(level, candidates=tuple(came.values()), chosen=best)
