"""A prediction, as commands, log, report and fit read it: typed, frozen, with a published schema."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, field, replace
from math import inf, nan
from typing import Any, Literal

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.display import Boundless, Displayed
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding
from sensorgen.core.lazy import by_key
from sensorgen.core.records import adapter
from sensorgen.core.units import si
from sensorgen.design.values import ASSUMED, ENDS, MaterialValue
from sensorgen.prediction.identifiability import results as identified
from sensorgen.prediction.plan import Plan, without_times

_SHORT = 60  # characters that say what an assumption is, on a first screen
_LEAST_PERCENT = 0.005  # change of a value that is not rounding
_LEFT = 0.01  # share of R at its worst that all terms but one have, below which that one is named [-]
_LEAST_SHARE = 1e-3  # change of C and R: less is not said
_LEAST_N, _LEAST_M = 1e-3, 1e-5  # by which a press is read wrongly: less is not said
UNPREDICTED = "12-numbers"  # rule of the finding that there are none
SCHEMA = (
    4  # 1 was a JSON of the drawing alone, of version 0.1.0; 2 had resolutions without their range; 3 no misread press
)


@dataclass(frozen=True)
class Changes:
    """Largest changes over the frequencies, relative ones but for the last two [-].

    Attributes
    ----------
    magnitude, re, im : float
        Of abs(Z), Re Z and Im Z.
    by_force : float
        Of dZ/dF.
    capacitance : float
        Of the capacitance at rest.
    force_n, position_m : float
        By which a press at the load is read wrongly, the reading compared with the one at rest [N], [m].
    """

    magnitude: float = 0.0
    re: float = 0.0
    im: float = 0.0
    by_force: float = 0.0
    capacitance: float = 0.0
    force_n: float = 0.0
    position_m: float = 0.0

    def __add__(self, other: "Changes") -> "Changes":
        return Changes(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def max(self, other: "Changes") -> "Changes":
        """The larger of both, each."""
        return Changes(*(max(a, b) for a, b in zip(astuple(self), astuple(other), strict=True)))


@dataclass(frozen=True)
class Term:
    """One source of error.

    Attributes
    ----------
    name, what : str
        Which, and what was moved between which ends.
    kind : str
        Where it comes from.
    changes : Changes or None
        Its effect; None where it is unknown.
    at_least : bool
        Whether it may be larger: the load at one end is beyond the models' range.
    source : str
        Where its range comes from: also the design, or an assumption.
    turns : str
        Verdicts that this alone leads to, with commas: "CHANGE", "PRINT", "cannot sense force", "cannot locate"; or "".
    """

    name: str
    what: str
    kind: Literal["model", "print", "material", "leads", "tip", "meter", "drift", "person"]
    changes: Changes | None
    at_least: bool = False
    source: str = ""
    turns: str = ""

    def magnitude(self) -> float:
        """Relative change of abs(Z), infinite where it is unknown [-]."""
        return inf if self.changes is None or self.at_least else self.changes.magnitude

    def words(self) -> str:
        """Range and source, and by how much a press is read wrongly."""
        what = f": {self.what}" * (len(self.what) <= _SHORT)
        return f"{self.name}{what} ({self.source}) reads a press wrongly by {' and '.join(self.wrong())}"

    def wrong(self) -> list[str]:
        """Force and position by which a press is read wrongly, where these are more than nothing."""
        c = self.changes or Changes()
        return [identified.newtons(c.force_n)] * (c.force_n > _LEAST_N) + [identified.metres(c.position_m)] * (
            c.position_m > _LEAST_M
        )

    def at_rest(self) -> str:
        """Changes of C and R in per cent, from a thousandth on."""
        sizes = ("C", (self.changes or Changes()).capacitance), ("R", (self.changes or Changes()).re)
        return ", ".join(f"{name} {float(f'{100 * size:.2g}'):g} %" for name, size in sizes if size >= _LEAST_SHARE)

    def remark(self) -> str:
        """That it is unknown, or may be larger."""
        return "unknown" if self.changes is None else "at least" if self.at_least else ""


@dataclass(frozen=True)
class ErrorBudget:
    """All that the numbers at a load rest on, each moved to the ends of its range.

    Attributes
    ----------
    force_n, position_m : float
        The load [N], [m].
    terms : tuple of Term
        All of them.
    total : Changes or None
        Their sum, as if each were at its worst: bounds do not average out. None where a term is unknown.
    at_least : bool
        Whether the sum may be larger.
    accuracy : float or None
        Wanted of abs(Z) [-].
    """

    force_n: float
    position_m: float
    terms: tuple[Term, ...]
    total: Changes | None
    at_least: bool
    accuracy: float | None = None

    def largest(self) -> Term:
        """The term with the largest effect on abs(Z)."""
        return max(self.terms, key=Term.magnitude)

    def by_press(self) -> tuple[Term, ...]:
        """All terms, that with the largest effect on what a press is read as first, in shares of the load."""

        def effect(term: Term) -> float:
            c = term.changes or Changes()
            return max(c.force_n / (self.force_n or inf), c.position_m / (self.position_m or inf))

        return tuple(sorted(self.terms, key=effect, reverse=True))

    def rests_on(self, verdict: str = "") -> Iterator[str]:
        """The largest assumption, and verdicts that assumptions alone lead to in place of that on the print."""
        by_press = self.by_press()
        if by_press[0].wrong():
            yield f"largest assumption: {by_press[0].words()}"
        turned = by_key((words, t.name) for t in by_press for words in filter(None, t.turns.split(", ")))
        turned.pop("CHANGE" if verdict == "CHANGE" else "PRINT" if verdict else "", None)
        if turned:
            shown = (f"{words} ({name}{f', {len(more)} more' * bool(more)})" for words, (name, *more) in turned.items())
            yield f"one alone gives: {'; '.join(shown)}"

    def met_by(self, *kinds: str) -> bool:
        """Test whether the terms of some kinds together are within the accuracy."""
        return sum(t.magnitude() for t in self.terms if t.kind in kinds) <= (self.accuracy or 0.0)

    def beyond(self) -> tuple[str, ...]:
        """Names of the terms that alone exceed the accuracy."""
        return tuple(t.name for t in self.terms if t.magnitude() > (self.accuracy or 0.0))

    def document(self) -> Iterator[Part]:
        """Each term, their sum, the largest, and whether the accuracy is reached."""
        terms = (
            *self.terms,
            *([Term("all at their worst", "", "model", self.total, self.at_least)] if self.total else ()),
        )
        columns = (Column("error"), *(Column(f, "%", digits=2) for f in ("|Z|", "R", "X", "dZ/dF")), Column(""))
        caption = f"error budget at {self.force_n:g} N and {self.position_m * 1e3:g} mm, at the worst frequency"
        yield Table("budget", caption, columns, tuple((t.name, *_percent(t, 4), t.remark()) for t in terms))
        largest = self.largest()
        yield f"largest: {largest.name} ({largest.what})"
        yield from self._by_one()
        if not self.accuracy:
            return
        beyond = f"; larger alone: {', '.join(self.beyond())}" if self.beyond() else ""
        if self.met_by("model", "print", "material", "leads"):
            yield f"accuracy {self.accuracy:g} of |Z| reached"
        elif self.met_by("model"):
            yield f"accuracy {self.accuracy:g} of |Z| reached by the models, not by print, material and leads{beyond}"
        else:
            yield f"accuracy {self.accuracy:g} of |Z| not reached by the models{beyond}"

    def _by_one(self) -> Iterator[str]:
        """Remainder of R at its worst without one term that is nearly all of it, as one over D squared is."""
        known = [t for t in self.terms if t.changes]
        most = max(known, key=lambda t: (t.changes or Changes()).re, default=None)
        left = sum((t.changes or Changes()).re for t in known if t is not most)
        if most and self.total and left < _LEFT * self.total.re:
            yield f"R at its worst is that of one term, {most.name}: {100 * left:.2g} % without it"

    def assumed(self) -> Iterator[Part]:
        """Effects of each assumption alone at the ends of its range, the largest on a press first."""
        columns = (
            Column("assumption"), Column("C", "%", digits=2), Column("R", "%", digits=2), Column("F", "N", digits=2),
            Column("x", "mm", digits=2), Column("leads to"),
        )  # fmt: skip
        by_press = self.by_press()
        rows = (
            (t.name, *((100 * c.capacitance, 100 * c.re, c.force_n, 1e3 * c.position_m) if c else (None,) * 4), t.turns)
            for t in by_press
            for c in (t.changes,)
        )
        caption = "a press read wrongly by one assumption at an end of its range (F, x), without known presses"
        yield Table("assumptions", caption, columns, tuple(rows))
        yield "(readings compared with those at rest; leads to: the verdict that this alone would change to)"
        ranges = tuple((t.name, f"{t.what} ({t.source})") for t in by_press)
        yield Table("assumed_ranges", "", (Column("assumption"), Column("range (source)")), ranges)


def _percent(term: Term, count: int) -> tuple[float | None, ...]:
    return tuple(100 * v for v in astuple(term.changes)[:count]) if term.changes else (None,) * count


@dataclass(frozen=True)
class Narrowing:
    """The one measurement that narrows a range most.

    Attributes
    ----------
    quantity, measurement : str
        Which, and by what.
    factor, left : float
        Upper over lower end of the range, now and then [-]; infinite where an end is unknown.
    """

    quantity: str
    measurement: str
    factor: float
    left: float


@dataclass(frozen=True)
class Impedance:
    """Impedance at one frequency, at rest.

    Attributes
    ----------
    frequency_hz : float
        Frequency [Hz].
    re, im : Bounds
        Real and imaginary part [ohm].
    """

    frequency_hz: float
    re: Bounds
    im: Bounds


@dataclass(frozen=True)
class UnderTop:
    """Numbers under one top of the cell, without what other tops would change.

    Attributes
    ----------
    name : str
        As "stiff plate".
    force_resolution, position_resolution, sensitivity : Bounds or None
        As of :class:`Prediction` [N], [m], [1/kPa].
    calibrated, typical : StandardErrors or None
        After 30 known presses at the reference load; medians over forces and positions.
    """

    name: str
    force_resolution: Bounds | None = None
    position_resolution: Bounds | None = None
    sensitivity: Bounds | None = None
    calibrated: identified.StandardErrors | None = None
    typical: identified.StandardErrors | None = None

    def bench(self) -> tuple[Bounds | None, Bounds | None]:
        """Standard errors of force and position after known presses [N], [m]."""
        known = self.calibrated or identified.StandardErrors(sigma_force_n=None, sigma_position_m=None)
        return (
            on_bench(self.force_resolution, known.sigma_force_n),
            on_bench(self.position_resolution, known.sigma_position_m),
        )

    def words(self, most_n: float = inf, length_m: float = inf) -> str:
        """Name, standard errors after known presses; what cannot be done up to a force [N] and over a length [m]."""
        force, position = self.bench()
        known = ((force, "N", most_n, identified.CANNOT_SENSE), (position, "m", length_m, identified.CANNOT_LOCATE))
        words = [
            si(b.value, u, 3) if b.value < identified.GUESS * abs(most) else cannot for b, u, most, cannot in known if b
        ]
        return f"{self.name} {', '.join(words)}"


@dataclass(frozen=True)
class Prediction(Boundless, Displayed):
    """Prediction of a sensor's readings.

    Attributes
    ----------
    schema : int
        Version of this record.
    design, design_id : str
        Name and identity of the design.
    body : str
        What is predicted: "drawn", or how it is printed.
    status : str
        "predicted"; "short" where electrodes touch; "not predicted" where no model applies or a value is missing.
    reason : str
        Why nothing is predicted, or no load; "" otherwise.
    gap : Bounds or None
        Smallest distance of two electrodes [m].
    capacitance : Bounds or None
        Between the electrodes, at rest [F].
    resistance : dict of str to Bounds
        Of each electrode, end to end [ohm].
    corner_frequency : Bounds or None
        Frequency above which the current no longer reaches the far end [Hz].
    impedance : tuple of Impedance
        At rest.
    sensitivity : Bounds or None
        Relative change of capacitance per pressure, from rest to the reference load [1/kPa].
    force_n, position_m : float
        The reference load [N], [m].
    force_resolution, position_resolution : Bounds or None
        Standard errors of force and position there, from one reading [N], [m]; None where undefined. The range holds
        what ways to print it differ by, and is infinite where that is not known.
    tops : tuple of UnderTop
        Those numbers under the tip, an even pressure and a stiff plate, where they differ by more than the models'
        error; the ranges of the numbers above hold all of them.
    identifiability : Identifiability or None
        How precisely impedance determines force and position.
    budget : ErrorBudget or None
        Error of the impedance at the reference load.
    plan : Plan or None
        Which models were used, their cost and error, and which were not and why.
    values : tuple of MaterialValue
        Material values that it rests on.
    assumptions : tuple of str
        What is taken for granted.
    doubts : tuple of str
        Why numbers under load, or the choice of the cell, may be wrong by more than their ranges say.
    drawn : Prediction or None
        The drawing's, beside that of a print.
    narrowing : tuple of Narrowing
        What narrows ranges that span a factor above 3.
    """

    schema: int
    design: str
    design_id: str
    body: str
    status: Literal["predicted", "short", "not predicted"]
    force_n: float
    position_m: float
    reason: str = ""
    gap: Bounds | None = None
    capacitance: Bounds | None = None
    resistance: dict[str, Bounds] = field(default_factory=dict)
    corner_frequency: Bounds | None = None
    impedance: tuple[Impedance, ...] = ()
    sensitivity: Bounds | None = None
    force_resolution: Bounds | None = None
    position_resolution: Bounds | None = None
    tops: tuple[UnderTop, ...] = ()
    identifiability: identified.Identifiability | None = None
    budget: ErrorBudget | None = None
    plan: Plan | None = None
    values: tuple[MaterialValue, ...] = ()
    assumptions: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    drawn: "Prediction | None" = None
    narrowing: tuple[Narrowing, ...] = ()

    def bench(self) -> tuple[Bounds | None, Bounds | None]:
        """Standard errors of force and position after known presses, under the worst top [N], [m]."""
        force, position = zip(*(top.bench() for top in self.under()), strict=True)
        return _worst(force), _worst(position)

    def under(self) -> tuple[UnderTop, ...]:
        """Numbers under each top, where they differ; else under the tip."""
        known = self.identifiability
        own = (self.force_resolution, self.position_resolution, self.sensitivity)
        return self.tops or (UnderTop("", *own, *((known.calibrated, known.map.typical()) if known else ())),)

    def by_top(self) -> str:
        """Standard errors under each top, in words; "" where they do not differ."""
        most = self.identifiability.most if self.identifiability else (inf, inf)
        return "; ".join(top.words(*most) for top in self.tops)

    @property
    def exact(self) -> bool:
        """True where resolutions are known of a perfect model alone."""
        return bool(self.force_resolution) and not any(top.calibrated for top in self.under())

    @property
    def conditional(self) -> bool:
        """True where it rests on values that no source gives."""
        return any(value.source == ASSUMED for value in self.values)

    def resolved(self) -> tuple[str, str]:
        """Standard errors of force and position on a bench, in words; what the sensor cannot do."""
        (force, position), known = self.bench(), self.identifiability
        length_m = max(known.map.position_m, default=inf) if known else inf
        return (
            resolved(force, self.force_n, identified.CANNOT_SENSE, conditional=self.conditional),
            resolved(position, length_m, identified.CANNOT_LOCATE, conditional=self.conditional),
        )

    def rests_on(self, verdict: str = "") -> tuple[str, ...]:
        """The largest assumption, and verdicts that assumptions alone lead to."""
        return tuple(self.budget.rests_on(verdict)) if self.budget else ()

    def summary(self) -> Iterator[Part]:
        """Quantities of the print beside the drawing's: the best value and the range with all errors."""
        shown = [self.drawn, self] if self.drawn else [self]
        words = [p._words_of_quantities() for p in shown]
        rows = [(name, *(each.get(name) for each in words)) for name in words[-1]]
        columns = (Column(""), *(Column(p.body.partition(",")[0]) for p in shown))
        yield Table("quantities", "", columns, tuple(rows))
        yield caption_of(self.force_n, self.position_m, self.body, exact=self.exact)
        if self.tops:
            yield f"the worst of: {self.by_top()}"
        if self.narrowing:
            columns = (Column("range that spans"), Column("a factor"), Column("narrowed most by"), Column("to"))
            rows_ = ((n.quantity, _times(n.factor), n.measurement, _times(n.left)) for n in self.narrowing)
            yield Table("narrowing", "", columns, tuple(rows_))

    def _words_of_quantities(self) -> dict[str, str | None]:
        """Quantities of the summary in words, by name."""
        words = {name: bounds.words() if bounds else None for name, bounds in self.quantities().items()}
        words["capacitance"] = words["capacitance"] or self.status
        words["sensitivity"] = (words["sensitivity"] or "–").replace(" 1/kPa", "")
        words["force resolution"], words["position resolution"] = self.resolved()
        return {f"{name} [1/kPa]" if name == "sensitivity" else name: of for name, of in words.items()}

    def quantities(self) -> dict[str, Bounds | None]:
        """Quantities of the summary by name; resolutions as on a bench."""
        force, position = self.bench()
        return {
            "electrode gap": self.gap, "capacitance": self.capacitance,
            **{f"{end} electrode": bounds for end, bounds in self.resistance.items()}, "sensitivity": self.sensitivity,
            "force resolution": force, "position resolution": position,
        }  # fmt: skip

    def table(self) -> Table:
        """Quantities in numbers [unit]: value, lower and upper end of the range, of the drawing before the print."""
        shown = [self.drawn, self] if self.drawn else [self]
        bodies, quantities = [p.body.partition(",")[0] for p in shown], [p.quantities() for p in shown]
        columns = [Column(f"{body}{end}") for body in bodies for end in ("", "_lower", "_upper")]
        names = dict.fromkeys(name for each in quantities for name in each)
        rows = ((name, *_numbers([each.get(name) for each in quantities])) for name in names)
        return Table("quantities", "", (Column("quantity"), Column("unit"), *columns), tuple(rows))

    def document(self) -> Iterator[Part]:
        """The prediction, what its ranges hold, impedance, identifiability and error budget."""
        if self.capacitance is None:
            yield f"{self.design}: {self.reason}"
            if self.drawn and self.drawn.capacitance:
                yield from ("", *self.summary())
            return
        yield self.design
        yield from self.summary()
        yield ""
        yield self._ranges()
        if self.impedance:
            yield f"corner frequency {self.corner_frequency.words() if self.corner_frequency else 'undefined'}"
            yield ""
            columns = (
                Column("at rest", "Hz", si=True), Column("Re", "ohm", digits=5), Column("range"),
                Column("Im", "ohm", digits=5), Column("range"),
            )  # fmt: skip
            z = (
                (row.frequency_hz, *(cell for part in (row.re, row.im) for cell in (part.value, _range(part))))
                for row in self.impedance
            )
            yield Table("impedance", "", columns, tuple(z))
        yield ""
        yield from self.judgement()
        yield ""
        yield from self.remarks()

    def _ranges(self) -> Table:
        """Causes of the ranges of capacitance and resistance."""
        c = self.capacitance or Bounds.of(0.0, "F")
        certified = " (certified)" if c.certified else ""
        heads = ("range of", f"model{certified}", "print", "material", "leads, edge")
        quantities = {"capacitance": c, **{f"{e} electrode": r for e, r in self.resistance.items()}}
        ranges = (
            (name, *(_change(part, b.value) if part else "" for part in (b.model, b.print, b.material, b.leads)))
            for name, b in quantities.items() if b.value
        )  # fmt: skip
        return Table("ranges", "", tuple(map(Column, heads)), tuple(ranges))

    def remarks(self) -> Iterator[Part]:
        """Assumptions and doubts."""
        yield from (f"assumed: {assumption}" for assumption in self.assumptions)
        yield from (f"doubtful: {doubt}" for doubt in self.doubts)

    def explained(self) -> Iterator[Part]:
        """Models that were used, their cost and error."""
        yield from (*self.plan.document(), "") if self.plan else ()

    def judgement(self) -> Iterator[Part]:
        """Identifiability and error budget; or why there are none."""
        if self.identifiability:
            yield from self.identifiability.document()
            medians = [
                f"{top.name} {top.typical.words(*self.identifiability.most)}" for top in self.tops if top.typical
            ]
            if medians:
                yield f"median over forces and positions: {'; '.join(medians)}"
        elif self.reason:
            yield f"no load: {self.reason}"
        if self.budget:
            yield ""
            yield from self.budget.document()
            yield ""
            yield from self.budget.assumed()

    def to_json(self) -> str:
        """Indented JSON of the published schema."""
        return json.dumps(json.loads(to_json(self)), indent=2, ensure_ascii=False) + "\n"

    def missing(self) -> str:
        """Why capacitance or the resistance of an electrode is not predicted; "" where all are."""
        if self.status == "short" or (self.capacitance and len(self.resistance) == len(ENDS)):
            return ""
        return next((doubt for doubt in self.doubts if doubt.startswith("no resistance")), self.reason)

    def problems(self, accuracy: float | None) -> Sequence[str]:
        """A short, and that abs(Z) is not within an accuracy that was asked for [-]."""
        if self.status == "short":
            return (f"a short: {self.reason}",)
        if accuracy is None or self.capacitance is None:
            return ()
        reached = self.plan.width if self.plan else self.capacitance.model.width()
        if reached is not None and reached <= accuracy:
            return ()
        best = "error unknown" if reached in (None, inf) else f"{reached:.2g}"
        return ("; ".join((f"accuracy {accuracy:g} not reached: {best}", *(self.plan.shares() if self.plan else ()))),)

    def overview(self) -> Iterator[Part]:
        """The first screen: numbers on a bench, what narrows them, and what is doubtful."""
        if self.capacitance is None:
            yield from self.document()
            return
        yield self.design
        yield from self.summary()
        if self.reason and not self.identifiability:
            yield f"no load: {self.reason}"
        yield from self.rests_on()
        yield from (f"doubtful: {doubt}" for doubt in self.doubts)
        yield f"(--details: causes of the ranges, impedance, error budget, {len(self.assumptions)} assumptions)"


