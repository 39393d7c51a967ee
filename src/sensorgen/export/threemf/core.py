"""Parts that all families of 3MF share: a body and what can be wrong with it, the zip, the model file.

The zip's bytes depend on its files only: no clock, no user, no operating system.

Bodies keep their own vertices even where they touch: welded, they would be one surface that is no
longer the boundary of anything.
"""

import html
import io
import math
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


def _texts(title: str, parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """All texts of a file, each with what it is."""
    yield "title", title
    for part in parts:
        yield "name", part.name
        yield "material", part.material
        yield from ((f"setting of body {part.name!r}", s) for s in (*part.settings.keys(), *part.settings.values()))


def _check_part(part: Part) -> None:
    if not re.fullmatch("#[0-9a-fA-F]{6}", part.colour):
        raise BadInput(f"colour {part.colour!r} of body {part.name!r} is not of the form #rrggbb")
    if part.extruder < 0:
        raise OutOfRange(f"extruder {part.extruder} of body {part.name!r} is below 0: slicers count from 0")
    _check_mesh(part)


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
    if not all(map(math.isfinite, centre_mm)):
        raise OutOfRange(f"centre {centre_mm} mm on the bed is not finite")
    names = [part.name for part in parts]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(f"two bodies are called {twice[0]!r}: name each body once")
    for part in parts:
        _check_part(part)
    for what, text in _texts(title, parts):
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


_UNIX = 3
_MODE = 0o100644 << 16  # a plain file, readable by all

# What any 3MF starts with: kinds of file, and which of them is the model.
_KINDS = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
<Default Extension="config" ContentType="application/xml"/>
</Types>
"""
_START = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" \
Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""

MODEL = "3D/3dmodel.model"
OBJECT_ID = 1  # the one object of the build; the bodies of a family with one object each come after it
MATERIALS_ID = 1000000  # far above any body's, so that a body's id stays its place in the list

_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_ROWS = 1 << 15  # rows of text made at once: some megabytes


def model(
    title: str, metadata: Mapping[str, str], namespaces: Mapping[str, str], parts: Sequence[Part],
    objects: Iterator[str], shift_mm: NDArray[np.float64],
) -> Iterator[str]:  # fmt: skip
    """Text of the model file: head, materials, the family's objects, and where the one object stands.

    Parameters
    ----------
    title : str
        Name of the print.
    metadata : mapping of str to str
        The family's own marks, by name.
    namespaces : mapping of str to str
        Address of each prefix that those names use.
    parts : sequence of Part
        The bodies, for their materials.
    objects : iterator of str
        Text of the objects; that of ``OBJECT_ID`` is built.
    shift_mm : (3,) float64 array
        From the sensor's coordinates to those of the bed [mm].
    """
    prefixes = "".join(f' xmlns:{prefix}="{escaped(address)}"' for prefix, address in namespaces.items())
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xmlns="{_CORE}"{prefixes}>\n'
    for name, value in {"Title": title, "Application": "sensorgen", **metadata}.items():
        yield f'<metadata name="{escaped(name)}">{escaped(value)}</metadata>\n'
    yield "<resources>\n"
    yield f'<basematerials id="{MATERIALS_ID}">\n'
    for name, colour in _palette(parts):
        yield f'<base name="{escaped(name)}" displaycolor="{colour.upper()}"/>\n'
    yield "</basematerials>\n"
    yield from objects
    where = " ".join(f"{x:.9g}" for x in (1, 0, 0, 0, 1, 0, 0, 0, 1, *shift_mm))
    yield f'</resources>\n<build>\n<item objectid="{OBJECT_ID}" transform="{where}"/>\n</build>\n</model>\n'


def mesh(parts: Sequence[Part], marks: Sequence[str]) -> Iterator[str]:
    """Text of one mesh of all ``parts``, side by side; ``marks`` are further attributes of their triangles."""
    yield "<mesh>\n<vertices>\n"
    for part in parts:
        # Grids have few distinct coordinates: each is put in words once. Readers keep float32, and nine digits
        # tell any two of those apart; below 1e-9 mm there is only noise, and no -0.
        values, places = np.unique(np.round(part.mesh.vertices_mm, 9) + 0.0, return_inverse=True)
        words = np.array([f"{value:.9g}" for value in values.tolist()], dtype=object)
        yield from _lines('<vertex x="%s" y="%s" z="%s"/>\n', words[places.reshape(-1, 3)])
    yield "</vertices>\n<triangles>\n"
    first = 0
    for part, mark in zip(parts, marks, strict=True):
        yield from _lines(f'<triangle v1="%d" v2="%d" v3="%d"{mark}/>\n', part.mesh.triangles + first)
        first += len(part.mesh.vertices_mm)
    yield "</triangles>\n</mesh>\n"


def _lines(line: str, cells: NDArray[Any]) -> Iterator[str]:
    """A line for each row; one format call for many rows was measured 1.7 times as fast as one per row."""
    for start in range(0, len(cells), _ROWS):
        rows = cells[start : start + _ROWS]
        yield line * len(rows) % tuple(rows.ravel().tolist())


def bodies(title: str, parts: Sequence[Part], group: Callable[[Part], str] = lambda _: "") -> Iterator[str]:
    """Text of an object for each body and of the one that holds them all.

    Parameters
    ----------
    title : str
        Name of the print.
    parts : sequence of Part
        The bodies.
    group : callable
        Metadata of a body.
    """
    for place, part in enumerate(parts):
        yield from body(body_id(place), part, parts, group(part))
    yield f'<object id="{OBJECT_ID}" type="model" name="{escaped(title)}">\n<components>\n'
    yield from (f'<component objectid="{body_id(place)}"/>\n' for place in range(len(parts)))
    yield "</components>\n</object>\n"


def body(number: int, part: Part, parts: Sequence[Part], group: str = "") -> Iterator[str]:
    """Text of the object of one body; ``group`` is that of its metadata, ``parts`` are for its material."""
    yield f'<object id="{number}" type="model" name="{escaped(part.name)}"{material(part, parts)}>\n{group}'
    yield from mesh([part], [""])
    yield "</object>\n"


def body_id(place: int) -> int:
    """Number of the object of the body at ``place`` in the list [-]."""
    return OBJECT_ID + 1 + place


def material(part: Part, parts: Sequence[Part], index: str = "pindex") -> str:
    """Attributes that give an object (``pindex``) or a triangle (``p1``) the material of ``part``."""
    return f' pid="{MATERIALS_ID}" {index}="{_palette(parts).index((part.material, part.colour))}"'


def _palette(parts: Sequence[Part]) -> list[tuple[str, str]]:
    return sorted({(part.material, part.colour) for part in parts})


def pack(files: Iterable[tuple[str, Iterable[str]]]) -> bytes:
    """Zip a model and its side files as a 3MF, piece by piece, so that no whole text is held.

    Parameters
    ----------
    files : iterable of (str, iterable of str)
        Path inside the 3MF, and its text in pieces.

    Returns
    -------
    bytes
        The whole file. Equal input gives equal bytes under one version of zlib; another zlib may
        pack the same text into other bytes.
    """
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for path, pieces in (("[Content_Types].xml", [_KINDS]), ("_rels/.rels", [_START]), *files):
            entry = zipfile.ZipInfo(path)  # dated 1980-01-01, as far back as a zip goes
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, _UNIX, _MODE
            with archive.open(entry, "w") as stream:
                stream.writelines(piece.encode() for piece in pieces)
    return target.getvalue()
