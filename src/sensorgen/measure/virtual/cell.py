"""A pressed unit cell on a raster: finite strain with air as a very soft third medium, then the electric field.

One element is one cell of a grid whose lines pass through all corners of the section. Contact is what air does when it
is flattened: its pressure rises without limit (third medium contact, Wriggers, Schroeder and Schwarz, 2013). Written
apart from ``solvers`` and ``models``, so that what is made here and analysed there shares no error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
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
_SMALLEST_STEP = 1e-3  # of a load step, before it is given up
_GAUSS = 0.5 / np.sqrt(3)
_FLAT = 1e-9  # of the height: rows that are flatter have none


@dataclass(frozen=True, eq=False)
class Raster:
    """A section as a grid of columns, each of them cut into as many rows.

    Attributes
    ----------
    x_m : (nx + 1,) array
        Sides of the columns [m].
    z_m : (nz + 1, nx + 1) array
        Heights of the rows' edges at each side [m]; rows may have no height there.
    material : (nz, nx) array
        Number of each element's material; 0 is air, as above and below.
    electrode : (nz, nx) array
        1 at the bottom terminal, 2 at the top one, 0 elsewhere; conductors that float are 3.
    repeats : bool
        Whether the pattern goes on at its sides by shifts, else by mirrors.
    """

    x_m: Real
    z_m: Real
    material: Whole
    electrode: Whole
    repeats: bool


@dataclass(frozen=True)
class Solid:
    """Young's modulus [Pa], Poisson's ratio [-] and relative permittivity [-] of a material."""

    modulus_pa: float
    poisson: float
    permittivity: float


AIR = Solid(0.0, 0.0, 1.00059)


class Grid:
    """Nodes, elements and shape functions of a raster; constant for all loads. Elements of no area are left out."""

    def __init__(self, raster: Raster) -> None:
        z = raster.z_m
        rise = np.diff(z, axis=0) > _FLAT * np.ptp(z)
        number = np.concatenate([np.zeros((1, z.shape[1]), int), rise.cumsum(0)])  # along each side
        sides = number[:, :-1] if raster.repeats else number
        number = number + np.concatenate([[0], np.cumsum(sides[-1] + 1)])[: z.shape[1]]
        if raster.repeats:
            number[:, -1] = number[:, 0]
        self.count = int(number.max()) + 1
        self.edges: Whole = np.empty(0, int) if raster.repeats else np.unique(number[:, [0, -1]])
        self.base: Whole = np.unique(number[0])
        x = np.broadcast_to(raster.x_m, z.shape)

        def corners(of: NDArray[Any]) -> NDArray[Any]:
            return np.stack([of[:-1, :-1], of[:-1, 1:], of[1:, 1:], of[1:, :-1]], -1).reshape(-1, 4)

        kept = (rise[:, 1:] | rise[:, :-1]).ravel()
        self.nodes: Whole = corners(number)[kept]
        self.at_m: Real = np.stack([corners(x), corners(z)], -1)[kept]
        self.material, self.electrode = raster.material.ravel()[kept], raster.electrode.ravel()[kept]
        self.top: Whole = np.stack([number[-1, :-1], number[-1, 1:]], -1)
        self.gradients, self.weight = gradients(self.at_m)


def gradients(at_m: Real) -> tuple[Real, Real]:
    """Derivatives of four shape functions at four points of Gauss (e, 4, 4, 2) [1/m], and the points' areas (e, 4)."""
    points = 0.5 + _GAUSS * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    u, v = points.T
    by = np.stack([
        np.stack([-(1 - v), 1 - v, v, -v], -1), np.stack([-(1 - u), -u, u, 1 - u], -1),
    ], -1)  # fmt: skip
    turn = np.einsum("eni,gnk->egik", at_m, by)
    area = turn[..., 0, 0] * turn[..., 1, 1] - turn[..., 0, 1] * turn[..., 1, 0]
    return np.einsum("gnk,egki->egni", by, np.linalg.inv(turn)), area / 4


@dataclass(frozen=True, eq=False)
class Pressed:
    """A cell under a series of pressures.

    Attributes
    ----------
    pressure_pa : (k,) array
        On its top, the first 0 [Pa].
    sink_m : (k,) array
        Mean displacement of the top, downwards [m].
    place_m : (k, e, 4, 2) array
        Displaced corners of the elements [m].
    """

    pressure_pa: Real
    sink_m: Real
    place_m: Real


