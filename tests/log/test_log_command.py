"""``sensorgen log``: words in, words out, and what is asked of a person."""

import json
import subprocess
import sys

import pytest

from sensorgen.core.files import seal
from sensorgen.measure.log import Log, Reading
from sensorgen.measure.log.notes import reading


def test_a_reading_with_everything(run, path):
    said = run(
        "multimeter", "23 tri¥.2mm 3", "--y", "0,6 kΩ", "--z", "65 / 130", "--unbaked", "--remark", "small holes",
        "--measured-at", "4 May 2023",
    )  # fmt: skip
    assert (said.code, said.err) == (0, "")
    for line in (
        "reading 1: 23 triY .2mm 3, written '23 tri¥.2mm 3'",
        "Y 600 ohm, written '0,6 kΩ'",
        "Z 65 ohm, 130 ohm, written '65 / 130'",
        "baked no",
        "remark small holes",
        "measured 4 May 2023",
        "doubtful axes ¥ read as Y",
        f"logged in {path}",
    ):
        assert line in said.words, line


def test_json_for_programs(run):
    (row,) = json.loads(run("multimeter", "23 triX", "--y", "OL", "--z", "1 / OL", "--json").out)
    assert (row["y_ohm"], row["z_ohm"], row["number"], row["baked"]) == (["OL"], [1.0, "OL"], 1, None)
    assert json.loads(run("list", "--json").out)["readings"] == [row]
    told = json.loads(run("import", "--thesis", "--json").out)
    assert told == {"rows": 69, "new": 69, "doubtful": 38, "corrections": 0, "elsewhere": {}, "left_out": []}


WRONG = {
    "nothing": (["23 triX"], "nothing to log; expected --y, --z, --C or"),
    "blank": (["23 triX", "--y", " "], "nothing to log"),
    "value": (["23 triX", "--y", "abc"], "resistance in Y: 'abc' is no resistance; expected a resistance such as 650"),
    "name": (["23 trj", "--y", "1"], "'23 trj' is no specimen's name"),
    "correction": (["23 triX", "--y", "1", "--corrects", "7"], "--corrects 7: no such row"),
    "axis": (["23 triX", "--visa", "x", "--axis", "q"], "unknown --axis 'q'"),
}


@pytest.mark.parametrize(("words", "message"), WRONG.values(), ids=WRONG)
def test_wrong_words_are_told_in_one_line_and_nothing_is_logged(run, path, words, message):
    said = run("multimeter", *words)
    assert said.code == 2
    assert message in said.line
    assert not path.exists() or "0 readings" in run("list").out


def test_other_wrong_words(run, tmp_path):
    assert "unknown command of log 'lst'; did you mean 'list'" in run("lst").line
    assert "neither of FILE and --thesis" in run("import").line
    assert "both of FILE and --thesis" in run("import", "x", "--thesis").line
    assert "--column 'x': expected KEY=VALUE" in run("import", "x.csv", "--column", "x").line
    run("import", "--thesis")
    assert "nothing in" in run("show", "23 triX 99").line
    assert "nothing in" in run("show", "9999").line
    assert "is no specimen's name" in run("show", "xyz").line
    assert run().err.startswith("Usage: sensorgen log")


def test_a_small_m_is_asked_for_on_a_terminal_and_flagged_elsewhere(run, path, monkeypatch):
    assert "m read as mega" in run("multimeter", "23 triX", "--z", "1.1m").out
    asked = []
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.confirm", lambda text, **_: asked.append(text) or len(asked) == 1)
    assert "m read as mega" not in run("multimeter", "23 triX", "--z", "1.1m / 2", "--y", "3m").out
    assert asked == ["3m, 1.1m: is m mega (a million)?"]
    refused = run("multimeter", "23 triX", "--z", "1.1m").line
    assert "'1.1m' is not logged; write M for mega, or 0.0011 for 1.1 milliohm" in refused
    run("multimeter", "23 triX", "--z", "1.1M")
    assert len(asked) == 2
    with Log(path) as log:
        assert [r.z_ohm[0] for r in log.readings()] == [1.1e6] * 3


def test_corrections(run):
    run("multimeter", "23 triX", "--y", "0.65")
    said = run("multimeter", "23 triX", "--y", "0.65k", "--corrects", "1").words
    assert "reading 2" in said
    assert "corrects reading 1 of 23 triX" in said
    assert "row 1 was corrected before, by row 2" in run("multimeter", "23 triX", "--y", "1", "--corrects", "1").line
    listed = run("list").out
    assert "   650  " in listed
    assert "0.65" not in listed
    assert "reading 1:" in run("show", "1").out
    assert [f"reading {k}:" in run("show", "23-trix-d0").out for k in (1, 2)] == [True, True]


