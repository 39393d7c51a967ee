"""``sensorgen bench hysteresis|sets|live`` on runs whose truth is known."""

import csv
import io
import re
import sys

import made
import numpy as np
import pytest
import scipy.io
from scipy.signal import sosfreqz

from sensorgen.measure.signal.lowpass import sections

TONES = made.TONES_HZ[::3]
SLOW = made.presses(4, seed=3, dwell_s=8, rest_s=6, least_n=2.0)  # up for four seconds, down for four


def write(folder, name, plan, **how):
    """A run's two files."""
    ramp = how.get("ramp_s", 0.2)
    lived = made.run(plan, rate_hz=70, tones_hz=TONES, **how)
    tree = made.tree([lived.impedance_ohm], [lived.time_s], made.stamps(lived.time_s), (TONES,))
    scipy.io.savemat(folder / f"{name}.mat", tree)
    made.write_rig(folder / f"{name}.csv", made.rig_rows(plan, 3.2, ramp_s=ramp))
    return lived


def apart(lived, plan, k):
    """Largest distance of X on both ways over its span, by the readings without noise: press by press."""
    found = []
    for start, end, force, _ in plan:
        during = (lived.time_s >= start) & (lived.time_s <= end)
        x = (lived.clean_ohm * np.exp(lived.drift))[during, k].imag
        f = lived.force_n[during]
        top = np.argmax(f)
        at = np.linspace(0.1 * force, 0.9 * force, 200)
        both = np.interp(at, f[:top], x[:top]), np.interp(at, f[top:][::-1], x[top:][::-1])
        found.append(np.abs(both[0] - both[1]).max() / np.ptp(x))
    return np.array(found)


def test_hysteresis_of_a_film_that_answers_slowly(run, tmp_path):
    lived = write(tmp_path, "slow", SLOW, law=made.answering(0.01, 3.0), noise=2e-4, ramp_s=4.0)
    said = run("bench", "hysteresis", "slow.mat", "--rig", "slow.csv", "--plot", "ways.png").clean
    lines = said.out.splitlines()
    assert lines[-1] == "ways.png"
    assert len([line for line in lines if "kHz" in line]) == 2 * len(SLOW)
    assert (tmp_path / "ways.png").read_bytes().startswith(b"\x89PNG")
    data = run("bench", "hysteresis", "slow.mat", "--rig", "slow.csv", "--json").json
    assert data["tones_hz"] == TONES.tolist()
    for k in (0, -1):
        shares = np.array([press["share_im"][k] for press in data["presses"]])
        truth = apart(lived, SLOW, k)
        np.testing.assert_allclose(shares, truth, rtol=0.15, atol=0.01)
        assert truth.max() > 0.03
        assert (shares > 10 * np.array([press["error_im"][k] for press in data["presses"]])).any()
    np.testing.assert_allclose([p["force_n"][1] for p in data["presses"]], [m[2] for m in SLOW], atol=0.1)


def test_a_film_that_answers_at_once_has_next_to_none(run, tmp_path):
    write(tmp_path, "fast", SLOW, creep=0.02, noise=2e-4, ramp_s=4.0)
    data = run("bench", "hysteresis", "fast.mat", "--rig", "fast.csv", "--json").json
    for press in data["presses"]:
        assert all(share < 5 * error for share, error in zip(press["share_im"], press["error_im"], strict=True))
        assert max(press["error_im"]) < 0.1
    count, total = re.search(
        r"(\d+) of (\d+) distances", run("bench", "hysteresis", "fast.mat", "--rig", "fast.csv").out
    ).groups()
    shares = [(p[f"share_{x}"][k], p[f"error_{x}"][k]) for p in data["presses"] for k in (0, -1) for x in ("re", "im")]
    assert (int(count), int(total)) == (sum(share < 3.2 * error for share, error in shares), len(shares))
    high = run("bench", "hysteresis", "fast.mat", "--rig", "fast.csv", "--threshold", "20").line
    assert "nothing pressed" in high
    assert "no log of a rig" in run("bench", "hysteresis", "fast.mat").line
    assert "ends in .png" in run("bench", "hysteresis", "fast.mat", "--rig", "fast.csv", "--plot", "a.jpg").line


