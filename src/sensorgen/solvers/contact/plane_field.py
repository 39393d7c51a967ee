"""Bounds of the capacitance of a cell's outlines by quadratic triangles.

Any admissible potential bounds it from above (Dirichlet); any divergence-free flux from below
(Thomson). In the plane such a flux is the curl of a stream function, which turns the lower bound into the same problem
with 1/eps, its values given on the sides of the cell in place of the electrodes. Around an axis (Stokes) the stream
function psi = r phi has the energy (phi / r e_r + grad phi)^2 r / (2 pi eps), and phi is the unknown.
"""

from collections import defaultdict
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.solvers.contact import rings
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell, Edge
from sensorgen.solvers.contact.element import triangle_gradients, triangle_points, triangle_values
from sensorgen.solvers.contact.factors import solved_by_lu
from sensorgen.solvers.contact.mesh import Net, TriangleMesh, nearest, of_triangles, triangulated
from sensorgen.solvers.contact.mesher import Unmeshed
from sensorgen.solvers.contact.wedge import Wedge, filled, wedges

Edges = Mapping[Edge, tuple[int, int]]

_ROUNDING = 1e-9
_HOLE = 1e-6  # area that a mesh may miss, as a share


def capacitance(cell: ContactCell, mesh: TriangleMesh, permittivity: Mapping[str, float]) -> Interval:
    """Bounds of the capacitance per area of a cell [F/m2].

    Parameters
    ----------
    cell : ContactCell
        Mirrored.
    mesh : TriangleMesh
        From :func:`meshed`, pressed or not.
    permittivity : mapping of str to float
        Relative permittivity by material, with "air" [-].

    Raises
    ------
    OutOfRange
        The electrodes touch.
    Unmeshed
        The bounds are in the wrong order, which no sound mesh can do.
    """
    terminal = np.array([r.terminal for r in cell.regions])[mesh.region - 1]
    ends = [np.isin(np.arange(len(mesh.points_m)), mesh.outer[terminal == end]) for end in ("bottom", "top")]
    if (ends[0] & ends[1]).any():
        raise OutOfRange("the electrodes touch: the capacitance grows without bound")
    # Dielectric carries field in a piece that touches both electrodes
    dielectric = terminal == ""
    middles = mesh.outer[dielectric, 3:]
    beside = coo_matrix((np.ones(middles.size), (middles.ravel(), middles[:, [1, 2, 0]].ravel())), (len(ends[0]),) * 2)
    _, piece = connected_components(beside)
    touched = [np.unique(piece[middles[end[middles].any(axis=1), 0]]) for end in ends]
    inside = np.flatnonzero(dielectric)[np.isin(piece[middles[:, 0]], np.intersect1d(touched[0], touched[1]))]
    eps = np.array([permittivity.get(r.material, np.nan) for r in cell.regions])[mesh.region[inside] - 1]
    x = mesh.points_m[:, 0]
    width = float(np.ptp(x))
    area = np.pi * width**2 if cell.turned else width
    sides = [abs(x - end) < _ROUNDING * width for end in (x.min(), x.max())]
    potentials, streams = _energies(mesh, inside)
    upper = _energy(mesh.outer[inside], potentials * eps[:, None, None], *ends) / area
    flux = width if cell.turned else 1.0  # psi of a phi that is 1 at the outer side
    lower = flux**2 / (_energy(mesh.outer[inside], streams / eps[:, None, None], *sides) * area)
    if not lower <= upper * (1 + _ROUNDING):
        raise Unmeshed(f"bounds in the wrong order, {lower} above {upper}")
    return Interval(lower, upper).times(EPS0_F_PER_M)


def _energies(mesh: TriangleMesh, inside: Whole) -> tuple[Real, Real]:
    """Quadratic forms (m, 6, 6) of some triangles: of potentials, and of stream functions."""
    at, weights = triangle_points()
    slopes, jacobians = triangle_gradients(at)[:, :6], mesh.jacobians_m[inside]
    inverse, volume = np.linalg.inv(jacobians), np.linalg.det(jacobians)
    if not mesh.turned:
        table = np.einsum("q,qna,qmb->abnm", weights, slopes, slopes).reshape(4, 36)
        metric = volume[:, None, None] * (inverse @ inverse.transpose(0, 2, 1))
        found = (metric.reshape(-1, 4) @ table).reshape(-1, 6, 6)
        return found, found
    gradients, weight = np.einsum("qnk,mki->mqin", slopes, inverse), volume[:, None] * weights
    values = triangle_values(at)[:, :6]
    r = mesh.points_m[mesh.outer[inside], 0] @ values.T
    streams = gradients.copy()
    streams[:, :, 0] += values / r[..., None]
    return _squares(gradients, 2 * np.pi * r * weight), _squares(streams, r / (2 * np.pi) * weight)


def _squares(fields: Real, weight: Real) -> Real:
    """Integrals (m, n, n) of products of fields (m, q, d, n)."""
    flat = fields.reshape(*fields.shape[:1], -1, fields.shape[-1])
    return np.asarray(
        np.matmul((flat * np.repeat(weight, fields.shape[2], axis=1)[..., None]).transpose(0, 2, 1), flat)
    )


