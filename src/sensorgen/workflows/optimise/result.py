"""The answer to a target: how many designs there are and why they are out, the front, and the designs to print."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from sensorgen.core.bounds import Bounds
from sensorgen.core.display import Displayed
from sensorgen.core.document import Cell, Column, Facts, Part, Table, comma_separated
from sensorgen.core.findings import Verdict
from sensorgen.workflows.optimise.search import Row, Searched
from sensorgen.workflows.optimise.target import NUMBERS, Target

_SAME = 1e-9  # relative difference of numbers that are equal but for rounding


@dataclass(frozen=True)
class Reason:
    """Why designs are out: whether that is proven, and how many."""

    why: str
    certified: bool
    count: int


@dataclass(frozen=True)
class Binding:
    """A constraint: how many designs violate it, and how many violate nothing else."""

    constraint: str
    violated: int
    alone: int


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


@dataclass(frozen=True)
class Spread:
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
    robust : dict of str to Spread
        Objectives over walls of slicers, and lengths in the plane by the tolerance to both sides.
    sliced : dict of str to Bounds
        Objectives by the G-code of a real slicer.
    slicer : str
        Its name and version; or why nothing was sliced.
    """

    role: str
    design: Chosen
    folder: str = ""
    verdict: str = ""
    robust: dict[str, Spread] | None = None
    sliced: dict[str, Bounds] | None = None
    slicer: str = ""


@dataclass(frozen=True)
class Optimised(Displayed):
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
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

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

    def document(self) -> Iterator[Part]:
        """The proof, what was discarded, the front, and the designs to print."""
        yield self.proof()
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
        yield ""
        for one in self.recommended:
            yield Facts(tuple(_facts(one)))

    def table(self) -> Table:
        """The front: parameters that differ, objectives with what the models leave open, verdict."""
        keys = [k for k in self.front[0].values if len({c.values[k] for c in self.designs}) > 1]
        names = list(dict.fromkeys((*self.objectives, *self.front[0].numbers)))[: len(self.objectives) + 2]
        columns = (
            Column("", key="leads"), *(Column(k.removesuffix("_mm"), key=k) for k in keys),
            *(Column(n, digits=3, key=n) for n in names), Column("verdict"),
        )  # fmt: skip
        cells = (
            (">" if c.leads else "", *(c.values[k] for k in keys),
             *(c.numbers[n].value if n in c.numbers else None for n in names), c.verdict)
            for c in self.front
        )  # fmt: skip
        return Table(
            "front",
            "Front, as printed; > leads by best values, the others by intervals that overlap",
            columns,
            tuple(cells),
        )

    def proof(self) -> str:
        """How good the front is, in words."""
        if not self.front:
            return f"{self.name}: none of {self.size} designs meets the target ({self.evaluated} evaluated)"
        coarse = ""
        if any(r.why == "dominated" and not r.certified for r in self.reasons):
            seen = f", largest seen {self.largest:.3g}" if self.largest else ""
            coarse = f"; by the models, not certified: coarse meshes within a factor {self.margin:.3g}{seen}"
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
            yield f"nearest: {values}; violates {', '.join(self.nearest.violated)}"
        if self.binding:
            yield Table(
                "binding", "", (Column("constraint"), Column("violated by"), Column("by it alone")),
                tuple((b.constraint, b.violated, b.alone) for b in self.binding),
            )  # fmt: skip

    def csv(self) -> Iterator[str]:
        """Every design with its numbers, or why it has none."""
        keys = list(self.designs[0].values)
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
            yield from (c.number, *(c.values[k] for k in keys))
            for name in names:
                b = c.numbers.get(name)
                yield from (b.value, b.lower, b.upper) if b else (None, None, None)
            yield from (c.verdict, "yes" if c.number in front else "", c.discarded, "; ".join(c.violated))

        yield comma_separated(Table("designs", "", columns, tuple(tuple(cells(c)) for c in self.designs)))


def _facts(one: Recommended) -> Iterator[tuple[str, str]]:
    numbers = ", ".join(f"{key} {b.value:.3g}" for key, b in one.design.numbers.items())
    yield one.role, f"{one.design.name}: {numbers}"
    for key, s in (one.robust or {}).items():
        yield (
            "",
            (
                f"{key} over walls and tolerance: median {s.median:.3g}, worst {s.worst:.3g}; with material ranges "
                f"{s.with_materials:.3g}"
            ),
        )
    if one.folder:
        yield "", f"{one.verdict}, {one.folder}"
    for key, b in (one.sliced or {}).items():
        change = b.value / one.design.numbers[key].value - 1 if one.design.numbers[key].value else 0.0
        yield "", f"{key} by {one.slicer}: {b.value:.3g} ({change:+.1%} to the estimate)"
    if one.slicer and not one.sliced:
        yield "", one.slicer


def result(name: str, found: Searched, recommended: tuple[Recommended, ...] = ()) -> Optimised:
    """A search as its answer."""
    front = {row.number for row in found.front}
    leading = {row.number for row in leads(found)}
    designs = tuple(chosen(found.target, row, leads=row.number in leading) for row in found.rows)
    nearest = None if front else found.nearest()
    return Optimised(
        name, len(found.rows), len(found.evaluated),
        {k: goal if isinstance(goal, str) else f"near {goal.near:g}" for k, goal in found.target.objectives.items()},
        tuple(Reason(*reason) for reason in found.reasons()), tuple(designs[row.number - 1] for row in found.front),
        designs, found.margin, found.largest, recommended, designs[nearest.number - 1] if nearest else None,
        () if front else tuple(Binding(*each) for each in found.binding()),
    )  # fmt: skip


def chosen(target: Target, row: Row, *, leads: bool = False) -> Chosen:
    """A design of the space as plain data."""
    trial, design = row.trial, row.candidate.design
    wanted = dict.fromkeys((*target.objectives, *target.limits, "capacitance_pf"))
    values = {k: NUMBERS[k].of(trial.printed, trial.toolpath) for k in wanted} if trial else {}
    return Chosen(
        row.number, row.candidate.values, design.name if design else "", design.id() if design else "",
        row.discarded or row.candidate.reason, tuple(row.violated), trial.verdict if trial else "",
        {key: value for key, value in values.items() if value}, leads,
    )  # fmt: skip


def leads(found: Searched) -> list[Row]:
    """Of the front, the designs that no other's best values are better than."""
    worth = {}
    for row in found.front:
        if row.trial:
            numbers = {k: NUMBERS[k].of(row.trial.printed, row.trial.toolpath) for k in found.target.objectives}
            worth[row.number] = [found.target.worth(k, b.value) for k, b in numbers.items() if b]

    def is_beaten(row: Row) -> bool:
        mine = worth[row.number]
        others = (other for number, other in worth.items() if number != row.number)
        steps = ([a - b for a, b in zip(o, mine, strict=True)] for o in others)
        slack = [_SAME * abs(a) for a in mine]
        return any(
            all(s <= t for s, t in zip(step, slack, strict=True))
            and any(s < -t for s, t in zip(step, slack, strict=True))
            for step in steps
        )

    return [row for row in found.front if not is_beaten(row)]
