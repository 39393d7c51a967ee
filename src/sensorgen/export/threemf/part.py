"""One body of a multi-material 3MF, and what can be wrong with it."""

import html
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import Design
from sensorgen.export.slicers.loads import load
from sensorgen.export.slicers.prusa import volume_settings
from sensorgen.scene.geometry.meshes import Mesh

# What XML 1.0 cannot carry, not even escaped; and line breaks and tabs, whose escapes lib3mf refuses.
_NOT_XML = re.compile("[^\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

# PrusaSlicer's 25 % leaves slits where walls and infill of a film meet: 0.26 % of a layer, 0.10 % with this; more than
# 40 % opens those of thin lines. Electrodes stay at 25 %: more material would close nothing there.
FILM_OVERLAP = "40%"


@dataclass(frozen=True, eq=False)
class Part:
    """A body, what it is made of, and the tool that prints it.

    Attributes
    ----------
    name : str
        Name of the body, unique in its file: ``top_electrode_with_cogs``.
    material : str
        Material as a person reads it: ``PI-eTPU 85-700+``.
    colour : str
        Colour in viewers, ``#rrggbb``.
    extruder : int
        Place of the tool in the slicer's list, from 0 [-].
    mesh : Mesh
        Closed surface, in the coordinates of the sensor [mm].
    settings : mapping of str to str
        Slicer settings for this body alone, in PrusaSlicer's words: ``{"fill_density": "80%"}``.
        The Cura file carries those with the same meaning there, the Orca file none: see each module.
    """

    name: str
    material: str
    colour: str
    extruder: int
    mesh: Mesh
    settings: Mapping[str, str] = field(default_factory=dict)


def check(title: str, parts: Sequence[Part], centre_mm: tuple[float, float]) -> None:
    """Refuse what no slicer could print, or what the file could not say.

    Parameters
    ----------
    title : str
        Name of the print.
    parts : sequence of Part
        The bodies.
    centre_mm : (float, float)
        Where the middle of the sensor goes on the bed [mm].

    Raises
    ------
    BadInput
        No bodies, two of one name, a mesh without triangles or with wrong indices, a colour or a
        character that the file cannot hold.
    OutOfRange
        A coordinate that is not finite, or a negative extruder.
    """
    if not parts:
        raise BadInput("no bodies to write: a 3MF needs at least one")
    if not all(math.isfinite(c) for c in centre_mm):
        raise OutOfRange(f"centre {centre_mm} mm on the bed is not finite")
    names = [part.name for part in parts]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(f"two bodies are called {twice[0]!r}: name each body once")
    texts = [("title", title)]
    for part in parts:
        settings = (*part.settings.keys(), *part.settings.values())
        texts += [
            ("name", part.name),
            ("material", part.material),
            *((f"setting of body {part.name!r}", s) for s in settings),
        ]
        if not re.fullmatch("#[0-9a-fA-F]{6}", part.colour):
            raise BadInput(f"colour {part.colour!r} of body {part.name!r} is not of the form #rrggbb")
        if part.extruder < 0:
            raise OutOfRange(f"extruder {part.extruder} of body {part.name!r} is below 0: slicers count from 0")
        _check_mesh(part)
    for what, text in texts:
        if wrong := _NOT_XML.search(text):
            raise BadInput(f"{what} {text!r} has the character {wrong[0]!r}, which a 3MF cannot hold: remove it")


def _check_mesh(part: Part) -> None:
    vertices, triangles = part.mesh.vertices_mm, part.mesh.triangles
    if len(triangles) == 0:
        raise BadInput(f"body {part.name!r} has no triangles: leave it out, or give it a volume")
    if not np.isfinite(vertices).all():
        raise OutOfRange(f"body {part.name!r} has a coordinate that is not finite")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise BadInput(f"body {part.name!r} has a triangle on a vertex that it lacks (it has {len(vertices)})")
    a, b, c = triangles.T
    if ((a == b) | (b == c) | (c == a)).any():
        raise BadInput(f"body {part.name!r} has a triangle with one corner twice")


def escaped(text: str) -> str:
    """Text for XML, also within double quotes; without references by number, which lib3mf refuses."""
    return html.escape(text, quote=False).replace('"', "&quot;")


def parts_of(design: Design, meshes: Mapping[str, Mesh]) -> list[Part]:
    """Bodies of a design, in the sensor's coordinates.

    Parameters
    ----------
    design : Design
        The design.
    meshes : mapping of str to Mesh
        Mesh of each body, by its name [mm].
    """
    return [part_of(design, body.name, body.material, meshes[body.name]) for body in design.printed.bodies]


def part_of(design: Design, name: str, material: str, mesh: Mesh) -> Part:
    """One body, with the tool that the design gives its material."""
    tool, stuff = design.tool(material), design.material(material)
    settings = volume_settings(design.machine, design.layers, tool, load(design, material))
    if material not in {design.slot(end)[0].name for end in ("top_electrode", "bottom_electrode")}:
        settings["infill_overlap"] = FILM_OVERLAP
    extruder = design.machine.slicer_index(tool)
    return Part(name, stuff.title, stuff.colour, extruder, mesh, settings)


def placed(parts: Sequence[Part], centre_mm: tuple[float, float], name: str = "") -> list[Part]:
    """Bodies of one sensor with the middle of their box over a place of the plate, the lowest point at 0.

    Parameters
    ----------
    parts : sequence of Part
        The bodies, in the coordinates of the sensor [mm].
    centre_mm : (float, float)
        Where the middle goes [mm].
    name : str
        Stands before the names of the bodies, which must differ on the plate.

    Raises
    ------
    BadInput
        No bodies.
    """
    if not parts:
        raise BadInput("no bodies to place: a sensor has at least one")
    low, high = box_mm(parts)
    shift_mm = np.array([*centre_mm, 0.0]) - [*((low + high)[:2] / 2), low[2]]
    lead = f"{name} " if name else ""
    return [
        replace(part, name=f"{lead}{part.name}", mesh=replace(part.mesh, vertices_mm=part.mesh.vertices_mm + shift_mm))
        for part in parts
    ]


def box_mm(parts: Iterable[Part]) -> tuple[Real, Real]:
    """Lowest and highest corner of the box around bodies, two (3,) arrays [mm]."""
    ends = [(p.mesh.vertices_mm.min(axis=0), p.mesh.vertices_mm.max(axis=0)) for p in parts]
    return np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)
