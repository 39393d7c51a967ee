"""Print batches: a plan of designs and copies becomes one plate, with a record of what lies where."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from shutil import rmtree

from sensorgen.asprinted import agreement
from sensorgen.asprinted import printed as asprinted
from sensorgen.checks.review import Review, Step
from sensorgen.core import files as store
from sensorgen.core.display import Displayed
from sensorgen.core.document import Part, to_json
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, Unprintable
from sensorgen.core.findings import headline
from sensorgen.core.parallel import remembered
from sensorgen.design.design import Design
from sensorgen.export import slicing, threemf
from sensorgen.export.gcode.check import check_motion
from sensorgen.export.slicers import TIME_LIMIT_S, cura
from sensorgen.export.slicers.versions import parse
from sensorgen.export.slicing import Placed, Sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Prediction, timeless
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows.batch import labelling, layout, record
from sensorgen.workflows.batch.layout import Plate, Room, Size, column, packed, room
from sensorgen.workflows.batch.plan import BatchPlan, PrintPiece, load, pieces, shuffled, texts, tools
from sensorgen.workflows.batch.record import BatchRecord, PrintedDesign, ResolvedDesign, SlicedPlate
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
class Batch(Displayed):
    """Results of a batch.

    Attributes
    ----------
    folder : Path
        Where the files are.
    record : BatchRecord
        As in ``batch.json``.
    reviews : dict of str to Review
        Findings about each design printed alone, and their source, by its name.
    """

    folder: Path
    record: BatchRecord
    reviews: dict[str, Review]

    def errors(self, *, force: bool = False) -> bool:
        """True where a file for the printer has errors, or, unless ``force``, a design is to be changed."""
        plates = self.record.slicers.values()
        change = any(review.verdict == "CHANGE" for review in self.reviews.values())
        missing = any(one.lost for plate in plates for one in plate.printed.values())
        return any(plate.errors() for plate in plates) or ((change or missing) and not force)

    def to_json(self) -> str:
        """The folder, then the record."""
        return f'{{\n  "folder": {json.dumps(str(self.folder))},{to_json(self.record)[1:]}'

    def document(self) -> Iterator[Part]:
        """The record, the numbers of findings, and the folder."""
        yield from self.record.document()
        yield ""
        yield from (headline(name, review.findings, review.source) for name, review in self.reviews.items())
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
        The plan is wrong, needs more than one plate, or has its specimens less than two lines apart.
    OutOfRange
        One of its specimens fits on no plate.
    """
    plan = load(path)
    specimens = shuffled(pieces(plan, path.parent), plan.seed)
    first = specimens[0].design
    count = len(tools(piece.design for piece in specimens))
    here = room(first.machine, first.layers, count, plan.layout.spacing_mm, plan.layout.brim_mm)
    if len(specimens) > 1 and here.gap_mm < (least := 2 * first.machine.line_mm()):
        raise BadInput(
            f"{path}: specimens {here.gap_mm:g} mm apart print as one; expected layout.spacing_mm of {least:g} or more"
        )
    layout = packed if plan.layout.kind == "packed" else column(plan.layout.per_column)
    try:
        plates = layout([_size(plan, piece) for piece in specimens], here)
    except OutOfRange as error:
        raise error.within(str(path)) from None
    if len(plates) > 1:
        raise BadInput(
            f"{path}: {len(specimens)} specimens need {len(plates)} plates, {len(plates[0])} of them on the first "
            f"(layout {plan.layout.kind}, {here.gap_mm:g} mm apart): make {len(plates)} plans, or ask for fewer"
        )
    return Arranged(plan, specimens, here, plates[0])


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
    placed = arranged(path)
    step("checks")
    reviews = {key: reviewed(design) for key, design in placed.designs.items()}
    _refuse_unprintable(placed, reviews, force=force, strict=strict)
    step("predictions")
    prints = [(bodies.of_file(design, reviews[key].file),) for key, design in placed.designs.items()]
    known = dict(remembered(evaluate, prints, jobs, cluster=cluster))
    predicted = {key: timeless(known[k]) for k, key in enumerate(placed.designs)}
    folder = out / placed.plan.name
    with store.staging(folder) as stage:
        step("3MF")
        store.write(stage, {"plan.yaml": path.read_bytes()})
        on_plate = _on_plate(placed.plan, placed.pieces, placed.plate)
        slicers = placed.plan.slicers if gcode else ()
        sliced_from = {"prusa"} & set(slicers)  # slicing leaves the 3MF that it took; CuraEngine takes none
        name = placed.plan.name
        for family in threemf.FAMILIES:
            if family not in sliced_from:
                store.write(stage, {f"{name}.{family}.3mf": slicing.plate_3mf(on_plate, family, name)})
        for file, content in _files(placed, log_head):
            store.write(stage, {file: content})
        sliced: dict[str, SlicedPlate] = {s: _gcode(name, on_plate, s, stage, time_limit_s, step) for s in slicers}
        step("record")
        batch = _record(placed, predicted, sliced, stage).sealed()
        store.write(stage, {record.RECORD: to_json(batch).encode()})
        store.publish(stage, folder, record.RECORD)
    step("done")
    return Batch(folder, batch, {placed.designs[key].name: review for key, review in reviews.items()})


def _refuse_unprintable(placed: Arranged, reviews: Mapping[str, Review], *, force: bool, strict: bool) -> None:
    wrong = [key for key in reviews if reviews[key].errors(strict)]
    if wrong and not force:
        every = [f for key in wrong for f in reviews[key].findings]
        stopping = [f for key in wrong for f in reviews[key].errors(strict)]
        raise Unprintable(every, stopping).within(placed.designs[wrong[0]].name)


