"""``--budget`` and ``--apply``: the first screen, and a change written into the design's file."""

import json

from sensorgen.checks.review import review
from sensorgen.design.design import load

OFF_GRID = """# my plate
shape: reference   # no pattern

parameters:
  dielectric_mm: 0.57  # between two layers
  length_mm: 30
quality: fine
"""


def test_apply_writes_into_the_file(run, tmp_path, shared_cache):
    path = tmp_path / "plate.yaml"
    path.write_text(OFF_GRID, "utf-8")
    said = run("check", str(path), "--budget", "600", "--apply").ok
    assert said.out.splitlines()[0].startswith("PRINT WITH WARNINGS  plate: 5 warnings")
    assert "1.  dielectric_mm 0.57 -> 0.6: 0 errors, 0 warnings; C " in said.out
    assert path.read_text("utf-8") == OFF_GRID.replace("0.57", "0.6")
    assert review(load(path)).findings == []
    after = run("check", str(path), "--json")
    assert json.loads(after.out)["verdict"] == "PRINT"


def test_build_that_is_refused_says_what_became_of_the_file(run, tmp_path, shared_cache):
    path = tmp_path / "plate.yaml"
    path.write_text(OFF_GRID, "utf-8")
    words = ["build", str(path), "--strict", "--no-cad", "--budget", "600", "--out", str(tmp_path / "out")]
    assert "nothing was written" in run(*words).err
    said = run(*words, "--apply")
    assert said.code == 1
    assert "nothing was written" not in said.err
    assert f"{path} is changed: dielectric_mm 0.57 -> 0.6; all above is of the design before" in said.err
    assert path.read_text("utf-8") == OFF_GRID.replace("0.57", "0.6")
    assert run(*words).code == 0


def test_apply_refuses_what_is_no_file_or_no_change(run, tmp_path, shared_cache):
    path = tmp_path / "plate.yaml"
    path.write_text(OFF_GRID, "utf-8")
    words = ["check", "reference", "--dielectric", "0.57", "--length", "30", "--budget", "600", "--apply"]
    assert "use these options: --set parameters.dielectric_mm=0.6" in run(*words).line
    assert "expected the file alone" in run("check", str(path), "--width", "9", "--budget", "600", "--apply").line
    refused = run("check", str(path), "--budget", "600", "--apply", "9").line
    assert "expected the number of a change above, at most" in refused
    assert path.read_text("utf-8") == OFF_GRID