def caption_of(force_n: float, position_m: float, body: str, *, exact: bool) -> str:
    """For which press, after what calibration and of which body resolutions are stated."""
    known = "of a perfect model" if exact else "after 30 known presses"
    return f"(resolution {known}, at {force_n:g} N and {position_m * 1e3:g} mm; {body})"


def on_bench(exact: Bounds | None, calibrated: float | None) -> Bounds | None:
    """Standard error after known presses, its relative range that of a perfect model; of that where it has no other."""
    if exact is None or calibrated is None:
        return exact
    return exact.times(calibrated / exact.value, exact.unit)


def _worst(errors: Sequence[Bounds | None]) -> Bounds | None:
    """Largest standard error, its range that of all; None where none is known."""
    known = [b for b in errors if b]
    if not known:
        return None
    ends = min(b.lower for b in known), max(b.upper for b in known)
    return replace(max(known, key=lambda b: b.value), lower=ends[0], upper=ends[1])


def _times(factor: float) -> str:
    return f"x {factor:.2f}" if factor < 2 else f"x {factor:.2g}" if factor < 100 else "x > 100"


def unpredicted(reason: str) -> Finding:
    """That a sensor's verdict rests on its checks alone."""
    advice = "see what is missing; until then the verdict is that of the checks alone"
    return Finding(UNPREDICTED, "warning", "sensor", f"no electrical numbers: {reason}", advice)


