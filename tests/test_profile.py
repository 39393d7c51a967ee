"""Slicer options of a design: read, refused, part of its identity, and in every slicer's profile."""

import json
import math

import pytest

from sensorgen.checks import estimate
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.design import design
from sensorgen.design.walls import rule, rules
from sensorgen.export.slicers import cura, orca, prusa
from sensorgen.export.slicers import cura as curaengine
from sensorgen.export.slicers.loads import loads, overlaid
from sensorgen.export.slicing import Placed, check
from sensorgen.prediction.bodies import estimated

SIZE = {"length_mm": 6.0, "width_mm": 6.0, "dielectric_mm": 0.1}


def make(**profile):
    return design.make({"shape": "tri", "parameters": SIZE, "profile": profile})


PLAIN = design.make({"shape": "tri", "parameters": SIZE})


def ini(made, version=()):
    return prusa.settings(prusa.profile(made.machine, made.layers, loads(made), version))


def test_an_unused_profile_does_not_change_who_a_design_is():
    assert make().id() == PLAIN.id()
    assert make().name == PLAIN.name
    assert "profile" not in PLAIN.resolved()
    other = make(walls="classic")
    assert other.id() != PLAIN.id()
    assert other.name.startswith(f"{PLAIN.name}-")
    assert design.of_resolved("again", json.loads(json.dumps(other.resolved()))).id() == other.id()


def test_own_files_stand_beside_the_design_and_give_way_to_what_it_says_itself(tmp_path, monkeypatch):
    (tmp_path / "own.ini").write_text("# mine\n[print]\nskirts = 3\nseam_position = random\n")
    (tmp_path / "own.json").write_text('{"skirt_gap": 5}')
    text = "shape: tri\nprofile: {own: {prusa: own.ini, cura: own.json}, settings: {prusa: {skirts: 2}}}\n"
    (tmp_path / "a.yaml").write_text(text)
    (elsewhere := tmp_path / "x").mkdir()
    monkeypatch.chdir(elsewhere)
    found = design.load(tmp_path / "a.yaml")
    assert found.profile.settings == {"prusa": {"skirts": 2, "seam_position": "random"}, "cura": {"skirt_gap": 5}}
    said = ini(found)
    assert (said["skirts"], said["seam_position"]) == ("2", "random")
    engine = curaengine.engine_settings(found.machine, found.layers, loads(found))
    assert {engine.common["skirt_gap"], *(tool["skirt_gap"] for tool in engine.tools.values())} == {"5"}
    # The design holds the file's content: it is the same design without the file, another one with another content.
    before = found.id()
    assert design.make(found.model_dump(mode="json", exclude_unset=True)).id() == before
    (tmp_path / "own.ini").write_text("skirts = 3\nseam_position = nearest\n")
    assert design.load(tmp_path / "a.yaml").id() != before


@pytest.mark.parametrize(
    ("content", "name", "says"),
    [
        (None, "own.ini", "cannot read"),
        ("skirts 3\n", "own.ini", "expected lines 'name = value'"),
        ("a = 1\na = 2\n", "own.ini", "a name twice"),
        ('{"a": [1]}', "own.json", "one text or number"),
        ("[1]", "own.json", "expected names"),
        ("a = 1\n" * 30000, "own.ini", "at most"),
    ],
)
def test_an_own_file_that_is_none_is_refused(content, name, says, tmp_path):
    if content is not None:
        (tmp_path / name).write_text(content)
    (tmp_path / "a.yaml").write_text(f"shape: tri\nprofile: {{own: {{prusa: {name}}}}}\n")
    with pytest.raises(BadInput, match=says):
        design.load(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    ("profile", "error", "says"),
    [
        ({"walls": "round"}, BadInput, "profile.walls"),
        ({"wall_lines": {"x60": 0}}, BadInput, "1 or more"),
        ({"line_mm": {"x61": 0.4}}, UnknownName, "did you mean 'x60'"),
        ({"infill_angle_deg": {"x60": 180.0}}, BadInput, "below 180"),
        ({"settings": {"prusa": {"a": True}}}, BadInput, "settings"),
    ],
)
def test_what_no_slicer_could_do_is_refused(profile, error, says):
    with pytest.raises(error, match=says):
        make(**profile)


