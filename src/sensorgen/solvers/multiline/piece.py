r"""A uniform length of coupled line, as three matrices, and its exact derivatives: right for any length and loss.

Film voltages v and loop currents i (a loop runs out on the track above a film and back on the track below) obey
v' = A v - R i, i' = -Y v - A^T i. A is 0 on every real line; its derivative is what a moving patch needs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import OutOfRange

Matrix = NDArray[np.complex128]  # (..., n, n)

_SMALL = 0.25  # of R Y l^2, up to which the series below serves
_LITTLE = 0.5  # of a voltage
_TERMS = 17  # of exp(N l) with |N l| up to 0.5: the next is below 1e-19 of the first


class Line(NamedTuple):
    """What a length of line is made of, per length, and how these matrices move in one direction of interest."""

    series: Matrix  # R [ohm/m]
    shunt: Matrix  # Y [S/m]
    by_series: Matrix | float = 0.0
    by_shunt: Matrix | float = 0.0
    by_tilt: Matrix | float = 0.0  # A [1/m]


class Piece(NamedTuple):
    """A length as seen from its ends.

    Attributes
    ----------
    opened : array
        Admittance at the near end, the far end open [S].
    shorted : array
        Impedance at the far end, the near end shorted [ohm].
    passed, lost : array
        S, the voltage that arrives at an open far end, and 1 - S [-]: each keeps its digits where it is small.
    """

    opened: Matrix
    shorted: Matrix
    passed: Matrix
    lost: Matrix


class Moving(NamedTuple):
    """A piece and its derivative."""

    piece: Piece
    by: Piece


def piece(line: Line, length_m: NDArray[np.float64]) -> Moving:
    """A length of line, by halving it until a series serves, and doubling that again.

    Parameters
    ----------
    line : Line
        Matrices (..., n, n).
    length_m : array
        Length, with two axes of 1 at its end [m].
    """
    halvings = _halvings(line, length_m)
    made = _short(line, length_m * 0.5**halvings)
    for _ in range(halvings):
        made = _doubled(made)
    return made


def _halvings(line: Line, length_m: NDArray[np.float64]) -> int:
    """How often to halve: the sum of R_kk |Y_kk| bounds every eigenvalue of R Y, whatever the units of each film."""
    rates = np.einsum("...kk,...kk->...", line.series, np.abs(line.shunt))
    size = float(np.max(rates.real * length_m[..., 0, 0] ** 2, initial=0.0))
    if not np.isfinite(size):
        raise OutOfRange("the stack's numbers are too extreme for double precision")
    return max(0, int(np.ceil(np.log2(size / _SMALL) / 2))) if size > _SMALL else 0


def _short(line: Line, length_m: NDArray[np.float64]) -> Moving:
    """A piece so short that the exponential of its equations is a few terms of its series."""
    n = line.series.shape[-1]
    generator = _generator(line.series, line.shunt, 0.0) * length_m
    moved = _generator(line.by_series, line.by_shunt, line.by_tilt, like=generator) * length_m
    power: Matrix = np.eye(2 * n, dtype=complex)
    by_power = np.zeros_like(power)
    grown, by_grown = np.zeros_like(generator), np.zeros_like(moved)
    for k in range(1, _TERMS + 1):
        power, by_power = power @ generator / k, (by_power @ generator + power @ moved) / k
        grown, by_grown = grown + power, by_grown + by_power
    return Moving(*_seen(grown, by_grown, n))


def _generator(
    series: Matrix | float, shunt: Matrix | float, tilt: Matrix | float, like: Matrix | None = None
) -> Matrix:
    """[[A, -R], [-Y, -A^T]]."""
    n = np.shape(series)[-1] if like is None else like.shape[-1] // 2
    blocks = [np.zeros((n, n), complex) + block for block in (tilt, series, shunt)]
    a, r, y = np.broadcast_arrays(*blocks)
    return np.concatenate(
        [np.concatenate([a, -r], axis=-1), np.concatenate([-y, -np.swapaxes(a, -1, -2)], axis=-1)], axis=-2
    )


def _seen(grown: Matrix, by_grown: Matrix, n: int) -> tuple[Piece, Piece]:
    """A piece from its transfer matrix exp(N l) less 1, v and i at the far end from those at the near one."""
    shunt, series, rest = grown[..., n:, :n], grown[..., :n, n:], grown[..., n:, n:]
    by_shunt, by_series, by_rest = by_grown[..., n:, :n], by_grown[..., :n, n:], by_grown[..., n:, n:]
    inverse = np.linalg.inv(np.eye(n) + rest)
    opened, shorted, passed = -inverse @ shunt, -series @ inverse, _turned(inverse)  # type: ignore[arg-type]
    by_lost = passed @ _turned(by_rest) @ passed
    found = Piece(opened, shorted, passed, passed @ _turned(rest))
    by = Piece(
        -inverse @ (by_shunt + by_rest @ opened), -(by_series + shorted @ by_rest) @ inverse, -by_lost, by_lost
    )  # fmt: skip
    return found, by


def _doubled(moving: Moving) -> Moving:
    """Two equal pieces in a row. All terms add up: nothing cancels, and nothing grows."""
    (opened, shorted, passed, lost), by = moving
    meet = Meeting(shorted, opened)
    behind, before, halfway = _turned(passed) @ meet.admittance, passed @ meet.impedance, meet.passed @ passed
    by_meet = meet.slopes(by.shorted, by.opened)
    turn_1, turn_2 = behind @ by.passed, before @ _turned(by.passed)
    lost = lost + passed @ (meet.lost + meet.passed @ lost)
    by_passed = by.passed @ halfway + passed @ (by_meet.passed @ passed + meet.passed @ by.passed)
    return Moving(
        Piece(opened + behind @ passed, shorted + before @ _turned(passed), _arriving(passed @ halfway, lost), lost),
        Piece(
            by.opened + _turned(passed) @ by_meet.opened @ passed + turn_1 + _turned(turn_1),
            by.shorted + passed @ by_meet.shorted @ _turned(passed) + turn_2 + _turned(turn_2),
            by_passed,
            -by_passed,
        ),
    )


def _arriving(product: Matrix, lost: Matrix) -> Matrix:
    """S, as a product where little arrives, and as 1 less what is lost where much does: a product's errors double."""
    largest = np.abs(np.einsum("...kk->...k", product)).max(axis=-1)[..., None, None]
    return np.where(largest < _LITTLE, product, np.eye(lost.shape[-1]) - lost)