def resolved(error: Bounds | None, most: float, cannot: str, *, conditional: bool = False) -> str:
    """A standard error in words; where it is that of a reading without information, what the sensor cannot do.

    Where the error is conditional, as on values that no source gives, the best of its range is stated beside that.

    >>> resolved(Bounds.of(8580.0, "m"), 0.1, "cannot locate"), resolved(Bounds.of(0.2, "N"), 6.0, "cannot sense")
    ('cannot locate', '200 mN')
    >>> resolved(Bounds.of(0.12, "m", model=Interval(0.0065, 1.0)), 0.1, "cannot locate", conditional=True)
    'cannot locate, at best 6.5 mm'

    Where the print may be anything, no end of the range is known.

    >>> resolved(Bounds.of(0.65, "N", print=Interval(0.0, inf)), 6.0, "cannot sense force")
    '650 mN (error unknown)'
    """
    if error is None:
        return "–"
    if not (error.lower if conditional else error.value) < identified.GUESS * most:
        return cannot
    if not error.value < identified.GUESS * most:
        return f"{cannot}, at best {si(error.lower, error.unit, 2)}"
    if error.upper > most and error.lower > 0:
        error = replace(error, upper=most, open="upper")
    return error.words()


def _numbers(of: Sequence[Bounds | None]) -> Iterator[str | float | None]:
    """Unit of a quantity, and value and ends of each range; None where there is none."""
    yield next((bounds.unit for bounds in of if bounds), "")
    for bounds in of:
        yield from (bounds.value, bounds.lower, bounds.upper) if bounds else (None, None, None)


