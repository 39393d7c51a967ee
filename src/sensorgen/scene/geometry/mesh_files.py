"""Bodies from files of triangles: STL, and 3MF as slicers and CAD programs write it.

The files may be of strangers: sizes are limited before and while they are unpacked, and XML may neither define
entities nor name other files.
"""

import math
import re
import struct
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.files import reading

if TYPE_CHECKING:
    from sensorgen.scene.revolved import Revolved

UNITS_MM = {"micron": 1e-3, "mm": 1.0, "cm": 10.0, "inch": 25.4, "foot": 304.8, "m": 1000.0}
MOST_BYTES = 100_000_000  # of a file
MOST_UNPACKED = 400_000_000  # of the model files in a 3MF
MOST_TRIANGLES = 500_000
_3MF_UNITS = {"": "mm", "millimeter": "mm", "centimeter": "cm", "meter": "m"}  # others as in UNITS_MM
_DEPTH = 20  # of components within components
_Range = tuple[int, int, str]  # first and last triangle of a part, and its name
_NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VERTEX = re.compile(rb"vertex\s+(%b)\s+(%b)\s+(%b)" % (_NUMBER, _NUMBER, _NUMBER))


@dataclass(frozen=True, eq=False)
class FileBody:
    """A body as a file has it, in any state.

    Attributes
    ----------
    name : str
        As in the file; "" where it has none.
    vertices_mm : (n, 3) array
        Corners [mm].
    triangles : (m, 3) array
        Numbers of corners, counter-clockwise from outside, where the file is in order.
    colour : str
        As "#202428", or "".
    rounding_mm : float
        Of the file's numbers [mm].
    chord_mm : float
        How far flat faces may lie from the file's curved ones; 0 where it has none [mm].
    revolved : Revolved or None
        The body exactly, where it is one of revolution about an upright axis.
    """

    name: str
    vertices_mm: Real
    triangles: Whole
    colour: str = ""
    rounding_mm: float = 0.0
    chord_mm: float = 0.0
    revolved: "Revolved | None" = None


def check_size(path: Path) -> None:
    """Refuse files that are empty, missing, or too large to be one sensor."""
    with reading(path):
        size = path.stat().st_size if path.is_file() else -1
    if size < 0:
        raise BadInput(f"{path}: not a file; expected a STEP, 3MF or STL file")
    if size == 0:
        raise BadInput(f"{path}: the file is empty; export it again")
    if size > MOST_BYTES:
        raise BadInput(
            f"{path}: {size / 1e6:.0f} MB; expected at most {MOST_BYTES / 1e6:.0f} MB: export the sensor alone, or "
            "with a coarser mesh"
        )


