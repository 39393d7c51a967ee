"""Forward model of one sensor at fixed frequencies, as a table in which responses are looked up.

In the table everything is scaled: force by its limit, position by the sensor's length, so that a press is a point of
the unit square. The table only has to lead to the solution; the exact model has the last word.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.models import refusal
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.inference import Index, parts

FORCE_LIMIT_N = 13.0  # the rig's largest force, thesis chapter 6
_HALVINGS = 40


def log_impedance(sensor: Sensor, frequency_hz: Real, force_n: Real, position_m: Real) -> Complex:
    """Natural logarithm of Z/ohm for one press per row, (n, n_tones); errors as :meth:`Sensor.impedance`."""
    return np.log(sensor.impedance(frequency_hz, force_n[:, None], position_m[:, None]))


def bearable_n(sensor: Sensor, most_n: float = FORCE_LIMIT_N) -> float:
    """The largest force up to ``most_n`` that a sensor bears anywhere, the tip half over its end [N].

    Raises
    ------
    OutOfRange
        A tip whose pressure is not uniform; a force that is not above 0.
    """
    if sensor.profile != UNIFORM:
        raise OutOfRange(f"a tip of profile {sensor.profile!r}: only uniform pressure can be inverted")
    if not 0 < most_n < np.inf:
        raise OutOfRange(f"a force limit of {most_n:g} N; expected a number above 0")
    ends = np.array([0.0, sensor.length_m])

    def bears(force_n: float) -> bool:
        return refusal(OutOfRange, sensor.check_press, force_n, ends) is None

    low, high = 0.0, most_n
    if bears(high):
        return high
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if bears(middle) else (low, middle)
    return low * (1 - 1e-6)


def tones(frequency_hz: ArrayLike) -> Real:
    """Frequencies as an array, checked.

    Raises
    ------
    BadInput, OutOfRange
        No list of numbers; none at all, one that is not above 0 and finite, or two that are equal.
    """
    try:
        hz = np.atleast_1d(np.asarray(frequency_hz, np.float64))
    except (TypeError, ValueError):
        raise BadInput(f"frequencies are numbers in Hz, not {str(frequency_hz)[:60]!r}") from None
    if hz.ndim != 1 or not hz.size:
        raise BadInput(f"expected a list of frequencies in Hz, not an array of shape {hz.shape}")
    bad = ~((hz > 0) & (hz < np.inf))
    if bad.any():
        raise OutOfRange(f"a frequency of {hz[bad][0]:g} Hz; expected a number above 0")
    if len(np.unique(hz)) < len(hz):
        raise OutOfRange("the same frequency twice: give each once")
    return hz


FORCE_CELLS = 24
POSITION_CELLS = 40  # where the whole tip is on the sensor
END_CELLS = 3  # where it overhangs, at each end
_BEND = 1.5  # force cells grow by this power: a soft cell stiffens, so the response bends most at small forces
_DEGREE = 4
_ORDERS = np.arange(_DEGREE)
_TO_POWERS = np.linalg.inv((np.arange(_DEGREE) / (_DEGREE - 1))[:, None] ** _ORDERS)

_FIRST_ORDER = [2, 1]  # by force, by position; the others are the value and the mixed derivative
_TINY = np.float32(1e-30)
_SMALL_PRODUCT = 1 << 18  # multiplications up to which BLAS keeps to one thread: more only wait for each other here
_LOT = 32  # cells compared with all others at once: their distances stay in a core's cache


class Local(NamedTuple):
    """A response and its derivatives by scaled force and position: real and imaginary parts of ln Z, one after one."""

    value: Real
    """(n, 2 n_tones)."""
    slope: Real
    """(n, 2, 2 n_tones)."""


class ResponseTable:
    """Responses of one sensor over the unit square.

    Parameters
    ----------
    sensor : Sensor
        The exact model.
    frequency_hz : (n_tones,) array
        Frequencies [Hz].
    most_n : float
        Force that the square's edge stands for [N].
    """

    def __init__(self, sensor: Sensor, frequency_hz: Real, most_n: float) -> None:
        self.scale = np.array([most_n, sensor.length_m])
        self.edges = _edges(sensor)
        force, position = (_thirds(edges) * scale for edges, scale in zip(self.edges, self.scale, strict=True))
        values = parts(log_impedance(sensor, frequency_hz, *pairs(force, position)))
        self.coefficients = _cubics(values.reshape(len(force), len(position), -1))
        self.shape = len(self.edges[0]) - 1, len(self.edges[1]) - 1
        forces, positions = ((edges[1:] + edges[:-1]) / 2 for edges in self.edges)
        self.middles = np.column_stack(pairs(forces, positions))
        self._seeds = np.column_stack(pairs(self.edges[0][1::2], positions))
        local, reach = self.at(self._seeds), np.repeat(np.diff(self.edges[0][::2]), len(positions))
        self._origin = local.value.mean(0)
        off, along = (local.value - self._origin).T, local.slope[:, 0].T
        least = np.maximum(-reach, -self._seeds[:, 0])  # no force below 0, or it would explain presses elsewhere
        filters = (2 * off, along, off * off, off * along, along * along, least, reach)
        self._filters = [np.ascontiguousarray(of, np.float32) for of in filters]

    def at(self, press: Real) -> Local:
        """Interpolated response at scaled presses (n, 2)."""
        n, powers, (force, position) = len(press), [], self._cells(press)
        for edges, k, at in zip(self.edges, (force, position), press.T, strict=True):
            width = edges[k + 1] - edges[k]
            t, one = (at - edges[k]) / width, np.ones(n)
            slope = np.stack([0 * one, one, 2 * t, 3 * t * t]) / width
            powers.append(np.stack([[one, t, t * t, t * t * t], slope]).transpose(2, 0, 1))  # of the place in the cell
        rows = self.coefficients[force * self.shape[1] + position]
        along = (powers[0] @ rows).reshape(n, 2, _DEGREE, rows.shape[2] // _DEGREE)
        both = powers[1][:, None] @ along
        return Local(both[:, 0, 0], both.reshape(n, 4, -1)[:, _FIRST_ORDER] if n else both[:, 0])

    def nearest(self, response: Real, weight: Real) -> Real:
        """Presses near each response (n, 2): a matched filter over positions, at each with the best force.

        Parameters
        ----------
        response, weight : (n, 2 n_tones) array
            Measured ln Z, anything finite where it is missing; 1/sigma, 0 where it is missing.
        """
        match, along, squares, products, curvatures, least, most = self._filters
        square = (weight * weight).astype(np.float32)
        wanted = square * (response - self._origin).astype(np.float32)
        press, size = np.empty((len(response), 2)), max(1, _SMALL_PRODUCT // match.size)
        for rows in (slice(start, start + size) for start in range(0, len(response), size)):
            weights = square[rows][:1] if (square[rows] == square[rows][:1]).all() else square[rows]
            slope, curvature = wanted[rows] @ along - weights @ products, weights @ curvatures + _TINY
            shift = np.minimum(np.maximum(slope / curvature, least), most)
            gain = wanted[rows] @ match - weights @ squares + shift * (2 * slope - curvature * shift)
            seed = gain.argmax(1)
            press[rows] = self._seeds[seed]
            press[rows, 0] += shift[np.arange(len(seed)), seed]
        lowest = self.edges[0][1] / 2  # at no force nothing depends on the position: a search that starts there stays
        press[:, 0] = np.clip(press[:, 0], lowest, 1.0)
        return press

    def _cells(self, press: Real) -> list[Index]:
        """Numbers of the cells that presses (n, 2) are in, along either axis."""
        return [np.searchsorted(edges[1:-1], at, side="right") for edges, at in zip(self.edges, press.T, strict=True)]

    def cell(self, press: Real) -> Index:
        """Number of the cell that a press (n, 2) is in."""
        force, position = self._cells(press)
        return np.asarray(force * self.shape[1] + position)

    def rivals(self, sigma: float) -> tuple[Index, Real]:
        """For every cell, the cell of the nearest other minimum of the distance, or -1; and a lower limit of it.

        The distance, in units of noise, is the one that is left for a press anywhere in the two cells.
        """
        local = self.at(self.middles)
        scaled, slopes = (local.value - local.value.mean(axis=0)) / sigma, local.slope[:, 0] / sigma
        reach = np.repeat(np.diff(self.edges[0]), self.shape[1]) / 2
        squares, curvature, level = ((a * b).sum(axis=1) for a, b in ((scaled,) * 2, (slopes,) * 2, (scaled, slopes)))
        row, column = np.divmod(np.arange(len(scaled)), self.shape[1])
        rival, gap, spacing = np.full(len(scaled), -1), np.full(len(scaled), np.inf), np.zeros(len(scaled))
        for start in range(0, len(scaled), _LOT):
            lot = slice(start, start + _LOT)
            along = scaled[lot] @ slopes.T - level
            shift = np.clip(along / curvature, -reach, reach)
            square = squares[lot, None] + squares - 2 * scaled[lot] @ scaled.T - shift * (2 * along - curvature * shift)
            distance = np.sqrt(np.maximum(square, 0.0))
            lowest = _minima(distance.reshape(-1, *self.shape)).reshape(distance.shape)
            rows, columns = abs(row[lot, None] - row), abs(column[lot, None] - column)
            other = np.where(lowest & (np.maximum(rows, columns) > 1), distance, np.inf)
            rival[lot], gap[lot] = other.argmin(axis=1), other.min(axis=1)
            spacing[lot] = np.where((rows == 0) & (columns == 1), distance, 0.0).max(axis=1)
        rival[gap == np.inf] = -1
        return rival, gap - (spacing + spacing[rival]) / 2


def _edges(sensor: Sensor) -> tuple[Real, Real]:
    """Borders of the cells in the unit square; the ends, where the tip overhangs, have cells of their own."""
    half = min(sensor.tip_m / sensor.length_m / 2, 0.5)
    parts = [
        np.linspace(0, half, END_CELLS + 1),
        np.linspace(half, 1 - half, POSITION_CELLS + 1),
        np.linspace(1 - half, 1, END_CELLS + 1),
    ]
    return np.linspace(0, 1, FORCE_CELLS + 1) ** _BEND, np.unique(np.concatenate(parts))


def pairs(force: Real, position: Real) -> tuple[Real, Real]:
    """Forces and positions of all points of a grid, along positions first."""
    forces, positions = np.meshgrid(force, position, indexing="ij")
    return forces.ravel(), positions.ravel()


def _thirds(edges: Real) -> Real:
    """Points at the thirds of every cell."""
    thirds = edges[:-1, None] + np.diff(edges)[:, None] * np.arange(3) / 3
    return np.append(thirds.ravel(), edges[-1])


def _cubics(values: Real) -> Real:
    """Coefficients of the cubic in both directions of every cell, (cells, 4, 4 * 2 n_tones)."""
    step = _DEGREE - 1
    forces, positions = (values.shape[0] - 1) // step, (values.shape[1] - 1) // step
    i = (np.arange(forces) * step)[:, None, None, None] + _ORDERS[:, None]
    j = (np.arange(positions) * step)[None, :, None, None] + _ORDERS
    blocks = values[i, j]
    powers = np.einsum("pi,qj,abijk->abpqk", _TO_POWERS, _TO_POWERS, blocks)
    return np.ascontiguousarray(powers.reshape(forces * positions, _DEGREE, -1))


def _minima(distance: Real) -> Mask:
    """Cells (..., rows, columns) below all their neighbours, those at the border among the ones that they have."""
    rows, columns = distance.shape[-2:]
    around = np.pad(distance, [(0, 0)] * (distance.ndim - 2) + [(1, 1)] * 2, constant_values=np.inf)
    lowest = np.ones(distance.shape, bool)
    for i, j in [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]:
        lowest &= distance < around[..., i : i + rows, j : j + columns]
    return lowest
