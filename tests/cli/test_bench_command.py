"""``sensorgen bench``: a design in, presses for a rig out; the rig's recording in, what presses change out."""

import csv
import io

import made
import numpy as np
import pytest
import scipy.io

from sensorgen.measure.recording import rig


def test_a_plan_as_csv_stays_on_the_sensor(run):
    said = run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "3").clean
    rows = list(csv.DictReader(io.StringIO(said.out)))
    assert len(rows) == 200
    at, force = ([float(row[name]) for row in rows] for name in ("position_mm", "force_n"))
    assert 10 <= min(at) < 15 < 85 < max(at) <= 90  # the tip's middle on a sensor of 100 mm
    assert 0 <= min(force) < 0.2 < 5.8 < max(force) <= 6
    assert run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "3").out == said.out
    assert run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "4").out != said.out


@pytest.mark.usefixtures("unpainted")
def test_a_plan_as_json_file_and_picture(run, tmp_path):
    table, picture = tmp_path / "plan.csv", tmp_path / "plan.png"
    words = ("bench", "plan", "reference", "--presses", "5", "--repeats", "1", "--force", "1:2:1N", "--dwell", "2")
    data = run(*words, "-o", str(table), "--picture", str(picture), "--json").json
    assert (data["design"], data["repeats"], data["force_n"], len(data["steps"])) == ("reference", 1, [1.0, 2.0], 10)
    assert len(table.read_text().splitlines()) == 11
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(*words, "-o", str(table)).out == f"{table}: 10 presses, 1 min 26 s\n"


MADE = made.presses(12, seed=3, dwell_s=3, rest_s=3)


@pytest.fixture(scope="module")
def lived():
    return made.run(MADE, rate_hz=70, creep=0.02)


@pytest.fixture
def files(tmp_path, lived):
    """A recording with 14 samples skipped, one of two lock-ins, and the log of a rig with two errors."""
    z = lived.impedance_ohm.copy()
    z[1400:1414] = 0
    one, two = (made.stamps(lived.time_s), (made.TONES_HZ, made.TONES_HZ[:2]))
    scipy.io.savemat(tmp_path / "run.mat", made.tree([z], [lived.time_s], one))
    scipy.io.savemat(tmp_path / "two.mat", made.tree([z, z[:4000, :2]], [lived.time_s, lived.time_s[:4000]], one, two))
    return made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE, 3.2), {100: "stalled", 101: "stalled"})


def changed(lived):
    """What each press changes in truth [ohm]."""
    return np.array([made.sensor().impedance(made.TONES_HZ, f, x * 1e-3) for *_, f, x in MADE]) - lived.clean_ohm[0]


def test_a_recording_shows_what_its_presses_change(run, files, lived):
    said = run("bench", "show", "run.mat", "--rig", files).clean
    table = said.out[said.out.index("start [s]") :].splitlines()
    assert len(table) == 1 + len(MADE)
    assert all(len(line) <= 80 and line.count("(") in (0, 4) for line in table)
    assert "99.7kHz" in table[0]
    assert "14 zero, " in said.out
    assert "2 with errors" in said.out
    assert "rig's clock + 3.2" in said.out
    data = run("bench", "show", "run.mat", "--rig", files, "--json").json
    assert data["rig"] == {"rows": len(rig(files).time_s), "errors": 2}
    assert data["counts"]["zero"] == 14
    assert 0.02 < data["drift"] < 0.06
    presses = data["presses"]
    np.testing.assert_allclose([p["force_n"] for p in presses], [m[2] for m in MADE], atol=0.02)
    np.testing.assert_allclose([p["position_mm"] for p in presses], [m[3] for m in MADE], atol=0.01)
    off = np.array([p["difference_im_ohm"] for p in presses]) - changed(lived).imag
    pulls = off / np.array([p["error_im_ohm"] for p in presses])
    assert 0.7 < np.sqrt(np.mean(pulls**2)) < 1.3
    kept = run("bench", "show", "run.mat", "--rig", files, "--json", "--keep-drift").json
    assert kept["drift"] is None
    worse = np.array([p["difference_im_ohm"] for p in kept["presses"]]) - changed(lived).imag
    assert np.mean(np.abs(worse)) > 2 * np.mean(np.abs(off))


@pytest.mark.usefixtures("unpainted")
def test_without_a_rig_presses_are_found_in_the_readings_and_their_forces_are_not_known(run, files):
    said = run("bench", "show", "run.mat")
    assert "found by the readings alone" in said.out
    assert "force [N]" not in said.out
    presses = run("bench", "show", "run.mat", "--json").json["presses"]
    assert len(MADE) - 1 <= len(presses) <= len(MADE)
    assert all(p["force_n"] is None for p in presses)
    assert run("bench", "show", "run.mat", "--plot", "out").out.splitlines()[-1] == "out/time.png"


