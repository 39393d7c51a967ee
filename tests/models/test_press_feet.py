"""Feet under pressure: as printed in layers, bonded or free, wider below than above, and against closed forms."""

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.scene.scene import Body, Prism, Scene, rectangle

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.solvers.contact import plane_field

SOLIDS = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
EPS = {"x60": 4.68, "air": 1.00059}
QUICK = Fineness(corner_mm=0.08, coarse_mm=0.2)


def prisms(*boxes):
    return tuple(Prism("y", rectangle(*box), 0.0, 10.0) for box in boxes)


def stacked(*feet, film=0.1, lift=0.0, material="x60"):
    """A top on feet: half widths of the layers of 0.1 mm from below, feet at x = 0.5 and 2.5, on a film of 0.1 mm."""
    roof = 0.3 + film + lift + 0.1 * len(feet)
    bars = [
        (x - w, x + w, 0.3 + film + lift + 0.1 * k, 0.3 + film + lift + 0.1 * (k + 1))
        for x in (0.5, 2.5)
        for k, w in enumerate(feet)
    ]
    bodies = (
        Body("bottom_electrode", "etpu", prisms((0, 4, 0, 0.3)), "bottom"),
        Body("film", "x60", prisms((0, 4, 0.3, 0.3 + film))),
        Body("feet", material, prisms(*bars), "" if material == "x60" else "top"),
        Body("top_electrode", "etpu", prisms((0, 4, roof, roof + 0.3)), "top"),
    )
    return press2d.cell(Scene(bodies, (4.0, 10.0, roof + 0.3)), 2.0)


@pytest.fixture(scope="module")
def bonded():
    return press2d.press(stacked(0.2, 0.3), SOLIDS, [0.0, 5e3, 1e4], EPS, fineness=QUICK)


def test_a_bonded_foot_is_nearly_linear(bonded):
    assert (bonded.faults, bonded.doubts) == ((), ())
    assert bonded.displacement_m[2] == pytest.approx(2 * bonded.displacement_m[1], rel=0.02)


def test_a_free_foot_falls_and_then_carries_as_if_it_stuck(bonded):
    """A flat foot that rests on the film and cannot slip differs from a bonded one only in its corners."""
    held = BoundaryConditions(contact="stick")
    found = press2d.press(stacked(0.2, 0.3, lift=0.05), SOLIDS, [0.0, 5e3, 1e4], EPS, held, QUICK)
    assert found.faults == ()
    assert found.fall_m == pytest.approx(0.05e-3, rel=1e-6)
    assert "the top falls" in found.doubts[-1]
    assert found.displacement_m[0] == 0
    assert found.displacement_m[1:] - found.fall_m == pytest.approx(bonded.displacement_m[1:], rel=0.06)
    grown = [c.middle() for c in found.capacitance_f_per_m2]
    assert grown[2] == pytest.approx(bonded.capacitance_f_per_m2[2].middle(), rel=0.01)


def test_a_foot_that_slips_is_softer(bonded):
    slips = press2d.press(stacked(0.2, 0.3, lift=1e-3), SOLIDS, [0.0, 1e4], fineness=QUICK)
    assert slips.displacement_m[1] - slips.fall_m > 1.01 * bonded.displacement_m[2]


def test_a_foot_wider_below_than_above_is_no_graph_over_x():
    """An upside-down stair has faces one above the other; its ledge shuts on the roof when pressed enough."""
    found = press2d.press(stacked(0.4, 0.1, 0.1), SOLIDS, [0.0, 1e4, 2e4, 4e4], EPS, fineness=QUICK)
    assert found.faults == ()
    assert np.all(np.diff(found.displacement_m) > 0)
    slim = press2d.press(stacked(0.1, 0.1, 0.1), SOLIDS, [0.0, 1e4], fineness=QUICK)
    assert found.displacement_m[1] < slim.displacement_m[1]
    assert max(c.width() for c in found.capacitance_f_per_m2) < 0.01


