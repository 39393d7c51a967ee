"""The rebuilt clock against clocks whose truth is known."""

import made
import numpy as np
import pytest
from made import rebuilt

from sensorgen.core.errors import BadInput

TIME = np.arange(140 * 60) / 140


def test_stamps_that_step_back_give_a_time_that_rises():
    stamps = made.stamps(TIME)
    found = rebuilt(len(TIME), TIME, stamps)
    np.testing.assert_array_equal(found.time_s, TIME)
    assert np.count_nonzero(found.marks["reversed stamp"]) == np.count_nonzero(np.diff(stamps) < 0) > 100
    assert found.clock.jitter_s == pytest.approx(0.005, rel=0.1)


@pytest.mark.parametrize("skew", [0.0, 5e-5, -2e-4])
def test_epoch_and_skew_are_within_their_errors(skew):
    offs, slopes = [], []
    for seed in range(20):
        clock = rebuilt(len(TIME), TIME, made.stamps(TIME, seed=seed, skew=skew)).clock
        offs.append((clock.real_s(30.0) - made.EPOCH_S - 0.03 - (1 + skew) * 30.0) / clock.epoch_error_s)
        slopes.append((clock.skew - skew) / clock.skew_error if clock.skew else np.nan)
    assert abs(np.mean(offs)) < 1
    assert 0.5 < np.std(offs) < 1.5
    told = np.isfinite(slopes)
    assert told.sum() <= 1 if skew == 0 else told.all() if skew == -2e-4 else True
    if skew == -2e-4:
        assert 0.5 < np.sqrt(np.mean(np.square(slopes))) < 1.6


def test_lost_samples_move_the_time_and_a_set_clock_does_not():
    stamps = made.stamps(TIME)
    lost = stamps + np.where(TIME >= 20, 1.5, 0)
    found = rebuilt(len(TIME), TIME, lost)
    at = int(np.flatnonzero(found.marks["gap"])[0])
    assert (TIME[at], found.time_s[at] - found.time_s[at - 1]) == (20, pytest.approx(1.5, abs=0.02))
    np.testing.assert_allclose(found.clock.real_s(found.time_s) - lost, 0, atol=0.05)
    back = rebuilt(len(TIME), TIME, stamps - np.where(TIME >= 10, 3600, 0))
    np.testing.assert_array_equal(back.time_s, TIME)
    assert not back.marks["gap"].any()
    assert "set back by 3.6e+03 s" in back.source.notes[0]
    assert back.clock.epoch_s == pytest.approx(made.EPOCH_S + 0.03, abs=0.02)


def test_a_late_block_is_no_gap():
    stamps = made.stamps(TIME)
    stamps[1400:1414] += 3.0
    found = rebuilt(len(TIME), TIME, stamps)
    assert not found.marks["gap"].any()
    assert found.clock.epoch_s == pytest.approx(made.EPOCH_S + 0.03, abs=0.002)


@pytest.mark.parametrize(("stamped", "seed", "uneven"), [(False, 1, 0.0), (True, 2, 0.05)])
def test_rows_that_are_cut_out_leave_a_gap_in_a_time_that_rises(stamped, seed, uneven):
    """The first sample after each cut, of a single row too, and no other, also where steps differ by a part."""
    time = TIME + uneven / 140 * np.random.default_rng(seed).random(len(TIME))
    left = np.delete(np.arange(len(TIME)), [500, *range(2000, 2150)])
    found = rebuilt(len(left), time[left], made.stamps(TIME)[left] if stamped else None)
    np.testing.assert_array_equal(found.time_s, time[left])
    assert np.flatnonzero(found.marks["gap"]).tolist() == [500, 1999]
    assert not rebuilt(len(TIME), time, None).marks["gap"].any()


