"""The profiles under the real slicers: understood to the last key, and printed with the tools asked for."""

import ast
import builtins
import configparser
import json
import math
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import extruded
import numpy as np
import pytest
from loaded import DIABASE, FINE, both_printers, both_qualities, ini, usual

from sensorgen.core.errors import SlicerFailed
from sensorgen.design import materials
from sensorgen.design.printer import Printer, tower
from sensorgen.export.slicers import cura, prusa, versions
from sensorgen.export.slicers import cura as curaengine
from sensorgen.export.slicers.loads import ToolLoad
from sensorgen.export.slicers.run import content
from sensorgen.export.threemf import Part, plate
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import Body, Point, box

prusa_versions = pytest.mark.parametrize("prusa_version", ["own", "newer"], indirect=True)
cura_versions = pytest.mark.parametrize("cura_version", ["own", "newer"], indirect=True)

# Slicers lay round-ended lines and push infill into the walls: a solid box comes out 1 to 2 % too full.
SOLID = pytest.approx(1.0, abs=0.03)
SIZE_MM = (20.0, 10.0)
WALLS_MM = 2 * 2 * 0.44  # both sides of the box have two lines
INSIDE = (SIZE_MM[0] - WALLS_MM) * (SIZE_MM[1] - WALLS_MM) / (SIZE_MM[0] * SIZE_MM[1])
HALF = pytest.approx(1 - INSIDE / 2, abs=0.04)  # infill 50 %, less at the ends of its lines
STEP_MM = 0.6  # a whole number of layers in both qualities


def block(low_mm: float, high_mm: float, centre: Point = (0.0, 0.0), x_mm: Point = (-10.0, 10.0)) -> Mesh:
    """A box of SIZE_MM between two heights, or a part of it."""
    (x, y), half = centre, SIZE_MM[1] / 2
    return mesh(Body("", "", (box(x + x_mm[0], x + x_mm[1], y - half, y + half, low_mm, high_mm),)))


def write_3mf(path: Path, bodies: list[tuple[Mesh, int, dict[str, str]]]) -> Path:
    """Bodies, each with its extruder from 1 and settings of its own."""
    parts = [Part(f"body {n}", "m", "#000000", at - 1, each, own) for n, (each, at, own) in enumerate(bodies)]
    path.write_bytes(plate("prusa", "t", parts, (0.0, 0.0)))
    return path


def read(path: Path, printer: Printer) -> extruded.Extruded:
    with path.open(encoding="utf-8") as lines:
        return extruded.read(lines, printer.filament_mm)


def fullness(found: extruded.Extruded, heights_mm: dict[int, float]) -> dict[int, float]:
    """Printed over drawn volume of each tool's bodies [-]."""
    return {tool: volume / (SIZE_MM[0] * SIZE_MM[1] * heights_mm[tool]) for tool, volume in found.model_mm3().items()}


def towers(path: Path, kind: str) -> list[tuple[float, float]]:
    """Where lines of a type end [mm]."""
    here, at, points = "", {"X": 0.0, "Y": 0.0}, []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith(";TYPE:"):
            here = line.removeprefix(";TYPE:").strip().lower()
        words = line.partition(";")[0].split()
        if words and words[0] == "G1":
            moved = {w[0]: float(w[1:]) for w in words[1:] if w[0] in at}
            at |= moved
            if here == kind and moved and any(w.startswith("E") for w in words):
                points.append((at["X"], at["Y"]))
    return points


# --- PrusaSlicer ------------------------------------------------------------------------------------------


def ignored(program: str, text: str, folder: Path) -> list[str]:
    """Keys of a profile that PrusaSlicer does not keep as they are: unknown, misspelt or of another form."""
    (folder / "in.ini").write_text(text)
    subprocess.run(
        [program, "--load", str(folder / "in.ini"), "--save", str(folder / "out.ini")], check=True, capture_output=True
    )
    given, kept = (ini(each.replace('"', "")) for each in (text, (folder / "out.ini").read_text()))
    return [key for key, value in given.items() if kept.get(key) != value]


@prusa_versions
@both_printers
@both_qualities
def test_prusa_keeps_every_key(prusa_version, printer, quality, tmp_path):
    version = versions.of_program("prusa", prusa_version)
    assert ignored(prusa_version, prusa.profile(printer, quality, usual(printer), version), tmp_path) == []


def test_prusa_planted_slip_is_found(prusa_slicer, tmp_path):
    text = prusa.profile(DIABASE, FINE, usual(DIABASE)).replace("\nthick_bridges", "\nthick_bridge")
    assert ignored(prusa_slicer, text, tmp_path) == ["thick_bridge"]


def slice_with_prusa(printer, quality, loads, bodies, folder):
    (folder / "p.ini").write_text(prusa.profile(printer, quality, loads))
    result = folder / "p.gcode"
    prusa.slice_3mf(write_3mf(folder / "p.3mf", bodies), folder / "p.ini", result)
    return result


