"""Designs tried: findings, verdict, and the numbers that decide, drawn beside printed; changes, and their effects."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.core import files, yamlfile
from sensorgen.core.bounds import Bounds
from sensorgen.core.display import Boundless, Displayed
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding, Verdict, counted, counts, grouped, listed, most_severe, verdict
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design, load, make
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE, FORCE_SHARE, GUESS
from sensorgen.prediction.query import DEFAULT, Query
from sensorgen.prediction.results import Prediction, caption_of, resolved
from sensorgen.prediction.slices import PrintReview, reviewed

if TYPE_CHECKING:
    from sensorgen.prediction.new_slice import SliceReport

SAME = 0.02  # relative difference of resolutions that is none [-]
NOT_COMPARED = (
    "aimed at these alone: the print may sense force and position worse than that of what was asked for; build that, "
    "then this again, to compare"
)


@dataclass(frozen=True)
class Numbers:
    """The numbers of a body; None where one is unknown or undefined.

    Attributes
    ----------
    gap : Bounds or None
        Smallest distance of the electrodes [m].
    capacitance : Bounds or None
        Between the electrodes, at rest [F].
    top_electrode, bottom_electrode : Bounds or None
        Resistance end to end [ohm].
    sensitivity : Bounds or None
        Relative change of capacitance per pressure, over the range of the query [1/kPa].
    force_resolution, position_resolution : Bounds or None
        Standard errors from one reading at the reference load, of a sensor that is exactly as predicted [N], [m].
    force_calibrated, position_calibrated : Bounds or None
        The same on a bench, after 30 known presses of a specimen [N], [m].
    force_typical, position_typical : float or None
        Median of the standard errors over all forces and positions [N], [m].
    conditional : bool
        Whether they rest on values that no source gives.
    by_top : str
        Standard errors after known presses under each top, in words; "" where the top makes no difference.
    pressure_resolution, wires : float or None
        Of an array: median standard error of a crossing's pressure, at 100 kPa [kPa], and number of wires [-].
    """

    gap: Bounds | None = None
    capacitance: Bounds | None = None
    top_electrode: Bounds | None = None
    bottom_electrode: Bounds | None = None
    sensitivity: Bounds | None = None
    force_resolution: Bounds | None = None
    position_resolution: Bounds | None = None
    force_calibrated: Bounds | None = None
    position_calibrated: Bounds | None = None
    force_typical: float | None = None
    position_typical: float | None = None
    conditional: bool = False
    by_top: str = ""
    pressure_resolution: float | None = None
    wires: float | None = None

    @classmethod
    def of(cls, found: Prediction) -> "Numbers":
        """The numbers of a prediction, under the worst top where they depend on it."""
        tops = found.under()
        on_bench = found.bench() if any(top.calibrated for top in tops) else (None, None)

        def worst(key: str) -> Bounds | None:
            values: list[Bounds] = [b for top in tops if (b := getattr(top, key))]
            sign = 1 if key == "sensitivity" else -1
            return min(values, key=lambda b: sign * b.value, default=None)

        def typical(part: str) -> float | None:
            values = [getattr(top.typical, part) for top in tops if top.typical]
            return max((v for v in values if v is not None), default=None)

        return cls(
            found.gap, found.capacitance, found.resistance.get("top"), found.resistance.get("bottom"),
            worst("sensitivity"), worst("force_resolution"), worst("position_resolution"),
            *on_bench, typical("sigma_force_n"), typical("sigma_position_m"),
            found.conditional, found.by_top(),
        )  # fmt: skip

    def bench(self) -> tuple[Bounds | None, Bounds | None]:
        """Standard errors of force and position on a bench, after known presses [N], [m]."""
        return self.force_calibrated or self.force_resolution, self.position_calibrated or self.position_resolution


@dataclass(frozen=True)
class Toolpath:
    """Needs of a G-code file, and how it exposes the film to shorts.

    Attributes
    ----------
    source : str
        Slicer and version.
    time_s : float
        At the file's feeds, without acceleration, heating and tool changes: a lower bound [s].
    exposure_mm : float
        Way that nozzles go in contact with what another tool has printed, travelling or printing beside it [mm].
    crossings : int
        Travels over it, in contact or near, that are longer than 0.5 mm [-].
    """

    source: str
    time_s: float
    exposure_mm: float
    crossings: int

    @classmethod
    def of(cls, made: "SliceReport") -> "Toolpath":
        """By what each tool passes over."""
        tools = made.lifting.after.tools
        touching = sum(tool.contact_mm + tool.rubbing_mm for tool in tools)
        source = f"{made.slicer.name} {made.slicer.version}"
        return cls(source, made.time_s, touching, sum(tool.crossings for tool in tools))


@dataclass(frozen=True)
class Trial(Boundless, Displayed):
    """One design tried.

    Attributes
    ----------
    name, design : str
        Name and identity of the design.
    body : str
        How it is printed, in words.
    status, reason : str
        As of :class:`sensorgen.prediction.results.Prediction`, of the print.
    verdict : str
        CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT.
    findings : tuple of Finding
        Of the drawing and of the print, those left out that the design waives.
    force_n, position_m : float
        The reference load [N], [m].
    length_m : float
        Of the sensor [m].
    drawn, printed : Numbers
        Of the drawing, and of the print.
    doubts : tuple of str
        Why the print's numbers may be wrong by more than their ranges say.
    toolpath : Toolpath or None
        Of the G-code; None for an estimate.
    rests_on : tuple of str
        Assumption that a press is read most wrongly by, and verdicts that assumptions alone lead to.
    """

    name: str
    design: str
    body: str
    status: str
    reason: str
    verdict: Verdict
    findings: tuple[Finding, ...]
    force_n: float
    position_m: float
    length_m: float
    drawn: Numbers
    printed: Numbers
    doubts: tuple[str, ...] = ()
    toolpath: Toolpath | None = None
    rests_on: tuple[str, ...] = ()

    def errors(self) -> tuple[Finding, ...]:
        """Findings that are errors."""
        return tuple(f for f in self.findings if f.severity == "error")

    def document(self) -> Iterator[Part]:
        """Verdict, numbers drawn beside printed, doubts, and the findings that matter most."""
        yield f"{self.verdict}  {self.name}: {counted(counts(self.findings))}"
        yield ""
        yield from table(self)
        yield from listed(most_severe(self.findings, 3))


def grade(tried: Trial) -> tuple[int, int]:
    """Grade of the print's sensing of force, and of locating: 2 yes, 1 roughly, 0 no."""
    length_m = 2 * tried.position_m  # the reference load is in the middle
    force, place = tried.printed.force_resolution, tried.printed.position_resolution
    return (
        _grade(force, FORCE_SHARE * tried.force_n, GUESS * tried.force_n),
        _grade(place, FORCE_SHARE * length_m, GUESS * length_m),
    )


