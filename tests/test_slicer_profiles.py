"""Profiles as text: what must be in them, and what is refused. No slicer runs here."""

import configparser
import json
import math
import sys
import uuid
from pathlib import Path
from xml.etree import ElementTree

import pytest
from loaded import DIABASE, FINE, both_printers, both_qualities, ini, usual

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, SlicerFailed, UnknownName
from sensorgen.design import materials
from sensorgen.design.printer import MARGIN_MM, load_printer, load_quality, tower
from sensorgen.export.slicers import cura, orca, prusa, versions
from sensorgen.export.slicers import cura as curaengine
from sensorgen.export.slicers.loads import ToolLoad, recipes
from sensorgen.export.slicers.run import run


def changed(name: str, **prints: float) -> materials.Material:
    """A material whose print values are not as shipped."""
    shipped = materials.load(name)
    values = {key: [materials.Value(value=v, source="test", default=True)] for key, v in prints.items()}
    return shipped.model_copy(update={"print": shipped.print | values})


def values(text: str) -> dict[str, str]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    return dict(parser["values"])


# --- loads ------------------------------------------------------------------------------------------------


ETPU = materials.load("etpu")
COLDER = {3: ToolLoad(ETPU), 4: ToolLoad(changed("x60", bed_temperature_c=60.0))}


@pytest.mark.parametrize(
    ("loads", "error", "says"),
    [
        ({}, BadInput, "no tool is loaded"),
        ({6: ToolLoad(ETPU)}, BadInput, r"no tool 6; its tools are \[1, 2, 3, 4, 5\]"),
        ({3: ToolLoad(ETPU, infill_percent=0)}, OutOfRange, r"infill \[%\] is 0; expected 1 to 100"),
        ({3: ToolLoad(ETPU, infill_pattern="gird")}, UnknownName, "did you mean 'grid'"),
        (COLDER, BadInput, "one bed, two temperatures: etpu on tool 3 75 C, x60 on tool 4 60 C"),
        ({3: ToolLoad(materials.load("air"))}, MissingValue, r"tool 3: air has no default .*add it under 'print'"),
    ],
)
def test_impossible_loads_are_refused(loads, error, says):
    with pytest.raises(error, match=says):
        recipes(DIABASE, FINE, loads)


@pytest.mark.parametrize(
    ("prints", "says"),
    [
        ({"nozzle_temperature_c": 251.0}, r"etpu on tool 3: nozzle temperature \[C\] is 251; expected 0 to 250"),
        ({"bed_temperature_c": 121.0}, r"bed temperature \[C\] is 121; expected 0 to 120"),
        ({"speed_mm_s": 201.0}, r"speed \[mm/s\] is 201; expected 0.1 to 200"),
        ({"fan_percent": 101.0}, r"fan \[%\] is 101"),
        ({"wall_lines": 1.5}, r"walls \[lines\] is 1.5; expected a whole number"),
        ({"flow_percent": math.nan}, r"flow \[%\] is nan"),
    ],
)
def test_beyond_the_printer_is_refused(prints, says):
    with pytest.raises(OutOfRange, match=says):
        recipes(DIABASE, FINE, {3: ToolLoad(changed("etpu", **prints))})


def test_layers_thinner_than_the_printer_are_refused():
    with pytest.raises(OutOfRange, match=r"layer height \[mm\] is 0.02; expected 0.06"):
        recipes(DIABASE, FINE.model_copy(update={"layer_mm": 0.02}), usual(DIABASE))


def test_the_named_source_counts_and_the_default_fills_in():
    made = recipes(DIABASE, FINE, {4: ToolLoad(materials.load("x60"), source="thesis-4.1")})
    assert (made[3].nozzle_c, made[3].bed_c) == (230.0, 75.0)


# --- PrusaSlicer ------------------------------------------------------------------------------------------


@both_printers
@both_qualities
def test_prusa_lists_have_one_entry_per_tool(printer, quality):
    found = ini(prusa.profile(printer, quality, usual(printer)))
    tools = len(printer.tool_numbers)
    for key in ("nozzle_diameter", "temperature", "retract_length", "filament_max_volumetric_speed", "min_fan_speed"):
        assert len(found[key].split(",")) == tools, key
    assert len(found["filament_settings_id"].split(";")) == tools
    assert len(found["wiping_volumes_matrix"].split(",")) == tools**2
    assert float(found["layer_height"]) == quality.layer_mm
    assert {float(v) for k, v in found.items() if k.endswith("extrusion_width")} == {printer.line_mm()}


