"""The lines that a file prints."""

import math

import pytest

from sensorgen.core.errors import BadInput
from sensorgen.design.printer import load_printer
from sensorgen.export.gcode import motion as paths

DIABASE = load_printer("diabase-h5")
PRUSA = [
    "M83", "T2", ";LAYER_CHANGE", ";Z:0.1", ";HEIGHT:0.1", "G1 Z.1 F3000", "G1 E-4.7 F2400", "G1 X10 Y0", "G1 E4.7",
    ";TYPE:Skirt/Brim", ";WIDTH:0.44", "G1 X20 E.5", ";TYPE:External perimeter", "G1 Y10 E.25", "G1 E.1", "T3",
    ";LAYER_CHANGE", "G1 Z.2", "G1 X10 E.5",
]  # fmt: skip
CURA = [
    ";FLAVOR:RepRap", ";Layer height: 0.06", "M83", ";LAYER:0", "T0", "G0 F7200 X0 Y0 Z0.06", ";TYPE:SKIRT",
    "G1 F1200 X10 E0.1", ";TYPE:PRIME-TOWER", "G1 X20 E0.1", ";TYPE:WALL-OUTER", "G1 X30 E0.1", ";LAYER:1",
    "G0 Z0.12", "G1 X0 E0.3",
]  # fmt: skip


def test_a_slicers_own_file():
    found = paths.read(PRUSA, DIABASE, "slicer")
    assert found.tool.tolist() == [3, 3, 3, 4]
    assert found.filament_mm.tolist() == [0.5, 0.25, 0.1, 0.5]
    assert found.length_mm().tolist() == [10, 10, 0, 10]
    assert found.layer.tolist() == [1, 1, 1, 2]
    assert found.end_mm[:, 2].tolist() == [0.1, 0.1, 0.1, 0.2]
    assert found.number.tolist() == [12, 14, 15, 19]
    assert [found.kinds[k] for k in found.kind] == ["skirt/brim", *["external perimeter"] * 3]
    assert found.model().number.tolist() == [14, 19]
    assert found.volume_mm3(1.75) == pytest.approx(found.filament_mm * math.pi * 1.75**2 / 4)


def test_curas_file_says_height_but_no_width():
    found = paths.read(CURA, DIABASE, "slicer")
    assert found.height_mm.tolist() == [0.06] * 4
    assert all(math.isnan(w) for w in found.width_mm)
    assert found.layer.tolist() == [1, 1, 1, 2]
    assert found.model().number.tolist() == [12, 15]


def test_the_printers_own_numbers_stay():
    assert paths.read(PRUSA, DIABASE).tool.tolist() == [2, 2, 2, 3]
    assert paths.read(["M83", "G1 X1 E1"], DIABASE).tool.tolist() == [1]
    assert paths.read(["M83", "T9", "G1 X1 E1"], DIABASE, "slicer").tool.tolist() == [-1]


def test_layers_by_height_where_no_comment_counts():
    lines = ["M83", "T3", "G1 Z.1", "G1 X1 E1", "G1 Z.2", "G1 X2 E1", "G1 Z.1", "G1 X1 E1"]
    assert paths.read(lines, DIABASE).layer.tolist() == [1, 2, 1]
    assert paths.read([*lines[:4], "G1 X2 Z.2 E1"], DIABASE).layer.tolist() == [1, 2]


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"GCDE\1\0", "binary G-code"), (b"G28\n\0\0", "no text"), (b" \n", "is empty"), (b"PK\3\4", "zip archive")],
)
def test_what_is_no_text_is_refused(tmp_path, content, said):
    path = tmp_path / "a.gcode"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=said):
        paths.read(path, DIABASE)
    with pytest.raises(BadInput, match="cannot read"):
        paths.read(tmp_path, DIABASE)