def _on_plate(plan: BatchPlan, pieces: Sequence[PrintPiece], plate: Plate) -> list[Placed]:
    """The specimens of a plate as slicing knows them, each with its tab where the plan wants them."""
    return [
        Placed(
            pieces[number].design, place.centre_mm, pieces[number].name,
            labelling.bodies(pieces[number].design, pieces[number].name) if plan.labels.tab else (),
        )
        for number, place in plate.items()
    ]  # fmt: skip


def _gcode(
    name: str, plate: Sequence[Placed], slicer: str, folder: Path, time_limit_s: float, step: Step
) -> SlicedPlate:
    """Slice a plate into ``folder``, and say by what; the 3MF on record is the one that PrusaSlicer took.

    Parameters
    ----------
    name : str
        Of the batch; ``<name>.<slicer>.gcode`` is for the printer, ``<name>.<slicer>.refused.gcode`` has errors.
    plate : sequence of Placed
        The specimens.
    slicer : str
        ``prusa`` or ``cura``.
    folder : Path
        Of the batch; the slicer's own G-code and its settings go to a folder of its name in there.
    time_limit_s : float
        How long the slicer may take [s].
    step : callable
        Called repeatedly while the slicer works.
    """
    machine = plate[0].design.machine
    inside, own, ready = folder / f".{slicer}", folder / slicer, folder / f"{name}.{slicer}.gcode"
    sliced = slicing.sliced(
        plate, slicer, inside, title=name, time_limit_s=time_limit_s, step=lambda _: step("slicing")
    )
    own.mkdir()
    sliced.raw.replace(own / "raw.gcode")
    sliced.ready.replace(ready)
    if slicer == "prusa":
        (inside / "plate.3mf").replace(folder / f"{name}.prusa.3mf")
        settings = "profile.ini"
        (inside / settings).replace(own / settings)
    else:
        settings = "settings.json"
        engine = cura.engine_settings(
            machine, plate[0].design.layers, slicing.plate_loads(plate), parse(sliced.version)
        )
        store.write(own, {settings: json_bytes(asdict(engine))})
    rmtree(inside)  # what is left are the bodies again, as the slicer took them
    loaded = tools(piece.design for piece in plate)
    checked = check_motion(
        sliced.lifted.motion, machine, loaded, others_empty=True, texts=texts(p.design for p in plate)
    )
    for piece in plate:
        checked = checked.with_more(
            agreement.check(piece.design, sliced.lines, sliced.lifted.motion, piece.sensor_mm(), piece=piece.name)
        )
    if checked.errors():
        ready = ready.replace(ready.with_suffix(".refused.gcode"))
    step("as printed")
    firsts: dict[str, Placed] = {}
    for piece in plate:
        firsts.setdefault(piece.design.id(), piece)  # it stands for its copies, which the same slicer cuts alike
    content = ready.read_bytes()
    return SlicedPlate(
        **vars(checked), version=sliced.version, gcode=ready.name, raw=f"{slicer}/raw.gcode",
        profile=f"{slicer}/{settings}",
        printed={key: _printed(piece, sliced, content) for key, piece in firsts.items()},
    )  # fmt: skip


def _printed(piece: Placed, sliced: Sliced, content: bytes) -> PrintedDesign:
    """The print of a specimen, from the G-code of its plate."""
    design, source = piece.design, f"{sliced.slicer} {sliced.version}"
    try:
        printed = asprinted.body(design, sliced.lines, slicer=source, centre_mm=piece.sensor_mm())
        body = bodies.sliced(design, lambda: printed, source, content + piece.name.encode())
        layers, findings = tuple(printed.rows), (*sliced.findings, *printed.findings())
        return PrintedDesign(piece.name, design.name, timeless(evaluate(body)), layers, findings)
    except SensorgenError as error:
        return PrintedDesign(piece.name, design.name, reason=str(error))


def _files(placed: Arranged, log_head: str) -> Iterator[tuple[str, bytes]]:
    """Files for people: designs, plate and labels."""
    plan, machine = placed.plan, placed.pieces[0].design.machine
    for key, design in placed.designs.items():
        yield f"designs/{key}.json", json_bytes(design.model_dump(mode="json"))
    yield "plate.svg", layout.svg(plan.name, machine, placed.room, placed.plate, placed.pieces).encode()
    if plan.labels.sheet:
        places = enumerate(placed.plate, 1)
        labels = [labelling.Label(placed.pieces[n], plan.name, order, log_head) for order, n in places]
        yield "labels.html", labelling.page(labels, plan.name).encode()


def _record(
    placed: Arranged, predicted: dict[str, Prediction], sliced: dict[str, SlicedPlate], stage: Path
) -> BatchRecord:  # fmt: skip
    plan, first = placed.plan, placed.pieces[0].design
    loaded = record.tools(plan, placed.tools, texts(placed.designs.values()))
    for plate in reversed(sliced.values()):
        predicted |= {key: one.prediction for key, one in plate.printed.items() if one.prediction}
    return BatchRecord(
        batch=plan.name, iteration=plan.iteration, seed=plan.seed, printer=first.machine.name,
        quality=first.layers.name, layout=plan.layout, tower=placed.room.tower, tools=loaded,
        checklist=record.checklist(plan, loaded), bake=plan.bake,
        specimens=record.specimens(placed.pieces, placed.plate), predictions=predicted,
        designs={key: ResolvedDesign(design.name, design.resolved()) for key, design in placed.designs.items()},
        slicers=sliced, versions=versions(), files=store.hashes(stage),
    )  # fmt: skip