def read_stl(path: Path, unit: str) -> list[FileBody]:
    """Bodies of an STL file: one for each ``solid`` of a text, one of a binary file.

    Parameters
    ----------
    path : Path
        The file.
    unit : str
        Of its numbers, one of :data:`UNITS_MM`: the format has none.

    Raises
    ------
    BadInput
        No STL.
    UnknownName
        No such unit.
    """
    check_size(path)
    scale = _scale(unit)
    with reading(path):
        data = path.read_bytes()
    solids = [(name or path.stem, points) for name, points in _stl_solids(data, path) if len(points)]
    if not solids or any(len(points) % 3 for _, points in solids):
        raise BadInput(f"{path}: an STL without whole triangles; expected a closed surface")
    _refuse_many(path, sum(len(points) // 3 for _, points in solids))
    rounding = 2.0**-21 * scale * max(float(np.abs(points).max()) for _, points in solids)
    return [
        FileBody(name, points * scale, np.arange(len(points)).reshape(-1, 3), rounding_mm=rounding)
        for name, points in solids
    ]


def _stl_solids(data: bytes, path: Path) -> Iterator[tuple[str, Real]]:
    """Name of each solid, and the corners of its triangles (3n, 3)."""
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        rows = np.frombuffer(data, np.dtype([("face", "<f4", (4, 3)), ("more", "<u2")]), count, 84)
        yield "", _shortest(rows["face"][:, 1:].reshape(-1, 3))
    elif data.lstrip()[:5].lower() == b"solid":
        texts = re.split(rb"(?m)^\s*solid\b[ \t]*([^\r\n]*)", data)[1:]
        for name, text in zip(texts[::2], texts[1::2], strict=True):
            yield name.decode("utf-8", "replace").strip(), np.array(_VERTEX.findall(text), float).reshape(-1, 3)
    else:
        raise BadInput(
            f"{path}: no STL: {len(data)} bytes do not fit the {count} triangles of its head; export it again"
        )


def _shortest(singles: np.ndarray) -> Real:
    """Numbers of single precision as the shortest decimals that they may have been: 0.3, not 0.30000001192."""
    values, back = np.unique(singles, return_inverse=True)
    return np.array([float(str(value)) for value in values])[back].reshape(singles.shape)


def _scale(unit: str) -> float:
    if unit not in UNITS_MM:
        raise UnknownName("unit", unit, UNITS_MM)
    return UNITS_MM[unit]


def _refuse_many(path: Path, count: int) -> None:
    if count > MOST_TRIANGLES:
        raise BadInput(
            f"{path}: {count} triangles; expected at most {MOST_TRIANGLES}: export with a coarser mesh, as of 0.01 mm"
        )


@dataclass
class _Object:
    """An object of a 3MF: triangles, or other objects in their places."""

    name: str = ""
    kind: str = "model"
    colour: tuple[str, int] = ("", 0)
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    triangles: list[tuple[int, int, int]] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)  # of each triangle, from the object's own group
    components: list[tuple[tuple[str, str], Real]] = field(default_factory=list)


@dataclass
class _Model:
    """Contents of the model files of a 3MF; keys are file and number."""

    unit: str = ""
    objects: dict[tuple[str, str], _Object] = field(default_factory=dict)
    colours: dict[tuple[str, str], list[tuple[str, str]]] = field(default_factory=dict)
    built: list[tuple[tuple[str, str], Real]] = field(default_factory=list)

    def colour(self, group: tuple[str, str], number: int) -> str:
        """Colour of a group by its number there; "" where it is not known."""
        colours = self.colours.get(group, [])
        return colours[number][1] if 0 <= number < len(colours) else ""


def read_3mf(path: Path, unit: str = "") -> list[FileBody]:
    """Bodies of a 3MF: one for each object that has triangles, or each volume that a slicer has named.

    Parameters
    ----------
    path : Path
        The file.
    unit : str
        In place of the one that the file states, one of :data:`UNITS_MM`.

    Raises
    ------
    BadInput
        No 3MF, one that unpacks to more than :data:`MOST_UNPACKED` bytes, or one that is not in order.
    """
    check_size(path)
    try:
        with zipfile.ZipFile(path) as archive:
            model, parts = _model(archive, path), _parts(archive)
        scale = _scale(unit or _3MF_UNITS.get(model.unit, model.unit))
        bodies = [body for key, where in model.built for body in _bodies(model, key, where, parts)]
        _refuse_many(path, sum(len(body.triangles) for body in bodies))
        return [
            FileBody(b.name, b.vertices_mm * scale, b.triangles, b.colour, 1e-6 * scale)
            for b in bodies
            if len(b.triangles)
        ]
    except BadInput as error:
        raise error.within(str(path)) from None
    except (zipfile.BadZipFile, expat.ExpatError, KeyError, ValueError, IndexError, OverflowError, EOFError,
            NotImplementedError, RuntimeError, OSError) as error:  # fmt: skip
        raise BadInput(f"{path}: not a 3MF: {error or type(error).__name__}; export it again") from None


def _model(archive: zipfile.ZipFile, path: Path) -> _Model:
    """Contents of all model files of a 3MF; raises BadInput where they are too large, or build nothing."""
    names = [name for name in archive.namelist() if name.endswith(".model")]
    size = sum(archive.getinfo(name).file_size for name in names)
    if size > MOST_UNPACKED:
        raise BadInput(f"{path}: unpacks to {size / 1e6:.0f} MB; expected at most {MOST_UNPACKED / 1e6:.0f} MB")
    model = _Model()
    for name in names:
        _parse(archive, name, _model_handler(model, "/" + name))
    if not model.built:
        raise BadInput("it builds nothing; expected objects in its <build>")
    return model


def _parse(archive: zipfile.ZipFile, name: str, start: Callable[[str, Mapping[str, str]], None]) -> None:
    """Parse one file of a zip, without entities or anything from outside, and no more than is allowed."""
    parser = expat.ParserCreate(namespace_separator=" ")

    def refuse(*_: object) -> None:
        raise BadInput(f"{name} has a document type, which a 3MF has not: it is refused")

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = lambda tag, values: start(
        tag.rpartition(" ")[2], {key.rpartition(" ")[2]: value for key, value in values.items()}
    )
    read = 0
    with archive.open(name) as stream:
        while block := stream.read(1 << 20):
            read += len(block)
            if read > MOST_UNPACKED:
                raise BadInput(f"{name} unpacks to over {MOST_UNPACKED / 1e6:.0f} MB")
            parser.Parse(block, False)
    parser.Parse(b"", True)


def _model_handler(model: _Model, file: str) -> Callable[[str, Mapping[str, str]], None]:
    """Takes the elements of a model file into ``model``."""
    now, group = _Object(), [("", "")]
    triangles = 0

    def start(tag: str, has: Mapping[str, str]) -> None:
        nonlocal now, group, triangles
        if tag == "vertex":
            now.vertices.append((float(has["x"]), float(has["y"]), float(has["z"])))
        elif tag == "triangle":
            triangles += 1
            _refuse_many(Path(file), triangles)
            now.triangles.append((int(has["v1"]), int(has["v2"]), int(has["v3"])))
            now.materials.append(int(has.get("p1", now.colour[1])))
        elif tag == "object":
            now = _Object(
                has.get("name", ""), has.get("type", "model"), (has.get("pid", ""), int(has.get("pindex", 0)))
            )
            model.objects[file, has["id"]] = now
        elif tag == "component":
            now.components.append(((has.get("path", file), has["objectid"]), _matrix(has.get("transform", ""))))
        elif tag == "item":
            model.built.append(((has.get("path", file), has["objectid"]), _matrix(has.get("transform", ""))))
        elif tag in ("basematerials", "colorgroup"):
            group = model.colours[file, has["id"]] = []
        elif tag in ("base", "color"):
            group.append((has.get("name", ""), has.get("displaycolor", has.get("color", ""))[:7].lower()))
        elif tag == "model" and (not model.unit or file == "/3D/3dmodel.model"):
            model.unit = has.get("unit", "millimeter")

    return start


def _matrix(text: str) -> Real:
    """A 3MF's transform: rows for x, y and z, and a shift (4, 3)."""
    values = [float(word) for word in text.split()] or [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]
    if len(values) != 12 or not all(map(math.isfinite, values)):
        raise BadInput(f"transform {text[:60]!r}: expected 12 numbers")
    return np.array(values, float).reshape(4, 3)


def _bodies(
    model: _Model, key: tuple[str, str], where: Real, parts: Mapping[str, Sequence[_Range]], depth: int = 0
) -> Iterator[FileBody]:
    """The bodies of an object and of its components, in their places."""
    if depth > _DEPTH:
        raise BadInput(f"components {_DEPTH} deep, or one that holds itself")
    if key not in model.objects:
        raise BadInput(f"object {key[1]} is built, but not there")
    one = model.objects[key]
    if one.kind not in ("model", "other"):
        return
    for part, place in one.components:
        moved = np.vstack([place[:3] @ where[:3], place[3] @ where[:3] + where[3]])
        yield from _bodies(model, part, moved, parts, depth + 1)
    if not one.triangles:
        return
    points, faces = _placed(one, key[1], where)
    for first, last, name in parts.get(key[1]) or [(0, len(faces), one.name)]:
        colour = model.colour((key[0], one.colour[0]), one.materials[first])
        yield FileBody(name, points, faces[first : last + 1], colour)


def _placed(one: _Object, number: str, where: Real) -> tuple[Real, Whole]:
    """Corners and triangles of an object in its place, which may mirror it."""
    points = np.array(one.vertices, float).reshape(-1, 3) @ where[:3] + where[3]
    faces = np.array(one.triangles, np.int64)
    if faces.min() < 0 or faces.max() >= len(points):
        raise BadInput(f"object {number} has a triangle of a vertex that it does not have")
    return points, faces[:, ::-1] if np.linalg.det(where[:3]) < 0 else faces


def _parts(archive: zipfile.ZipFile) -> dict[str, list[_Range]]:
    """Named parts by number of the object: volumes of PrusaSlicer; parts of OrcaSlicer and Bambu Studio, each whole."""
    parts: dict[str, list[_Range]] = {}
    last = ""

    def start(tag: str, has: Mapping[str, str]) -> None:
        nonlocal last
        name = has.get("value", "") if has.get("key") == "name" else ""
        if tag in ("object", "part"):
            last = has.get("id", "")
        elif tag == "volume":
            parts.setdefault(last, []).append((int(has["firstid"]), int(has["lastid"]), ""))
        elif name and has.get("type") == "volume":
            parts[last][-1] = (*parts[last][-1][:2], name)
        elif has.get("key") == "volume_type" and has.get("value") != "ModelPart":
            raise BadInput("it has modifiers or negative volumes of a slicer; expected solid parts only")
        elif name and last and "type" not in has:
            parts.setdefault(last, [(0, MOST_TRIANGLES, name)])

    for file in ("Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"):
        if file in archive.namelist():
            _parse(archive, file, start)
    return parts
