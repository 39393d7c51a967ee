r"""Both bounds of a capacitance between curved and slanted bodies: curved tetrahedra, H1 above and hybrid H(div) below.

Piola's transformation keeps fluxes free of sources on curved elements too, and both functionals are integrated so
finely that quadrature does not count: what is left is the distance of the curved elements from the round faces, by
which the bounds are moved outwards.

Netgen's CAD kernel makes the elements. Conductors are cut out of the cell, and their faces named. Elements shrink
towards edges and tips of conductors, where the field is infinite (hp-refinement), and where bodies are near each other.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import atan2, inf, pi
from typing import Any, NamedTuple

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.errors import NotInstalled
from sensorgen.scene.polyhedra import surface
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Piece, Prism
from sensorgen.solvers.electrostatics.bounds import Energies, Unsolved
from sensorgen.solvers.electrostatics.prisms import TOP, balanced, fluxes
from sensorgen.solvers.electrostatics.round_cell import SAME_MM, DomeTouch, ProfileEdge, RoundCell, profile, touches

ROUND = "round"  # end of the name of faces that elements approach by polynomials
SIDE, BETWEEN = "side", "between"  # names of mirrors, and of faces between dielectrics
MORE = 6  # order of the quadrature beyond that of the polynomials squared

_REENTRANT = 0.52  # share of a small sphere around a place on an edge or corner beyond which the field is infinite
_SPHERE = 256  # places on it
_RADIUS = 2e-3  # of it, over the least side of the cell
_SECTORS = 12  # of a body with a tip: elements there would bend around it
_SHRINK = 0.15  # of a layer towards an edge to the one around it
_COARSE = 0.5  # longest edge over the cell's shorter side
_NEAR = 2.0  # longest edge on a round face over its distance from other bodies
_CUSP = 5.0  # the same in a gap that ends in a cusp
_TRIES = 6  # meshes until all elements are sound
_FINER, _SLOWER = 0.7, 0.8  # longest edge and growth of elements in the next one
_MOST = 300_000  # unknowns: more would need 4 GB


@dataclass
class RoundMesh:
    """A mesh of NGSolve, and the cell that it fills.

    Attributes
    ----------
    cell : RoundCell
        What is meshed.
    ngsolve : Mesh
        Materials are "d0p1" for part 1 of dielectric 0, and "t0" for what fills the cusp of touch 0; boundaries are
        "c0" for a conductor, "t0" around a cusp, ``SIDE`` and ``BETWEEN``.
    touches : list of DomeTouch
        Whose cusps are closed.
    round : (n,) array of bool
        Which regions of the boundary elements approach by polynomials.
    """

    cell: RoundCell
    ngsolve: Any
    touches: list[DomeTouch]
    round: Mask


def mesh_of(cell: RoundCell, order: int, layers: int, closed: float) -> RoundMesh:
    """A mesh whose curved elements are sound.

    Parameters
    ----------
    cell : RoundCell
        What is meshed.
    order : int
        Of the potential; faces are approached by polynomials of one more.
    layers : int
        Towards edges and tips of conductors.
    closed : float
        Height at which a gap that ends in a cusp is closed, over the distance of the conductors there [-].

    Raises
    ------
    Unsolved
        The CAD kernel cannot cut the conductors out of the cell, an electrode does not cover it, or no sound mesh of at
        most 300 000 unknowns fills it.
    """
    try:
        import netgen.occ as occ
        import ngsolve as ng
        from netgen.meshing import MeshingParameters, NgException
    except ImportError:
        raise NotInstalled("curved bodies need NGSolve: pip install 'sensorgen[fem]'") from None
    cusps = [(touch, closed * touch.apart_mm) for touch in touches(cell)]
    try:
        shape, is_graded, along = _shape(cell, cusps)
        geometry = occ.OCCGeometry(shape)
    except occ.OCCException as error:
        raise Unsolved(f"the CAD kernel does not cut this cell: {error}") from None
    longest = _COARSE * min(np.subtract(cell.high_mm, cell.low_mm)[:2])
    sizes = cell.sizes(np.array(along).reshape(-1, 3), _NEAR, longest)
    sizes += [size for touch, gap in cusps for size in touch.sizes(cell, gap, _CUSP)]
    growth = 0.5
    for _ in range(_TRIES):
        # Threads that wait for each other would take ten times the processor time
        wanted = MeshingParameters(maxh=longest, grading=growth, parallel_meshing=False, nthreads=1)
        for size in sizes:
            wanted.RestrictH(*size)
        try:
            coarse = geometry.GenerateMesh(wanted)
        except NgException:
            longest, growth = _FINER * longest, _SLOWER * growth
            continue
        unknowns = len(coarse.Elements3D()) * order * (order + 1)
        if unknowns > _MOST:
            raise Unsolved(f"{unknowns} unknowns; meshes of up to {_MOST} are solved")
        rounds, (middles, spans) = _named(coarse), _elements(coarse)
        mesh = ng.Mesh(coarse)
        if is_graded:
            mesh.RefineHP(layers, _SHRINK)
        mesh.Curve(order + 1)
        bad = unsound(mesh, order)
        if not bad.any():
            return RoundMesh(cell, mesh, [touch for touch, _ in cusps], rounds)
        for place in _middles(mesh)[bad]:
            k = int(((middles - place) ** 2).sum(1).argmin())
            sizes.append((*middles[k].tolist(), float(spans[k]) / 2))
    raise Unsolved("no sound mesh of this cell: faces meet at too small an angle, or are too near each other")


def unsound(mesh: Any, order: int) -> Mask:
    """Mask of the elements that are turned inside out somewhere."""
    import ngsolve as ng

    kinds = [element.type for element in mesh.Elements()]
    rules = {kind: ng.IntegrationRule(kind, 2 * order + MORE) for kind in set(kinds)}
    volumes = ng.Det(ng.specialcf.JacobianMatrix(3))(mesh.MapToAllElements(rules, ng.VOL)).ravel()
    first = np.cumsum([0, *(len(rules[kind].points) for kind in kinds)])[:-1]
    return np.asarray(np.minimum.reduceat(volumes, first) * np.maximum.reduceat(volumes, first) <= 0)


def _named(netgen_mesh: Any) -> Mask:
    """Name the boundaries of a mesh, and tell which are round."""
    rounds = []
    for k in range(netgen_mesh.GetNFaceDescriptors()):
        name, face = netgen_mesh.GetBCName(k), netgen_mesh.FaceDescriptor(k + 1)
        between = bool(face.domin and face.domout)
        rounds.append(name.endswith(ROUND))
        stays = name[0] == "c" or (name[0] == "t" and between)
        netgen_mesh.SetBCName(k, name.removesuffix(ROUND) if stays else (SIDE, BETWEEN)[between])
    return np.array(rounds)


def _elements(netgen_mesh: Any) -> tuple[Real, Real]:
    """Middles of tetrahedra (n, 3) and their longest extents [mm]."""
    corners = netgen_mesh.Coordinates()[netgen_mesh.Elements3D().NumPy()["nodes"][:, :4] - 1]
    return corners.mean(1), np.ptp(corners, axis=1).max(1)


def _middles(mesh: Any) -> Real:
    """Middles of all elements (n, 3) [mm]."""
    points = np.array([vertex.point for vertex in mesh.vertices])
    return np.array([points[[v.nr for v in element.vertices]].mean(0) for element in mesh.Elements()])


def _shape(
    cell: RoundCell, cusps: Sequence[tuple[DomeTouch, float]]
) -> tuple[Any, bool, list[tuple[float, float, float]]]:
    """All dielectrics with their common faces, named by conductor; edges and tips to be graded are marked.

    Also whether there are some, and places on the edges [mm].
    """
    import netgen.occ as occ

    whole = _glued(_solids(cell, cusps))
    metal, dielectrics = ([one for one in whole if (one.name[0] == "c") == is_metal] for is_metal in (True, False))
    faces = _named_faces([one for one in dielectrics if one.name[0] == "t"] + metal)
    _refuse_contact(cell, faces, dielectrics)
    _refuse_open(cell, dielectrics)
    return occ.Compound(dielectrics), *_graded(cell, [f for name, own in faces.items() if name[0] == "c" for f in own])


def _named_faces(solids: Sequence[Any]) -> dict[str, list[Any]]:
    """Faces of solids by their solid's name, which they get; round ones are marked."""
    faces: dict[str, list[Any]] = {}
    for one in solids:
        for face in one.faces:
            face.name = one.name + (ROUND if (face.name or "").endswith(ROUND) else "")
        faces.setdefault(one.name, []).extend(one.faces)
    return faces


