"""Branch and bound over a space of designs: each is discarded for a reason, or evaluated; what is left is the front."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf, log
from typing import Any

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.parallel import Lane, open_lanes, remembered, said
from sensorgen.design.design import Design
from sensorgen.workflows.optimise import ladder
from sensorgen.workflows.optimise.ladder import AT_REST, COARSE, EarlyNumber
from sensorgen.workflows.optimise.space import Candidate
from sensorgen.workflows.optimise.target import NUMBERS, Target
from sensorgen.workflows.trial import Trial

MARGIN = 1.5  # between a number on the coarse mesh and its best value; widened where a design shows more
_FIRST_ROUND = 8
_NUMBER = re.compile(r"\d+(\.\d+)?")

Progress = Callable[[str, int, int], None]  # step, how many are done, how many there are


@dataclass(frozen=True)
class Workers:
    """Where works run: so many processes of this computer, or a Dask cluster; ``lanes`` are those that are open."""

    jobs: int = 1
    cluster: str = ""
    lanes: tuple[Lane, ...] = ()

    @contextmanager
    def opened(self) -> "Iterator[Workers]":
        """Workers that stay for several rounds of works: a process that begins anew imports the solvers again."""
        if self.lanes or (self.jobs < 2 and not self.cluster):
            yield self
            return
        with open_lanes(self.jobs, self.cluster) as lanes:
            yield replace(self, lanes=tuple(lanes))

    def results(
        self, work: Callable[..., Any], inputs: Sequence[tuple[Any, ...]], lost: str, *, keep: bool
    ) -> Iterator[tuple[int, Any]]:
        """Number and result of each work as they come; in place of a result the reason why there is none."""
        attempt = partial(said, work, refused=(SensorgenError,))
        return remembered(
            attempt, inputs, self.jobs, cluster=self.cluster, keep=keep, lost=lambda *_: lost, lanes=self.lanes
        )


HERE = Workers()


@dataclass
class Row:
    """One design of the space and what became of it.

    Attributes
    ----------
    number : int
        In the order of the space, from 1.
    candidate : Candidate
        Its values and design.
    discarded : str
        Why it was not evaluated; "" if it was.
    certified : bool
        Whether the discard is proven; else it holds by the models.
    known : dict of str to EarlyNumber
        Numbers before it was evaluated.
    trial : Trial or None
        The design tried.
    violated : dict of str to float
        Constraints that it violates, and by how much, relative [-].
    """

    number: int
    candidate: Candidate
    discarded: str = ""
    certified: bool = True
    known: dict[str, EarlyNumber] = field(default_factory=dict)
    trial: Trial | None = None
    violated: dict[str, float] = field(default_factory=dict)

    @property
    def design(self) -> Design:
        """Design of the candidate."""
        if self.candidate.design is None:
            raise BadInput(self.candidate.reason)
        return self.candidate.design

    def discard(self, why: str, *, certified: bool = True) -> None:
        """Leave it out."""
        self.discarded, self.certified = why, certified


@dataclass(frozen=True)
class Searched:
    """The whole space after a search.

    Attributes
    ----------
    target : Target
        That was searched for.
    rows : tuple of Row
        Every design.
    front : tuple of Row
        Designs that no other is certain to be better than, the best compromise first.
    margin : float
        Between a number on the coarse mesh and its best value, that was allowed for [-].
    largest : float or None
        The largest factor between both among the evaluated designs [-]; None where no coarse mesh was used.
    size : int
        Designs of the whole space where only a sample was tried, else 0 [-].
    """

    target: Target
    rows: tuple[Row, ...]
    front: tuple[Row, ...]
    margin: float
    largest: float | None
    size: int = 0

    @property
    def evaluated(self) -> tuple[Row, ...]:
        """Designs that were evaluated."""
        return tuple(row for row in self.rows if row.trial)

    def reasons(self) -> list[tuple[str, bool, int]]:
        """Why designs are out, whether that is proven, and how many; of reasons that differ in numbers the first."""
        found: Counter[tuple[str, bool]] = Counter()
        words: dict[str, str] = {}
        front = {row.number for row in self.front}
        for row in self.rows:
            why = row.discarded or (f"violates {min(row.violated)}" if row.violated else "")
            if not why and row.number not in front:
                why = "evaluated; another is better in every objective"
            if why:
                alike = _NUMBER.sub("#", why)
                words.setdefault(alike, why)
                found[alike, row.certified and bool(row.discarded)] += 1
        return [(words[alike], certified, count) for (alike, certified), count in found.most_common()]

    def nearest(self) -> Row | None:
        """Where nothing meets the target: the design that violates the fewest constraints, and these the least."""
        tried = [row for row in self.rows if row.violated]
        return min(
            tried, key=lambda row: (row.trial is None, len(row.violated), sum(row.violated.values())), default=None
        )

    def binding(self) -> list[tuple[str, int, int]]:
        """Constraints, how many designs violate each, and how many violate nothing else."""
        every, alone = Counter[str](), Counter[str]()
        for row in self.rows:
            every.update(list(row.violated))
            alone.update(list(row.violated) if len(row.violated) == 1 else ())
        return [
            (name, count, alone[name]) for name, count in sorted(every.items(), key=lambda i: (-alone[i[0]], -i[1]))
        ]


def search(
    target: Target, space: Sequence[Candidate], workers: Workers = HERE, *, keep: bool = True,
    progress: Progress = lambda *_: None,
) -> Searched:  # fmt: skip
    """Every design of a space: discarded for a reason, or evaluated as printed.

    Parameters
    ----------
    target : Target
        What the best design is to be best at.
    space : sequence of Candidate
        Its designs.
    workers : Workers
        Where works run.
    keep : bool
        Read the cache and store new answers, so that a search that was stopped goes on where it was.
    progress : callable
        Called with the step, how many designs are done, and how many there are.

    Raises
    ------
    SensorgenError
        As :func:`sensorgen.core.parallel.in_parallel`.
    """
    rows = [Row(k, candidate) for k, candidate in enumerate(space, 1)]
    with workers.opened() as opened:
        each = partial(results, workers=opened, keep=keep, progress=progress)
        return finished(target, rows, narrowed(target, rows, each))


def finished(target: Target, rows: Sequence[Row], margins: tuple[float, float | None], size: int = 0) -> Searched:
    """The front of designs that are all discarded or evaluated."""
    feasible = [row for row in rows if row.trial and not row.violated]
    worth = {row.number: badness(target, row) for row in feasible}
    front = [
        row for row in feasible if not any(_beats(worth[other.number], worth[row.number]) for other in feasible)
    ]  # fmt: skip
    return Searched(target, tuple(rows), tuple(sorted(front, key=_compromise(target, front))), *margins, size)


def narrowed(
    target: Target, rows: Sequence[Row], each: Callable[..., Iterator[tuple[Row, Any]]]
) -> tuple[float, float | None]:
    """Check, bound and evaluate those that are open; margin of coarse meshes, and the largest factor that was seen."""
    query = target.query()
    _refuse_unmade(rows)
    for row, found in each("checks", ladder.rules, _open(rows), ()):
        refused = [found] if isinstance(found, str) else _refused(target, found)
        if refused:
            row.violated = {f"check {rule}": 1.0 for rule in refused}
            row.discard(f"checks: {refused[0]}")
    keys = {*target.objectives, *target.limits}
    solve = bool(keys & (COARSE - AT_REST)) and len(_open(rows)) > _FIRST_ROUND
    if solve or keys & AT_REST:
        for row, found in each("bounds", ladder.known, _open(rows), (query, solve)):
            row.known = {} if isinstance(found, str) else found
            _limit(target, row)
    return _evaluate(target, rows, lambda some: each("evaluation", ladder.everything, some, (query, target.slicer)))


def badness(target: Target, row: Row) -> dict[str, Interval]:
    """Objectives of an evaluated design, within what its models leave open; the lower the better."""
    trial = row.trial
    if trial is None:
        return {}
    values = {key: NUMBERS[key].of(trial.printed, trial.toolpath) for key in target.objectives}
    return {key: target.badness(key, value.model) for key, value in values.items() if value}


def results(
    step: str, work: Callable[..., Any], rows: Sequence[Row], given: tuple[Any, ...], *, workers: Workers, keep: bool,
    progress: Progress,
) -> Iterator[tuple[Row, Any]]:  # fmt: skip
    """Results of a work for each design as they come; the reason in place of one that has none."""
    lost = f"{step}: the process ended, as when the memory is full"
    found = workers.results(work, [(row.design, *given) for row in rows], lost, keep=keep)
    for done, (k, one) in enumerate(found, 1):
        yield rows[k], one
        progress(step, done, len(rows))


def _open(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if not row.discarded and row.trial is None]


def _refuse_unmade(rows: Sequence[Row]) -> None:
    """Discard values that no design can have, and those that give a design again."""
    seen: set[str] = set()
    for row in rows:
        if row.candidate.design is None:
            row.violated = {"cannot be made": 1.0}
            row.discard(f"cannot be made: {row.candidate.reason}")
            continue
        identity = row.design.id()
        if identity in seen:
            row.discard("the same design as another")
        seen.add(identity)


def _refused(target: Target, found: Sequence[tuple[str, str]]) -> list[str]:
    return list(dict.fromkeys(rule for rule, severity in found if target.refuses(severity, rule)))


def _limit(target: Target, row: Row) -> None:
    """Discard a design whose certified bounds lie beyond a limit."""
    for key, limit in target.limits.items():
        number = row.known.get(key)
        if number and number.certified and (number.upper < limit.least or number.lower > limit.most):
            row.violated = {f"limit {key}": min(limit.beyond(number.lower), limit.beyond(number.upper))}
            row.discard(f"limit {key}")
            return


def _evaluate(
    target: Target, rows: Sequence[Row], each: Callable[[list[Row]], Iterator[tuple[Row, Any]]]
) -> tuple[float, float | None]:
    """Evaluate in rounds, the most promising first; after each, discard what an evaluated design is better than."""
    largest = max(filter(None, (_factor(target, row) for row in rows)), default=None)
    margin, size = max(MARGIN, 1.1 * (largest or 0.0)), _FIRST_ROUND
    while left := sorted(_open(rows), key=partial(_promise, target)):
        for row, found in each(left[:size]):
            if isinstance(found, str):
                row.violated = {found: 1.0}
                row.discard("killed the process or failed", certified=False)
                continue
            row.trial, row.violated = found, target.violated(found)
            largest = max(filter(None, (largest, _factor(target, row))), default=None)
        if largest and largest > margin:  # what was discarded within the margin is open again
            margin = 1.1 * largest
            for row in rows:
                if row.discarded == "dominated" and not row.certified:
                    row.discarded = ""
        _dominate(target, rows, margin)
        size *= 2
    return margin, largest


def _dominate(target: Target, rows: Sequence[Row], margin: float) -> None:
    """Discard open designs that an evaluated one is certain to be at least as good as, in every objective."""
    best = [badness(target, row) for row in rows if row.trial and not row.violated]
    for row in _open(rows):
        hoped = {key: _hoped(target, key, row.known[key], margin) for key in target.objectives if key in row.known}
        if len(hoped) == len(target.objectives) and any(_beats(other, hoped) for other in best):
            row.discard("dominated", certified=all(row.known[key].certified for key in target.objectives))


def _hoped(target: Target, key: str, number: EarlyNumber, margin: float) -> Interval:
    """An objective of a design that is not evaluated yet; the lower the better."""
    share = 1.0 if number.certified else margin
    return target.badness(key, Interval(number.lower / share, number.upper * share))


def _beats(one: dict[str, Interval], other: dict[str, Interval]) -> bool:
    """True if one is at least as good in every objective and better in one, wherever both lie in their intervals."""
    return all(one[key].upper <= other[key].lower for key in other) and any(
        one[key].upper < other[key].lower for key in other
    )


def _factor(target: Target, row: Row) -> float | None:
    """Largest factor between an objective on the coarse mesh and its best value."""
    trial, found = row.trial, []
    if trial is None or row.violated:
        return None
    for key in target.objectives:
        number, value = row.known.get(key), NUMBERS[key].of(trial.printed, trial.toolpath)
        if number and value and not number.certified and value.value > 0 < number.lower:
            found.append(max(value.value / number.lower, number.lower / value.value))
    return max(found, default=None)


def _promise(target: Target, row: Row) -> tuple[float, int]:
    """Key of the order in which designs are evaluated: the product of their objectives, or the order of the space."""
    if any(key not in row.known for key in target.objectives):
        return inf, row.number
    ends = [_hoped(target, key, row.known[key], 1.0).lower for key in target.objectives]
    return sum(log(e) if e > 0 else -1 / (1e-9 - e) for e in ends), row.number


def _compromise(target: Target, front: Sequence[Row]) -> Callable[[Row], float]:
    """Largest distance of a design from the best value of an objective, over the span of the front."""
    worth = {row.number: badness(target, row) for row in front}
    spans = {}
    for key in target.objectives:
        ends = [worth[row.number][key] for row in front]
        low, high = min((e.lower for e in ends), default=0.0), max((e.lower for e in ends), default=0.0)
        spans[key] = low, (high - low) or 1.0

    def distance(row: Row) -> float:
        return max((worth[row.number][key].lower - low) / span for key, (low, span) in spans.items())

    return distance
