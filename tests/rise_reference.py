"""Scenes of tests/reference/rise.json and of programs in 3D, and the default mesh's rise of C beside them."""

import json
from pathlib import Path

import numpy as np

from sensorgen.design.design import make
from sensorgen.design.tip import Tip
from sensorgen.prediction.compression_law import STRESS_PA, case_of
from sensorgen.prediction.mesh_ladder import PressedPiece, drawn, estimated, model_of
from sensorgen.scene.scene import Body, Prism, Scene
from sensorgen.solvers.contact.cell import BLOCK

FILE = Path(__file__).parent / "reference" / "rise.json"


def scenes():
    """All entries of the file."""
    return json.loads(FILE.read_text("utf-8"))["scenes"]


def of_another_program():
    """Entries whose rise another program solved, which shares no code: bench/rise_ngsolve.py."""
    found, own = json.loads(FILE.with_name("rise_other.json").read_text("utf-8"))["scenes"], scenes()
    return [own[other["scene"]] | {"rise_nf_per_m2": other["rise_nf_per_m2"]} for other in found]


def in_3d():
    """Entries that NGSolve solved in 3D: round cells of bench/press_round.py, rect of bench/rect_rise.py."""
    plain = {"quality": "fine", "walls": "", "top": "even", "print": None}
    found = json.loads(FILE.with_name("round_rise.json").read_text("utf-8"))
    rows = [plain | {"material_values": found["material_values"]} | cell for cell in found["cells"]]
    rect = json.loads(FILE.with_name("rect_rise.json").read_text("utf-8"))
    for cell in rect["cells"]:
        sizes = {name: value for name, value in cell.items() if name != "meshes"}
        params = make({"shape": "rect", "parameters": sizes}).params
        area_m2 = params.period_mm**2 * 1e-6
        best = cell["meshes"][-1]
        rise = 1e9 * best["rise"] * best["capacitance_f"] / area_m2
        rows.append(
            plain | {"shape": "rect", "parameters": sizes, "rise_nf_per_m2": [[rect["pressure_pa"] / 1e3, rise]]}
        )
    return rows


def with_contact():
    """Entries of drawn cells whose flanks touch, to 1103 kPa, by NGSolve on its finer mesh: bench/tri_contact.py."""
    rows = []
    for cell in json.loads(FILE.with_name("tri_contact.json").read_text("utf-8"))["cells"]:
        best, parameters = cell["meshes"][-1], cell["parameters"]
        rises = [[load["pressure_kpa"], best["capacitance_nf_per_m2"] * load["rise"]] for load in best["loads"]]
        quality = "extrafine" if "electrode_mm" in parameters else "fine"  # electrodes of two layers
        plain = {"walls": "", "top": "even", "print": None, "quality": quality}
        rows.append(plain | {"parameters": parameters, "rise_nf_per_m2": rises})
    return rows


def case(entry):
    """The scene of an entry under its top: the stored print, or the drawing of its parameters."""
    keys = {"quality", "parameters", "material_values", "shape"} & set(entry)
    design = make({"shape": "tri"} | {key: entry[key] for key in keys})
    piece = drawn(design)
    if entry["print"]:
        bodies = tuple(
            Body(b["name"], b["material"], tuple(Prism(**_tuples(p)) for p in b["pieces"]), b["terminal"])
            for b in entry["print"]["bodies"]
            if b["name"] != BLOCK  # the references' own, which the top adds again
        )
        piece = PressedPiece(Scene(bodies, tuple(entry["print"]["size_mm"])), entry["print"]["period_mm"])
    return case_of(design, piece, model_of(piece), Tip(block=entry["top"]))


def _tuples(piece):
    return piece | {"outline": tuple(tuple(corner) for corner in piece["outline"])}


def compared(entry):
    """Errors of the default mesh at the reference's pressures, and the stated ones, over the rise [-]."""
    own = [1e3 * kpa for kpa, _ in entry["rise_nf_per_m2"]]
    loads = (
        STRESS_PA
        if set(own) <= set(STRESS_PA) and len(own) > 1
        else (0.0, *own, *(2 * p for p in own if len(own) == 1))
    )
    found = estimated(case(entry), loads, sound=True)
    pairs_by_pa = zip(found.rise_f_per_m2, found.rise_error_f_per_m2, strict=True)
    known = dict(zip(found.found.stress_pa.tolist(), pairs_by_pa, strict=True))
    pairs = [
        (1e9 * known[1e3 * kpa][0] / rise - 1, known[1e3 * kpa][1] / known[1e3 * kpa][0])
        for kpa, rise in entry["rise_nf_per_m2"] if 1e3 * kpa in known
    ]  # fmt: skip
    return np.array(pairs).T
