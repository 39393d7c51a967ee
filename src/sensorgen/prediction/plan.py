"""Plans as databases print them: candidate models of each level, expected cost and error, and what they reached."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import TypeVar

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import si

Found = TypeVar("Found")


@dataclass(frozen=True)
class PlanCandidate:
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

    def expected(self) -> str:
        """Expected error and time in words."""
        if self.expected_seconds is None:
            return "" if self.passed_over else "always run"
        return _error_and_time(self.expected_width, self.expected_seconds)

    def reached(self) -> str:
        """Error that it reached and its time in words."""
        return "not run" if self.seconds is self.width is None else _error_and_time(self.width, self.seconds)


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
    candidates : tuple of PlanCandidate
        The least expensive first.
    chosen : str
        The model whose answer is used, or that is expected to meet the tolerance; "" where none applies.
    """

    name: str
    measure: str
    allowed: float
    candidates: tuple[PlanCandidate, ...]
    chosen: str = ""

    @property
    def choice(self) -> PlanCandidate:
        """The candidate of that name."""
        return next(c for c in self.candidates if c.model == self.chosen)


@dataclass(frozen=True)
class Plan:
    """Plan to meet a tolerance, level by level.

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

    def document(self) -> Iterator[Part]:
        """Candidates of each level, with what they reached if they were run."""
        yield f"plan for an accuracy of {self.accuracy:g} of {self.of}"
        for level in self.levels:
            caption = f"{level.name}: {level.measure}, tolerance {level.allowed:.2g}"
            yield candidates_table(level.candidates, caption, level.chosen)
        if self.width is not None:
            yield f"all levels together: {_error(self.width)}"

    def shares(self) -> Iterator[str]:
        """Error that the chosen model of each level reached, in words."""
        chosen = ((level.name, level.choice) for level in self.levels if level.chosen)
        yield from (f"{name} {_error(of.width)} ({of.model})" for name, of in chosen)


def candidates_table(candidates: Sequence[PlanCandidate], caption: str = "", chosen: str = "") -> Table:
    """Models with their expected and reached error and time; an arrow leads the one that was chosen."""
    columns = (Column(""), Column("model"), Column("expected"), Column("reached"), Column("reason"))
    rows = ((">" if c.model == chosen else "", c.model, c.expected(), c.reached(), c.passed_over) for c in candidates)
    return Table("plan", caption, columns, tuple(rows))


def _error_and_time(width: float | None, seconds: float | None) -> str:
    time = "" if seconds is None else " instant" if seconds == 0 else f" in {si(seconds, 's', 2)}"
    return _error(width) + time


def _error(width: float | None) -> str:
    if width in (None, inf):
        return "error unknown"
    return "exact" if width == 0 else f"{width:.2g}"


def without_times(plan: Plan) -> Plan:
    """The plan without run times, which differ from run to run."""
    levels = (
        replace(level, candidates=tuple(replace(c, seconds=None, expected_seconds=None) for c in level.candidates))
        for level in plan.levels
    )
    return replace(plan, levels=tuple(levels))


def cheapest(candidates: tuple[PlanCandidate, ...], allowed: float) -> str:
    """Name of the first candidate expected within tolerance; else of the one with the least expected error."""
    able = [c for c in candidates if not c.passed_over]
    enough = [c for c in able if c.reach() <= allowed]
    nearest = sorted(able, key=PlanCandidate.reach)
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
    reached = {c.model: c for c in level.candidates}
    results: list[tuple[float, str, Found]] = []
    failure: SensorgenError | None = None
    for name, is_fallback in _order(level):
        if results and (is_fallback or results[-1][0] <= level.allowed):
            break
        begun = time.perf_counter()
        try:
            answer = find[name]()
        except SensorgenError as error:
            failure, reached[name] = error, replace(reached[name], passed_over=str(error))
            continue
        results.append((width(answer), name, answer))
        reached[name] = replace(reached[name], width=results[-1][0], seconds=time.perf_counter() - begun)
    if not results:
        raise failure or SensorgenError(f"{level.name}: no model applies")
    _, chosen, answer = min(results, key=lambda each: each[0])
    return answer, replace(level, candidates=tuple(reached.values()), chosen=chosen)


def _order(level: Level) -> list[tuple[str, bool]]:
    """Candidates from the planned one upwards, then downwards those to fall back on."""
    names = [c.model for c in level.candidates if not c.passed_over]
    start = names.index(level.chosen)
    return [*((name, False) for name in names[start:]), *((name, True) for name in reversed(names[:start]))]