def pressed(raster: Raster, solids: Sequence[Solid], pressure_pa: Sequence[float]) -> Pressed:
    """Press the top of a cell that stands on a fixed base; its width stays.

    Parameters
    ----------
    raster : Raster
        The section.
    solids : sequence of Solid
        Materials by number; the first, of air, counts by its permittivity alone.
    pressure_pa : sequence of float
        Rising, from 0 on [Pa].

    Raises
    ------
    OutOfRange
        A pressure at which no equilibrium was found.
    """
    grid = Grid(raster)
    body = _Body(grid, raster, solids)
    u, rate = np.zeros(2 * grid.count), np.zeros(2 * grid.count)
    sinks, places = [0.0], [grid.at_m]
    for before, after in pairwise(pressure_pa):
        at, step = before, after - before
        while at < after - 1e-9 * after:
            step = min(step, after - at)
            ahead = u + step * rate  # where the last step leads, if that is nearer
            near = body.energy(ahead, at + step) < body.energy(u, at + step)
            found = body.settled(ahead if near else u, at + step)
            if found is None:
                step /= 2
                if step < _SMALLEST_STEP * (after - before):
                    raise OutOfRange(f"the cell has no equilibrium that the raster can find above {at / 1e3:.3g} kPa")
                continue
            u, rate, at = found, (found - u) / step, at + step
            step *= 1.5
        sinks.append(float(body.load @ u) / float(np.diff(raster.x_m).sum()))
        places.append(grid.at_m + u.reshape(-1, 2)[grid.nodes])
    return Pressed(np.array(pressure_pa, float), np.array(sinks), np.array(places))


class _Body:
    """Energy of a cell by its displacements, per depth, and its derivatives."""

    def __init__(self, grid: Grid, raster: Raster, solids: Sequence[Solid]) -> None:
        self.grid = grid
        number = grid.material
        self.air: Mask = number == 0
        shear = np.array([0.0] + [s.modulus_pa / 2 / (1 + s.poisson) for s in solids[1:]])
        ratio = np.array([0.0] + [min(2 * s.poisson / (1 - 2 * s.poisson), _BULK) for s in solids[1:]])
        shear[0] = _SOFT * shear[1:].min()
        self.shear = shear[number]
        self.bulk = (shear * ratio)[number]
        nodes = 2 * grid.nodes
        self.dofs: Whole = np.stack([nodes, nodes + 1], -1).reshape(-1, 8)
        self.rows = np.repeat(self.dofs, 8, axis=1).ravel()
        self.cols = np.tile(self.dofs, (1, 8)).ravel()
        fixed = np.zeros(2 * grid.count, bool)
        fixed[2 * grid.base] = fixed[2 * grid.base + 1] = fixed[2 * grid.edges] = True
        self.free = np.flatnonzero(~fixed)
        self.load = np.zeros(2 * grid.count)  # work per displacement of a pressure of 1, downwards negative
        np.add.at(self.load, 2 * grid.top + 1, -np.diff(raster.x_m)[:, None] / 2 * np.ones(2))
        twist = np.array([1.0, -1.0, 1.0, -1.0])
        size = np.ptp(grid.at_m, axis=1)
        own = np.where(self.air, _HOURGLASS * self.shear, 0.0) * (size.prod(1) * (size**-2).sum(1))
        self.hourglass = own[:, None, None] * np.kron(np.outer(twist, twist), np.eye(2))

    def strain(self, u: Real) -> tuple[Real, Real]:
        """Deformation gradients (e, 4, 2, 2) and their determinants (e, 4)."""
        f = np.eye(2) + np.einsum("eni,egnk->egik", u.reshape(-1, 2)[self.grid.nodes], self.grid.gradients)
        return f, f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]

    def energy(self, u: Real, pressure: float) -> float:
        """Of strain less the load's work; infinite where an element is turned inside out."""
        f, j = self.strain(u)
        if (j <= 0).any():
            return np.inf
        w, ln = self.grid.weight, np.log(j)
        density = self.shear[:, None] * ((f * f).sum((2, 3)) / 2 - 1 - ln)
        density = density + np.where(self.air, _AIR_BULK / 2 * self.shear, 0.0)[:, None] * ln**2
        mean = (w * j).sum(1) / w.sum(1) - 1
        own = u[self.dofs]
        twist = np.einsum("ea,eab,eb->", own, self.hourglass, own) / 2
        total = (w * density).sum() + (w.sum(1) * self.bulk * mean**2).sum() / 2 + twist
        return float(total - pressure * (self.load @ u))

    def slopes(self, u: Real) -> tuple[Real, Real]:
        """Forces (e, 8) and stiffness (e, 8, 8) of the elements."""
        f, j = self.strain(u)
        w, g = self.grid.weight, self.grid.gradients
        mean = (w * j).sum(1) / w.sum(1) - 1
        by_ln = -self.shear[:, None] + (self.bulk * mean)[:, None] * j
        twice = (self.bulk * mean)[:, None] * j
        air = self.air[:, None]
        by_ln = np.where(air, self.shear[:, None] * (_AIR_BULK * np.log(j) - 1), by_ln)
        twice = np.where(air, _AIR_BULK * self.shear[:, None], twice)
        inverse = np.stack([
            np.stack([f[..., 1, 1], -f[..., 1, 0]], -1), np.stack([-f[..., 0, 1], f[..., 0, 0]], -1),
        ], -2) / j[..., None, None]  # transposed  # fmt: skip
        b = np.einsum("egik,egnk->egni", inverse, g)
        n = len(j)
        force = np.einsum("eg,egik,egnk->eni", w * self.shear[:, None], f, g) + np.einsum("eg,egni->eni", w * by_ln, b)
        same = np.einsum("eg,egnk,egmk->enm", w * self.shear[:, None], g, g)
        k = np.einsum("enm,ij->enimj", same, np.eye(2))
        k = k + np.einsum("eg,egni,egmj->enimj", w * twice, b, b) - np.einsum("eg,egnj,egmi->enimj", w * by_ln, b, b)
        stiff = k.reshape(n, 8, 8)
        volume = np.einsum("eg,egni->eni", w * j, b).reshape(n, 8)
        stiff = stiff + (self.bulk / w.sum(1))[:, None, None] * volume[:, :, None] * volume[:, None, :]
        own = np.einsum("eab,eb->ea", self.hourglass, u[self.dofs])
        return force.reshape(n, 8) + own, stiff + self.hourglass

    def settled(self, u: Real, pressure: float) -> Real | None:
        """Displacements in equilibrium, by Newton's method with a search along each step; None if there is none."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.linalg import splu

        energy, work = self.energy(u, pressure), 0.0
        size = 2 * self.grid.count
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


def capacitance(raster: Raster, permittivity: Sequence[float], place_m: Real) -> float:
    """Between the electrodes, per depth [F/m].

    Parameters
    ----------
    raster : Raster
        The section.
    permittivity : sequence of float
        Relative, by material; the first of air.
    place_m : (e, 4, 2) array
        Corners of its elements, displaced [m].
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu

    grid = Grid(raster)
    inside = grid.electrode == 0
    corners = grid.nodes[inside]
    by, area = gradients(place_m[inside])
    eps = np.array(permittivity)[grid.material[inside]] * EPSILON_0
    k = np.einsum("eg,egni,egmi->enm", eps[:, None] * np.abs(area), by, by)
    same = _potentials(grid)
    used, numbers = np.unique(same[corners], return_inverse=True)
    numbers = numbers.reshape(corners.shape)
    whole = coo_matrix((k.ravel(), (np.repeat(numbers, 4, 1).ravel(), np.tile(numbers, (1, 4)).ravel())),
                       (len(used), len(used))).tocsc()  # fmt: skip
    v = (used == -2).astype(float)
    free = np.flatnonzero(used >= 0)
    fixed = np.flatnonzero(used < 0)
    v[free] = splu(whole[free][:, free]).solve(-(whole[free][:, fixed] @ v[fixed]))
    return float(v @ (whole @ v))


