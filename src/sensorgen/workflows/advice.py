"""Advice that was tried: the nearest changes of a design that remove its findings, each checked and predicted."""

import json
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from hashlib import sha256
from typing import Any

from sensorgen.checks.review import review
from sensorgen.core import cache as answers
from sensorgen.core.findings import Finding, verdict
from sensorgen.core.parallel import used_s
from sensorgen.core.records import adapter
from sensorgen.design import best
from sensorgen.design.design import Design
from sensorgen.prediction.results import UNPREDICTED
from sensorgen.workflows import moves
from sensorgen.workflows import trial as trials
from sensorgen.workflows.moves import Candidate, Nearest
from sensorgen.workflows.trial import Advice, Trial

BUDGET_S = 60.0
SHOWN = 3
MOST_CHECKED, MOST_PREDICTED = 400, 8
FARTHEST = 1.2  # distance of a change, as of moves.distance: at most by a factor of 3.3 in all [-]
NOT_TRIED = "other materials, shapes, real slicers; sensorgen optimise looks for the best design"
_VERSION = 7  # of the search for changes: stored advice of another one is not read
Step = Callable[[str], None]


def advised(
    design: Design, now: Trial, budget_s: float, step: Step = lambda _: None, spent_s: float = 0.0
) -> Advice | None:
    """Changes of a design with findings, tried now or before; None where nothing is to be changed, or nothing known.

    What its own prediction has ``spent_s`` counts as spent.
    """
    if verdict([f for f in now.findings if f.rule != UNPREDICTED]) == "PRINT":
        return None
    digest = sha256(adapter(Trial).dump_json(now)).hexdigest()
    question = {"advice": _VERSION, "design": design.id(), "trial": digest}
    stored = answers.known(question)
    known: Advice | None = adapter(Advice).validate_json(json.dumps(stored)) if stored else None
    if known and (known.complete or known.budget_s >= budget_s):
        return known
    if budget_s <= 0:
        return None
    advice = advise(design, now, budget_s, step, spent_s)
    if advice.checked:
        answers.keep(question, json.loads(adapter(Advice).dump_json(advice)))
    return advice


