"""What the thesis's whole log of resistances, Table D.1, says of its films."""

import math

import pytest
from scipy import stats

from sensorgen.measure.log import Log, exchange
from sensorgen.measure.signal.verdicts import Evidence, dependence, expected_from, groups, verdict


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    with Log(tmp_path_factory.mktemp("d1") / "log.db", create=True) as log:
        exchange.thesis(log)
        made = [(r, Evidence(f"row {r.source_row}", r.y_ohm, r.z_ohm)) for r in log.readings()]
    baked = [(r.shape, e) for r, e in made if remark(r) != "not baked"]
    known = [(shape, min(e.ry_ohm)) for shape, e in baked if e.ry_ohm and min(e.ry_ohm) < math.inf]
    expected = {s: expected_from([ohm for shape, ohm in known if shape == s]) for s in ("tri", "rect")}
    assert expected == {"tri": 670, "rect": 1050}
    made = [(r, e._replace(expected_ohm=expected[r.shape])) for r, e in made]
    return [(r, e, verdict(e)) for r, e in made]


def by(judged, key, **how):
    return groups(((key(r), e, v) for r, e, v in judged), **how)


def remark(reading):
    return "not baked" if reading.baked is False else "holes" if "holes" in reading.remark else reading.remark


def counts(found):
    return {group.key: (group.shorted.count, group.shorted.total) for group in found}


def test_none_of_the_specimens_is_intact(judged):
    whole = by(judged, lambda _: ())[0]
    assert (whole.intact.count, whole.intact.total) == (0, 62)
    assert whole.intact.high < 0.06
    assert whole.words == {"short": 50, "leak": 8, "unknown": 7, "open electrode": 2, "dry joint": 2}


def test_nine_in_ten_have_a_z_resistance_of_the_order_of_their_y_resistance(judged):
    whole = by(judged, lambda _: ())[0].shorted
    assert (whole.count, whole.total) == (53, 59)
    exact = stats.binomtest(53, 59).proportion_ci(0.95, "exact")
    assert (whole.low, whole.high) == (pytest.approx(exact.low), pytest.approx(exact.high))
    assert {e.name for _, e, v in judged if v.same_order is False} == {f"row {k}" for k in (8, 11, 36, 47, 49, 69)}


def test_neither_film_nor_shape_decides_whether_they_are_shorted(judged):
    known = [one for one in judged if one[0].film_mm is not None]
    film, shape = by(known, lambda r: (r.film_mm,)), by(judged, lambda r: (r.shape,))
    assert counts(film) == {(0.0,): (24, 26), (0.1,): (13, 16), (0.2,): (16, 16)}
    assert counts(shape) == {("rect",): (21, 26), ("tri",): (32, 33)}
    assert dependence(film) == pytest.approx(0.158, abs=1e-3)
    assert dependence(shape) == pytest.approx(stats.fisher_exact([[21, 5], [32, 1]]).pvalue)


def test_how_hard_they_are_shorted_depends_on_both_and_on_holes(judged):
    """A tenth of R_Y and less: the bridge lies near the contacts, or there are many."""
    hard = {"order": 0.1}
    shape = by(judged, lambda r: (r.shape,), **hard)
    assert counts(shape) == {("rect",): (5, 26), ("tri",): (18, 33)}
    assert dependence(shape) == pytest.approx(stats.fisher_exact([[5, 21], [18, 15]]).pvalue)
    of_23 = [one for one in judged if (one[0].shape, one[0].iteration) == ("tri", 23)]
    prisms = by(of_23, lambda r: (r.film_mm,), **hard)
    assert counts(prisms) == {(0.0,): (10, 10), (0.1,): (5, 11), (0.2,): (3, 9)}
    assert dependence(prisms) == pytest.approx(0.0034, abs=1e-4)
    holes = by(judged, lambda r: (remark(r) == "holes",), **hard)
    assert counts(holes) == {(False,): (22, 40), (True,): (1, 19)}
    assert dependence(holes) == pytest.approx(stats.fisher_exact([[22, 18], [1, 18]]).pvalue)
