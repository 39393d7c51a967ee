"""Triangles of which those at singular corners stand for rings, and what of them both problems share."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensorgen.solvers.electrostatics.cuts import Flow, flow
from sensorgen.solvers.electrostatics.fans import Fan, fans
from sensorgen.solvers.electrostatics.fronts import Numbers, Whole
from sensorgen.solvers.electrostatics.triangles import Triangles


@dataclass(frozen=True)
class Cones:
    """Triangles of which those at singular corners stand for rings without end.

    Attributes
    ----------
    triangles : Triangles
        Each corner has one fan.
    doublings : dict of int to int
        Of singular corners: logarithm of the number of their rings.
    """

    triangles: Triangles
    doublings: Mapping[int, int]

    @cached_property
    def corners(self) -> Whole:
        """Of all triangles (n, 3)."""
        return np.array(self.triangles.triangles)

    @cached_property
    def fans(self) -> dict[int, Fan]:
        """Triangles at each singular corner."""
        return {c: found[0] for c, found in fans(self.triangles.triangles).items() if c in self.doublings}

    @cached_property
    def plain(self) -> Whole:
        """Numbers of the triangles that are no tips."""
        is_plain = np.ones(len(self.corners), bool)
        is_plain[[n for fan in self.fans.values() for n in fan.members]] = False
        return np.flatnonzero(is_plain)

    @cached_property
    def sides(self) -> tuple[Whole, Whole]:
        """Distinct sides of the plain triangles (:meth:`names`), and which of them each of these has (k, 3)."""
        corners = self.corners[self.plain]
        found, at = np.unique(self.names(corners, np.roll(corners, -1, axis=1)), return_inverse=True)
        return found, at.reshape(corners.shape)

    @cached_property
    def flow(self) -> Flow:
        """The boundary as a flux sees it."""
        return flow(self.triangles, self.fans)

    def names(self, a: Whole, b: Whole) -> Whole:
        """One number for each side, by its ends."""
        return np.minimum(a, b) * len(self.triangles.points) + np.maximum(a, b)

    def areas(self) -> Numbers:
        """Of all triangles, twice; 0 or less where doubles tell no triangle [mm2]."""
        a, b, c = self.triangles.points[self.corners].transpose(1, 2, 0)
        return np.asarray((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])

    def thinness(self) -> Numbers:
        """How many times the share by which its corners' coordinates are off each triangle's area is [-].

        A micrometre of height, a metre up or along a slope that is a metre long, makes it a million.
        """
        corners = self.triangles.points[self.corners]
        farthest, along = abs(corners).max(axis=1), np.ptp(corners, axis=1)
        return np.asarray((farthest * along[:, ::-1]).sum(axis=1) / self.areas())

    def elements(self) -> int:
        """Triangles, those in rings each for itself."""
        in_rings = [len(fan.members) * (1 + (2 << self.doublings[c])) for c, fan in self.fans.items()]
        return len(self.plain) + sum(in_rings)