def test_a_time_that_does_not_rise_is_rebuilt_from_the_index():
    broken = TIME.copy()
    broken[100:110] = np.nan
    broken[200] = broken[199]
    found = rebuilt(len(TIME), broken, None)
    np.testing.assert_allclose(found.time_s, TIME, atol=1e-9)
    assert found.source.notes == ("the time of 11 samples does not rise: placed between their neighbours",)
    with pytest.raises(BadInput, match="no sampling times"):
        rebuilt(5, None, None)
    with pytest.raises(BadInput, match="does not rise"):
        rebuilt(5, None, np.array([5.0, 4, 3, 2, 1]))


EVEN = np.arange(6000) / 50
CUT = EVEN[(EVEN < 40) | (EVEN >= 45)]


def changed(place, value):
    return np.r_[CUT[:place], value, CUT[place + len(value) :]]


@pytest.mark.parametrize(
    ("time", "stamps", "gap", "within_s"),
    [
        (CUT, None, True, 1e-9),
        (None, made.EPOCH_S + CUT, True, 1e-5),
        (CUT, made.EPOCH_S + CUT, True, 1e-9),
        (EVEN[:5750], made.EPOCH_S + CUT, True, 1e-5),  # the instrument counts on where samples are lost
        (changed(500, CUT[[501, 500]]), None, True, 1e-9),
        (changed(500, [np.nan] * 10), None, True, 1e-9),
        (np.round(CUT, 1), None, True, 0.02),
        (np.round(EVEN, 1), None, False, 0.02),
        (np.floor(EVEN), None, False, 0.02),
        (np.round(EVEN * 50 / 70, 2), None, False, 0.01),  # rises, by steps of 0.01 s and 0.02 s
    ],
)
def test_lost_rows_are_a_gap_and_rounded_times_are_none(time, stamps, gap, within_s):
    truth = EVEN * 50 / 70 if within_s == 0.01 else CUT if gap else EVEN
    got = rebuilt(len(truth), time, stamps)
    np.testing.assert_allclose(got.time_s - np.median(got.time_s - truth), truth, atol=within_s)
    assert np.flatnonzero(got.marks["gap"]).tolist() == [2000] * gap


def test_blocks_with_stamps_alone_lose_samples_once():
    kept = TIME[(TIME < 20) | (TIME >= 25)]
    first = np.arange(len(kept)) // made.BLOCK * made.BLOCK
    counted = made.stamps(np.arange(len(kept)) / 140)  # by the computer's clock, which the lost samples move on
    got = rebuilt(len(kept), None, counted + kept[first] - first / 140)
    np.testing.assert_allclose(got.time_s, kept - kept[0], atol=0.02)
    assert np.flatnonzero(got.marks["gap"]).tolist() == [2800]


# how late the blocks of a recording of the real program were stamped, over the first one [0.1 ms]
LATE = [
    0, 45, -16, -25, 62, -28, -109, 1, -62, 25, 46, -93, 17, -59, 28, -5, -119, 15, -64, 11, -5, -25, -18, -95, 9, -41,
    -121, -3, -42, 30, -72, 34, 8, 58, 6, -69, 64, 4, -108, 10, -81, 31, 46, -49, 18, -20,
]  # fmt: skip


def test_the_stamps_of_the_real_program():
    time = 0.05 + np.arange(644) / 140
    first = np.arange(644) // 14
    stamps = 1661419320.7 + time[first * 14] + np.array(LATE)[first] * 1e-4 + np.arange(644) % 14 * 0.1 / 13
    found = rebuilt(644, time, stamps)
    assert np.count_nonzero(found.marks["reversed stamp"]) == 25
    assert (found.clock.blocks, found.clock.skew) == (46, 0)
    assert found.clock.jitter_s == pytest.approx(np.std(LATE) * 1e-4, rel=0.05)
    alone = rebuilt(644, None, stamps)  # without the instrument's own time
    assert 1 / np.median(np.diff(alone.time_s)) == pytest.approx(140, rel=2e-3)
    np.testing.assert_allclose(np.diff(alone.time_s), alone.time_s[1], rtol=1e-9)