@both_printers
@both_qualities
def test_prusa_prints_each_box_with_its_tool(prusa_slicer, printer, quality, tmp_path):
    loads = usual(printer)
    low, high = (printer.slicer_index(printer.default_tools[name]) for name in ("etpu", "x60"))
    centre = printer.bed_centre_mm()
    bodies = [(block(k * STEP_MM, (k + 1) * STEP_MM, centre), at + 1, {}) for k, at in enumerate((low, high, low))]
    result = slice_with_prusa(printer, quality, loads, bodies, tmp_path)
    found = read(result, printer)
    assert found.tools == (low, high, low)
    assert fullness(found, {low: 2 * STEP_MM, high: STEP_MM}) == {low: SOLID, high: SOLID}
    assert found.volume_mm3[(high, "wipe tower")] >= 15.0
    place = tower(printer, quality, 2)
    brim = 2.5
    for x, y in towers(result, "wipe tower"):
        assert place.x_mm - brim <= x <= place.x_mm + place.side_mm + brim
        assert place.y_mm - brim <= y <= place.y_mm + place.side_mm + brim


def test_prusa_bodies_carry_their_infill_walls_and_speed(prusa_slicer, tmp_path):
    thin = ToolLoad(materials.load("x60"), infill_percent=50.0)
    loads = {3: ToolLoad(materials.load("etpu")), 4: thin}
    own = prusa.volume_settings(DIABASE, FINE, 4, thin) | {"external_perimeter_speed": "12"}
    # A film of two layers between electrodes: nothing of it is skin, so its share of infill counts in full.
    bodies = [(block(0, 0.6), 3, {}), (block(0.6, 0.8), 4, own), (block(0.8, 1.4), 3, {})]
    result = slice_with_prusa(DIABASE, FINE, loads, bodies, tmp_path)
    full = fullness(read(result, DIABASE), {2: 1.2, 3: 0.2})
    assert full == {2: SOLID, 3: HALF}
    assert "F720" in result.read_text()


def test_prusa_bridges_over_air_with_lines_of_usual_width(prusa_slicer, tmp_path):
    posts = [block(0, STEP_MM, x_mm=ends) for ends in ((-10.0, -8.0), (8.0, 10.0))]
    bodies = [(posts[0], 3, {}), (posts[1], 3, {}), (block(STEP_MM, 2 * STEP_MM), 4, {})]
    found = read(slice_with_prusa(DIABASE, FINE, usual(DIABASE), bodies, tmp_path), DIABASE)
    assert found.volume_mm3[(3, "bridge infill")] > 0
    assert fullness(found, {2: STEP_MM * 0.2, 3: STEP_MM})[3] == SOLID  # 1.21 with thick bridges, on the bridging layer


@pytest.mark.parametrize(("gap_mm", "islands"), [(0.0, 1), (0.05, 2)])
def test_prusa_keeps_gaps_and_joins_what_touches(prusa_slicer, tmp_path, gap_mm, islands):
    halves = [block(0, STEP_MM, x_mm=ends) for ends in ((-10.0, -gap_mm / 2), (gap_mm / 2, 10.0))]
    load = {3: ToolLoad(materials.load("etpu"))}
    result = slice_with_prusa(DIABASE, FINE, load, [(half, 3, {}) for half in halves], tmp_path)
    layers = round(STEP_MM / FINE.layer_mm)
    assert result.read_text().count(";TYPE:External perimeter") == islands * layers


def test_prusa_single_tool_needs_no_tower(prusa_slicer, tmp_path):
    result = slice_with_prusa(
        DIABASE, FINE, {4: ToolLoad(materials.load("x60"))}, [(block(0, STEP_MM), 4, {})], tmp_path
    )
    found = read(result, DIABASE)
    assert found.tools == (3,)
    assert not any(kind == "wipe tower" for _, kind in found.volume_mm3)


def test_prusa_is_quoted_when_it_refuses(prusa_slicer, tmp_path):
    text = prusa.profile(DIABASE, FINE, usual(DIABASE)).replace("fill_pattern = rectilinear", "fill_pattern = wobbly")
    (tmp_path / "p.ini").write_text(text)
    model = write_3mf(tmp_path / "p.3mf", [(block(0, STEP_MM), 3, {})])
    with pytest.raises(SlicerFailed, match="wobbly"):
        prusa.slice_3mf(model, tmp_path / "p.ini", tmp_path / "p.gcode")
    with pytest.raises(SlicerFailed, match="there is no file"):
        prusa.slice_3mf(model, tmp_path / "absent.ini", tmp_path / "p.gcode")


# --- CuraEngine -------------------------------------------------------------------------------------------


