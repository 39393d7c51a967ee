"""A design is found in G-code of anybody: raw or ready, moved, turned, among others; or it is said what is there."""

import math
import re
import shutil

import meshio
import pytest

import sensorgen as sg
from sensorgen.asprinted import agreement
from sensorgen.asprinted.beads import pieces, placed
from sensorgen.core.errors import BadInput
from sensorgen.design.design import make
from sensorgen.export import slicing
from sensorgen.export.gcode.motion import follow
from sensorgen.export.slicing import Placed
from sensorgen.prediction.bodies import from_gcode
from sensorgen.prediction.rest_state import rest_state

from .conftest import small

WORD = re.compile(r"\b([XY])(-?[\d.]+)")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The design in the middle of the bed, its raw and its ready file."""
    if shutil.which("prusa-slicer") is None:
        pytest.skip("prusa-slicer is not installed")
    design = small()
    return design, slicing.sliced([slicing.alone(design)], "prusa", tmp_path_factory.mktemp("alone"))


def capacitance_f(design, file):
    return rest_state(from_gcode(design, file), ranges=False).capacitance.value


def changed(text, place):
    """G-code with every place in plan put elsewhere; moves along one axis get both, as a turn needs."""
    x = y = 0.0
    lines = []
    for line in text.splitlines():
        words = dict(WORD.findall(line.partition(";")[0])) if re.match(r"G[01]\b", line) else {}
        if words:
            x, y = float(words.get("X", x)), float(words.get("Y", y))
            rest = " ".join(WORD.sub("", line).split()[1:])
            u, v = place(x, y)
            line = f"{line[:2]} X{u:.3f} Y{v:.3f} {rest}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def test_raw_and_ready_files_are_one_print(made):
    design, done = made
    assert placed(design, done.ready).copies == 1
    assert capacitance_f(design, done.raw) == pytest.approx(capacitance_f(design, done.ready), rel=1e-9, abs=0)


@pytest.mark.parametrize(
    "place",
    [lambda x, y: (x + 37.3, y - 21.2), lambda x, y: (-y + 40, x - 15)],
    ids=["moved", "turned"],
)
def test_it_is_found_wherever_it_stands(made, place, tmp_path):
    design, done = made
    file = tmp_path / "elsewhere.gcode"
    file.write_text(changed(done.raw.read_text("utf-8"), place), "utf-8")
    assert capacitance_f(design, file) == pytest.approx(capacitance_f(design, done.raw), rel=2e-3, abs=0)


def test_a_body_is_exported_wherever_it_stands(made, tmp_path):
    design, done = made
    moved, empty = tmp_path / "moved.gcode", tmp_path / "empty.gcode"
    moved.write_text(changed(done.raw.read_text("utf-8"), lambda x, y: (x + 8.0, y)), "utf-8")
    wanted, elsewhere = (sg.export_design(design, tmp_path / f"{file.stem}.vtu", file)[0] for file in (done.raw, moved))
    material = [meshio.read(file).cells_dict["hexahedron"] for file in (wanted, elsewhere)]
    assert len(material[1]) == pytest.approx(len(material[0]), rel=0.01)
    empty.write_text("")
    with pytest.raises(BadInput, match=r"empty\.gcode"):
        sg.export_design(design, tmp_path / "none.3mf", empty)


def test_each_of_a_plate_is_found(made, tmp_path):
    design, done = made
    other = small(parameters={"dielectric_mm": 0.3, "length_mm": 16.0})
    x, y = design.machine.bed_centre_mm()
    pieces = [Placed(design, (x - 20, y + 5), "a"), Placed(other, (x + 20, y), "b"), Placed(design, (x, y - 30), "c")]
    plate = slicing.sliced(pieces, "prusa", tmp_path)
    found = placed(design, plate.raw)
    assert found.copies == 2
    assert math.dist(found.centre_mm, (x - 20, y + 5)) < 0.3 or math.dist(found.centre_mm, (x, y - 30)) < 0.3
    assert capacitance_f(design, plate.raw) == pytest.approx(capacitance_f(design, done.raw), rel=2e-3, abs=0)
    alone = capacitance_f(other, plate.raw)
    assert alone < capacitance_f(design, plate.raw) * 16 / 12, "its film is thicker"


def test_the_piece_of_a_plate_that_has_a_fault_is_named(made, tmp_path):
    """Three copies, one of them turned; the strips of one are left out, and the two others pass."""
    design, done = made
    alone, (x, y) = done.ready.read_text("utf-8"), design.machine.bed_centre_mm()
    places = [lambda u, v: (u, v), lambda u, v: (u - 40, v + 20), lambda u, v: (y - v + 40, u - x)]
    turns = [changed(alone, place) for place in places]
    for broken, at in ((1, f"at x {x - 40:.4g}, y {y + 20:.4g} mm"), (2, "at x 40, y 0 mm")):
        texts = [without(text, 3) if k == broken else text for k, text in enumerate(turns)]
        motion = follow("".join(texts).encode())
        assert len(pieces(design, motion)) == 3
        faults = [f for f in agreement.check_motion(design, motion) if f.rule == "volume"]
        assert faults
        assert all(re.match(rf"piece \d of 3, {at} on the bed: .* mm3 in layer", f.message) for f in faults), faults
    with_all = agreement.check_motion(design, follow("".join(turns).encode()))
    assert not [f for f in with_all if f.rule in ("volume", "material", "place", "width")]


def without(text, tool):
    """G-code whose tool extrudes but in the first layers."""
    hand, layer, lines = 0, 0, []
    for line in text.splitlines():
        hand = int(line[1]) if re.match(r"T\d", line) else hand
        layer += line.startswith(";LAYER_CHANGE")
        gone = hand == tool and layer > 4 and re.match(r"G1 .*[XY].* E[.\d]", line)
        lines.append(re.sub(r" E[.\d]+", "", line) if gone else line)
    return "\n".join(lines) + "\n"


def test_what_is_no_g_code_is_said(tmp_path):
    design = small()
    with pytest.raises(BadInput, match="cannot read"):
        from_gcode(design, tmp_path / "missing.gcode")
    (tmp_path / "no.gcode").write_bytes(bytes(range(256)))
    with pytest.raises(BadInput, match="expected G-code"):
        _ = from_gcode(design, tmp_path / "no.gcode").cells


def test_of_an_array_one_crossing_is_looked_for(tmp_path):
    """The whole array was taken for a sensor, of which an electrode did not run from end to end."""
    (tmp_path / "a.gcode").write_text("G1 X1\n")
    array = make({"shape": "array", "name": "a", "cell": {"shape": "tri"}})
    assert from_gcode(array, tmp_path / "a.gcode").design == array.crossing
