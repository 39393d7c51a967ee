"""Sensors drawn in other CAD programs: their bodies come from a file, and a map says what prints them.

``sensorgen import`` writes the file: pieces of every body as JSON, the sensor's corner at 0, 0, 0. In a design it
becomes part of the text (``geometry``), so that a design, its identity and its records hold all that decides them.
"""

import base64
import binascii
import json
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.files import reading
from sensorgen.core.records import Strict
from sensorgen.scene.scene import Body, Envelope, Move, Piece, Prism, Scene, extent
from sensorgen.scene.sections import sections

SHAPE = "imported"
MOST_BYTES = 200_000_000  # of a file of bodies
_START = "data:application/zlib;base64,"
_DAMAGED = (  # errors of reading what is no geometry
    binascii.Error, zlib.error, ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError, BadInput,
)  # fmt: skip
HASHED = r"-([0-9a-f]{8})\.bodies\.json"  # end of a file's name


def _kinds() -> "dict[str, type[Piece]]":
    from sensorgen.scene.polyhedra import Loft, Polyhedron
    from sensorgen.scene.revolved import Revolved

    return {"prism": Prism, "revolved": Revolved, "loft": Loft, "polyhedron": Polyhedron}


class Filled(Strict):
    """Material of an imported body, and its connections."""

    material: Annotated[str, Field(pattern=r"^[a-z0-9-]+(@[a-z0-9.-]+)?$", examples=["x60", "x60@thesis-4.1"])]
    terminal: Literal["", "top", "middle", "bottom"] = ""


@dataclass(frozen=True)
class Params(Envelope):
    """Size of an imported sensor: that of its bodies, never given."""


@dataclass(frozen=True)
class Patterned(Params):
    """Size of an imported sensor whose cross-section repeats, and its period."""

    period_mm: float = field(default=0.0, metadata={"help": "Period of the pattern.", "range": (0.0, 1000.0)})


@dataclass(frozen=True)
class Bodies:
    """Bodies of a file.

    Attributes
    ----------
    pieces : mapping of str to tuple of Piece
        By the bodies' names, from bottom to top.
    size_mm : (float, float, float)
        Edges of the box around them, whose corner is the origin.
    chord_mm : float
        How far flat faces may lie from the curved ones of the CAD file; 0 where it had none [mm].
    source : str
        Name of the CAD file.
    """

    pieces: Mapping[str, tuple[Piece, ...]]
    size_mm: tuple[float, float, float]
    chord_mm: float
    source: str


def text(bodies: Bodies) -> str:
    """Bodies as the text of a file."""
    kinds = {kind: name for name, kind in _kinds().items()}
    data = {
        "source": bodies.source,
        "chord_mm": bodies.chord_mm,
        "size_mm": bodies.size_mm,
        "bodies": {
            name: [{"kind": kinds[type(piece)], **asdict(piece)} for piece in own]
            for name, own in bodies.pieces.items()
        },
    }
    return json.dumps(data, separators=(",", ":"), allow_nan=False) + "\n"


def file_name(name: str, content: str) -> str:
    """Name of a file of bodies: that of the design, and a part of its hash."""
    return f"{name}-{sha256(content.encode()).hexdigest()[:8]}.bodies.json"


def packed(content: str) -> str:
    """The text of a file of bodies as a design holds it."""
    return _START + base64.b64encode(zlib.compress(content.encode(), 9)).decode()


