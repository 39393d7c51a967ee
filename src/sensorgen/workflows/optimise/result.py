"""The answer to a target: how many designs there are and why they are out, the front, and the designs to print."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import inf

from sensorgen.core.bounds import Bounds
from sensorgen.core.display import Boundless, Displayed
from sensorgen.core.document import Cell, Column, Part, Table, comma_separated, shown
from sensorgen.core.findings import Verdict
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE
from sensorgen.workflows.moves import Candidate
from sensorgen.workflows.optimise.front import RULE, Binding, Front, Reason, tied, value_of
from sensorgen.workflows.optimise.front import worth as worth_of
from sensorgen.workflows.optimise.target import NUMBERS, OURS, Target

_LISTED = 8  # designs, of those that are tied
_SAME = 1e-9  # relative difference of numbers that are equal but for rounding


@dataclass(frozen=True)
class Chosen:
    """A design of the space.

    Attributes
    ----------
    number : int
        In the order of the space.
    values : dict of str to float or str
        Of the parameters that are varied.
    name, design : str
        Name and identity.
    discarded : str
        Why it was not evaluated, or "".
    violated : tuple of str
        Constraints that it violates.
    verdict : str
        Of its checks; "" where it was not evaluated.
    numbers : dict of str to Bounds
        As printed, in the unit of the name.
    leads : bool
        Whether no design has better best values; else it is on the front since its interval reaches theirs.
    tied : tuple of int
        Leading designs that equal it in every objective, within what the models leave open; of others than these.
    uninformed : dict of str to float
        Of numbers that are errors: the error without any reading, of a uniform distribution.
    body : str
        How it is printed: by an estimate or a slicer, which verdict and numbers are of; "" where it was not evaluated.
    """

    number: int
    values: dict[str, float | str]
    name: str
    design: str
    discarded: str
    violated: tuple[str, ...]
    verdict: Verdict | str
    numbers: dict[str, Bounds]
    leads: bool = False
    tied: tuple[int, ...] = ()
    uninformed: dict[str, float] = field(default_factory=dict)
    body: str = ""

    def mark(self) -> str:
        """Mark in the table of the front."""
        return ">" if self.leads else "=" if self.tied else ""

    def senses(self, name: str) -> bool:
        """False for an error that is that of no reading."""
        return name not in self.numbers or not isinstance(self.cell(name), str)

    def cell(self, name: str, value: float | None = None) -> Cell:
        """A number, or another value of it, for people: what is not sensed where an error holds no information."""
        if value is None:
            value = self.numbers[name].value if name in self.numbers else None
        if value is None or value < self.uninformed.get(name, inf):
            return value
        return CANNOT_LOCATE if name.startswith("position") else CANNOT_SENSE


@dataclass(frozen=True)
class ObjectiveSpread:
    """An objective over variants of a design: best value, median, worst, and the worst with all material ranges."""

    value: float
    median: float
    worst: float
    with_materials: float


@dataclass(frozen=True)
class Recommended:
    """A design to print.

    Attributes
    ----------
    role : str
        What it is best at.
    design : Chosen
        The design.
    folder : str
        With its files; "" where it was not built.
    verdict : str
        Of the build.
    robust : dict of str to ObjectiveSpread
        Objectives over walls of slicers, and lengths in the plane by the tolerance to both sides.
    sliced : dict of str to Bounds
        Objectives by the G-code of a real slicer.
    slicer : str
        Its name and version; or why nothing was sliced.
    ties : tuple of int
        Designs that equal it within what the models leave open; :data:`.ties.RULE` chose it.
    """

    role: str
    design: Chosen
    folder: str = ""
    verdict: str = ""
    robust: dict[str, ObjectiveSpread] | None = None
    sliced: dict[str, Bounds] | None = None
    slicer: str = ""
    ties: tuple[int, ...] = ()


@dataclass(frozen=True)
class Optimised(Boundless, Displayed):
    """The answer to a target.

    Attributes
    ----------
    name : str
        Of the target.
    size, evaluated : int
        Designs of the space, and those that were evaluated [-].
    objectives : dict of str to str
        As the target has them, in words.
    reasons : tuple of Reason
        Why designs are out.
    front : tuple of Chosen
        Designs that no other is certain to be better than, the best compromise first.
    designs : tuple of Chosen
        The whole space.
    margin, largest : float and float or None
        Factor between coarse mesh and best value that was allowed for, and the largest that was seen [-].
    recommended : tuple of Recommended
        Designs to print.
    nearest : Chosen or None
        Where nothing meets the target.
    binding : tuple of Binding
        What keeps designs out, the constraints that alone keep most out first.
    remarks : tuple of str
        What of the target had no effect.
    whole : int
        Designs of the whole space where only a sample was tried, else 0 [-].
    """

    name: str
    size: int
    evaluated: int
    objectives: dict[str, str]
    reasons: tuple[Reason, ...]
    front: tuple[Chosen, ...]
    designs: tuple[Chosen, ...]
    margin: float
    largest: float | None
    recommended: tuple[Recommended, ...] = ()
    nearest: Chosen | None = None
    binding: tuple[Binding, ...] = ()
    remarks: tuple[str, ...] = ()
    whole: int = 0

    def document(self) -> Iterator[Part]:
        """The proof, what was discarded, the front, and the designs to print."""
        yield self.proof()
        if {"force_resolution_n", "position_resolution_mm"} & set(self.objectives):
            yield (
                "resolutions: standard errors of a sensor exactly as predicted; after 30 known presses they are larger "
                "(objectives force_calibrated_n, position_calibrated_mm)"
            )
        yield from self.remarks
        yield ""
        if self.reasons:
            columns = (Column("designs"), Column("out since"), Column("proof"))
            cells = ((r.count, r.why, "certified" if r.certified else "by the models") for r in self.reasons)
            yield Table("discarded", "", columns, tuple(cells))
            yield ""
        if not self.front:
            yield from self._missed()
            return
        yield self.table()
        yield from _designs(self.recommended)

    def table(self) -> Table:
        """The front: parameters that differ, objectives with what the models leave open, verdict."""
        keys = [k for k in self._keys() if len({c.values.get(k) for c in self.designs}) > 1]
        names = list(dict.fromkeys((*self.objectives, *self.front[0].numbers)))[: len(self.objectives) + 2]
        columns = (
            Column("", key="number"), Column("", key="leads"),
            *(Column(k.removesuffix("_mm"), "mm" * k.endswith("_mm"), key=k) for k in keys),
            *(Column(NUMBERS[n].words, NUMBERS[n].unit, digits=3, key=n) for n in names), Column("verdict"),
        )  # fmt: skip
        cells = (
            (c.number, c.mark(), *(c.values.get(k) for k in keys),
             *(c.cell(n) for n in names), c.verdict)
            for c in self.front
        )  # fmt: skip
        bodies = "; ".join(dict.fromkeys(c.body for c in self.front))
        caption = (
            f"Front, {bodies}: > no best values are better, = as good within ranges, others: perhaps, by their range"
        )
        return Table("front", caption, columns, tuple(cells))

    def _keys(self) -> list[str]:
        """Parameters that are varied."""
        return list(dict.fromkeys(key for c in self.designs for key in c.values))

    def proof(self) -> str:
        """Quality of the front, in words."""
        tried = f"{self.size} designs tried of {self.whole} (NSGA-II)" if self.whole else f"{self.size} designs"
        if not self.front:
            return f"{self.name}: none of {tried} meets the target ({self.evaluated} evaluated)"
        coarse = ""
        if any(r.why == "dominated" and not r.certified for r in self.reasons):
            seen = f", largest seen {self.largest:.3g}" if self.largest else ""
            coarse = f"; by the models, not certified: coarse meshes within a factor {self.margin:.3g}{seen}"
        if self.whole:
            return (
                f"{self.name}: nothing is proven: of {tried}, {self.evaluated} evaluated as printed, none is "
                f"better than these {len(self.front)}; untried designs may be{coarse}"
            )
        return (
            f"{self.name}: no design in this space of {self.size} is better than these {len(self.front)} "
            f"({self.evaluated} evaluated as printed, {self.size - self.evaluated} discarded{coarse})"
        )

    def _missed(self) -> Iterator[Part]:
        """The nearest design, and which constraints bind."""
        if self.nearest:
            values = ", ".join(
                f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in self.nearest.values.items()
            )
            numbers = ", ".join(f"{k} {shown(self.nearest.cell(k), 3)}" for k in self.nearest.numbers)
            has = f" ({numbers})" if numbers else ""
            yield f"nearest: {values}; violates {', '.join(self.nearest.violated)}{has}"
        if self.binding:
            yield Table.of("binding", "", self.binding)

    def csv(self) -> Iterator[str]:
        """Every design with its numbers, or why it has none."""
        keys = self._keys()
        names = list(dict.fromkeys(n for c in self.designs for n in c.numbers))
        ends = [Column(f"{n}{end}") for n in names for end in ("", "_lower", "_upper")]
        columns = (
            Column("number"),
            *map(Column, keys),
            *ends,
            *map(Column, ("verdict", "front", "discarded", "violated")),
        )
        front = {c.number for c in self.front}

        def cells(c: Chosen) -> Iterator[Cell]:
            yield from (c.number, *(c.values.get(k) for k in keys))
            for name in names:
                b = c.numbers.get(name)
                yield from (b.value, b.lower, b.upper) if b else (None, None, None)
            yield from (c.verdict, "yes" if c.number in front else "", c.discarded, "; ".join(c.violated))

        yield comma_separated(Table("designs", "", columns, tuple(tuple(cells(c)) for c in self.designs)))


def _designs(some: Sequence[Recommended]) -> Iterator[Part]:
    """Each design to print: role, verdict, folder, ties and numbers."""
    for one in some:
        yield ""
        by = f"{one.verdict}; sliced by {one.slicer}" if one.sliced is not None else one.verdict
        files = ", ".join(filter(None, (by, one.folder)))
        yield f"design {one.design.number}, {one.role}" + (f": {files}" if files else "")
        if one.ties:
            others = ", ".join(map(str, one.ties[:_LISTED])) + ", ..." * (len(one.ties) > _LISTED)
            yield f"tied with {others} within what the models leave open; chosen by {RULE}"
        yield _numbers(one)
        if one.slicer and not one.sliced:
            yield one.slicer
    if any(one.robust for one in some):
        yield ""
        yield "median, worst: over walls and tolerance, under its worst top; with materials: worst over their ranges"


def _numbers(one: Recommended) -> Table:
    """Numbers of one, as estimated, in the worst case, and by a real slicer."""

    def words(key: str, value: float | None = None) -> str:
        return shown(one.design.cell(key, value), 3)

    def cells(key: str) -> Iterator[Cell]:
        yield from (key, words(key))
        spread, own, sliced = (one.robust or {}).get(key), one.design.numbers[key].value, (one.sliced or {}).get(key)
        ends = (spread.median, spread.worst, spread.with_materials) if spread else ()
        yield from (words(key, end) for end in ends) if ends else (None, None, None)
        is_number = sliced and own and not isinstance(one.design.cell(key, sliced.value), str)
        change = f" ({sliced.value / own - 1:+.1%})" if sliced and is_number else ""
        yield words(key, sliced.value) + change if sliced else None

    heads = ("", "estimate", "median", "worst", "with materials", one.slicer if one.sliced else "")
    columns = tuple(Column(head, right=bool(head), key=head or "number") for head in heads)
    return Table(f"design-{one.design.number}", "", columns, tuple(tuple(cells(key)) for key in one.design.numbers))


def result(name: str, found: Front, recommended: tuple[Recommended, ...] = ()) -> Optimised:
    """A search as its answer."""
    ahead = leads(found)
    ties = dict(_ties(found, ahead))
    leading = {row.number for row in ahead}
    designs = tuple(
        chosen(found.target, row, leads=row.number in leading, ties=ties.get(row.number, ())) for row in found.rows
    )
    nearest = None if found.front else found.nearest()
    return Optimised(
        name, len(found.rows), len(found.evaluated),
        {k: goal if isinstance(goal, str) else f"near {goal.near:g}" for k, goal in found.target.objectives.items()},
        tuple(found.reasons()), tuple(designs[row.number - 1] for row in found.front),
        designs, found.margin, found.largest or None, recommended, designs[nearest.number - 1] if nearest else None,
        () if found.front else tuple(found.binding()), tuple(_remarks(found)),
        found.whole,
    )  # fmt: skip


def _ties(found: Front, ahead: Sequence[Candidate]) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Designs of the front that do not lead, each with those that do and equal it in every objective."""
    keys = list(found.target.objectives)
    for row in found.front:
        if row not in ahead:
            yield row.number, tuple(each.number for each in ahead if tied(each, row, keys))