def _grade(error: Bounds | None, good: float, useless: float) -> int:
    return 0 if error is None or not error.value < useless else 2 if error.value <= good else 1


def table(tried: Trial) -> Iterator[Part]:
    """Electrode gap, capacitance, resistance of the electrodes, resolution, time of the print where known; doubts."""
    drawn, printed = (_in_words(n, tried.force_n, 2 * tried.position_m) for n in (tried.drawn, tried.printed))
    rows = [(name, drawn[name], words) for name, words in printed.items()]
    if tried.toolpath:
        rows.append(("print time", "", f"at least {tried.toolpath.time_s / 60:.0f} min"))
    yield Table("numbers", "", (Column(""), Column("drawn"), Column("printed")), tuple(rows))
    exact = tried.printed.force_resolution and not tried.printed.force_calibrated
    yield caption_of(tried.force_n, tried.position_m, tried.body, exact=bool(exact))
    if tried.printed.by_top:
        yield f"printed, the worst of: {tried.printed.by_top}"
    yield from tried.rests_on
    if tried.reason:
        yield f"{'not predicted: ' * (tried.status == 'not predicted')}{tried.reason}"
    yield from (f"doubtful: {doubt}" for doubt in tried.doubts)


def _in_words(numbers: Numbers, force_n: float, length_m: float) -> dict[str, str]:
    """Numbers of a body by name."""
    return {
        "electrode gap": _words(numbers.gap), "capacitance": _words(numbers.capacitance),
        "top electrode": _words(numbers.top_electrode), "bottom electrode": _words(numbers.bottom_electrode),
        "force resolution": _force(numbers, force_n), "position resolution": _place(numbers, length_m),
    }  # fmt: skip


def words_of(tried: Trial) -> str:
    """Capacitance and resolutions of the print, in one line."""
    printed = tried.printed
    c = printed.capacitance
    force, place = _force(printed, tried.force_n), _place(printed, 2 * tried.position_m)
    return ", ".join((
        f"C {_best(c)}" if c else tried.status,
        force if force.startswith("cannot") else f"force {_best(printed.bench()[0])}",
        place if place.startswith("cannot") else f"position {_best(printed.bench()[1])}",
    ))  # fmt: skip


def _force(numbers: Numbers, force_n: float) -> str:
    return resolved(numbers.bench()[0], force_n, CANNOT_SENSE, conditional=numbers.conditional)


def _place(numbers: Numbers, length_m: float) -> str:
    return resolved(numbers.bench()[1], length_m, CANNOT_LOCATE, conditional=numbers.conditional)


