"""Exact derivatives of the pressed line, passed on from section to section; each is worked out only when asked for."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from sensorgen.core.errors import MissingValue, OutOfRange, UnknownName
from sensorgen.solvers.line.inputs import HIGHEST_OHM, NAMES, Complex, Inputs, in_blocks, read
from sensorgen.solvers.line.tanhc import sech_squared, tanhc, tanhc_slope

Array = Any  # of numpy, or one of its scalars

BY = tuple(name for name in NAMES if name != "eps0_F_per_m")
_OF_PATCH = {"F_N", "E_Pa", "L_p_m"}  # through the strain, which needs an area and a modulus


def slopes(of: Iterable[str] | None, given: Mapping[str, Any]) -> tuple[Complex, dict[str, Complex]]:
    """Z [ohm] and its derivatives; see :func:`sensorgen.models.line.sensitivities`."""
    names = tuple(BY if of is None else of)
    for name in names:
        if name not in BY:
            raise UnknownName("input to differentiate by", name, BY)
    if _OF_PATCH & set(names) and "E_Pa" not in given:
        raise MissingValue("a derivative by force or patch needs E_Pa")
    found = read(given)
    if _OF_PATCH & set(names) and not found["L_p_m"].all():
        raise OutOfRange("a derivative by force or patch needs a patch: L_p_m above 0")
    first, *rest = in_blocks(found, lambda part: _block(part, names), 1 + len(names))
    return first, dict(zip(names, rest, strict=True))


def _block(inputs: Inputs, names: tuple[str, ...]) -> list[Array]:
    with np.errstate(all="ignore"):
        seen = _Line(inputs)
        found = [seen.z, *(seen.slope(name) for name in names)]
        if abs(seen.z.sum()) < HIGHEST_OHM and all(np.isfinite(value.sum()) for value in found):
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
        """What the recursion takes for u and v: admittance is marched from an open end, impedance from any other."""
        return (of_y, of_r) if self.opened else (of_r, of_y)

    def by_matter(self, index: int, by_r: Array | float, by_y: Array | float) -> Iterator[Array]:
        """What a change of resistance and admittance per length of a section does."""
        by_shunt, by_series = self.shunt_and_series(by_r, by_y)
        if np.ndim(by_shunt) or by_shunt:
            yield self.gain(index) * self.sections[index].by_shunt * by_shunt
        if np.ndim(by_series) or by_series:
            yield self.gain(index) * self.sections[index].by_series * by_series

    def by_length(self, index: int) -> Array:
        """What a longer section does."""
        return self.gain(index) * self.sections[index].by_length

    def by_shift(self, index: int, contrast: Array) -> Array:
        """What a move of a section towards the far end does, within a line that it differs from by r0 y - r y0."""
        return self.gain(index) * self.sections[index].by_shift * (contrast if self.opened else -contrast)


class _Line(Chain):
    """The sections left of the patch, under it and right of it, as seen from the contacts."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        r, y, lengths = inputs.sections()
        self._r, self._y = r[0], y[0]
        super().__init__(r, y, lengths, inputs.load_ohm)

    def slope(self, name: str) -> Array:
        """Derivative of Z by an input."""
        parts = [*self._by_place(name), *self._by_inputs(name)]
        return np.asarray(sum(parts), np.complex128)

    def _by_place(self, name: str) -> Iterator[Array]:
        """What a change of the sections' lengths, or a move of the patch, does."""
        if name == "x_p_left_edge_m":
            yield self.by_shift(1, self._contrast())
        if name == "L_p_m":
            by_shunt, by_series = self.shunt_and_series(*self._raised())
            yield self.gain(2) * (by_shunt - by_series * self.sections[1].q ** 2)
        if name == "L_m":
            yield self.by_length(2)

    def _by_inputs(self, name: str) -> Iterator[Array]:
        """What a change of resistance and admittance per length does."""
        if name not in _CHANGES:
            return
        away, pressed = _CHANGES[name](_Film(self.inputs))
        for index, change in enumerate((away, pressed, away)):
            yield from self.by_matter(index, *change)

    def _contrast(self) -> Array:
        """r0 y_p - r_p y0 [1/m2]."""
        of_r, of_y = self._raised()
        return np.asarray(self._r * of_y - of_r * self._y)

    def _raised(self) -> tuple[Array, Array]:
        """What pressing adds to r [ohm/m] and y [S/m], exactly 0 where nothing is pressed."""
        p = self.inputs
        strain = p.strain()
        return p.track_change(), (p["tan_delta"] + 1j) * (p.susceptance() * (strain / (1 - strain)))


