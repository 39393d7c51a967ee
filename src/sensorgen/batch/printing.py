"""What slicers get, and what they give: the plate as one 3MF per family, and as G-code."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from typing import Any

from sensorgen import slicing, store, threemf
from sensorgen.batch import tab
from sensorgen.batch.layout import Plate
from sensorgen.batch.pieces import Piece, tools
from sensorgen.batch.plan import Plan
from sensorgen.build import json_bytes
from sensorgen.gcode.check import check
from sensorgen.review import Step
from sensorgen.slicer import curaengine
from sensorgen.slicing import Placed


def placed(plan: Plan, pieces: Sequence[Piece], plate: Plate) -> list[Placed]:
    """The specimens of a plate as slicing knows them, each with its tab where the plan wants them."""
    return [
        Placed(
            pieces[number].design, place.centre_mm, pieces[number].name,
            tab.bodies(pieces[number].design, pieces[number].name) if plan.labels.tab else (),
        )
        for number, place in plate.items()
    ]  # fmt: skip


def threemfs(name: str, found: Sequence[Placed]) -> Iterator[tuple[str, bytes]]:
    """Name and content of the 3MF of a plate called ``name``, for each family of slicers."""
    for family in threemf.FAMILIES:
        yield f"{name}.{family}.3mf", slicing.plate_3mf(found, family, name)


def gcode(name: str, found: Sequence[Placed], slicer: str, folder: Path, step: Step) -> dict[str, Any]:
    """Slice a plate into ``folder``, and say by what.

    Parameters
    ----------
    name : str
        Of the batch; ``<name>.<slicer>.gcode`` is for the printer.
    found : sequence of Placed
        The specimens.
    slicer : str
        ``prusa`` or ``cura``.
    folder : Path
        Of the batch; the slicer's own G-code and its settings go to a folder of its name in there.
    step : callable
        Told again and again while the slicer works.

    Returns
    -------
    dict
        Version of the slicer, the names of its files, what the check of the printer's file found, and what it takes.
    """
    inside, own, ready = folder / f".{slicer}", folder / slicer, folder / f"{name}.{slicer}.gcode"
    made = slicing.sliced(found, slicer, inside, step=lambda _: step("slicing"))
    own.mkdir()
    made.raw.replace(own / "raw.gcode")
    made.ready.replace(ready)
    if slicer == "prusa":
        settings = "profile.ini"
        (inside / settings).replace(own / settings)
    else:
        settings = "settings.json"
        store.write(own, {settings: json_bytes(_engine_settings(found))})
    rmtree(inside)  # what is left are the bodies again, as the slicer took them
    checked = check(ready, found[0].design.machine, tools(piece.design for piece in found))
    return {
        "version": made.version,
        "gcode": ready.name,
        "raw": f"{slicer}/raw.gcode",
        "profile": f"{slicer}/{settings}",
        **checked.as_dict(),
    }


def _engine_settings(found: Sequence[Placed]) -> dict[str, Any]:
    design = found[0].design
    return asdict(curaengine.engine_settings(design.machine, design.layers, slicing.plate_loads(found)))
