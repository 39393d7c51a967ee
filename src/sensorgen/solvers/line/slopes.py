"""Exact derivatives of a line by the chain rule along its sections, each computed only on demand."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from sensorgen.solvers.line.tanhc import sech_squared, tanhc, tanhc_slope

Array = Any  # of numpy, or one of its scalars


class _Section:
    """One step of the recursion, q -> (q + a) / (1 + b q), a = u l T, b = v l T, and how it passes changes on."""

    def __init__(self, q: Array, u: Array, v: Array, length: Array) -> None:
        self.q, self.u, self.v, self.length = q, u, v, length
        self.squared = length * length * (u * v)
        self.ratio = tanhc(self.squared)
        t = length * self.ratio
        self.a, self.b = u * t, v * t
        self.below = 1 + self.b * q
        self.before = (q + self.a) / self.below

    @cached_property
    def by_behind(self) -> Array:
        """Derivative of the immittance before the section by that behind it."""
        return sech_squared(self.squared, self.ratio) / (self.below * self.below)

    @cached_property
    def _same(self) -> Array:
        """Derivative of a by u, and of b by v."""
        return self.length * (self.ratio + self.squared * self._slope)

    @cached_property
    def _cross(self) -> Array:
        """Derivative of a by v over u^2, and of b by u over v^2."""
        return self.length**3 * self._slope

    @cached_property
    def _slope(self) -> Array:
        return tanhc_slope(self.squared, self.ratio)

    @cached_property
    def by_shunt(self) -> Array:
        """Derivative by u."""
        return (self._same - self.before * self.q * (self.v * self.v * self._cross)) / self.below

    @cached_property
    def by_series(self) -> Array:
        """Derivative by v."""
        return (self.u * self.u * self._cross - self.before * self.q * self._same) / self.below

    @cached_property
    def by_length(self) -> Array:
        """Derivative by l: that of the flow, u - v q^2, is carried along by it, and before a long section cancels."""
        return (self.u - self.v * self.q * self.q) * self.by_behind

    @cached_property
    def by_shift(self) -> Array:
        """Derivative by a move towards the far end, per unit of v0 u - v u0."""
        above = self.a + self.q * (2 + self.b * self.q)
        return -self.length * self.ratio * above / (self.below * self.below)


class Chain:
    """Sections from the contacts to the far end, and how a change of each reaches the contacts."""

    def __init__(self, r: Sequence[Array], y: Sequence[Array], lengths: Sequence[Array], load: Array | None) -> None:
        self.opened = load is None
        shunt, series = self.shunt_and_series(r, y)
        q: Array = np.zeros(()) if load is None else load
        self.sections: list[_Section] = []
        for u, v, length in zip(reversed(shunt), reversed(series), reversed(lengths), strict=True):
            self.sections.insert(0, _Section(q, u, v, length))
            q = self.sections[0].before
        self.z = 1 / q if self.opened else q
        self._gains = [-self.z * self.z if self.opened else np.ones(())]

    def gain(self, index: int) -> Array:
        """Derivative of Z by the immittance before a section."""
        while len(self._gains) <= index:
            self._gains.append(self._gains[-1] * self.sections[len(self._gains) - 1].by_behind)
        return self._gains[index]

    def shunt_and_series(self, of_r: Array, of_y: Array) -> tuple[Array, Array]:
        """Pair u, v of the recursion: admittance is marched from an open end, impedance from any other."""
        return (of_y, of_r) if self.opened else (of_r, of_y)

    def by_matter(self, index: int, by_r: Array | float, by_y: Array | float) -> Iterator[Array]:
        """Effect of a change of resistance and admittance per length of a section."""
        by_shunt, by_series = self.shunt_and_series(by_r, by_y)
        if np.ndim(by_shunt) or by_shunt:
            yield self.gain(index) * self.sections[index].by_shunt * by_shunt
        if np.ndim(by_series) or by_series:
            yield self.gain(index) * self.sections[index].by_series * by_series

    def by_length(self, index: int) -> Array:
        """Effect of a longer section."""
        return self.gain(index) * self.sections[index].by_length

    def by_shift(self, index: int, contrast: Array) -> Array:
        """Effect of a move of a section towards the far end, within a line that it differs from by r0 y - r y0."""
        return self.gain(index) * self.sections[index].by_shift * (contrast if self.opened else -contrast)