def slice_with_cura(printer, quality, loads, bodies, folder):
    stls = [(folder / f"{n}.stl", index) for n, (_, index) in enumerate(bodies)]
    for (path, _), (body, _) in zip(stls, bodies, strict=True):
        path.write_bytes(content(body, np.zeros(3)))
    result = folder / "c.gcode"
    curaengine.slice_bodies(stls, curaengine.engine_settings(printer, quality, loads), result)
    return result


@both_printers
@both_qualities
def test_cura_prints_each_box_with_its_tool(cura_engine, printer, quality, tmp_path):
    low, high = (printer.slicer_index(printer.default_tools[name]) for name in ("etpu", "x60"))
    bodies = [(block(k * STEP_MM, (k + 1) * STEP_MM), tool) for k, tool in enumerate((low, high, low))]
    result = slice_with_cura(printer, quality, usual(printer), bodies, tmp_path)
    found = read(result, printer)
    # The tower's outline is always printed by the first tool, so the tools alternate where one would do.
    assert found.tools[0] == low
    assert set(found.tools) == {low, high}
    assert fullness(found, {low: 2 * STEP_MM, high: STEP_MM}) == {low: SOLID, high: SOLID}
    assert found.volume_mm3[(high, "prime-tower")] >= 14.0
    place = tower(printer, quality, 2)
    for x, y in towers(result, "prime-tower"):
        assert place.x_mm <= x <= place.x_mm + place.side_mm
        assert place.y_mm <= y <= place.y_mm + place.side_mm
    walls = towers(result, "wall-outer")
    middle = printer.bed_centre_mm()
    assert max(x for x, _ in walls) - middle[0] == pytest.approx(SIZE_MM[0] / 2, abs=0.3)
    assert max(y for _, y in walls) - middle[1] == pytest.approx(SIZE_MM[1] / 2, abs=0.3)


def test_cura_infill_reaches_a_film(cura_engine, tmp_path):
    bodies = [(block(0, 0.6), 2), (block(0.6, 0.8), 3), (block(0.8, 1.4), 2)]
    result = slice_with_cura(DIABASE, FINE, usual(DIABASE, infill_percent=50.0), bodies, tmp_path)
    full = fullness(read(result, DIABASE), {2: 1.2, 3: 0.2})
    assert full == {2: SOLID, 3: HALF}


def test_cura_two_tools_of_a_two_tool_printer(cura_engine, tmp_path):
    two = DIABASE.model_copy(update={"tool_numbers": (7, 9), "default_tools": {"etpu": 9, "x60": 7}})
    result = slice_with_cura(two, FINE, usual(two), [(block(0, STEP_MM), 1), (block(STEP_MM, 1.2), 0)], tmp_path)
    assert set(read(result, two).tools) == {0, 1}


def test_cura_is_quoted_when_it_refuses(cura_engine, tmp_path):
    settings = curaengine.engine_settings(DIABASE, FINE, usual(DIABASE))
    empty = tmp_path / "empty.stl"
    empty.write_bytes(b"")
    with pytest.raises(SlicerFailed, match="Failed to load model"):
        curaengine.slice_bodies([(empty, 2)], settings, tmp_path / "c.gcode")
    with pytest.raises(SlicerFailed, match=r"wants tool 0, which has no material; loaded are \[2, 3\]"):
        curaengine.slice_bodies([(empty, 0)], settings, tmp_path / "c.gcode")


# --- Cura's own definitions -------------------------------------------------------------------------------


def definition(name: str, program: str = "") -> dict[str, dict[str, object]]:
    """All settings of one of Cura's own definitions, flat."""
    flat: dict[str, dict[str, object]] = {}

    def walk(nodes: dict[str, dict]) -> None:
        for key, node in nodes.items():
            if node["type"] != "category":
                flat[key] = node
            walk(node.get("children", {}))

    walk(
        json.loads((curaengine.resources(program) / "definitions" / f"{name}.def.json").read_text("utf-8"))["settings"]
    )
    return flat


def section(text: str, name: str) -> dict[str, str]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    return dict(parser[name])


@cura_versions
@both_printers
def test_cura_knows_every_key_and_option(cura_version, printer):
    of_printer, of_tool = definition("fdmprinter", cura_version), definition("fdmextruder", cura_version)
    version = versions.of_program("cura", cura_version)
    files = cura.profiles(printer, FINE, usual(printer, infill_percent=80.0, infill_pattern="grid"), version)
    for path, text in files.items():
        if path.startswith("definitions/"):
            assert set(json.loads(text)["overrides"]) <= set(of_printer), path
        elif path.startswith("extruders/"):
            assert set(json.loads(text)["overrides"]) <= set(of_tool), path
        elif path.startswith("quality/"):
            given = section(text, "values")
            assert set(given) <= set(of_printer), path
            assert section(text, "metadata")["setting_version"] == {4: "19", 5: "20"}[version[0]]
            for key, value in given.items():
                assert value in of_printer[key].get("options", {value: ""}), (path, key)
    settings = curaengine.engine_settings(printer, FINE, usual(printer), version)
    assert curaengine.unknown(settings, cura_version) == set()
    settings.common["no_such_setting"] = "1"
    assert curaengine.unknown(settings, cura_version) == {"no_such_setting"}


