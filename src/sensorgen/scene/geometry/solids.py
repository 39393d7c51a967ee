"""From the scene to CAD solids and a STEP file, and bodies from one; the only file that knows build123d.

Run as a program it is the far end of :class:`sensorgen.scene.geometry.cad.CadProcess`; build123d is imported where it
is used, because that takes seconds.

One solid per piece, and no fuse: a body of several pieces is one product, a compound under one name and
colour, even where its boxes touch. One rule for all sizes, exact, and linear in the number of pieces. Fusing a body's
boxes in one go, glued, is exact too and gives one valid solid, but cuts faces up wherever strips cross, for which all
that follows pays. Crossed strips (``rect``, OCCT 8.0; solids and STEP file together):

========  ===============  ================
cells     compound         fused
========  ===============  ================
50 x 5    0.3 s, 0.8 MB    1.0 s, 1.5 MB
50 x 25   0.4 s, 1.1 MB    4.6 s, 5.0 MB
165 x 25  1.2 s, 2.7 MB    15.9 s, 16.4 MB
========  ===============  ================

Of a STEP file that is read, bodies have names, colours, and faces as triangles: flat ones exact, curved ones within a
stated distance.
"""

import gc
import re
import sys
from collections.abc import Callable, Iterator, Mapping, MutableSequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput, CadFailed, SensorgenError, Unwritable
from sensorgen.core.worker import answer_input
from sensorgen.scene.scene import AXES, PLANE, Body, Piece, Point, Prism, Scene

if TYPE_CHECKING:
    from build123d import Compound, Solid

    from sensorgen.scene.geometry.mesh_files import FileBody
    from sensorgen.scene.revolved import Revolved

VOLUME_RATIO = 1e-9  # how far a solid's volume may be from its piece's; the kernel reaches 1e-13
TIME_STAMP = "1980-01-01T00:00:00"  # the same in every file, so that a rebuilt file is the same to the byte

# Two thirds of the time that build123d takes to load
UNREAD = ("scipy", "scipy.optimize", "scipy.spatial", "sklearn", "sklearn.cluster", "svgpathtools")

_LABEL = re.compile(rb"'@(\d+)@'")
_PLACING = re.compile(rb"(NEXT_ASSEMBLY_USAGE_OCCURRENCE)\(\s*'\d+',\s*'@(\d+)@',\s*'',\s*(#\d+),\s*(#\d+),\s*\$\)")
_COLOURS = rb"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION("
_ENTITY = re.compile(rb"#(\d+) = (.*?);\n", re.DOTALL)
_REFERENCE = re.compile(rb"#(\d+)")

_NO_AREA_MM2 = 1e-9
MOST_ANGLE = 0.3  # between neighbouring triangles of a curved face [rad]


def solid(piece: Piece) -> "Solid":
    """The piece as a CAD solid in its place [mm]: extruded, revolved with true arcs, or sewn of flat faces.

    For axis y the plane (x, z) is left-handed, so the face of an outline looks against its extrusion. The kernel turns
    all faces outwards either way; were they inside out, the volume would be negative.

    Raises
    ------
    CadFailed
        The kernel refuses the outline, or makes a solid of another volume of it.
    """
    from sensorgen.scene.revolved import Revolved

    try:
        if isinstance(piece, Prism):
            shape = _extruded(piece)
        elif isinstance(piece, Revolved):
            shape = _revolved(piece)
        else:
            shape = _sewn(piece)
        volume = shape.volume
    except Exception as error:  # whatever the kernel throws: Standard_Failure, StdFail_NotDone, ValueError
        raise CadFailed(f"{_described(piece)}: {error or type(error).__name__}") from error
    exact = piece.volume_mm3()
    if not (exact > 0 and abs(volume - exact) <= VOLUME_RATIO * exact):  # so that NaN is caught as well
        raise CadFailed(
            f"{_described(piece)}: its solid holds {volume:.12g} mm3, its outline {exact:.12g} mm3; an outline runs"
            " counter-clockwise, does not cross itself, and is no thinner than 1e-7 mm"
        )
    return shape


