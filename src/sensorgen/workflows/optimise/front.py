"""The front of a space of designs: each is discarded for a reason, or evaluated, the most promising first.

Of a space that is too large to try all, NSGA-II (:func:`sample`) chooses the designs; nothing is proven beyond those.
"""

import importlib.util
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import inf, log
from typing import Annotated, Any

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.document import Column
from sensorgen.core.errors import NotInstalled, SensorgenError
from sensorgen.core.parallel import Lane, open_lanes, remembered, said
from sensorgen.workflows.moves import Candidate, Search
from sensorgen.workflows.optimise import ladder
from sensorgen.workflows.optimise.ladder import AT_REST, COARSE
from sensorgen.workflows.optimise.target import NUMBERS, Space, Target
from sensorgen.workflows.trial import Trial

MARGIN = 1.5  # between a number on the coarse mesh and its best value; widened where a design shows more
_SURE, _POWER, _WIDER = 3, 5, 1.1  # evaluated designs from which on it is a power of the largest seen, or wider by 1.1
FEW = 8  # designs that are evaluated without a coarse mesh [-]
_CHECKS, _BOUNDS, _EVALUATION = range(3)
RULE = "the other objectives, then fewest warnings, then most layers between the electrodes, then best value"
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


@dataclass(frozen=True)
class Reason:
    """Why designs are out: whether that is proven, and how many."""

    why: str
    certified: bool
    count: int


@dataclass(frozen=True)
class Binding:
    """A constraint: how many designs violate it, and how many violate nothing else."""

    constraint: Annotated[str, Column("constraint")]
    violated: Annotated[int, Column("violated by")]
    alone: Annotated[int, Column("by it alone")]


