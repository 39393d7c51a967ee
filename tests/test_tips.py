"""Cells of tri under an even pressure, a stiff plate and a block, beside another finite-element program."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design.design import make
from sensorgen.design.effects import TipData
from sensorgen.design.tip import Tip
from sensorgen.prediction.compression_law import case_of, solved
from sensorgen.prediction.mesh_ladder import COARSEST, USUAL, drawn, pressed

REFERENCE = json.loads((Path(__file__).parent / "reference" / "tips.json").read_text("utf-8"))["cells"]
BLOCKS = {"even": "even", "rigid": "stiff", "block": "ninjaflex"}
FAST = ("t3 even", "t3 rigid", "t3 block")
needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")


def case(cell):
    sizes = {"period_mm": cell["p"], "hang_height_mm": cell["hs"], "lower_height_mm": cell["ht"]}
    sizes |= {"dielectric_mm": cell["d"], "electrode_mm": cell["te"], "length_mm": 10 * cell["p"]}
    design = make({"shape": "tri", "quality": "extrafine", "parameters": sizes})
    return case_of(design, drawn(design), "press2d", Tip(block=BLOCKS[cell["top"]], height_m=3e-3))


def rises(found):
    values = np.array([c.middle() if c else np.nan for c in found.capacitance_f_per_m2])
    return 1e9 * (values - values[0])


@needs_mesher
@pytest.mark.parametrize(
    "cell",
    [
        pytest.param(c, id=name, marks=() if name in FAST else pytest.mark.nightly)
        for c in REFERENCE
        if (name := f"{c['design']} {c['top']}")
    ],
)
def test_rises_under_a_tip_are_those_of_another_program(cell):
    kpa, expected = np.array(cell["rise_nf_per_m2"]).T
    level = COARSEST if f"{cell['design']} {cell['top']}" in FAST else USUAL
    found = pressed(case(cell), [0.0, *(1e3 * kpa)], level)
    ours = rises(found)[1:]
    n = len(ours)
    known = np.isfinite(ours)
    assert known[: int((kpa <= 60).sum())].all()
    off = abs(ours / expected[:n] - 1)[known]
    assert (off <= np.where(kpa[:n] > 5, 0.03, 0.05)[known]).all(), off


@needs_mesher
def test_a_higher_block_changes_nothing():
    cell = next(c for c in REFERENCE if (c["design"], c["top"]) == ("t3", "block"))
    low = case(cell)
    sizes = {"height_m": 3e-3}, {"height_m": 10e-3}
    design = make({"shape": "tri", "quality": "extrafine", "parameters": {"length_mm": 100.0, "period_mm": 5.0}})
    heights = [case_of(design, drawn(design), "press2d", Tip(**size)).piece.scene.bodies[-1] for size in sizes]
    spans = [body.pieces[0].span("z") for body in heights]
    assert [round(b - a, 6) for a, b in spans] == [3.0, 7.5]  # cut at one and a half periods
    higher = replace(low, piece=case(cell | {"top": "block"}).piece)
    assert higher.piece == low.piece


def test_a_tip_of_a_design_is_no_part_of_its_identity():
    plain = make({"shape": "tri"})
    tipped = make({"shape": "tri", "tip": {"width_mm": 5, "block": "stiff"}})
    assert plain.id() == tipped.id()
    assert "tip" not in plain.resolved()
    assert tipped.tip.tip() == Tip(5e-3, block="stiff")
    assert make({"shape": "tri"}).tip == TipData()


def test_a_block_of_no_material_and_a_wrong_key_are_refused():
    with pytest.raises(UnknownName, match="ninjaflx"):
        make({"shape": "tri", "tip": {"block": "ninjaflx"}})
    with pytest.raises(BadInput, match="tip"):
        make({"shape": "tri", "tip": {"width": 5}})


def test_a_layered_cell_gets_no_block():
    design = make({"shape": "reference"})
    found = case_of(design, drawn(design), "press2d", Tip())
    assert found.piece == drawn(design)


@needs_mesher
@pytest.mark.nightly
@pytest.mark.parametrize("cell", [pytest.param(c, id=c["design"]) for c in REFERENCE if c["top"] == "block"])
def test_the_stated_range_holds_what_another_program_finds_under_a_block(cell):
    """Law, its errors and its tops, from 10 kPa on."""
    sizes = {"period_mm": cell["p"], "hang_height_mm": cell["hs"], "lower_height_mm": cell["ht"]}
    sizes |= {"dielectric_mm": cell["d"], "electrode_mm": cell["te"], "length_mm": 10 * cell["p"]}
    law = solved(make({"shape": "tri", "quality": "extrafine", "parameters": sizes}), tip=Tip(height_m=3e-3))
    for kpa, rise in cell["rise_nf_per_m2"]:
        if kpa < 10 or 1e3 * kpa > law.compression.stress_pa[-1]:
            continue
        share = rise / cell["c0_nf_per_m2"]
        strains = [float(one.capacitive_strain(np.array(1e3 * kpa))[0]) for one in (*law.others, *law.tops.values())]
        least, most = (s / (1 - s) for s in (min(strains), max(strains)))
        assert least <= share <= most, (kpa, least, share, most)
