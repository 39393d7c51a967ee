"""Electrodes that do not cover the sensor: against Kirchhoff's disc, and resistor networks on voxels."""

import importlib.util
from dataclasses import replace
from math import cos, log, pi, sin, sqrt

import numpy as np
import pytest

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import capacitance_models, overlap, prisms
from sensorgen.prediction.capacitance import OPEN, capacitance, default_width
from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.scene import FLOATING, Body, Prism, Scene, box
from sensorgen.scene.slabs import covered, is_open, slabs

solver = pytest.mark.skipif(importlib.util.find_spec("ngsolve") is None, reason="NGSolve is not installed")
EPS = {"x60": 4.68, "air": 1.0}
MM = 1e-3


def discs(radius, gap, thick, corners=48):
    angles = np.arange(corners) * 2 * pi / corners
    outline = tuple((5 + radius * cos(a), 5 + radius * sin(a)) for a in angles)
    plates = {"bottom": (0.0, thick), "top": (thick + gap, 2 * thick + gap)}
    bodies = tuple(Body(end, "etpu", (Prism("z", outline, *span),), end) for end, span in plates.items())
    return Scene(bodies, (10, 10, 2 * thick + gap))


@solver
def test_round_plates_are_those_of_kirchhoff():
    """Thick discs (Kirchhoff 1877); its error is of the order of (d / R)^2."""
    radius, gap, thick = 4.9, 0.2, 0.05
    scene = discs(radius, gap, thick)
    polygon = 24 * radius**2 * sin(2 * pi / 48)
    r = sqrt(polygon / pi)
    edge = log(16 * pi * r * (gap + thick) / gap**2) - 1 + thick / gap * log(1 + gap / thick)
    exact = EPS0_F_PER_M * MM * (polygon / gap + r * edge)
    found = prisms.capacitance(scene, {"air": 1.0}, 1e-2)
    assert found.width() < 6e-3
    assert (found.lower * (1 - 2e-3), found.upper * (1 + 2e-3)) == pytest.approx((exact, exact), rel=6e-3)
    assert found.lower < exact * 1.003
    assert exact * 0.997 < found.upper
    rough = overlap.capacitance(scene, {"air": 1.0})
    assert rough.lower == pytest.approx(EPS0_F_PER_M * MM * polygon / gap, rel=1e-6)
    assert rough.lower < found.lower < found.upper < rough.upper < 1.2 * found.upper


def plates(more=()):
    """Two plates of different size, one off the middle, with half a film on the lower one."""
    bodies = (
        Body("low", "etpu", (box(0, 3, 0, 3, 0, 0.25),), "bottom"),
        Body("film", "x60", (box(0, 3, 0, 1.5, 0.25, 0.5),)),
        *more,
        Body("up", "etpu", (box(0.5, 2.0, 0.75, 2.0, 0.75, 1.0),), "top"),
    )
    return Scene(bodies, (3, 3, 1.0))


@solver
def test_a_conductor_that_floats_between_them_shortens_the_way_of_the_flux():
    floating = Body("shield", "etpu", (box(0, 3, 0, 3, 0.5, 0.625),), FLOATING)
    scene = plates((floating,))
    found, rough = prisms.capacitance(scene, EPS, 0.1), overlap.capacitance(scene, EPS)
    straight = [area / (below / eps + 0.125) for area, below, eps in ((1.125, 0.25, 4.68), (0.75, 0.25, 1.0))]
    assert rough.lower == pytest.approx(EPS0_F_PER_M * MM * sum(straight), rel=1e-6)
    assert rough.lower < found.lower < found.upper < rough.upper
    assert found.lower > prisms.capacitance(plates(), EPS, 0.1).upper


@solver
def test_a_slanted_pad_lies_between_the_boxes_that_enclose_it():
    plate, lid = box(0, 30, 0, 10, 0, 0.4), box(0, 30, 0.3, 9.7, 1.2, 1.6)
    pad = Prism("x", ((0, 0.4), (10, 0.4), (10, 0.9), (9.7, 1.2), (0.3, 1.2), (0, 0.9)), 0, 30)
    less, more = (box(0, 30, side, 10 - side, 0.4, 1.2) for side in (0.3, 0.0))
    found = []
    for piece in (less, pad, more):
        bodies = (
            Body("low", "etpu", (plate,), "bottom"),
            Body("pad", "x60", (piece,)),
            Body("up", "etpu", (lid,), "top"),
        )
        found.append(prisms.capacitance(Scene(bodies, (30, 10, 1.6)), EPS, 4e-2))
    assert all(one.width() < 4e-2 for one in found)
    assert found[0].lower < found[1].upper
    assert found[1].lower < found[2].upper
    assert found[0].middle() < found[1].middle() < found[2].middle()


def test_covering_plates_stay_with_the_other_models():
    bodies = (Body("low", "etpu", (box(0, 3, 0, 3, 0, 0.25),), "bottom"),
              Body("up", "etpu", (box(0, 3, 0, 3, 0.5, 0.75),), "top"))  # fmt: skip
    scene = Scene(bodies, (3, 3, 0.75))
    assert "cover the sensor" in (overlap.why_not_applicable(scene) or "")
    assert not is_open(scene)
    assert capacitance(scene, EPS, 1e-3).model == "columns"
    assert is_open(plates())
    assert covered(plates(), "bottom")
    assert default_width(plates()) == OPEN
    fine = [name for name, model in capacitance_models().items() if not model.why_not_applicable(plates())]
    assert fine == ["overlap", "prisms"] or fine == ["overlap"]


def test_electrodes_beside_each_other_are_refused_in_closed_form():
    low, film, up = plates().bodies
    beside = replace(up, pieces=(box(4, 5, 0, 3, 0, 0.25),))
    assert "reach into each other" in (overlap.why_not_applicable(Scene((low, film, beside), (5, 3, 1.0))) or "")


def test_slabs_enclose_what_is_slanted():
    """A frustum: what all heights of a slab share, and what any covers, hold its volume between them."""
    lower, upper = ((0, 0), (4, 0), (4, 4), (0, 4)), ((1, 1), (3, 1), (3, 3), (1, 3))
    scene = Scene((Body("foot", "etpu", (Loft(lower, upper, 0.0, 1.0),), "top"),), (4, 4, 1.0))
    exact = (16 + 4 + sqrt(64)) / 3
    widths = []
    for cuts in (8, 32):
        found = slabs(scene, cuts)
        inner, outer = (
            sum((s.high_mm - s.low_mm) * sum(r.area for r in own.values()) for s, own in pairs)
            for pairs in ([(s, s.inner) for s in found], [(s, s.outer) for s in found])
        )
        assert inner < exact < outer
        widths.append(outer - inner)
    assert widths[0] == pytest.approx(12 / 8, rel=1e-6)  # the areas of both ends differ by 12 mm2
    assert widths[1] == pytest.approx(12 / 32, rel=1e-6)
