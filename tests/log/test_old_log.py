"""What commit 0645a80 wrote is read by today's code: a log with every kind of row, and the files beside it."""

import csv
import json
import re
import shutil
from pathlib import Path

import pytest

from in_process import captured
from sensorgen.design.design import make

OLD = Path(__file__).parents[1] / "reference" / "0645a80"
TABLES = ("batches", "bench-runs", "predictions", "prints", "raw-files", "readings")
ROWS = 21  # as `log verify` of 0645a80 counted them
SPECIMENS = {  # rows that `log show` of 0645a80 printed: readings with corrected ones, recordings, predictions
    "59 triX .2mm": (1, 1, 1),
    "59 triX .2mm 2": (1, 0, 1),
    "59 triY .2mm": (1, 0, 0),
    "59 sqXY .1mm x fine": (1, 0, 0),
    "60 triX .2mm 1 fine": (2, 0, 1),
    "60 triX .2mm 2 fine": (0, 0, 1),
    "60 SX60 1 fine": (1, 0, 1),
}


@pytest.fixture
def command(capfd, monkeypatch, tmp_path):
    """Run a command in this process, in an empty folder; gives what it printed; ``code`` None is any exit code."""
    monkeypatch.chdir(tmp_path)

    def call(*words, code=0):
        said = captured(capfd, monkeypatch, *words)
        assert code in (said.code, None), said.err
        return said.out

    return call


@pytest.fixture
def old(path):
    """A copy of the old log with its raw files, where the command line looks for the log."""
    shutil.copyfile(OLD / "log.db", path)
    shutil.copytree(OLD / "log.db.files", path.with_name(f"{path.name}.files"))
    return path


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def as_then(rows, before):
    """Rows with the columns that the old version had: a later one may add some."""
    return [{name: row[name] for name in then} for row, then in zip(rows, before, strict=True)]


def as_imported(before):
    """Old rows as a new log has them: logged today, what the old export states is a claim that nothing proves."""
    return [{**row, "logged_at": "", "claimed_at": row["logged_at"]} for row in before]


def undated(rows):
    """Rows of today without the time of today."""
    return [{**row, "logged_at": ""} for row in rows]


def test_every_row_comes_out_as_it_went_in(old, command, tmp_path):
    """The old version's own export beside today's, cell for cell; no table has more rows or fewer."""
    command("log", "export", tmp_path / "now")
    for name in TABLES:
        before, now = table(OLD / "export" / f"{name}.csv"), table(tmp_path / "now" / f"{name}.csv")
        assert as_then(now, before) == before, name


def test_every_specimen_is_shown_with_all_its_rows(old, command):
    readings = {row["uid"]: row for row in table(OLD / "export" / "readings.csv")}
    for specimen, counts in SPECIMENS.items():
        rows = json.loads(command("log", "show", specimen, "--json"))
        kinds = [sum(column in row for row in rows) for column in ("y_words", "facts", "data")]
        assert tuple(kinds) == counts, specimen
        for row in (row for row in rows if "y_words" in row):
            then, same = readings[row["uid"]], ("written", "y_words", "z_words", "remark", "design_id", "batch")
            assert [row[key] for key in same] == [then[key].removeprefix("'") for key in same]


def test_a_correction_stands_for_the_reading_that_it_corrects(old, command):
    current = json.loads(command("log", "list", "--json", "--iteration", 60))["readings"]
    assert [row["y_ohm"] for row in current if row["specimen"] == "60 triX .2mm 1 fine"] == [[1200.0]]
    first, second = (json.loads(command("log", "show", number, "--json"))[0] for number in (1, 2))
    assert second["supersedes"] == first["uid"]


def test_the_old_log_is_sound(old, command):
    """Verified: the database, what refers to what, predictions by their hashes, raw files by their SHA-256."""
    assert f"{ROWS} rows" in command("log", "verify")


def test_reports_find_the_predictions_that_were_stored_before_measuring(old, command):
    found = command("report", "--iteration", 60, "--format", "json", "-o", "-")
    assert "60 triX .2mm 1 fine" in found
    assert found.count("stored 2026-11-22T10:34:01") >= 2, "of both designs of the bed"