def _glued(named: Sequence[tuple[str, Any]]) -> list[Any]:
    """Solids of some shapes, each with its name; faces between them are one."""
    import netgen.occ as occ

    for name, shape in named:
        for one in shape.solids:
            one.name = name
    return list(occ.Glue([one for _, shape in named for one in shape.solids]).solids)


def _refuse_contact(cell: RoundCell, faces: Mapping[str, Sequence[Any]], dielectrics: Sequence[Any]) -> None:
    """Refuse conductors that meet somewhere, or leave no dielectric."""
    conductors = [faces.get(f"c{k}", []) for k in range(cell.conductors)]
    places = [{_key(v.p) for face in own for v in face.vertices} for own in conductors]
    if not dielectrics or any(a & b for a, b in combinations(places, 2)):
        raise Unsolved("the electrodes touch: the capacitance grows without bound")


def _refuse_open(cell: RoundCell, dielectrics: Sequence[Any]) -> None:
    """Refuse a dielectric that reaches the bottom or the top of the cell."""
    for face in (face for one in dielectrics for face in one.faces if (face.name or "x")[0] != "c"):
        low, high = face.bounding_box
        for end in (cell.low_mm[2], cell.high_mm[2]):
            if max(abs(low.z - end), abs(high.z - end)) < SAME_MM * 10:
                raise Unsolved("an electrode does not cover the whole sensor")


