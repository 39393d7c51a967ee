"""One design tried: findings, verdict, and the numbers that decide, drawn beside printed."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from sensorgen.core.bounds import Bounds
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.findings import Finding, Verdict, counted, counts, listed, most_severe, verdict
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE, FORCE_SHARE, GUESS
from sensorgen.prediction.new_slice import SliceReport
from sensorgen.prediction.query import DEFAULT, Query
from sensorgen.prediction.results import Prediction, caption_of, resolved
from sensorgen.prediction.slices import PrintReview, reviewed


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
    def of(cls, made: SliceReport) -> "Toolpath":
        """By what each tool passes over."""
        tools = made.lifting.after.tools
        touching = sum(tool.contact_mm + tool.rubbing_mm for tool in tools)
        source = f"{made.slicer.name} {made.slicer.version}"
        return cls(source, made.time_s, touching, sum(tool.crossings for tool in tools))


@dataclass(frozen=True)
class Trial(Displayed):
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

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

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
    yield caption_of(tried.force_n, tried.position_m, tried.body)
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