def _remarks(found: Front) -> Iterator[str]:
    """Doubts that the user accepts and no evaluated design has."""
    doubts = list(dict.fromkeys(doubt for row in found.evaluated if row.trial for doubt in row.trial.doubts))
    for part in sorted({*found.target.accept_doubts} - {*OURS}) if found.evaluated else ():
        if not any(part in doubt for doubt in doubts):
            known = "; ".join(f"{doubt:.60}" for doubt in doubts[:3]) or "none"
            yield (
                f"accept_doubts: {part!r} is part of no doubt about the {len(found.evaluated)} evaluated designs; "
                f"correct or remove it (their doubts: {known})"
            )


def chosen(target: Target, row: Candidate, *, leads: bool = False, ties: tuple[int, ...] = ()) -> Chosen:
    """A design of the space as plain data."""
    trial = row.trial
    name, identity = (row.made.name, row.made.id()) if row.made else ("", "")
    verdict, body = (trial.verdict, trial.body) if trial else ("", "")
    wanted = dict.fromkeys((*target.objectives, *target.limits, "capacitance_pf"))
    values = {k: value_of(k, row) for k in wanted}
    uninformed = {k: limit for k in values if trial and (limit := NUMBERS[k].uninformed(trial)) < inf}
    return Chosen(
        row.number, dict(row.values), name, identity, row.discarded, tuple(row.violated), verdict,
        {key: value for key, value in values.items() if value}, leads, ties, uninformed, body,
    )  # fmt: skip


def leads(found: Front) -> list[Candidate]:
    """Of the front, the designs that no other's best values are better than."""
    keys = found.target.objectives
    worth = {row.number: {key: worth_of(found.target, key, row) for key in keys} for row in found.front}

    def is_better(one: dict[str, float], other: dict[str, float]) -> bool:
        slack = {key: _SAME * abs(other[key]) for key in keys}
        return all(one[k] <= other[k] + slack[k] for k in keys) and any(one[k] < other[k] - slack[k] for k in keys)

    return [row for row in found.front if not any(is_better(one, worth[row.number]) for one in worth.values())]