@pytest.mark.usefixtures("unpainted")
def test_a_recording_of_the_log_by_its_number_with_tables_and_pictures(run, files, tmp_path):
    assert run("log", "bench", "26 triX .1mm", "run.mat", files).code == 0
    (tmp_path / "run.mat").unlink()
    said = run("bench", "show", "1", "--presses", "p.csv", "--filtered", "f.csv", "--plot", "out").clean
    pictures = [f"out/{name}" for name in ("time.png", "resistance.png", "reactance.png", "run.html")]
    assert said.out.splitlines()[-6:] == ["p.csv", "f.csv", *pictures]
    assert all((tmp_path / name).is_file() for name in pictures)
    assert (tmp_path / "out" / "run.html").stat().st_size > 10_000
    filtered = made.read(tmp_path / "f.csv")
    assert filtered.tones_hz.tolist() == made.TONES_HZ.tolist()
    assert filtered.source.rate_hz == pytest.approx(70, rel=1e-3)
    back = run("invert", "tri", "--drawn", "--perfect", "p.csv").clean
    assert f"{len(MADE)} " in back.out
    head, at_rest, *_ = (tmp_path / "p.csv").read_text().splitlines()
    assert head.startswith("time_s,rest,force_n,position_mm,re_ohm_")
    assert at_rest.split(",")[1:4] == ["1.0", "", ""]
    assert run("invert", "tri", "p.csv", "--drawn", "-o", "back.csv").clean
    statuses = [row["status"] for row in csv.DictReader((tmp_path / "back.csv").read_text().splitlines())]
    assert [status == "rest" for status in statuses] == [True, False] * len(MADE)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("two.mat",), "2 lock-ins; choose one with --lockin 1 to 2"),
        (("two.mat", "--lockin", "3"), "--lockin 3: expected 1 to 2"),
        (("run.mat", "--lockin", "2"), "expected 1, the only one"),
        (("none.mat",), "No such file"),
        (("rig.csv",), "rig.csv"),
        (("run.mat", "--rig", "run.mat"), "run.mat"),
        (("run.mat", "--cutoff", "50"), "a cut-off of 50 Hz at 70 samples/s"),
        (("7",), "no log at"),
    ],
)
def test_what_cannot_be_shown_is_told(run, files, words, said):
    assert said in run("bench", "show", *words).refusal


def test_the_log_has_no_such_recording_or_more_than_its_number_is_given(run, files):
    run("log", "bench", "26 triX .1mm", "two.mat", files)
    assert "no recording 7 in" in run("bench", "show", "7").line
    assert "has its rig's log and columns" in run("bench", "show", "1", "--rig", files).line
    said = run("bench", "show", "1", "--lockin", "2")
    assert ("1.1 kHz, 2.3 kHz;" in said.out, said.out.count("lock-in")) == (True, 1)


def test_noise_alone_has_no_presses(run, tmp_path):
    rng = np.random.default_rng(1)
    rows = "".join(f"{k / 50},{100 + x:.6f},{-50 + y:.6f}\n" for k, (x, y) in enumerate(rng.normal(0, 0.1, (3000, 2))))
    (tmp_path / "a.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + rows)
    assert "nothing pressed" in run("bench", "show", "a.csv").out
    (rest,) = run("bench", "show", "a.csv", "--json").json["rest"]
    assert (rest["re_ohm"], rest["im_ohm"]) == pytest.approx((100, -50), abs=4 * 0.1 / 3000**0.5)
    assert rest["noise_re_ohm"] == pytest.approx(0.1, rel=0.06)
    assert rest["capacitance_f"] == pytest.approx(1 / (2 * np.pi * 1e3 * 50), rel=1e-3)
    assert "negative" not in run("bench", "show", "a.csv").out
    (tmp_path / "b.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + rows.replace(",1", ",-1").replace(",9", ",-9"))
    assert "negative resistance at 1kHz" in run("bench", "show", "b.csv").out
    assert "nothing pressed" in run("bench", "show", "a.csv", "--plot", "out").line
    assert "nothing pressed" in run("bench", "show", "a.csv", "--presses", "p.csv").line
    assert not (tmp_path / "p.csv").exists()


def test_a_recording_of_the_log_is_read_by_the_columns_that_were_told(run, tmp_path):
    rng = np.random.default_rng(1)
    rows = "".join(f"{k / 50},{100 + x:.6f},{-50 + y:.6f}\n" for k, (x, y) in enumerate(rng.normal(0, 0.1, (500, 2))))
    (tmp_path / "a.csv").write_text("t,R,X\n" + rows)
    told = ["--column", "time_s=t", "--column", "re_ohm_1kHz=R", "--column", "im_ohm_1kHz=X"]
    assert run("log", "bench", "26 triX", "a.csv", *told).code == 0
    assert "500 samples, 500 of them sound" in run("bench", "show", "1").out
    assert run("bench", "show", "a.csv", *told).code == 0
