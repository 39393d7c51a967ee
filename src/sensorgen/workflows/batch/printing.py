"""Input and output of slicers: the plate as one 3MF per family, and as G-code."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree

from sensorgen.asprinted import agreement
from sensorgen.asprinted import printed as asprinted
from sensorgen.checks.review import Step
from sensorgen.core import files as store
from sensorgen.core.errors import SensorgenError
from sensorgen.export import slicing
from sensorgen.export.gcode.check import check_motion
from sensorgen.export.slicers import curaengine, versions
from sensorgen.export.slicing import Placed, Sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import timeless
from sensorgen.workflows.batch import labelling
from sensorgen.workflows.batch.layout import Plate
from sensorgen.workflows.batch.plan import BatchPlan, PrintPiece, texts, tools
from sensorgen.workflows.batch.record import PrintedDesign, SlicedPlate
from sensorgen.workflows.build import json_bytes


def placed(plan: BatchPlan, pieces: Sequence[PrintPiece], plate: Plate) -> list[Placed]:
    """The specimens of a plate as slicing knows them, each with its tab where the plan wants them."""
    return [
        Placed(
            pieces[number].design, place.centre_mm, pieces[number].name,
            labelling.bodies(pieces[number].design, pieces[number].name) if plan.labels.tab else (),
        )
        for number, place in plate.items()
    ]  # fmt: skip


def threemfs(name: str, plate: Sequence[Placed], families: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    """Name and content of the 3MF of a plate called ``name``, for some families of slicers."""
    for family in families:
        yield f"{name}.{family}.3mf", slicing.plate_3mf(plate, family, name)


def gcode(
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
        engine = curaengine.engine_settings(
            machine, plate[0].design.layers, slicing.plate_loads(plate), versions.parse(sliced.version)
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
