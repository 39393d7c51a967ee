"""Verdicts against the line model, yields against SciPy, and what Table D.1 says of itself."""

from math import inf, isnan, nan
from types import SimpleNamespace

import numpy as np
import pytest
from line_cases import PLATE
from scipy import stats

from sensorgen.analysis import comparison
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.measure.signal.verdicts import (
    WORDS,
    Evidence,
    expected_from,
    groups,
    independence,
    leak_s,
    share,
    verdict,
)
from sensorgen.models import line


@pytest.mark.parametrize("leak", [1e-12, 1e-3, 10.0])
def test_the_leak_is_that_of_the_line_model(leak):
    changes = {"bottom_resistivity_ohm_m": 0.07, "force_n": 0.0, "frequency_hz": 1e-9, "leak_s_per_m": leak / 0.1}
    z = line.impedance(line.PressedLine(**PLATE | changes))
    assert leak_s(float(z.real), 0.07 * 0.1 / (3e-4 * 0.01)) == pytest.approx(leak, rel=1e-6)


def test_leaks_at_their_limits():
    assert (leak_s(inf, 600.0), leak_s(0.0, 600.0), leak_s(1e12, 600.0)) == (0, inf, pytest.approx(1e-12))
    assert leak_s(500.0, 0.0) == pytest.approx(1 / 500)
    small = [leak_s(z, 600.0) for z in np.geomspace(1e-3, 1e13, 300)]
    assert (np.diff(small) < 0).all()
    with pytest.raises(OutOfRange):
        leak_s(-1.0, 600.0)
    with pytest.raises(OutOfRange, match="0 ohm expected of an electrode"):
        verdict(Evidence("x", (600.0,), (inf,), 0.0))


@pytest.mark.parametrize(
    ("ry", "rz", "word", "electrode", "film"),
    [
        ((600.0,), (inf,), "intact", "sound", "intact"),
        ((600.0,), (1e8,), "intact", "sound", "intact"),
        ((600.0,), (0.999e8,), "leak", "sound", "leak"),
        ((600.0,), (1200.0,), "short", "sound", "short"),
        ((600.0,), (1201.0,), "leak", "sound", "leak"),
        ((600.0,), (0.0,), "short", "sound", "short"),
        ((1800.0,), (inf,), "intact", "sound", "intact"),
        ((1801.0,), (inf,), "dry joint", "dry joint", "intact"),
        ((600.0, 1300.0), (inf,), "dry joint", "dry joint", "intact"),
        ((59_999.0,), (inf,), "dry joint", "dry joint", "intact"),
        ((60_000.0,), (inf,), "open electrode", "open electrode", "intact"),
        ((inf,), (40.0,), "open electrode", "open electrode", "short"),
        ((2000.0,), (5.0,), "short", "dry joint", "short"),
        ((inf,), (5e7,), "open electrode", "open electrode", "leak"),
        ((), (40.0,), "short", "unknown", "short"),
        ((), (5000.0,), "leak", "unknown", "leak"),
        ((600.0,), (), "unknown", "sound", "unknown"),
        ((), (), "unknown", "unknown", "unknown"),
        ((0.8,), (inf,), "unknown", "unknown", "intact"),
    ],
)
def test_every_verdict_at_its_limits(ry, rz, word, electrode, film):
    found = verdict(Evidence("x", ry, rz, 600.0))
    assert (found.word, found.electrode, found.film) == (word, electrode, film)
    assert word in WORDS
    assert len(found.reasons) == 2


def test_a_verdict_carries_its_numbers():
    found = verdict(Evidence("x", (700.0, 650.0), (260.0, 300.0), 600.0))
    assert (found.ry_ohm, found.rz_ohm, found.ratio, found.same_order) == (650, 260, 0.4, True)
    assert "260 ohm is within the 1300 ohm" in found.reasons[1]
    blank = verdict(Evidence("y", (650.0,)))
    assert blank.same_order is None
    assert isnan(blank.ratio)
    assert verdict(Evidence("z", (650.0,), (6500.0,))).same_order is True
    assert verdict(Evidence("z", (650.0,), (6501.0,))).same_order is False
    below = verdict(Evidence("z", (650.0,), (-0.3,), 600.0))  # the meter's offset
    assert (below.word, below.rz_ohm, below.leak_s) == ("short", 0, inf)
    assert verdict(Evidence("z", (-5.0,), (inf,), 600.0)).word == "unknown"
    with pytest.raises(OutOfRange, match="expected numbers, or none"):
        verdict(Evidence("z", (nan,)))


@pytest.mark.parametrize(("count", "total"), [(0, 1), (59, 59), (20, 1000)])
def test_intervals_are_those_of_scipy(count, total):
    found = share(count, total)
    exact = stats.binomtest(count, total).proportion_ci(0.95, "exact")
    assert (found.low, found.high) == (pytest.approx(exact.low, abs=1e-12), pytest.approx(exact.high, abs=1e-12))


