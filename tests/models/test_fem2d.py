"""Cells of a cross-section between two bounds: references, scenes of all kinds, bad input."""

from itertools import pairwise

import numpy as np
import pytest
from cell_scenes import CELLS, EPS, MM, between_curves, bumps, close, plates, rect_cell, stairs, tri_cell

from sensorgen.core.errors import OutOfRange
from sensorgen.design.shapes import reference, tri
from sensorgen.models import columns, fem2d
from sensorgen.scene.scene import Body, Fill, Scene, box
from sensorgen.solvers.electrostatics import bounds


def holds(found, low: float, high: float | None = None) -> bool:
    """Whether an interval meets another one, that of a reference."""
    return found.lower <= (low if high is None else high) and low <= found.upper


@pytest.mark.parametrize("case", CELLS["tri"], ids=lambda c: f"d={c['d']}")
def test_tri_lies_between_its_bounds(case):
    found = fem2d.capacitance(tri_cell(case["d"]), EPS, 1e-6).times(1 / MM)
    off = case["rel_error_halfwidth"]
    assert found.width() <= 1e-6
    assert holds(found, case["C_F_per_m"] * (1 - off), case["C_F_per_m"] * (1 + off))


def test_the_width_falls_exponentially_with_the_order():
    section, coarse = fem2d._triangles(tri_cell(0.1))
    mesh = fem2d._graded(coarse, EPS, 1e-10)
    widths = [bounds.whole(fem2d._solved(mesh, EPS, p), [1.0]).width() for p in (3, 5, 7, 9)]
    assert section.depth_mm == 1.0
    assert all(b < a / 5 for a, b in pairwise(widths))  # a factor of 9 to 12, measured


def test_a_plate_is_exact():
    scene = reference.scene(reference.Params(length_mm=2.0, width_mm=2.0), Fill())
    found = fem2d.capacitance(scene, EPS, 1e-6)
    assert (found.lower, found.upper) == close((CELLS["plate"]["cell_2x2mm_F"],) * 2, 2e-9)


GENERAL = {
    "stairs": stairs(),
    "bumps": bumps(10),
    "flatter": tri_cell(0.1, hang_height_mm=0.2, lower_height_mm=0.1),
    "steeper": tri_cell(0.1, hang_height_mm=1.5, lower_height_mm=1.2),
    "isolated": tri_cell(0.1, isolation_mm=0.3),
    "supported": tri.scene(tri.Params(length_mm=2.0, width_mm=1.0), Fill(support="pva")),
    "bent alike": between_curves(
        lambda u: 0.6 - 0.4 * abs(u - 1), lambda u: 1.0 - 0.4 * abs(u - 1), np.arange(3.0), 1.2
    ),
    "curved": between_curves(
        lambda u: 0.3 + 0.1 * np.cos(np.pi * u), lambda u: 0.7 + 0.2 * np.sin(3 * u), np.linspace(0, 2, 17), 1.2
    ),
}


@pytest.mark.parametrize("name", GENERAL)
def test_scenes_that_nobody_foresaw(name):
    """Vertical columns lie below and their trial potentials above, whatever is drawn; a finer width lies within."""
    scene, eps = GENERAL[name], EPS | {"pva": 3.0}
    found, finer = (fem2d.capacitance(scene, eps, w) for w in (1e-3, 1e-5))
    bounds = columns.capacitance(scene, eps)
    assert finer.width() <= 1e-5
    assert bounds.lower < finer.lower < finer.upper < bounds.upper
    assert found.lower <= finer.lower * (1 + 1e-9)
    assert finer.upper <= found.upper * (1 + 1e-9)


def test_support_of_the_films_kind_fills_the_air():
    """Support of permittivity eps in the gaps is air of permittivity eps."""
    filled = tri.scene(tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=0.1), Fill(support="pva"))
    with_support = fem2d.capacitance(filled, EPS | {"pva": 3.0}, 1e-6)
    with_air = fem2d.capacitance(tri_cell(0.1), {"x60": 4.68, "air": 3.0}, 1e-6)
    assert with_support.middle() == close(with_air.middle(), 1e-6)


@pytest.mark.parametrize(
    ("eps", "width", "words"),
    [
        (EPS | {"x60": 0.0}, 1e-4, "x60 is 0; expected a number above 0"),
        (EPS | {"air": float("nan")}, 1e-4, "air"),
        (EPS, float("nan"), "accuracy"),
    ],
)
def test_nonsense_is_refused(eps, width, words):
    with pytest.raises(OutOfRange, match=words):
        fem2d.capacitance(tri_cell(0.1), eps, width)


def test_a_missing_permittivity_is_named():
    with pytest.raises(KeyError, match="x60"):
        fem2d.capacitance(tri_cell(0.1), {"air": 1.0})


def test_what_it_cannot_speak_of():
    overlap = plates(Body("a", "x60", (box(0, 2, 0, 1, 0.2, 0.6),)), Body("b", "pva", (box(0, 2, 0, 1, 0.5, 0.8),)))
    half = Scene((plates().bodies[0], Body("high", "etpu", (box(0, 1, 0, 1, 1.2, 1.4),), "top")), (2.0, 1.0, 1.4))
    middle = plates(Body("mid", "etpu", (box(0, 2, 0, 1, 0.5, 0.6),), "middle"))
    assert "overlap" in (fem2d.why_not_applicable(overlap) or "")
    assert "does not cover" in (fem2d.why_not_applicable(half) or "")
    assert "three directions" in (fem2d.why_not_applicable(rect_cell(0.1)) or "")
    assert "two electrodes" in (fem2d.why_not_applicable(middle) or "")
    assert fem2d.why_not_applicable(tri_cell(0.1)) is None
