"""What the thesis's whole log of resistances, Table D.1, says of its films."""

from dataclasses import replace
from math import nan

import pytest
from scipy import stats

from sensorgen.process.verdicts import Evidence, expected_from, verdict
from sensorgen.process.yields import dependence, groups

# iteration, shape, film [mm], R_Y and R_Z [ohm], and h for holes or u for not baked among the remarks
TABLE = """
19 rect 0.0 900 0 -; 19 rect 0.0 - - -; 20 rect 0.0 1400 - -; 20 rect 0.0 600000 - -; 20 rect 0.0 1400 - -;
20 rect 0.0 1700 - -; 20 rect - 59000 - u; 20 rect - 6900 70000 -; 21 tri 0.0 2900 - -;
22 tri 0.0 2300/3800 3300/1300 h; 22 rect 0.0 2500 650000 -; 23 tri 0.0 680 45 -; 23 tri 0.0 600 13 -;
23 tri 0.0 630 13.6 -; 23 tri 0.0 670 53 -; 23 tri 0.0 680 32 -; 23 tri 0.1 740 28 -; 23 tri 0.1 800 1130 h;
23 tri 0.1 800 0.27 -; 23 tri 0.2 650 260 h; 23 tri 0.2 8000 39300 h; 23 tri 0.2 850 40 -; 23 tri 0.2 800 300 h;
23 tri 0.0 360 7 -; 23 tri 0.0 435 16/24 -; 23 tri 0.0 500 18 -; 23 tri 0.0 500 34 -; 23 tri 0.0 450 30 -;
23 tri 0.1 500 9.2 -; 23 tri 0.1 500 45 -; 23 tri 0.1 900 110 h; 23 tri 0.1 900 300/1800 h; 23 tri 0.1 700 700 h;
23 tri 0.1 1000 1100 h; 23 tri 0.1 650 36 -; 23 tri 0.1 75000 1100000 u; 23 tri 0.2 900 300 -;
23 tri 0.2 38000 300000 -; 23 tri 0.2 400 13 -; 23 tri 0.2 600 65/130 -; 23 tri 0.2 500 45 -;
23 rect 0.0 750 142 -; 23 rect 0.0 1200 2000 h; 23 rect 0.0 800 123 -; 23 rect 0.0 600 60 -;
23 rect 0.1 1000 2000 -; 23 rect 0.1 1400 700000 -; 23 rect 0.1 2500/3000 5000/0 h; 23 rect 0.1 1100 20000 -;
23 rect 0.2 1000 1600 h; 23 rect 0.2 2200 5700 h; 23 rect 0.2 1300 700 h; 23 rect 0.2 700 600/800 h;
23 rect 0.0 600 200/400 h; 23 rect 0.0 1100 1400 h; 23 rect 0.0 900 1200 h; 23 rect 0.0 700 38 -;
23 rect 0.0 1000 1000 h; 23 rect 0.1 1000 1000 -; 23 rect 0.1 - - -; 23 rect 0.1 0.8 - -; 23 rect 0.2 3000 - -;
23 rect 0.2 1400 0 -; 23 rect 0.2 1600/1000 500/1000/1300 -; 23 rect 0.2 4000 4000 -; 25 tri 0.0 500/800 260 -;
25 tri 0.0 400/600 100/180 -; 25 rect 0.0 900/2000 500/3000 -; 25 rect 0.0 800/2300 8500/10500 -
"""


def numbers(text):
    return () if text == "-" else tuple(map(float, text.split("/")))


@pytest.fixture(scope="module")
def judged():
    made = []
    for k, row in enumerate(TABLE.replace("\n", " ").strip().split(";"), 1):
        iteration, shape, film, ry, rz, remark = row.split()
        made.append(Evidence(f"row {k}", numbers(ry), numbers(rz), nan, shape, None if film == "-" else float(film),
                             {"h": "holes", "u": "not baked", "-": ""}[remark], iteration))  # fmt: skip
    expected = {shape: expected_from([e for e in made if e.shape == shape and e.remark != "not baked"])
                for shape in ("tri", "rect")}  # fmt: skip
    assert expected == {"tri": 670, "rect": 1050}
    made = [replace(e, expected_ohm=expected[e.shape]) for e in made]
    return [(e, verdict(e)) for e in made]


def counts(found):
    return {group.key: (group.shorted.count, group.shorted.total) for group in found}


def test_none_of_the_specimens_is_intact(judged):
    whole = groups(judged, lambda _: ())[0]
    assert (whole.intact.count, whole.intact.total) == (0, 62)
    assert whole.intact.high < 0.06
    assert whole.words == {"short": 50, "leak": 8, "unknown": 7, "open electrode": 2, "dry joint": 2}


def test_nine_in_ten_have_a_z_resistance_of_the_order_of_their_y_resistance(judged):
    whole = groups(judged, lambda _: ())[0].shorted
    assert (whole.count, whole.total) == (53, 59)
    exact = stats.binomtest(53, 59).proportion_ci(0.95, "exact")
    assert (whole.low, whole.high) == (pytest.approx(exact.low), pytest.approx(exact.high))
    assert {e.name for e, v in judged if v.same_order is False} == {f"row {k}" for k in (8, 11, 36, 47, 49, 69)}


def test_neither_film_nor_shape_decides_whether_they_are_shorted(judged):
    known = [(e, v) for e, v in judged if e.film_mm is not None]
    film, shape = groups(known, lambda e: (e.film_mm,)), groups(judged, lambda e: (e.shape,))
    assert counts(film) == {(0.0,): (24, 26), (0.1,): (13, 16), (0.2,): (16, 16)}
    assert counts(shape) == {("rect",): (21, 26), ("tri",): (32, 33)}
    assert dependence(film) == pytest.approx(0.158, abs=1e-3)
    assert dependence(shape) == pytest.approx(stats.fisher_exact([[21, 5], [32, 1]]).pvalue)


def test_how_hard_they_are_shorted_depends_on_both_and_on_holes(judged):
    """A tenth of R_Y and less: the bridge lies near the contacts, or there are many."""
    hard = {"order": 0.1}
    shape = groups(judged, lambda e: (e.shape,), **hard)
    assert counts(shape) == {("rect",): (5, 26), ("tri",): (18, 33)}
    assert dependence(shape) == pytest.approx(stats.fisher_exact([[5, 21], [18, 15]]).pvalue)
    prisms = groups(
        [(e, v) for e, v in judged if (e.shape, e.iteration) == ("tri", "23")], lambda e: (e.film_mm,), **hard
    )
    assert counts(prisms) == {(0.0,): (10, 10), (0.1,): (5, 11), (0.2,): (3, 9)}
    assert dependence(prisms) == pytest.approx(0.0034, abs=1e-4)
    holes = groups(judged, lambda e: (e.remark == "holes",), **hard)
    assert counts(holes) == {(False,): (22, 40), (True,): (1, 19)}
    assert dependence(holes) == pytest.approx(stats.fisher_exact([[22, 18], [1, 18]]).pvalue)
