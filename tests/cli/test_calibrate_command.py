"""``sensorgen calibrate`` and ``invert SPECIMEN``: from the bench's files to force and place, in three commands."""

import csv
import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

import in_process
from sensorgen.analysis import calibration
from sensorgen.measure.log import Log, prints
from sensorgen.measure.log.bench import log_recording
from sensorgen.measure.log.entries import Calibration
from virtual_specimen import TONES_HZ, drawn, recorded, session, write_csv

DESIGN = "shape: tri\nname: mine\nparameters:\n  dielectric_mm: 0.2\n"
TRUTH = drawn(3)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A log with a specimen of an own design and one run of known presses, and a calibrated one, with its page."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "mine.yaml").write_text(DESIGN)
    recorded(TRUTH, folder, 24, 1)
    with Log(folder / "log.db", create=True) as log:
        prints.bind(log, ["S1"], str(folder / "mine.yaml"))
        log_recording(log, "S1", folder / "run-lcr.csv", folder / "run-rig.csv")
    shutil.copytree(folder, folder / "calibrated")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SENSORGEN_LOG", str(folder / "calibrated" / "log.db"))
        words = ("calibrate", "S1", "--tip", "5mm", "--drawn", "--page", "cal.html", "--source", "s1.yaml")
        code, said = in_process.run(folder / "calibrated", *words)
    assert code == 0
    (folder / "calibrated" / "said.txt").write_text(said, "utf-8")
    return folder


@pytest.fixture
def bench(run, made, tmp_path, monkeypatch):
    """Commands beside the log with known presses."""
    monkeypatch.setenv("SENSORGEN_LOG", str(tmp_path / "log.db"))
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return run


@pytest.fixture
def after(bench, tmp_path, monkeypatch):
    """Commands beside the log with the calibration."""
    monkeypatch.setenv("SENSORGEN_LOG", str(tmp_path / "calibrated" / "log.db"))
    return bench


def quickly(folder):
    """Record of a calibration as ``calibrate S1 --json`` prints it; no press is held back: ``made`` has these."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibration, "held_out", lambda *_: None)
        patch.setenv("SENSORGEN_LOG", str(folder / "log.db"))
        code, said = in_process.run(folder, "calibrate", "S1", "--tip", "5mm", "--drawn", "--dry-run", "--json")
    assert code == 0
    return json.loads(said)


@pytest.fixture(scope="module")
def alone(made):
    """A calibration by known presses alone."""
    return quickly(made)


def unseen(path, count=100, truth=TRUTH):
    """Readings of other presses, each after one at rest, with what is true beside them."""
    made = session(truth, count, 5, (0.5, 5.5))
    z = np.stack([made.rest_ohm, made.pressed_ohm], 1).reshape(-1, 7)
    true = {"true_n": made.force_n, "true_mm": made.position_m * 1e3}
    both = {name: np.stack([0 * v, v], 1).ravel() for name, v in true.items()}
    rest = np.tile([1.0, 0.0], count)
    write_csv(path, np.arange(2.0 * count) * 5, z, TONES_HZ, rest=rest, **both)


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def written(path, table, names):
    """A table of readings with these columns of it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(table)


def covered(found, name, unit):
    """Share of presses that lie in their intervals."""
    keys = f"{name}_low_{unit}", f"true_{unit}", f"{name}_high_{unit}"
    low, true, high = (np.array([float(row[key]) for row in found]) for key in keys)
    return ((low <= true) & (true <= high)).mean()


def said_by_calibrate(folder):
    return " ".join((folder / "calibrated" / "said.txt").read_text("utf-8").split())


