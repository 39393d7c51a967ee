"""Compression of the thesis's triangular cells as slicers print them: writes models/solved_prints.yaml.

Films of 0, 0.1 and 0.2 mm are sliced by the PrusaSlicer that is installed too, by every convention for a line's width.
With "prototypes" as argument it writes what the drawn cells of models/solved_cells.yaml do under a block, instead; with
"rect" the printed prototype of rect alone, up to the pressures of Table 1.1: one coarse mesh, some 20 s of processor.

A cell that the file has is not solved again: delete the file to solve all anew, which takes a quarter of an hour.
"""

import re
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from json import dumps
from pathlib import Path

import numpy as np

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Real
from sensorgen.design.design import Design, make
from sensorgen.design.tip import EVEN, STIFF, Tip
from sensorgen.prediction.bodies import WALLS, estimated, of_file
from sensorgen.prediction.compression_law import case_of, content, solved
from sensorgen.prediction.mesh_ladder import (
    COARSEST,
    USUAL,
    PressedPiece,
    coarsest,
    drawn,
    mesh_levels,
    model_of,
    pressed,
)
from sensorgen.prediction.print_files import at_hand
from sensorgen.prediction.sensor_model import piece

MODELS = Path(__file__).parents[1] / "src" / "sensorgen" / "models"
FILE, CELLS = MODELS / "solved_prints.yaml", MODELS / "solved_cells.yaml"
HEAD = """\
# Rise of the capacitance of printed cells with stress, as bench/solved_prints.py solved it: by press2d, its
# usual mesh; "within" by bench/rise_errors.py, of slices ("prusa") against the next coarser mesh; layers of 0.1 and
# 0.06 mm, walls as named, the film as thin and as thick as the printer's tools may make it, and less a layer, too.
# Keys are the content of the section. "stiff" and "block" are the changes under a stiff plate and
# under 10 mm of NinjaFlex, from the even pressure, at 60 kPa on the coarsest mesh. rect: its boxes, on press3d's
# coarsest mesh, whose error is stated; the changes under other tops are the drawn cell's.
source: plane-strain finite elements with frictionless contact, neo-Hookean, nu 0.4999, of the printed cell
youngs_modulus_pa: {etpu: 22.0e6, x60: 6.0e6}
cells:
"""
CROSSED_PA = (0.0, 1e4, 6e4, 1.2e5, 3.45e5, 7e5, 8e5, 9e5, 1e6)
EVEN_PRESSURE, COARSE_PA = Tip(block=EVEN), (0.0, 2e4, 4e4, 6e4)


def main() -> None:
    """Solve and write."""
    text = FILE.read_text("utf-8") if FILE.exists() else ""
    before = {entry[2:18]: entry for entry in re.findall(r"(?m)^  \w{16}:.*\n(?:    .*\n)+", text)}
    found: dict[str, str] = {}
    films = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
    estimates = product(WALLS, ("fine", "extrafine"), "xy", films)
    for walls, quality, along, film in (*product(["prusa"], ["fine"], "xy", (0.2, 0.1, 0.0)), *estimates):
        sizes = {"dielectric_mm": film, "along": along}
        design = make({"shape": "tri", "quality": quality, "parameters": sizes})
        for what, cell in cells(design, walls):
            key = content(cell, 3 if walls == "prusa" else 6)
            if key in found:
                continue
            if key in before:
                found[key] = with_tops(before[key], design, cell)
                FILE.write_text(HEAD + "".join((before | found).values()), "utf-8")
                continue
            name = f"tri repeating along {along}, film {film:g}{what} mm, {quality}, {walls}"
            try:
                law = solved(design, cell, tip=EVEN_PRESSURE)
            except Exception as error:  # a cell that cannot be solved stays unsolved
                print(name, error, flush=True)
                continue
            curve = law.compression
            found[key] = with_tops(
                f"  {key}:  # {name}\n"
                f"    displacement_um: {curve.displacement_m * 1e6:.5g}\n"
                f"    stress_kpa: {[round(p / 1e3, 6) for p in curve.stress_pa]}\n"
                f"    rise_percent: {[round(100 * (r - 1), 6) for r in curve.ratio]}\n"
                f"    within: {curve.within:.4g}\n" + (f"    doubts: {dumps(law.doubts)}\n" if law.doubts else ""),
                design, cell,
            )  # fmt: skip
            print(name, key, law.doubts, flush=True)
            FILE.write_text(HEAD + "".join((before | found).values()), "utf-8")
    spatial = {key: entry for key, entry in before.items() if "# rect" in entry}
    FILE.write_text(HEAD + "".join((found | spatial).values()), "utf-8")