UNCHANGED = ("thick_bridges", "elefant_foot_compensation", "xy_size_compensation", "raft_layers", "support_material")


@pytest.mark.parametrize(
    ("printer", "values"),
    [
        ("diabase-h5", {"filament_settings_id": '"unused";"unused";"etpu";"x60";"unused"',
                        "temperature": "0,0,210,230,0", "first_layer_bed_temperature": "0,0,75,75,0"}),
        ("diabase-h5", {"bed_shape": "-195x-85,195x-85,195x85,-195x85"}),
        ("prusa-xl5", {"bed_shape": "0x0,360x0,360x360,0x360"}),
        ("diabase-h5", dict.fromkeys(UNCHANGED, "0") | {"perimeter_generator": "arachne"}),
    ],
    ids=["unused tools stay cold", "origin in the middle", "origin in a corner", "the drawing stays"],
)  # fmt: skip
def test_prusa_settings(printer, values):
    loaded = load_printer(printer)
    assert values.items() <= ini(prusa.profile(loaded, FINE, usual(loaded))).items()


def test_prusa_takes_what_is_safe_for_all_and_bodies_carry_their_own():
    loads = {3: ToolLoad(materials.load("etpu")), 4: ToolLoad(changed("x60", speed_mm_s=40.0), "", 80.0, "grid")}
    found = ini(prusa.profile(DIABASE, FINE, loads))
    assert (found["fill_density"], found["fill_pattern"], found["perimeter_speed"]) == ("100%", "rectilinear", "20")
    own = prusa.volume_settings(DIABASE, FINE, 4, loads[4])
    assert (own["fill_density"], own["fill_pattern"], own["perimeter_speed"]) == ("80%", "grid", "40")
    assert set(own) <= set(found)


def test_prusa_full_infill_has_no_pattern():
    own = prusa.volume_settings(DIABASE, FINE, 4, ToolLoad(materials.load("x60"), infill_pattern="honeycomb"))
    assert (own["fill_density"], own["fill_pattern"]) == ("100%", "rectilinear")


def test_two_tools_and_one_tool_are_enough():
    two = DIABASE.model_copy(update={"tool_numbers": (7, 9), "default_tools": {"etpu": 9, "x60": 7}})
    assert ini(prusa.profile(two, FINE, usual(two)))["temperature"] == "230,210"
    alone = prusa.profile(two, FINE, {9: ToolLoad(materials.load("etpu"))})
    assert (ini(alone)["temperature"], ini(alone)["wipe_tower"]) == ("0,210", "0")
    machine = json.loads(cura.profiles(two, FINE, usual(two))["definitions/diabase-h5.def.json"])
    trains = {"0": "diabase-h5_extruder_0", "1": "diabase-h5_extruder_1"}
    assert machine["metadata"]["machine_extruder_trains"] == trains


# --- Cura -------------------------------------------------------------------------------------------------


@both_printers
def test_cura_files_name_each_other(printer):
    files = cura.profiles(printer, FINE, usual(printer))
    machine = json.loads(files[f"definitions/{printer.name}.def.json"])
    trains = machine["metadata"]["machine_extruder_trains"]
    assert sorted(trains) == [str(i) for i in range(len(printer.tool_numbers))]
    for number, train in trains.items():
        extruder = json.loads(files[f"extruders/{train}.def.json"])
        assert extruder["metadata"] == {"machine": printer.name, "position": number}
    assert f"materials/{machine['metadata']['preferred_material']}.xml.fdm_material" in files
    qualities = [text for path, text in files.items() if path.startswith(f"quality/{printer.name}/")]
    assert len(qualities) == 3
    for text in qualities:
        parser = configparser.ConfigParser(interpolation=None)
        parser.read_string(text)
        assert parser["general"]["definition"] == printer.name
        assert parser["metadata"]["quality_type"] == "fine"
        if "material" in parser["metadata"]:
            assert f"materials/{parser['metadata']['material']}.xml.fdm_material" in files