def test_from_files_of_the_bench_to_force_and_place(after, tmp_path):
    said = said_by_calibrate(tmp_path)
    assert "S1, design mine: calibrated by 24 known presses" in said
    assert "of 24 forces and" in said
    page = (tmp_path / "calibrated" / "cal.html").read_text()
    for words in ("Calibration of S1", "each press found again from the others", "what was learnt"):
        assert words in page
    unseen(tmp_path / "m.csv")
    said = after("invert", "S1", "m.csv", "-o", "o.csv").clean
    assert "S1: 100 readings under load (100 at rest)" in said.words
    found = rows(tmp_path / "o.csv")
    assert [row["status"] for row in found[::2]] == ["rest"] * 100
    pressed = found[1::2]
    assert sum(row["status"] == "ok" for row in pressed) > 70
    assert covered(pressed, "force", "n") >= 0.7  # one specimen; over many bench/coverage.py has 0.85 to 0.95
    assert covered(pressed, "position", "mm") >= 0.7


def test_the_record_of_the_log_says_it_all(bench, alone, made):
    with Log(made / "calibrated" / "log.db") as log:
        (row,) = log.entries(Calibration)
    record = json.loads(row.data)
    assert (record["schema"], record["held_out"]["presses"]) == (2, 24)
    assert record["posterior"]["at"] == pytest.approx(alone["posterior"]["at"])
    assert alone["schema"] == 2
    assert len(alone["posterior"]["at"]) == len(alone["values"]) == len(alone["parameters"])
    assert "was never calibrated" in bench("invert", "S1", "none.csv").line


@pytest.mark.usefixtures("roughly")
def test_the_report_has_it(after):
    said = after("report", "S1", "--format", "md", "-o", "-").ok
    assert "S1 is calibrated by 24 known presses; over the prediction: resistance" in said.words
    (told,) = re.findall(r"capacitance ([\d.]+) \(([\d.]+) to ([\d.]+)\)", said.words)
    value, low, high = map(float, told)
    assert low < value < high
    assert "## Calibrated specimens" in said.out


def test_the_readings_of_another_specimen_are_called_so(after, tmp_path):
    unseen(tmp_path / "m.csv", 20, replace(TRUTH, capacitance=TRUTH.capacitance + 0.1))
    said = after("invert", "S1", "m.csv", "-o", "o.csv").ok
    assert "20 changed since calibration" in said.words
    assert "note: C +1" in said.words
    assert "at rest since the calibration: a load or moisture on it, or another specimen" in said.words
    assert {row["status"] for row in rows(tmp_path / "o.csv")[1::2]} == {"changed since calibration"}


def test_a_recheck_with_another_tip_alarms_and_mends(after, tmp_path):
    other = replace(TRUTH, tip_m=9e-3)
    recorded(other, tmp_path, 5, 9, name="again")
    unseen(tmp_path / "m.csv", truth=other)
    assert "no recording of S1" in after("calibrate", "S1", "--recheck").line
    assert after("log", "bench", "S1", "again-lcr.csv", "again-rig.csv").code == 0
    shares, widths = [], []
    for words in ((), ("calibrate", "S1", "--recheck")):
        if words:
            said = after(*words)
            assert said.code == 1, said.err
            assert "ALARM: the calibration no longer held" in said.words
        assert after("invert", "S1", "m.csv", "-o", "o.csv").code == 0
        pressed = rows(tmp_path / "o.csv")[1::2]
        shares.append(covered(pressed, "force", "n"))
        widths.append(np.median([float(row["force_high_n"]) - float(row["force_low_n"]) for row in pressed]))
    assert min(shares) > 0.6  # before, by the allowance for a wider tip
    assert widths[1] < widths[0] / 2


def test_without_a_calibration_the_design_alone_says_so(run, tmp_path, monkeypatch):
    (tmp_path / "mine.yaml").write_text(DESIGN)
    unseen(tmp_path / "m.csv", 30)
    said = run("invert", "mine.yaml", "m.csv", "--drawn", "--tip", "5mm", "-o", "o.csv").ok
    assert " not calibrated" in said.words
    assert " ok" not in said.words
    assert "known presses make them several times narrower" in said.words
    assert covered(rows(tmp_path / "o.csv")[1::2], "force", "n") >= 0.85


