"""Exact derivatives of the pressed line by the chain rule along its sections, each computed only on demand."""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import HIGHEST_OHM, NAMES, Inputs
from sensorgen.solvers.line.tanhc import sech_squared, tanhc, tanhc_slope

Array = Any  # of numpy, or one of its scalars

BY = tuple(name for name in NAMES if name != "eps0_f_per_m")
OF_PATCH = {"force_n", "modulus_pa", "tip_m"}  # through the strain, which needs an area and a modulus


def impedance_and_slopes(names: tuple[str, ...], inputs: Inputs) -> list[Array]:
    """Z [ohm] and its derivatives by some inputs."""
    with np.errstate(all="ignore"):
        pressed = _Pressed(inputs)
        found = [pressed.z, *(pressed.slope(name) for name in names)]
        if abs(pressed.z.sum()) < HIGHEST_OHM and all(np.isfinite(value.sum()) for value in found):
            return found
    raise OutOfRange("no derivative where Z is infinite or beyond double precision")


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


class _Pressed(Chain):
    """The sections left of the patch, under it and right of it, and how each input changes them."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs, self.strain = inputs, inputs.strain()
        self.turned, self.susceptance = inputs["tan_delta"] + 1j, inputs.susceptance()
        r, y, lengths = inputs.sections()
        self.r, self.y = r[0], y[0]
        super().__init__(r, y, lengths, inputs.load_ohm)

    def __getitem__(self, name: str) -> Array:
        return self.inputs[name]

    def slope(self, name: str) -> Array:
        """Derivative of Z by an input."""
        parts = [*self._by_lengths(name)]
        if name in _CHANGES:
            away, pressed = _CHANGES[name](self)
            for index, change in enumerate((away, pressed, away)):
                parts += self.by_matter(index, *change)
        return np.asarray(sum(parts), np.complex128)

    def _by_lengths(self, name: str) -> Iterator[Array]:
        """Effect of the sections' lengths, or of a move of the patch."""
        if name == "left_m":
            of_r, of_y = self._raised()
            yield self.by_shift(1, np.asarray(self.r * of_y - of_r * self.y))  # r0 y_p - r_p y0
        if name == "tip_m":
            by_shunt, by_series = self.shunt_and_series(*self._raised())
            yield self.gain(2) * (by_shunt - by_series * self.sections[1].q ** 2)
        if name == "length_m":
            yield self.by_length(2)

    def _raised(self) -> tuple[Array, Array]:
        """Additions of pressing to r [ohm/m] and y [S/m], exactly 0 without force."""
        denser = self.strain / (1 - self.strain)
        return self.inputs.track_change(), self.turned * (self.susceptance * denser)

    def thinned(self, value: Array) -> Array:
        """Under the patch, in proportion to 1/d."""
        return value / (1 - self.strain)

    def by_strain(self) -> Array:
        """Derivative of the admittance under the patch by strain [S/m]."""
        return self.turned * (self.susceptance / (1 - self.strain) ** 2)


_Change = tuple[Array, Array]  # derivative of resistance [ohm/m] and admittance [S/m] per length by an input
_Changes = tuple[_Change, _Change]  # away from the patch, and under it


def _of_film(of_susceptance: Callable[[_Pressed], Array], p: _Pressed) -> _Changes:
    """By an input that enters the susceptance only."""
    change = of_susceptance(p)
    return (0.0, p.turned * change), (0.0, p.turned * p.thinned(change))


def _by_width(p: _Pressed) -> _Changes:
    away, pressed = p.inputs.tracks()
    wider = p.susceptance / p["width_m"]
    film = p.turned * p.thinned(wider) - p.by_strain() * (p.strain / p["width_m"])
    return (-away / p["width_m"], p.turned * wider), (-pressed / p["width_m"], film)


def _by_stiffness(name: str, p: _Pressed) -> _Changes:
    """By modulus or length of the patch: both lower the strain."""
    return (0.0, 0.0), (0.0, -p.by_strain() * (p.strain / p[name]))


def _by_force(p: _Pressed) -> _Changes:
    touches_at = p["width_m"] * p["tip_m"] * p["modulus_pa"]
    return (0.0, 0.0), (p.inputs.track_change_per_newton(), p.by_strain() / touches_at)


def _by_resistivity(end: str, p: _Pressed) -> _Changes:
    section = p.inputs.section(end)
    return (1 / section, 0.0), ((1 + p[f"{end}_piezoresistance_per_n"] * p["force_n"]) / section, 0.0)


def _by_thickness(end: str, p: _Pressed) -> _Changes:
    away, pressed = _by_resistivity(end, p)
    thinner = -p[f"{end}_resistivity_ohm_m"] / p[f"{end}_thickness_m"]
    return (thinner * away[0], 0.0), (thinner * pressed[0], 0.0)


def _by_piezoresistance(end: str, p: _Pressed) -> _Changes:
    return (0.0, 0.0), (p[f"{end}_resistivity_ohm_m"] * p["force_n"] / p.inputs.section(end), 0.0)


_CHANGES: dict[str, Callable[[_Pressed], _Changes]] = {
    "width_m": _by_width,
    "film_m": partial(_of_film, lambda p: -p.susceptance / p["film_m"]),
    "eps_r": partial(_of_film, lambda p: p.susceptance / p["eps_r"]),
    "frequency_hz": partial(_of_film, lambda p: p.inputs.susceptance_per_hertz()),
    "tan_delta": lambda p: ((0.0, p.susceptance), (0.0, p.thinned(p.susceptance))),
    "leak_s_per_m": lambda _: ((0.0, 1.0), (0.0, 1.0)),
    "modulus_pa": partial(_by_stiffness, "modulus_pa"),
    "tip_m": partial(_by_stiffness, "tip_m"),
    "force_n": _by_force,
    **{f"{end}_resistivity_ohm_m": partial(_by_resistivity, end) for end in ("top", "bottom")},
    **{f"{end}_thickness_m": partial(_by_thickness, end) for end in ("top", "bottom")},
    **{f"{end}_piezoresistance_per_n": partial(_by_piezoresistance, end) for end in ("top", "bottom")},
}