def _words(bounds: Bounds | None) -> str:
    return bounds.words() if bounds else "–"


def _best(bounds: Bounds | None) -> str:
    """The best value alone, to two digits."""
    return Bounds.of(float(f"{bounds.value:.2g}"), bounds.unit).words() if bounds else "–"


def _crossings(design: Design) -> str:
    """Part of an array that numbers are of, in words; "" of any other design."""
    return f"one of {sum(map(sum, design.layout.here))} crossings, " if design.layout else ""


def trial(
    design: Design, query: Query = DEFAULT, *, folder: Path | None = None, slicer: str = "", keep: bool = True,
    drawn: bool = True, held: PrintReview | None = None,
) -> Trial:  # fmt: skip
    """Check a design, and predict its drawing and its print.

    Parameters
    ----------
    design : Design
        What is tried.
    query : Query
        Reference load, tip, frequencies, range of the sensitivity.
    folder, slicer : Path, str
        As of :func:`sensorgen.prediction.slices.reviewed`.
    keep : bool
        Read stored predictions and store new ones.
    drawn : bool
        Predict the drawing, too.
    held : PrintReview, optional
        Findings about the print, if they are known.

    Raises
    ------
    SensorgenError
        A name or value of the design is missing, or a query that no sensor can answer; a slicer that fails.

    Examples
    --------
    >>> tried = trial(Design(shape="reference", name="plate"))
    >>> tried.verdict, tried.printed.capacitance.unit
    ('PRINT', 'F')
    """
    held = held or reviewed(design, slicer=slicer, folder=folder)
    body = bodies.of_file(design, held.file)
    predicted = evaluate(body, query, keep=keep, beside=drawn)
    findings = tuple(f for f in held.findings if not f.waiver)
    said = verdict(findings)
    return Trial(
        design.name, design.id(), f"{_crossings(design)}{body.provenance}",
        predicted.status, predicted.reason, said, findings,
        predicted.force_n, predicted.position_m, design.params.length_mm * M_PER_MM,
        Numbers.of(predicted.drawn) if predicted.drawn else Numbers(), Numbers.of(predicted), predicted.doubts,
        Toolpath.of(held.file.report) if held.file else None, predicted.rests_on(said),
    )  # fmt: skip


@dataclass(frozen=True)
class Change:
    """One value that changes.

    Attributes
    ----------
    key : str
        In the design file, as ``parameters.period_mm``.
    before, after : float or str
        In the unit that the key ends in.
    """

    key: str
    before: float | str | None
    after: float | str

    def words(self) -> str:
        """Key, before and after."""
        name = self.key.rpartition(".")[2]
        before, after = (f"{v:g}" if isinstance(v, float) else v or "none" for v in (self.before, self.after))
        return f"{name} {before} -> {after}"


@dataclass(frozen=True)
class TriedChange:
    """A change of the design that was checked and predicted.

    Attributes
    ----------
    changes : tuple of Change
        What differs from the design.
    distance : float
        How far: sum of abs(ln(after / before)), with a constant for each choice [-].
    trial : Trial
        The changed design.
    about : str
        What it is, of a design that is known to be good; "" for a change that removes findings.
    better : bool
        Something that the sensor is for is better, and nothing is worse.
    effects : str
        How resolutions and sensitivity change.
    """

    changes: tuple[Change, ...]
    distance: float
    trial: Trial
    about: str = ""
    better: bool = False
    effects: str = ""

    def counts(self) -> tuple[int, int]:
        """Errors and warnings that are left, each sentence once."""
        return finding_counts(self.trial.findings)

    def words(self) -> str:
        """Changes, findings and numbers in one line."""
        errors, warnings = self.counts()
        numbers = words_of(self.trial)
        changes = ", ".join(change.words() for change in self.changes)
        left = f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"
        parts = "; ".join(filter(None, (left, numbers, self.effects)))
        return ": ".join(filter(None, (self.about, changes, parts)))


