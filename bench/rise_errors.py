"""Stated errors of the rise of the capacitance under pressure, against finer meshes: writes results/rise_errors.md.

``python bench/rise_errors.py reference`` solves the scenes of ``SCENES`` on two fine meshes, ten minutes of CPU, and
writes tests/reference/rise.json with the prints themselves; without an argument the default mesh is compared with it.
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from sensorgen.design.design import make
from sensorgen.design.tip import Tip
from sensorgen.models import press2d
from sensorgen.prediction.bodies import estimated
from sensorgen.prediction.compression_law import case_of
from sensorgen.prediction.mesh_ladder import drawn
from sensorgen.prediction.sensor_model import piece

FILE = Path(__file__).parents[1] / "tests" / "reference" / "rise.json"
RESULTS = Path(__file__).parent / "results" / "rise_errors.md"
HEAD = """# Stated errors of the rise of the capacitance

The default mesh against meshes of a third and a quarter of its size, whose own errors are 0.05 to 0.4 %
(tests/reference/rise.json), at 10, 30, 60 and 100 kPa, four prints at 200 and 345 kPa too; rows with a star against
NGSolve: drawn tri with its flanks in contact, also at 345, 600 and 1103 kPa (tri_contact.json), cones and a pyramid at
2 kPa and rect at 10 kPa in 3D (round_rise.json, rect_rise.json). Written by `bench/rise_errors.py`.

