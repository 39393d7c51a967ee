"""What slicers get, and what they give: the plate as one 3MF per family, and as G-code."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sensorgen import materials, threemf
from sensorgen.batch import tab
from sensorgen.batch.layout import Plate, Rect
from sensorgen.batch.pieces import Piece
from sensorgen.batch.plan import Plan
from sensorgen.design import Infill
from sensorgen.geometry import meshes
from sensorgen.printer import Printer
from sensorgen.scene import Body
from sensorgen.slicer import prusa
from sensorgen.slicer.loads import Load


def threemfs(plan: Plan, pieces: Sequence[Piece], plate: Plate) -> Iterator[tuple[str, bytes]]:
    """Name and content of the plate's 3MF for each family of slicers."""
    machine = pieces[0].design.machine
    parts = [part for number, place in plate.items() for part in _parts(plan, pieces[number], place)]
    middle = _middle_mm(parts)
    for family in threemf.FAMILIES:
        yield (
            f"{plan.name}.{family}.3mf",
            threemf.content(family, plan.name, parts, _bed_mm(machine, family, middle)),
        )


def _parts(plan: Plan, piece: Piece, place: Rect) -> Iterator[threemf.Part]:
    design = piece.design
    bodies: tuple[Body, ...] = design.printed.bodies
    if plan.labels.tab:
        bodies += tab.bodies(design, piece.name)
    shift = np.array([place.x0, place.y0, 0.0])
    for body in bodies:
        tool = design.tool(body.material)
        infill = design.infill.get(body.material, Infill())
        load = Load(design.material(body.material), design.used()[body.material], infill.percent, infill.pattern)
        mesh = meshes.mesh(body)
        yield threemf.Part(
            name=f"{piece.name}: {body.name}",
            material=materials.load(body.material).title,
            colour=materials.load(body.material).colour,
            extruder=design.machine.slicer_index(tool),
            mesh=replace(mesh, vertices_mm=mesh.vertices_mm + shift),
            settings=prusa.volume_settings(design.machine, design.layers, tool, load),
        )


def _middle_mm(parts: Sequence[threemf.Part]) -> tuple[float, float]:
    low = np.min([part.mesh.vertices_mm.min(axis=0) for part in parts], axis=0)
    high = np.max([part.mesh.vertices_mm.max(axis=0) for part in parts], axis=0)
    return float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2


def _bed_mm(machine: Printer, family: str, place: tuple[float, float]) -> tuple[float, float]:
    """A place as a slicer family counts it: Cura from the front left corner, whatever the printer does."""
    if family != "cura":
        return place
    (x, y), (bed_x, bed_y) = machine.bed_centre_mm(), machine.bed_mm
    return place[0] - x + bed_x / 2, place[1] - y + bed_y / 2


def gcodes(plan: Plan, pieces: Sequence[Piece], plate: Plate, folder: Path) -> dict[str, Any]:
    """Slice the plate into ``folder``; what each slicer was, by its name."""
    raise NotImplementedError