@cura_versions
def test_cura_global_settings_stand_in_the_global_quality(cura_version):
    known = definition("fdmprinter", cura_version)
    version = versions.of_program("cura", cura_version)
    for path, text in cura.profiles(DIABASE, FINE, usual(DIABASE), version).items():
        if path.startswith("quality/"):
            per_tool = {known[key].get("settable_per_extruder", True) for key in section(text, "values")}
            assert per_tool == {not path.endswith("_global.inst.cfg")}, path


def test_cura_material_has_the_words_of_cura_s_own(cura_engine):
    words: set[str | None] = set()
    own = (curaengine.resources() / "materials").glob("*.fdm_material")
    space = "{http://www.ultimaker.com/material}"
    for path in own:
        root = ElementTree.parse(path).getroot()
        words |= {e.tag.removeprefix(space) for e in root.iter()} | {e.get("key") for e in root.iter(f"{space}setting")}
    for path, text in cura.profiles(DIABASE, FINE, usual(DIABASE)).items():
        if path.startswith("materials/"):
            root = ElementTree.fromstring(text)
            ours = {e.tag.removeprefix(space) for e in root.iter() if e.tag.startswith(space)}
            assert ours | {e.get("key") for e in root.iter(f"{space}setting")} <= words


class Formulas(dict):
    """What Cura's window makes of given settings: its definitions' formulas, evaluated for one tool."""

    def __init__(self, known, given):
        super().__init__()
        self.known, self.given = known, given
        self.update(
            math=math,
            __builtins__={},
            **{f: getattr(builtins, f) for f in ("max", "min", "round", "int", "any", "all", "sum", "map", "abs")},
        )
        self.update(
            resolveOrValue=self.__getitem__,
            extruderValue=lambda _, key: self[key],
            extruderValues=lambda key: [self[key]],
            defaultExtruderPosition=lambda: 0,
        )

    def __missing__(self, key):
        if key not in self.known:
            raise KeyError(key)
        formula = self.known[key].get("value")
        if key in self.given:
            self[key] = plain(self.given[key])
        elif isinstance(formula, str):
            self[key] = self.work_out(formula)
        else:
            self[key] = plain(self.known[key]["default_value"] if formula is None else formula)
        return self[key]

    def work_out(self, formula):
        return eval(formula, {"__builtins__": {}}, self)  # a formula of the installed Cura, with no builtins to reach

    def enabled(self, key):
        said = self.known[key].get("enabled", True)
        return self.work_out(said) if isinstance(said, str) else said


def same(a, b):
    numbers = isinstance(a, int | float) and isinstance(b, int | float)
    return math.isclose(a, b, abs_tol=1e-6) if numbers else a == b


def plain(value):
    try:
        return ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return value


@cura_versions
@both_printers
@pytest.mark.parametrize(
    "infill", [{}, {"infill_percent": 80.0, "infill_pattern": "triangles"}], ids=["full", "triangles"]
)
def test_engine_is_told_what_the_window_would_work_out(cura_version, printer, infill):
    known, version = definition("fdmprinter", cura_version), versions.of_program("cura", cura_version)
    loads = usual(printer, **infill)
    files = cura.profiles(printer, FINE, loads, version)
    told = curaengine.engine_settings(printer, FINE, loads, version)
    machine = {
        k: v["default_value"] for k, v in json.loads(files[f"definitions/{printer.name}.def.json"])["overrides"].items()
    }
    shared = section(files[f"quality/{printer.name}/{printer.name}_fine_global.inst.cfg"], "values")
    for index, own in told.tools.items():
        material = {
            "default_material_print_temperature": own["material_print_temperature"],
            "default_material_bed_temperature": told.common["material_bed_temperature"],
            **{key: own[key] for key in ("cool_fan_speed", "retraction_amount", "retraction_speed", "material_flow")},
            **{key: own[key] for key in ("material_adhesion_tendency", "machine_nozzle_size", "material_diameter")},
        }
        quality = {
            key: own[key]
            for path, text in files.items()
            if "_fine_sensorgen_" in path
            for key in section(text, "values")
        }
        window = Formulas(known, machine | material | shared | quality)
        engine = machine | told.common | own
        differ = {
            key
            for key, node in known.items()
            if window.enabled(key) and not same(window[key], plain(engine.get(key, node["default_value"])))
        }
        # Their children are told; the engine reads the children alone.
        assert differ <= {"bottom_thickness", "cool_fan_full_at_height"}, (index, differ)