def ahead(moving: Moving, admittance: Matrix, by: Matrix) -> tuple[Matrix, Matrix]:
    """Admittance before a piece, and its derivative, from those behind it [S]."""
    (opened, shorted, passed, _), by_piece = moving
    meet = Meeting(shorted, admittance)
    turn = _turned(passed) @ meet.admittance @ by_piece.passed
    by_meet = meet.slopes(by_piece.shorted, by).opened
    return (
        opened + _turned(passed) @ meet.admittance @ passed,
        by_piece.opened + _turned(passed) @ by_meet @ passed + turn + _turned(turn),
    )


class Meeting:
    """Where a piece with the impedance X behind it meets an admittance W: what v before it makes of v, i after."""

    def __init__(self, impedance: Matrix, admittance: Matrix) -> None:
        """Solve with scaled unknowns, so that films of very different admittance keep their digits."""
        n = admittance.shape[-1]
        size = np.abs(np.einsum("...kk->...k", admittance))
        scale = np.exp2(np.rint(np.log2(np.where(size > 0, size, 1.0)) / 2))
        across = scale[..., :, None] / scale[..., None, :]
        inverse = np.linalg.inv(np.eye(n) + across * (impedance @ admittance))
        self.passed: Matrix = inverse / across  # type: ignore[assignment]
        self.admittance: Matrix = admittance @ self.passed
        self.impedance: Matrix = self.passed @ impedance
        self.lost: Matrix = self.impedance @ admittance  # 1 - passed

    def slopes(self, by_impedance: Matrix, by_admittance: Matrix) -> Piece:
        """Derivatives of ``admittance``, ``impedance``, ``passed`` and ``lost`` by X and W."""
        inward = by_admittance @ self.passed
        outward = self.passed @ by_impedance
        by_lost = outward @ self.admittance + self.impedance @ inward
        return Piece(
            _turned(self.passed) @ inward - self.admittance @ by_impedance @ self.admittance,
            outward @ _turned(self.passed) - self.impedance @ by_admittance @ self.impedance,
            -by_lost,
            by_lost,
        )


def _turned(matrix: Matrix) -> Matrix:
    return np.swapaxes(matrix, -1, -2)