def _extruded(prism: Prism) -> "Solid":
    from build123d import Face, Solid, Wire

    way = [0.0, 0.0, 0.0]
    way[AXES.index(prism.axis)] = prism.end_mm - prism.start_mm
    corners = [_corner(prism, point) for point in (*prism.outline, prism.outline[0])]
    face = Face(Wire.make_polygon(corners, close=False))  # True leaves a last edge under 1e-6 mm open
    return Solid.extrude(face, tuple(way))


def _revolved(piece: "Revolved") -> "Solid":
    from build123d import Axis, Edge, Face, Solid, Wire

    edges = []
    for start, end, middle in piece.sides():
        a, b, between = ((piece.x_mm + r, piece.y_mm, z) for r, z in (start, end, middle or start))
        edges.append(Edge.make_three_point_arc(a, between, b) if middle else Edge.make_line(a, b))
    return Solid.revolve(Face(Wire(edges)), 360.0, Axis((piece.x_mm, piece.y_mm, 0.0), (0.0, 0.0, 1.0)))


def _sewn(piece: Piece) -> "Solid":
    from build123d import Face, Shell, Solid, Wire

    from sensorgen.scene.polyhedra import Loft, surface

    if isinstance(piece, Loft):
        rings = piece.faces()
    else:
        whole = surface(piece)
        rings = [tuple(whole.vertices[number] for number in triangle) for triangle in whole.triangles]
    faces = [Face(Wire.make_polygon((*ring, ring[0]), close=False)) for ring in rings]
    sewn = Solid(Shell(faces))
    return sewn if sewn.volume > 0 else Solid(sewn.wrapped.Reversed())


def part(body: Body) -> "Solid | Compound":
    """The body as one solid, or as a compound of the solids of its pieces; labelled with its name.

    Raises
    ------
    CadFailed
        One of its pieces cannot be made; the message names body and piece.
    """
    from build123d import Compound

    solids = []
    for number, piece in enumerate(body.pieces, 1):
        try:
            solids.append(solid(piece))
        except CadFailed as error:
            place = f"{type(piece).__name__.lower()} {number} of {len(body.pieces)}"
            raise CadFailed(f"the CAD kernel cannot make {body.name} ({body.material}), {place}, {error}") from error
    joined = solids[0] if len(solids) == 1 else Compound(solids)
    joined.label = body.name
    return joined


def write_step(scene: Scene, colours: Mapping[str, str], title: str, path: Path) -> None:
    """Write a scene as a STEP file (AP214, mm): an assembly with one named, coloured product per body.

    Parameters
    ----------
    scene : Scene
        What to write.
    colours : mapping of str to str
        Colour of each body by its name, as in "#202428".
    title : str
        Name of the assembly.
    path : Path
        Where; a file that is there is overwritten. Equal arguments give equal bytes.

    Raises
    ------
    CadFailed
        The kernel cannot make a body, or a body has no colour.
    Unwritable
        The file cannot be written.
    """
    from build123d import Color, Compound, export_step

    if not scene.bodies:
        raise CadFailed(f"{title!r} has no bodies: there is nothing to write as STEP")
    parts = []
    for number, body in enumerate(scene.bodies, 1):
        if body.name not in colours:
            raise CadFailed(f"body {body.name!r} has no colour; colours are given for: {', '.join(sorted(colours))}")
        product = part(body)
        product.label, product.color = _label(number), Color(colours[body.name])
        parts.append(product)
    assembly = Compound(children=parts, label=_label(0))
    try:
        path.write_bytes(b"")  # says why it cannot, which the kernel does not
        # Where all faces are planes, curves in their parameters say nothing new, in twice the time and the bytes.
        is_round = any(piece.is_round() for _, piece in scene.pieces)
        export_step(assembly, path, write_pcurves=is_round, timestamp=TIME_STAMP)
        # What differs from run to run is made equal, and bodies get their real names.
        step = path.read_bytes()
        step = _PLACING.sub(rb"\1('\2','@\2@','',\3,\4,$)", step)
        begin = step.find(_COLOURS)
        begin, end = step.rfind(b"\n", 0, begin) + 1, step.rfind(b"ENDSEC;")
        step = step[:begin] + _in_order(step[begin:end]) + step[end:]
        names = [title, *(body.name for body in scene.bodies)]
        path.write_bytes(_LABEL.sub(lambda match: _step_string(names[int(match[1])]), step))
    except OSError as error:
        raise Unwritable(f"cannot write {str(path)!r}: {error.strerror or error}") from error
    except Exception as error:  # what the kernel throws while it translates
        raise CadFailed(f"the CAD kernel cannot write {title!r} as STEP: {error or type(error).__name__}") from error


