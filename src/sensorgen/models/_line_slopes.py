"""Exact derivatives of the pressed line, passed on from section to section."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import MissingValue, OutOfRange, UnknownName
from sensorgen.models._line_inputs import DEFAULTS, Complex, Inputs, in_blocks, read
from sensorgen.models._tanhc import tanhc, tanhc_slope

Array = NDArray[Any]

BY = tuple(name for name in DEFAULTS if name != "eps0_F_per_m")
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


class _Local(NamedTuple):
    """How an input moves resistance [ohm/m] and admittance [S/m] away from the patch and under it, per unit."""

    r: Array | float = 0.0
    r_pressed: Array | float = 0.0
    y: Array | float = 0.0
    y_pressed: Array | float = 0.0


class _Section(NamedTuple):
    """Derivatives of the immittance before a section, by what is behind and in it."""

    before: Array
    by_behind: Array
    by_shunt: Array
    by_series: Array
    by_length: Array
    by_shift: Array  # per unit of v0 u - v u0, when the section moves on by its length's unit


def _section(q: Array, u: Array, v: Array, length: Array) -> _Section:
    """One step of the recursion q -> (q + a) / (1 + b q), a = u l T, b = v l T, and its derivatives."""
    squared = u * v * length * length
    ratio = tanhc(squared)
    slope = tanhc_slope(squared, ratio)
    same = length * (ratio + squared * slope)  # da/du = db/dv
    cross = length**3 * slope  # da/dv = u^2 of it, db/du = v^2 of it
    a, b = u * length * ratio, v * length * ratio
    below = 1 + b * q
    before = (q + a) / below
    return _Section(
        before=before,
        by_behind=_sech_squared(np.sqrt(squared)) / below**2,
        by_shunt=(same - before * q * v**2 * cross) / below,
        by_series=(u**2 * cross - before * q * same) / below,
        by_length=u - v * before**2,
        by_shift=-length * ratio * (a + 2 * q + b * q**2) / below**2,
    )


def _sech_squared(z: Array) -> Array:
    """1 - tanh(z)^2 without cancellation, for a real part of 0 or more."""
    decay = np.exp(-2 * z)
    return np.asarray(4 * decay / (1 + decay) ** 2)


def _block(inputs: Inputs, names: tuple[str, ...]) -> list[Array]:
    with np.errstate(all="ignore"):
        z, r, y, lengths, shift = _by_sections(inputs)
        local = _locals(inputs)
        direct = {"x_p_left_edge_m": shift, "L_p_m": lengths[1] - lengths[2], "L_m": lengths[2]}
        found = [z]
        for name in names:
            by = local.get(name, _Local())
            total = (r[0] + r[2]) * by.r + r[1] * by.r_pressed + (y[0] + y[2]) * by.y + y[1] * by.y_pressed
            found.append(total + direct.get(name, 0.0))
    if any(np.isnan(value).any() or np.isinf(value).any() for value in found):
        raise OutOfRange("no derivative where Z is infinite or beyond double precision")
    return found


def _by_sections(inputs: Inputs) -> tuple[Array, list[Array], list[Array], list[Array], Array]:
    """Z, and dZ by r, y and length of each section, and by the position of the patch."""
    r, y, lengths = inputs.sections()
    opened = inputs.load_ohm is None
    shunt, series = (y, r) if opened else (r, y)
    q = np.asarray(0.0 if inputs.load_ohm is None else inputs.load_ohm)
    steps: list[_Section] = []
    for u, v, length in zip(reversed(shunt), reversed(series), reversed(lengths), strict=True):
        steps.append(_section(q, u, v, length))
        q = steps[-1].before
    z = 1 / q if opened else q
    gain = -z * z if opened else np.asarray(1.0)
    right, patch, left = steps
    gains = (gain, gain * left.by_behind, gain * left.by_behind * patch.by_behind)
    ordered = (left, patch, right)
    by_u, by_v, by_l = (
        [g * getattr(step, name) for g, step in zip(gains, ordered, strict=True)]
        for name in ("by_shunt", "by_series", "by_length")
    )
    shift = gains[1] * patch.by_shift * _contrast(inputs, opened)
    return z, *((by_v, by_u) if opened else (by_u, by_v)), by_l, shift


def _contrast(inputs: Inputs, opened: bool) -> Array:
    """r0 y_p - r_p y0 [1/m2], from the changes themselves so that it is exactly 0 where nothing is pressed."""
    r, y, _ = inputs.sections()
    strain = inputs.strain()
    risen = (inputs["tan_delta"] + 1j) * inputs.susceptance() * (strain / (1 - strain))
    found = r[0] * risen - inputs.track_change() * y[0]
    return np.asarray(found if opened else -found)


def _locals(p: Inputs) -> dict[str, _Local]:
    """How each input moves the sections' resistance and admittance."""
    (r, r_pressed), strain, turned = p.tracks(), p.strain(), p["tan_delta"] + 1j
    omega_c, omega_c_pressed = p.susceptance(), p.susceptance() / (1 - strain)
    y, y_pressed = turned * omega_c, turned * omega_c_pressed
    by_strain = y_pressed / (1 - strain)
    per_hertz = 2 * np.pi * p["eps0_F_per_m"] * p["eps_r"] * p["W_m"] / p["d_m"] * turned
    area_modulus = p["W_m"] * p["L_p_m"] * p["E_Pa"]
    known = {
        "W_m": _Local(-r / p["W_m"], -r_pressed / p["W_m"], y / p["W_m"], (y_pressed - by_strain * strain) / p["W_m"]),
        "d_m": _Local(y=-y / p["d_m"], y_pressed=-y_pressed / p["d_m"]),
        "eps_r": _Local(y=y / p["eps_r"], y_pressed=y_pressed / p["eps_r"]),
        "f_Hz": _Local(y=per_hertz, y_pressed=per_hertz / (1 - strain)),
        "tan_delta": _Local(y=omega_c, y_pressed=omega_c_pressed),
        "G_S_per_m": _Local(y=1.0, y_pressed=1.0),
        "E_Pa": _Local(y_pressed=-by_strain * strain / p["E_Pa"]),
        "L_p_m": _Local(y_pressed=-by_strain * strain / p["L_p_m"]),
        "F_N": _Local(r_pressed=p.track_change_per_newton(), y_pressed=by_strain / area_modulus),
    }
    for end in ("top", "bottom"):
        known |= _locals_of_track(p, end)
    return known


def _locals_of_track(p: Inputs, end: str) -> dict[str, _Local]:
    section, rho, force = p[f"H_{end}_m"] * p["W_m"], p[f"rho_{end}_ohm_m"], p["F_N"]
    factor = 1 + p[f"S_n_{end}_per_N"] * force
    thinner = -rho / (section * p[f"H_{end}_m"])
    return {
        f"rho_{end}_ohm_m": _Local(1 / section, factor / section),
        f"H_{end}_m": _Local(thinner, thinner * factor),
        f"S_n_{end}_per_N": _Local(r_pressed=rho * force / section),
    }