def test_readings_at_rest_may_stand_in_a_file_of_their_own(after, tmp_path):
    unseen(tmp_path / "m.csv", 20)
    table = rows(tmp_path / "m.csv")
    for name, part in (("rest.csv", table[:1] * 9), ("pressed.csv", table[1::2])):
        written(tmp_path / name, part, [n for n in table[0] if n not in ("rest", "time_s")])
    refused = after("invert", "S1", "pressed.csv").line
    assert ("a column 'rest'" in refused, "--perfect" in refused) == (True, False)  # that is of designs alone
    said = after("invert", "S1", "pressed.csv", "--rest", "rest.csv", "-o", "o.csv").ok
    assert "stale" not in said.words
    assert len(rows(tmp_path / "o.csv")) == 20


def test_stale_readings_at_rest_are_named(after, tmp_path):
    unseen(tmp_path / "m.csv", 10)
    table = rows(tmp_path / "m.csv")
    for row in table[2:]:
        row["time_s"] = float(row["time_s"]) * 10
    written(tmp_path / "m.csv", table, list(table[0]))
    said = after("invert", "S1", "m.csv")
    assert "9 stale rest" in said.words
    assert "take one before each press" in said.words


MISSING = {
    "nobody": "no design is known of 'nobody'", "S2": "the log has no recording of S2", "S1 S1": "stands twice",
    "S1 --recheck": "was never calibrated", "S1 S2 --recheck": "expected one", "S1 --force-offset 1": "as 0.9+-0.1",
    "S1 --force-offset x+-1": "not a force", "": "SPECIMEN", "S1 S2 --source s1.yaml": "--source of 2 specimens",
    "S1 --recording 4": "no recording 4 of S1; expected one of its own: 1",
}  # fmt: skip


def test_what_is_missing_is_one_line(bench):
    assert bench("log", "specimen", "S2", "--design", "mine.yaml").code == 0
    for words, said in MISSING.items():
        assert said in bench("calibrate", *words.split()).refusal


def meter(truth, frequency_hz):
    """Parallel capacitance [pF] and loss factor that an LCR meter at the contacts would show of a specimen."""
    z = replace(truth, gain=(), lead_ohm=0.0, stray_f=0.0).impedance(0.0, 0.05, frequency_hz=TONES_HZ)[0]
    k = int(np.flatnonzero(frequency_hz == TONES_HZ)[0])
    return (1 / z[k]).imag / (2 * np.pi * frequency_hz) * 1e12, z[k].real / -z[k].imag


def metered(truth, frequency_hz):
    """Words of a log for what a good meter shows of a specimen."""
    c, d = meter(truth, frequency_hz)
    return ("--C", f"{c:.6g}pF@{frequency_hz}Hz", "--D", f"{d:.6g}@{frequency_hz}Hz", "--instrument", "HP 4284A")


def told(found, name):
    return next(v for v in found["values"] if v["name"] == name)


def test_readings_of_meters_count(bench, alone, tmp_path):
    """The same presses with and without them: R, C and stray of the specimen are known better, and still right."""
    for f in (1.1e3, 19.9e3):
        assert bench("log", "add", "S1", *metered(TRUTH, f)).code == 0
    both = quickly(tmp_path)
    assert any("2 readings of meters count" in note for note in both["notes"])
    truth_pf = 64.256829 * np.exp(TRUTH.capacitance)
    one = told(both, "capacitance")
    assert one["lower"] < truth_pf < one["upper"]
    stray = [told(found, "stray") for found in (alone, both)]
    assert stray[1]["lower"] < max(TRUTH.stray_f * 1e12, 0.05) < stray[1]["upper"]
    for name in ("resistance", "capacitance"):
        widths = [told(found, name)["upper"] / told(found, name)["lower"] for found in (alone, both)]
        assert widths[1] <= widths[0] * 1.001


