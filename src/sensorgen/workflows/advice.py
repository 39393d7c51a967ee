"""Advice that was tried: the nearest changes of a design that remove its findings, each checked and predicted."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from sensorgen.checks.review import review
from sensorgen.core import cache as answers
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Finding, verdict
from sensorgen.design import best
from sensorgen.design.design import Design
from sensorgen.prediction.results import UNPREDICTED
from sensorgen.workflows import moves
from sensorgen.workflows.changes import Advice, Change, TriedChange, effects, finding_counts
from sensorgen.workflows.moves import Changes, Key, Value
from sensorgen.workflows.trial import Trial, grade, trial, words_of

if TYPE_CHECKING:
    from pydantic import TypeAdapter

BUDGET_S = 60.0
SHOWN = 3
MOST_CHECKED, MOST_PREDICTED = 400, 8
FARTHEST = 1.2  # distance of a change, as of moves.distance: at most by a factor of 3.3 in all [-]
NOT_TRIED = "other materials, shapes, real slicers; sensorgen optimise looks for the best design"
_VERSION = 6  # of the search for changes: stored advice of another one is not read
Step = Callable[[str], None]


def advised(
    design: Design, made: Trial, budget_s: float, step: Step = lambda _: None, spent_s: float = 0.0
) -> Advice | None:
    """Changes of a design with findings, tried now or before; None where nothing is to be changed, or nothing known.

    What its own prediction has ``spent_s`` counts as spent.
    """
    if verdict([f for f in made.findings if f.rule != UNPREDICTED]) == "PRINT":
        return None
    digest = sha256(_adapter(Trial).dump_json(made)).hexdigest()
    question = {"advice": _VERSION, "design": design.id(), "trial": digest}
    stored = answers.known(question)
    known: Advice | None = _adapter(Advice).validate_json(json.dumps(stored)) if stored else None
    if known and (known.complete or known.budget_s >= budget_s):
        return known
    if budget_s <= 0:
        return None
    advice = advise(design, made, budget_s, step, spent_s)
    if not advice.checked:
        return advice
    answers.keep(question, json.loads(_adapter(Advice).dump_json(advice)))
    return advice


@cache
def _adapter(kind: type) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def advise(
    design: Design, now: Trial, budget_s: float = BUDGET_S, step: Step = lambda _: None, spent_s: float = 0.0
) -> Advice:
    """The nearest changes that remove the errors of a design, then its warnings, and lose nothing that it senses.

    Changes are visited by distance (Dijkstra): each is checked, and predicted where fewer findings are left.

    Parameters
    ----------
    design : Design
        As it is.
    now : Trial
        Its findings and numbers.
    budget_s : float
        Processor time after which nothing more is tried [s].
    step : callable
        Called with what is tried next, for a progress display.
    spent_s : float
        Of the budget, by the prediction of the design itself [s].
    """
    search = _Search(design, now, budget_s, step, time.process_time() - spent_s)
    search.run()
    return search.advice


@dataclass(eq=False)
class _Search:
    """Changes by distance from a design; those that are better than all nearer ones are kept."""

    design: Design
    now: Trial
    budget_s: float
    step: Step
    start_s: float = field(default_factory=time.process_time)
    kept: list[TriedChange] = field(default_factory=list, init=False)
    checked: int = field(default=0, init=False)
    predicted: int = field(default=0, init=False)
    known: list[str] = field(default_factory=list, init=False)
    left: dict[frozenset[tuple[Key, Value]], tuple[int, int]] = field(default_factory=dict, init=False)
    reached: float = field(default=0.0, init=False)

    def run(self) -> None:
        """Try the best designs that are known, then visit changes until none is left, or the budget is used up."""
        self._try_best()
        # first: of many heights, single steps leave findings to the last
        starts = moves.onto_grid(self.design) if "grid" in moves.kinds(self.now.findings) else []
        self.reached = moves.walk(self.design, self._visit, FARTHEST, starts)

    def _try_best(self) -> None:
        """The best known designs of the shape, those whose prediction takes the least first; the rest in words."""
        for one in sorted(best.of(self.design.shape), key=lambda known: known.seconds):
            changes = {key: value for key, value in one.changes() if value != moves.own(self.design, key)}
            if not changes:
                continue
            self.step(one.about)
            left = self.budget_s - (time.process_time() - self.start_s)
            made = self._good(changes) if one.seconds <= left else None
            if made:
                self._keep(changes, made, about=one.about)
            elif one.seconds > left:
                self.known.append(f"{one.about}: {moves.words(changes)} ({one.numbers})")

    def _visit(self, changes: Changes, far: float) -> Iterable[tuple[Key, Value]] | None:
        """Keep a change that is better than all nearer ones, and give the steps that go on from others."""
        self.reached = far
        if self._over():
            return None
        findings = self._reviewed(changes) if changes else self.now.findings
        if findings is None:
            return ()
        left = finding_counts(findings)
        self.left[frozenset(changes.items())] = left
        if changes and self._improves(left, changes) and self._is_kept(changes, left):
            return ()  # a further step on the same way changes more
        before = self.left.get(frozenset(list(changes.items())[:-1]), (len(self.now.findings),) * 2)
        if left >= before and changes and moves.is_choice(list(changes)[-1]):
            return ()  # another way to print that improves nothing
        return self._neighbours(changes, findings)

    def _over(self) -> bool:
        late = time.process_time() - self.start_s > self.budget_s
        return late or self.checked >= MOST_CHECKED or self.predicted >= MOST_PREDICTED

    def _reviewed(self, changes: Changes) -> list[Finding] | None:
        """Findings about a changed design; None where there is no such design."""
        self.step(f"{self.checked} changes, {len(self.kept)} good")
        try:
            design = moves.changed(self.design, changes)
            held = review(moves.short(design) if self._is_like_short else design)
        except SensorgenError:
            return None
        self.checked += 1
        return [f for f in held.findings if not f.waiver]

    @cached_property
    def _is_like_short(self) -> bool:
        """True if a few periods of the design have the same findings, so that they are enough to look for changes."""
        held = review(moves.short(self.design)).findings
        return {(f.rule, f.severity, f.body) for f in held if not f.waiver} == {
            (f.rule, f.severity, f.body) for f in self.now.findings
        }

    def _improves(self, left: tuple[int, int], changes: Changes) -> bool:
        """Test whether errors are gone, or warnings fewer, than of the design and of smaller changes.

        Of changes that leave as many warnings the nearest ``SHOWN`` count, of those of the same values the nearest.
        """
        before = finding_counts(self.now.findings)
        if left[0] or left >= before:
            return False
        keys = {".".join(key) for key in changes}
        nearest = [one for one in self.kept if not one.about]
        same = (one for one in nearest if {c.key for c in one.changes} <= keys)
        known = [one.counts() for one in nearest]
        return all(left < one.counts() for one in same) and (len(known) < SHOWN or left < min(known))

    def _is_kept(self, changes: Changes, left: tuple[int, int]) -> bool:
        """Keep a change if it is good, without the parts that are not needed: each is left out and all tried again."""
        made = self._good(changes)
        if made is None:
            return False
        for key in list(changes):
            fewer = {k: v for k, v in changes.items() if k != key}
            if not fewer or self._over():
                break
            findings = self._reviewed(fewer)
            if findings is not None and finding_counts(findings) <= left and (smaller := self._good(fewer)):
                changes, made = fewer, smaller
        self._keep(changes, made)
        nearest = [one for one in self.kept if not one.about]
        if len(nearest) > SHOWN:  # the last one leaves the fewest warnings, and takes the place of the farthest
            self.kept.remove(nearest[-2])
        return True

    def _keep(self, changes: Changes, made: Trial, about: str = "") -> None:
        """Keep a change that was tried, once."""
        listed = tuple(Change(".".join(k), moves.own(self.design, k), v) for k, v in changes.items())
        if not any(set(one.changes) == set(listed) for one in self.kept):
            better, words = effects(self.now, made)
            far = moves.distance(self.design, changes)
            self.kept.append(TriedChange(listed, far, made, about, better, words))

    def _good(self, changes: Changes) -> Trial | None:
        """The changed design tried, if its print can sense what the design's can, with no further doubt."""
        self.predicted += 1
        try:
            made = trial(moves.changed(self.design, changes), drawn=False)
        except SensorgenError:
            return None
        senses = all(min(old, 1) <= new for old, new in zip(grade(self.now), grade(made), strict=True))
        is_worse = made.status != "predicted" or made.errors() or len(made.doubts) > len(self.now.doubts)
        return made if senses and not is_worse else None

    def _neighbours(self, changes: Changes, findings: Sequence[Finding]) -> Iterator[tuple[Key, Value]]:
        """Steps that can satisfy what is left; of errors alone, as long as there are any."""
        errors = [f for f in findings if f.severity == "error"]
        serious = errors or [f for f in findings if f.severity == "warning"]
        yield from moves.steps(moves.changed(self.design, changes), moves.kinds(serious))

    @property
    def advice(self) -> Advice:
        """Advice by the changes that were tried."""
        complete = self.reached > FARTHEST
        return Advice(
            tuple(sorted(self.kept, key=lambda one: (not one.better, one.distance, one.counts()))), words_of(self.now),
            self.checked, self.predicted,
            round(time.process_time() - self.start_s, 2), self.budget_s, complete,
            FARTHEST if complete else self.reached, NOT_TRIED, tuple(self.known),
        )  # fmt: skip