def _range(bounds: Bounds) -> str:
    return " to ".join(f"{float(f'{end:.3g}'):g}" for end in (bounds.lower, bounds.upper))


def _change(part: Interval, value: float) -> str:
    """Changes from the best value to the ends [%]."""
    changes = [100 * (end / value - 1) for end in (part.lower, part.upper)]
    if max(map(abs, changes)) < _LEAST_PERCENT:
        return "none" if part.lower == part.upper else f"within {2 * _LEAST_PERCENT:g} %"
    return " to ".join(f"{float(f'{c:.2g}'):+g}" if abs(c) >= _LEAST_PERCENT else "0" for c in changes) + " %"


def to_json(prediction: Prediction) -> str:
    """A prediction as JSON, the same for the same prediction: without run times; infinities are "Infinity"."""
    return adapter(Prediction).dump_json(timeless(prediction)).decode()


def timeless(prediction: Prediction) -> Prediction:
    """A prediction without run times, which differ from run to run."""
    plan, drawn = prediction.plan, prediction.drawn
    return replace(prediction, plan=plan and without_times(plan), drawn=drawn and timeless(drawn))


def from_json(text: str) -> Prediction:
    """A prediction from JSON of this or an older schema.

    Raises
    ------
    BadInput
        Not a prediction, or one of a newer version of sensorgen.
    """
    try:
        data = json.loads(text)
        if isinstance(data, dict) and "schema" not in data:
            return _of_schema_1(data)
        if isinstance(data, dict) and data["schema"] not in (2, 3, SCHEMA):
            raise BadInput(f"a prediction of schema {data['schema']}; this version reads {SCHEMA} and older: update")
        known, old = adapter(Prediction), isinstance(data, dict) and data["schema"] == 2
        found: Prediction = (
            known.validate_python(_of_schema_2(data), strict=False) if old else known.validate_json(text)
        )
        return found
    except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
        raise BadInput(f"not a prediction: {str(error).partition(chr(10))[0]:.200}") from None