def _solids(cell: RoundCell, cusps: Sequence[tuple[DomeTouch, float]]) -> list[tuple[str, Any]]:
    """Conductors, parts of dielectrics and cusps, by name."""
    import netgen.occ as occ

    box = occ.Box(cell.low_mm, cell.high_mm)
    filled = _filled(cell, box)
    rest = box
    for shape in filled.values():
        rest = rest - shape
    named = []
    for k, (touch, gap) in enumerate(cusps):
        at = occ.Pnt(touch.piece.x_mm, touch.piece.y_mm, touch.z_mm)
        cusp = occ.Cylinder(at, occ.Z if touch.upwards else -occ.Z, touch.rim_mm(gap), gap) * box
        filled[touch.kind], rest = filled[touch.kind] - cusp, rest - cusp
        named.append((f"t{k}", cusp))
    last = cell.conductors + len(cell.permittivity) - 1
    filled[last] = occ.Glue([filled[last], rest]) if last in filled else rest
    for kind, shape in filled.items():
        if kind < cell.conductors:
            named.append((f"c{kind}", shape))
            continue
        parts = cell.parts()
        for n, (low, high) in enumerate(parts):
            part = shape * occ.Box(tuple(low), tuple(high)) if len(parts) > 1 else shape
            named.append((f"d{kind - cell.conductors}p{n}", part))
    return named


def _filled(cell: RoundCell, box: Any) -> dict[int, Any]:
    """Pieces of each conductor and dielectric as one solid, cut at the sides of the cell."""
    import netgen.occ as occ

    pieces: dict[int, list[Any]] = {}
    for _, piece, kind in cell.boxes():
        pieces.setdefault(kind, []).append(solid(piece) * box)
    return {kind: occ.Fuse(own) if len(own) > 1 else own[0] for kind, own in pieces.items()}


def solid(piece: Piece) -> Any:
    """A piece for the CAD kernel."""
    import netgen.occ as occ

    if isinstance(piece, Revolved):
        return _revolved(piece)
    if isinstance(piece, Prism):
        at, way = piece.start_mm, [(piece.end_mm - piece.start_mm) * (piece.axis == axis) for axis in "xyz"]
        corners = [{"x": (at, u, v), "y": (u, at, v), "z": (u, v, at)}[piece.axis] for u, v in piece.outline]
        return occ.Prism(_flat(corners), occ.Vec(*way))
    whole = surface(piece)
    faces = [_flat([whole.vertices[k] for k in triangle]) for triangle in whole.triangles]
    return occ.Solid(occ.Sew(faces)).UnifySameDomain()


def _flat(corners: Sequence[tuple[float, float, float]]) -> Any:
    import netgen.occ as occ

    vertices = [occ.Vertex(occ.Pnt(*corner)) for corner in corners]
    return occ.Face(occ.MakePolygon([*vertices, vertices[0]]))