class Front(Search):
    """Every design of a space: discarded for a reason, or evaluated as printed, against all that were before.

    Attributes
    ----------
    target : Target
        What the best design is to be best at.
    workers : Workers
        Where works run.
    keep : bool
        Read the cache and store new answers, so that a search that was stopped goes on where it was.
    progress : callable
        Called with the step, how many designs are done, and how many there are.
    margin, largest : float
        Between a number on the coarse mesh and its best value: allowed for, and seen; 0 where none was used [-].
    whole : int
        Designs of the whole space where only a sample was tried, else 0 [-].
    """

    def __init__(
        self, target: Target, workers: Workers = HERE, *, keep: bool = True, progress: Progress = lambda *_: None
    ) -> None:  # fmt: skip
        super().__init__()
        self.target, self.workers, self.keep, self.progress = target, workers, keep, progress
        self.rows: list[Candidate] = []
        self.query, self.solve = target.query(), False
        keys = {*target.objectives, *target.limits}
        self.is_bounded, self.is_pressed = bool(keys & AT_REST), bool(keys & (COARSE - AT_REST))
        self.best: list[dict[str, Interval]] = []  # objectives of those that were evaluated and violate nothing
        self.margin, self.largest, self.whole = MARGIN, 0.0, 0
        self.together = max(1, workers.jobs, len(workers.lanes))
        self.identities: set[str] = set()

    def made(self, some: Sequence[Candidate]) -> list[Candidate]:
        """Further designs: those that can be made, and are no design again."""
        new, first = [], len(self.rows) + 1
        self.rows += some
        for number, one in enumerate(some, first):
            one.number = number
            if one.made is None:
                one.violated = {"cannot be made": 1.0}
                one.discard(f"cannot be made: {one.discarded}")
            elif one.design.id() in self.identities:
                one.discard("the same design as another")
            else:
                self.identities.add(one.design.id())
                new.append(one)
        self.solve = self.is_pressed and len(new) > FEW
        return new

    def order(self, one: Candidate) -> tuple[float, ...]:
        """The least expensive step first; of those to evaluate, the least product of objectives."""
        last = bool(self._doubt(one))
        if not self._is_known(one):
            return one.stage, last, inf, one.number
        ends = [interval.lower for interval in self._hoped(one, 1.0).values()]
        return one.stage, last, sum(log(end) if end > 0 else -1 / (1e-9 - end) for end in ends), one.number

    def batch(self, stage: int) -> int:
        """All at once, but for evaluations: what they show discards others."""
        return self.together if stage == _EVALUATION else len(self.rows)

    def results(self, some: Sequence[Candidate]) -> Iterator[tuple[Candidate, Any]]:
        """Results of all workers: design rules; numbers at rest and on a coarse mesh; everything."""
        step, work, given = (
            ("checks", ladder.rules, ()),
            ("bounds", ladder.known, (self.query, self.solve)),
            ("evaluation", ladder.everything, (self.query, self.target.slicer)),
        )[some[0].stage if some else 0]
        lost = f"{step}: the process ended, as when the memory is full"
        inputs = [(one.design, *given) for one in some]
        for done, (k, answer) in enumerate(self.workers.results(work, inputs, lost, keep=self.keep), 1):
            yield some[k], answer
            self.progress(step, done, len(some))

    def _doubt(self, one: Candidate) -> str:
        """Doubt that an evaluation would show, known before it; "" where the target accepts it."""
        doubt = self.query.few_periods(one.design)
        return "" if self.target.accepts(doubt) else f"doubt: {doubt}"

    def is_wanted(self, one: Candidate) -> bool:
        """False for a design that an evaluated one is certain to be at least as good as, or with a doubt beside one."""
        if one.stage < _EVALUATION:
            return True
        if self.best and (doubt := self._doubt(one)):
            one.violated = {doubt: 1.0}
            one.discard(f"violates {doubt}", certified=False)
        elif self._is_known(one) and any(_beats(other, self._hoped(one, self.margin)) for other in self.best):
            one.discard("dominated", certified=all(one.known[key].certified for key in self.target.objectives))
        return not one.discarded

    def take(self, one: Candidate, answer: Any) -> Iterable[Candidate]:
        """Discard for a finding or a proven limit; after an evaluation, perhaps take discards back."""
        if one.stage > _EVALUATION:
            return self._evaluated(one, answer)
        if one.stage > _BOUNDS:
            one.known = {} if isinstance(answer, str) else answer
            self._limit(one)
        else:
            self._check(one, [(answer, "error")] if isinstance(answer, str) else answer)
        return () if one.discarded else (one,)

    def _check(self, one: Candidate, findings: Sequence[tuple[str, str]]) -> None:
        """Discard a design with a finding that is refused; without an objective at rest, leave out its bounds."""
        refused = [rule for rule, severity in findings if self.target.refuses(severity, rule)]
        if refused:
            one.violated = {f"check {rule}": 1.0 for rule in refused}
            one.discard(f"checks: {refused[0]}")
        one.stage += not (self.is_bounded or self.solve)

    def _limit(self, one: Candidate) -> None:
        """Discard a design whose certified bounds lie beyond a limit."""
        for key, limit in self.target.limits.items():
            number = one.known.get(key)
            if number and number.certified and (number.upper < limit.least or number.lower > limit.most):
                one.violated = {f"limit {key}": min(limit.beyond(number.lower), limit.beyond(number.upper))}
                one.discard(f"limit {key}")
                return

    def _evaluated(self, one: Candidate, answer: Trial | str) -> Iterable[Candidate]:
        """Compare with the coarse mesh; where it was wrong by more than the margin, take discards back."""
        if isinstance(answer, str):
            one.violated = {answer: 1.0}
            one.discard("killed the process or failed", certified=False)
            return ()
        one.trial, one.violated = answer, self.target.violated(answer)
        if one.violated:
            return ()
        self.best.append(badness(self.target, one))
        self.largest = max(self.largest, *self._factors(one), 0.0)
        is_sure, before = self.largest and len(self.best) >= _SURE, self.margin
        self.margin = max(_WIDER * self.largest, min(self.largest**_POWER, MARGIN) if is_sure else before)
        if self.margin <= before:
            return ()
        back = [row for row in self.rows if row.discarded == "dominated" and not row.certified]
        for row in back:
            row.discarded = ""
        return back

    def _is_known(self, one: Candidate) -> bool:
        return all(key in one.known for key in self.target.objectives)

    def _factors(self, one: Candidate) -> Iterator[float]:
        """Factors between objectives on the coarse mesh and their best values."""
        for key in self.target.objectives:
            number, value = one.known.get(key), value_of(key, one)
            if number and value and not number.certified and value.value > 0 < number.lower:
                yield max(value.value / number.lower, number.lower / value.value)

    def _hoped(self, one: Candidate, margin: float) -> dict[str, Interval]:
        """Objectives of a design that is not evaluated yet; the lower the better."""
        shares = {key: 1.0 if one.known[key].certified else margin for key in self.target.objectives}
        ends = {key: Interval(one.known[key].lower / s, one.known[key].upper * s) for key, s in shares.items()}
        return {key: self.target.badness(key, interval) for key, interval in ends.items()}

    @cached_property
    def front(self) -> tuple[Candidate, ...]:
        """Designs that no other is certain to be better than, the best compromise first."""
        feasible = [row for row in self.rows if row.trial and not row.violated]
        worth = {row.number: badness(self.target, row) for row in feasible}
        front = [row for row in feasible if not any(_beats(other, worth[row.number]) for other in worth.values())]
        return tuple(sorted(front, key=_compromise(self.target, front)))

    @property
    def evaluated(self) -> tuple[Candidate, ...]:
        """Designs that were evaluated."""
        return tuple(row for row in self.rows if row.trial)

    def reasons(self) -> list[Reason]:
        """Most frequent first; of reasons that differ in numbers alone the first."""
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
        return [Reason(words[alike], certified, count) for (alike, certified), count in found.most_common()]

    def nearest(self) -> Candidate | None:
        """Where nothing meets the target: the design that violates the fewest constraints, and these the least.

        Of several, the best by the objectives.
        """

        def order(row: Candidate) -> tuple[float, ...]:
            aims = (worth(self.target, key, row) for key in self.target.objectives) if row.trial else ()
            return row.trial is None, len(row.violated), sum(row.violated.values()), *aims

        return min((row for row in self.rows if row.violated), key=order, default=None)

    def binding(self) -> list[Binding]:
        """Those first that most designs violate alone."""
        every, alone = Counter[str](), Counter[str]()
        for row in self.rows:
            every.update(list(row.violated))
            alone.update(list(row.violated) if len(row.violated) == 1 else ())
        rows = (Binding(name, count, alone[name]) for name, count in every.items())
        return sorted(rows, key=lambda row: (-row.alone, -row.violated))