def conductance(raster: Raster, electrode: int) -> float:
    """Of an electrode from one side of the section to the other, per depth and conductivity [-]."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu

    grid = Grid(raster)
    inside = grid.electrode == electrode
    by, area = gradients(grid.at_m[inside])
    k = np.einsum("eg,egni,egmi->enm", area, by, by)
    used, numbers = np.unique(grid.nodes[inside], return_inverse=True)
    numbers = numbers.reshape(-1, 4)
    pairs = np.repeat(numbers, 4, 1).ravel(), np.tile(numbers, (1, 4)).ravel()
    whole = coo_matrix((k.ravel(), pairs), (len(used), len(used))).tocsc()
    at = np.empty(len(used))
    at[numbers] = grid.at_m[inside][..., 0]
    left, right = (np.isclose(at, side, rtol=0, atol=1e-9) for side in (raster.x_m[0], raster.x_m[-1]))
    v = right.astype(float)
    free, fixed = np.flatnonzero(~(left | right)), np.flatnonzero(left | right)
    v[free] = splu(whole[free][:, free]).solve(-(whole[free][:, fixed] @ v[fixed]))
    return float(v @ (whole @ v))


def _potentials(grid: Grid) -> Whole:
    """Number of each node's unknown: -1 at the bottom terminal, -2 at the top one; one in a piece that floats."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    found = np.arange(grid.count)
    loose = grid.nodes[grid.electrode > 2]
    pairs = loose[:, [0, 1, 2]].ravel(), loose[:, [1, 2, 3]].ravel()
    _, piece = connected_components(coo_matrix((np.ones(len(pairs[0])), pairs), (grid.count, grid.count)), False)
    found[loose] = np.unique(piece, return_index=True)[1][piece][loose]
    for terminal in (2, 1):
        found[grid.nodes[grid.electrode == terminal]] = -terminal
    return found
