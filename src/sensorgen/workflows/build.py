"""From a design to the files that print it: one folder, complete or not there at all."""

import json
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sensorgen.checks.review import Step, draw, report
from sensorgen.core import document
from sensorgen.core import files as store
from sensorgen.core.cache import Unknown, only_known
from sensorgen.core.display import Boundless, Displayed
from sensorgen.core.document import Part, Table, apart
from sensorgen.core.errors import SensorgenError, Unprintable
from sensorgen.core.findings import Finding, headline, listed, most_severe
from sensorgen.core.version import __version__
from sensorgen.design import printer
from sensorgen.design.design import Design
from sensorgen.design.printer import tower
from sensorgen.export import threemf
from sensorgen.export.slicers import cura, orca, prusa
from sensorgen.export.slicers.loads import loads
from sensorgen.export.slicers.versions import folders
from sensorgen.export.threemf.core import parts_of
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Prediction, timeless, to_json
from sensorgen.prediction.slices import PrintReview, reviewed
from sensorgen.workflows import decision, sealed
from sensorgen.workflows.decision import Decision
from sensorgen.workflows.trial import NOT_COMPARED, Adjustment, Advice, Trial, compensation, effects, table, trial

QUALITIES = ("fine", "extrafine")  # every build brings the profiles of both
LIBRARIES = ("build123d", "cadquery-ocp", "manifold3d", "numpy", "pydantic", "PyYAML", "click")
STEPS = ("meshes", "checks", "validity", "prediction", "3MF", "profiles", "drawing", "STEP", "done")


@dataclass(frozen=True)
class Built(Boundless, Displayed):
    """Results of a build.

    Attributes
    ----------
    name : str
        Of the design.
    folder : Path
        Where the files are.
    files : tuple of str
        Their names there.
    verdict : str
        CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT.
    findings : tuple of Finding
        About the print.
    prediction : Prediction
        Of the print, with the drawing's beside it.
    compensated : tuple of Adjustment
        How the design differs from the one that was asked for.
    replaced : tuple of str
        What made room: files of another design in the same folder.
    trial : Trial or None
        The numbers that decide; None where nothing is predicted.
    advice : Advice or None
        Changes that were tried; None where none was looked for.
    source : str
        Of the findings: slicer and version, or that the print is estimated, and why.
    compared : str
        Effect of the compensation on the resolutions.
    """

    name: str
    folder: Path
    files: tuple[str, ...]
    verdict: str
    findings: tuple[Finding, ...]
    prediction: Prediction
    compensated: tuple[Adjustment, ...] = ()
    replaced: tuple[str, ...] = ()
    trial: Trial | None = None
    advice: Advice | None = None
    source: str = ""
    compared: str = NOT_COMPARED

    def document(self) -> Iterator[Part]:
        """Verdict, quantities drawn beside printed, and the three findings that matter most."""
        yield from self._head()
        yield from table(self.trial) if self.trial else self.prediction.summary()
        advice = self.advice.document() if self.advice else ()
        yield from apart(listed(most_severe(self.findings, 3)), advice)
        yield ""
        yield from self.written()

    def details(self) -> Iterator[Part]:
        """Verdict, all findings, and the whole prediction."""
        yield from self._head()
        yield from listed(self.findings)
        yield ""
        yield from self.prediction.document()
        yield from self.written()

    def table(self) -> Table:
        """Quantities of the prediction, as numbers."""
        return self.prediction.table()

    def written(self) -> Iterator[Part]:
        """Where the files are; nothing before they are there."""
        if self.files:
            yield from self.replaced
            yield f"{self.folder}: {len(self.files)} files; --details prints all, --advise tries changes"

    def _head(self) -> Iterator[Part]:
        yield from compensation(self.compensated, self.compared)
        predicted = self.prediction.status != "not predicted"
        yield headline(self.name, self.findings, self.source, predicted=predicted)
        yield ""


def build(
    design: Design,
    out: Path,
    *,
    cad: bool = True,
    force: bool = False,
    strict: bool = False,
    compensated: Sequence[Adjustment] = (),
    asked: Design | None = None,
    budget_s: float | None = None,
    step: Step = lambda _: None,
    decided: Callable[[Built], None] = lambda _: None,
) -> Built:
    """Write all files of a design into ``out/<name>``.

    Parameters
    ----------
    design : Design
        What to build.
    out : Path
        Folder that holds the designs' folders.
    cad : bool
        Also write the STEP file; it takes the CAD kernel some seconds.
    force : bool
        Write the files even if checks report errors.
    strict : bool
        Take warnings for errors.
    compensated : sequence of Adjustment
        How the design differs from the one that was asked for, for the record.
    asked : Design, optional
        That one: its print's resolutions are compared, where they are stored.
    budget_s : float
        Processor time for trying changes that remove findings [s]; none are tried if not given.
    step : callable
        Called with the next step, for a progress display.
    decided : callable
        Called with verdict and numbers before any file is written.

    Raises
    ------
    Unprintable
        The checks found errors; its ``findings`` has them, and nothing was written.
    Unwritable, CadFailed, MissingValue
        See there; nothing was written.
    """
    folder = out / design.name
    with ExitStack() as stack:
        predicted_ahead = stack.enter_context(decision.beside(design))
        review = reviewed(design, step, folder=folder)
        if review.errors(strict) and not force:
            raise Unprintable(review.findings, review.errors(strict), review.source)
        stage = stack.enter_context(store.staging(folder))
        job = None
        if cad:
            from sensorgen.scene.geometry.cad import CadProcess

            kernel = stack.enter_context(CadProcess())  # its import runs beside everything below
            job = kernel.submit(design.printed, _colours(design), design.name, stage / f"{design.name}.step")
        step("prediction")
        predicted_ahead()
        predicted = evaluate(bodies.of_file(design, review.file))
        final = decision.decision(design, review, budget_s, step=step)
        built = Built(
            design.name, folder, (), final.verdict, final.findings, timeless(predicted), tuple(compensated), (),
            final.trial, final.advice, review.source, _compared(asked, final.trial),
        )  # fmt: skip
        decided(built)
        for name, content in _files(design, review, predicted, final, step):
            store.write(stage, {name: content})
        if job:
            _await(job, step)
        store.write(stage, {store.MANIFEST: json_bytes(_manifest(design, stage))})
        replaced = _replaced(folder, design)
        store.publish(stage, folder)
        replaced += sealed.set_aside(folder, design)
        step("done")
    return replace(built, files=tuple(sorted([*store.listed(folder), store.MANIFEST])), replaced=replaced)