def _revolved(piece: Revolved) -> Any:
    """A body of revolution, its round faces named; one with a tip of sectors."""
    import netgen.occ as occ

    def edge(own: ProfileEdge) -> Any:
        start, middle, end = (occ.Pnt(piece.x_mm + r, piece.y_mm, z) for r, z in own.places(2).tolist())
        return occ.ArcOfCircle(start, middle, end) if own.bulge else occ.Segment(start, end)

    own = profile(piece)
    axis = occ.Axis(occ.Pnt(piece.x_mm, piece.y_mm, 0.0), occ.Z)
    count = _SECTORS if any(e.is_tip() for e in own) else 1
    sector = occ.Face(occ.Wire([edge(e) for e in own])).Revolve(axis, 360 / count)
    for face in sector.faces:
        (low, high), at = face.bounding_box, face.center
        swept = count == 1 or abs(atan2(at.y - piece.y_mm, at.x - piece.x_mm) - pi / count) < SAME_MM
        face.name = ROUND if swept and high.z - low.z > 10 * SAME_MM else None
    return sector if count == 1 else occ.Fuse([sector.Rotate(axis, 360 / count * k) for k in range(count)])


def _key(place: Any) -> tuple[float, ...]:
    return tuple((np.array(tuple(place)).round(6) + 0.0).tolist())


def _graded(cell: RoundCell, faces: Sequence[Any]) -> tuple[bool, list[tuple[float, float, float]]]:
    """Mark edges and corners of conductors around which dielectrics fill more than half of a small sphere.

    Whether there are some, and places on marked edges [mm].
    """
    edges = [edge for face in faces for edge in face.edges if edge.mass > SAME_MM]  # poles have edges of no length
    along, ways = _graded_edges(cell, edges)
    is_graded = bool(along)
    for place, vertex in {_key(vertex.p): vertex for edge in edges for vertex in edge.vertices}.items():
        if _is_corner(cell, place, ways.get(place, [])) and _is_open(cell, np.array(place)):
            vertex.hpref = 1
            is_graded = True
    return is_graded, along


def _graded_edges(
    cell: RoundCell, edges: Sequence[Any]
) -> tuple[list[tuple[float, float, float]], dict[tuple[float, ...], list[Real]]]:
    """Mark those of some edges that are open: places on them, and unit vectors along them from each of their ends."""
    along, ways = list[tuple[float, float, float]](), dict[tuple[float, ...], list[Real]]()
    seen = set()
    for edge in edges:
        low, high = edge.parameter_interval
        middle = np.array(tuple(edge.Value((low + high) / 2)))
        if _key(middle) in seen:
            continue
        seen.add(_key(middle))
        if _is_open(cell, middle):
            edge.hpref = 1
            along += [tuple(edge.Value(t)) for t in np.linspace(low, high, 17)]
            for end in dict.fromkeys(_key(vertex.p) for vertex in edge.vertices):
                ways.setdefault(end, []).append((middle - end) / np.linalg.norm(middle - end))
    return along, ways


def _is_open(cell: RoundCell, place: Real) -> bool:
    """Test whether dielectrics fill more than half of a small sphere around a place, by places on it."""
    height = 1 - (2 * np.arange(_SPHERE) + 1) / _SPHERE
    turn, across = np.arange(_SPHERE) * pi * (1 + 5**0.5), np.sqrt(1 - height**2)
    ball = np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
    radius = _RADIUS * min(np.subtract(cell.high_mm, cell.low_mm))
    return bool(1 - cell.conducts(place + radius * ball).mean() > _REENTRANT)


def _is_corner(cell: RoundCell, place: tuple[float, ...], ways: Sequence[Real]) -> bool:
    """Test whether marked edges, mirrored at the sides of the cell, end or turn at a place."""
    every = list(ways)
    for axis in (0, 1):
        if min(abs(place[axis] - cell.low_mm[axis]), abs(place[axis] - cell.high_mm[axis])) < SAME_MM * 10:
            every += [way * np.where(np.arange(3) == axis, -1, 1) for way in every]
    distinct = np.array(list({tuple((way + 0.0).round(2).tolist()) for way in every})).reshape(-1, 3)
    return len(distinct) != 2 or bool((distinct.sum(0) ** 2).sum() > 0.5)


__all__ = ["LEVELS", "RoundCell", "RoundLevel", "bounds", "solved"]


class RoundLevel(NamedTuple):
    """A mesh, as of :func:`mesh_of`, and the width that it often reaches [-]."""

    order: int
    layers: int
    closed: float
    width: float


