"""Recording and rig's log on one time, with offsets that are known."""

from dataclasses import replace

import made
import numpy as np
import pytest
from made import joined, rebuilt
from scipy.signal import lfilter

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording import Recording, RecordingClock, Source, joined_all, rig
from sensorgen.measure.recording.rig import _covariance
from sensorgen.measure.recording.samples import blank, sifted

MADE = made.presses(12)


def recording(run, skew=0.0, stamped=True):
    clock = (
        rebuilt(len(run.time_s), run.time_s, made.stamps(run.time_s, skew=skew)).clock if stamped else RecordingClock()
    )
    z = run.impedance_ohm.copy()
    return Recording(run.time_s, made.TONES_HZ, z, blank(len(z)) | sifted(z), clock, Source("run.mat", "MATLAB 5"))


@pytest.fixture(scope="module")
def run():
    return made.run(MADE, creep=0.01)


@pytest.mark.parametrize("offset_s", [-47.12, 3600.5])
def test_the_offset_is_found_within_its_error(tmp_path, run, offset_s):
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE, offset_s)))
    found = joined(recording(run), log)
    assert found.clocks.offset_error_s < 0.01
    assert found.clocks.offset_s == pytest.approx(offset_s + 0.03, abs=3 * found.clocks.offset_error_s)
    assert found.clocks.skew == 0
    assert f"clock {'+-'[offset_s < 0]} {abs(found.clocks.offset_s):.4f} +- " in found.clocks.words()
    truth, _ = made.force_at(run.time_s, MADE)
    told = np.isfinite(found.force_n)
    assert told.mean() > 0.99
    assert np.std(found.force_n[told] - truth[told]) < 0.1
    held = found.force_n > 0.3
    np.testing.assert_allclose(found.set_position_mm[held], run.position_mm[held], atol=1e-3)


def stamped(path):
    """A rig's log whose time is by the computer that stamped the recording."""
    path.write_text(path.read_text("utf-8").replace("time_s", "stamp_s", 1), "utf-8")
    return rig(path)


def test_stamps_of_one_computer_leave_little_to_find(tmp_path, run):
    late = made.write_rig(tmp_path / "late.csv", made.rig_rows(MADE, 0.2))
    found = joined(recording(run), stamped(late))
    assert found.clocks.offset_s == pytest.approx(0.23, abs=3 * found.clocks.offset_error_s)
    off = joined(recording(run), stamped(made.write_rig(tmp_path / "off.csv", made.rig_rows(MADE, 32.0))))
    assert off.clocks.offset_s == 0  # a response that fits 32 s later is no reason to believe that
    assert np.isnan(off.clocks.offset_error_s)
    near = joined(recording(run), stamped(made.write_rig(tmp_path / "near.csv", made.rig_rows(MADE, 1.5))))
    assert near.clocks.words().endswith("agree: one computer stamped both, but the force fits best more than 1 s away")


def test_errors_of_the_offset_are_what_they_say(tmp_path):
    pulls = []
    for seed in range(5):
        one = made.run(MADE, seed=seed)
        log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE, 1.0, seed=seed + 50)))
        found = joined(recording(one), log)
        pulls.append((found.clocks.offset_s - 1.03) / found.clocks.offset_error_s)
    assert 0.15 < np.sqrt(np.mean(np.square(pulls))) < 1.8


def test_lock_ins_share_the_clock_of_the_one_that_tells_it_best(tmp_path, run):
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE, 3.217, skew=2e-4), {90: "stalled"}))
    good = recording(run, stamped=False)
    half = len(run.time_s) // 2
    noise = np.random.default_rng(1).standard_normal((len(run.time_s), 7))
    deaf = replace(good, impedance_ohm=41 * np.exp(1e-3 * noise + 0j))
    dead = replace(good, impedance_ohm=np.full_like(good.impedance_ohm, 41))
    short = Recording(
        run.time_s[:half], good.tones_hz[:2], good.impedance_ohm[:half, :2], blank(half), good.clock, good.source
    )
    alone = joined(good, log)
    found = joined_all((deaf, short, dead, good), log)
    assert {one.clocks.offset_s for one in found} == {alone.clocks.offset_s}
    assert [one.recording.tones_hz.size for one in found] == [7, 2, 7, 7]
    for one in found:
        count = len(one.recording.time_s)
        np.testing.assert_allclose(one.force_n, alone.force_n[:count])
        assert one.recording.counts()["rig error"] == np.count_nonzero(alone.recording.marks["rig error"][:count])
    with pytest.raises(BadInput, match="too little to find the offset"):
        joined_all((deaf, deaf), log)
    with pytest.raises(BadInput, match="do not change"):
        joined_all((dead, dead), log)


def test_a_skew_of_the_rigs_clock_is_found(tmp_path):
    many = made.presses(30)
    run = made.run(many, rate_hz=70)
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(many, 2.0, skew=3e-4)))
    found = joined(recording(run, stamped=False), log)
    assert found.clocks.skew == pytest.approx(3e-4, abs=3 * found.clocks.skew_error)
    assert found.clocks.skew_error < 5e-5


def test_errors_and_silence_of_the_rig_are_marked_and_counted(tmp_path, run):
    rows = [c.copy() for c in made.rig_rows(MADE)]
    keep = np.ones(len(rows[0]), bool)
    keep[600:700] = False  # 5 s
    columns = [c[keep] for c in rows]
    log = rig(made.write_rig(tmp_path / "rig.csv", columns, {200: "timeout", 201: "timeout", 300: "0"}))
    assert log.counts() == {"rows": int(keep.sum()), "errors": 2}
    found = joined(recording(run), log)
    marked = found.recording.marks["rig error"]
    assert marked.sum() == pytest.approx(140 * (5 + 0.1), abs=30)
    assert np.isnan(found.force_n[np.isclose(run.time_s, 32, atol=1e-3)]).all()
    assert not found.recording.valid()[marked].any()
    assert marked[np.searchsorted(run.time_s, 10.02)]  # beside rows 200 and 201
    assert not marked[np.searchsorted(run.time_s, [9.9, 10.15, 15.0])].any()