def _compared(asked: Design | None, now: Trial | None) -> str:
    """Effect of a compensation on the resolutions, as far as the print of what was asked for is predicted."""
    if not (asked and now and decision.is_known(asked)):
        return NOT_COMPARED
    try:
        with only_known():
            _, words = effects(trial(asked, drawn=False), now)
    except (Unknown, SensorgenError):
        return NOT_COMPARED
    return f"against the print of what was asked for: {words or 'it senses as that does'}"


def _replaced(folder: Path, design: Design) -> tuple[str, ...]:
    """That the folder holds another design, whose files make room."""
    try:
        key = json.loads((folder / store.MANIFEST).read_text("utf-8"))["design"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ()
    return (f"{folder} held another design, {key!r:.40}: its files were replaced",) if key != design.id() else ()


def _files(
    design: Design, review: PrintReview, predicted: Prediction, decided: Decision, step: Step
) -> Iterator[tuple[str, bytes]]:
    name, primed = design.name, tower(design.machine, design.layers, len(design.used()))
    step("3MF")
    parts, settings = parts_of(design, review.meshes), prusa.profile(design.machine, design.layers, loads(design))
    for family in threemf.FAMILIES:
        content = threemf.content(family, name, parts, _centre_mm(design, family), primed, settings)
        yield f"{name}.{family}.3mf", content
    step("profiles")
    for path, text in profiles(design).items():
        yield path, text.encode()
    step("drawing")
    printed = review.printed(design)
    yield f"{name}.svg", draw(design, review, printed.scene, printed.provenance).encode()
    yield f"{name}.html", decided.page(printed, review, predicted).encode()
    yield "check.json", document.to_json(report(design, review)).encode()
    yield "prediction.json", json_bytes(json.loads(to_json(predicted)))
    yield "design.json", json_bytes(design.model_dump(mode="json"))
    if design.layout:
        from sensorgen.prediction.array.model import wire_table

        yield "wires.csv", document.comma_separated(wire_table(design)).encode()


def _await(job: "Future[None]", step: Step) -> None:
    """Wait for the STEP file, and let the progress display see that time passes."""
    while True:
        step("STEP")
        try:
            return job.result(timeout=0.2)
        except TimeoutError:
            continue


def profiles(design: Design) -> dict[str, str]:
    """Slicer profiles, by file name: PrusaSlicer, Cura and Orca, for every quality that ships and the design's own."""
    by_tool, machine = loads(design), design.machine
    texts: dict[str, str] = {}
    # The design's own quality comes last: Cura's machine definition, one for all, then starts with it.
    others = (printer.load_quality(name) for name in QUALITIES if name != design.layers.name)
    for quality in (*others, design.layers):
        for at, since in folders("prusa").items():
            texts[f"profiles/{at}/{machine.name}-{quality.name}.ini"] = prusa.profile(machine, quality, by_tool, since)
        for at, since in folders("cura").items():
            own = cura.profiles(machine, quality, by_tool, since)
            texts |= {f"profiles/{at}/{path}": text for path, text in own.items()}
        own = orca.profiles(machine, quality, by_tool)
        texts |= {f"profiles/orca/{path}": text for path, text in own.items()}
    return texts


def _centre_mm(design: Design, family: str) -> tuple[float, float]:
    """Middle of the bed as a slicer family counts it: Cura from the front left corner, whatever the printer does."""
    bed_x, bed_y = design.machine.bed_mm
    return (bed_x / 2, bed_y / 2) if family == "cura" else design.machine.bed_centre_mm()


def _colours(design: Design) -> dict[str, str]:
    return {body.name: design.material(body.material).colour for body in design.printed.bodies}


def _manifest(design: Design, stage: Path) -> dict[str, Any]:
    content = {
        "name": design.name,
        "design": design.id(),
        "resolved": json.loads(json.dumps(design.resolved())),
        "files": store.hashes(stage),
        "versions": versions(),
    }
    return content | {store.SEAL: store.seal(_plain(content))}


def versions() -> dict[str, str]:
    """Versions of this software, of Python and of the libraries that the results depend on."""
    by_name = {"sensorgen": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            by_name[name] = version(name)
        except PackageNotFoundError:
            by_name[name] = "not installed"
    return by_name


def json_bytes(data: Mapping[str, Any]) -> bytes:
    """Indented JSON that ends in a newline; infinity, which JSON lacks, becomes a word."""
    return (json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _plain(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    return "infinity" if data == float("inf") else data