def crossed() -> None:
    """Add the printed prototype of rect, by the slice and by the estimate, whose strips are 0.6 um narrower.

    On press3d's coarsest mesh, whose error is stated; under other tops as the drawn prototype's changes.
    """
    design = make({"shape": "rect"})
    film_mm, solved_cells = design.params.dielectric_mm, yamlfile.parse(CELLS.read_text("utf-8"), CELLS.name)["cells"]
    known = next(c for c in solved_cells if c["shape"] == "rect" and c["parameters"]["dielectric_mm"] == film_mm)
    cell = piece(of_file(design, at_hand(design, None, "prusa")[0]))
    level = coarsest("press3d")
    result = pressed(case_of(design, cell, "press3d", EVEN_PRESSURE), CROSSED_PA, level).sound()
    c = [one.middle() for one in result.capacitance_f_per_m2 if one]  # ends before Table 1.1 does: faces of gaps touch
    within = next(m.rise_error for m in mesh_levels(cell, "press3d", 1) if m.level == level)
    text = FILE.read_text("utf-8")
    for name, key in (("prusa", content(cell, 3)), ("arachne", content(piece(estimated(design, "arachne")), 6))):
        text = re.sub(rf"(?m)^  {key}:.*\n(?:    .*\n)+", "", text) + (
            f"  {key}:  # rect, film {film_mm:g} mm, fine, {name}\n"
            f"    source: boxes in 3D (press3d, its coarsest mesh), neo-Hookean, nu 0.4999, of the cell as printed\n"
            f"    displacement_um: {result.displacement_m[-1] * 1e6:.5g}\n"
            f"    stress_kpa: {[round(p / 1e3, 6) for p in result.stress_pa.tolist()]}\n"
            f"    rise_percent: {[round(100 * (one / c[0] - 1), 6) for one in c]}\n"
            f"    within: {within:.4g}\n    stiff: {known['stiff']}\n    block: [{known['block'][-1]}]\n"
        )
    FILE.write_text(text, "utf-8")


def with_tops(entry: str, design: Design, cell: PressedPiece) -> str:
    """A cell's entry with the changes of its rise under a stiff plate and a block."""
    tips = {"stiff": Tip(block=STIFF), "block": Tip()}
    missing = {key: tip for key, tip in tips.items() if f"    {key}: " not in entry}
    even = rises(design, cell, EVEN_PRESSURE, COARSE_PA, COARSEST) if missing else np.zeros(0)
    for key, tip in missing.items():
        changes = rises(design, cell, tip, COARSE_PA, COARSEST) / even - 1
        change = float(changes[np.isfinite(changes)][-1])  # at the highest pressure at which both are known
        print(entry.partition("\n")[0], key, changes, flush=True)
        entry += f"    {key}: {f'[{change:.4g}]' if key == 'block' else f'{change:.4g}'}\n"
    return entry


def rises(design: Design, cell: PressedPiece, tip: Tip, stress_pa: Sequence[float], level: int) -> Real:
    """Rise of the capacitance at each pressure but the first [F/m2]; NaN where unknown."""
    found = pressed(case_of(design, cell, model_of(cell), tip), stress_pa, level)
    values = [c.middle() if c else np.nan for c in found.capacitance_f_per_m2]
    return np.append(values, [np.nan] * (len(stress_pa) - len(values)))[1:] - values[0]


def prototypes() -> None:
    """Write the changes under a block of all drawn cells, on the usual mesh."""
    text = CELLS.read_text("utf-8")
    for known in yamlfile.parse(text, CELLS.name)["cells"]:
        design = make({"shape": known["shape"], "parameters": {"dielectric_mm": known["parameters"]["dielectric_mm"]}})
        stress_pa = [1e3 * kpa for kpa in known["stress_kpa"]]
        even, block = (rises(design, drawn(design), tip, stress_pa, USUAL) for tip in (EVEN_PRESSURE, Tip()))
        changes = [float(f"{change:.3g}") for change in block / even - 1]
        rise = re.escape(f"    rise_percent: {known['rise_percent']}".replace("0.0,", "0,", 1))
        text = re.sub(rf"({rise}\n)(    block: .*\n)?", rf"\g<1>    block: {changes}\n", text)
        print(known["parameters"], changes, flush=True)
        CELLS.write_text(text, "utf-8")


def cells(design: Design, walls: str) -> Iterator[tuple[str, PressedPiece]]:
    """The printed cell; by Arachne's walls, which are the likeliest, and by G-code with other films too."""
    body = of_file(design, at_hand(design, None, walls)[0]) if walls == "prusa" else estimated(design, walls)
    yield "", piece(body)
    for rule in list(body.cells.scenes)[1:] if walls == "prusa" else ():
        yield f" ({rule})", piece(body.printed_otherwise(rule))
    film = body.cells.film
    if walls in ("arachne", "prusa") and film:
        layer = (f"- a layer, {design.layers.layer_mm:g}", film.layer_thinner)
        for change, scene in ((f"- {film.error_mm:g}", film.thinner), (f"+ {film.error_mm:g}", film.thicker), layer):
            if scene:
                yield f" {change}", PressedPiece(scene, body.cells.period_mm)


if __name__ == "__main__":
    {"prototypes": prototypes, "rect": crossed}.get(" ".join(sys.argv[1:]), main)()