LEVELS = (
    RoundLevel(2, 2, 1e-2, 1.5e-2),
    RoundLevel(3, 2, 4e-3, 1.5e-3),
    RoundLevel(4, 2, 2e-3, 4.5e-4),
    RoundLevel(5, 3, 1e-3, 6e-5),
    RoundLevel(6, 4, 5e-4, 1e-5),
)


def bounds(cell: RoundCell, width: float) -> Iterator[tuple[RoundLevel, int, Energies]]:
    """Both bounds over eps0 [mm] on finer and finer meshes, each with its number of elements, until within tolerance.

    Parameters
    ----------
    cell : RoundCell
        Between mirrors.
    width : float
        Relative width of the bounds that is wanted: the first mesh often reaches it [-].

    Raises
    ------
    Unsolved
        As :func:`mesh_of`.
    """
    first = sum(level.width > width for level in LEVELS[:-1])
    for level in LEVELS[first:]:
        mesh = mesh_of(cell, level.order, level.layers, level.closed)
        found = solved(mesh, level.order)
        yield level, mesh.ngsolve.ne, found
        if found.upper * (1 + found.rounding) - found.lower * (1 - found.rounding) <= width * found.lower:
            return


def solved(mesh: RoundMesh, order: int) -> Energies:
    """Both bounds over eps0 [mm] on one mesh, of a potential of an order and of a flux of one less."""
    import ngsolve as ng

    cell, space, fine = mesh.cell, mesh.ngsolve, 2 * order + MORE
    least = {f"d{k}p.*": value for k, value in enumerate(cell.permittivity)}
    most, metal = dict(least), [f"c{k}" for k in range(cell.conductors)]
    grown, filled = list(metal), "d.*"  # for the upper bound: conductors and what they leave
    for k, touch in enumerate(mesh.touches):
        own = cell.permittivity[max(touch.kind - cell.conductors, -1)]  # of a conductor's cusp, that of the rest
        both = sorted((own, cell.permittivity[-1]))
        least[f"t{k}"], most[f"t{k}"] = both
        if touch.kind < cell.conductors:
            grown[touch.kind] += f"|t{k}"
        else:
            filled += f"|t{k}"
    eps, inside = space.MaterialCF(most), space.Materials(filled)
    above = ng.H1(space, order=order, dirichlet="|".join(grown), definedon=inside)
    u, v = above.TnT()
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx(definedon=inside), symmetric=True, condense=True)
    _, potential = balanced(form, lambda f: f, grown)
    density = eps * ng.grad(potential) * ng.grad(potential)
    upper = ng.Integrate(density, space, order=fine, definedon=inside)
    part = sum(
        weight * ng.Integrate(density, space, order=fine, definedon=space.Materials(f"d.*p{n}"))
        for n, weight in enumerate(cell.weights().tolist())
        if weight
    )
    flux, _, charges, unknowns = fluxes(space, space.MaterialCF(least), metal, order - 1)
    lower = 2 * charges[TOP] - ng.Integrate(flux * flux / space.MaterialCF(least), space, order=fine)
    return Energies(lower, upper, part, unknowns, _moved(mesh, density) / upper, bool(mesh.touches))


def _moved(mesh: RoundMesh, density: Any) -> float:
    """Change by the distance of curved elements from round faces, to first order [mm].

    A conductor whose face moves changes the energy by that of the layer that it passes; a dielectric by at most that,
    on the side where it is greater: fields along the face and fluxes across it are continuous.
    """
    import ngsolve as ng

    space = mesh.ngsolve
    far = ng.CF(inf)
    for piece in (piece for _, piece, _ in mesh.cell.boxes() if isinstance(piece, Revolved)):
        radius = ng.sqrt((ng.x - piece.x_mm) ** 2 + (ng.y - piece.y_mm) ** 2)
        for edge in profile(piece):
            off = edge.distance(radius, ng.z, ng.sqrt)
            square = off * off
            far = ng.IfPos(far - square, square, far)
    between = np.array(space.GetBoundaries()) == BETWEEN
    ratio, far = max(mesh.cell.permittivity) / min(mesh.cell.permittivity), ng.sqrt(far).Compile()
    layer = far * ng.BoundaryFromVolumeCF(density)
    found = 0.0
    for faces, factor in ((mesh.round & ~between, 1.0), (mesh.round & between, ratio)):
        if faces.any():
            region = ng.Region(space, ng.BND, ng.BitArray(faces.tolist()))
            found += factor * ng.Integrate(layer, space, definedon=region, order=2 * MORE)
    return float(found)
