"""Moves from a design to its neighbours on the printable grid (layers, line widths), and the one search along them.

Candidates are checked, bounded, pressed and evaluated, the most promising first. The search's targets: the front
(:mod:`.optimise.front`), the nearest changes that remove findings (:mod:`.advice`), and the electrode gap and
capacitance of a drawing (:mod:`.compensation`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from heapq import heappop, heappush
from math import ceil, floor, log
from types import MappingProxyType
from typing import Any

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.design.best import KnownDesign
from sensorgen.design.design import Design, make
from sensorgen.scene.scene import Envelope
from sensorgen.workflows.trial import Trial, finding_counts

Key = tuple[str, ...]  # of a design file, as in ("parameters", "period_mm")
Value = float | str
Changes = Mapping[Key, Value]

NOZZLES_MM = (0.25, 0.4, 0.6)
QUALITIES = ("fine", "extrafine")
SUPPORT = "bvoh"
# Distance of a choice, as if a length had changed by that share [-]
CHOICES = {"walls": 0.1, "orientation": 0.1, "quality": 0.15, "materials": 0.3, "nozzle_mm": 0.4}
# By the number of a rule, what can satisfy it
MOVES = {
    "1": ("film", "height", "wider", "walls", "quality"),
    "2": ("film", "wider", "height", "walls", "quality"),
    "3": ("grid", "quality"),
    "4": ("grid", "quality"),
    "5": ("wider", "height", "walls", "nozzle", "quality"),
    "6": ("wider", "nozzle"),
    "7": ("wider", "height", "walls", "quality", "nozzle"),
    "8": ("shorter",),
    "9": ("orientation", "narrower", "whole", "support"),
    "10": ("film", "quality"),
}
PERIODS = 6  # that a short sensor has
_EPS = 1e-6


def kinds(findings: Iterable[Finding]) -> list[str]:
    """Kinds of moves that can satisfy the findings, those of the most severe first."""
    return list(dict.fromkeys(kind for f in findings for kind in MOVES.get(f.rule.partition("-")[0], ())))


def changed(design: Design, changes: Changes) -> Design:
    """The design with other values.

    Raises
    ------
    SensorgenError
        There is no such design.
    """
    return make(with_values(design.model_dump(mode="json", exclude_unset=True) | {"name": design.name}, changes))


def with_values(data: Mapping[str, Any], changes: Changes) -> dict[str, Any]:
    """A design's data with other values."""
    made = dict(data)
    for key, value in changes.items():
        at = made
        for part in key[:-1]:
            at[part] = at = dict(at.get(part) or {})
        at[key[-1]] = value
    return made


def own(design: Design, key: Key) -> Value | None:
    """The value of a design itself."""
    if key[0] == "parameters":
        value: Value | None = getattr(design.params, key[1])
        return value
    if key == ("profile", "walls"):
        return design.walls
    if key == ("nozzle_mm",):
        return design.machine.nozzle_mm
    return design.materials.support if key[0] == "materials" else getattr(design, key[0])


def distance(design: Design, changes: Changes) -> float:
    """Distance of a changed design: sum of abs(ln(after / before)), and a constant for each choice [-]."""
    own = asdict(design.params)
    total = 0.0
    for key, value in changes.items():
        if key[0] == "parameters" and isinstance(value, float):
            total += abs(log(value / own[key[1]])) if value and own[key[1]] else 1.0
        else:
            total += CHOICES["walls" if key[0] == "profile" else key[0]]
    return total


def words(changes: Changes) -> str:
    """Changed values, by the last part of their keys."""
    return ", ".join(f"{key[-1]} {value if isinstance(value, str) else f'{value:g}'}" for key, value in changes.items())


def is_choice(key: Key) -> bool:
    """Test whether a value is another way to print, and no length."""
    return key[0] != "parameters"


def short(design: Design, changes: Changes = MappingProxyType({}), periods: int = PERIODS) -> Design:
    """A changed sensor of a few periods, which is checked sooner; of all its length where it has no period.

    Raises
    ------
    SensorgenError
        As :func:`changed`.
    """
    few = periods * float(changes.get(("parameters", "period_mm"), getattr(design.params, "period_mm", 0.0)))
    sides: dict[Key, Value] = {
        ("parameters", side): few for side in ("length_mm", "width_mm") if getattr(design.params, side) > few > 0
    }
    return changed(design, {**changes, **sides}) if changes or sides else design


def steps(design: Design, wanted: Iterable[str]) -> Iterator[tuple[Key, Value]]:
    """One step of every kind that is wanted, up and down."""
    for kind in wanted:
        yield from _PARAMETERS[kind](design, kind) if kind in _PARAMETERS else _choices(design, kind)


def onto_grid(design: Design) -> list[dict[Key, Value]]:
    """All heights that are no whole number of layers moved to one at once: down, up, and each to the nearer."""
    pairs = [_beside(name, value, design.layers.layer_mm) for name, value in _off_grid(design)]
    nearer = [min(pair, key=lambda move: distance(design, dict([move]))) for pair in pairs]
    return [dict(moves) for moves in (*zip(*pairs, strict=True), nearer) if len(moves) > 1]


