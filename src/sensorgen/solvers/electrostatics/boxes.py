r"""Elements on boxes in which every matrix is known in closed form: a potential's, and a flux's.

In a box of edges h the energy is a sum over the three directions, each a product of one-dimensional matrices:

.. math:: E = \varepsilon \sum_x \frac{h_y h_z}{2 h_x} \, G_x, \qquad G_x = g \otimes m \otimes m

- Potential (Dirichlet): g is the stiffness and m the mass of polynomials on -1..1.
- Flux (Thomson), with potentials lambda on the faces that keep its normal component continuous and u that keeps it free
  of sources: g is what remains when the flux along x is worked out, m is 1 in an orthonormal basis.

In the eigenvectors of g the unknowns inside a box do not couple, so that they are eliminated by a division.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Element:
    """One kind of element on -1..1 cubed, of one order.

    Attributes
    ----------
    outer : three (b, b) arrays
        G of each direction for what neighbours share.
    coupling : three (i, b) arrays
        G between what lies inside and what neighbours share.
    inner : three (i,) arrays
        G of what lies inside, which is diagonal.
    one : (b,) array
        What neighbours share where the potential is 1.
    numbers : (b, 4) array
        Of each shared unknown: its place on the lattice of one element, and its kind.
    pitch : int
        Places of the lattice from one element to the next.
    """

    outer: tuple[Array, Array, Array]
    coupling: tuple[Array, Array, Array]
    inner: tuple[Array, Array, Array]
    one: Array
    numbers: Ints
    pitch: int

    def keys(self, boxes: Ints, count: Ints) -> Ints:
        """Numbers of the shared unknowns of boxes, equal where boxes share them.

        Parameters
        ----------
        boxes : (n, 3) array
            Which box of the grid each is, along x, y and z.
        count : (3,) array
            Boxes of the grid along x, y and z.
        """
        sizes = count * self.pitch + 1
        place = boxes[:, None, :] * self.pitch + self.numbers[None, :, :3]
        flat = (place[..., 0] * sizes[1] + place[..., 1]) * sizes[2] + place[..., 2]
        found: Ints = flat * 3 + self.numbers[:, 3]
        return found

    def condensed(self, scale: Array) -> Array:
        """Energy of the shared unknowns when those inside have found their best values, of a box of three scales."""
        shared, coupling, inner = (
            sum(s * g for s, g in zip(scale, of, strict=True)) for of in (self.outer, self.coupling, self.inner)
        )
        found: Array = shared - coupling.T @ (coupling / inner[:, None])
        return found


@cache
def potential(order: int) -> Element:
    """Continuous polynomials of an order: what they minimise lies above."""
    stiffness, mass, _ = _modes(order)
    pair = (stiffness, mass)
    places = np.indices((order + 1,) * 3).reshape(3, -1).T
    ends = places < 2
    shared, inside = ends.any(1), ~ends.any(1)
    lattice = np.array([0, order, *range(1, order)])  # both ends, then the modes between them
    numbers = np.column_stack([lattice[places[shared]], np.zeros(shared.sum(), dtype=np.int64)])
    whole = np.stack([_product([pair[int(a != axis)] for a in range(3)]) for axis in range(3)])
    return Element(
        _three(whole[:, shared][:, :, shared]),
        _three(whole[:, inside][:, :, shared]),
        _three(np.diagonal(whole[:, inside][:, :, inside], axis1=1, axis2=2)),
        ends[shared].all(1).astype(float),
        numbers,
        order,
    )


def _product(factors: list[Array]) -> Array:
    first, second, third = factors
    return np.kron(np.kron(first, second), third)


def _modes(order: int) -> tuple[Array, Array, Array]:
    """Stiffness and mass of two straight hats and of modes that vanish at both ends and diagonalise both; the modes."""
    at, weight = np.polynomial.legendre.leggauss(order + 1)
    value = _values(order, at)
    degree = np.arange(2, order + 1)
    legendre = np.polynomial.legendre.legvander(at, order)
    rising = legendre[:, degree - 1] * (2 * degree - 1) / np.sqrt(4 * degree - 2)
    slope = np.column_stack([-0.5 + 0 * at, 0.5 + 0 * at, rising])
    stiffness, mass = (v.T @ (weight[:, None] * v) for v in (slope, value))
    turn = np.eye(order + 1)
    turn[2:, 2:] = np.linalg.eigh(mass[2:, 2:]).eigenvectors  # the bubbles' stiffness is 1
    return turn.T @ stiffness @ turn, turn.T @ mass @ turn, turn


def _values(order: int, at: Array) -> Array:
    """Two straight hats, and bubbles of degree 2 and more, at some places."""
    legendre = np.polynomial.legendre.legvander(at, order)
    degree = np.arange(2, order + 1)
    bubbles = (legendre[:, degree] - legendre[:, degree - 2]) / np.sqrt(4 * degree - 2)
    return np.column_stack([(1 - at) / 2, (1 + at) / 2, bubbles])


@cache
def flux(order: int) -> Element:
    """Fluxes without sources of an order, and potentials on faces: what they minimise lies below."""
    ends, between, squares, turn = _worked_out(order)
    n = order + 1
    inside = np.indices((n, n, n)).reshape(3, -1)
    pair = np.indices((n, n)).reshape(2, -1)
    outer, coupling = np.zeros((3, 6 * n * n, 6 * n * n)), np.zeros((3, n**3, 6 * n * n))
    numbers = np.zeros((6 * n * n, 4), dtype=np.int64)
    for axis, side in np.ndindex(3, 2):
        face = (2 * axis + side) * n * n
        across = [a for a in range(3) if a != axis]
        rows = face + np.arange(n * n)
        for other in (0, 1):
            outer[axis, rows, rows + (other - side) * n * n] = ends[side, other]
        coupling[axis, np.arange(n**3), face + inside[across[0]] * n + inside[across[1]]] = between[inside[axis], side]
        numbers[rows, axis], numbers[rows[:, None], across], numbers[rows, 3] = side * n, pair.T, axis
    one = np.tile(2.0 * np.outer(turn[0], turn[0]).ravel(), 6)
    return Element(_three(outer), _three(coupling), _three(squares[inside]), one, numbers, n)


@cache
def traces(order: int, flux_order: int) -> Array:
    """What fluxes feel of potentials: moments of :func:`potential` with the functions on the faces of :func:`flux`.

    Parameters
    ----------
    order, flux_order : int
        Of both elements.

    Returns
    -------
    (f, b) array
        Of a potential's shared unknowns, its moments on six faces. With the moments of a flux, which G gives of its own
        unknowns, their product is the integral of the potential's gradient along the flux.
    """
    at, weight = np.polynomial.legendre.leggauss(order + flux_order + 2)
    modes = _values(order, at) @ _modes(order)[2]
    _, _, _, turn = _worked_out(flux_order)
    n = flux_order + 1
    legendre = np.polynomial.legendre.legvander(at, flux_order) * np.sqrt(np.arange(n) + 0.5)
    along = (legendre @ turn).T @ (weight[:, None] * modes)
    places = np.indices((order + 1,) * 3).reshape(3, -1).T
    places = places[(places < 2).any(1)]
    found = np.zeros((6 * n * n, len(places)))
    for axis, side in np.ndindex(3, 2):
        here = np.flatnonzero(places[:, axis] == side)
        first, second = (along[:, places[here, a]] for a in range(3) if a != axis)
        face = (2 * axis + side) * n * n
        found[face : face + n * n, here] = (first[:, None] * second[None]).reshape(n * n, -1)
    return found


def _worked_out(order: int) -> tuple[Array, Array, Array, Array]:
    """In one dimension: energy of a flux driven by potentials at two ends and between them, in the latter's modes.

    Returns the ends' matrix, that between modes and ends, the modes' energies, and the modes (orthonormal Legendre).
    """
    at, weight = np.polynomial.legendre.leggauss(order + 2)
    norm = np.sqrt(np.arange(order + 2) + 0.5)
    value = np.polynomial.legendre.legvander(at, order + 1) * norm
    ends = np.polynomial.legendre.legvander(np.array([-1.0, 1.0]), order + 1) * norm
    slope = np.polynomial.legendre.legval(at, np.polynomial.legendre.legder(np.diag(norm))).T
    divergence = value[:, :-1].T @ (weight[:, None] * slope)
    squares, turn = np.linalg.eigh(divergence @ divergence.T)
    drive = np.array([[-1.0], [1.0]]) * ends
    return drive @ drive.T, -turn.T @ divergence @ drive.T, squares, turn


def _three(found: NDArray[np.float64]) -> tuple[Array, Array, Array]:
    return found[0], found[1], found[2]
