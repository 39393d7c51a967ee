"""Recordings of the bench: counted, joined with the rig, and kept whole under their SHA-256."""

import json
import re
from hashlib import sha256

import made
import numpy as np
import pytest
import scipy.io

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.measure.log import Log, RawFile, bench, files, verify
from sensorgen.measure.log.bench import log_recording, read_again
from sensorgen.measure.recording import joined_all

MADE = made.presses(8)
OFFSET_S = 3.217


@pytest.fixture(scope="module")
def run_files(tmp_path_factory):
    """A run of seven tones with 14 samples skipped, and the rig's log whose clock is late and has two errors."""
    folder = tmp_path_factory.mktemp("run")
    run = made.run(MADE)
    z = run.impedance_ohm.copy()
    z[1400:1414] = 0
    content = made.tree([z], [run.time_s], made.stamps(run.time_s))
    scipy.io.savemat(folder / "run.mat", content)
    errors = {3: "stalled", 90: "stalled"}
    return folder / "run.mat", made.write_rig(folder / "rig.csv", made.rig_rows(MADE, OFFSET_S), errors)


def test_files_are_kept_whole_and_what_was_counted_beside_them(log, run_files):
    mat, rig = run_files
    (run,) = log_recording(log, "26 triX .1mm", mat, rig, remark="first of the day")
    assert log.recordings(iteration=26) == (run,)
    assert (run.file, run.rig_file) == tuple(sha256(path.read_bytes()).hexdigest() for path in run_files)
    for kept, path in zip(log.entries(RawFile), run_files, strict=True):
        place = files.place(log.files, kept)
        assert place.read_bytes() == path.read_bytes()
        assert (kept.name, kept.size, place.suffix) == (path.name, path.stat().st_size, path.suffix)
        assert place.stat().st_mode & 0o777 == 0o444
    assert (run.design, run.remark, run.source) == ("trix-d0.1", "first of the day", "run.mat")
    assert list(verify.faults(log)) == []
    facts = json.loads(run.facts)
    (lockin,) = facts["lockins"]
    assert lockin["tones_hz"] == pytest.approx(made.TONES_HZ.tolist())
    assert lockin["counts"]["zero"] == 14
    assert lockin["counts"]["samples"] == len(made.run(MADE).time_s)
    assert 0 < lockin["counts"]["transient"] < 40
    assert lockin["rate_hz"] == pytest.approx(140, rel=1e-3)
    assert facts["rig"]["errors"] == 2
    assert 10 < facts["rig"]["samples"] < 60  # two rows of 50 ms, and what lies before the rig's first
    assert facts["rig"]["offset_s"] == pytest.approx(OFFSET_S + 0.03, abs=4 * facts["rig"]["offset_error_s"])


def test_every_lock_in_is_joined_with_the_rig(log, run_files, tmp_path):
    lived = made.run(MADE)
    noise = np.random.default_rng(1).standard_normal((len(lived.time_s), 2))
    dead = 41 * np.exp(1e-3 * noise + 0j)  # a shorted sensor on the first lock-in
    tones = (made.TONES_HZ[:2], made.TONES_HZ)
    tree = made.tree([dead, lived.impedance_ohm], [lived.time_s] * 2, made.stamps(lived.time_s), tones)
    scipy.io.savemat(tmp_path / "two.mat", tree)
    (run,) = log_recording(log, "26 triX .1mm", tmp_path / "two.mat", run_files[1])
    facts = json.loads(run.facts)
    assert facts["rig"]["offset_s"] == pytest.approx(OFFSET_S + 0.03, abs=4 * facts["rig"]["offset_error_s"])
    marked = [lockin["counts"]["rig error"] for lockin in facts["lockins"]]
    assert marked[0] == marked[1] == facts["rig"]["samples"] > 10


def test_columns_of_csv_by_other_names_are_kept_to_read_it_again(run, path, run_files, tmp_path):
    lived = made.run(MADE, tones_hz=made.TONES_HZ[:1])
    rows = zip(lived.time_s, lived.impedance_ohm[:, 0], strict=True)
    lines = "".join(f"{t},{z.real},{z.imag}\n" for t, z in rows)
    (tmp_path / "run.csv").write_text(f"t,R,X\n{lines}")
    (tmp_path / "rig.csv").write_text(run_files[1].read_text().replace("time_s", "when", 1))
    words = ["bench", "26 triX", "run.csv", "rig.csv"]
    for option in ("time_s=t", "re_ohm_1.1kHz=R", "im_ohm_1.1kHz=X"):
        assert run(*words).code == 2
        words += ["--column", option]
    assert "rig.csv" in run(*words).line
    assert run(*words, "--rig-column", "time_s=when").code == 0
    with Log(path) as log:
        (row,) = log.recordings()
        raw = log.raw(row.file)
        with pytest.raises(SensorgenError, match="no raw file 'x' in the log"):
            log.raw("x")
    facts = json.loads(row.facts)
    again = made.read(raw, facts["columns"])
    assert again.impedance_ohm[:, 0] == pytest.approx(lived.impedance_ohm[:, 0])
    assert facts["rig_columns"] == {"when": "time_s"}


