"""``sensorgen invert``: files in, files out, one line for what is wrong."""

import csv
import io
import json
import os
import subprocess
import sys
import threading
from functools import cache

import numpy as np
import pytest

from sensorgen.design.design import make
from sensorgen.prediction.bodies import default_body
from sensorgen.prediction.sensor_model import sensor_model

TONES = {"1.1kHz": 1.1e3, "10.1kHz": 10.1e3, "99.7kHz": 99.7e3, "0.5MHz": 5e5}
QUIET = ["--noise", "0.01%"]  # as printed the film is 0.2 mm, and presses of 1 N are lost in the usual noise
DESIGN = ["tri", "--dielectric", "0.1", "--perfect", "--material", "electrode=etpu@thesis-3.2"]
SLOTS = {"top_electrode": "etpu@thesis-3.2", "bottom_electrode": "etpu@thesis-3.2"}
PLAIN = {"shape": "tri", "parameters": {"dielectric_mm": 0.1}, "materials": SLOTS}
FORCE, POSITION = np.array([1.0, 2.0, 3.0, 5.0]), np.array([20.0, 40.0, 60.0, 75.0])


@cache
def sensor():
    """The model behind the command, computed once: most tests look at words."""
    return sensor_model(default_body(make(PLAIN)))[0].sensor


def table(force=FORCE, position=POSITION, extra=()):
    z = sensor().impedance(np.array(list(TONES.values())), force[:, None], position[:, None] * 1e-3)
    names = [f"{part}_ohm_{tone}" for tone in TONES for part in ("re", "im")]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time_s", *names, *extra])
    for k, row in enumerate(z):
        writer.writerow([k / 10, *(v for value in row for v in (value.real, value.imag)), *(["a,b"] * len(extra))])
    return out.getvalue()


