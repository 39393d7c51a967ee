"""Through-holes of films: planted ones, percolation, closed forms, and the probability of a short."""

import csv
from collections import Counter
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from scipy import ndimage
from scipy.special import gammaln
from scipy.stats import beta

from sensorgen.analysis.shorts import chance, elsewhere, risk, series, verdicts
from sensorgen.asprinted.beads import Beads
from sensorgen.asprinted.pinholes import CoveredFilm, draws, findings, opened, pinholes, through
from sensorgen.design.design import make
from sensorgen.export.gcode import motion as paths
from sensorgen.measure.log import Log, exchange
from sensorgen.measure.log.entries import Reading

PLAN = shapely.box(0, 0, 10, 10)
JEFFREYS = beta(0.5, 0.5).ppf((np.arange(200) + 0.5) / 200)


def lines(spacing, width, height=0.1, along_x=True, left_out=()):
    """Parallel lines over the plan, with some left out."""
    at = [v for k, v in enumerate(np.arange(-1, 11.5, spacing).tolist()) if k not in left_out]
    start, end = (np.array([(x, v) if along_x else (v, x) for v in at]) for x in (-2.0, 12.0))
    none = np.zeros(len(at), np.int64)
    ones = np.ones(len(at))
    return Beads(start, end, ones * width, ones * height, ones, none, none, none, none)


def film(*layers):
    return CoveredFilm(PLAN, tuple(range(1, len(layers) + 1)), (0.0, 0.1 * len(layers)), layers)


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


def joined(sign, inset_mm=0.3):
    """A layer of a wall and of infill at 45 degrees that ends on it: lines 0.4 mm wide."""
    wall, inner = shapely.box(0.2, 0.2, 9.8, 9.8), shapely.box(inset_mm, inset_mm, 10 - inset_mm, 10 - inset_mm)
    corners = np.array(wall.exterior.coords)
    ways = [(5 + at - 20, 5 - 20 * sign, 5 + at + 20, 5 + 20 * sign) for at in np.arange(-10, 10, 0.4 * np.sqrt(2))]
    infill = [shapely.intersection(shapely.LineString([way[:2], way[2:]]), inner) for way in ways]
    ends = np.array([*pairwise(corners), *(way.coords for way in infill if way.length > 0.1)])
    none, ones = np.zeros(len(ends), np.int64), np.ones(len(ends))
    width = ones * (0.4 - (1 - np.pi / 4) * 0.1)
    return Beads(ends[:, 0], ends[:, 1], width, ones * 0.1, ones, none, none, none, none)


def rastered(two, count, cell_mm=0.01):
    """Holes of random prints, counted on a raster by the distance to lines: shares no code with ``draws``."""
    rng, counts, x = np.random.default_rng(1), [], np.arange(cell_mm / 2, 10, cell_mm)
    for _ in range(count):
        unfilled = np.ones((len(x), len(x)), bool)
        for layer in two.lines:
            shift, half = rng.uniform(-0.05, 0.05, 2), 0.2 * rng.uniform(0.95, 1.05)
            filled = np.zeros_like(unfilled)
            for start, end in zip(layer.start_mm + shift, layer.end_mm + shift, strict=True):
                i, j = np.searchsorted(x, np.minimum(start, end) - half)
                m, n = np.searchsorted(x, np.maximum(start, end) + half)
                px, py, (ux, uy) = x[i:m, None] - start[0], x[None, j:n] - start[1], end - start
                t = ((px * ux + py * uy) / (ux**2 + uy**2)).clip(0, 1)
                filled[i:m, j:n] |= (px - t * ux) ** 2 + (py - t * uy) ** 2 < half**2
            unfilled &= ~filled
        label, _ = ndimage.label(unfilled)
        counts.append(int((np.bincount(label.ravel())[1:] * cell_mm**2 > 4.5e-4).sum()))
    return np.array(counts)


def test_holes_of_random_prints_are_as_many_as_on_a_raster():
    """Four corners of a wall are open; 530 crossings of slits at most 0.02 mm wide are no holes."""
    two = film(joined(1), joined(-1))
    drawn, counted = draws(two, 16), rastered(two, 8)
    assert (np.median(drawn), np.median(counted)) == pytest.approx((3, 3), abs=0.5)
    assert np.quantile(drawn, 0.9) == np.quantile(counted, 0.9) == 4


def test_without_holes_the_posterior_is_a_beta_distribution():
    for shorted, prints in ((0, 0), (0, 5), (3, 4), (29, 32)):
        exact = beta(0.5 + shorted, 0.5 + prints - shorted)
        found = chance([0.0], JEFFREYS, shorted, prints)
        assert found.mean == pytest.approx(exact.mean(), abs=0.005)
        assert (found.low, found.high) == pytest.approx((exact.ppf(0.05), exact.ppf(0.95)), abs=0.015)