def test_hostile_words_do_not_reach_the_terminal(run):
    run("multimeter", "23 triX", "--y", "1", "--remark", "\x1b[2J\x07<b>\u202eevil\n=1", "--measured-at", "\x9b2J")
    for words in (["list"], ["show", "1"], ["show", "23 triX"]):
        out = run(*words).out
        assert "\\x1b[2J\\x07<b>" in out
        assert out.replace("\n", "").isprintable()
    assert "<b>\\u202eevil\\n=1" in out
    assert json.loads(run("list", "--json").out)["readings"][0]["remark"] == "\x1b[2J\x07<b>\u202eevil\n=1"


def test_lists(run, path):
    run("import", "--thesis")
    assert "the latest 40 are shown; --all shows all" in run("list").out
    assert len(run("list", "--all").out.splitlines()) == 69 + 4
    assert len(run("list", "--last", "3").out.splitlines()) == 3 + 5
    assert max(map(len, run("list", "--all").out.splitlines()[:-1])) <= 80
    listed = run("list", "--iteration", "25").out.splitlines()
    assert [line.split()[1:3] for line in listed[1:-3]] == [["25", name] for name in ("triX", "triY", "sqXY", "sqYX")]
    assert listed[-3] == "69 readings, 0 recordings, 0 predictions"
    assert listed[-1] == str(path)


@pytest.mark.usefixtures("roughly")
def test_a_prediction_is_kept_when_it_is_made(run, path):
    first = run("predict", "tri", "--dielectric", "0.1")
    assert "prediction 1: design trix-d0.1" in first.words
    assert "has this very prediction" in run("predict", "tri", "--dielectric", "0.1").out
    run("multimeter", "26 triX .1mm", "--y", "650")
    assert "prediction 1" in run("show", "26 triX .1mm").out
    with Log(path) as log:
        (kept,) = log.predictions()
        assert log.predictions(design_id=kept.design_id) == (kept,)
        assert log.predictions(design_id="x") == ()
        assert log.readings()[0].design_id == kept.design_id
    assert json.loads(kept.data)["capacitance"]["lower"] > 1e-12
    assert "is sound: 3 rows" in run("verify").out


@pytest.mark.usefixtures("roughly")
def test_a_prediction_ahead_of_the_measurement(run, path, tmp_path):
    said = run("multimeter", "26 triX .1mm", "--y", "650", "--predict")
    assert (said.code, said.err) == (0, "")
    assert said.out.index("logged prediction 1") < said.out.index("reading 1")
    again = run("multimeter", "26 triX .1mm 2", "--y", "660", "--predict", "--json")
    assert (json.loads(again.out)[0]["number"], again.err) == (2, "")
    first = run("multimeter", "23 triX .2mm", "--y", "1k", "--predict", "--json")
    assert json.loads(first.out)[0]["number"] == 3
    assert "logged prediction 2" in first.err
    assert "names no design" in run("multimeter", "22 triY 10mm", "--y", "1", "--predict").line
    failed = run("multimeter", "26 triY .1mm", "--visa", "nowhere", "--axis", "y", "--predict")
    assert failed.code == 2  # no meter, but what it should have read is on record
    with Log(path) as log:
        readings, predictions = log.readings(), log.predictions()
        assert [r.design for r in readings] == ["trix-d0.1", "trix-d0.1", "trix-d0.2"]
        assert [p.design for p in predictions] == ["trix-d0.1", "trix-d0.2", "triy-d0.1"]
        assert predictions[0].logged_at <= readings[0].logged_at
        assert predictions[1].design_id == readings[2].design_id


def test_a_print_beds_own_design_is_the_one_that_is_predicted(run, path, tmp_path):
    (tmp_path / "batch.json").write_text(json.dumps(BATCH))
    run("import", "batch.json")
    assert run("multimeter", "26 triX .1mm", "--y", "650", "--predict").code == 0  # the print bed brought its own
    for piece in (bare := json.loads(json.dumps(BATCH)))["specimens"].values():
        del piece["expected"]
    (tmp_path / "batch.json").write_text(json.dumps(bare))
    run("import", "batch.json", "--log", "other.db")
    words = ("multimeter", "26 triX .1mm", "--y", "650", "--predict", "--log", "other.db")
    assert "log a prediction of its file: sensorgen log predict FILE" in run(*words).line
    with Log(path) as log, Log(tmp_path / "other.db") as other:
        assert len(log.predictions()) == 1
        assert other.predictions() == other.readings() == ()


