"""3MF files in the hands of the programs they are written for."""

import io
import json
import shutil
import subprocess
import zipfile
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
from loaded import DIABASE

from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.motion import Paths
from sensorgen.export.threemf import Part, content
from sensorgen.scene import scene
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import Body

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
    return mesh(Body("", "", (scene.box(*map(float, chain.from_iterable(zip(low, high, strict=True)))),)))


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


def printed(program: str, packed: bytes, folder: Path) -> dict[int, Paths]:
    """Lines of each tool, by the printer's own number, from 1."""
    source, settings, target = folder / "a.3mf", folder / "a.ini", folder / "a.gcode"
    source.write_bytes(packed)
    settings.write_text(INI)
    command = [program, "--export-gcode", "--load", settings, "--dont-arrange", "--output", target, source]
    run = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    lines = paths.read(target, DIABASE, "slicer")
    lines = lines.of(lines.length_mm() > 0)
    return {tool: lines.of(lines.tool == tool) for tool in np.unique(lines.tool).tolist()}


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
    heights = {tool: lines.end_mm[:, 2].round(3) for tool, lines in found.items()}
    assert {tool: (z.min(), z.max()) for tool, z in heights.items()} == {3: (0.2, 1.0), 4: (1.2, 2.0)}


def test_three_touching_bodies_each_on_their_tool(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, content("prusa", "three", beside(), (0, 0)), tmp_path)
    assert set(found) == {2, 5}
    low = {tool: lines.end_mm[lines.end_mm[:, 2] < 1.1, 0] for tool, lines in found.items()}
    assert low[5].max() < 0 < low[2].min()
    assert [tool for tool, lines in found.items() if lines.end_mm[:, 2].max() > 1.1] == [5]


def test_planted_fault_without_config_one_tool_prints_all(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, without_config(content("prusa", "two", stacked(), (0, 0))), tmp_path)
    assert set(found) == {1}


def test_the_middle_is_where_it_was_asked_to_be(prusa_slicer, tmp_path):
    found = printed(prusa_slicer, content("prusa", "two", stacked(), (-100, 30.5)), tmp_path)
    ends = np.concatenate([lines.end_mm[:, :2] for lines in found.values()])
    assert (ends.min(axis=0) + ends.max(axis=0)) / 2 == pytest.approx([-100, 30.5], abs=0.02)


def test_settings_of_one_body_hold_for_it_alone(prusa_slicer, tmp_path):
    filament = {}
    for density in ("10%", "90%"):
        bodies = [Part("a", "m", "#000000", 0, box((0, 0, 0), (20, 20, 4)), {"fill_density": density})]
        bodies += [Part("b", "m", "#000000", 1, box((20, 0, 0), (40, 20, 4)), {"fill_density": "20%"})]
        found = printed(prusa_slicer, content("prusa", "t", bodies, (0, 0)), tmp_path)
        filament[density] = {tool: lines.filament_mm.sum() for tool, lines in found.items()}
    assert filament["90%"][1] > 1.3 * filament["10%"][1]
    assert filament["90%"][2] == pytest.approx(filament["10%"][2], rel=1e-3)


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