"""
FOOT = """
Beyond 345 kPa finer meshes of prints do not converge. NGSolve without contact (order 4, elements of 4 um at corners)
has rises above the default mesh's by 3.9 % (film 0.1 mm) and 3.6 % (0.2 mm) at 200 kPa, by 6 % at 345 kPa, but there
the corners of its steps, unlike those of a print, have passed through each other.
"""
PRESSURE_KPA = (10.0, 30.0, 60.0, 100.0)
HIGHER_KPA = (200.0, 345.0)  # of a few prints: beyond, their finer meshes do not converge
FINE = {False: (0.5, 0.35), True: (0.35, 0.25)}  # sizes over the default mesh's, of drawn and printed cells
_THIN = {"period_mm": 5.0, "hang_height_mm": 0.42, "lower_height_mm": 0.12, "dielectric_mm": 0.12, "electrode_mm": 0.12}
_WIDE = _THIN | {"period_mm": 6.25, "lower_height_mm": 0.06}
_MEDIUM = {"period_mm": 3.2, "hang_height_mm": 0.4, "lower_height_mm": 0.18, "dielectric_mm": 0.15, "electrode_mm": 0.2}
_SMALL = {"period_mm": 1.2, "hang_height_mm": 0.4, "lower_height_mm": 0.2, "dielectric_mm": 0.05}
SCENES = (  # parameters, quality, walls ("": as drawn), top
    ({"dielectric_mm": 0.1}, "fine", "", "even"),
    ({"dielectric_mm": 0.1}, "fine", "", "ninjaflex"),
    ({"dielectric_mm": 0.2}, "fine", "", "even"),
    ({"dielectric_mm": 0.2}, "fine", "", "stiff"),
    ({"dielectric_mm": 0.4}, "fine", "", "ninjaflex"),
    ({"dielectric_mm": 0.1, "period_mm": 4.0}, "fine", "", "stiff"),
    (_SMALL, "fine", "", "even"),
    (_THIN, "extrafine", "", "even"),
    (_THIN, "extrafine", "", "stiff"),
    (_THIN, "extrafine", "", "ninjaflex"),
    (_MEDIUM, "fine", "", "ninjaflex"),
    (_WIDE, "extrafine", "", "stiff"),
    ({"dielectric_mm": 0.1}, "fine", "arachne", "even"),
    ({"dielectric_mm": 0.1}, "fine", "arachne", "stiff"),
    ({"dielectric_mm": 0.1}, "fine", "arachne", "ninjaflex"),
    ({"dielectric_mm": 0.2}, "fine", "arachne", "even"),
    ({"dielectric_mm": 0.2}, "fine", "arachne", "ninjaflex"),
    ({"dielectric_mm": 0.1}, "fine", "classic", "even"),
    ({"dielectric_mm": 0.3}, "fine", "classic", "stiff"),
    ({"dielectric_mm": 0.2}, "extrafine", "arachne", "even"),
    ({"dielectric_mm": 0.1, "period_mm": 4.0}, "fine", "arachne", "ninjaflex"),
    (_THIN, "extrafine", "arachne", "even"),
    (_THIN, "extrafine", "arachne", "stiff"),
    (_THIN, "extrafine", "arachne", "ninjaflex"),
    (_WIDE, "extrafine", "arachne", "stiff"),
    (_MEDIUM | {"lower_height_mm": 0.2, "dielectric_mm": 0.2}, "fine", "arachne", "ninjaflex"),
)  # fmt: skip

HIGHER = tuple(SCENES[k] for k in (12, 15, 17, 18))


def pressures_kpa(scene):
    """Pressures at which a scene is solved."""
    return PRESSURE_KPA + HIGHER_KPA if scene in HIGHER else PRESSURE_KPA


def case(parameters, quality, walls, top):
    """A scene under a top."""
    design = make({"shape": "tri", "quality": quality, "parameters": parameters})
    pressed = piece(estimated(design, walls)) if walls else drawn(design)
    return case_of(design, pressed, "press2d", Tip(block=top))


def rises(found, count):
    """Of the capacitance per area [nF/m2]; None where unknown."""
    known = [c.middle() if c else np.nan for c in found.capacitance_f_per_m2]
    values = [round(1e9 * (c - known[0]), 6) for c in known[1:]]
    return [None if np.isnan(v) else v for v in values] + [None] * (count - len(values))


def reference(scene):
    """A scene with what two fine meshes say."""
    one = case(*scene)
    cell = press2d.cell(one.piece.scene, one.piece.period_mm)
    pressures = pressures_kpa(scene)
    loads = [0.0, *(1e3 * p for p in pressures)]
    known = {}
    for size in FINE[bool(scene[2])]:
        mesh = press2d.Fineness().scaled(size)
        solved = press2d.press(cell, one.solids, loads, one.permittivity, one.boundary, mesh)
        known[size] = rises(solved, len(pressures))
    parameters, quality, walls, top = scene
    other, best = list(known.values())
    return {
        "parameters": parameters, "quality": quality, "walls": walls, "top": top,
        "print": asdict(one.piece.scene) | {"period_mm": one.piece.period_mm} if walls else None,
        "rise_nf_per_m2": [[p, r] for p, r in zip(pressures, best, strict=True) if r is not None],
        "other_mesh": max(abs(a / b - 1) for a, b in zip(other, best, strict=True) if a and b),
    }  # fmt: skip


def table():
    """Rows of the page, and how often the stated errors hold."""
    from rise_reference import compared, in_3d, scenes, with_contact

    found = []
    yield "| body | film, period [mm] | top | error [%] | stated [%] |\n|---|---|---|---|---|\n"
    others = (*with_contact(), *in_3d())
    for entry in (*scenes(), *others):
        errors, stated = compared(entry)
        found.append((errors, stated))
        shape = entry.get("shape", "tri")
        params = make({"shape": shape, "parameters": entry["parameters"]}).params
        shown = " | ".join(", ".join(f"{100 * v:.2g}" for v in values) for values in (errors, stated))
        body = f"{shape}{'*' * (entry in others)}, {entry['walls'] or 'drawn'}, {entry['quality']}"
        yield f"| {body} | {params.dielectric_mm:g}, {params.period_mm:g} | {entry['top']} | {shown} |\n"
    once = [pair for pair, entry in zip(found, (*scenes(), *others), strict=True) if entry not in with_contact()]
    for name, pairs in (("Without tri*", once), ("With tri*, whose scenes are partly the same", found)):
        errors, stated = np.concatenate(pairs, axis=1)
        yield f"\n{name}, {np.mean(abs(errors) <= stated):.0%} of {len(errors)} errors are below the stated ones, "
        yield f"which are {np.median(stated / abs(errors)):.2g} times the error in the median.\n"


def main():
    if "reference" in sys.argv:
        found = [json.dumps(reference(scene)) for scene in SCENES]
        about = {"origin": json.loads(FILE.read_text())["origin"]}
        FILE.write_text(json.dumps(about)[:-1] + ', "scenes": [\n' + ",\n".join(found) + "\n]}\n")
    else:
        RESULTS.write_text(HEAD + "".join(table()) + FOOT)


if __name__ == "__main__":
    main()