def test_meters_alone_calibrate_what_they_can(bench):
    """A specimen that was never on the bench, 30 % above its prediction, then baked: the last state counts."""
    assert bench("log", "specimen", "S2", "--design", "mine.yaml").code == 0
    truth = replace(TRUTH, capacitance=float(np.log(1.3)))
    assert bench("log", "add", "S2", "--C", f"{2 * meter(truth, 1.1e3)[0]:.6g}pF@1.1kHz", "--unbaked").code == 0
    assert bench("log", "add", "S2", *metered(truth, 1.1e3), "--baked").code == 0
    assert bench("log", "add", "S2", "--y", "25.5k", "--baked").code == 0
    found = bench("calibrate", "S2", "--drawn", "--json").json
    assert any("no recording: R, C and leak by meters alone" in note for note in found["notes"])
    assert any("2 readings of meters count, baked" in note for note in found["notes"])
    known = told(found, "capacitance")
    assert known["lower"] < 1.3 * 64.256829 < known["upper"]
    assert 1.06 < known["upper"] / known["lower"] < 1.1  # C differs by 2 % from session to session
    for f in TONES_HZ[1:]:
        assert bench("log", "add", "S2", *metered(truth, f), "--baked").code == 0
    more = told(bench("calibrate", "S2", "--drawn", "--dry-run", "--json").json, "capacitance")
    assert more["lower"] < 1.3 * 64.256829 < more["upper"]
    assert more["upper"] / more["lower"] > 1.05  # however many frequencies one session has
    assert bench("log", "withdraw", "reading", "3", "--reason", "slipped").code == 0
    assert "were withdrawn or corrected" in bench("invert", "S2", "none.csv").line


def test_a_negative_inductance_is_what_a_meter_shows_of_a_capacitor(bench, tmp_path):
    c, d = meter(TRUTH, 1.1e3)
    inductance = -1 / ((2 * np.pi * 1.1e3) ** 2 * c * 1e-12 * (1 + d**2))
    (tmp_path / "ls.csv").write_text(f"Frequency (Hz),Ls (H),Q\n1100,{inductance:.8g},{1 / d:.8g}\n")
    assert bench("log", "specimen", "S2", "--design", "mine.yaml").code == 0
    assert "doubt" not in bench("log", "import", "ls.csv", "--specimen", "S2", "--instrument", "HP 4284A").out
    known = told(bench("calibrate", "S2", "--drawn", "--json").json, "capacitance")
    assert known["lower"] < 64.256829 * np.exp(TRUTH.capacitance) < known["upper"] < 1.1 * known["lower"]


def test_readings_that_no_specimen_has_are_named(bench):
    """A phase of the wrong sign, a capacitance in F for pF; a remark that is no reading changes nothing."""
    assert bench("log", "specimen", "S2", "--design", "mine.yaml").code == 0
    assert bench("log", "add", "S2", "--Z", "2.6Mohm@1kHz", "--phase", "88deg@1kHz", "--baked").code == 0
    assert "left out: no capacitor" in bench("calibrate", "S2", "--drawn").refusal
    assert bench("log", "add", "S2", "--C", "60F@1kHz", "--baked").code == 0
    assert bench("log", "add", "S2", "--remark", "moved to another box").code == 0
    found = bench("calibrate", "S2", "--drawn", "--dry-run").ok
    assert "2 readings of meters count, baked" in found.words
    assert "fit no specimen of this design" in found.words


def test_values_of_materials_are_told_and_become_a_source(made, alone):
    said = said_by_calibrate(made)
    assert "material values of this specimen, 95 %" in said
    assert "x60: " not in said
    text = (made / "calibrated" / "s1.yaml").read_text("utf-8")
    assert "resistivity_ohm_m: {value: " in text
    found = alone["materials"]
    assert [one["quantity"] for one in found] == ["resistivity_ohm_m", "relative_permittivity", "youngs_modulus_pa"]
    assert all(one["lower"] < one["value"] < one["upper"] for one in found)