def test_cura_material_is_well_formed_and_says_what_the_recipe_says():
    files = cura.profiles(DIABASE, FINE, usual(DIABASE))
    root = ElementTree.fromstring(files["materials/sensorgen_etpu.xml.fdm_material"])
    space = {"m": "http://www.ultimaker.com/material"}
    found = {s.get("key"): s.text for s in root.iterfind("m:settings/m:setting", space)}
    assert found["print temperature"] == "210"
    assert found["retraction amount"] == "4.7"
    assert root.findtext("m:properties/m:density", None, space) == "1.1"
    assert uuid.UUID(root.findtext("m:metadata/m:GUID", None, space)).version == 5  # from the name, not by chance


def test_cura_density_that_no_source_gives_is_left_out():
    files = cura.profiles(DIABASE, FINE, {5: ToolLoad(materials.load("bvoh"))})
    assert "<density>" not in files["materials/sensorgen_bvoh.xml.fdm_material"]


def test_cura_keeps_two_infills_of_one_material_apart():
    x60 = materials.load("x60")
    loads = {3: ToolLoad(x60), 4: ToolLoad(x60, infill_percent=80.0, infill_pattern="grid")}
    own = "quality/diabase-h5/diabase-h5_fine_sensorgen_x60"
    files = cura.profiles(DIABASE, FINE, loads)
    assert values(files[f"{own}.inst.cfg"])["infill_sparse_density"] == "100"
    thin = values(files[f"{own}_infill80_grid.inst.cfg"])
    assert (thin["infill_sparse_density"], thin["infill_pattern"], thin["bottom_layers"]) == ("80", "grid", "0")


def test_cura_refuses_a_pattern_that_it_does_not_have():
    with pytest.raises(OutOfRange, match="Cura has no honeycomb infill; use rectilinear"):
        cura.profiles(DIABASE, FINE, usual(DIABASE, infill_percent=80.0, infill_pattern="honeycomb"))


@both_printers
def test_profiles_are_the_same_each_time_and_without_leftovers(printer):
    quality, loads = FINE, usual(printer)
    texts = [prusa.profile(printer, quality, loads), *cura.profiles(printer, quality, loads).values()]
    backwards = dict(reversed(loads.items()))
    assert texts == [prusa.profile(printer, quality, backwards), *cura.profiles(printer, quality, backwards).values()]
    assert not any("$" in text for text in texts)
    settings = curaengine.engine_settings(printer, quality, loads)
    told = [settings.common, *settings.tools.values(), *settings.unused.values()]
    assert not any("$" in value for each in told for value in each.values())


# --- versions ---------------------------------------------------------------------------------------------


def test_a_version_renames_drops_adds_and_translates():
    changes = {"renamed": {"b": "c"}, "values": {"b": {"False": "x"}}, "added": {"t": "e = 5\n"}}
    change = versions.VersionChange(title="2", source="here", dropped=("a",), **changes)
    text = "# a = 1\n[values]\na = 1\nb = False\nbb = False\nd = {{ b }}\n"
    assert change.adapted("t", text) == "# a = 1\n[values]\nc = x\nbb = False\nd = {{ b }}\ne = 5\n"
    assert change.adapted("another", "b = True\n") == "c = True\n"


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_what_a_version_drops_or_renames_is_there_before(slicer):
    of = {"prusa": ("profile.ini",), "cura": ("quality_global.inst.cfg", "quality_tool.inst.cfg", "engine.ini")}
    names = of[slicer]
    before: tuple[int, ...] = ()
    for version, change in versions.changes(slicer).items():
        old = [line.partition(" =") for name in names for line in versions.template(slicer, before, name).splitlines()]
        new = "\n".join(versions.template(slicer, version, name) for name in names)
        assert {*change.dropped, *change.renamed, *change.values} <= {key for key, equal, _ in old if equal}
        assert not any(f"\n{key} =" in new for key in (*change.dropped, *change.renamed))
        assert set(change.added) <= set(names)
        before = version


def test_the_profile_is_that_of_the_version():
    keys = {}
    for version in ("2.5.2", "2.6.0", "2.7.4", "2.8.1", "2.9.2", "3.0"):
        keys[version] = ini(prusa.profile(DIABASE, FINE, usual(DIABASE), versions.parse(version)))
    assert keys["2.5.2"] == ini(prusa.profile(DIABASE, FINE, usual(DIABASE)))
    assert [v for v, k in keys.items() if "wipe_tower_x" in k] == ["2.5.2", "2.6.0", "2.7.4", "2.8.1"]
    assert [v for v, k in keys.items() if "wiping_volumes_extruders" in k] == ["2.5.2", "2.6.0"]
    assert [k.get("ensure_vertical_shell_thickness") for k in keys.values()] == ["0", *[None] * 3, *["disabled"] * 2]
    assert keys["3.0"] == keys["2.9.2"]