def search(
    target: Target, space: Sequence[Candidate], workers: Workers = HERE, *, keep: bool = True,
    progress: Progress = lambda *_: None,
) -> Front:  # fmt: skip
    """Every design of a space: discarded for a reason, or evaluated as printed; arguments as of :class:`Front`.

    Raises
    ------
    SensorgenError
        As :func:`sensorgen.core.parallel.in_parallel`.
    """
    with workers.opened() as opened:
        front = Front(target, opened, keep=keep, progress=progress)
        front.run(front.made(space))
    return front


def value_of(key: str, row: Candidate) -> Bounds | None:
    """A number of an evaluated design, as printed."""
    return NUMBERS[key].of_print(row.trial) if row.trial else None


def badness(target: Target, row: Candidate) -> dict[str, Interval]:
    """Objectives of an evaluated design, within what its models leave open; the lower the better."""
    values = {key: value_of(key, row) for key in target.objectives}
    return {key: target.badness(key, value.model) for key, value in values.items() if value}


def _beats(one: dict[str, Interval], other: dict[str, Interval]) -> bool:
    """True if one is at least as good in every objective and better in one, wherever both lie in their intervals."""
    return all(one[key].upper <= other[key].lower for key in other) and any(
        one[key].upper < other[key].lower for key in other
    )


def _compromise(target: Target, front: Sequence[Candidate]) -> Callable[[Candidate], float]:
    """Largest distance of a design from the best value of an objective, over the span of the front."""
    worth = {row.number: badness(target, row) for row in front}
    spans = {}
    for key in target.objectives:
        ends = [worth[row.number][key] for row in front]
        low, high = min((e.lower for e in ends), default=0.0), max((e.lower for e in ends), default=0.0)
        spans[key] = low, (high - low) or 1.0

    def distance(row: Candidate) -> float:
        return max((worth[row.number][key].lower - low) / span for key, (low, span) in spans.items())

    return distance


def tied(one: Candidate, other: Candidate, keys: Sequence[str]) -> bool:
    """Test whether the best value of each lies within what the models leave open of the other, in every objective."""
    for key in keys:
        first, second = value_of(key, one), value_of(key, other)
        if first is None or second is None:
            return False
        alike = first.model.lower <= second.value <= first.model.upper
        if not (alike and second.model.lower <= first.value <= second.model.upper):
            return False
    return True