def test_contact_hands_an_even_pressure_on():
    """Patch test: a plate that lies loose on a plate, sides on mirrors, is as stiff as one that is bonded."""

    def plates(lift):
        bodies = (
            Body("bottom_electrode", "etpu", prisms((0, 4, 0, 0.3)), "bottom"),
            Body("film", "x60", prisms((0, 4, 0.3, 0.6))),
            Body("top_electrode", "etpu", prisms((0, 4, 0.6 + lift, 0.9 + lift)), "top"),
        )
        return press2d.cell(Scene(bodies, (4.0, 10.0, 0.9 + lift)), 2.0)

    soft = {name: Elastic(s.youngs_modulus_pa, 0.4) for name, s in SOLIDS.items()}
    whole = press2d.press(plates(0.0), soft, [0.0, 2e4, 4e4], EPS)
    softer = []
    for fineness in (Fineness(), Fineness().finer()):
        loose = press2d.press(plates(1e-2), soft, [0.0, 2e4, 4e4], EPS, fineness=fineness)
        assert loose.faults == ()
        softer.append(np.diff(loose.displacement_m)[1] - np.diff(whole.displacement_m)[1])
        assert loose.capacitance_f_per_m2[2].middle() == pytest.approx(whole.capacitance_f_per_m2[2].middle(), rel=1e-3)
    assert 0 < softer[0] < 2e4 * 0.15e-3 / (60 * 6e6)  # what the penalty gives way: pressure times side over 60 E
    assert softer[1] == pytest.approx(softer[0] / 2, rel=0.15)


def test_a_gap_that_shuts_fully_leaves_a_solid():
    """A shallow slot shuts; from then on the cell is as stiff as a solid plate."""
    soft = {name: Elastic(s.youngs_modulus_pa, 0.4) for name, s in SOLIDS.items()}
    bodies = (
        Body("bottom_electrode", "etpu", prisms((0, 4, 0, 0.3)), "bottom"),
        Body("film", "x60", prisms((0, 4, 0.3, 0.5), (0.3, 1.7, 0.5, 0.52), (2.3, 3.7, 0.5, 0.52))),
        Body("top_electrode", "etpu", prisms((0, 4, 0.52, 0.8)), "top"),
    )
    slotted = press2d.cell(Scene(bodies, (4.0, 10.0, 0.8)), 2.0)
    found = press2d.press(slotted, soft, np.linspace(0, 1.2e6, 7), EPS, fineness=QUICK)
    slopes = np.diff(found.displacement_m) / np.diff(found.stress_pa)
    oedometer = {k: s.youngs_modulus_pa * 0.6 / (1.4 * 0.2) for k, s in soft.items()}
    solid = 0.58e-3 / oedometer["etpu"] + 0.22e-3 / oedometer["x60"]
    assert slopes[0] > 1.3 * solid
    assert slopes[-1] == pytest.approx(solid, rel=0.15)


def test_bodies_that_overlap_are_refused():
    with pytest.raises((BadInput, ValueError), match="overlap"):
        press2d.press(stacked(0.2, 0.3, film=0.35, lift=-0.15), SOLIDS, [0.0, 1.0])


def test_a_cell_without_mirrors_stands_between_mirrors():
    bodies = (
        Body("bottom_electrode", "etpu", prisms((0, 4, 0, 0.3)), "bottom"),
        Body("film", "x60", prisms((0, 4, 0.3, 0.5))),
        Body(
            "feet",
            "x60",
            prisms((0.4, 0.8, 0.5, 0.7), (0.8, 1.1, 0.5, 0.6), (2.4, 2.8, 0.5, 0.7), (2.8, 3.1, 0.5, 0.6)),
        ),
        Body("top_electrode", "etpu", prisms((0, 4, 0.7, 1.0)), "top"),
    )
    found = press2d.press(press2d.cell(Scene(bodies, (4.0, 10.0, 1.0)), 2.0), SOLIDS, [0.0, 1e4], EPS, fineness=QUICK)
    assert found.faults == ()
    assert "mirror image" in found.doubts[0]


def test_outlines_that_cross_never_reach_the_mesher():
    with pytest.raises(plane_field.Unmeshed, match="run into each other"):
        plane_field._refuse_crossings(np.array([[(0.0, 0.0), (1.0, 1.0)], [(0.0, 1.0), (1.0, 0.0)]]))
    plane_field._refuse_crossings(np.array([[(0.0, 0.0), (1.0, 1.0)], [(1.0, 1.0), (2.0, 0.0)]]))  # they only touch
