"""Plans as databases print them: who could be asked at each level, what that should cost and reach, and what it did."""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Any, TypeVar

from sensorgen.core.errors import SensorgenError

Found = TypeVar("Found")


@dataclass(frozen=True)
class Candidate:
    """A model in a plan: what was expected of it, and what came of it.

    Attributes
    ----------
    model : str
        Its name.
    expected_width, expected_seconds : float or None
        How near it should come, in the terms of its level [-], and time [s], scaled from the scene that it was measured
        on; None where it never was.
    passed_over : str
        Why it was not asked, or "".
    width, seconds : float or None
        What it gave, and how long it took, its imports left out.
    """

    model: str
    expected_width: float | None = None
    expected_seconds: float | None = None
    passed_over: str = ""
    width: float | None = None
    seconds: float | None = None

    def reach(self) -> float:
        """Expected width; 0 where nothing is known, so that it is tried."""
        return self.expected_width or 0.0


@dataclass(frozen=True)
class Level:
    """One thing that an answer rests on, and who could tell it.

    Attributes
    ----------
    name : str
        "cell", "compression" or "line".
    measure : str
        What the widths of its candidates are, in words.
    allowed : float
        The largest of them that will do [-].
    candidates : tuple of Candidate
        The cheapest first.
    chosen : str
        The model whose answer is taken, or that is expected to do; "" where none can speak.
    """

    name: str
    measure: str
    allowed: float
    candidates: tuple[Candidate, ...]
    chosen: str = ""


@dataclass(frozen=True)
class Plan:
    """What an answer as near as asked takes, level by level.

    Attributes
    ----------
    accuracy : float
        Wanted of the answer, relative [-].
    of : str
        Which answer, in words.
    levels : tuple of Level
        In the order in which they are worked out.
    width : float or None
        What all of them came to together; infinite where one is not known [-].
    """

    accuracy: float
    of: str
    levels: tuple[Level, ...]
    width: float | None = None


def plain(plan: Plan) -> dict[str, Any]:
    """A plan as plain data; widths that nobody knows are None."""
    data = asdict(plan)
    for part in (data, *(c for level in data["levels"] for c in level["candidates"])):
        part |= {key: None for key in ("width", "expected_width") if part.get(key) == inf}
    return data


def cheapest(candidates: tuple[Candidate, ...], allowed: float) -> str:
    """Name of the first candidate that should do; of the one that should come nearest where none is near enough."""
    able = [c for c in candidates if not c.passed_over]
    enough = [c for c in able if c.reach() <= allowed]
    nearest = sorted(able, key=Candidate.reach)
    return next((c.model for c in (*enough, *nearest)), "")


def walked(
    level: Level, find: Mapping[str, Callable[[], Found]], width: Callable[[Found], float]
) -> tuple[Found, Level]:
    """Ask candidates from the chosen one on until one is near enough; if none can answer, those before it.

    Parameters
    ----------
    level : Level
        As planned.
    find : mapping of str to function
        What a candidate answers, by its model; a SensorgenError where it cannot.
    width : function
        How near an answer is, in the terms of the level; infinite where nobody knows.

    Returns
    -------
    (answer, Level)
        The first that will do, or the nearest; and the level with what came of every candidate.

    Raises
    ------
    SensorgenError
        What the last one said, where none can answer.
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
        raise said or SensorgenError(f"{level.name}: no model can speak of it")
    best = min(found, key=lambda name: found[name][0])
    return found[best][1], replace(level, candidates=tuple(came.values()), chosen=best)
