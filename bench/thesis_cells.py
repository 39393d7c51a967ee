"""The thesis's formulas and its geometry of a pressed cell, held against certified cells and solved compression.

Writes ``results/thesis_cells.md``, whose tables docs/cells.md shows, and ``docs/pictures/cells-thesis.png``.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from sensorgen.design.shapes import rect, tri
from sensorgen.models import fem2d, fem3d, thesis_cells
from sensorgen.scene.scene import Fill

HERE = Path(__file__).parent
PICTURE = HERE.parent / "docs" / "pictures" / "cells-thesis.png"
REFERENCE = HERE.parent / "tests" / "reference"
CELLS = json.loads((REFERENCE / "cells.json").read_text("utf-8"))
CONTACT = json.loads((REFERENCE / "contact.json").read_text("utf-8"))
EPS = {"x60": 4.68, "air": 1.00059}
FILMS_MM = (0.1, 0.2)
PRESSES_MM = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)
STRESSES_KPA = (10, 50, 100)
_M2_PER_MM2 = 1e-6

Table = list[list[str]]


def resting() -> Table:
    """Error of every formula on the cells of the reference, none of them pressed."""
    known = {
        **{f"tri, d = {c['d']}": (tri.Params(dielectric_mm=c["d"]), c["C_F_per_m"] / 2e-3) for c in CELLS["tri"]},
        **{f"rect, d = {c['d']}": (rect.Params(dielectric_mm=c["d"]), c["C_F"] / 4e-6) for c in CELLS["rect"]},
    }
    rows = [["formula", *known]]
    for name, law in thesis_cells.NAMED.items():
        if "swept" not in name:
            rows.append([name, *(_off(law, p, exact) for p, exact in known.values())])
    return rows


def _off(law: thesis_cells.Named, p: Any, exact: float) -> str:
    if type(p).__module__.rpartition(".")[2] not in law.shapes:
        return ""
    return percent(law.value_f_per_m2(p, EPS["x60"]) / exact - 1)


def percent(share: float) -> str:
    return f"{100 * share:+.3g} %"


def thinner(p: rect.Params, press_mm: float) -> rect.Params:
    """The geometry of 3.50: film and both layers thinner by one share, the dielectric strips alone wider."""
    share = 1 - press_mm / (p.upper_height_mm + p.lower_height_mm + p.dielectric_mm)
    return replace(
        p,
        x60_width_mm=p.x60_width_mm / share,
        air_width_mm=p.air_width_mm - 0.5 * p.x60_width_mm * (1 / share - 1),
        upper_height_mm=p.upper_height_mm * share,
        lower_height_mm=p.lower_height_mm * share,
        dielectric_mm=p.dielectric_mm * share,
    )


def strips_field(p: rect.Params) -> float:
    """Certified to 1e-3, per area [F/m2]."""
    cell = replace(p, length_mm=p.period_mm, width_mm=p.period_mm)
    return fem3d.capacitance(rect.scene(cell, Fill()), EPS, 1e-3).middle() / (p.period_mm**2 * _M2_PER_MM2)


def triangles_field(p: tri.Params) -> float:
    """Certified to 1e-4, per area [F/m2]."""
    cell = replace(p, length_mm=p.period_mm, width_mm=1.0)
    return fem2d.capacitance(tri.scene(cell, Fill()), EPS, 1e-4).middle() / (p.period_mm * _M2_PER_MM2)


def pressed_strips(film_mm: float) -> dict[str, list[float]]:
    """Capacitance of the pressed rectangular cell on both geometries, and by each formula [F/m2]."""
    p, eps = rect.Params(dielectric_mm=film_mm), EPS["x60"]
    laws = {name: law for name, law in thesis_cells.NAMED.items() if law.pressed and "rect" in law.shapes}
    return {
        "field, 3.1.2": [strips_field(thesis_cells.swept(p, press)) for press in PRESSES_MM],
        "field, 3.50": [strips_field(thinner(p, press)) for press in PRESSES_MM],
        **{name: [law.value_f_per_m2(p, eps, press) for press in PRESSES_MM] for name, law in laws.items()},
    }


def of_strips(found: dict[float, dict[str, list[float]]]) -> Table:
    """Errors at the greatest press, of the capacitance and of its rise, against either geometry."""
    rows = [["formula", "film [mm]", "C, of 3.1.2's field", "rise", "C, of 3.50's field", "rise"]]
    for film, curves in found.items():
        for name in (n for n in curves if not n.startswith("field")):
            cells = [_errors(curves[name], curves[f"field, {which}"]) for which in ("3.1.2", "3.50")]
            rows.append([name, str(film), *cells[0], *cells[1]])
    return rows


def _errors(found: list[float], known: list[float]) -> tuple[str, str]:
    """Of the last value, and of the rise from the first."""
    return percent(found[-1] / known[-1] - 1), percent((found[-1] - found[0]) / (known[-1] - known[0]) - 1)


def pressed_triangles(film_mm: float) -> dict[str, list[float]]:
    """Displacement [mm], and capacitance per period at rest [F/m2]: solved, of the swept geometry, by 3.35 on that."""
    p, known = tri.Params(dielectric_mm=film_mm), CONTACT[f"tri_d{film_mm}"]
    down = [um * 1e-3 for um in known["uy_um"]]
    law = thesis_cells.NAMED["thesis-3.35-swept"]
    swept = [thesis_cells.swept(p, press) for press in down]
    return {
        "press [mm]": down,
        "solved": [c * 1e-12 / 2e-3 for c in known["C_pF_per_m"]],
        "thesis-3.1.2": [triangles_field(q) * thesis_cells.stretch(p, q) for q in swept],
        "thesis-3.35-swept": [law.value_f_per_m2(p, EPS["x60"], press) for press in down],
    }


def of_triangles(found: dict[float, dict[str, list[float]]]) -> Table:
    """How far swept geometry is from solved compression, and the formula from its field, at equal displacement."""
    rows = [
        ["film [mm]", "stress [kPa]", "top down [um]", "thesis-3.1.2, C", "rise", "thesis-3.35-swept, C", "rise",
         "3.35 from the field of 3.1.2"],
    ]  # fmt: skip
    for film, curves in found.items():
        for kpa in STRESSES_KPA:
            upto = slice(0, 1 + CONTACT[f"tri_d{film}"]["p_kPa"].index(kpa))
            solved, field, formula = (curves[n][upto] for n in ("solved", "thesis-3.1.2", "thesis-3.35-swept"))
            rows.append([
                str(film), str(kpa), f"{1e3 * curves['press [mm]'][upto][-1]:.1f}", *_errors(field, solved),
                *_errors(formula, solved), percent(formula[-1] / field[-1] - 1),
            ])  # fmt: skip
    return rows


def markdown(table: Table) -> Iterator[str]:
    head, *rows = (f"| {' | '.join(row)} |" for row in table)
    yield from (head, f"|{'---|' * len(table[0])}", *rows, "")


def picture(strips: dict[str, list[float]], triangles: dict[str, list[float]]) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    labels = {
        "solved": ("solved, with contact", "k-"),
        "thesis-3.1.2": ("swept by hand, its field (3.1.2)", "C0s--"),
        "thesis-3.35-swept": ("3.35 on the swept sizes", "C1^:"),
    }
    _curves(left, triangles["press [mm]"], triangles, labels)
    looks = {
        "field, 3.1.2": ("field, solids' volume kept (3.1.2)", "k-"),
        "field, 3.50": ("field, film thinner too (3.50)", "k--"),
        "thesis-3.55": ("3.55 as printed", "C3o:"),
        "thesis-3.55-corrected": ("3.55, only what its term grew by", "C2v:"),
        "thesis-3.49-swept": ("columns on the swept sizes", "C1^:"),
    }
    _curves(right, list(PRESSES_MM), strips, looks)
    for axis, title in ((left, "triangular cell, d = 0.1 mm"), (right, "rectangular cell, d = 0.1 mm")):
        axis.set(title=title, xlabel="top down by [µm]", ylabel="capacitance per area at rest [nF/m²]", ylim=(0, None))
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="lower right")
    figure.savefig(PICTURE, dpi=110)


def _curves(axis: Any, press_mm: list[float], found: dict[str, list[float]], looks: dict[str, tuple[str, str]]) -> None:
    for name, (label, look) in looks.items():
        axis.plot([1e3 * u for u in press_mm], [1e9 * c for c in found[name]], look, ms=4, label=label)


def main() -> None:
    strips = {film: pressed_strips(film) for film in FILMS_MM}
    triangles = {film: pressed_triangles(film) for film in FILMS_MM}
    lines = [
        "At rest, off the certified cells by:", "", *markdown(resting()),
        f"Strips pressed by {PRESSES_MM[-1]} mm, off the field of either geometry (certified to 1e-3) by:", "",
        *markdown(of_strips(strips)),
        "Triangles, off the solved compression (known to 0.2 %) at equal displacement by:", "",
        *markdown(of_triangles(triangles)),
    ]  # fmt: skip
    (HERE / "results" / "thesis_cells.md").write_text("\n".join(lines), "utf-8")
    picture(strips[0.1], triangles[0.1])


if __name__ == "__main__":
    main()
