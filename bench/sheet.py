"""The sheet: processor time per frequency against error, with edge contacts and with corner pads.

Edge contacts are held against the one-dimensional line, pads against 160 cells. Times are the processor's, so that
other programs count for nothing: medians of runs in turn, the grid being set up once for several tones.
"""

import json
import statistics
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line
from sensorgen.models.sheet import impedance, solve
from sensorgen.solvers.sheet.parts import Contact, Sheet, SheetPatch
from sensorgen.solvers.sheet.solve import BY

RESULTS = Path(__file__).parent / "results"
CELLS = (10, 20, 40, 80)
TRUTH = 160
TONES = np.array([1.1e3, 10.1e3, 99.7e3, 1e6])
RUNS = 5
EPS_R, FILM_M = 4.68, 6e-4
FILM = Sheet(0.1, 0.1, (450.0, 450.0), EPS0_F_PER_M * EPS_R / FILM_M)


def pair(x, y):
    return tuple(Contact(side, x, y) for side in ("top", "bottom"))


EDGE = [(FILM.edge("top", "left"), FILM.edge("bottom", "left"))]
PADS = [pair(x, y) for x in ((0.0, 0.01), (0.09, 0.1)) for y in ((0.0, 0.01), (0.09, 0.1))]
CROSSED = [(FILM.edge("top", "left"), FILM.edge("bottom", "front"))]
PRESS = SheetPatch(0.0413, 0.0, 0.02, 0.1, 1.2)
SPOT = SheetPatch(0.0413, 0.0227, 0.02, 0.02, 1.2)


def exact_line():
    return line.impedance(
        line.PressedLine(
            length_m=0.1,
            width_m=0.1,
            top_thickness_m=3e-4,
            bottom_thickness_m=3e-4,
            top_resistivity_ohm_m=0.135,
            bottom_resistivity_ohm_m=0.135,
            film_m=FILM_M,
            eps_r=EPS_R,
            frequency_hz=TONES,
            force_n=1 - 1 / 1.2,
            modulus_pa=1 / 0.002,
            tip_m=0.02,
            left_m=0.0413,
        )
    )[:, None, None]


CASES = {
    "edge contacts, against the line": (EDGE, PRESS, exact_line),
    "four corner pads, against 160 cells": (PADS, SPOT, lambda: impedance(FILM, PADS, TONES, SPOT, cells=TRUTH)),
    "crossed edges, both sheets, against 120 cells": (
        CROSSED, SPOT, lambda: impedance(FILM, CROSSED, TONES, SPOT, cells=120)
    ),
}  # fmt: skip


def seconds(cells, ports, press, names):
    start = time.process_time()
    solve(FILM, ports, TONES, press, of=names, cells=cells)
    return (time.process_time() - start) / len(TONES)


def measure(ports, press, truth):
    true, rows = truth(), []
    for cells in CELLS:
        z = impedance(FILM, ports, TONES, press, cells=cells)
        scale = np.abs(np.einsum("fpp->fp", true))[:, :1, None]
        real = np.einsum("fpp->fp", true.real)[:, :1, None]
        times = [[seconds(cells, ports, press, names) for names in ((), BY)] for _ in range(RUNS)]
        plain, with_slopes = (statistics.median(column) for column in zip(*times, strict=True))
        rows.append({
            "cells": cells,
            "seconds_per_frequency": plain,
            "seconds_per_frequency_with_derivatives": with_slopes,
            "error": float((np.abs(z - true) / scale).max()),
            "error_re": float((np.abs(z.real - true.real) / real).max()),
        })  # fmt: skip
    return rows


def table(results):
    heads = (
        "contacts",
        "cells",
        "processor time per frequency [ms]",
        "with derivatives [ms]",
        "error of Z",
        "of Re Z",
        "order",
    )
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for name, rows in results.items():
        for before, row in zip([None, *rows], rows, strict=False):
            order = f"{np.log2(before['error_re'] / row['error_re']):.1f}" if before else ""
            lines.append(
                f"| {name} | {row['cells']} | {row['seconds_per_frequency'] * 1e3:.1f} "
                f"| {row['seconds_per_frequency_with_derivatives'] * 1e3:.1f} "
                f"| {row['error']:.1e} | {row['error_re']:.1e} | {order} |"
            )
    return "\n".join(lines) + "\n"


def draw(results):
    figure, frame = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for (name, rows), mark in zip(results.items(), "os^", strict=True):
        times = [row["seconds_per_frequency"] * 1e3 for row in rows]
        errors = [row["error_re"] for row in rows]
        frame.loglog(times, errors, marker=mark, label=name)
        for t, e, row in zip(times, errors, rows, strict=True):
            frame.annotate(row["cells"], (t, e), xytext=(5, 5), textcoords="offset points", fontsize=8)
    frame.set(xlabel="processor time per frequency [ms]", ylabel="largest relative error of Re Z [-]")
    frame.set_title("Sheet: cells along a side, 1.1 kHz to 1 MHz", fontsize=10)
    frame.grid(alpha=0.3)
    frame.legend(fontsize=8)
    figure.savefig(RESULTS / "sheet.png", dpi=120)


def main():
    results = {name: measure(*case) for name, case in CASES.items()}
    (RESULTS / "sheet.json").write_text(json.dumps(results, indent=1) + "\n", "utf-8")
    (RESULTS / "sheet.md").write_text(table(results), "utf-8")
    draw(results)
    print(table(results))


if __name__ == "__main__":
    main()
