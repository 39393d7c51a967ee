"""Arcs in the plane of the bed: their middles, their lengths, what they reach, and chords for who needs lines."""

import math
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole

SAG_MM = 0.005  # how far a chord may be from its arc: a tenth of what the printer can place
MOST_CHORDS = 720
_FULL = 1e-9  # a turn below this is a full circle [rad]


@dataclass(frozen=True, eq=False)
class Arcs:
    """Moves that are arcs.

    Attributes
    ----------
    row : (n,) int64 array
        The move of each.
    start_mm, end_mm : (n, 3) float64 array
        Where each begins and ends [mm]; Z rises evenly.
    centre_mm : (n, 2) float64 array
        Middle of its circle [mm].
    turn : (n,) float64 array
        Angle that it turns, to the left positive [rad]; never 0.

    Examples
    --------
    >>> start, end = np.array([[1.0, 0, 0]]), np.array([[-1.0, 0, 0]])
    >>> half = Arcs.of(np.array([4]), start, end, np.zeros((1, 2)), np.array([False]))
    >>> [m.round(3).tolist() for m in (half.across_mm(), *half.box_mm())]
    [[3.142], [[-1.0, 0.0, 0.0]], [[1.0, 1.0, 0.0]]]
    """

    row: Whole
    start_mm: Real
    end_mm: Real
    centre_mm: Real
    turn: Real

    @classmethod
    def of(cls, row: Whole, start_mm: Real, end_mm: Real, centre_mm: Real, clockwise: Mask) -> "Arcs":
        """Arcs between two places; the same place twice means a full circle. Clockwise is as seen from above: G2."""
        first, last = (_angle(place[:, :2] - centre_mm) for place in (start_mm, end_mm))
        left = (last - first) % math.tau
        right = (first - last) % math.tau
        turn = np.where(clockwise, right, left)
        turn = np.where(turn < _FULL, math.tau, turn)
        return cls(row, start_mm, end_mm, centre_mm, np.where(clockwise, -turn, turn))

    def __len__(self) -> int:
        """Number of arcs [-]."""
        return len(self.row)

    def chosen(self, rows: Mask) -> "Arcs":
        """The arcs of a mask."""
        return Arcs(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    def radius_mm(self) -> Real:
        """Radius at the start of each [mm]."""
        off = self.start_mm[:, :2] - self.centre_mm
        return np.asarray(np.hypot(off[:, 0], off[:, 1]))

    def across_mm(self) -> Real:
        """Length of each in plan [mm]."""
        return np.asarray(self.radius_mm() * np.abs(self.turn))

    def box_mm(self) -> tuple[Real, Real]:
        """Lowest and highest place of each on every axis, (n, 3) [mm]."""
        low, high = np.minimum(self.start_mm, self.end_mm), np.maximum(self.start_mm, self.end_mm)
        first = _angle(self.start_mm[:, :2] - self.centre_mm)
        for quarter in range(4):
            way = (np.sign(self.turn) * (quarter * math.tau / 4 - first)) % math.tau
            axis, side = quarter % 2, 1 if quarter < 2 else -1
            edge = self.centre_mm[:, axis] + side * self.radius_mm()
            bound, worse = (high, np.maximum) if side > 0 else (low, np.minimum)
            bound[:, axis] = np.where(way < np.abs(self.turn), worse(bound[:, axis], edge), bound[:, axis])
        return low, high

    def chords(self) -> tuple[Whole, Real, Real]:
        """Chords of all arcs in order: which arc each belongs to, and where it starts and ends, (m, 3) [mm]."""
        sag = np.minimum(SAG_MM / (2 * np.maximum(self.radius_mm(), SAG_MM)), 0.5)
        angle = 4 * np.arcsin(np.sqrt(sag))  # acos(1 - sag / radius) would be 0 for a large one
        count = np.asarray(np.clip(np.ceil(np.abs(self.turn) / angle), 1, MOST_CHORDS), np.int64)
        which = np.repeat(np.arange(len(self)), count)
        step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        ends = []
        for share in (step / count[which], (step + 1) / count[which]):
            at = _angle(self.start_mm[:, :2] - self.centre_mm)[which] + self.turn[which] * share
            radius, (x, y) = self.radius_mm()[which], self.centre_mm[which].T
            bottom, top = self.start_mm[which, 2], self.end_mm[which, 2]
            z = bottom + (top - bottom) * share
            ends.append(np.column_stack([x + radius * np.cos(at), y + radius * np.sin(at), z]))
        ends[0][step == 0], ends[1][step == count[which] - 1] = self.start_mm, self.end_mm
        return which, ends[0], ends[1]


def _angle(off: Real) -> Real:
    return np.asarray(np.arctan2(off[:, 1], off[:, 0]))


def centres_of_radius(start: Real, end: Real, radius: Real, clockwise: Mask) -> Real:
    """Middles of arcs of given radii, (n, 2) [mm]; nan where none leads from start to end.

    Parameters
    ----------
    start, end : (n, 2) array
        Their ends [mm].
    radius : (n,) array
        Their radii [mm]; negative for the longer way round.
    clockwise : (n,) array of bool
        As seen from above: G2.
    """
    step = end - start
    chord = np.hypot(step[:, 0], step[:, 1])
    there = (chord > 0) & (chord <= 2 * np.abs(radius) * (1 + 1e-6))
    off = np.sqrt(np.maximum(0.0, radius**2 - chord**2 / 4)) / np.where(there, chord, np.nan)
    side = np.where((radius > 0) != clockwise, off, -off)[:, None]
    return np.asarray((start + end) / 2 + side * np.column_stack([-step[:, 1], step[:, 0]]))
