"""3MF files in the hands of the programs they are written for."""

import io
import json
import re
import shutil
import subprocess
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from sensorgen.export.threemf import Part, content
from sensorgen.scene.geometry.meshes import Mesh

CONFIG = "Metadata/Slic3r_PE_model.config"

# As little as five tools need; the bed has its origin at its centre, as the Diabase's.
INI = """\
gcode_flavor = marlin
bed_shape = -195x-85,195x-85,195x85,-195x85
nozzle_diameter = 0.4,0.4,0.4,0.4,0.4
filament_diameter = 1.75,1.75,1.75,1.75,1.75
temperature = 200,200,200,200,200
extruder_offset = 0x0,0x0,0x0,0x0,0x0
layer_height = 0.2
first_layer_height = 0.2
skirts = 0
wipe_tower = 0
start_gcode =
end_gcode =
"""

# Printed on the system's Python, where Cura's own parser of 3MF is, if it is anywhere.
SAVITAR = """\
import json, sys, zipfile, Savitar
scene = Savitar.ThreeMFParser().parse(zipfile.ZipFile(sys.argv[1]).read("3D/3dmodel.model"))
def tell(node):
    return {"name": node.getName(), "transform": node.getTransformation(), "vertices":
            len(node.getMeshData().getFlatVerticesAsBytes()) // 12, "children": [tell(c) for c in node.getChildren()],
            "settings": {k: v.value for k, v in node.getSettings().items()}}
print(json.dumps([tell(node) for node in scene.getSceneNodes()]))
"""


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """A closed box between two corners [mm]."""
    x, y, z = zip(low, high, strict=True)
    corners = np.array([[a, b, c] for a in x for b in y for c in z], dtype=float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])]
    return Mesh(corners, np.array(triangles, dtype=np.int32))


def stacked() -> list[Part]:
    """Two boxes, one on the other."""
    return [
        Part("bottom", "eTPU", "#202428", 2, box((0, 0, 0), (20, 10, 1))),
        Part('film <X60> & "soft"', "X60", "#f0e6d2", 3, box((0, 0, 1), (20, 10, 2))),
    ]


def beside() -> list[Part]:
    """Two boxes that share an upright face, and one over both, of one of their materials."""
    return [
        Part("left", "eTPU", "#202428", 4, box((0, 0, 0), (10, 10, 1))),
        Part("right", "X60", "#f0e6d2", 1, box((10, 0, 0), (20, 10, 1))),
        Part("above", "eTPU", "#202428", 4, box((0, 0, 1), (20, 10, 2))),
    ]


def printed(program: str, packed: bytes, folder: Path) -> dict[int, list[tuple[float, float, float, float]]]:
    """Ends of the extruding moves of each tool: X, Y, Z of the layer's top [mm] and filament [mm]."""
    source, settings, target = folder / "a.3mf", folder / "a.ini", folder / "a.gcode"
    source.write_bytes(packed)
    settings.write_text(INI)
    command = [program, "--export-gcode", "--load", settings, "--dont-arrange", "--output", target, source]
    run = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    return moves(target.read_text())


def moves(gcode: str) -> dict[int, list[tuple[float, float, float, float]]]:
    by_tool = defaultdict(list)
    tool, at = 0, {"X": 0.0, "Y": 0.0, "Z": 0.0, "E": 0.0}
    for line in gcode.splitlines():
        code = line.partition(";")[0].split()
        if not code:
            continue
        if match := re.fullmatch(r"T(\d+)", code[0]):
            tool = int(match[1])
        words = {w[0]: float(w[1:]) for w in code[1:] if w[0] in at}
        if code[0] == "G92":
            at.update(words)
        elif code[0] in ("G0", "G1"):
            filament = words.get("E", at["E"]) - at["E"]
            at.update(words)
            if filament > 0 and "X" in words:
                by_tool[tool].append((at["X"], at["Y"], at["Z"], filament))
    return dict(by_tool)


def without_config(packed: bytes) -> bytes:
    """The same file without the word on who prints what."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(packed)) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            if name != CONFIG:
                new.writestr(name, old.read(name))
    return target.getvalue()


def test_two_stacked_bodies_each_on_their_tool(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, content("prusa", "two", stacked(), (0, 0)), tmp_path)
    assert set(found) == {2, 3}
    heights = {tool: [round(move[2], 3) for move in ends] for tool, ends in found.items()}
    assert (min(heights[2]), max(heights[2])) == (0.2, 1.0)
    assert (min(heights[3]), max(heights[3])) == (1.2, 2.0)


def test_three_touching_bodies_each_on_their_tool(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, content("prusa", "three", beside(), (0, 0)), tmp_path)
    assert set(found) == {1, 4}
    low = {tool: [x for x, _, z, _ in ends if z < 1.1] for tool, ends in found.items()}
    assert max(low[4]) < 0 < min(low[1])
    assert [tool for tool, ends in found.items() if any(z > 1.1 for _, _, z, _ in ends)] == [4]


def test_planted_fault_without_config_one_tool_prints_all(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, without_config(content("prusa", "two", stacked(), (0, 0))), tmp_path)
    assert set(found) == {0}


def test_the_middle_is_where_it_was_asked_to_be(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, content("prusa", "two", stacked(), (-100, 30.5)), tmp_path)
    ends = np.array([move[:2] for moves_of_tool in found.values() for move in moves_of_tool])
    assert (ends.min(axis=0) + ends.max(axis=0)) / 2 == pytest.approx([-100, 30.5], abs=0.02)


def test_settings_of_one_body_hold_for_it_alone(prusa_slicer, tmp_path):
    filament = {}
    for density in ("10%", "90%"):
        bodies = [Part("a", "m", "#000000", 0, box((0, 0, 0), (20, 20, 4)), {"fill_density": density})]
        bodies += [Part("b", "m", "#000000", 1, box((20, 0, 0), (40, 20, 4)), {"fill_density": "20%"})]
        found = printed(prusa_slicer, content("prusa", "t", bodies, (0, 0)), tmp_path)
        filament[density] = {tool: sum(move[3] for move in ends) for tool, ends in found.items()}
    assert filament["90%"][0] > 1.3 * filament["10%"][0]
    assert filament["90%"][1] == pytest.approx(filament["10%"][1], rel=1e-3)


def test_cura_parser_finds_bodies_names_and_tools(tmp_path):
    python = shutil.which("python3", path="/usr/bin")
    if python is None or subprocess.run([python, "-c", "import Savitar"], capture_output=True, check=False).returncode:
        pytest.skip("Cura's parser is not here: apt install python3-savitar")
    source = tmp_path / "a.3mf"
    source.write_bytes(content("cura", "two", stacked(), (195, 85)))
    run = subprocess.run([python, "-c", SAVITAR, source], capture_output=True, encoding="utf-8", check=True)
    (group,) = json.loads(run.stdout)
    assert group["name"] == "two"
    assert group["transform"].split()[9:] == ["185", "80", "0"]
    assert [child["name"] for child in group["children"]] == [part.name for part in stacked()]
    assert [child["settings"] for child in group["children"]] == [{"extruder_nr": "2"}, {"extruder_nr": "3"}]
    assert [child["vertices"] for child in group["children"]] == [36, 36]  # three for each triangle
