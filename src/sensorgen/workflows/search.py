"""One search on the printable grid: candidates are checked, bounded, pressed and evaluated, the most promising first.

Its targets: the front (:mod:`.optimise.front`), the nearest changes that remove findings (:mod:`.advice`), and the
electrode gap and capacitance of a drawing (:mod:`.compensation`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Any

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.design.best import KnownDesign
from sensorgen.design.design import Design
from sensorgen.workflows import moves
from sensorgen.workflows.changes import finding_counts
from sensorgen.workflows.trial import Trial


@dataclass(frozen=True)
class EarlyNumber:
    """A number of one design before it is evaluated.

    Attributes
    ----------
    lower, upper : float
        Bounds where they are certified; else both are a value of unknown error [unit of its name].
    certified : bool
        Whether they are proven.
    """

    lower: float
    upper: float
    certified: bool


@dataclass(eq=False)
class Candidate:
    """A design on the printable grid, and what is known of it.

    Attributes
    ----------
    values : mapping
        What is changed, to its values.
    made : Design or None
        The design, where it is known already; None where there is none.
    number : int
        In the order of the space, from 1.
    origin : KnownDesign or None
        Where it is known to be good.
    distance : float
        From the design that is changed [-].
    before : Candidate or None
        From which a step leads here.
    stage : int
        Steps of the ladder that are done.
    findings : sequence of Finding
        Of its review.
    known : mapping of str to EarlyNumber
        Numbers before it is evaluated.
    trial : Trial or None
        The design tried.
    discarded : str
        Why it was not evaluated; "" if it was.
    certified : bool
        Whether the discard is proven; else it holds by the models.
    violated : dict of str to float
        Constraints that it violates, and by how much, relative [-].
    """

    values: Mapping[Any, moves.Value]
    made: Design | None = None
    number: int = 0
    origin: KnownDesign | None = None
    distance: float = 0.0
    before: "Candidate | None" = None
    stage: int = 0
    findings: Sequence[Finding] = ()
    known: Mapping[str, EarlyNumber] = field(default_factory=dict)
    trial: Trial | None = None
    discarded: str = ""
    certified: bool = True
    violated: dict[str, float] = field(default_factory=dict)

    @property
    def design(self) -> Design:
        """The design, where there is one."""
        if self.made is None:
            raise BadInput(self.discarded)
        return self.made

    def counts(self) -> tuple[int, int]:
        """Errors and warnings, of the print where it was tried [-]."""
        return finding_counts(self.trial.findings if self.trial else self.findings)

    def discard(self, why: str, *, certified: bool = True) -> None:
        """Leave it out."""
        self.discarded, self.certified = why, certified


class Search:
    """Candidates by their order, each taken up a ladder of works; a target says which, and what follows from each."""

    def __init__(self) -> None:
        self.heap: list[tuple[tuple[float, ...], int, Candidate]] = []
        self.pushed = 0

    def order(self, one: Candidate) -> tuple[float, ...]:
        """Key of a candidate: the least is next."""
        raise NotImplementedError

    def work(self, one: Candidate) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Next step of a candidate, and what it is called with."""
        raise NotImplementedError

    def take(self, one: Candidate, answer: Any) -> Iterable[Candidate]:
        """Learn a step's result, or the reason why it has none, and give the candidates that follow: itself, others."""
        raise NotImplementedError

    def is_wanted(self, one: Candidate) -> bool:  # noqa: ARG002 - of targets that override it
        """Test whether a candidate still has to be looked at."""
        return True

    def is_over(self) -> bool:
        """Test whether nothing more is to be looked at."""
        return False

    def batch(self, stage: int) -> int:  # noqa: ARG002
        """Number of candidates at a step that are looked at together [-]."""
        return 1

    def results(self, some: Sequence[Candidate]) -> Iterator[tuple[Candidate, Any]]:
        """Result of the next step of each candidate, as they come; the reason in place of one that has none."""
        for one in some:
            work, given = self.work(one)
            try:
                yield one, work(*given)
            except SensorgenError as error:
                yield one, str(error)

    def push(self, some: Iterable[Candidate]) -> None:
        """Add candidates to those that are open."""
        for one in some:
            self.pushed += 1
            heappush(self.heap, (self.order(one), self.pushed, one))

    def run(self, start: Iterable[Candidate]) -> None:
        """Look at candidates, from some on, until none is left, or the target has enough."""
        self.push(start)
        while self.heap and not self.is_over():
            stage, some = self.heap[0][-1].stage, list[Candidate]()
            while self.heap and self.heap[0][-1].stage == stage and len(some) < self.batch(stage):
                one = heappop(self.heap)[-1]
                some += [one] * self.is_wanted(one)
            for one, answer in self.results(some):
                one.stage += 1
                self.push(self.take(one, answer))


class Nearest(Search):
    """Changes of one design by distance (Dijkstra), each once, up to a largest distance [-]."""

    def __init__(self, design: Design, farthest: float) -> None:
        super().__init__()
        self.base, self.farthest = design, farthest
        self.seen: set[frozenset[tuple[moves.Key, moves.Value]]] = set()

    def changed(
        self, changes: moves.Changes, before: Candidate | None = None, origin: KnownDesign | None = None
    ) -> Iterator[Candidate]:
        """The candidate with these changes, if it is new, and near enough or known to be good."""
        values = {key: value for key, value in changes.items() if value != moves.own(self.base, key)}
        mark, far = frozenset(values.items()), moves.distance(self.base, values)
        if mark not in self.seen and (origin or far <= self.farthest):
            self.seen.add(mark)
            yield Candidate(values, distance=far, before=before, origin=origin)

    def order(self, one: Candidate) -> tuple[float, ...]:
        """Distance of a candidate; where the search begins, and what is looked at already, goes first."""
        return (one.distance if one.before else 0.0, -one.stage)
