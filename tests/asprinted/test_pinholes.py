"""Through-holes of films: planted ones, percolation, closed forms, and the probability of a short."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from scipy.stats import beta

from sensorgen.analysis.shorts import chance, risk, verdicts
from sensorgen.asprinted.beads import Beads
from sensorgen.asprinted.pinholes import Film, draws, findings, opened, pinholes, through
from sensorgen.design.design import make
from sensorgen.export.gcode import paths
from sensorgen.measure.log import Log
from sensorgen.measure.log.entries import Reading

PLAN = shapely.box(0, 0, 10, 10)


def lines(spacing, width, height=0.1, along_x=True, left_out=()):
    """Parallel lines over the plan, with some left out."""
    at = [v for k, v in enumerate(np.arange(-1, 11.5, spacing).tolist()) if k not in left_out]
    start, end = (np.array([(x, v) if along_x else (v, x) for v in at]) for x in (-2.0, 12.0))
    none = np.zeros(len(at), np.int64)
    ones = np.ones(len(at))
    return Beads(start, end, ones * width, ones * height, ones, none, none, none, none)


def film(*layers):
    return Film(PLAN, tuple(range(1, len(layers) + 1)), (0.0, 0.1 * len(layers)), layers)


def test_slits_of_parallel_lines_by_hand():
    """Lines 0.5 mm apart, stadiums 0.45 mm wide: a tenth is open; crossed in two layers, a hundredth."""
    width = 0.45 - (1 - np.pi / 4) * 0.1
    one, two = lines(0.5, width), lines(0.5, width, along_x=False)
    (open_one,) = opened(film(one), [1.0])
    assert open_one.area == pytest.approx(10.0, rel=1e-6)
    holes = through(opened(film(one, two), [1.0, 1.0]))
    assert sum(hole.area for hole in holes) == pytest.approx(1.0, rel=1e-6)
    assert len(holes) == 400


def test_lines_that_touch_leave_nothing_open():
    assert through(opened(film(lines(0.5, 0.5)), [1.0])) == []


def test_round_ends_of_lines_leave_their_corners_open():
    """Lines 0.5 mm wide as stadiums that end half a width inside the plan: of each end, w^2/2 less half a circle."""
    lying = lines(0.5, 0.5 - (1 - np.pi / 4) * 0.1)
    less = np.array([2.25, 0])
    ending = replace(lying, start_mm=lying.start_mm + less, end_mm=lying.end_mm - less)
    half_circle = 4 * np.sin(np.pi / 8) * 0.25**2  # of 16 corners
    (found,) = opened(film(ending), [1.0])
    assert found.area == pytest.approx(2 * 20 * (0.5**2 / 2 - half_circle), rel=1e-6)
    assert all(x < 0.25 or x > 9.75 for hole in through([found]) for x, _ in [hole.centroid.coords[0]])


def test_a_planted_gap_is_found_at_its_place():
    gap = lines(0.5, 0.5, left_out=(12,))  # at 5 mm
    (slit,) = through(opened(film(gap), [1.0]))
    assert slit.bounds == pytest.approx((0, 4.76, 10, 5.24), abs=0.002)
    assert through(opened(film(gap, lines(0.5, 0.5)), [1.0, 1.0])) == []
    (cross,) = through(opened(film(gap, lines(0.5, 0.5, along_x=False, left_out=(4,))), [1.0, 1.0]))
    assert cross.centroid.coords[0] == pytest.approx((1, 5), abs=0.01)


def test_a_way_within_a_layer_connects_holes_that_do_not_lie_above_each_other():
    """Slits at x 1 below, at y 5 in the middle, at x 7 above percolate, though nothing is open straight through."""
    low, high = (lines(0.5, 0.5, along_x=False, left_out=(k,)) for k in (4, 16))
    middle = lines(0.5, 0.5, left_out=(12,))
    layers = opened(film(low, middle, high), [1.0] * 3)
    assert shapely.intersection_all(layers).area == 0
    assert len(through(layers)) == 1
    assert through(opened(film(low, lines(0.5, 0.5), high), [1.0] * 3)) == []


def test_the_narrowest_place_of_a_path_is_the_hole():
    """A millimetre square open through two layers, and a tenth of it through the third."""
    square, tenth = shapely.box(0, 0, 1, 1), shapely.box(0.9, 0, 2, 1)
    for layers in ([square, square, tenth], [tenth, square, square], [square, square, tenth, tenth]):
        assert [hole.area for hole in through(layers)] == pytest.approx([0.1])


def test_a_shift_of_both_layers_alike_opens_nothing():
    two = film(lines(0.5, 0.47), lines(0.5, 0.47, along_x=False))
    areas = [
        sum(h.area for h in through(opened(two, [1.0, 1.0], [shift, shift]))) for shift in ((0.0, 0.0), (0.05, -0.05))
    ]
    assert areas[0] == pytest.approx(areas[1], rel=1e-6)


def test_parallel_layers_open_more_than_crossed_ones():
    crossed, parallel = (film(lines(0.5, 0.45), lines(0.5, 0.45, along_x=k)) for k in (False, True))
    area = [sum(h.area for h in through(opened(of, [1.0, 1.0]))) for of in (crossed, parallel)]
    assert area[1] > 5 * area[0]


@cache
def printed(layers=2):
    """A plate of X60 with a film of some layers, printed by lines along x that leave a slit at y 0."""
    design = make({"shape": "rect", "parameters": {"length_mm": 12.0, "width_mm": 12.0, "dielectric_mm": 0.1 * layers}})
    found = ["M83"]
    for k, z in enumerate(design.layers.boundaries_mm(design.printed.size_mm[2])[1:]):
        here = [b for b in design.printed.bodies if any(p.span("z")[0] < z - 0.05 < p.span("z")[1] for p in b.pieces)]
        for body in here:
            found += [f"T{design.tool(body.material)}", f"G1 Z{z}"]
            for at in np.arange(-5.8, 5.9, 0.4).tolist():
                if abs(at) > 0.3 or body.terminal:
                    ends = ((-5.8, at), (5.8, at)) if k % 2 == 0 or layers == 1 else ((at, -5.8), (at, 5.8))
                    found += [f"G1 X{ends[0][0]} Y{ends[0][1]:.2f}", f"G1 X{ends[1][0]} Y{ends[1][1]:.2f} E0.193"]
    return design, found


def test_a_film_of_one_layer_is_a_finding_with_place_and_figures():
    design, text = printed(1)
    found = pinholes(design, paths.read(text, design.machine))
    (said,) = findings(found)
    assert (said.rule, said.severity) == ("10-film", "warning")
    assert "one layer: 1 through-holes" in said.message
    assert said.place_mm[1] == pytest.approx(6.0, abs=0.5)
    assert design.waived([said])[0].waiver == ""


def test_two_crossed_layers_leave_a_hole_where_their_slits_cross():
    design, text = printed(2)
    row = pinholes(design, paths.read(text, design.machine)).rows[0]
    assert (row.layers, row.holes) == (2, 1)
    assert (row.x_mm, row.y_mm) == (pytest.approx(6.0, abs=0.5), pytest.approx(6.0, abs=0.5))


def test_films_of_more_layers_are_left_out_where_asked():
    design, text = printed(2)
    assert pinholes(design, paths.read(text, design.machine), most_layers=1).rows == ()


def test_draws_repeat_and_differ():
    two = film(lines(0.5, 0.47), lines(0.5, 0.47, along_x=False))
    assert draws(two, 3).tolist() == draws(two, 3).tolist()


def test_without_holes_the_posterior_is_a_beta_distribution():
    for shorted, prints in ((0, 0), (0, 5), (3, 4), (29, 32)):
        exact = beta(0.5 + shorted, 0.5 + prints - shorted)
        found = chance([0.0], shorted, prints)
        assert found.mean == pytest.approx(exact.mean(), abs=0.005)
        assert (found.low, found.high) == pytest.approx((exact.ppf(0.05), exact.ppf(0.95)), abs=0.015)


def test_holes_raise_the_probability_and_intact_prints_lower_it():
    assert chance([20.0], 0, 0).mean > chance([1.0], 0, 0).mean > chance([0.0], 0, 0).mean
    assert chance([20.0], 0, 10).high < 0.27
    assert chance([0.0], 10, 10).low > 0.75


def test_the_interval_covers_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(5)
    truths = rng.beta(0.5, 0.5, 200)
    hits = 0
    for truth in truths:
        found = chance([0.0], int(rng.binomial(12, truth)), 12)
        hits += found.low <= truth <= found.high
    assert 0.84 < hits / 200 < 0.96


def test_the_logs_verdicts_are_those_of_the_same_shape_and_film(tmp_path):
    design, text = printed(1)
    with Log(tmp_path / "log.db", create=True) as log:
        log.add(
            [
                Reading(
                    uid=str(k), specimen=f"23 sqXY .{film}mm {k}", iteration=23, written="", shape=shape,
                    film_mm=0.1 * film, y_ohm=(1e3,), z_ohm=(z,),
                )
                for k, (shape, film, z) in enumerate(
                    [("rect", 1, 500.0), ("rect", 1, 9e3), ("rect", 1, 1e9), ("rect", 2, 100.0), ("tri", 1, 100.0)]
                )
            ]
        )  # fmt: skip
        assert verdicts(log, design) == (2, 3)
        found, figure = risk(design, text, log)
    assert (found.shorted, found.prints) == (2, 3)
    assert found.posterior.high - found.posterior.low < found.prior.high - found.prior.low
    said = "\n".join(str(part) for part in found.document())
    assert "yield" not in said
    assert "2 of 3 prints" in said
    assert len(figure.choices[""]) == 1
