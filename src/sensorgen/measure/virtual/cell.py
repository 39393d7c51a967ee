"""A pressed unit cell on a raster: finite strain with air as a very soft third medium, then the electric field.

Of a section in plane strain, or of a cell in three dimensions. One element is one cell of a grid whose lines pass
through all corners. Contact is what air does when it is flattened: its pressure rises without limit (third medium
contact, Wriggers, Schroeder and Schwarz, 2013). Written apart from ``solvers`` and ``models``, so that what is made
here and analysed there shares no error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import OutOfRange

EPSILON_0 = 8.8541878128e-12
_SOFT = 1e-5  # shear modulus of air over that of the softest solid
_AIR_BULK = 5.0  # its second constant, over its shear modulus
_HOURGLASS = 1e-3  # stiffness of air's hourglass mode, over its shear modulus: keeps flattened air in shape
_BULK = 1000.0  # Lame's first constant over the shear modulus at most: with the mean of an element no locking below it
_ROUNDS = 40
_SETTLED = 1e-7  # of the energy's fall, relative to the load's work
_SMALLEST_STEP = 1e-2  # of a load step, before it is given up
_GAUSS, _ADJUGATE = 0.5 / np.sqrt(3), np.array([[1, -1], [-1, 1]])  # signs of a matrix turned by half a turn
_FLAT = 1e-9  # of the height: rows that are flatter have none
_MOST_DIRECT = 15_000  # unknowns of a field that is solved by factors
_RESIDUAL = 1e-8  # relative, of larger ones


@dataclass(frozen=True)
class Solid:
    """Young's modulus [Pa], Poisson's ratio [-] and relative permittivity [-] of a material."""

    modulus_pa: float
    poisson: float
    permittivity: float


AIR = Solid(0.0, 0.0, 1.00059)


@dataclass(frozen=True, eq=False)
class ElementGrid:
    """Elements of a section (d = 2) or of a whole cell (d = 3); those of no area are left out.

    Attributes
    ----------
    nodes : (e, 2^d) array
        Numbers of the elements' corners, in the order of :func:`_corners`.
    at_m : (e, 2^d, d) array
        Where the corners are, the height last [m].
    material : (e,) array
        Number of each element's material; 0 is air, as above and below.
    electrode : (e,) array
        1 at the bottom terminal, 2 at the top one, 0 elsewhere; conductors that float are 3.
    fixed : (n, d) array
        Which displacements of the nodes are zero: all at the base, at the sides those across them.
    top_m : (n,) array
        Length or area of the top that belongs to each node [m] or [m2].
    """

    nodes: Whole
    at_m: Real
    material: Whole
    electrode: Whole
    fixed: Mask
    top_m: Real

    @cached_property
    def shapes(self) -> tuple[Real, Real]:
        """As :func:`gradients` at rest."""
        return gradients(self.at_m)


def section_grid(x_m: Real, z_m: Real, material: Whole, electrode: Whole, *, repeats: bool) -> ElementGrid:
    """Elements of a section in columns, each of them cut into as many rows.

    Parameters
    ----------
    x_m : (nx + 1,) array
        Sides of the columns [m].
    z_m : (nz + 1, nx + 1) array
        Heights of the rows' edges at each side [m]; rows may have no height there.
    material, electrode : (nz, nx) array
        As of the grid.
    repeats : bool
        Whether the pattern goes on at its sides by shifts, else by mirrors.
    """
    rise = np.diff(z_m, axis=0) > _FLAT * np.ptp(z_m)
    number = np.concatenate([np.zeros((1, z_m.shape[1]), int), rise.cumsum(0)])  # along each side
    sides = number[:, :-1] if repeats else number
    number = number + np.concatenate([[0], np.cumsum(sides[-1] + 1)])[: z_m.shape[1]]
    if repeats:
        number[:, -1] = number[:, 0]
    fixed, top = np.zeros((int(number.max()) + 1, 2), bool), np.zeros(int(number.max()) + 1)
    fixed[number[0]] = True
    if not repeats:
        fixed[number[:, [0, -1]], 0] = True
    np.add.at(top, number[-1], _shares(x_m))
    at = np.stack([np.broadcast_to(x_m, z_m.shape), z_m], -1)
    free = (rise[:, 1:] | rise[:, :-1]).T.ravel()
    of = material.T.ravel()[free], electrode.T.ravel()[free]
    return ElementGrid(_at_corners(number.T, 2)[free], _at_corners(at.swapaxes(0, 1), 2)[free], *of, fixed, top)


def brick_grid(x_m: Real, y_m: Real, z_m: Real, material: Whole, electrode: Whole) -> ElementGrid:
    """Elements of a cell of bricks between mirrors.

    Parameters
    ----------
    x_m, y_m, z_m : (nx + 1,), (ny + 1,), (nz + 1,) array
        Places of the planes square to x, y and z [m].
    material, electrode : (nx, ny, nz) array
        As of the grid.
    """
    at = np.stack(np.meshgrid(x_m, y_m, z_m, indexing="ij"), -1)
    number = np.arange(at[..., 0].size).reshape(at.shape[:3])
    fixed, top = np.zeros((number.size, 3), bool), np.zeros(number.size)
    fixed[number[..., 0]] = True
    fixed[number[[0, -1]], 0] = fixed[number[:, [0, -1]], 1] = True
    top[number[..., -1]] = np.outer(_shares(x_m), _shares(y_m))
    return ElementGrid(_at_corners(number, 3), _at_corners(at, 3), material.ravel(), electrode.ravel(), fixed, top)


def _shares(at_m: Real) -> Real:
    """Length that belongs to each of some places in a row [m]."""
    return np.convolve(np.diff(at_m), [0.5, 0.5])


def _corners(dimensions: int) -> Whole:
    """Corners of the unit square or cube (2^d, d)."""
    return np.array(list(product((0, 1), repeat=dimensions)))


def _at_corners(of: NDArray[Any], dimensions: int) -> NDArray[Any]:
    """Values at the corners of all elements (e, 2^d, ...), of values at the nodes of a grid."""
    ends = product((slice(None, -1), slice(1, None)), repeat=dimensions)
    return np.stack([of[end] for end in ends], dimensions).reshape(-1, 2**dimensions, *of.shape[dimensions:])


def gradients(at_m: Real) -> tuple[Real, Real]:
    """Derivatives of the shape functions at the points of Gauss, and the points' areas or volumes.

    Parameters
    ----------
    at_m : (e, 2^d, d) array
        Corners of elements [m].

    Returns
    -------
    (e, g, 2^d, d) array, (e, g) array
        Of g = 2^d points [1/m], [m^d].
    """
    dimensions = at_m.shape[-1]
    corner = _corners(dimensions)
    point = (0.5 + _GAUSS * (2 * corner - 1))[:, None]
    value = np.where(corner, point, 1 - point)
    by = np.stack([(2 * corner[:, k] - 1) * np.delete(value, k, -1).prod(-1) for k in range(dimensions)], -1)
    turn = np.einsum("eni,gnk->egik", at_m, by)
    return by @ np.linalg.inv(turn), np.linalg.det(turn) / len(corner)


def pressed(grid: ElementGrid, solids: Sequence[Solid], pressure_pa: Sequence[float], least: int | None = None) -> Real:
    """Press the top of a cell that stands on a fixed base; its width stays.

    Parameters
    ----------
    grid : ElementGrid
        The section, or the cell.
    solids : sequence of Solid
        Materials by number; the first, of air, counts by its permittivity alone.
    pressure_pa : sequence of float
        Rising, from 0 on [Pa].
    least : int, optional
        Number of pressures that have to be reached; the others are left out where no equilibrium is found. All if None.

    Returns
    -------
    (k, e, 2^d, d) array
        Displaced corners of the elements, under each pressure that is reached [m].

    Raises
    ------
    OutOfRange
        No equilibrium was found at one of the pressures that have to be reached.
    """
    body = _Body(grid, solids)
    u, rate = np.zeros(grid.fixed.size), np.zeros(grid.fixed.size)
    places = [grid.at_m]
    for before, after in pairwise(pressure_pa):
        at, step = before, after - before
        while at < after - 1e-9 * after and step >= _SMALLEST_STEP * (after - before):
            step = min(step, after - at)
            ahead = u + step * rate  # where the last step leads, if that is nearer
            near = body.energy(ahead, at + step) < body.energy(u, at + step)
            settled = body.settled(ahead if near else u, at + step)
            if settled is None:
                step /= 2
                continue
            u, rate, at = settled, (settled - u) / step, at + step
            step *= 1.5
        if at < after - 1e-9 * after:
            if len(places) < (least or len(pressure_pa)):
                raise OutOfRange(f"the cell has no equilibrium that the raster can find above {at / 1e3:.3g} kPa")
            break
        places.append(grid.at_m + u.reshape(grid.fixed.shape)[grid.nodes])
    return np.array(places)


class _Body:
    """Energy of a cell by its displacements, of a section per depth, and its derivatives."""

    def __init__(self, grid: ElementGrid, solids: Sequence[Solid]) -> None:
        self.grid = grid
        self.air: Mask = grid.material == 0
        shear = np.array([0.0] + [s.modulus_pa / 2 / (1 + s.poisson) for s in solids[1:]])
        ratio = np.array([0.0] + [min(2 * s.poisson / (1 - 2 * s.poisson), _BULK) for s in solids[1:]])
        shear[0] = _SOFT * shear[1:].min()
        self.shear = shear[grid.material]
        self.bulk = (shear * ratio)[grid.material]
        elements, corners, d = grid.at_m.shape
        self.dofs: Whole = (d * grid.nodes[..., None] + np.arange(d)).reshape(elements, -1)
        self.rows = np.repeat(self.dofs, corners * d, axis=1).ravel()
        self.cols = np.tile(self.dofs, (1, corners * d)).ravel()
        self.free = np.flatnonzero(~grid.fixed)
        load = np.zeros(grid.fixed.shape)  # work per displacement of a pressure of 1, downwards negative
        load[:, -1] = -grid.top_m
        self.load: Real = load.ravel()
        self.hourglass = np.where(self.air, _HOURGLASS * self.shear, 0.0)[:, None, None] * _twists(grid.at_m)

    def strain(self, u: Real) -> tuple[Real, Real]:
        """Deformation gradients (e, 2^d, d, d) and their determinants (e, 2^d)."""
        moved = u.reshape(self.grid.fixed.shape)[self.grid.nodes]
        f = np.eye(moved.shape[-1]) + moved.swapaxes(1, 2)[:, None] @ self.grid.shapes[0]
        return f, np.linalg.det(f) if f.shape[-1] > 2 else f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]

    def energy(self, u: Real, pressure: float) -> float:
        """Of strain less the load's work; infinite where an element is turned inside out."""
        f, j = self.strain(u)
        if (j <= 0).any():
            return np.inf
        w, ln = self.grid.shapes[1], np.log(j)
        density = self.shear[:, None] * (((f * f).sum((2, 3)) - f.shape[-1]) / 2 - ln)
        density = density + np.where(self.air, _AIR_BULK / 2 * self.shear, 0.0)[:, None] * ln**2
        mean = (w * j).sum(1) / w.sum(1) - 1
        own = u[self.dofs]
        twist = (own * (self.hourglass @ own[..., None])[..., 0]).sum() / 2
        total = (w * density).sum() + (w.sum(1) * self.bulk * mean**2).sum() / 2 + twist
        return float(total - pressure * (self.load @ u))

    def slopes(self, u: Real) -> tuple[Real, Real]:
        """Forces (e, m) and stiffness (e, m, m) of the elements, of m displacements each."""
        f, j = self.strain(u)
        g, w = self.grid.shapes
        elements, points, corners, d = g.shape
        mean = (w * j).sum(1) / w.sum(1) - 1
        air = self.air[:, None]
        twice = np.where(air, _AIR_BULK * self.shear[:, None], (self.bulk * mean)[:, None] * j)  # by ln J, twice
        by_ln = np.where(air, self.shear[:, None] * (_AIR_BULK * np.log(j) - 1), twice - self.shear[:, None])
        inverse = np.linalg.inv(f) if d > 2 else f[..., ::-1, ::-1].swapaxes(2, 3) * _ADJUGATE / j[..., None, None]
        b = g @ inverse  # derivatives of ln J
        stretch, flat = w * self.shear[:, None], b.reshape(elements, points, -1)
        force = (stretch[..., None, None] * (g @ f.swapaxes(2, 3)) + (w * by_ln)[..., None, None] * b).sum(1)
        turned = _products(w * by_ln, flat).reshape(elements, corners, d, corners, d).swapaxes(2, 4)
        k = _each_way(_gradient_products(stretch, g), d) + _products(w * twice, flat)
        k = k - turned.reshape(k.shape)
        volume = ((w * j)[:, None] @ flat)[:, 0]
        k = k + (self.bulk / w.sum(1))[:, None, None] * volume[:, :, None] * volume[:, None, :]
        return force.reshape(elements, -1) + (self.hourglass @ u[self.dofs][..., None])[..., 0], k + self.hourglass

    def settled(self, u: Real, pressure: float) -> Real | None:
        """Displacements in equilibrium, by Newton's method with a search along each step; None if there is none."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.linalg import splu

        energy, work = self.energy(u, pressure), 0.0
        size = self.grid.fixed.size
        for _ in range(_ROUNDS):
            force, stiff = self.slopes(u)
            left = pressure * self.load - np.bincount(self.dofs.ravel(), force.ravel(), size)
            whole = coo_matrix((stiff.ravel(), (self.rows, self.cols)), (size, size)).tocsc()
            step = np.zeros(size)
            inside = whole[self.free][:, self.free]
            step[self.free] = splu(
                inside, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0
            ).solve(left[self.free])
            fall = float(left @ step)
            if fall < 0:
                return None
            share, tried = 1.0, self.energy(u + step, pressure)
            while tried > energy - 1e-4 * share * fall and share > 1e-4:
                share /= 2
                tried = self.energy(u + share * step, pressure)
            if share <= 1e-4:
                return u if fall < 100 * _SETTLED * max(work, 1e-300) else None
            u, energy = u + share * step, tried
            work = max(work, abs(pressure * float(self.load @ u)))
            if fall < _SETTLED * work and share == 1.0:
                return u
        return None


def _products(weight: Real, of: Real) -> Real:
    """Sums over points of weight (e, g) times the products of a vector's (e, g, m) components (e, m, m)."""
    return np.asarray((weight[..., None] * of).swapaxes(1, 2) @ of)


