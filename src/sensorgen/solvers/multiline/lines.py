"""From resistances and admittances per length to the coupled line's matrices, and along it to the contacts."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import check_fit, passive
from sensorgen.solvers.multiline.piece import Line, Matrix, ahead, piece

Real = NDArray[np.float64]


def march(lines: Sequence[Line], lengths: Sequence[Real]) -> tuple[Matrix, Matrix]:
    """Admittance at the contacts and its derivative, from the open far end; the stack may be of any sections."""
    n = lines[0].series.shape[-1]
    w = by = np.zeros((n, n), complex)
    with np.errstate(all="ignore"):
        for line, length in zip(reversed(lines), reversed(lengths), strict=True):
            w, by = ahead(piece(line, length[..., None, None]), w, by)
    if not (np.isfinite(w).all() and np.isfinite(by).all()):
        raise OutOfRange("the stack's numbers are too extreme for double precision")
    return w, by


def inverse(admittance_s: Matrix) -> Matrix:
    """Z = 1/W with scaled unknowns; inf + 0j where a film carries no current."""
    size = np.abs(np.einsum("...kk->...k", admittance_s))
    idle = (size == 0).any(axis=-1)[..., None, None]
    scale = np.exp2(-np.rint(np.log2(np.where(size > 0, size, 1.0)) / 2))
    both = scale[..., :, None] * scale[..., None, :]
    safe = np.where(idle, np.eye(admittance_s.shape[-1]), admittance_s * both)
    return np.where(idle, complex(np.inf, 0.0), np.linalg.inv(safe) * both)


def side_by_side(name: str, values: Sequence[ArrayLike]) -> NDArray[Any]:
    """The tracks' or films' values along a last axis."""
    found = [passive(name, value) for value in values]
    check_fit(f"the values of {name} in a section", found)
    return np.stack(np.broadcast_arrays(*found), axis=-1)


def loops(r: NDArray[Any]) -> NDArray[Any]:
    """Resistance matrix of the loops: each runs through its two tracks, neighbours share one in opposite directions."""
    n = r.shape[-1] - 1
    own, shared = r[..., 1:] + r[..., :-1], r[..., 1:-1]
    found = np.zeros((*r.shape[:-1], n, n))
    k = np.arange(n)
    found[..., k, k] = own
    found[..., k[1:], k[:-1]] = found[..., k[:-1], k[1:]] = -shared
    return found


def diagonal(values: NDArray[Any]) -> Matrix:
    """Admittance matrix of the films, which do not see each other."""
    return np.asarray(np.eye(values.shape[-1]) * values[..., None, :], complex)


def directions(deep: int, *changes: Matrix | float) -> Matrix:
    """The directions of interest along one axis in front of ``deep`` others."""
    found = np.stack(np.broadcast_arrays(*(np.asarray(change, complex) for change in changes)))
    return found.reshape(len(changes), *(1,) * (deep + 1 - found.ndim), *found.shape[1:])
