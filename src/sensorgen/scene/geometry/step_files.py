"""Bodies from a STEP file: names, colours, and faces as triangles. Runs in the CAD process only.

Flat faces are exact; curved ones are met by triangles within a stated distance.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.scene.geometry.mesh_files import FileBody
    from sensorgen.scene.revolved import Revolved

_NO_AREA_MM2 = 1e-9
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
        bodies = [_body(leaf, name, colour, chord_mm) for leaf, name, colour in _leaves(root, "", None)]
    except BadInput as error:
        raise error.within(str(path)) from None
    except Exception as error:  # whatever the kernel throws, also where there is nothing
        reason = f" ({error})" if str(error) else ""
        raise BadInput(
            f"{path}: no solids that the CAD kernel can read{reason}; export solids, as AP214 or AP242"
        ) from error
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
    """Triangles of a part, face by face; corners that faces share are there once for each."""
    import numpy as np
    from build123d import GeomType
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    from sensorgen.scene.geometry.mesh_files import FileBody

    BRepMesh_IncrementalMesh(shape.wrapped, chord_mm, False, MOST_ANGLE, False)  # False: millimetres, not a share
    points: list[Any] = []
    triangles: list[Any] = []
    faces = shape.faces()
    for face in faces:
        place = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face.wrapped, place)
        if mesh is None:
            if face.area < _NO_AREA_MM2:  # as revolved axes leave
                continue
            x, y, z = tuple(face.center())
            raise BadInput(
                f"{name or 'a body'}: its curved face near x {x:.6g}, y {y:.6g}, z {z:.6g} mm cannot be met by "
                "triangles: it crosses itself; draw it anew in CAD"
            )
        backwards = face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        to, first = place.Transformation(), len(points)
        corners = (mesh.Node(k).Transformed(to) for k in range(1, mesh.NbNodes() + 1))
        points += [(corner.X(), corner.Y(), corner.Z()) for corner in corners]
        numbers = [[t.Value(k) - 1 + first for k in (1, 2, 3)] for t in mesh.Triangles()]
        triangles += [number[::-1] for number in numbers] if backwards else numbers
    _refuse_missing(shape, name, points, triangles, chord_mm)
    curved = any(face.geom_type != GeomType.PLANE for face in faces)
    paint = "#" + "".join(f"{round(255 * value):02x}" for value in tuple(colour)[:3]) if colour is not None else ""
    return FileBody(
        name, np.array(points, float).reshape(-1, 3), np.array(triangles, np.int64).reshape(-1, 3), paint, 1e-7,
        chord_mm if curved else 0.0, _revolved(shape) if curved else None,
    )  # fmt: skip


def _corner(edge: Any, axis_mm: float, *, arc: bool) -> tuple[tuple[float, float], float]:
    """Radius and height at which an edge of a profile begins [mm], and its bulge."""
    ends = [(point.X - axis_mm, point.Z) for point in (edge.position_at(k) for k in (0.0, 0.5, 1.0))]
    (ra, za), (rm, zm), (rb, zb) = ends
    chord = (rb - ra) ** 2 + (zb - za) ** 2
    beside = (rb - ra) * (zm - za) - (zb - za) * (rm - ra)
    return (abs(round(ra, 9)), round(za, 9)), -2 * beside / chord if arc and chord > 0 else 0.0


def _revolved(shape: Any) -> "Revolved | None":
    """A part as a body of revolution about an upright axis, where its profile of lines and arcs says that it is one."""
    from build123d import Face, GeomType, Plane, Pos

    from sensorgen.core.errors import SensorgenError
    from sensorgen.scene.revolved import Revolved

    box = shape.bounding_box()
    middle, size = box.center(), box.size
    if len(shape.solids()) != 1 or abs(size.X - size.Y) > 1e-6:
        return None
    half = Pos(middle.X + size.X, middle.Y, middle.Z) * Face.make_rect(2 * size.X, 2 * size.Z, Plane.XZ)
    cut = shape.solids()[0].intersect(half)
    faces = cut.faces() if cut is not None else []
    if len(faces) != 1 or faces[0].inner_wires():
        return None
    edges = faces[0].outer_wire().order_edges()
    if any(edge.geom_type not in (GeomType.LINE, GeomType.CIRCLE) for edge in edges):
        return None
    outline, bulges = zip(
        *(_corner(edge, middle.X, arc=edge.geom_type == GeomType.CIRCLE) for edge in edges), strict=True
    )
    try:
        piece = Revolved(middle.X, middle.Y, outline, bulges)
    except SensorgenError:
        return None
    exact = shape.solids()[0].volume
    return piece if abs(piece.volume_mm3() - exact) < 1e-6 * exact else None


def _refuse_missing(shape: Any, name: str, points: Any, triangles: Any, chord_mm: float) -> None:
    """Refuse triangles that enclose another volume than the solids do: faces that no mesh was made for."""
    exact, corners = sum(solid.volume for solid in shape.solids()), [points[k] for face in triangles for k in face]
    met = sum(
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        for a, b, c in zip(corners[::3], corners[1::3], corners[2::3], strict=True)
    ) / 6  # fmt: skip
    if abs(met - exact) > 2 * chord_mm * shape.area + 1e-6 * abs(exact):
        x, y, z = tuple(shape.center())
        raise BadInput(
            f"{name or 'a body'} near x {x:.6g}, y {y:.6g}, z {z:.6g} mm: its faces enclose {met:.6g} mm3, its solid "
            f"{exact:.6g} mm3: a face is damaged; draw it anew in CAD"
        )