def _gradient_products(weight: Real, by: Real) -> Real:
    """Sums over points of weight (e, g) times the scalar products of gradients (e, g, n, d), of all pairs (e, n, n)."""
    return np.asarray(sum(_products(weight, by[..., k]) for k in range(by.shape[-1])))


def _each_way(of: Real, dimensions: int) -> Real:
    """Matrices of one quantity (e, n, n) for each component of a vector alike (e, n d, n d)."""
    size = of.shape[-1] * dimensions
    return np.asarray(np.einsum("enm,ij->enimj", of, np.eye(dimensions)).reshape(-1, size, size))


def _twists(at_m: Real) -> Real:
    """Stiffness of the hourglass modes of elements of a unit modulus (e, m, m)."""
    dimensions = at_m.shape[-1]
    sign, size = 2 * _corners(dimensions) - 1, np.ptp(at_m, axis=1)
    most = 0.0
    for count in range(2, dimensions + 1):
        for axes in combinations(range(dimensions), count):
            twist = sign[:, axes].prod(1)
            own = size.prod(1) * (size[:, axes] ** -2).sum(1) * 4.0 ** (count - dimensions)
            most = most + own[:, None, None] * np.outer(twist, twist)
    return _each_way(np.asarray(most), dimensions)


def capacitance(grid: ElementGrid, permittivity: Sequence[float], place_m: Real) -> float:
    """Between the electrodes, of a section per depth [F/m], of bricks [F].

    Parameters
    ----------
    grid : ElementGrid
        The section, or the cell.
    permittivity : sequence of float
        Relative, by material; the first of air.
    place_m : (e, 2^d, d) array
        Corners of its elements, displaced [m].
    """
    inside = grid.electrode == 0
    by, size = gradients(place_m[inside])
    eps = np.array(permittivity)[grid.material[inside]] * EPSILON_0
    return _flux(_potentials(grid)[grid.nodes[inside]], eps[:, None] * np.abs(size), by)