def _choices(design: Design, kind: str) -> list[tuple[Key, Value]]:
    """Other choices of a kind for printing the same sensor."""
    finer = [size for size in NOZZLES_MM if size < design.machine.nozzle_mm - _EPS]
    others: dict[str, list[tuple[Key, Value]]] = {
        "walls": [(("profile", "walls"), "arachne" if design.walls == "classic" else "classic")],
        "orientation": [(("orientation",), "as-drawn" if design.orientation == "upside-down" else "upside-down")],
        "quality": [(("quality",), name) for name in QUALITIES if name != design.quality],
        "nozzle": [(("nozzle_mm",), size) for size in finer[-1:]],
        "support": [] if design.materials.support else [(("materials", "support"), SUPPORT)],
    }
    return others.get(kind, [])


def _heights(design: Design, kind: str) -> Iterator[tuple[Key, Value]]:
    """The nearest whole numbers of layers below and above: of the film, of other heights, or of those off the grid."""
    layer, plain = design.layers.layer_mm, asdict(Envelope())
    if kind == "grid":
        for name, value in _off_grid(design):
            yield from _beside(name, value, layer)
        return
    for name, value, vertical in lengths(design):
        is_film = name.endswith("dielectric_mm")
        if vertical and (is_film if kind == "film" else not is_film and name not in plain):
            yield from _beside(name, value, layer)


def _off_grid(design: Design) -> list[tuple[str, float]]:
    """Heights that are no whole number of layers [mm]."""
    layer = design.layers.layer_mm
    return [(n, v) for n, v, vertical in lengths(design) if vertical and abs(v / layer - round(v / layer)) > _EPS]


def _widths(design: Design, kind: str) -> Iterator[tuple[Key, Value]]:
    """The nearest whole number of lines above, or of half lines below, each width: air may be narrower than a line."""
    for name, value, vertical in lengths(design):
        if not vertical:
            line = design.machine.line_mm()
            found = _beside(name, value, line)[1] if kind == "wider" else _beside(name, value, line / 2)[0]
            if (found[1] > value) == (kind == "wider"):
                yield found


def _sides(design: Design, kind: str) -> Iterator[tuple[Key, Value]]:
    """Length and width in whole periods, or a tenth shorter."""
    period = float(getattr(design.params, "period_mm", 0.0))
    for name in ("length_mm", "width_mm"):
        value = float(getattr(design.params, name))
        if kind == "shorter":
            yield ("parameters", name), round(0.9 * value, 3)
        elif period and abs(value / period - round(value / period)) > _EPS:
            yield from _beside(name, value, period)


_PARAMETERS = {
    "film": _heights, "grid": _heights, "height": _heights,
    "wider": _widths, "narrower": _widths,
    "shorter": _sides, "whole": _sides,
}  # fmt: skip


def _beside(name: str, value: float, step: float) -> list[tuple[Key, float]]:
    """The multiples of a step below and above a value; at least one step."""
    low, high = (ceil(value / step - _EPS) - 1) * step, (floor(value / step + _EPS) + 1) * step
    return [(("parameters", name), round(max(each, step), 6)) for each in (low, high)]


def lengths(design: Design) -> Iterator[tuple[str, float, bool]]:
    """The shape's own lengths that are not 0, and whether a face moves up or down with them.

    Of two whole periods: the end of a cut one moves up and down with the period.
    """
    design = short(design, periods=2)
    drawn = levels(design)
    for name, value in asdict(design.params).items():
        if not isinstance(value, float) or not value or not name.endswith("_mm") or name in ("length_mm", "width_mm"):
            continue
        try:
            moved = levels(changed(design, {("parameters", name): 1.01 * value}))
        except SensorgenError:
            continue
        yield name, value, name in asdict(Envelope()) or not drawn <= moved


def levels(design: Design) -> set[float]:
    """Heights of all faces and corners [mm]."""
    from sensorgen.scene.layers import faces_mm

    return {round(z, 6) for body in design.drawn.bodies for z in faces_mm(body)}


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
    """A design on the printable grid, and its results so far.

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

    values: Mapping[Any, Value]
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
        self.seen: set[frozenset[tuple[Key, Value]]] = set()

    def changed(
        self, changes: Changes, before: Candidate | None = None, origin: KnownDesign | None = None
    ) -> Iterator[Candidate]:
        """The candidate with these changes, if it is new, and not too far away, or a known design."""
        values = {key: value for key, value in changes.items() if value != own(self.base, key)}
        mark, far = frozenset(values.items()), distance(self.base, values)
        if mark not in self.seen and (origin or far <= self.farthest):
            self.seen.add(mark)
            yield Candidate(values, distance=far, before=before, origin=origin)

    def order(self, one: Candidate) -> tuple[float, ...]:
        """Distance of a candidate; where the search begins, and what is looked at already, goes first."""
        return (one.distance if one.before else 0.0, -one.stage)