def test_what_slicers_print_is_kept_beside_what_was_drawn(run, path, tmp_path):
    report = {"specimen": "26 triX .1mm", "capacitance_f": {"drawn": {"lower": 1e-11}, "printed": {"lower": 2e-11}}}
    used = {"prusa": {"printed": {"a" * 16: report}}, "cura": {"version": "4"}}
    (tmp_path / "batch.json").write_text(json.dumps(BATCH | {"slicers": used}))
    assert "5 of 5 rows logged" in run("import", "batch.json").out
    with Log(path) as log:
        (kept,) = log.predictions()
    assert json.loads(kept.data) == {"capacitance_f": {"lower": 1e-11}, "printed": {"prusa": report}}
    wrong = {" is 3": 3, ".prusa is []": {"prusa": []}, ".prusa.printed is 'x'": {"prusa": {"printed": "x"}}}
    for message, slicers in wrong.items():
        (tmp_path / "batch.json").write_text(json.dumps(BATCH | {"slicers": slicers}))
        assert f"slicers{message}; expected a mapping" in run("import", "batch.json", "--log", "new.db").line


OF_BATCH = {"design": "trix-d0.1", "design_id": "a" * 16, "expected": {"capacitance_f": {"lower": 1e-11}}}
BATCH = {"batch": "26", "specimens": {"26 triX .1mm": OF_BATCH, "26 triX .1mm 2": OF_BATCH}}


def test_a_print_bed_ties_its_specimens(run, path, tmp_path):
    (tmp_path / "batch.json").write_text(json.dumps(BATCH))
    assert "5 of 5 rows logged" in run("import", "batch.json").out  # both specimens share one prediction
    assert "0 of 5 rows logged" in run("import", "batch.json").out
    assert "near" not in run("multimeter", "26 triX .1mm 2", "--y", "650").out
    near = "hint no print bed here has '26 triX .1mm 2 fine'; near is '26 triX .1mm 2'"
    assert near in run("multimeter", "26 triX .1mm 2 fine", "--y", "650").words
    assert "near" not in run("multimeter", "27 triX .1mm 2", "--y", "650").out
    shown = run("show", "26 triX .1mm 2").words
    assert "batch 26" in shown
    assert "design trix-d0.1 (aaaaaaaaaaaaaaaa)" in shown
    assert "print 2:" in shown
    assert "prediction 1:" in shown
    for text, message in (
        ("{}", "specimens is missing"),
        ('{"specimens": {"x": {"design": "a", "design_id": "b"}}}', "'x' is no specimen's name"),
        ('{"specimens": {"26 triX": {"design": "a"}}}', "specimens.26 triX.design_id is missing"),
        ('{"specimens": {"26 triX": 3}}', "specimens.26 triX is 3; expected a mapping"),
        ("[" * 9999, "not the record of a batch"),
        ("", "is empty; expected the record of a batch"),
    ):
        (tmp_path / "bad.json").write_text(text)
        said = run("import", "bad.json")
        assert said.code == 2
        assert "bad.json" in said.line
        assert message in said.line
    assert "is sound" in run("verify").out


def test_verify_says_what_is_wrong_and_ends_with_1(run, path, tmp_path):
    (tmp_path / "batch.json").write_text(json.dumps(BATCH))
    run("import", "batch.json")
    (file,) = (p for p in path.with_name("log.db.files").rglob("*") if p.is_file())
    file.unlink()
    said = run("verify")
    assert said.code == 1
    assert said.words.startswith("raw file batch.json (")


def test_a_long_list_loads_little(tmp_path):
    """Of 100 000 readings the latest are read, and nothing heavy is loaded for it."""
    path = tmp_path / "log.db"
    with Log(path, create=True) as log:
        one = reading("23 triX .1mm", "650", "40")
        log.add([one])
        number = "WITH RECURSIVE n (k) AS (SELECT 2 UNION ALL SELECT k + 1 FROM n WHERE k < 100000) "
        columns = [name for name, *_ in log._connection.execute("SELECT * FROM record").description]
        new = {"number": "k", "sequence": "k", "uid": "'u' || k", "id": "'i' || k"}
        values = ", ".join(new.get(name, name) for name in columns)
        log._connection.execute(f"INSERT INTO record {number} SELECT {values} FROM record, n WHERE number = 1")
        assert log.count(Reading) == 100_000
    words = [sys.executable, "-X", "importtime", "-m", "sensorgen", "log", "list", "--log", path]
    done = subprocess.run(words, capture_output=True, encoding="utf-8")
    assert "100000 readings" in done.stdout
    assert len(done.stdout.splitlines()) == 45
    loaded = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert not {"numpy", "pydantic", "yaml", "scipy", "build123d", "pyarrow", "sensorgen.design.design"} & loaded


def test_a_print_bed_that_was_changed_by_hand_is_refused(run, tmp_path):
    (tmp_path / "batch.json").write_text(json.dumps(BATCH | {"sha256": seal(BATCH)}))
    assert run("import", "batch.json").code == 0
    (tmp_path / "batch.json").write_text(json.dumps(BATCH | {"batch": "27", "sha256": seal(BATCH)}))
    said = run("import", "batch.json").line
    assert "batch.json: it does not hold what was written; see: sensorgen batch verify FOLDER" in said
