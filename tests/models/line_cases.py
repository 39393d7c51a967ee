"""The reference cases of the line, the thesis's plate, and the exact line with as many digits as it takes."""

import json
from pathlib import Path
from typing import Any

import mpmath

FILE = json.loads((Path(__file__).parents[1] / "reference" / "line_all.json").read_text("utf-8"))
TONES = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)
PLATE = {
    "length_m": 0.1, "width_m": 0.01, "top_thickness_m": 3e-4, "bottom_thickness_m": 3e-4,
    "top_resistivity_ohm_m": 0.07, "bottom_resistivity_ohm_m": 0.2, "film_m": 6e-4, "eps_r": 4.68, "modulus_pa": 6e6,
    "tip_m": 0.01, "force_n": 3.0, "left_m": 0.045, "frequency_hz": 99.7e3,
}  # fmt: skip


def cases() -> list[tuple[dict[str, Any], tuple[str, str]]]:
    """Inputs, and Z as two strings of 25 digits."""
    found = []
    for geometry, f, force, x, re, im in FILE["cases"]:
        where = {"frequency_hz": f, "force_n": force, "left_m": x}
        found.append(({**FILE["common"], **FILE["geometries"][geometry], **where}, (re, im)))
    return found


def exact(digits: int = 60, **inputs: Any) -> Any:
    """Z by transfer matrices in mpmath; inputs may themselves be mpmath numbers."""
    with mpmath.workdps(digits):
        return +_exact(inputs)


def slope(name: str, digits: int, step: int, **inputs: Any) -> Any:
    """Derivative of the exact line by an input: central differences of 10^-step."""
    with mpmath.workdps(digits):
        h = mpmath.mpf(10) ** -step
        low, high = (exact(digits, **(inputs | {name: mpmath.mpf(inputs[name]) + s * h})) for s in (-1, 1))
        return (high - low) / (2 * h)


def product(parts: Any) -> Any:
    """ABCD matrix of sections (ohm/m, S/m, m), with the digits of the moment."""
    whole = mpmath.eye(2)
    for part in parts:
        whole *= matrix(*(mpmath.mpmathify(v) for v in part))
    return whole


def _exact(given: dict[str, Any]) -> Any:
    zero = ("tan_delta", "leak_s_per_m", "force_n", "left_m", "tip_m")
    zero += ("top_piezoresistance_per_n", "bottom_piezoresistance_per_n")
    defaults = dict.fromkeys(zero, 0) | {"modulus_pa": 1, "eps0_f_per_m": 8.8541878128e-12}
    far_end = given.get("far_end", "open")
    p = {k: mpmath.mpmathify(v) for k, v in (defaults | given).items() if k != "far_end"}
    strain = p["force_n"] / (p["width_m"] * p["tip_m"] * p["modulus_pa"]) if p["force_n"] else mpmath.mpf(0)

    def section(length, pressed):
        rise = p["force_n"] if pressed else 0
        r = sum(
            p[f"{e}_resistivity_ohm_m"]
            * (1 + p[f"{e}_piezoresistance_per_n"] * rise)
            / (p[f"{e}_thickness_m"] * p["width_m"])
            for e in ("top", "bottom")
        )
        gap = p["film_m"] * (1 - strain) if pressed else p["film_m"]
        c = p["eps0_f_per_m"] * p["eps_r"] * p["width_m"] / gap
        y = p["leak_s_per_m"] + (p["tan_delta"] + 1j) * 2 * mpmath.pi * p["frequency_hz"] * c
        return matrix(r, y, length)

    right = p["length_m"] - p["left_m"] - p["tip_m"]
    parts = [section(p["left_m"], False), section(p["tip_m"], True), section(right, False)]
    return terminated(parts[0] * parts[1] * parts[2], far_end)


def matrix(r: Any, y: Any, length: Any) -> Any:
    """ABCD matrix of a section, with the limits r = 0 and y = 0 as they are."""
    if r == 0 or y == 0 or length == 0:
        return mpmath.matrix([[1, r * length], [y * length, 1]])
    z = mpmath.sqrt(r * y) * length
    zc = mpmath.sqrt(r / y)
    return mpmath.matrix([[mpmath.cosh(z), zc * mpmath.sinh(z)], [mpmath.sinh(z) / zc, mpmath.cosh(z)]])


def terminated(m: Any, far_end: Any) -> Any:
    if far_end == "open":
        return m[0, 0] / m[1, 0]
    load = mpmath.mpf(0 if far_end == "short" else far_end)
    return (m[0, 0] * load + m[0, 1]) / (m[1, 0] * load + m[1, 1])


def off(z: Any, true: Any) -> tuple[float, float]:
    """Relative error of Z, and of Re Z by itself."""
    with mpmath.workdps(60):
        gap = mpmath.mpmathify(complex(z)) - true
        return float(abs(gap) / abs(true)), float(abs(gap.real) / abs(true.real)) if true.real else float(gap.real)
