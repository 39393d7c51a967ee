"""Scenes of tests/reference/rise.json, and the default mesh's rise of the capacitance beside their references."""

import json
from pathlib import Path

import numpy as np

from sensorgen.design.design import make
from sensorgen.design.tip import Tip
from sensorgen.prediction.compression_law import STRESS_PA, case_of
from sensorgen.prediction.mesh_ladder import PressedPiece, drawn, estimated
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


def case(entry):
    """The scene of an entry under its top: the stored print, or the drawing of its parameters."""
    design = make({"shape": "tri", "quality": entry["quality"], "parameters": entry["parameters"]})
    piece = drawn(design)
    if entry["print"]:
        bodies = tuple(
            Body(b["name"], b["material"], tuple(Prism(**_tuples(p)) for p in b["pieces"]), b["terminal"])
            for b in entry["print"]["bodies"]
            if b["name"] != BLOCK  # the references' own, which the top adds again
        )
        piece = PressedPiece(Scene(bodies, tuple(entry["print"]["size_mm"])), entry["print"]["period_mm"])
    return case_of(design, piece, "press2d", Tip(block=entry["top"]))


def _tuples(piece):
    return piece | {"outline": tuple(tuple(corner) for corner in piece["outline"])}


def compared(entry):
    """Errors of the default mesh at the reference's pressures, and the stated ones, over the rise [-]."""
    found = estimated(case(entry), STRESS_PA, sound=True)
    pairs_by_pa = zip(found.rise_f_per_m2, found.rise_error_f_per_m2, strict=True)
    known = dict(zip(found.found.stress_pa.tolist(), pairs_by_pa, strict=True))
    pairs = [
        (1e9 * known[1e3 * kpa][0] / rise - 1, known[1e3 * kpa][1] / known[1e3 * kpa][0])
        for kpa, rise in entry["rise_nf_per_m2"] if 1e3 * kpa in known
    ]  # fmt: skip
    return np.array(pairs).T
