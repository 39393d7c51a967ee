"""Sensitivity of tri and rect beside the plate, all held in the same way: table and picture of docs/sensitivity.md.

Run with NGSolve installed: python bench/sensitivity.py. It presses ten cells (plate, tri and rect with two films each,
free and bonded), prints the table as Markdown, and draws docs/pictures/sensitivity.png: their rise over stress beside
the least standard errors of a press. The first run takes some eight minutes, most of it for rect in three dimensions;
what is solved is kept (SENSORGEN_CACHE), so that the next one takes seconds.
"""

from itertools import product
from math import floor, log10
from pathlib import Path

from plate_sensitivity import BOUNDARIES, Sensitivity, sensitivity
from sensorgen.design.design import Design, make
from sensorgen.models import compression
from sensorgen.models.compression import Compression
from sensorgen.prediction.compression_law import solved
from sensorgen.prediction.query import TONES_HZ

FORCE_N, RHO_OHM_M = 6.0, 0.042
RECT_MESH = 1.022  # rise in the limit of fine meshes over that of the default mesh: docs/compression.md
PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "sensitivity.png"
DESIGNS = {
    "plate": {"shape": "reference"},
    "tri, 0.1 mm": {"shape": "tri", "parameters": {"dielectric_mm": 0.1}},
    "tri, 0.2 mm": {"shape": "tri", "parameters": {"dielectric_mm": 0.2}},
    "rect, 0.1 mm": {"shape": "rect", "parameters": {"dielectric_mm": 0.1}},
    "rect, 0.2 mm": {"shape": "rect", "parameters": {"dielectric_mm": 0.2}},
}


def law(name: str, design: Design, boundary: str) -> Compression:
    """The law of a cell, held so; the rise of rect as it is extrapolated from three meshes."""
    found = solved(design, boundary=BOUNDARIES[boundary]).compression
    return found.scaled_rise(RECT_MESH) if name.startswith("rect") else found


def rows() -> list[tuple[str, str, Compression, Sensitivity]]:
    """Every cell and boundary; the plate also as the thesis has it and bonded over the width of the sensor."""
    plate = make(DESIGNS["plate"])
    laws = [
        ("plate", "B.49", compression.unconfined(6e6)),
        ("plate", "bonded, 10 mm", compression.bonded(6e6, 0.01, 6e-4)),
    ]
    laws += [(name, held, law(name, make(DESIGNS[name]), held)) for held, name in product(BOUNDARIES, DESIGNS)]
    found = []
    for name, held, how in laws:
        design = plate if name == "plate" else make(DESIGNS[name])
        accuracy = 1e-3 if not name.startswith("rect") else 1e-2
        seen = sensitivity(design, how, TONES_HZ, FORCE_N, resistivity_ohm_m=RHO_OHM_M, accuracy=accuracy)
        found.append((name, held, how, seen))
    return found


def table(found: list[tuple[str, str, Compression, Sensitivity]]) -> str:
    """As Markdown; the plate that is held in the same way is 1."""
    plates = {held: seen.per_newton for name, held, _, seen in found if name == "plate"}
    head = (
        "cell",
        "held",
        "C [pF]",
        "rise at 60 kPa",
        "its slope, per N",
        "over the plate's",
        "sigma_F [N]",
        "sigma_x [mm]",
    )
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for name, held, _, s in found:
        times = s.per_newton / plates[held]
        lines.append(
            f"| {name} | {held} | {_three(s.capacitance_f * 1e12)} | {_percent(s.rise)} | {_percent(s.per_newton)} | "
            f"{_three(times)} | {_three(s.sigma_force_n)} | {_three(s.sigma_position_m * 1e3)} |"
        )
    return "\n".join(lines)


def _percent(share: float) -> str:
    return f"{_three(100 * share)} %"


def _three(value: float) -> str:
    """Three digits, thousands apart."""
    digits = max(0, 2 - floor(log10(value)))
    return f"{round(value, 2 - floor(log10(value))):,.{digits}f}".replace(",", " ")


def stored() -> str:
    """What the curve of tri with 0.1 mm gives that `predict` takes, beside the table's."""
    design = make(DESIGNS["tri, 0.1 mm"])
    known = compression.solved(design.shape, vars(design.params), {"x60": 6e6, "etpu": 22e6})
    assert known
    seen = sensitivity(design, known, TONES_HZ, FORCE_N, resistivity_ohm_m=RHO_OHM_M)
    return f"stored curve of tri, 0.1 mm: {_three(seen.sigma_force_n)} N, {_three(seen.sigma_position_m * 1e3)} mm"


def draw(found: list[tuple[str, str, Compression, Sensitivity]]) -> None:
    """Rise over stress, and the bound of the force."""
    import matplotlib as mpl

    mpl.use("Agg")
    import numpy as np
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.8), layout="constrained")
    colours = dict(zip(DESIGNS, ("#555555", "#c0392b", "#e59866", "#1f618d", "#7fb3d5"), strict=True))
    stress = np.linspace(1e3, 1e5, 200)
    for name, held, how, _ in found:
        if held in BOUNDARIES:
            thinning = how.capacitive_strain(stress)[0]
            style = "-" if held == "free" else "--"
            rise = 100 * thinning / (1 - thinning)
            left.semilogy(stress / 1e3, rise, style, color=colours[name], label=f"{name}, {held}")
    left.set(xlabel="stress [kPa]", ylabel="rise of the capacitance [%]", xlim=(0, 100))
    left.grid(alpha=0.3)
    figure.legend(*left.get_legend_handles_labels(), fontsize=8, ncols=5, loc="outside lower center")
    labels = [f"{name}\n{held}" for name, held, _, _ in found]
    for k, (name, _, _, seen) in enumerate(found):
        right.plot(seen.sigma_force_n, k, "o", ms=8, color=colours[name])
    right.set_yticks(range(len(found)), [text.replace("\n", ", ") for text in labels], fontsize=8)
    right.invert_yaxis()
    right.set(xscale="log", xlabel="standard error of a press of 6 N, at 0.1 % noise [N]")
    right.axvline(FORCE_N, color="black", lw=0.8, ls=":")
    right.text(FORCE_N * 1.15, len(found) - 0.6, "the press itself", fontsize=7, va="bottom")
    right.grid(alpha=0.3)
    figure.savefig(PICTURE, dpi=130)


if __name__ == "__main__":
    everything = rows()
    print(table(everything), stored(), sep="\n\n")
    draw(everything)