def with_geometry(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's data with the content of its file of bodies in place of the file's name.

    Raises
    ------
    BadInput
        The file cannot be read, or is not the one that was imported.
    """
    name = data.get("geometry")
    if not isinstance(name, str) or name.startswith(_START):
        return data
    path = folder / name
    with reading(path):
        if not path.is_file():
            raise BadInput(f"{path}: not a file; expected the bodies that sensorgen import wrote beside the design")
        if path.stat().st_size > MOST_BYTES:
            raise BadInput(f"{path}: {path.stat().st_size / 1e6:.0f} MB; expected at most {MOST_BYTES / 1e6:.0f} MB")
        content = path.read_text("utf-8")
    own = re.search(HASHED, path.name)
    if own and own[1] != sha256(content.encode()).hexdigest()[:8]:
        raise BadInput(f"{path}: its content is not that of its name: it was changed or damaged; import it again")
    return {**data, "geometry": packed(content)}


@lru_cache(maxsize=8)
def bodies(geometry: str) -> Bodies:
    """Bodies of a design's geometry.

    Raises
    ------
    BadInput
        No file of bodies.
    """
    try:
        unpack = zlib.decompressobj()
        content = unpack.decompress(base64.b64decode(geometry.removeprefix(_START), validate=True), MOST_BYTES)
        data = json.loads(content)
        size = tuple(float(value) for value in data["size_mm"])
        pieces = {str(name): tuple(map(_piece, own)) for name, own in data["bodies"].items()}
        return Bodies(pieces, (size[0], size[1], size[2]), float(data["chord_mm"]), str(data["source"]))
    except _DAMAGED as error:
        raise BadInput(
            f"geometry: no bodies in it ({error or type(error).__name__}); expected a file that sensorgen import wrote"
        ) from None


def _piece(data: Mapping[str, Any]) -> Piece:
    return _kinds()[data["kind"]](**{key: _frozen(value) for key, value in data.items() if key != "kind"})


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


@lru_cache(maxsize=8)
def params(geometry: str) -> Params:
    """Size of an imported sensor, and the period of its pattern where one cross-section repeats."""
    from sensorgen.scene.repetition import cell

    content = bodies(geometry)
    length, width, height = content.size_mm
    drawn = Scene(tuple(Body(name, name, own) for name, own in content.pieces.items()), content.size_mm)
    try:
        (section,) = sections(drawn)
        piece = cell(section, height)
    except ValueError:  # several cross-sections, none that is constant, or bodies that overlap
        return Params(length, width)
    period = 2 * (piece.slices[-1].right_mm - piece.slices[0].left_mm)
    along = length if section.across == "x" else width
    return Patterned(length, width, period_mm=round(period, 9)) if period <= along / 2 else Params(length, width)


def scene(geometry: str, filled: Mapping[str, Filled]) -> Scene:
    """Bodies of an imported sensor, with the materials and terminals of a map."""
    content = bodies(geometry)
    drawn = (
        Body(name, filled[name].material.partition("@")[0], own, filled[name].terminal)
        for name, own in content.pieces.items()
    )
    return Scene(tuple(drawn), content.size_mm)


def middle(filled: Mapping[str, Filled]) -> set[str]:
    """Names of the bodies of a middle electrode."""
    return {name for name, one in filled.items() if one.terminal == "middle"}


def halves(geometry: str, filled: Mapping[str, Filled]) -> list[dict[str, Any]]:
    """Geometry and bodies of the sensors below and above a middle electrode, which both have it.

    Raises
    ------
    BadInput
        A body is neither below nor above the middle electrode.
    """
    pieces = bodies(geometry).pieces
    shared = middle(filled)
    low, high = extent((piece for name in shared for piece in pieces[name]), "z")
    lower = {name: own for name, own in pieces.items() if extent(own, "z")[1] <= high}
    upper = {name: own for name, own in pieces.items() if extent(own, "z")[0] >= low}
    if beside := sorted(n for n in pieces.keys() - shared if (n in lower) == (n in upper)):
        raise BadInput(
            f"{', '.join(beside)}: beside the middle electrode, which is from {low:g} to {high:g} mm; expected each "
            "body below or above it: divide it in CAD"
        )
    return [_half(geometry, lower, filled, "top"), _half(geometry, upper, filled, "bottom")]


def _half(
    geometry: str, pieces: Mapping[str, Sequence[Piece]], filled: Mapping[str, Filled], end: str
) -> dict[str, Any]:
    """Geometry and bodies of a sensor of some of the bodies, on the bed, of which the middle electrode is an end."""
    low, high = extent((piece for own in pieces.values() for piece in own), "z")
    down, whole = Move(shift_mm=(0, 0, -low)), bodies(geometry)
    moved = {name: tuple(piece.moved(down) for piece in own) for name, own in pieces.items()}
    part = replace(whole, pieces=moved, size_mm=(*whole.size_mm[:2], high - low))
    ends = {n: filled[n].model_dump() | {"terminal": filled[n].terminal.replace("middle", end)} for n in pieces}
    return {"geometry": packed(text(part)), "bodies": ends}


def check(geometry: str | None, filled: Mapping[str, Filled], given: Mapping[str, float | str]) -> None:
    """Refuse a design whose map does not fit its bodies.

    Parameters
    ----------
    geometry : str or None
        Of the design.
    filled : mapping of str to Filled
        Its map.
    given : mapping of str to float
        Its parameters: none but the size that the bodies have, as records hold it.

    Raises
    ------
    BadInput
        No geometry, a body without an entry, or a size that is given.
    UnknownName
        An entry without a body.
    """
    if not geometry:
        raise BadInput(
            "geometry is missing; a design of this shape is written by: sensorgen import FILE --map BODY=MATERIAL"
        )
    known = bodies(geometry).pieces
    for name in filled:
        if name not in known:
            raise UnknownName("body", name, known)
    for name in known:
        if name not in filled:
            raise BadInput(
                f"bodies.{name} is missing; expected a material for every body, as {name}: {{material: x60}}"
            )
    size = asdict(params(geometry))
    for name, value in given.items():
        if size.get(name) != value:
            raise BadInput(f"parameters.{name}: an imported sensor is as large as its bodies; change it in CAD")


def slots(geometry: str, filled: Mapping[str, Filled], conducts: Iterable[str]) -> dict[str, str]:
    """Materials of the electrodes and of the dielectric, as shapes name them: the largest body of each decides."""
    conductors = set(conducts)
    volume = {name: sum(piece.volume_mm3() for piece in own) for name, own in bodies(geometry).pieces.items()}
    largest = sorted(filled, key=lambda name: volume[name])
    parts: dict[str, str] = {}
    for name in largest:
        one = filled[name]
        if one.material.partition("@")[0] not in conductors:
            parts |= {"film": one.material, "dielectric": one.material} if name != "support" else {}
        elif one.terminal in ("top", "bottom"):
            parts[f"{one.terminal}_electrode"] = one.material
    return parts
