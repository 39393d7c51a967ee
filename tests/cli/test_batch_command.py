"""``sensorgen batch`` and ``batch verify`` as a user types them."""

import json
from pathlib import Path

import pytest

PLAN = """\
iteration: 26
seed: 7
designs:
  - {shape: tri, parameters: {length_mm: 20, width_mm: 10}, replicates: 2}
labels: {sheet: false}
"""


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(PLAN, "utf-8")
    return path


def test_a_batch_and_its_verification(run, plan):
    said = run("batch", "plan.yaml", "--no-gcode")
    assert said.code == 0, said.err
    assert "plan: 2 specimens on diabase-h5, fine" in said.out
    assert "26 triX .2mm 2 fine" in said.out
    assert "[ ] Clean the nozzles of T3, T4" in said.out
    assert max(map(len, said.out.splitlines())) <= 120
    said = run("batch", "verify", "out/plan")
    assert (said.code, said.out, said.err) == (0, "out/plan: as recorded\n", "")
    Path("out/plan/plate.svg").write_text("other")
    Path("out/plan/plan.yaml").unlink()
    said = run("batch", "verify", "out/plan")
    assert said.code == 1
    assert said.out.splitlines() == ["missing  plan.yaml", "changed  plate.svg", "out/plan: differs from its record"]


def test_json(run, plan):
    said = run("batch", "plan.yaml", "--no-gcode", "--json")
    record = json.loads(said.out)
    assert (record["folder"], len(record["specimens"])) == ("out/plan", 2)
    assert json.loads(run("batch", "verify", "out/plan", "--json").out) == {
        "missing": [], "changed": [], "extra": [], "record": False,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["batch", "absent.yaml"], "cannot read 'absent.yaml'"),
        (["batch", "--json", "plan.yaml"], "--json stands before the plan"),
        (["batch", "verify"], "Missing argument 'FOLDER'"),
        (["batch", "verify", "nowhere"], "expected the folder of a batch"),
        (["batch", "plan.yaml", "--fast"], "unknown option '--fast'"),
        (["batch", "empty.yaml"], "holds nothing"),
    ],
)
def test_wrong_words(run, plan, words, said):
    Path("empty.yaml").write_text("")
    found = run(*words)
    assert found.code == 2
    assert said.casefold() in (found.out + found.err).casefold()
    assert "Traceback" not in found.out + found.err


def test_findings_of_severity_error_stop_it(run, plan):
    Path("short.yaml").write_text("iteration: 26\ndesigns: [{shape: tri, parameters: {dielectric_mm: 0}}]\n")
    said = run("batch", "short.yaml", "--no-gcode")
    assert said.code == 1
    assert "1-short" in said.out
    assert not Path("out").exists()


def test_a_full_disk_leaves_nothing_half_there(run, plan, disk):
    small = disk(60_000)
    said = run("batch", str(plan), "--no-gcode", "--out", small)
    assert said.code == 2
    assert "No space left" in said.line
    assert list(small.rglob("*")) == []