@dataclass(frozen=True)
class Advice(Boundless):
    """Attempts to remove the findings of a design.

    Attributes
    ----------
    tried : tuple of TriedChange
        Those that improve the sensor first, then the nearest.
    now : str
        Numbers of the design itself, in words.
    checked, predicted : int
        How many designs were checked, and how many of them predicted too.
    seconds, budget_s : float
        Processor time that it took, and what it may take [s].
    complete : bool
        Whether all changes up to the distance ``farthest`` were checked.
    farthest : float
        Up to which distance changes were tried [-].
    not_tried : str
        What was left out.
    known : tuple of str
        Good designs of the shape that the budget left no time to predict.
    """

    tried: tuple[TriedChange, ...]
    now: str
    checked: int
    predicted: int
    seconds: float
    budget_s: float
    complete: bool
    farthest: float
    not_tried: str
    known: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """The changes, those that improve the sensor first, then the nearest, and what was tried."""
        effort = f"{self.checked} designs checked, {self.predicted} predicted"
        if self.tried:
            rows = ((f"{k}.", one.words()) for k, one in enumerate(self.tried, 1))
            yield f"changes that were tried, those that improve the sensor first (now {self.now}):"
            yield Facts(tuple(rows))
        elif not self.checked and not self.complete:
            yield "no change was tried: the design's own prediction took the budget; a second run reads it from disk"
        else:
            yield "no change was found that removes findings and keeps what the sensor senses"
        yield from (f"not predicted for lack of time (--budget): {one}" for one in self.known)
        spent = self.seconds >= round(self.budget_s, 2)  # which is how it is rounded
        ended = f"; ended by the budget of {self.budget_s:g} s (--budget)" if spent else "; that many are tried at most"
        limit = "" if self.complete else ended
        yield f"({effort}{limit}; not tried: {self.not_tried})"


def apply(path: Path, design: Design, change: TriedChange) -> None:
    """Write a change into a design file, as a whole or not at all; comments and order stay.

    Parameters
    ----------
    path : Path
        The file.
    design : Design
        What the change was tried on.
    change : TriedChange
        What to write.

    Raises
    ------
    BadInput
        The file holds another design, as with options beside it, or cannot be changed in place.
    """
    if load(path).id() != design.id():
        raise BadInput(f"--apply: options change {path} too; expected the file alone: write them into it first")
    text = yamlfile.text(path)
    values = {tuple(one.key.split(".")): one.after for one in change.changes}
    edited = yamlfile.changed(text, values, str(path))
    if make({"name": path.stem} | yamlfile.parse(edited, str(path)), str(path)).id() != change.trial.design:
        raise BadInput(f"--apply: {path} would not become the design that was tried: edit it by hand")
    start = b"\xef\xbb\xbf" if path.read_bytes().startswith(b"\xef\xbb\xbf") else b""
    files.replace(path, start + edited.encode())


def effects(now: Trial, then: Trial) -> tuple[bool, str]:
    """Effects of a change on what the sensor is for: only good ones, and resolutions and sensitivity in words."""
    words, factors = [], list[float]()
    ends = zip(now.printed.bench(), then.printed.bench(), (now.force_n, 2 * now.position_m), strict=True)
    for name, (old, new, whole) in zip(("force resolution", "position resolution"), ends, strict=True):
        if (gain := _gain(old, new, GUESS * whole)) is not None:
            factors.append(gain)
            words.append(f"{name} {_factor(gain)}")
    if (old := now.printed.sensitivity) and (new := then.printed.sensitivity):
        factors.append(new.value / old.value)
        words.append(f"sensitivity {_factor(factors[-1])}")
    better = max(factors, default=1.0) > 1 + SAME and min(factors, default=1.0) >= 1 - SAME
    return better, ", ".join(word for word in words if not word.endswith("as now"))


def _gain(old: Bounds | None, new: Bounds | None, useless: float) -> float | None:
    """Gain of a resolution, 0 where it is lost, infinite where there was none; None without one before and after."""
    before, after = (one.value if one and one.value < useless else None for one in (old, new))
    if before is None or after is None:
        return None if before is after else inf if before is None else 0.0
    return before / after


def _factor(gain: float) -> str:
    """A gain in words."""
    if 1 - SAME <= gain <= 1 + SAME:
        return "as now"
    if gain in (0.0, inf):
        return "gained" if gain else "lost"
    return f"{gain:.2g} x better" if gain > 1 else f"{1 / gain:.2g} x worse"


def finding_counts(findings: Sequence[Finding]) -> tuple[int, int]:
    """Errors and warnings, each sentence once [-]."""
    heads = [f.severity for f in grouped(findings)]
    return heads.count("error"), heads.count("warning")


@dataclass(frozen=True)
class Adjustment:
    """One thing that compensation changed, or that comes out changed.

    Attributes
    ----------
    what : str
        Parameter, or what it does.
    before, after : float
        Values, in the unit that its name ends in.
    why : str
        In a few words.
    """

    what: str
    before: float
    after: float
    why: str


def compensation(changes: Sequence[Adjustment], compared: str = NOT_COMPARED) -> Iterator[Part]:
    """Changes by compensation, if any, and their effect on what the sensor is for."""
    if changes:
        yield "compensated for the print:"
        yield Facts(tuple((f"  {c.what}", f"{c.before:.4g} -> {c.after:.4g}: {c.why}") for c in changes))
        yield compared
        yield ""