def test_a_sensor_with_a_hole_is_logged_although_nothing_shows_the_clocks(run, path, run_files, tmp_path):
    """5 Mohm in series hide the force: CSV without stamps, and clocks that do not overlap."""
    lived = made.run(MADE, tones_hz=made.TONES_HZ[:1])
    noise = np.random.default_rng(1).standard_normal(len(lived.time_s))
    ohm = 5e6 * (1 + 1e-4 * noise) + lived.impedance_ohm[:, 0].mean()
    rows = zip(lived.time_s + 1e5, ohm, strict=True)
    lines = "".join(f"{t},{z.real},{z.imag}\n" for t, z in rows)
    (tmp_path / "run.csv").write_text(f"time_s,re_ohm_1.1kHz,im_ohm_1.1kHz\n{lines}")
    said = run("bench", "26 triX", "run.csv", run_files[1])
    assert said.code == 0
    assert "not joined with the rig: the force explains" in " ".join(said.out.split())
    with Log(path) as log:
        (row,) = log.recordings()
        parts, rig = read_again(log, row)
        with pytest.raises(BadInput, match="too little to find the offset"):
            joined_all(next(parts), rig)
    assert row.rig_file


def test_without_a_rig_and_twice(log, run_files):
    (run,) = log_recording(log, "26 triX .1mm", run_files[0])
    assert (run.rig_file, "rig" in json.loads(run.facts)) == ("", False)
    assert log_recording(log, "26-trix-d0.1", run_files[0]) == []
    assert len(log_recording(log, "26 triX .1mm 2", run_files[0])) == 1
    assert (len(log.recordings()), log.count(RawFile)) == (2, 1)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("run.mat", b"MATLAB 5.0 MAT-file" + b" " * 105 + b"\0\1IM" + b"\xff" * 99, "run.mat"),
        ("run.csv", b"time_s,re_ohm_1kHz,im_ohm_1kHz\n0,1,x\n", "run.csv, row 2"),
        ("run.pkl", b"\x80\x04cos\nsystem\n(S'touch pwned'\ntR.", "run.pkl"),
    ],
)  # fmt: skip
def test_a_bad_recording_is_told_and_nothing_is_kept(log, tmp_path, run_files, name, content, message):
    (tmp_path / name).write_bytes(content)
    for pair in ((tmp_path / name, None), (tmp_path / name, run_files[1])):
        with pytest.raises(SensorgenError) as told:
            log_recording(log, "26 triX", *pair)
        assert message in str(told.value)
    with pytest.raises(SensorgenError):
        log_recording(log, "26 triX", run_files[0], tmp_path / name)
    for path in (tmp_path / "none.mat", tmp_path):
        with pytest.raises(SensorgenError, match=r"cannot read|is a folder"):
            log_recording(log, "26 triX", path)
    assert log.recordings() == log.specimens() == ()
    assert not [path for path in log.files.rglob("*") if path.is_file()]
    assert not (tmp_path / "pwned").exists()


def test_a_huge_file_is_refused_before_it_is_read(log, tmp_path, run_files, monkeypatch):
    with (tmp_path / "huge.mat").open("wb") as file:
        file.truncate(1 << 42)  # takes no space
    monkeypatch.setattr(files, "raw_file", lambda path: pytest.fail(f"{path} is read"))
    for pair in ((tmp_path / "huge.mat", None), (run_files[0], tmp_path / "huge.mat")):
        with pytest.raises(SensorgenError, match=r"4398046511104 bytes; expected at most 2147483648: split it"):
            log_recording(log, "26 triX", *pair)


def test_a_recording_that_grows_while_it_is_read_is_refused(log, tmp_path, monkeypatch):
    path = tmp_path / "run.csv"
    rows = "".join(f"{k},-{k},{k}\n" for k in range(1, 99))
    path.write_text(f"re_ohm_1kHz,im_ohm_1kHz,time_s\n{rows}")

    def growing(*paths, summarised=bench.summarised):
        found = summarised(*paths)
        with path.open("a") as file:
            file.write("99,-99,99\n")
        return found

    monkeypatch.setattr(bench, "summarised", growing)
    with pytest.raises(SensorgenError, match="changed while it was read: log it when it is complete"):
        log_recording(log, "26 triX", path)
    assert log.recordings() == ()


def test_the_command_and_the_way_out_and_in_again(run, path, run_files, tmp_path):
    said = run("bench", "26 triX .1mm", *run_files, "--remark", "x")
    assert (said.code, said.err) == (0, "")
    assert "recording 1: 26 triX .1mm" in said.out
    assert "rig's clock + 3.2" in said.out
    assert re.search(r"rows, 2 with errors; \d+ samples beside them", said.out)
    assert "has this very recording" in run("bench", "26 triX .1mm", *run_files).out
    assert "1 recordings" in run("list").out
    assert "no such row" in run("bench", "26 triX .1mm 2", *run_files, "--corrects", "9").line
    run("bench", "26 triX .1mm 2", *run_files, "--corrects", "1")  # it was another specimen
    with Log(path) as log:
        assert [(r.number, r.specimen) for r in log.recordings()] == [(2, "26 triX .1mm 2")]
        assert len(log.recordings(superseded=True)) == 2
    assert json.loads(run("show", "26 triX .1mm", "--json").out)[0]["remark"] == "x"
    again = run("bench", "26 triX .1mm 2", *run_files, "--corrects", "2", "--remark", "y").out  # or its words alone
    assert "corrects   recording 2 of 26 triX .1mm 2" in again
    assert "corrected  by row 3" in run("show", "26 triX .1mm 2").out
    assert "has this very recording" in run("bench", "26 triX .1mm 2", *run_files, "--corrects", "2").out
    assert run("export", "out").code == 0
    assert "5 of 5 rows logged" in run("import", "out", "--log", "new.db").out