def test_intervals_hold_at_least_their_confidence_where_wilsons_do_not():
    def coverage(intervals, p):
        inside = [low <= p <= high for low, high in intervals]
        return stats.binom.pmf(np.arange(len(intervals)), len(intervals) - 1, p)[inside].sum()

    for total in (5, 59):
        ours = [(share(k, total).low, share(k, total).high) for k in range(total + 1)]
        wilson = [stats.binomtest(k, total).proportion_ci(0.95, "wilson") for k in range(total + 1)]
        at = np.linspace(0.005, 0.995, 199)
        assert min(coverage(ours, p) for p in at) >= 0.95
        assert min(coverage(wilson, p) for p in at) < 0.94


@pytest.mark.parametrize("table", [[(28, 5), (12, 14)], [(0, 3), (4, 0)], [(10, 10), (10, 10)]])
def test_two_groups_are_fishers_test(table):
    assert independence(table) == pytest.approx(stats.fisher_exact(np.array(table)).pvalue, rel=1e-9)


def test_three_groups_against_every_table_with_the_same_sums():
    table = [(7, 1), (3, 4), (2, 6)]
    sizes, did = [8, 7, 8], 12
    law = stats.random_table(sizes, [did, sum(sizes) - did])
    every = [
        np.array([[a, 8 - a], [b, 7 - b], [did - a - b, 8 - did + a + b]])
        for a in range(9) for b in range(8) if 0 <= did - a - b <= 8
    ]  # fmt: skip
    chances = np.array([law.pmf(t) for t in every])
    assert chances.sum() == pytest.approx(1)
    assert independence(table) == pytest.approx(chances[chances <= law.pmf(np.array(table)) * 1.000001].sum(), rel=1e-9)
    with pytest.raises(OutOfRange, match="from 0 on"):
        independence([(-1, 5), (3, 4)])


@pytest.mark.parametrize("table", [[(620, 380), (560, 440)], [(5, 1995), (0, 3000)]])
def test_many_readings_are_fishers_test_too(table):
    exact = stats.fisher_exact(np.array(table)).pvalue
    assert independence(table) == pytest.approx(exact, abs=4 * np.sqrt(exact / 100_000))


def test_many_groups_are_held_against_pearsons_test():
    """With hundreds in each cell both tests say the same."""
    table = [(500, 500), (520, 480), (545, 455), (490, 510)]
    assert independence(table) == pytest.approx(stats.chi2_contingency(np.array(table)).pvalue, rel=0.05)
    assert independence([(9000, 1000), (1000, 9000), (500, 500)]) == pytest.approx(1e-5, rel=0.01)
    assert independence([(5000, 5000)] * 2) == 1


def test_groups_count_what_is_known_only():
    across = {"a": (inf,), "b": (30.0,), "c": (), "d": (9e6,)}
    made = [Evidence(name, (600.0,), read, 600.0) for name, read in across.items()]
    keys = [("tri", 0.1)] * 3 + [("rect", None)]
    found = groups((key, of, verdict(of)) for key, of in zip(keys, made, strict=True))
    assert [g.key for g in found] == [("rect", None), ("tri", 0.1)]
    tri = found[1]
    assert (tri.intact.count, tri.intact.total, tri.shorted.count, tri.shorted.total) == (1, 2, 1, 2)
    assert tri.words == {"intact": 1, "short": 1, "unknown": 1}
    assert found[0].shorted.count == 0
    assert expected_from([of.ry_ohm[0] for of in made]) == 600


def test_a_prediction_without_an_upper_end_leaves_readings_their_own():
    """An electrode that one way to print interrupts; readings without R_Y and an open one are no usual value."""
    words = SimpleNamespace(baked=None, batch="", specimen="s", instrument="")
    of = SimpleNamespace(ry_ohm=Bounds.of(1000.0, "ohm", print=Interval(900.0, inf)), touches=False)
    ohms = [(1100.0,), (1050.0,), (), (), (inf,)]
    rows = [SimpleNamespace(y_ohm=y, z_ohm=(1e9,), shape="rect", specimen="s", words=words) for y in ohms]
    assert comparison._usual_ohm(rows, [of] * len(rows))("rect", of) == pytest.approx(1075)


def test_intervals_hold_where_plates_differ():
    """Plates of ten whose yields scatter (beta distribution, mean 0.6): 95 % intervals, taken apart or as one."""
    rng = np.random.default_rng(7)
    inside = np.zeros(2)
    for _ in range(400):
        made = rng.binomial(10, rng.beta(1.2, 0.8, 12))
        count, plates = int(made.sum()), [(int(k), 10) for k in made]
        for k, found in enumerate((share(count, 120), share(count, 120, plates=plates))):
            inside[k] += found.low <= 0.6 <= found.high
    assert inside[0] / 400 < 0.7
    assert inside[1] / 400 > 0.93


def test_a_plate_alone_and_plates_of_one_change_nothing():
    assert share(3, 10, plates=[(3, 10)]) == share(3, 10)
    assert share(3, 10, plates=[(1, 1)] * 3 + [(0, 1)] * 7) == share(3, 10)
    assert share(4, 8, plates=[(4, 4), (0, 4)]).high > share(4, 8).high
