"""How singular the field is at each corner: u grows as r^lambda, and lambda below 1 means an infinite field."""

from collections import defaultdict
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.models._fem_triangles import Edge, Triangles

_DEGREE = 8  # of the polynomials in a sector
_WIDEST = np.pi / 3  # of a sector
_NO_FIELD = 1e-9  # lambda^2 of a constant
_SMOOTH = 1e-6  # how near to a whole number lambda counts as one
_HIGHEST = 3.5  # lambda above which polynomials serve without refinement


def exponents(mesh: Triangles, permittivity: dict[str, float]) -> dict[int, float]:
    r"""Lowest exponent that is no whole number, for each corner that has one below 3.5.

    Around a corner u = r^lambda w(theta), :math:`(\varepsilon w')' + \lambda^2 \varepsilon w = 0`, w = 0 on electrodes,
    w' = 0 on mirrors: an eigenvalue problem in one dimension, solved with polynomials per sector.

    Parameters
    ----------
    mesh : Triangles
        The cell's few triangles.
    permittivity : dict of str to float
        Relative, of each material; its modulus where it is complex [-].

    Returns
    -------
    dict of int to float
        Corner's number to lambda [-].
    """
    around: dict[int, list[int]] = defaultdict(list)
    for number, corners in enumerate(mesh.triangles):
        for corner in corners:
            around[corner].append(number)
    known: dict[Any, float] = {}
    found: dict[int, float] = {}
    for corner, here in around.items():
        sectors, ends = _sectors(mesh, corner, here, permittivity)
        for fan, fixed in zip(sectors, ends, strict=True):
            key = (tuple((round(w, 9), eps) for w, eps in fan), fixed)
            if key not in known:
                known[key] = exponent(fan, fixed)
            value = known[key]
            if value < _HIGHEST:
                found[corner] = min(value, found.get(corner, value))
    return found


_Fan = list[tuple[float, float]]


def _sectors(
    mesh: Triangles, corner: int, here: list[int], permittivity: dict[str, float]
) -> tuple[list[_Fan], list[tuple[bool, bool] | None]]:
    """Angle and permittivity of the triangles around a corner, in turn, for each piece of dielectric that meets there.

    The ends say whether the first and the last line are electrodes; None where the pieces close to a ring.
    """
    turned = {n: _turned(mesh.triangles[n], corner) for n in here}
    by_first = {first: n for n, (first, _) in turned.items()}
    lasts = {last for _, last in turned.values()}
    fans, ends = [], []
    starts = [n for first, n in by_first.items() if first not in lasts] or here[:1]
    for start in starts:
        fan, n, first = [], start, turned[start][0]
        while True:
            a, b = (mesh.points[p] - mesh.points[corner] for p in turned[n])
            fan.append((float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)), permittivity[mesh.regions[n][0]]))
            last = turned[n][1]
            if last == first or last not in by_first:
                break
            n = by_first[last]
        fans.append(_merged(fan))
        ends.append(None if last == first else (_on_terminal(mesh, corner, first), _on_terminal(mesh, corner, last)))
    return fans, ends


def _turned(corners: tuple[int, int, int], corner: int) -> Edge:
    """The other two corners of a triangle, in turn."""
    k = corners.index(corner)
    return corners[k - 2], corners[k - 1]


def _on_terminal(mesh: Triangles, a: int, b: int) -> bool:
    return (min(a, b), max(a, b)) in mesh.terminals


def _merged(fan: _Fan) -> _Fan:
    found: _Fan = []
    for angle, eps in fan:
        if found and found[-1][1] == eps:
            angle += found.pop()[0]
        found.append((angle, eps))
    return found


@cache
def _reference() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and mass of polynomials on 0..1, given by their values at Chebyshev's points."""
    nodes = (1 - np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)) / 2
    at, weight = np.polynomial.legendre.leggauss(_DEGREE + 1)
    at, weight = (at + 1) / 2, weight / 2
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    value = np.vander(at, _DEGREE + 1, increasing=True) @ powers
    slope = np.vander(at, _DEGREE, increasing=True) @ (powers[1:] * np.arange(1, _DEGREE + 1)[:, None])
    return (slope.T * weight) @ slope, (value.T * weight) @ value


def exponent(fan: _Fan, fixed: tuple[bool, bool] | None) -> float:
    """The lowest exponent that is no whole number, or infinity.

    ``fan`` holds angle [rad] and permittivity [-] of the sectors in turn; ``fixed`` says whether an electrode bounds
    the first and the last, and is None where they close to a ring.
    """
    parts = [(angle / n, eps) for angle, eps in fan for n in [int(np.ceil(angle / _WIDEST))] for _ in range(n)]
    size = _DEGREE * len(parts) + 1
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for k, (angle, eps) in enumerate(parts):
        here = slice(_DEGREE * k, _DEGREE * (k + 1) + 1)
        stiffness[here, here] += eps / angle * _reference()[0]
        mass[here, here] += eps * angle * _reference()[1]
    keep = _kept(size, fixed)
    stiffness, mass = (keep.T @ m @ keep for m in (stiffness, mass))
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares = np.linalg.eigvalsh(root @ stiffness @ root.T)
    values = np.sqrt(squares[squares > _NO_FIELD])
    odd = values[np.abs(values - np.round(values)) > _SMOOTH]
    return float(odd.min()) if len(odd) else np.inf


def _kept(size: int, fixed: tuple[bool, bool] | None) -> NDArray[np.float64]:
    """From free values to all values: 0 on electrodes, the same at both ends of a ring."""
    if fixed is None:
        keep = np.eye(size)[:, :-1]
        keep[-1, 0] = 1.0
        return keep
    return np.eye(size)[:, int(fixed[0]) : size - int(fixed[1])]