def _corner(prism: Prism, point: Point) -> tuple[float, float, float]:
    place = dict(zip(PLANE[prism.axis], point, strict=True))
    place[prism.axis] = prism.start_mm
    return place["x"], place["y"], place["z"]


def _described(piece: Piece) -> str:
    spans = ", ".join(f"{axis} {low:g} to {high:g}" for axis in AXES for low, high in [piece.span(axis)])
    if isinstance(piece, Prism):
        return f"{len(piece.outline)} corners along {piece.axis} at {spans} mm"
    return f"{type(piece).__name__.lower()} at {spans} mm"


def _label(number: int) -> str:
    """A name that the kernel's writer neither wraps nor garbles; the real one is put in afterwards."""
    return f"@{number}@"


def _in_order(colours: bytes) -> bytes:
    """The entities of the colours, numbered as one meets them on the way from each body's list, body by body."""
    entities = {int(match[1]): b"".join(match[2].split(b"\n")) for match in _ENTITY.finditer(colours)}
    places: dict[int, int] = {}
    first = min(entities, default=0)

    def visit(number: int) -> None:
        if number in entities and number not in places:
            places[number] = first + len(places)
            for other in _references(entities[number]):
                visit(other)

    lists = [number for number, text in entities.items() if text.startswith(_COLOURS)]
    lists.sort(key=lambda n: _references(entities[n])[-1])  # the last one is the body's own context
    for number in [*lists, *entities]:
        visit(number)

    def moved(match: re.Match[bytes]) -> bytes:
        return b"#%d" % places.get(int(match[1]), int(match[1]))

    return b"".join(b"#%d = %s;\n" % (places[n], _REFERENCE.sub(moved, entities[n])) for n in places)


def _references(text: bytes) -> list[int]:
    return [int(number) for number in _REFERENCE.findall(text)]


def _step_string(text: str) -> bytes:
    r"""The text as ISO 10303-21 writes it.

    >>> print(_step_string("it's 0.2 µm").decode())
    'it''s 0.2 \X2\00B5\X0\m'
    """

    def characters() -> Iterator[str]:
        for character in text:
            if character in "'\\":
                yield character * 2
            elif " " <= character <= "~":
                yield character
            elif ord(character) <= 0xFFFF:
                yield f"\\X2\\{ord(character):04X}\\X0\\"
            else:
                yield f"\\X4\\{ord(character):08X}\\X0\\"

    return f"'{''.join(characters())}'".encode("ascii")


class _Unread(ModuleType):
    """Module that build123d imports, and that STEP files do without; it is read when something of it is called."""

    __path__: MutableSequence[str] = []  # noqa: RUF012 - as of a package

    def __getattr__(self, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (), {"__new__": lambda _, *given, **named: self._real(name)(*given, **named)})

    def _real(self, name: str) -> Callable[..., object]:
        for other in UNREAD:
            if isinstance(sys.modules.get(other), _Unread):
                del sys.modules[other]
        real: Callable[..., object] = getattr(import_module(self.__name__), name)
        return real


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
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    from sensorgen.scene.geometry.mesh_files import FileBody

    BRepMesh_IncrementalMesh(shape.wrapped, chord_mm, False, MOST_ANGLE, False)  # False: millimetres, not a share
    points: list[Any] = []
    triangles: list[Any] = []
    faces = shape.faces()
    for face in faces:
        corners, numbers = _of_face(face, name)
        triangles += [[k + len(points) for k in number] for number in numbers]
        points += corners
    _refuse_missing(shape, name, points, triangles, chord_mm)
    curved = any(face.geom_type != GeomType.PLANE for face in faces)
    paint = "#" + "".join(f"{round(255 * value):02x}" for value in tuple(colour)[:3]) if colour is not None else ""
    return FileBody(
        name, np.array(points, float).reshape(-1, 3), np.array(triangles, np.int64).reshape(-1, 3), paint, 1e-7,
        chord_mm if curved else 0.0, _recognised(shape) if curved else None,
    )  # fmt: skip