def test_the_old_recording_opens(old, command):
    shown = command("bench", "show", 1)
    assert "275 samples" in shown
    assert "1.1 kHz, 99.7 kHz" in shown
    assert re.search(r"presses +4", shown)


def test_rows_are_added_to_the_old_log(old, command):
    command("log", "multimeter", "59 triX .2mm 5", "--y", "2.7k", "--z", "OL")
    command("log", "predict", "reference")
    assert f"{ROWS + 3} rows" in command("log", "verify"), "the design of the prediction too"


def test_the_old_export_is_imported(command, path, tmp_path):
    folder = Path(shutil.copytree(OLD / "export", tmp_path / "export"))
    (folder / "files").mkdir()
    for raw in (OLD / "log.db.files").rglob("*.*"):
        shutil.copyfile(raw, folder / "files" / raw.stem)
    assert f"{ROWS} of {ROWS} rows logged" in command("log", "import", folder)
    command("log", "verify")
    command("log", "export", tmp_path / "now")
    before = table(OLD / "export" / "readings.csv")
    assert as_then(undated(table(tmp_path / "now" / "readings.csv")), as_imported(before)) == as_imported(before)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_old_readings_in_every_format_are_the_same(suffix, command, path, tmp_path):
    """Of another log of that commit, with an overload, a correction and doubts."""
    before = table(OLD / "other" / "readings.csv")
    command("log", "import", OLD / "other" / f"readings.{suffix}")
    command("log", "export", tmp_path / "now.csv")
    assert as_then(undated(table(tmp_path / "now.csv")), as_imported(before)) == as_imported(before)


def test_the_old_record_of_a_batch_is_imported(command, path):
    """Three specimens of two designs, the designs, their predictions, the bed and its file."""
    (record,) = (OLD / "log.db.files").rglob("*.json")
    assert "9 of 9 rows logged" in command("log", "import", record)
    rows = json.loads(command("log", "show", "60 triX .2mm 1 fine", "--json"))
    (data,) = (row["data"] for row in rows if "data" in row)
    expected = data if isinstance(data, dict) else json.loads(data)
    assert expected["capacitance_f"]["lower"] == pytest.approx(12.84e-12, rel=1e-3)
    assert expected["printed"]["prusa"]["electrode_gap_mm"]["printed"] == [0.3, 0.3]


@pytest.mark.parametrize(("file", "key"), [("design.json", "7f4cf270ac4e80a1"), ("own.yaml", "c0d91538dfb4aabc")])
def test_old_designs_are_the_same_designs(command, file, key):
    """Their identity is what finds stored predictions."""
    assert json.loads(command("check", OLD / file, "--json", code=None))["design"] == key


def test_a_design_of_default_electrodes_knows_what_it_was():
    """Their default resistivity is another one since: another sensor; stored predictions are found."""
    now, named = make({"shape": "tri"}), dict.fromkeys(("top_electrode", "bottom_electrode"), "etpu@thesis-d.1")
    assert now.id() != "7f4cf270ac4e80a1"
    assert now.ids() == {now.id(), "7f4cf270ac4e80a1"}
    assert make({"shape": "tri", "materials": named}).id() not in now.ids()


def test_an_old_fit_is_a_source(command, monkeypatch, tmp_path):
    monkeypatch.setenv("SENSORGEN_MATERIALS", str(tmp_path / "materials"))
    (tmp_path / "materials").mkdir()
    shutil.copy(OLD / "fit-59.yaml", tmp_path / "materials")
    said = json.loads(command("predict", "reference", "--material", "electrode=etpu@fit-59", "--json"))
    text = json.dumps(said)
    assert "fit-59" in text
    assert "0.145163" in text


def test_a_folder_that_the_old_version_built_is_taken_over(command, tmp_path):
    """Files that only the old manifest lists go; a user's own stay."""
    folder = tmp_path / "out" / "reference"
    folder.mkdir(parents=True)
    manifest = json.loads((OLD / "manifest.json").read_text("utf-8"))
    manifest["files"]["gone.txt"] = next(iter(manifest["files"].values()))
    (folder / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    for name in ("gone.txt", "mine.txt"):
        (folder / name).write_text("before", "utf-8")
    command("build", "reference", "--no-cad")
    assert not (folder / "gone.txt").exists()
    assert (folder / "mine.txt").read_text("utf-8") == "before"
