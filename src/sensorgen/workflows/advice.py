"""Advice that was tried: the nearest changes of a design that remove its findings, each checked and predicted."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from heapq import heappop, heappush

from sensorgen.checks.review import review
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.design.design import Design
from sensorgen.workflows import moves
from sensorgen.workflows.decision import Advice, Change, TriedChange, finding_counts, grade, words_of
from sensorgen.workflows.moves import Changes, Key, Value
from sensorgen.workflows.trial import Trial, trial

BUDGET_S = 30.0
SHOWN = 3
MOST_CHECKED, MOST_PREDICTED = 400, 8
FARTHEST = 1.2  # distance of a change, as of moves.distance: at most by a factor of 3.3 in all [-]
NOT_TRIED = "other materials, shapes, real slicers; sensorgen optimise looks for the best design"
Step = Callable[[str], None]


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
    reached: float = field(default=0.0, init=False)
    complete: bool = field(default=False, init=False)

    def run(self) -> None:
        """Visit designs until none is left, or the budget is used up."""
        heap: list[tuple[float, int, dict[Key, Value], tuple[int, int]]] = []
        heappush(heap, (0.0, 0, {}, (len(self.now.findings),) * 2))
        seen: set[frozenset[tuple[Key, Value]]] = {frozenset()}
        if "grid" in moves.kinds(self.now.findings):  # first: of many heights, single steps leave findings to the last
            for together in moves.onto_grid(self.design):
                mark = frozenset(together.items())
                if mark not in seen and moves.distance(self.design, together) <= FARTHEST:
                    seen.add(mark)
                    heappush(heap, (0.0, len(seen), together, (len(self.now.findings),) * 2))
        while heap and not self._over():
            self.reached, _, changes, least = heappop(heap)
            findings = self._reviewed(changes) if changes else self.now.findings
            if findings is None:
                continue
            left = finding_counts(findings)
            if changes and self._improves(left, changes) and self._is_kept(changes, left):
                continue  # a further step on the same way changes more
            if left >= least and changes and moves.is_choice(list(changes)[-1]):
                continue  # another way to print that improves nothing
            for key, value in self._neighbours(changes, findings):
                further = {k: v for k, v in {**changes, key: value}.items() if v != self._own(k)}
                mark, far = frozenset(further.items()), moves.distance(self.design, further)
                if mark not in seen and far <= FARTHEST:
                    seen.add(mark)
                    heappush(heap, (far, len(seen), further, left))
        self.complete = not heap

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
        """Whether a few periods of the design have the same findings, so that they are enough to look for changes."""
        held = review(moves.short(self.design)).findings
        return {(f.rule, f.severity, f.body) for f in held if not f.waiver} == {
            (f.rule, f.severity, f.body) for f in self.now.findings
        }

    def _improves(self, left: tuple[int, int], changes: Changes) -> bool:
        """Whether errors are gone, or warnings fewer, than of the design and of smaller changes.

        Of changes that leave as many warnings the nearest ``SHOWN`` count, of those of the same values the nearest.
        """
        before = finding_counts(self.now.findings)
        if left[0] or left >= before:
            return False
        keys = {".".join(key) for key in changes}
        same = (one for one in self.kept if {c.key for c in one.changes} <= keys)
        known = [one.counts() for one in self.kept]
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
        listed = tuple(Change(".".join(k), self._own(k), v) for k, v in changes.items())
        if any(set(one.changes) == set(listed) for one in self.kept):
            return True
        self.kept.append(TriedChange(listed, moves.distance(self.design, changes), made))
        if len(self.kept) > SHOWN:  # the last one leaves the fewest warnings, and takes the place of the farthest
            del self.kept[-2]
        return True

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

    def _own(self, key: Key) -> Value | None:
        """The value of the design itself."""
        if key[0] == "parameters":
            value: Value | None = getattr(self.design.params, key[1])
            return value
        if key == ("profile", "walls"):
            return self.design.walls
        if key == ("nozzle_mm",):
            return self.design.machine.nozzle_mm
        return self.design.materials.support if key[0] == "materials" else getattr(self.design, key[0])

    @property
    def advice(self) -> Advice:
        """What came of it."""
        return Advice(
            tuple(sorted(self.kept, key=lambda one: (one.distance, one.counts()))), words_of(self.now),
            self.checked, self.predicted,
            round(time.process_time() - self.start_s, 2), self.budget_s, self.complete,
            FARTHEST if self.complete else self.reached, NOT_TRIED,
        )  # fmt: skip
