"""One folder, one design: what was exchanged, linked, rewritten or left over in the folder of a build is found."""

import json
import shutil
from hashlib import sha256

import pytest

from sensorgen.design.design import make
from sensorgen.measure.log import Log
from sensorgen.measure.log.prints import predicted_rows
from sensorgen.workflows.build import build
from sensorgen.workflows.sealed import Differences, build_differences, seal

SMALL = {"shape": "reference", "parameters": {"length_mm": 12.0, "width_mm": 8.0}, "name": "x"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A build, and its design."""
    design = make(SMALL)
    return build(design, tmp_path_factory.mktemp("out"), cad=False).folder, design


@pytest.fixture
def folder(whole, tmp_path):
    """A copy that a test may spoil, with G-code as ``slice`` leaves it."""
    copy = shutil.copytree(whole[0], tmp_path / "out" / "x")
    sliced(copy, whole[1].id())
    return copy


def sliced(folder, design_id, content=b"G1 X1\n"):
    (folder / "x.prusa.gcode").write_bytes(content)
    note = {"design": design_id, "sha256": sha256(content).hexdigest(), "slicer": {"name": "s", "version": "1"}}
    (folder / "x.prusa.gcode.json").write_text(json.dumps(note))


def rewritten(path, **new):
    """A record with other values and its own hash, as somebody would write it who knows how."""
    data = json.loads(path.read_text("utf-8")) | new
    path.write_text(json.dumps(data | {"sha256": seal(data)}), "utf-8")


def test_nothing_differs_where_nothing_changed(folder, whole):
    (folder / "mine.txt").write_text("a user's own")
    assert build_differences(folder, whole[1]) == Differences()


def test_files_that_were_changed_taken_out_or_linked(folder, whole, tmp_path):
    (folder / "x.svg").unlink()
    (folder / "check.json").write_text("{}")
    (folder / "design.json").replace(tmp_path / "design.json")
    (folder / "design.json").symlink_to(tmp_path / "design.json")
    found = build_differences(folder, whole[1])
    assert (found.missing, found.changed, found.links) == (("x.svg",), ("check.json",), ("design.json",))


def test_g_code_of_another_design_or_content(folder, whole):
    sliced(folder, "f" * 16)
    assert build_differences(folder, whole[1]).record == (
        f"x.prusa.gcode was sliced from design '{'f' * 16}', not from this one",
    )
    sliced(folder, whole[1].id())
    (folder / "x.prusa.gcode").write_bytes(b"G1 X2\n")
    assert build_differences(folder, whole[1]).record == ("x.prusa.gcode is not what was sliced",)


def test_the_folder_of_another_design(folder):
    other = make(SMALL | {"parameters": SMALL["parameters"] | {"width_mm": 9.0}})
    (found,) = build_differences(folder, other).record
    assert found.startswith("the files are of design ")


def test_a_record_that_was_changed_by_hand_or_has_a_key_twice(folder, whole):
    path = folder / "manifest.json"
    text = path.read_text("utf-8")
    path.write_text(text.replace('"name": "x"', '"name": "y"', 1), "utf-8")
    assert build_differences(folder, whole[1]).record == ("it does not hold what was written",)
    path.write_text(text.replace("{", '{"name": "z",', 1), "utf-8")
    assert build_differences(folder, whole[1]).record == ("key 'name' stands twice",)


def test_whoever_seals_a_tuned_prediction_anew_is_found_by_the_log(folder, whole, tmp_path):
    design = whole[1]
    prediction = folder / "prediction.json"
    with Log(tmp_path / "log.db", create=True) as log:
        log.add(predicted_rows(design))
        assert build_differences(folder, design, log) == Differences()
        prediction.write_text(prediction.read_text("utf-8").replace("e-1", "e-2"), "utf-8")
        files = json.loads((folder / "manifest.json").read_text("utf-8"))["files"]
        files["prediction.json"] = sha256(prediction.read_bytes()).hexdigest()
        rewritten(folder / "manifest.json", files=files)
        assert build_differences(folder, design) == Differences()
        (found,) = build_differences(folder, design, log).record
        assert "prediction.json is none of the 1 predictions that the log has" in found


def test_a_build_into_the_folder_of_another_design_says_so(folder, whole):
    """Files make room; G-code is set aside under a name that no printer takes."""
    other = make(SMALL | {"parameters": SMALL["parameters"] | {"width_mm": 9.0}})
    built = build(other, folder.parent, cad=False)
    held, aside = built.replaced
    assert f"held another design, '{whole[1].id()}': its files were replaced" in held
    assert "x.prusa.gcode is of another design" in aside
    assert not list(folder.glob("*.gcode"))
    assert (folder / "x.prusa.gcode.stale").read_bytes() == b"G1 X1\n"
    assert build_differences(folder, other) == Differences()
    assert build(other, folder.parent, cad=False).replaced == ()