class _Film:
    """What several derivatives share: the film's loss and its admittance, away from the patch and under it."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs, self.strain = inputs, inputs.strain()
        self.turned = inputs["tan_delta"] + 1j
        self.susceptance = inputs.susceptance()

    def __getitem__(self, name: str) -> Array:
        return self.inputs[name]

    def thinned(self, value: Array) -> Array:
        """Under the patch, in proportion to 1/d."""
        return value / (1 - self.strain)

    def by_strain(self) -> Array:
        """Derivative of the admittance under the patch by strain [S/m]."""
        return self.turned * (self.susceptance / (1 - self.strain) ** 2)


class _Change(NamedTuple):
    """Derivative of resistance [ohm/m] and admittance [S/m] per length by an input."""

    of_r: Array | float = 0.0
    of_y: Array | float = 0.0


Changes = tuple[_Change, _Change]  # away from the patch, and under it


def _of_film(p: _Film, of_susceptance: Array) -> Changes:
    """Of what enters the susceptance only."""
    return _Change(of_y=p.turned * of_susceptance), _Change(of_y=p.turned * p.thinned(of_susceptance))


def _by_width(p: _Film) -> Changes:
    away, pressed = p.inputs.tracks()
    wider = p.susceptance / p["W_m"]
    film = p.turned * p.thinned(wider) - p.by_strain() * (p.strain / p["W_m"])
    return _Change(-away / p["W_m"], p.turned * wider), _Change(-pressed / p["W_m"], film)


def _by_tan_delta(p: _Film) -> Changes:
    return _Change(of_y=p.susceptance), _Change(of_y=p.thinned(p.susceptance))


def _by_leak(_: _Film) -> Changes:
    return _Change(of_y=1.0), _Change(of_y=1.0)


def _by_stiffness(name: str, p: _Film) -> Changes:
    """By modulus or length of the patch: both make it yield less."""
    return _Change(), _Change(of_y=-p.by_strain() * (p.strain / p[name]))


def _by_force(p: _Film) -> Changes:
    yields_at = p["W_m"] * p["L_p_m"] * p["E_Pa"]
    return _Change(), _Change(p.inputs.track_change_per_newton(), p.by_strain() / yields_at)


def _by_resistivity(end: str, p: _Film) -> Changes:
    section = p[f"H_{end}_m"] * p["W_m"]
    return _Change(1 / section), _Change((1 + p[f"S_n_{end}_per_N"] * p["F_N"]) / section)


def _by_height(end: str, p: _Film) -> Changes:
    away, pressed = _by_resistivity(end, p)
    thinner = -p[f"rho_{end}_ohm_m"] / p[f"H_{end}_m"]
    return _Change(thinner * away.of_r), _Change(thinner * pressed.of_r)


def _by_softening(end: str, p: _Film) -> Changes:
    return _Change(), _Change(p[f"rho_{end}_ohm_m"] * p["F_N"] / (p[f"H_{end}_m"] * p["W_m"]))


_CHANGES: dict[str, Callable[[_Film], Changes]] = {
    "W_m": _by_width,
    "d_m": lambda p: _of_film(p, -p.susceptance / p["d_m"]),
    "eps_r": lambda p: _of_film(p, p.susceptance / p["eps_r"]),
    "f_Hz": lambda p: _of_film(p, p.inputs.susceptance_per_hertz()),
    "tan_delta": _by_tan_delta,
    "G_S_per_m": _by_leak,
    "E_Pa": partial(_by_stiffness, "E_Pa"),
    "L_p_m": partial(_by_stiffness, "L_p_m"),
    "F_N": _by_force,
    **{f"rho_{end}_ohm_m": partial(_by_resistivity, end) for end in ("top", "bottom")},
    **{f"H_{end}_m": partial(_by_height, end) for end in ("top", "bottom")},
    **{f"S_n_{end}_per_N": partial(_by_softening, end) for end in ("top", "bottom")},
}