def meshed(cell: ContactCell, coarse_mm: float, growth: float, count: int = 6) -> TriangleMesh:
    """Mesh everything but thin wedges of air, which are filled with triangles of their own.

    Parameters
    ----------
    cell : ContactCell
        Its outlines, pressed or not.
    coarse_mm, growth : float
        Largest triangle [mm], and by how much triangles grow per distance [-].
    count : int
        Of rings around corners.

    Raises
    ------
    Unmeshed
        The mesher gave up, or left a hole.
    """
    edges, room = cell.edges, _ROUNDING * cell.width_mm()
    cut, thin = dict(edges), wedges(edges, cell.air) if cell.air != OUTSIDE else []
    for number, wedge in enumerate(thin, 1):
        for p, q in (*pairwise(wedge.first), *pairwise(wedge.second[::-1])):
            key, place = ((p, q), 0) if (p, q) in cut else ((q, p), 1)
            cut[key] = (-number, cut[key][1]) if place == 0 else (cut[key][0], -number)
        if wedge.first[-1] != wedge.second[-1]:
            cut[wedge.first[-1], wedge.second[-1]] = (-number, cell.air)
    if any(not cell.left_mm - room <= x <= cell.right_mm + room for edge in edges for x, _ in edge):
        raise Unmeshed("the deformed outlines run through the mirrors")
    _refuse_crossings(np.array(list(cut)).reshape(-1, 2, 2))
    net = triangulated(cut, coarse_mm, growth, quick=True)
    new = [triangle for number, wedge in enumerate(thin, 1) for triangle in _filling(net, number, wedge)]
    corners = np.concatenate([net.corners, np.array(new, int).reshape(-1, 3)])
    # Compare the area within the edges with that of the triangles (m, 3, 2), none of which may be turned over
    placed = net.points_m[corners]
    drawn = sum(
        0.5 * (a[0] * b[1] - a[1] * b[0]) * ((left > 0) - (right > 0)) for (a, b), (left, right) in edges.items()
    )
    u, v = placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0]
    parts = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / M_PER_MM**2
    if parts.min() <= 0 or abs(parts.sum() / drawn - 1) > _HOLE:
        raise Unmeshed("the mesh has holes or folds")
    region = np.concatenate([net.region, np.full(len(new), cell.air)])
    tips = [nearest(net.points_m, place) for place in rings.corners(edges, cell.left_mm, cell.right_mm)]
    return of_triangles(*rings.ringed(net.points_m, corners, region, tips, count), turned=cell.turned)


def _refuse_crossings(edges: Real) -> None:
    """Edges (k, 2, 2) that cross each other would keep the mesher busy for ever, or end the process."""
    lines = shapely.linestrings(edges)
    near = edges[shapely.STRtree(lines).query(lines)]  # (2, pairs, 2, 2)
    (a, b), (c, d) = near.swapaxes(1, 2)
    if ((_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)).any():
        raise Unmeshed("the deformed outlines run into each other")


def _side(a: Real, b: Real, p: Real) -> Real:
    """On which side of the lines through a and b the points p lie: their sign."""
    u, v = b - a, p - a
    turn = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    size = np.abs(u[..., 0] * v[..., 1]) + np.abs(u[..., 1] * v[..., 0])
    return np.asarray(np.where(np.abs(turn) > _ROUNDING * size, np.sign(turn), 0.0))


def _filling(net: Net, number: int, wedge: Wedge) -> list[tuple[int, int, int]]:
    """Triangles for a wedge, whose sides the mesher may have cut."""
    points, beside = net.points_m, defaultdict(list)
    for a, b in net.marked[-number]:
        beside[a].append(b)
        beside[b].append(a)
    tip, ahead = (nearest(points, p) for p in wedge.first[:2])
    if len(beside[tip]) != 2:
        raise Unmeshed("the mesh has lost the tip of a gap")
    ways = points[beside[tip]] - points[tip]
    ring = [tip, beside[tip][int((ways @ (points[ahead] - points[tip]) / np.hypot(*ways.T)).argmax())]]
    while ring[-1] != tip:
        ring.append(next(k for k in beside[ring[-1]] if k != ring[-2]))
    return filled(ring[:-1], points.tolist())


def _energy(triangles: Whole, local: Real, zero: Mask, one: Mask) -> float:
    """Least of the sum of quadratic forms (m, 6, 6) of functions that are 0 and 1 at given nodes [-]."""
    n = len(zero)
    rows, columns = np.repeat(triangles, 6, axis=1).ravel(), np.tile(triangles, (1, 6)).ravel()
    matrix = coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
    v = one.astype(float)
    free = np.isin(np.arange(n), triangles) & ~zero & ~one
    v[free] = solved_by_lu(matrix[free][:, free], -(matrix @ v)[free])
    return float(v @ (matrix @ v))