def _of_face(face: Any, name: str) -> tuple[list[tuple[float, float, float]], list[list[int]]]:
    """Corners of a face's triangles, and their numbers; none of a face without an area, as revolved axes leave."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    place = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face.wrapped, place)
    if mesh is None:
        if face.area < _NO_AREA_MM2:
            return [], []
        x, y, z = tuple(face.center())
        raise BadInput(
            f"{name or 'a body'}: its curved face near x {x:.6g}, y {y:.6g}, z {z:.6g} mm cannot be met by "
            "triangles: it crosses itself; draw it anew in CAD"
        )
    to = place.Transformation()
    corners = (mesh.Node(k).Transformed(to) for k in range(1, mesh.NbNodes() + 1))
    order = (3, 2, 1) if face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else (1, 2, 3)
    triangles = [[triangle.Value(k) - 1 for k in order] for triangle in mesh.Triangles()]
    return [(corner.X(), corner.Y(), corner.Z()) for corner in corners], triangles


def _profile_corner(edge: Any, axis_mm: float, *, arc: bool) -> tuple[tuple[float, float], float]:
    """Radius and height at which an edge of a profile begins [mm], and its bulge."""
    ends = [(point.X - axis_mm, point.Z) for point in (edge.position_at(k) for k in (0.0, 0.5, 1.0))]
    (ra, za), (rm, zm), (rb, zb) = ends
    chord = (rb - ra) ** 2 + (zb - za) ** 2
    beside = (rb - ra) * (zm - za) - (zb - za) * (rm - ra)
    return (abs(round(ra, 9)), round(za, 9)), -2 * beside / chord if arc and chord > 0 else 0.0


def _recognised(shape: Any) -> "Revolved | None":
    """A part as a body of revolution about an upright axis, where its profile of lines and arcs says that it is one."""
    from build123d import GeomType

    from sensorgen.scene.revolved import Revolved

    middle, edges = shape.bounding_box().center(), _profile(shape)
    if not edges or any(edge.geom_type not in (GeomType.LINE, GeomType.CIRCLE) for edge in edges):
        return None
    outline, bulges = zip(
        *(_profile_corner(edge, middle.X, arc=edge.geom_type == GeomType.CIRCLE) for edge in edges), strict=True
    )
    try:
        piece = Revolved(middle.X, middle.Y, outline, bulges)
    except SensorgenError:
        return None
    exact = shape.solids()[0].volume
    return piece if abs(piece.volume_mm3() - exact) < 1e-6 * exact else None


def _profile(shape: Any) -> list[Any]:
    """Edges of a single solid's half section beside its upright axis; none where that is no one ring."""
    from build123d import Face, Plane, Pos

    box = shape.bounding_box()
    middle, size = box.center(), box.size
    if len(shape.solids()) != 1 or abs(size.X - size.Y) > 1e-6:
        return []
    half = Pos(middle.X + size.X, middle.Y, middle.Z) * Face.make_rect(2 * size.X, 2 * size.Z, Plane.XZ)
    cut = shape.solids()[0].intersect(half)
    faces = cut.faces() if cut is not None else []
    return list(faces[0].outer_wire().order_edges()) if len(faces) == 1 and not faces[0].inner_wires() else []


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


def _load() -> None:
    gc.disable()  # what the import makes lives for good: not to look through it for garbage saves a tenth of it
    sys.modules.update({name: _Unread(name) for name in UNREAD})
    import build123d  # noqa: F401

    gc.freeze()
    gc.enable()


def _answer(job: tuple[str, tuple[Any, ...]]) -> object:
    """Result or error of a job: a function's name, and arguments."""
    name, arguments = job
    try:
        work: Callable[..., object] = write_step if name == "write_step" else read_step
        return work(*arguments)
    except SensorgenError as error:
        return error
    except Exception as error:  # the process lives on, and the user learns of it
        what = arguments[2] if name == "write_step" else arguments[0].name
        return CadFailed(f"the CAD process failed on {what!r}: {type(error).__name__}: {error}")


if __name__ == "__main__":
    answer_input(_answer, _load)
