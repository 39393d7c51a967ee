"""Debian 13's slicers on the same designs as this machine's: accepted by the printer's check, the tower where asked."""

import re
import zipfile
from pathlib import Path

import extruded
import numpy as np
import pytest

from sensorgen.core import yamlfile
from sensorgen.design import design
from sensorgen.design.printer import tower
from sensorgen.export import slicing
from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.check import check
from sensorgen.export.slicers import cura, prusa, versions
from sensorgen.export.slicing import Placed, alone, sliced
from sensorgen.export.threemf.prusa import TOWER

DESIGNS = Path(__file__).parents[2] / "designs"
SIZE = {"length_mm": 6.0, "width_mm": 6.0}  # two or three cells
PROGRAMS = {"prusa": "prusa-slicer", "cura": "CuraEngine"}
NEWER = {"prusa": (2, 9), "cura": (5,)}
both = pytest.mark.parametrize("slicer", sorted(PROGRAMS))


def small(name, **more):
    data = yamlfile.read(DESIGNS / name)
    data["parameters"] = {**data.get("parameters", {}), **SIZE}
    return design.make({**data, "name": Path(name).stem, **more})


def supported():
    """The triangles' air filled with support, on a third tool."""
    return small("23/trix-d0.2.yaml", materials={"support": "bvoh"})


def volumes(made, variant):
    """Printed over solid volume of each tool [-]."""
    solid: dict[int, float] = {}
    for body in variant.printed.bodies:
        tool = variant.tool(body.material)
        solid[tool] = solid.get(tool, 0.0) + body.volume_mm3()
    printed = extruded.read(made.ready, variant.machine.filament_mm).model_mm3()
    return {tool: printed[tool] / volume for tool, volume in solid.items()}


@both
@pytest.mark.parametrize(
    "variant",
    [
        pytest.param(small("23/trix-d0.2.yaml"), id="tri", marks=pytest.mark.nightly),
        pytest.param(small("23/sqyx-d0.1.yaml", quality="extrafine"), id="rect"),
        pytest.param(supported(), id="support"),
    ],
)  # fmt: skip
def test_each_variant_passes_the_printers_check(variant, slicer, newer_program, tmp_path):
    made = sliced([alone(variant)], slicer, tmp_path, program=newer_program(PROGRAMS[slicer]))
    assert versions.parse(made.version) >= NEWER[slicer]
    assert made.findings == ()
    loaded = {variant.tool(name): name for name in variant.used()}
    assert check(made.ready, variant.machine, loaded, others_empty=True).errors(strict=True) == []
    assert all(0.93 < ratio < 1.2 for ratio in volumes(made, variant).values())
    lines = paths.read(made.ready, variant.machine)
    place = tower(variant.machine, variant.layers, len(loaded))
    names = np.array(lines.kinds)[lines.kind]
    ends = lines.end_mm[np.isin(names, ("wipe tower", "prime-tower")), :2] - (place.x_mm, place.y_mm)
    assert len(ends) > 10
    assert ((ends > -3) & (ends < place.side_mm + 3)).all()  # with its brim


def test_without_its_place_in_the_3mf_the_tower_leaves_the_bed(newer_program, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    program = slicing.Runner(newer_program("prusa-slicer"))
    made = sliced([alone(variant)], "prusa", tmp_path, program=program.program)
    with zipfile.ZipFile(tmp_path / "plate.3mf") as full, zipfile.ZipFile(tmp_path / "bare.3mf", "w") as bare:
        assert TOWER in full.namelist()
        for name in set(full.namelist()) - {TOWER}:
            bare.writestr(name, full.read(name))
    prusa.slice_3mf(tmp_path / "bare.3mf", tmp_path / "profile.ini", tmp_path / "bare.gcode", program)
    reach = [
        paths.read(path, variant.machine, "slicer").end_mm[:, 1].max() for path in (made.raw, tmp_path / "bare.gcode")
    ]
    assert reach[0] < variant.machine.bed_mm[1] / 2 < reach[1]


@both
def test_a_setting_that_the_slicer_does_not_know_is_a_finding(slicer, newer_program, tmp_path, monkeypatch):
    slip, template = {"prusa": "thick_bridges", "cura": "wall_line_count"}[slicer], versions.template
    monkeypatch.setattr(
        "sensorgen.export.slicers.loads.template", lambda *at: re.sub(f"(?m)^{slip} =", f"{slip}_ =", template(*at))
    )  # fmt: skip
    prusa._templates.cache_clear(), cura._templates.cache_clear()
    made = sliced([alone(small("23/trix-d0.1.yaml"))], slicer, tmp_path, program=newer_program(PROGRAMS[slicer]))
    prusa._templates.cache_clear(), cura._templates.cache_clear()
    assert [f.rule for f in made.findings] == ["11-profile"]
    assert f"{slip}_" in made.findings[0].message


@both
def test_two_sensors_stand_where_they_were_placed(slicer, newer_program, tmp_path):
    one, two = small("23/trix-d0.1.yaml"), small("23/sqxy-d0.2.yaml")
    pieces = [Placed(one, (-40.0, 10.0), "left"), Placed(two, (30.0, -20.0), "right")]
    made = sliced(pieces, slicer, tmp_path, program=newer_program(PROGRAMS[slicer]))
    assert check(made.ready, one.machine).errors(strict=True) == []
    ends = paths.read(made.ready, one.machine).model().end_mm
    for side, middle in ((ends[ends[:, 0] < 0], (-40, 10)), (ends[ends[:, 0] > 0], (30, -20))):
        assert (side.min(axis=0) + side.max(axis=0))[:2] / 2 == pytest.approx(middle, abs=0.05)


def test_options_of_the_design_reach_the_print(newer_program, tmp_path):
    infill = {"x60": {"percent": 40.0, "pattern": "gyroid"}}
    own = {"settings": {"prusa": {"nonsense": 1}}}
    profile = {"walls": "classic", "wall_lines": {"x60": 1}, "line_mm": {"x60": 0.5}} | own
    variant = small("23/trix-d0.2.yaml", infill=infill, profile=profile)
    made = sliced([alone(variant)], "prusa", tmp_path, program=newer_program("prusa-slicer"))
    assert check(made.ready, variant.machine).errors(strict=True) == []
    used = prusa.settings(made.raw.read_text())
    assert used["perimeter_generator"] == "classic"
    assert ["nonsense" in f.message for f in made.findings] == [True]
    lines = paths.read(made.ready, variant.machine).model()
    walls = np.char.find(np.array(lines.kinds)[lines.kind], "perimeter") >= 0
    widths = {tool: np.median(lines.width_mm[walls & (lines.tool == tool)]) for tool in (3, 4)}
    assert widths == {3: pytest.approx(0.44), 4: pytest.approx(0.5)}
    assert volumes(made, variant)[4] < 0.9