def answers(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_there_and_back(run, tmp_path):
    (tmp_path / "m.csv").write_text(table(extra=["label", "force_n"]))
    said = run("invert", *DESIGN, "m.csv", *QUIET, "-o", "o.csv").ok
    assert "4 samples: 4 ok" in said.out
    assert "median standard errors: force 0.07" in said.out
    rows = answers((tmp_path / "o.csv").read_text())
    assert [float(r["force_n"]) for r in rows] == pytest.approx(FORCE, abs=1e-8)
    assert [float(r["position_mm"]) for r in rows] == pytest.approx(POSITION, abs=1e-5)
    assert [r["time_s"] for r in rows] == ["0.0", "0.1", "0.2", "0.3"]
    assert {r["label"] for r in rows} == {r["force_n_given"] for r in rows} == {"a,b"}
    assert {r["status"] for r in rows} == {"ok"}
    assert {r["tones"] for r in rows} == {"4"}
    for row in rows:
        low, high = float(row["position_low_mm"]), float(row["position_high_mm"])
        assert high - low == pytest.approx(2 * 1.6449 * float(row["position_error_mm"]), rel=1e-3)
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_the_covariance_is_the_bound_in_newtons_and_millimetres(run, tmp_path):
    (tmp_path / "m.csv").write_text(table())
    run("invert", *DESIGN, "m.csv", "-o", "o.csv")
    for row, force, position in zip(answers((tmp_path / "o.csv").read_text()), FORCE, POSITION, strict=True):
        z, by_force, by_position = sensor().response(np.array(list(TONES.values())), force, position * 1e-3)
        j = np.stack([by_force / abs(z), by_position * 1e-3 / abs(z)], -1) / 1e-3
        bound = np.linalg.inv((j.conj().T @ j).real)
        assert float(row["covariance_n_mm"]) == pytest.approx(bound[0, 1], rel=0.02)
        assert float(row["force_error_n"]) == pytest.approx(np.sqrt(bound[0, 0]), rel=0.01)
        assert float(row["position_error_mm"]) == pytest.approx(np.sqrt(bound[1, 1]), rel=0.01)


def test_predictions_come_back(run, tmp_path):
    design = [word for word in DESIGN if word != "--perfect"]
    assert run("predict", *design, "--csv", "--force", "2:4:1", "--position", "20,50,70", "-o", "p.csv").ok
    assert run("invert", *DESIGN, "p.csv", *QUIET, "-o", "o.csv").code == 0
    for row in answers((tmp_path / "o.csv").read_text()):
        assert float(row["force_n"]) == pytest.approx(float(row["force_n_given"]), abs=1e-8)
        assert float(row["position_mm"]) == pytest.approx(float(row["position_mm_given"]), abs=1e-5)


def test_json_and_the_terminal(run, tmp_path):
    (tmp_path / "m.csv").write_text(table())
    (tmp_path / "d.yaml").write_text(json.dumps(PLAIN))
    said = run("invert", "d.yaml", "--perfect", "m.csv", "--json")
    told = json.loads(said.out.rpartition("\n--output")[0] or said.out)
    assert told["samples"] == 4
    assert told["statuses"] == {"ok": 4}
    assert told["frequency_hz"] == list(TONES.values())
    said = run("invert", *DESIGN, "m.csv", "-o", "-")
    assert len(answers(said.out)) == 4
    assert "4 samples" in said.err


def test_blank_where_the_reading_does_not_say(run, tmp_path):
    (tmp_path / "m.csv").write_text(table(np.array([0.0, 3.0]), np.array([50.0, 50.0])))
    run("invert", *DESIGN, "m.csv", "-o", "o.csv")
    none, some = answers((tmp_path / "o.csv").read_text())
    assert none["status"] == "force only"
    assert none["position_mm"] == none["position_low_mm"] == ""
    assert abs(float(none["force_n"])) < 1e-6
    assert some["status"] == "ok"
    run("invert", *DESIGN, "m.csv", "-o", "o.csv", "--prior", "uniform")
    none, _ = answers((tmp_path / "o.csv").read_text())
    assert float(none["position_mm"]) == pytest.approx(50, abs=8)
    assert 80 < float(none["position_high_mm"]) - float(none["position_low_mm"]) < 100


def test_what_to_do_is_said(run, tmp_path):
    (tmp_path / "m.csv").write_text(table(np.zeros(3), np.full(3, 50.0)))
    assert "average them, choose frequencies nearer" in run("invert", *DESIGN, "m.csv").words
    (tmp_path / "m.csv").write_text(table())
    said = run("invert", "tri", "--perfect", "--dielectric", "0.2", "m.csv")
    assert "no fit" in said.out
    assert "times the noise" in said.out


def test_one_tone_says_so(run, tmp_path):
    z = sensor().impedance(99.7e3, 3.0, 0.05)
    (tmp_path / "m.csv").write_text(f"re_ohm_99.7kHz,im_ohm_99.7kHz\n{z.real},{z.imag}\n")
    assert "note: one frequency gives two numbers for two unknowns" in run("invert", *DESIGN, "m.csv").out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.csv"], "cannot read 'none.csv'"), (["."], "is a folder"), ([], "MEASURED.csv"),
        (["m.csv", "--noise", "0"], "a noise of 0"), (["m.csv", "--noise", "x"], "is not a share"),
        (["m.csv", "--prior", "x"], "--prior 'x': expected uniform"),
        (["m.csv", "--prior", "force=a+-1"], "not a force"),
        (["m.csv", "--prior", "force=1+-0"], "standard deviation above 0"),
        (["m.csv", "--force-limit", "0"], "--force-limit: 0; expected above 0"),
        (["m.csv", "--force-limit", "x"], "--force-limit"),
        (["m.csv", "-o", "."], "cannot write '.'"), (["m.csv", "-o", "m.csv/x.csv"], "cannot write 'm.csv/x.csv'"),
        (["bad.csv", "-o", "o.csv"], "bad.csv, row 6, column re_ohm_1.1kHz: 'x' is not a number"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(run, tmp_path, words, said):
    text = table()
    (tmp_path / "m.csv").write_text(text)
    (tmp_path / "bad.csv").write_text(text + "1,x,2,3,4,5,6,7,8\n")
    assert said in run("invert", *DESIGN, *words).refusal
    assert not (tmp_path / "o.csv").exists()
    assert not [p for p in tmp_path.iterdir() if p.name.endswith(".part")]


def test_an_older_answer_survives_an_error(run, tmp_path):
    (tmp_path / "o.csv").write_text("mine")
    (tmp_path / "bad.csv").write_text(table() + "1,x,2,3,4,5,6,7,8\n")
    assert run("invert", *DESIGN, "bad.csv", "-o", "o.csv").code == 2
    assert (tmp_path / "o.csv").read_text() == "mine"


def test_in_real_time_readings_that_wait_are_dropped_and_counted(run, monkeypatch):
    """Four rows have come before the first is worked off: the newest is answered, as it would be anyway."""
    text = table()

    def said(*words):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        return run("invert", *DESIGN, "-", *QUIET, *words)

    every, newest = said(), said("--newest")
    assert (len(answers(every.out)), len(answers(newest.out))) == (4, 1)
    (only,), last = answers(newest.out), answers(every.out)[-1]
    assert all(only[name] == last[name] for name in ("time_s", "force_n", "position_mm", "status"))
    assert "3 readings were dropped for newer ones" in newest.err
    assert "dropped" not in every.err


def test_a_pipe_is_answered_line_by_line(tmp_path):
    head, *rows = table().splitlines(keepends=True)
    process = subprocess.Popen(
        [sys.executable, "-m", "sensorgen", "invert", *DESIGN, "-"], cwd=tmp_path, encoding="utf-8", bufsize=1,
        env={k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    hung = threading.Timer(120, process.kill)  # an answer that is held back would be waited for without end
    hung.start()
    process.stdin.write(head)
    process.stdin.flush()
    assert process.stdout.readline().startswith("time_s,force_n,position_mm")
    for row, force in zip(rows, FORCE, strict=True):
        process.stdin.write(row)
        process.stdin.flush()
        assert float(process.stdout.readline().split(",")[1]) == pytest.approx(force, abs=1e-8)
    out, err = process.communicate(timeout=30)
    hung.cancel()
    assert (process.returncode, out) == (0, "")
    assert "4 samples: 4 ok" in err
