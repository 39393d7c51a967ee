r"""A uniform length of coupled line, as three matrices, and its exact derivatives: right for any length and loss.

Film voltages v and loop currents i (a loop runs out on the track above a film and back on the track below) obey
v' = A v - R i, i' = -Y v - A^T i. A is 0 on every real line; its derivative is what a moving patch needs.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import check_fit, passive

_SMALL = 0.25  # of R Y l^2, up to which the series below serves
_LITTLE = 0.5  # of a voltage
_TERMS = 17  # of exp(N l) with |N l| up to 0.5: the next is below 1e-19 of the first


class LineMatrices(NamedTuple):
    """Matrices of a length of line, per length, and their change in one direction of interest."""

    series: Complex  # R [ohm/m]
    shunt: Complex  # Y [S/m]
    by_series: Complex | float = 0.0
    by_shunt: Complex | float = 0.0
    by_tilt: Complex | float = 0.0  # A [1/m]


class LinePiece(NamedTuple):
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

    opened: Complex
    shorted: Complex
    passed: Complex
    lost: Complex


class Moving(NamedTuple):
    """A piece and its derivative."""

    piece: LinePiece
    by: LinePiece


def piece(line: LineMatrices, length_m: Real) -> Moving:
    """A length of line, by halving it until a series serves, and doubling that again.

    Parameters
    ----------
    line : LineMatrices
        Matrices (..., n, n).
    length_m : array
        Length, with two axes of 1 at its end [m].
    """
    # How often to halve: the sum of R_kk |Y_kk| bounds every eigenvalue of R Y, whatever the units of each film
    rates = np.einsum("...kk,...kk->...", line.series, np.abs(line.shunt))
    size = float(np.max(rates.real * length_m[..., 0, 0] ** 2, initial=0.0))
    if not np.isfinite(size):
        raise OutOfRange("the stack's numbers are too extreme for double precision")
    halvings = max(0, int(np.ceil(np.log2(size / _SMALL) / 2))) if size > _SMALL else 0
    doubled = _short(line, length_m * 0.5**halvings)
    for _ in range(halvings):
        doubled = _doubled(doubled)
    return doubled


def _short(line: LineMatrices, length_m: Real) -> Moving:
    """A piece so short that the exponential of its equations is a few terms of its series."""
    n = line.series.shape[-1]
    generator = _generator(line.series, line.shunt, 0.0) * length_m
    moved = _generator(line.by_series, line.by_shunt, line.by_tilt, like=generator) * length_m
    power: Complex = np.eye(2 * n, dtype=complex)
    by_power = np.zeros_like(power)
    grown, by_grown = np.zeros_like(generator), np.zeros_like(moved)
    for k in range(1, _TERMS + 1):
        power, by_power = power @ generator / k, (by_power @ generator + power @ moved) / k
        grown, by_grown = grown + power, by_grown + by_power
    # ``grown`` is the transfer matrix exp(N l) less 1: v and i at the far end from those at the near one.
    shunt, series, rest = grown[..., n:, :n], grown[..., :n, n:], grown[..., n:, n:]
    by_shunt, by_series, by_rest = by_grown[..., n:, :n], by_grown[..., :n, n:], by_grown[..., n:, n:]
    inverse = np.linalg.inv(np.eye(n) + rest)
    opened, shorted, passed = -inverse @ shunt, -series @ inverse, _turned(inverse)  # type: ignore[arg-type]
    by_lost = passed @ _turned(by_rest) @ passed
    short = LinePiece(opened, shorted, passed, passed @ _turned(rest))
    by = LinePiece(
        -inverse @ (by_shunt + by_rest @ opened), -(by_series + shorted @ by_rest) @ inverse, -by_lost, by_lost
    )  # fmt: skip
    return Moving(short, by)


def _generator(
    series: Complex | float, shunt: Complex | float, tilt: Complex | float, like: Complex | None = None
) -> Complex:
    """[[A, -R], [-Y, -A^T]]."""
    n = np.shape(series)[-1] if like is None else like.shape[-1] // 2
    blocks = [np.zeros((n, n), complex) + block for block in (tilt, series, shunt)]
    a, r, y = np.broadcast_arrays(*blocks)
    return np.concatenate(
        [np.concatenate([a, -r], axis=-1), np.concatenate([-y, -np.swapaxes(a, -1, -2)], axis=-1)], axis=-2
    )


def _doubled(moving: Moving) -> Moving:
    """Two equal pieces in a row. All terms add up: nothing cancels, and nothing grows."""
    (opened, shorted, passed, lost), by = moving
    meet = Meeting(shorted, opened)
    behind, before, halfway = _turned(passed) @ meet.admittance, passed @ meet.impedance, meet.passed @ passed
    by_meet = meet.slopes(by.shorted, by.opened)
    turn_1, turn_2 = behind @ by.passed, before @ _turned(by.passed)
    lost = lost + passed @ (meet.lost + meet.passed @ lost)
    by_passed = by.passed @ halfway + passed @ (by_meet.passed @ passed + meet.passed @ by.passed)
    # S is a product where little arrives, and 1 less what is lost where much does: a product's errors double.
    product = passed @ halfway
    largest = np.abs(np.einsum("...kk->...k", product)).max(axis=-1)[..., None, None]
    arriving = np.where(largest < _LITTLE, product, np.eye(lost.shape[-1]) - lost)
    return Moving(
        LinePiece(
            opened + behind @ passed,
            shorted + before @ _turned(passed),
            arriving,
            lost,
        ),
        LinePiece(
            by.opened + _turned(passed) @ by_meet.opened @ passed + turn_1 + _turned(turn_1),
            by.shorted + passed @ by_meet.shorted @ _turned(passed) + turn_2 + _turned(turn_2),
            by_passed,
            -by_passed,
        ),
    )


def ahead(moving: Moving, admittance: Complex, by: Complex) -> tuple[Complex, Complex]:
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

    def __init__(self, impedance: Complex, admittance: Complex) -> None:
        """Solve with scaled unknowns, so that films of very different admittance keep their digits."""
        n = admittance.shape[-1]
        size = np.abs(np.einsum("...kk->...k", admittance))
        scale = np.exp2(np.rint(np.log2(np.where(size > 0, size, 1.0)) / 2))
        across = scale[..., :, None] / scale[..., None, :]
        inverse = np.linalg.inv(np.eye(n) + across * (impedance @ admittance))
        self.passed: Complex = inverse / across  # type: ignore[assignment]
        self.admittance: Complex = admittance @ self.passed
        self.impedance: Complex = self.passed @ impedance
        self.lost: Complex = self.impedance @ admittance  # 1 - passed

    def slopes(self, by_impedance: Complex, by_admittance: Complex) -> LinePiece:
        """Derivatives of ``admittance``, ``impedance``, ``passed`` and ``lost`` by X and W."""
        inward = by_admittance @ self.passed
        outward = self.passed @ by_impedance
        by_lost = outward @ self.admittance + self.impedance @ inward
        return LinePiece(
            _turned(self.passed) @ inward - self.admittance @ by_impedance @ self.admittance,
            outward @ _turned(self.passed) - self.impedance @ by_admittance @ self.impedance,
            -by_lost,
            by_lost,
        )


def _turned(matrix: Complex) -> Complex:
    return np.swapaxes(matrix, -1, -2)


def march(lines: Sequence[LineMatrices], lengths: Sequence[Real]) -> tuple[Complex, Complex]:
    """Admittance at the contacts and its derivative, from the open far end; the stack may be of any sections."""
    n = lines[0].series.shape[-1]
    w = by = np.zeros((n, n), complex)
    with np.errstate(all="ignore"):
        for line, length in zip(reversed(lines), reversed(lengths), strict=True):
            w, by = ahead(piece(line, length[..., None, None]), w, by)
    if not (np.isfinite(w).all() and np.isfinite(by).all()):
        raise OutOfRange("the stack's numbers are too extreme for double precision")
    return w, by


def inverse(admittance_s: Complex) -> Complex:
    """Z = 1/W with scaled unknowns; inf + 0j where a film carries no current."""
    size = np.abs(np.einsum("...kk->...k", admittance_s))
    idle = (size == 0).any(axis=-1)[..., None, None]
    scale = np.exp2(-np.rint(np.log2(np.where(size > 0, size, 1.0)) / 2))
    both = scale[..., :, None] * scale[..., None, :]
    safe = np.where(idle, np.eye(admittance_s.shape[-1]), admittance_s * both)
    return np.where(idle, complex(np.inf, 0.0), np.linalg.inv(safe) * both)


def side_by_side(name: str, values: Sequence[ArrayLike]) -> NDArray[Any]:
    """The tracks' or films' values along a last axis."""
    columns = [passive(name, value) for value in values]
    check_fit(f"the values of {name} in a section", columns)
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def loops(r: NDArray[Any]) -> NDArray[Any]:
    """Resistance matrix of the loops: each runs through its two tracks, neighbours share one in opposite directions."""
    n = r.shape[-1] - 1
    own, shared = r[..., 1:] + r[..., :-1], r[..., 1:-1]
    matrix = np.zeros((*r.shape[:-1], n, n))
    k = np.arange(n)
    matrix[..., k, k] = own
    matrix[..., k[1:], k[:-1]] = matrix[..., k[:-1], k[1:]] = -shared
    return matrix


def diagonal(values: NDArray[Any]) -> Complex:
    """Admittance matrix of the films, which do not see each other."""
    return np.asarray(np.eye(values.shape[-1]) * values[..., None, :], complex)


def directions(deep: int, *changes: Complex | float) -> Complex:
    """The directions of interest along one axis in front of ``deep`` others."""
    stacked = np.stack(np.broadcast_arrays(*(np.asarray(change, complex) for change in changes)))
    return stacked.reshape(len(changes), *(1,) * (deep + 1 - stacked.ndim), *stacked.shape[1:])


class GroundTie(NamedTuple):
    """Tie of a body to the ground of the instrument: a resistor and a capacitor in series.

    The defaults are the human body model of ANSI/ESDA/JEDEC JS-001, 1.5 kohm and 100 pF: an assumption, made for
    discharges, that stands here for a person on an isolating floor. The resistor lies in the skin, over the touch.

    Attributes
    ----------
    resistance_ohm : float
        Of the skin under the touch [ohm], above 0.
    capacitance_f : float
        From the body to ground [F].
    """

    resistance_ohm: float = 1500.0
    capacitance_f: float = 100e-12

    def admittance_s(self, frequency_hz: ArrayLike) -> Complex:
        """Admittance from behind the skin to ground [S]."""
        return np.asarray(2j * np.pi * np.asarray(frequency_hz, float) * self.capacitance_f)


class Touch(NamedTuple):
    """Where a body lies on the top, over the whole width, and what is between.

    Attributes
    ----------
    left_m, length_m : float
        Left edge and length of the touched stretch [m].
    isolation_f_per_m : float
        Capacitance of the isolation per length [F/m], above 0; inf where the body lies on the bare electrode.
    force_n : float
        With which it presses, its stress shared by the whole touch [N].
    """

    left_m: ArrayLike
    length_m: ArrayLike
    isolation_f_per_m: float
    force_n: ArrayLike = 0.0

    def admittance_s_per_m(self, frequency_hz: ArrayLike, body: GroundTie) -> Complex:
        """Admittance from the top track through isolation and skin, where they touch [S/m]."""
        skin = body.resistance_ohm * np.asarray(self.length_m, float)
        susceptance = 2 * np.pi * np.asarray(frequency_hz, float) * self.isolation_f_per_m
        return np.asarray(1 / (skin + 1 / (1j * susceptance)) if np.isfinite(self.isolation_f_per_m) else 1 / skin + 0j)


def reading(admittance_s: Complex, across: Real, tie: Real, body_s: Complex, bridge: bool) -> Complex:
    """Reading of the instrument between driven and low track [ohm].

    Parameters
    ----------
    admittance_s : array (..., n, n)
        Of the stack and its body [S].
    across, tie : array (n,)
        The films between low and driven track, and between low track and body; -1 where they lie against it [-].
    body_s : array
        Admittance from the body to ground [S].
    bridge : bool
        Whether what flows to ground through the body goes past the ammeter.
    """
    tied = inverse(admittance_s + body_s[..., None, None] * np.outer(tie, tie))
    voltages = tied @ across
    past = body_s * (voltages @ tie) if bridge else 0.0
    return np.asarray(voltages @ across / (1 - past))


_UNRELATED = 1e-12  # of the largest: singular values below it are rounding, and their directions undetermined


def standard_errors(slopes: Complex, noise: Real) -> Real:
    r"""Smallest standard errors of an unbiased estimate, none of the quantities being known beforehand.

    .. math:: \sigma_a^2 = (F^{-1})_{aa}, \quad
              F_{ab} = \sum_k \frac{\mathrm{Re}(\overline{s_{ak}}\, s_{bk})}{\sigma_k^2}

    Parameters
    ----------
    slopes : (quantities, readings) complex array
        Derivatives of each reading [ohm per the quantity's unit].
    noise : (readings,) array
        Standard deviation of the real and of the imaginary part of each reading, independent and normal [ohm].

    Returns
    -------
    (quantities,) array
        Standard errors, in the quantities' units; inf where the readings do not determine them.

    Examples
    --------
    One real reading that rises by 2 ohm/N, with 0.1 ohm of noise:

    >>> standard_errors(np.array([[2.0 + 0j]]), np.array([0.1])).tolist()
    [0.05]
    """
    weighted = slopes / noise
    jacobian = np.concatenate([weighted.real, weighted.imag], axis=1).T
    size = np.linalg.norm(jacobian, axis=0)
    _, values, rows = np.linalg.svd(jacobian / np.where(size > 0, size, 1.0), full_matrices=False)
    told = values > _UNRELATED * values.max(initial=0.0)
    spread = np.where(told[:, None], rows / np.where(told, values, 1.0)[:, None], 0.0)
    errors = np.linalg.norm(spread, axis=0) / np.where(size > 0, size, 1.0)
    untold = np.linalg.norm(rows[~told], axis=0) > np.sqrt(_UNRELATED)
    missing = len(rows) < len(size)
    return np.where(untold | (size == 0) | missing, np.inf, errors)
