"""docs/log.md says what the program does: its day at the bench, lived through."""

import json
import re
import shlex
from pathlib import Path

import made
import pytest
import scipy.io

from sensorgen.cli import cli
from sensorgen.measure.log import Log
from sensorgen.measure.log.notes import parse

pytest.importorskip("pyvisa_sim")
ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "log.md").read_text("utf-8")
NAME = "26 triX .1mm 2 fine"
BATCH = {
    "batch": "film-study",
    "specimens": {NAME: {"design": "trix-d0.1", "design_id": "a" * 16, "expected": {"c": 1}}},
}


@pytest.mark.usefixtures("roughly")
def test_a_day_at_the_bench(run, path, tmp_path, monkeypatch):
    monkeypatch.setenv("PYVISA_LIBRARY", f"{Path(__file__).with_name('meters.yaml')}@sim")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.pause", lambda *_, **__: None)
    (tmp_path / "designs").symlink_to(ROOT / "designs")
    (tmp_path / "out/film-study").mkdir(parents=True)
    (tmp_path / "out/film-study/batch.json").write_text(json.dumps(BATCH))
    pressed = made.presses(6)
    lived = made.run(pressed)
    content = made.tree([lived.impedance_ohm], [lived.time_s], made.stamps(lived.time_s))
    scipy.io.savemat(tmp_path / "run.mat", content)
    made.write_rig(tmp_path / "rig.csv", made.rig_rows(pressed))
    (tmp_path / "mysensor.yaml").write_text("shape: tri\nname: mysensor\nparameters: {length_mm: 120}\n")
    (tmp_path / "lcr.csv").write_text("Frequency,Cp,D\n1000,12.3e-12,0.02\n")
    commands = [
        shlex.split(line, comments=True) for line in re.search(r"```sh\n(.*?)```", PAGE, re.DOTALL)[1].splitlines()
    ]
    assert len(commands) == 17
    for words in commands:
        if words[1] == "bench":
            assert cli.main(words[1:], standalone_mode=False) in (None, 0)
            continue
        assert words[:2] == ["sensorgen", "log"]
        said = run(*words[2:])
        assert (said.code, said.err) == (0, ""), words
        assert words[2] != "verify" or "is sound" in said.out
    with Log(path) as log:
        assert [(r.design, r.quantity, r.defects) for r in log.readings(specimen="S1")] == [
            ("mysensor", ("Cp", "D"), ("hole",)),
            ("mysensor", ("Cp", "D"), ()),
        ]
        assert [(r.y_ohm, r.baked, r.batch) for r in log.readings(specimen=NAME)] == [
            ((660.0,), False, "film-study"),
            ((648.1,), True, "film-study"),
        ]
        assert [r.specimen for r in log.recordings()] == [NAME]
    assert (tmp_path / "anchors.txt").exists()
    assert (tmp_path / "backup.zip").exists()
    assert list((tmp_path / "lab-share" / "records").iterdir())


@pytest.mark.parametrize("line", re.findall(r"\n\| (`.*?) \| (.*?) \|", PAGE.partition("written | read as")[2]))
def test_the_table_of_values(line):
    for words in re.findall("`(.*?)`", line[0]):
        found = parse(words)
        said = line[1].replace("1 200 000", "1200000").replace("1.1 Mohm", "1100000 ohm")
        assert len(found.ohm) == (2 if "two readings" in said else 1)
        if "two" not in said and "infinite" not in said:
            assert f"{found.ohm[0]:g}".replace("1.2e+06", "1200000").replace("1.1e+06", "1100000") in said


def test_the_example_in_python(run, path):
    run("import", "--thesis")
    code = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1]
    exec(compile(code, "docs/log.md", "exec"), {"print": lambda *_: None})