def test_holes_raise_the_probability_and_intact_prints_lower_it():
    assert [chance([holes], JEFFREYS, 0, 0).mean for holes in (20.0, 1.0, 0.0)] == pytest.approx(
        [1 - 0.5 * np.mean((1 - JEFFREYS) ** holes) for holes in (20.0, 1.0, 0.0)]
    )
    assert chance([20.0], JEFFREYS, 0, 10).high < 0.27
    assert chance([0.0], JEFFREYS, 10, 10).low > 0.75


def test_the_interval_covers_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(5)
    truths = rng.beta(0.5, 0.5, 200)
    hits = 0
    for truth in truths:
        found = chance([0.0], JEFFREYS, int(rng.binomial(12, truth)), 12)
        hits += found.low <= truth <= found.high
    assert 0.84 < hits / 200 < 0.96


def moment(shorted, failed, power, mean, alike):
    """E[p^(shorted + power) (1 - p^power)^failed] of one shape's counts by layers, p by Beta(mean alike, ...)."""
    a = mean * alike
    terms = [(sum(k * power(n) for n, k in shorted.items()), 1)]
    for n, count in failed.items():
        for _ in range(count):
            terms += [(t + power(n), -sign) for t, sign in terms]
    return lambda more: sum(
        sign * np.exp(gammaln(a + t + more) - gammaln(a) + gammaln(alike) - gammaln(alike + t + more))
        for t, sign in terms
    )


def integrated(table, shape, layers):
    """Mean and standard deviation of r by midpoints over m, k and g; p is integrated in closed form."""
    middle = (np.arange(60) + 0.5) / 60
    mean, pooled, together = np.meshgrid(middle, middle, middle, indexing="ij")
    alike = pooled / (1 - pooled)
    weight, wanted = 1.0, None
    for each in sorted({shape, *(s for s, _, _ in table)}):
        shorted, failed = ({n: k for (s, n, low), k in table.items() if s == each and low == yes} for yes in (1, 0))
        of = moment(shorted, failed, lambda n: n**together, mean, alike)
        weight, wanted = (weight, of) if each == shape else (weight * of(0.0), wanted)
    base, first, second = ((weight * wanted(k * layers**together)).sum() for k in (0, 1, 2))
    return first / base, np.sqrt(second / base - (first / base) ** 2)


@cache
def table_d1():
    """Series 23 by shape, layers and whether R_Z is below ten times R_Y, from the table that was parsed by hand."""
    found = Counter()
    with (Path(__file__).parents[1] / "reference" / "table_d1.csv").open() as text:
        for row in csv.DictReader(text):
            if row["iteration"] == "23" and row["ry_ohm"] and row["rz_ohm"]:
                least = [min(map(float, row[name].split(";"))) for name in ("ry_ohm", "rz_ohm")]
                layers = round(float(row["film_mm"]) / (0.06 if row["slicing"] == "extrafine" else 0.1))
                found[row["shape"], layers, int(least[1] <= 10 * least[0])] += 1
    return found


def test_series_23_is_that_of_the_table_parsed_by_hand():
    signed = Counter()
    for (shape, layers), (shorted, prints) in series().items():
        signed += Counter({(shape, layers, 1): shorted, (shape, layers, 0): prints - shorted})
    assert signed == table_d1()
    assert sum(series()[key][0] for key in series()) == 48


@pytest.mark.parametrize(
    ("shape", "layers"), [("tri", 2), ("rect", 1), ("rect", 6), ("reference", 1), ("reference", 6)]
)
def test_the_rate_of_other_shorts_is_that_of_an_integration(shape, layers):
    values = elsewhere(shape, [layers])
    assert (values.mean(), values.std()) == pytest.approx(integrated(table_d1(), shape, layers), abs=0.012)


def test_six_layers_are_below_a_fifth_if_prints_show_that_layers_help():
    """A hundred prints each: 4 in 5 shorted with one layer, 16 in 25 with two, 8 in 20 with four."""
    assert elsewhere("reference", [6]).mean() > 0.2  # series 23: two layers shorted as often as one
    helped = {("rect", 1): (80, 100), ("rect", 2): (64, 100), ("rect", 4): (40, 100)}
    assert 0.2 < elsewhere("rect", [6], helped).mean() < 0.32
    assert elsewhere("rect", [6], {("rect", 1): (20, 100), ("rect", 2): (4, 100)}).mean() < 0.05
    two = elsewhere("rect", [2, 2], helped).mean()
    assert elsewhere("rect", [2], helped).mean() < two < 2 * elsewhere("rect", [2], helped).mean()


def test_a_log_of_the_same_table_does_not_count_twice(tmp_path):
    with Log(tmp_path / "log.db", create=True) as log:
        exchange.thesis(log)
        assert verdicts(log, make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})) == (0, 0)
        assert verdicts(log, make({"shape": "rect", "parameters": {"dielectric_mm": 0.0}}))[1] > 0  # of other series


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
    assert found.posterior.mean < found.prior.mean  # fewer than in series 23
    said = "\n".join(str(part) for part in found.document())
    assert "yield" not in said
    assert "2 of 3 prints" in said
    assert "11 of 13 with 1, 17 of 18 with 2" in said
    assert len(figure.choices[""]) == 1
