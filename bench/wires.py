"""Wires against what can be told apart: a line with one cable, with both ends, several lines, crossing tracks.

All of one print: cell, sheet resistances and law of compression are those of an array's crossing; lines are its rows. A
line is read at eight tones, presses are patches of even pressure; errors are Cramer-Rao bounds with the prior of an
unknown place (its length over sqrt(12)) and of an unknown force (its own size); crossing tracks by one frame of the
network, wherever presses lie. Writes ``results/wires.md``.
"""

import resource
import time
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.design.design import make
from sensorgen.models.line import cascade
from sensorgen.prediction.array.model import ArrayModel, array_model
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.study import count as presses_at
from sensorgen.prediction.array.study import study

RESULTS = Path(__file__).parent / "results"
TONES_HZ, NOISE = np.logspace(3, 6, 8), 1e-3
FORCE_N, TIP_M = 6.0, 0.01
DISTANCES_MM = (20, 30, 40, 50, 60, 80, 100, 120, 150, 180)
APART = 3.0  # standard errors
ENDS = {"one end": (("left", "open"),),
        "both ends": (("left", "open"), ("left", "short"), ("right", "open"), ("right", "short"))}  # fmt: skip
INSOLE = {
    "shape": "array", "parameters": {"length_mm": 260, "width_mm": 90, "between": "air"},
    "cell": {"shape": "tri", "parameters": {"dielectric_mm": 0.2}},
}  # fmt: skip


def readings(model: ArrayModel, presses: Real, ends: str) -> Real:
    """Logarithms of all impedances of one line of the array under presses of force [N] and place [m], in order."""
    p = model.layout.params
    width_m, length_m = p.row_mm * 1e-3, p.length_mm * 1e-3
    ohm_per_m = (model.row_ohm.value + model.column_ohm.value) / width_m
    farad_per_m2 = model.capacitance.value / (p.row_mm * p.column_mm * 1e-6)
    rest = 2j * np.pi * TONES_HZ * farad_per_m2 * width_m * (1 - 1j * model.crossing.lost.tan_delta)
    cuts, shunts = [0.0], []
    for force_n, place_m in presses:
        ratio, _ = model.under(np.array(force_n / (width_m * TIP_M)))
        cuts += [place_m - TIP_M / 2, place_m + TIP_M / 2]
        shunts += [rest, rest * float(ratio)]
    lengths, shunts = np.diff([*cuts, length_m]), [*shunts, rest]
    found = []
    for side, far in ENDS[ends]:
        turn = slice(None, None, -1 if side == "right" else 1)
        found.append(np.log(cascade([ohm_per_m] * len(lengths), shunts[turn], lengths[turn], far)))
    every = np.concatenate(found)
    return np.concatenate([every.real, every.imag])


def errors(model: ArrayModel, places_mm: list[float], ends: str) -> Real:
    """Covariance of force and place of every press [N, m]."""
    presses = np.array([(FORCE_N, at * 1e-3) for at in places_mm])
    slopes = []
    for k in range(presses.size):
        step = np.zeros(presses.size)
        step[k] = 1e-5 if k % 2 else 1e-3 * FORCE_N
        up, down = (readings(model, presses + sign * step.reshape(-1, 2), ends) for sign in (1, -1))
        slopes.append((up - down) / (2 * step[k]))
    jacobian = np.array(slopes).T / NOISE
    prior = np.tile([FORCE_N, model.layout.params.length_mm * 1e-3 / 12**0.5], len(presses))
    return np.asarray(np.linalg.inv(jacobian.T @ jacobian + np.diag(prior**-2.0)))


def told_apart_mm(model: ArrayModel, ends: str) -> str:
    """Least distance of two equal presses around the middle whose places differ by three standard errors."""
    middle = model.layout.params.length_mm / 2
    for distance in DISTANCES_MM:
        found = errors(model, [middle - distance / 2, middle + distance / 2], ends)
        if APART * (found[1, 1] + found[3, 3] - 2 * found[1, 3]) ** 0.5 < distance * 1e-3:
            return f"{distance} mm"
    return "never"


def table() -> list[str]:
    """Rows of Markdown."""
    model = array_model(make(INSOLE))
    m, n = model.here.shape
    p = model.layout.params
    rows = ["| layout | wires | one press, along | two presses apart from | presses at once |", "|---|---|---|---|---|"]
    for lines, what in ((1, "a line"), (m, f"{m} lines")):
        for ends, cables in (("one end", 1), ("both ends", 2)):
            place_mm = errors(model, [p.length_mm / 2], ends)[1, 1] ** 0.5 * 1e3
            apart = told_apart_mm(model, ends)
            count = lines * (1 if apart == "never" else 2)
            rows.append(
                f"| {what}, {ends} | {2 * lines * cables} | {place_mm:.2g} mm | {apart} of one line | {count} |"
            )
    found = study(model, ArrayReadout(noise=NOISE))
    worst = float(np.nanmax(found.sigma_kpa))
    rows.append(
        f"| {m} x {n} crossing tracks | {m + n} | {p.pitch[0] / 12**0.5:.2g} mm "
        f"| {found.apart_mm:g} mm | {presses_at(model, found.apart_mm)} of {m * n}, each to {worst:.2g} kPa |"
    )
    return rows


def main() -> None:
    """Write the table."""
    start, lines = time.process_time(), table()
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    text = "\n".join(lines)
    note = (
        f"{FORCE_N:g} N on {TIP_M * 1e3:g} mm, noise {NOISE:g} of each part, {len(TONES_HZ)} tones of 1 kHz to 1 MHz; "
    )
    spent = f"{time.process_time() - start:.0f} s of processor, {most:.0f} MB"
    (RESULTS / "wires.md").write_text(f"# Wires\n\n{text}\n\n{note}{spent}. `python bench/wires.py`\n", "utf-8")
    print(text)


if __name__ == "__main__":
    main()