def settled(found: Front, best: Candidate, key: str = "") -> tuple[Candidate, tuple[Candidate, ...]]:
    """The design to print among those of the front that equal the best within what the models leave open.

    Parameters
    ----------
    found : Front
        The search.
    best : Candidate
        With the best value of an objective, or the best compromise.
    key : str
        The objective: of designs that are equal in it those count that are best in the other objectives, one by one;
        "" for the compromise, from which the others must not differ in any objective.

    Returns
    -------
    tuple
        The design that :data:`RULE` chooses, and the others; ``best`` among them where another one is as good.
    """
    target = found.target
    objectives = list(target.objectives)
    group = _ties(found.front, best, [key] if key else objectives)
    for other in objectives if key else ():
        if other != key:
            group = _ties(group, min(group, key=partial(worth, target, other)), [other])
    chosen = min(group, key=lambda row: (*_rule(row), worth(target, key or objectives[0], row), row.number))
    return chosen, tuple(row for row in dict.fromkeys((*group, best)) if row is not chosen)


def _ties(rows: Iterable[Candidate], best: Candidate, keys: Sequence[str]) -> list[Candidate]:
    """Designs that equal the best in every objective, within what the models leave open."""
    return [row for row in rows if row is best or tied(best, row, keys)]


def worth(target: Target, key: str, row: Candidate) -> float:
    """An objective's best value of an evaluated design, the lower the better."""
    value = value_of(key, row)
    return target.worth(key, value.value) if value else float("inf")


def _rule(row: Candidate) -> tuple[int, int]:
    """Warnings, and layers between the electrodes as printed, negative [-]."""
    gap = value_of("gap_mm", row)
    return row.counts()[1], -round(gap.value / row.design.layers.layer_mm) if gap else 0


POPULATION = 24  # designs of a generation
SEED = 1
_STEPS = 1 << 20  # of the share of a range: finer than any grid
_IDLE = 5  # generations without a new design, after which the search ends
_WORST = 1e30  # objective of a design that has none
_Rows = dict[tuple[object, ...], Candidate]  # by their values


def sample(
    target: Target, space: Space, count: int, workers: Workers = HERE, *, keep: bool = True,
    progress: Progress = lambda *_: None,
) -> Front:  # fmt: skip
    """The front of so many designs, which NSGA-II chooses by the results of those before.

    Each generation is checked, bounded and evaluated as by :func:`sensorgen.workflows.optimise.front.search`, against
    all designs before: what is violated, doubts too, counts before any objective.

    Parameters
    ----------
    target : Target
        What the best design is to be best at.
    space : Space
        Its designs.
    count : int
        Designs to try; fewer where generations bring no new one.
    workers, keep, progress
        As of ``search``.

    Raises
    ------
    NotInstalled
        Optuna is missing.

    Notes
    -----
    Deb et al., IEEE Trans. Evol. Comput. 6 (2002) 182; as in Optuna, with a fixed seed.
    """
    if importlib.util.find_spec("optuna") is None:
        raise NotInstalled("--sample needs Optuna: pip install 'sensorgen[search]'")
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    sampler = optuna.samplers.NSGAIISampler(population_size=POPULATION, seed=SEED)
    study = optuna.create_study(directions=["minimize"] * len(target.objectives), sampler=sampler)
    rows: _Rows = {}
    idle = 0
    with workers.opened() as opened:
        front = Front(target, opened, keep=keep, progress=progress)
        while len(rows) < count and idle < _IDLE:
            before = len(rows)
            generation = list(_generation(study, space, rows, count))
            front.run(front.made(list(rows.values())[before:]))
            for trial, row in generation:
                trial.set_constraint("violated", sum(row.violated.values()))
                study.tell(trial, _objectives(target, row))
            idle = idle + 1 if len(rows) == before else 0
    front.whole = space.size
    return front


def _generation(study: Any, space: Space, rows: _Rows, count: int) -> Iterator[tuple[Any, Candidate]]:
    """Trials of a study and their designs, which join those before, up to so many."""
    for trial in [study.ask() for _ in range(POPULATION)]:
        part = trial.suggest_int("part", 0, len(space.parts) - 1)
        shares = {key: trial.suggest_int(key, 0, _STEPS - 1) / _STEPS for key in space.parts[part][1]}
        candidate = space.at(part, shares)
        values = tuple(candidate.values.values())
        if values in rows or len(rows) < count:
            yield trial, rows.setdefault(values, candidate)


def _objectives(target: Target, row: Candidate) -> Sequence[float]:
    """Objectives of a design, evaluated or on the coarse mesh, the lower the better."""
    if row.trial:
        return [min(worth(target, key, row), _WORST) for key in target.objectives]
    known = row.known
    return [target.worth(key, known[key].lower) if key in known else _WORST for key in target.objectives]
