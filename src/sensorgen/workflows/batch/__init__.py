"""Print batches: a plan of designs and copies becomes one plate, with a record of what lies where."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from sensorgen.checks.review import Review, Step
from sensorgen.core import files as store
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput, OutOfRange, Unprintable
from sensorgen.core.findings import Finding, headline, verdict
from sensorgen.core.parallel import remembered
from sensorgen.design.design import Design
from sensorgen.export import threemf
from sensorgen.export.slicers import TIME_LIMIT_S
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Prediction, timeless
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows.batch import labelling, layout, printing, record
from sensorgen.workflows.batch.layout import Plate, Room, Size, column, packed, room
from sensorgen.workflows.batch.plan import BatchPlan, PrintPiece, load, pieces, shuffled, texts, tools
from sensorgen.workflows.batch.record import BatchRecord, ResolvedDesign, SlicedPlate
from sensorgen.workflows.build import json_bytes, versions

STEPS = ("plan", "checks", "predictions", "3MF", "slicing", "as printed", "record", "done")


@dataclass(frozen=True, eq=False)
class Arranged:
    """A plan's specimens on their plate.

    Attributes
    ----------
    plan : BatchPlan
        As read.
    pieces : tuple of PrintPiece
        In the random order in which the plate is filled.
    room : Room
        What the plate has to offer.
    plate : mapping of int to Rect
        Place of each piece.
    """

    plan: BatchPlan
    pieces: tuple[PrintPiece, ...]
    room: Room
    plate: Plate

    @cached_property
    def designs(self) -> dict[str, Design]:
        """The designs, once each, by their hash."""
        return {piece.design_id: piece.design for piece in self.pieces}

    @cached_property
    def tools(self) -> dict[int, str]:
        """Materials by tool."""
        return tools(self.designs.values())


@dataclass(frozen=True)
class Batch:
    """Results of a batch.

    Attributes
    ----------
    folder : Path
        Where the files are.
    record : BatchRecord
        As in ``batch.json``.
    findings : dict of str to list of Finding
        Findings about each design printed alone, by its name.
    sources : dict of str to str
        Their sources: slicer and version, or that a print is estimated, and why.
    """

    folder: Path
    record: BatchRecord
    findings: dict[str, list[Finding]]
    sources: dict[str, str]

    def errors(self, *, force: bool = False) -> bool:
        """True where a file for the printer has errors, or, unless ``force``, a design is to be changed."""
        plates = self.record.slicers.values()
        change = any(verdict(found) == "CHANGE" for found in self.findings.values())
        missing = any(made.lost for plate in plates for made in plate.printed.values())
        return any(plate.errors() for plate in plates) or ((change or missing) and not force)

    def to_json(self) -> str:
        """The folder, then the record."""
        return f'{{\n  "folder": {json.dumps(str(self.folder))},{self.record.to_json()[1:]}'

    def document(self) -> Iterator[Part]:
        """The record, the numbers of findings, and the folder."""
        yield from self.record.document()
        yield ""
        yield from (headline(name, found, self.sources[name]) for name, found in self.findings.items())
        yield f"{self.folder}: {len(self.record.files) + 1} files"


def arranged(path: Path) -> Arranged:
    """A plan's file laid out on its plate.

    Parameters
    ----------
    path : Path
        The plan.

    Raises
    ------
    BadInput
        The plan is wrong, or needs more than one plate.
    OutOfRange
        One of its specimens fits on no plate.
    """
    plan = load(path)
    found = shuffled(pieces(plan, path.parent), plan.seed)
    first = found[0].design
    count = len(tools(piece.design for piece in found))
    here = room(first.machine, first.layers, count, plan.layout.spacing_mm, plan.layout.brim_mm)
    layout = packed if plan.layout.kind == "packed" else column(plan.layout.per_column)
    try:
        plates = layout([_size(plan, piece) for piece in found], here)
    except OutOfRange as error:
        raise error.within(str(path)) from None
    if len(plates) > 1:
        raise BadInput(
            f"{path}: {len(found)} specimens need {len(plates)} plates, {len(plates[0])} of them on the first "
            f"(layout {plan.layout.kind}, {here.gap_mm:g} mm apart): make {len(plates)} plans, or ask for fewer"
        )
    return Arranged(plan, found, here, plates[0])


def _size(plan: BatchPlan, piece: PrintPiece) -> Size:
    """Length and width that a specimen takes on the plate, its tab included [mm]."""
    length, width, _ = piece.design.printed.size_mm
    return (length + labelling.size_mm(piece.design, piece.name)[0], width) if plan.labels.tab else (length, width)


def make(
    path: Path,
    out: Path,
    *,
    gcode: bool = True,
    time_limit_s: float = TIME_LIMIT_S,
    force: bool = False,
    strict: bool = False,
    log_head: str = "",
    jobs: int = 1,
    cluster: str = "",
    step: Step = lambda _: None,
) -> Batch:
    """Write all files of a batch into ``out/<name>``.

    Parameters
    ----------
    path : Path
        The plan.
    out : Path
        Folder that holds the batches' folders.
    gcode : bool
        Also slice; the slicers take most of the time.
    time_limit_s : float
        How long each slicer may take [s].
    force : bool
        Write the files even if checks report errors.
    strict : bool
        Take warnings for errors.
    log_head : str
        Identity of the last record of the log, for the labels.
    jobs, cluster : int, str
        Where predictions are worked out, as of :func:`sensorgen.core.parallel.in_parallel`.
    step : callable
        Called with the next step, for a progress display.

    Raises
    ------
    Unprintable
        The checks found errors; nothing was written.
    SensorgenError
        The plan or one of its designs is wrong, a slicer is missing or fails, or the place cannot be written to;
        nothing was written.
    """
    step("plan")
    found = arranged(path)
    step("checks")
    held = {key: reviewed(design) for key, design in found.designs.items()}
    _refuse_unprintable(found, held, force=force, strict=strict)
    step("predictions")
    prints = [(bodies.of_file(design, held[key].file),) for key, design in found.designs.items()]
    known = dict(remembered(evaluate, prints, jobs, cluster=cluster))
    predicted = {key: timeless(known[k]) for k, key in enumerate(found.designs)}
    folder = out / found.plan.name
    with store.staging(folder) as stage:
        step("3MF")
        store.write(stage, {"plan.yaml": path.read_bytes()})
        on_plate = printing.placed(found.plan, found.pieces, found.plate)
        slicers = found.plan.slicers if gcode else ()
        sliced_from = {"prusa"} & set(slicers)  # slicing leaves the 3MF that it took; CuraEngine takes none
        families = [family for family in threemf.FAMILIES if family not in sliced_from]
        for name, content in (*printing.threemfs(found.plan.name, on_plate, families), *_files(found, log_head)):
            store.write(stage, {name: content})
        sliced: dict[str, SlicedPlate] = {
            s: printing.gcode(found.plan.name, on_plate, s, stage, time_limit_s, step) for s in slicers
        }
        step("record")
        made = _record(found, predicted, sliced, stage).sealed()
        store.write(stage, {record.RECORD: made.to_json().encode()})
        store.publish(stage, folder, record.RECORD)
    step("done")
    named = {found.designs[key].name: of for key, of in held.items()}
    return Batch(folder, made, {k: of.findings for k, of in named.items()}, {k: of.source for k, of in named.items()})


def _refuse_unprintable(found: Arranged, held: Mapping[str, Review], *, force: bool, strict: bool) -> None:
    wrong = [key for key in held if held[key].errors(strict)]
    if wrong and not force:
        every = [f for key in wrong for f in held[key].findings]
        stopping = [f for key in wrong for f in held[key].errors(strict)]
        raise Unprintable(every, stopping).within(found.designs[wrong[0]].name)


def _files(found: Arranged, log_head: str) -> Iterator[tuple[str, bytes]]:
    """Files for people: designs, plate and labels."""
    plan, machine = found.plan, found.pieces[0].design.machine
    for key, design in found.designs.items():
        yield f"designs/{key}.json", json_bytes(design.model_dump(mode="json"))
    yield "plate.svg", layout.svg(plan.name, machine, found.room, found.plate, found.pieces).encode()
    if plan.labels.sheet:
        places = enumerate(found.plate, 1)
        labels = [labelling.Label.of(found.pieces[n], plan.name, order, log_head) for order, n in places]
        yield "labels.html", labelling.page(labels, plan.name).encode()


def _record(
    found: Arranged, predicted: dict[str, Prediction], sliced: dict[str, SlicedPlate], stage: Path
) -> BatchRecord:  # fmt: skip
    plan, first = found.plan, found.pieces[0].design
    loaded = record.tools(plan, found.tools, texts(found.designs.values()))
    for plate in reversed(sliced.values()):
        predicted |= {key: made.prediction for key, made in plate.printed.items() if made.prediction}
    return BatchRecord(
        batch=plan.name, iteration=plan.iteration, seed=plan.seed, printer=first.machine.name,
        quality=first.layers.name, layout=plan.layout, tower=found.room.kept, tools=loaded,
        checklist=record.checklist(plan, loaded), bake=plan.bake,
        specimens=record.specimens(found.pieces, found.plate), predictions=predicted,
        designs={key: ResolvedDesign(design.name, design.resolved()) for key, design in found.designs.items()},
        slicers=sliced, versions=versions(), files=store.hashes(stage),
    )  # fmt: skip