# --- Orca -------------------------------------------------------------------------------------------------


def presets(printer, **dielectric):
    found = orca.profiles(printer, FINE, usual(printer, **dielectric))
    return {path: json.loads(text) for path, text in found.items()}


@both_printers
def test_orca_has_every_key_and_texts_alone(printer):
    known = {key: set(names.split()) for key, names in yamlfile.read(Path(__file__).parent / "orca_keys.yaml").items()}
    known["machine"] |= known["tools"]
    kinds = []
    for path, preset in presets(printer, infill_percent=80.0, infill_pattern="gyroid").items():
        kinds.append(preset["type"])
        assert path == f"{preset['type']}/{preset['name']}.json"
        assert preset.keys() <= known["preset"] | known[preset["type"]], path
        for key, value in preset.items():
            entries = value if isinstance(value, list) else [value]
            assert all(isinstance(entry, str) for entry in entries), key
            if key in known["tools"]:
                assert len(value) == len(printer.tool_numbers), key
            elif preset["type"] == "filament" and key not in known["preset"] | {"compatible_printers"}:
                assert len(value) == 1, key
    assert kinds == ["machine", "process", "filament", "filament"]


def test_orca_presets_belong_together_and_say_what_prusaslicers_profile_says():
    machine, process, *filaments = presets(DIABASE).values()
    same = ini(prusa.profile(DIABASE, FINE, usual(DIABASE)))
    assert all(each["compatible_printers"] == [machine["name"]] for each in (process, *filaments))
    assert ",".join(machine["printable_area"]) == same["bed_shape"]
    assert machine["machine_start_gcode"].replace("\n", "\\n") == same["start_gcode"]
    assert ",".join(machine["retract_length_toolchange"]) == same["retract_length_toolchange"]
    assert process["wall_loops"] == same["perimeters"]
    assert process["outer_wall_line_width"] == same["external_perimeter_extrusion_width"]
    assert process["prime_tower_width"] == same["wipe_tower_width"]
    assert process["min_bead_width"] == same["min_bead_width"]
    assert [each["nozzle_temperature"][0] for each in filaments] == same["temperature"].split(",")[2:4]
    assert [each["hot_plate_temp"][0] for each in filaments] == same["bed_temperature"].split(",")[2:4]
    speeds = same["filament_max_volumetric_speed"].split(",")[2:4]
    assert [each["filament_max_volumetric_speed"][0] for each in filaments] == speeds


# --- tower ------------------------------------------------------------------------------------------------


@both_printers
@pytest.mark.parametrize(("quality", "tools"), [(FINE, 2), (load_quality("extrafine"), 5)], ids=["2", "5"])
def test_tower_stands_on_the_bed_and_holds_what_is_primed(printer, quality, tools):
    place = tower(printer, quality, tools)
    centre_x, centre_y = printer.bed_centre_mm()
    assert place.x_mm + place.side_mm == centre_x + printer.bed_mm[0] / 2 - MARGIN_MM
    assert place.y_mm > centre_y
    assert math.pi / 4 * place.side_mm**2 * quality.layer_mm >= tools * 15.0


# --- running ----------------------------------------------------------------------------------------------


def test_a_missing_slicer_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SlicerFailed, match=r"prusa-slicer is not installed.*apt install"):
        prusa.slice_3mf(tmp_path / "a.3mf", tmp_path / "a.ini", tmp_path / "a.gcode")
    settings = curaengine.engine_settings(DIABASE, FINE, usual(DIABASE))
    with pytest.raises(SlicerFailed, match="CuraEngine is not installed"):
        curaengine.slice_bodies([(tmp_path / "a.stl", 2)], settings, tmp_path / "a.gcode")


def python(code: str) -> list[str]:
    return [sys.executable, "-c", code]


def test_an_old_result_is_not_taken_for_a_new_one(tmp_path: Path):
    old = tmp_path / "a.gcode"
    old.write_text("G28\n")
    with pytest.raises(SlicerFailed, match="wrote no"):
        run(python("pass"), old)
    assert not old.exists()