def advise(
    design: Design, now: Trial, budget_s: float = BUDGET_S, step: Step = lambda _: None, spent_s: float = 0.0
) -> Advice:
    """The nearest changes that remove the errors of a design, then its warnings, and lose nothing that it senses.

    Changes are visited by distance: each is checked, and predicted where fewer findings are left.

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
    search = AdviceSearch(design, now, budget_s, step, spent_s)
    search.run(search.start())
    return search.advice()


class AdviceSearch(Nearest):
    """Changes by distance from a design; those that are better than all nearer ones are kept."""

    def __init__(self, design: Design, now: Trial, budget_s: float, step: Step, spent_s: float) -> None:
        super().__init__(design, FARTHEST)
        self.now, self.budget_s, self.step, self.start_s = now, budget_s, step, used_s() - spent_s
        self.longest_s = spent_s  # of a prediction
        self.kept, self.nearest, self.untried = list[Candidate](), list[Candidate](), list[Candidate]()
        self.checked = self.predicted = 0

    def start(self) -> Iterator[Candidate]:
        """The best known designs of the shape, those of the shortest prediction first; the design; it on the grid."""
        for known in sorted(best.of(self.base.shape), key=lambda known: known.seconds):
            yield from (one for one in self.changed(dict(known.changes()), origin=known) if one.values)
        starts = moves.onto_grid(self.base) if "grid" in moves.kinds(self.now.findings) else []
        for changes in ({}, *starts):  # of many heights, single steps leave findings to the last
            yield from self.changed(changes)

    def is_over(self) -> bool:
        """Test whether time, or what is tried at most, is used up."""
        is_next_new = self.heap[0][-1].stage == 0
        return self.left_s < 0 or self.predicted >= MOST_PREDICTED or (self.checked >= MOST_CHECKED and is_next_new)

    def is_wanted(self, one: Candidate) -> bool:
        """False for a design whose prediction takes longer than is left: a known time, or the longest so far."""
        late = one.origin and one.origin.seconds > self.left_s
        if late:
            self.untried.append(one)
        return not late and (one.stage == 0 or self.longest_s <= self.left_s)

    @property
    def left_s(self) -> float:
        """Processor time that is left, that of slicers counted [s]."""
        return self.budget_s + self.start_s - used_s()

    def work(self, one: Candidate) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Review, then prediction; a known design is predicted at once."""
        self.step(one.origin.about if one.origin else f"{self.checked} changes, {len(self.kept)} good")
        return (self._predicted if one.stage or one.origin else self._reviewed), (one,)

    def _reviewed(self, one: Candidate) -> list[Finding]:
        if not one.values:
            return list(self.now.findings)
        design = moves.changed(self.base, one.values)
        findings = review(moves.short(design) if self._is_like_short else design).findings
        self.checked += 1
        return [f for f in findings if not f.waiver]

    def _predicted(self, one: Candidate) -> Trial:
        self.predicted += 1
        start_s = used_s()
        tried = trials.trial(moves.changed(self.base, one.values), drawn=False)
        self.longest_s = max(self.longest_s, used_s() - start_s)
        return tried

    @cached_property
    def _is_like_short(self) -> bool:
        """True if a few periods of the design have the same findings, so that they are enough to look for changes."""
        short = [f for f in review(moves.short(self.base)).findings if not f.waiver]
        some, others = ({(f.rule, f.severity, f.body) for f in found} for found in (short, self.now.findings))
        return some == others

    def take(self, one: Candidate, answer: list[Finding] | Trial | str) -> Iterable[Candidate]:
        """Predict what has fewer findings than all nearer changes; keep what is good, go on from what is not."""
        if isinstance(answer, list):
            one.findings = answer
            return [one] if self._improves(one) else self._neighbours(one)
        if isinstance(answer, Trial) and self._is_good(answer):
            one.trial = answer
            return self._keep(one)
        return self._neighbours(one) if one.stage > 1 else ()

    def _improves(self, one: Candidate) -> bool:
        """Test whether errors are gone, or warnings fewer, than of the design and of smaller changes.

        Of changes that leave as many warnings the nearest ``SHOWN`` count, of those of the same values the nearest.
        """
        left, others = one.counts(), [kept for kept in self.nearest if not one.values.items() < kept.values.items()]
        alike = all(left < kept.counts() for kept in others if kept.values.keys() <= one.values.keys())
        is_least = len(others) < SHOWN or left < min(kept.counts() for kept in others)
        return left[0] == 0 and left < trials.finding_counts(self.now.findings) and alike and is_least

    def _is_good(self, tried: Trial) -> bool:
        """Test whether a print can sense what the design's can, with no further doubt."""
        senses = all(min(old, 1) <= new for old, new in zip(trials.grade(self.now), trials.grade(tried), strict=True))
        is_worse = tried.status != "predicted" or tried.errors() or len(tried.doubts) > len(self.now.doubts)
        return senses and not is_worse

    def _keep(self, one: Candidate) -> Iterator[Candidate]:
        """Keep a good design, and go on with each of its changes left out: what is good without one takes its place."""
        if one.origin:
            self.kept.append(one)
            return
        self.nearest = [kept for kept in self.nearest if not _has_idle(kept, one)]
        # the last one leaves the fewest warnings, and takes the place of the farthest
        self.nearest = [*self.nearest[: SHOWN - 1], one]
        for key in one.values if len(one.values) > 1 else ():
            yield from self.changed({k: v for k, v in one.values.items() if k != key}, one)

    def _neighbours(self, one: Candidate) -> Iterator[Candidate]:
        """Steps that can satisfy the errors that are left, or the warnings where there is none."""
        worse = one.before and one.counts() >= one.before.counts()
        if worse and moves.is_choice(list(one.values)[-1]):
            return  # another way to print that improves nothing
        errors = [f for f in one.findings if f.severity == "error"]
        serious = errors or [f for f in one.findings if f.severity == "warning"]
        for key, value in moves.steps(moves.changed(self.base, one.values), moves.kinds(serious)):
            yield from self.changed({**one.values, key: value}, one)

    def advice(self) -> Advice:
        """Advice by the changes that were tried."""
        untried = [*self.untried, *(one for *_, one in self.heap if one.origin)]
        kept = [self._tried(one, one.trial) for one in (*self.kept, *self.nearest) if one.trial]
        return Advice(
            tuple(sorted(kept, key=lambda one: (not one.better, one.distance, one.counts()))),
            trials.words_of(self.now), self.checked, self.predicted, round(self.budget_s - self.left_s, 2),
            self.budget_s, not self.heap, min((order[0] for order, *_ in self.heap), default=FARTHEST), NOT_TRIED,
            tuple(f"{o.about}: {moves.words(one.values)} ({o.numbers})" for one in untried if (o := one.origin)),
        )  # fmt: skip

    def _tried(self, one: Candidate, made: Trial) -> trials.TriedChange:
        """A design that is kept, with its effects on what the sensor is for."""
        changes = tuple(
            trials.Change(".".join(key), moves.own(self.base, key), value) for key, value in one.values.items()
        )
        better, words = trials.effects(self.now, made)
        about = one.origin.about if one.origin else ""
        return trials.TriedChange(changes, one.distance, made, about, better, words)


def _has_idle(whole: Candidate, part: Candidate) -> bool:
    """True if some of its changes do nothing: a part of them leaves no more findings."""
    return part.values.items() < whole.values.items() and part.counts() <= whole.counts()