# how much of its noise a reading has from the one before
@pytest.mark.parametrize(("wanders", "seed"), [(0.0, 0), (0.99, 3)])
def test_a_sensor_that_does_not_answer_leaves_the_clocks_as_they_are(tmp_path, run, wanders, seed):
    noise = np.random.default_rng(seed).standard_normal((len(run.time_s), 7))
    z = 41 * np.exp(1e-3 * lfilter([(1 - wanders**2) ** 0.5], [1, -wanders], noise, axis=0) + 0j)
    dead = made.Run(run.time_s, run.force_n, run.position_mm, z, z, z, run.presses)
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE)))
    found = joined(recording(dead), log)
    assert (found.clocks.offset_s, found.clocks.skew) == (0, 0)
    assert np.isnan(found.clocks.offset_error_s)
    assert "assumed to agree" in found.clocks.words()


def test_clocks_that_both_count_from_0_and_clocks_far_apart(tmp_path, run):
    noise = np.random.default_rng(0).standard_normal((len(run.time_s), 7))
    dead = replace(run, impedance_ohm=41 * np.exp(1e-3 * noise + 0j))
    shown, *others = made.rig_rows(MADE)
    same = rig(made.write_rig(tmp_path / "same.csv", [shown - made.EPOCH_S, *others]))
    assert "assumed to agree" in joined(recording(dead, stamped=False), same).clocks.words()  # both count from 0
    with pytest.raises(BadInput, match=r"clocks, which have 0 s in common \(recording from 1\.66142e\+09 s, rig's log"):
        joined(recording(dead), same)  # stamps since 1970, beside a rig that counts from 0
    far = stamped(made.write_rig(tmp_path / "far.csv", made.rig_rows(MADE, 9000.0)))
    with pytest.raises(BadInput, match="do not overlap within 1 s"):
        joined(recording(run), far)


def test_a_rigs_log_in_other_words(tmp_path):
    file = tmp_path / "rig.csv"
    file.write_text(
        "when;soll;x;ist;err\n2023-05-04T12:00:00+02:00;1,5;10;1,4;\n2023-05-04T10:00:01.5Z;2;20;;E7\n"
        "2023-05-04T10:00:01Z;2;20;1;\n2023-05-04T10:00:0"
    )
    names = {"when": "time_s", "soll": "set_force_n", "x": "set_position_mm", "ist": "force_n", "err": "error"}
    found = rig(file, names)
    assert np.diff(found.time_s).tolist() == [1.5, -0.5]
    assert found.set_force_n.tolist() == [1.5, 2, 2]
    assert found.error.tolist() == [False, True, True]
    assert any("not later" in note for note in found.notes)
    assert "incomplete" in found.notes[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time_s,set_force_n\n1,2\n", "set_position_mm is not there once"),
        ("time_s,set_force_n,set_position_mm\n1,x,3\n", "row 2, column set_force_n: 'x' is not a number"),
        ("time_s,set_force_n,set_position_mm\n2023-05-04T12:00:00,1,3\n", "is not a number"),
        ("time_s,set_force_n,set_position_mm\nnoon,1,3\n", "row 2, column time_s: 'noon' is not a number"),
        ("time_s,set_force_n,set_position_mm\n1,2,3,4\n", "row 2: 4 cells, but the header has 3"),
        ("time_s,set_force_n,set_position_mm\n", "no rows"),
        ("time_s,set_force_n,set_position_mm\n1,inf,3\n", "is not finite"),
        ("x" * 300_000, "row 1: longer than"),
    ],
)
def test_bad_logs_name_row_and_column(tmp_path, text, said):
    (tmp_path / "rig.csv").write_text(text)
    with pytest.raises(BadInput, match=said) as error:
        rig(tmp_path / "rig.csv")
    assert "rig.csv" in str(error.value)


def test_errors_of_weights_hold_for_noise_that_hangs_together():
    rng = np.random.default_rng(5)
    t = np.linspace(-1, 1, 1500)
    model = np.column_stack([np.ones_like(t), np.sin(5 * t), t**2])
    found, said = [], []
    for _ in range(300):
        noise = lfilter([1], [1, -0.7], rng.standard_normal(1500))
        weights = np.linalg.lstsq(model, noise, rcond=None)[0]
        found.append(weights[-2:])
        said.append(np.sqrt(np.diag(_covariance(model, noise - model @ weights))))
    np.testing.assert_allclose(np.mean(said, axis=0), np.std(found, axis=0), rtol=0.15)


def test_three_presses_in_noise_that_wanders_tell_the_offset(tmp_path):
    lived = made.run(MADE[:3])
    noise = np.random.default_rng(1).standard_normal(lived.impedance_ohm.shape)
    lived.impedance_ohm *= np.exp(1e-3 * lfilter([0.14], [1, -0.99], noise, axis=0))
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(MADE[:3], 3.217)))
    found = joined(recording(lived), log)
    assert found.clocks.offset_s == pytest.approx(3.247, abs=0.02)


def test_rows_a_second_apart_tell_the_offset_though_no_fast_relaxation(tmp_path):
    many = made.presses(25, seed=2, dwell_s=3.0)
    log = rig(made.write_rig(tmp_path / "rig.csv", made.rig_rows(many, 2.0, rate_hz=1)))
    found = joined(recording(made.run(many, rate_hz=35)), log)
    assert found.clocks.offset_s == pytest.approx(2.03, abs=0.15)
