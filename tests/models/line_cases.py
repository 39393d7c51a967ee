"""The reference cases of the line, the thesis's plate, and the exact line with as many digits as it takes."""

import json
from pathlib import Path
from typing import Any

import mpmath

FILE = json.loads((Path(__file__).parents[1] / "reference" / "line_all.json").read_text("utf-8"))
TONES = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)
PLATE = {
    "L_m": 0.1, "W_m": 0.01, "H_top_m": 3e-4, "H_bottom_m": 3e-4, "rho_top_ohm_m": 0.07, "rho_bottom_ohm_m": 0.2,
    "d_m": 6e-4, "eps_r": 4.68, "E_Pa": 6e6, "L_p_m": 0.01, "F_N": 3.0, "x_p_left_edge_m": 0.045, "f_Hz": 99.7e3,
}  # fmt: skip


def cases() -> list[tuple[dict[str, Any], tuple[str, str]]]:
    """Inputs, and Z as two strings of 25 digits."""
    found = []
    for geometry, f, force, x, re, im in FILE["cases"]:
        where = {"f_Hz": f, "F_N": force, "x_p_left_edge_m": x}
        found.append(({**FILE["common"], **FILE["geometries"][geometry], **where}, (re, im)))
    return found


def exact(digits: int = 60, **inputs: Any) -> Any:
    """Z by transfer matrices in mpmath; inputs may themselves be mpmath numbers."""
    with mpmath.workdps(digits):
        return +_exact(inputs)


def _exact(given: dict[str, Any]) -> Any:
    defaults = {
        "tan_delta": 0, "G_S_per_m": 0, "F_N": 0, "x_p_left_edge_m": 0, "L_p_m": 0, "E_Pa": 1, "S_n_top_per_N": 0,
        "S_n_bottom_per_N": 0, "eps0_F_per_m": 8.8541878128e-12,
    }  # fmt: skip
    far_end = given.get("far_end", "open")
    p = {k: mpmath.mpmathify(v) for k, v in (defaults | given).items() if k != "far_end"}
    strain = p["F_N"] / (p["W_m"] * p["L_p_m"] * p["E_Pa"]) if p["F_N"] else mpmath.mpf(0)

    def section(length, pressed):
        rise = p["F_N"] if pressed else 0
        r = sum(
            p[f"rho_{e}_ohm_m"] * (1 + p[f"S_n_{e}_per_N"] * rise) / (p[f"H_{e}_m"] * p["W_m"])
            for e in ("top", "bottom")
        )
        gap = p["d_m"] * (1 - strain) if pressed else p["d_m"]
        c = p["eps0_F_per_m"] * p["eps_r"] * p["W_m"] / gap
        y = p["G_S_per_m"] + (p["tan_delta"] + 1j) * 2 * mpmath.pi * p["f_Hz"] * c
        return matrix(r, y, length)

    right = p["L_m"] - p["x_p_left_edge_m"] - p["L_p_m"]
    parts = [section(p["x_p_left_edge_m"], False), section(p["L_p_m"], True), section(right, False)]
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