def test_a_line_far_from_the_nozzle_is_refused():
    with pytest.raises(OutOfRange, match=r"line width \[mm\] is 0.81; expected 0.2 to 0.8"):
        ini(make(line_mm={"x60": 0.81}))


def test_every_option_is_in_every_slicers_profile():
    made = make(walls="classic", wall_lines={"x60": 5}, line_mm={"x60": 0.5}, infill_angle_deg={"x60": 30.0})
    said, own = ini(made), prusa.volume_settings(made.machine, made.layers, 4, loads(made)[4])
    assert (said["perimeter_generator"], said["first_layer_extrusion_width"]) == ("classic", "0")
    assert (own["perimeters"], own["perimeter_extrusion_width"], own["fill_angle"]) == ("5", "0.5", "30")
    etpu = prusa.volume_settings(made.machine, made.layers, 3, loads(made)[3])
    assert not {"perimeter_extrusion_width", "fill_angle"} & etpu.keys()
    tools = curaengine.engine_settings(made.machine, made.layers, loads(made)).tools
    assert [tools[index]["line_width"] for index in (2, 3)] == ["0.44", "0.5"]
    assert [tools[index]["infill_line_width"] for index in (2, 3)] == ["0.44", "0.5"]
    assert tools[3]["fill_outline_gaps"] == "False"
    assert tools[3]["skin_angles"] == "[30, 120]"
    assert "skin_angles" not in tools[2]
    process = json.loads(
        orca.profiles(made.machine, made.layers, loads(made))["process/sensorgen diabase-h5 fine.json"]
    )
    assert (process["wall_generator"], process["wall_loops"]) == ("classic", "5")
    flow = [float(v) for v in said["filament_max_volumetric_speed"].split(",")]
    speed, bent = float(own["perimeter_speed"]), 0.1 * (1 - math.pi / 4)
    assert flow[3] == pytest.approx(speed * 0.1 * (0.5 - bent), abs=1e-6)


def test_own_settings_go_before_all_others():
    made = make(
        wall_lines={"x60": 5}, settings={"prusa": {"perimeters": 7}, "orca": {"wall_loops": 7, "mine": 1, "z_hop": 2}}
    )
    assert ini(made)["perimeters"] == "7"
    assert "perimeters" not in prusa.volume_settings(made.machine, made.layers, 4, loads(made)[4])
    machine, process, *_ = map(json.loads, orca.profiles(made.machine, made.layers, loads(made)).values())
    assert (process["wall_loops"], process["mine"], machine["z_hop"]) == ("7", "1", ["2"] * 5)
    assert "mine" not in machine
    own = make(settings={"cura": {"wall_line_count": 9}})
    files = cura.profiles(own.machine, own.layers, loads(own))
    tool = next(text for path, text in files.items() if path.endswith("_fine_sensorgen_x60.inst.cfg"))
    assert "wall_line_count = 9\n" in tool
    assert overlaid("a = 1\nb =\n", {"b": "2", "c": "3"}) == "a = 1\nb = 2\nc = 3\n"


def test_one_plate_has_one_profile():
    pieces = [Placed(PLAIN, (-20.0, 0.0), "a"), Placed(make(walls="classic"), (20.0, 0.0), "b")]
    with pytest.raises(BadInput, match="differently"):
        check(pieces)


def test_estimates_use_the_designs_walls():
    assert rules(None)[0] == "arachne"
    assert rules("classic") == ("classic", "cura", "cura-5")
    assert rule("cura", "arachne") == "cura-gaps"
    layers = estimate.layers(PLAIN.printed, PLAIN.machine, PLAIN.layers, "classic")
    assert layers
    made = {walls: estimated(make(walls=walls)) for walls in ("arachne", "classic")}
    assert "Arachne" in made["arachne"].provenance
    assert "classic" in made["classic"].provenance
    assert set(made["classic"].cells.scenes) == {"classic", "cura", "cura-5"}