def _of_schema_2(data: dict[str, Any]) -> dict[str, Any]:
    """Resolutions were numbers, without what ways to print differ by."""
    fields = {"schema": SCHEMA, **{k: v for k, v in data.items() if k not in ("schema", "drawn")}}
    for name, unit in (("force_resolution", "N"), ("position_resolution", "m")):
        value = fields.pop(f"{name}_{unit.lower()}", None)
        fields[name] = value and Bounds.of(float(value), unit)
    return {**fields, "drawn": data.get("drawn") and _of_schema_2(data["drawn"])}


def _of_schema_1(data: dict[str, Any]) -> Prediction:
    """A prediction of version 0.1.0: of the drawing, its capacitance between bounds of the model alone."""
    data = {key: value for key, value in data.items() if value}
    reason, known = data.get("reason", ""), data.get("identifiability", {})
    unpredicted: Literal["short", "not predicted"] = "short" if "electrodes touch" in reason else "not predicted"
    press = known.get("press") or {}
    return Prediction(
        1, "", "", "drawn", "predicted" if "capacitance_f" in data else unpredicted, press.get("force_n", nan),
        press.get("position_m", nan), reason,
        capacitance=_old_bounds(data.get("capacitance_f"), "F"),
        resistance={end: Bounds.of(ohm, "ohm") for end, ohm in data.get("electrode_resistance_ohm", {}).items()},
        corner_frequency=_old_bounds(data.get("corner_frequency_hz"), "Hz"),
        impedance=tuple(_old_impedance(tone) for tone in data.get("impedance_ohm", ())),
        identifiability=identified.of_schema_1(known), assumptions=tuple(data.get("assumptions", ())),
        values=tuple(MaterialValue(**value) for value in data.get("values", ())),
    )  # fmt: skip


def _old_bounds(data: dict[str, float] | None, unit: str) -> Bounds | None:
    if not data:
        return None
    lower, upper = data["lower"], data.get("upper", data["lower"])
    return Bounds.of(data.get("middle", (lower * upper) ** 0.5), unit, model=Interval(lower, upper), certified=True)


def _old_impedance(data: dict[str, Any]) -> Impedance:
    def part(name: str) -> Bounds:
        value, (low, high) = data[name], data[f"{name}_range"]
        exact = Interval(value, value)
        return Bounds(value, low, high, "ohm", Interval(low, high), exact, exact, certified=True)

    return Impedance(data["frequency_hz"], part("re"), part("im"))
