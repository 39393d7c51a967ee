"""Every variant of the thesis, both ways up and in both qualities, through both real slicers to the printer's words.

Nine of these 72 are run each time, all by `make nightly`.

Small sensors of few cells: what their G-code says does not depend on how often the pattern repeats.
"""

import re
from itertools import product
from pathlib import Path

import extruded
import numpy as np
import pytest

from sensorgen.core import yamlfile
from sensorgen.design import design
from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.crossings import lift
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.reading import text_of
from sensorgen.export.slicing import Placed, alone, sliced

DESIGNS = Path(__file__).parents[2] / "designs"
VARIANTS = sorted(p.relative_to(DESIGNS).as_posix() for p in DESIGNS.rglob("*.yaml") if not p.stem.endswith("-d0"))
SIZE = {"length_mm": 6.0, "width_mm": 6.0}  # two or three cells
FILLED_IN = re.compile(rb";(TIME|Filament used|M(IN|AX)[XYZ]):")  # in the head that CuraEngine leaves unfinished
PROGRAMS = {"prusa": "prusa_slicer", "cura": "cura_engine"}


def small(name, **more):
    data = yamlfile.read(DESIGNS / name)
    data["parameters"] = {**data.get("parameters", {}), **SIZE}
    return design.make({**data, "name": Path(name).stem, **more})


@pytest.fixture
def slicer(request):
    request.getfixturevalue(PROGRAMS[request.param])
    return request.param


both = pytest.mark.parametrize("slicer", sorted(PROGRAMS), indirect=True)
# Each variant once, and each slicer with both ways up in both qualities; all others are run by `make nightly`.
NINE = {
    ("reference.yaml", "as-drawn", "fine", "prusa"),
    ("23/sqxy-d0.1.yaml", "upside-down", "extrafine", "prusa"),
    ("23/sqxy-d0.2.yaml", "as-drawn", "fine", "cura"),
    ("23/sqyx-d0.1.yaml", "upside-down", "extrafine", "cura"),
    ("23/sqyx-d0.2.yaml", "as-drawn", "fine", "prusa"),
    ("23/trix-d0.1.yaml", "upside-down", "fine", "prusa"),
    ("23/trix-d0.2.yaml", "as-drawn", "extrafine", "cura"),
    ("23/triy-d0.1.yaml", "upside-down", "fine", "cura"),
    ("23/triy-d0.2.yaml", "as-drawn", "extrafine", "prusa"),
}
EVERY = [
    pytest.param(*case, marks=() if case in NINE else pytest.mark.nightly)
    for case in product(VARIANTS, ("as-drawn", "upside-down"), ("fine", "extrafine"), sorted(PROGRAMS))
]


def solid_mm3(variant):
    found = {}
    for body in variant.printed.bodies:
        tool = variant.tool(body.material)
        found[tool] = found.get(tool, 0.0) + body.volume_mm3()
    return found


@pytest.mark.parametrize(("name", "orientation", "quality", "slicer"), EVERY, indirect=["slicer"])
def test_each_variant_passes_the_printers_check(name, orientation, quality, slicer, tmp_path):
    variant = small(name, orientation=orientation, quality=quality)
    made = sliced([alone(variant)], slicer, tmp_path)
    result = check(made.ready, variant.machine)
    assert result.errors(strict=True) == []
    assert {tool.tool for tool in result.tools} == {3, 4}
    assert all(tool.purge_mm > 5 for tool in result.tools)  # the tower primes both
    assert made.version.split(".")[0].isdecimal()
    assert not {b";TIME:6666", b";Filament used: 0m"} & set(made.ready.read_bytes().splitlines())
    printed = extruded.read(made.ready, variant.machine.filament_mm)
    assert set(printed.model_mm3()) == {3, 4}
    layers = paths.read(made.ready, variant.machine).model()
    heights = np.unique(np.round(layers.end_mm[:, 2], 4))
    assert set(heights) <= {round(z, 4) for z in variant.layers.boundaries_mm(variant.printed.size_mm[2] + 0.1)}


@both
def test_what_the_rewriting_leaves_alone(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    made = sliced([alone(variant)], slicer, tmp_path)
    before, after = paths.read(made.raw, variant.machine, "slicer"), paths.read(made.ready, variant.machine)
    for column in ("start_mm", "end_mm", "filament_mm", "tool", "kind", "layer"):
        assert np.array_equal(getattr(before, column), getattr(after, column)), column
    texts = [text_of(path).splitlines() for path in (made.raw, made.ready)]
    assert [texts[0][n - 1] for n in before.number] == [texts[1][n - 1] for n in after.number]
    feeds = [follow(path).feed_mm_min[follow(path).extruded_mm > 0] for path in (made.raw, made.ready)]
    assert feeds[0] == pytest.approx(feeds[1], abs=1e-3)
    comments = [
        [line for line in text_of(path).splitlines() if line.startswith(b";") and not FILLED_IN.match(line)]
        for path in (made.raw, made.ready)
    ]
    assert comments[0] == comments[1]


@both
def test_two_sensors_stand_where_they_were_placed(slicer, tmp_path):
    one, two = small("23/trix-d0.1.yaml"), small("23/sqxy-d0.2.yaml")
    made = sliced([Placed(one, (-40.0, 10.0), "left"), Placed(two, (30.0, -20.0), "right")], slicer, tmp_path)
    assert check(made.ready, one.machine).errors(strict=True) == []
    lines = paths.read(made.ready, one.machine).model()
    assert len(lines)
    for where, middle in ((lines.end_mm[:, 0] < 0, (-40, 10)), (lines.end_mm[:, 0] > 0, (30, -20))):
        ends = lines.end_mm[where]
        low, high = ends.min(axis=0)[:2], ends.max(axis=0)[:2]
        assert (low + high) / 2 == pytest.approx(middle, abs=0.05)
        assert ((high - low > 5.4) & (high - low <= 6.0)).all()  # lines stay inside the outline


@both
def test_another_printer_keeps_its_words(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml", printer="prusa-xl5", tools={"etpu": 0, "x60": 1})
    made = sliced([alone(variant)], slicer, tmp_path)
    assert check(made.ready, variant.machine).errors() == []
    found = lift(made.raw, variant.machine)
    lifted, lifting = found.text, found.lifting
    written, before = (
        [line for line in text.splitlines() if not FILLED_IN.match(line)] for text in (made.ready.read_bytes(), lifted)
    )
    for line in before:  # the slicer's, in order; between them Z alone, where a change of tool left it unstated
        while written[0] != line:
            assert re.fullmatch(rb"G1( Z[0-9.]+)? F[0-9]+", written.pop(0))
        written.pop(0)
    assert written == []
    assert lifting.lifts > 0
    assert lifting.after.contact_mm + lifting.after.near_mm == 0
    ends = paths.read(made.ready, variant.machine).model().end_mm[:, :2]
    assert (ends.min(axis=0) + ends.max(axis=0)) / 2 == pytest.approx(variant.machine.bed_centre_mm(), abs=0.05)


@both
def test_retraction_by_the_firmware(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    control = variant.machine.control.model_copy(update={"firmware_retraction": True})
    variant.__dict__["machine"] = variant.machine.model_copy(update={"control": control})
    made = sliced([alone(variant)], slicer, tmp_path)
    motion = follow(made.ready)
    assert not (motion.filament_mm < 0).any()
    commands = [event.command for event in motion.events]
    plain = [command.code for command in commands if command.code in ("G10", "G11") and not command.words]
    assert plain.count("G10") >= plain.count("G11") > 3
    assert check(made.ready, variant.machine).errors(strict=True) == []