def conductance(grid: ElementGrid, electrode: int) -> float:
    """Of an electrode from the lowest x to the highest, per conductivity: of a section per depth [-], of bricks [m]."""
    inside, x = grid.electrode == electrode, grid.at_m[..., 0]
    by, size = gradients(grid.at_m[inside])
    left, right = (np.isclose(x[inside], side, rtol=0, atol=1e-9) for side in (x.min(), x.max()))
    return _flux(np.where(left, -1, np.where(right, -2, grid.nodes[inside])), size, by)


def _flux(unknown: Whole, weight: Real, by: Real) -> float:
    """Between potentials 0 and 1, of elements with their corners' unknowns (e, n), -1 and -2 at those potentials."""
    from scipy.sparse import coo_matrix

    used, number = np.unique(unknown, return_inverse=True)
    k, (elements, corners) = _gradient_products(weight, by), unknown.shape
    number = number.reshape(elements, corners)
    pairs = np.repeat(number, corners, 1).ravel(), np.tile(number, (1, corners)).ravel()
    whole = coo_matrix((k.ravel(), pairs), (len(used), len(used))).tocsc()
    v = (used == -2).astype(float)
    free, fixed = np.flatnonzero(used >= 0), np.flatnonzero(used < 0)
    v[free] = _solved(whole[free][:, free], -(whole[free][:, fixed] @ v[fixed]))
    return float(v @ (whole @ v))


def _solved(matrix: Any, right: Real) -> Real:
    """Solution of a symmetric positive definite system; a large one by conjugate gradients."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import cg, splu

    if len(right) < _MOST_DIRECT:
        return np.asarray(splu(matrix).solve(right))
    solution, failed = cg(matrix, right, rtol=_RESIDUAL, M=diags(1 / matrix.diagonal()))
    if failed:
        raise OutOfRange(f"the field of a cell with {len(right)} unknowns did not converge")
    return np.asarray(solution)


def _potentials(grid: ElementGrid) -> Whole:
    """Number of each node's unknown: -1 at the bottom terminal, -2 at the top one; one in a piece that floats."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(grid.top_m)
    numbers = np.arange(count)
    loose = grid.nodes[grid.electrode > 2]
    pairs = loose[:, :-1].ravel(), loose[:, 1:].ravel()
    _, piece = connected_components(coo_matrix((np.ones(len(pairs[0])), pairs), (count, count)), False)
    numbers[loose] = np.unique(piece, return_index=True)[1][piece][loose]
    for terminal in (2, 1):
        numbers[grid.nodes[grid.electrode == terminal]] = -terminal
    return numbers
