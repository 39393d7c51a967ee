"""Bodies from a STEP file: names, colours, and faces as triangles. Runs in the CAD process only.

Flat faces are exact; curved ones are met by triangles within a stated distance.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.scene.geometry.mesh_files import FileBody

MOST_ANGLE = 0.3  # between neighbouring triangles of a curved face [rad]


def read_step(path: Path, chord_mm: float) -> "list[FileBody]":
    """Bodies of a STEP file: one for each named leaf of its assembly; lengths in mm, whatever the file's unit.

    Parameters
    ----------
    path : Path
        The file.
    chord_mm : float
        How far triangles may lie from curved faces [mm].

    Raises
    ------
    BadInput
        No STEP, or one without solids.
    """
    from build123d import import_step

    with path.open("rb") as file:
        head = file.read(200)
    if b"ISO-10303-21" not in head:
        raise BadInput(f"{path}: no STEP: it does not begin with ISO-10303-21; export it again, as AP214 or AP242")
    try:
        root = import_step(path)
    except Exception as error:  # whatever the kernel throws
        raise BadInput(f"{path}: the CAD kernel cannot read it: {error or type(error).__name__}") from error
    bodies = [body for leaf, name, colour in _leaves(root, "", None) for body in [_body(leaf, name, colour, chord_mm)]]
    solid = [body for body in bodies if len(body.triangles)]
    if not solid:
        raise BadInput(f"{path}: no solids in it; export solids, not sketches or wires")
    return solid


def _leaves(shape: Any, name: str, colour: Any) -> Iterator[tuple[Any, str, Any]]:
    """Parts of an assembly that hold no others, with the name and colour that they have or inherit."""
    own, paint = shape.label or name, getattr(shape, "color", None) or colour
    if shape.children:
        for child in shape.children:
            yield from _leaves(child, own, paint)
    elif len(shape.solids()) > 1 and not shape.label:
        for solid in shape.solids():
            yield solid, own, paint
    else:
        yield shape, own, paint


def _body(shape: Any, name: str, colour: Any, chord_mm: float) -> "FileBody":
    """Triangles of a part: those of its solids, or of its faces where it has none, side by side."""
    import numpy as np
    from build123d import GeomType

    from sensorgen.scene.geometry.mesh_files import FileBody

    curved = any(face.geom_type != GeomType.PLANE for face in shape.faces())
    points: list[Any] = []
    triangles: list[Any] = []
    for piece in shape.solids() or [shape]:
        corners, faces = piece.tessellate(chord_mm, MOST_ANGLE)
        triangles += [tuple(number + len(points) for number in face) for face in faces]
        points += [(corner.X, corner.Y, corner.Z) for corner in corners]
    paint = "#" + "".join(f"{round(255 * value):02x}" for value in tuple(colour)[:3]) if colour is not None else ""
    return FileBody(
        name, np.array(points, float).reshape(-1, 3), np.array(triangles, np.int64).reshape(-1, 3), paint, 1e-7,
        chord_mm if curved else 0.0,
    )  # fmt: skip