@pytest.mark.usefixtures("unpainted")
def test_sets_on_one_scale_and_in_a_table(run, tmp_path):
    plans = {name: made.presses(6, seed=seed) for name, seed in (("a", 1), ("b", 2))}
    for k, (name, plan) in enumerate(plans.items()):
        write(tmp_path, name, plan, noise=1e-4, seed=k)
    words = ("bench", "sets", "a.mat", "b.mat", "--rig", "a.csv", "--rig", "b.csv")
    said = run(*words, "-o", "sets.csv", "--plot", "sets.png").clean
    lines = said.out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["a.mat", "a.mat", "b.mat", "b.mat", "sets.csv", "sets.png"]
    rows = list(csv.DictReader((tmp_path / "sets.csv").read_text().splitlines()))
    assert [row["set"] for row in rows] == ["a.mat"] * 6 + ["b.mat"] * 6
    of = made.sensor()
    for name, plan in plans.items():
        own = [row for row in rows if row["set"] == f"{name}.mat"]
        x = np.array([of.impedance(TONES, f, at * 1e-3).imag[0] for *_, f, at in plan])
        expected = (x - x.min()) / np.ptp(x)
        np.testing.assert_allclose([float(row["im_share_1.1kHz"]) for row in own], expected, atol=0.01)
        np.testing.assert_allclose([float(row["force_n"]) for row in own], [m[2] for m in plan], atol=0.03)
    assert run(*words, "--together", "-o", "sets.csv").code == 0
    rows = list(csv.DictReader((tmp_path / "sets.csv").read_text().splitlines()))
    shares = np.array([float(row["im_share_1.1kHz"]) for row in rows])
    assert (shares.min(), shares.max()) == (0, 1)
    assert not all((half.min(), half.max()) == (0, 1) for half in (shares[:6], shares[6:]))
    data = run(*words, "--json").json
    assert list(data["sets"]) == ["a.mat", "b.mat"]
    assert np.shape(data["sets"]["a.mat"]["difference_im_ohm"]) == (6, len(TONES))
    assert "1 --rig for 2 recordings" in run(*words[:-2]).line
    assert "forces are not known" in run(*words[:4]).line
    assert "'a.mat' twice" in run("bench", "sets", "a.mat", "a.mat", "--rig", "a.csv", "--rig", "a.csv").line
    for number, name in enumerate(plans, 1):
        assert run("log", "bench", f"26 triX .1mm {number}", f"{name}.mat", f"{name}.csv").code == 0
    assert "recording 2" in run("bench", "sets", "1", "2").out


def test_sets_of_other_tones_are_refused(run, tmp_path):
    write(tmp_path, "a", made.presses(3), noise=1e-4)
    lived = made.run(made.presses(3), rate_hz=70, tones_hz=TONES[:2])
    tree = made.tree([lived.impedance_ohm], [lived.time_s], made.stamps(lived.time_s), (TONES[:2],))
    scipy.io.savemat(tmp_path / "b.mat", tree)
    assert "expected [1100.0" in run("bench", "sets", "a.mat", "b.mat", "--rig", "a.csv", "--rig", "a.csv").line


def test_readings_are_filtered_as_they_come(run, tmp_path):
    """A wave far below the cut-off comes through delayed, one far above is gone: by the filter's response alone."""
    rate, low, high = 50.0, 0.05, 5.0
    t = np.arange(6000) / rate
    z = 100 + 10 * np.cos(2 * np.pi * low * t) + 3 * np.cos(2 * np.pi * high * t) - 40j
    rows = "".join(f'"n, {k}",{v.real:.9f},{v.imag:.9f}\n' for k, v in enumerate(z))
    (tmp_path / "a.csv").write_text("note,re_ohm_1kHz,im_ohm_1kHz\n" + rows)
    said = run("bench", "live", "a.csv", "--rate", "50Hz").clean
    table = list(csv.DictReader(said.out.splitlines()))
    assert [row["note"] for row in table[:2]] == ["n, 0", "n, 1"]
    found = np.array([complex(float(row["re_ohm_1kHz"]), float(row["im_ohm_1kHz"])) for row in table])
    np.testing.assert_allclose(found.imag, -40, atol=1e-9)  # from the first row on
    gain = sosfreqz(sections(rate), [low], fs=rate)[1][0]
    expected = 100 + 10 * (gain * np.exp(2j * np.pi * low * t)).real
    late = t > 30
    np.testing.assert_allclose(found.real[late], expected[late], atol=0.01)


def test_a_stream_is_answered_row_by_row(run, tmp_path, monkeypatch):
    table = b"re_ohm_1kHz,im_ohm_1kHz\n5,1\n,\n0,0\n5,1\n"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(table), encoding="utf-8"))
    said = run("bench", "live", "-", "--rate", "140")
    assert (said.code, said.out) == (0, "re_ohm_1kHz,im_ohm_1kHz\n5,1\n,\n,\n5,1\n")
    assert "a cut-off of 80 Hz at 140 samples/s" in run("bench", "live", "-", "--rate", "140", "--cutoff", "80").line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("live", "none.csv", "--rate", "1"), "none.csv"),
        (("live", "-"), "--rate"),
        (("show", "a.mat", "--drift", "cubic"), "unknown law of drift 'cubic'"),
        (("show", "a.mat", "--drift", "line", "--keep-drift"), "--keep-drift and --drift line at once"),
    ],
)
def test_wrong_words_are_told(run, tmp_path, words, said):
    write(tmp_path, "a", made.presses(2))
    found = run("bench", *words)
    assert found.code == 2
    assert said in found.err
