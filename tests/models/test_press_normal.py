"""Contact along the normals: upright faces, undercuts, a closing gap within one solid, and the mirrors."""

from dataclasses import replace

import numpy as np
import pytest

from sensorgen.scene.repetition import slices
from sensorgen.scene.scene import Body, Prism, Scene, rectangle
from sensorgen.scene.sections import sections

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.solvers.contact import cell as cells
from sensorgen.solvers.contact import closing, contact, plane_field

EPS = {"x60": 4.68, "etpu": 5.0, "air": 1.00059}
EPS0 = 8.8541878e-12
SOFT = {"x60": Elastic(1e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
BASE = 0.3
ROUGH = Fineness().scaled(2)


def cell_of(high, left, right, *outlines):
    """Outlines of X60 between plates of eTPU 0.3 mm thick, ``high`` apart; mirrors at the ends."""
    wide, top = 4.0, BASE + high
    bodies = (
        Body("bottom_electrode", "etpu", (Prism("y", rectangle(0, wide, 0, BASE), 0.0, 10.0),), "bottom"),
        Body("shape", "x60", tuple(Prism("y", tuple(o), 0.0, 10.0) for o in outlines)),
        Body("top_electrode", "etpu", (Prism("y", rectangle(0, wide, top, top + 0.3), 0.0, 10.0),), "top"),
    )
    whole = slices(sections(Scene(bodies, (wide, 10.0, top + 0.3)))[0], 0.0, layered=True)
    return cells.between(whole, left, right, mirrored=True)


def box(left, right, low, high):
    return rectangle(left, right, BASE + low, BASE + high)


def pillars(gap, count=1):
    """Half a pillar 0.45 mm wide and 0.5 high before a mirror, or two halves ``gap`` apart."""
    period = 0.45 + gap
    bars = [box(k * period + gap / 2, (k + 1) * period - gap / 2, 0, 0.5) for k in range(3)]
    return cell_of(0.5, 0.5 * period, (0.5 + count / 2) * period, *bars)


def solved(cell, stresses, held=None, fineness=None):
    return press2d._solved(cell, SOFT, stresses, held or BoundaryConditions(), fineness or Fineness())


def with_field(cell, stresses):
    """Capacitances of a cell [F/m2], all of which have to be known; and its displacements [m]."""
    found = press2d.press(cell, SOFT, stresses, EPS)
    assert found.faults == ()
    assert max(c.width() for c in found.capacitance_f_per_m2) < 1e-3
    return np.array([c.middle() for c in found.capacitance_f_per_m2]), np.array(found.displacement_m)


def test_faces_that_run_through_each_other_are_caught(monkeypatch):
    """Made blind to each other: the curve ends where the pillars would enter one another."""
    project = contact.Faces.project

    def blind(self, places_m, penalty_pa, kept=None):
        pairs = project(self, places_m, penalty_pa, kept)
        return pairs.some(np.zeros(len(pairs.point), bool))

    monkeypatch.setattr(contact.Faces, "project", blind)
    for count in (1, 2):  # beyond a mirror, and inside two bodies
        found, _ = solved(pillars(0.05, count), np.linspace(0, 4e5, 9))
        assert found.faults[0].startswith("converged up to")
        assert found.converged_pa < 4e5  # they touch at 120 kPa


def test_two_pillars_that_bulge_into_each_other_are_one_before_a_mirror():
    one, two = (solved(pillars(0.05, count), [0.0, 2e5, 4e5], fineness=ROUGH)[0] for count in (1, 2))
    assert one.faults == two.faults == ()
    assert two.displacement_m == pytest.approx(one.displacement_m, rel=2e-3)


def test_the_capacitance_is_continuous_where_pillars_meet():
    """Loads 3 kPa apart from 120 kPa on, where they meet: C goes on rising, never by a step."""
    stresses = np.concatenate([np.linspace(0, 1.14e5, 3), np.arange(1.17e5, 1.51e5, 3e3)])
    middle, _ = with_field(pillars(0.05), stresses)
    rises = np.diff(middle[3:])
    assert (rises[1:] / rises[:-1]).min() > 0.6
    assert (rises[1:] / rises[:-1]).max() < 1.1
    assert rises[-1] < 0.7 * rises[0]  # slower once they have met
    at_once, _ = with_field(pillars(0.05), [0.0, stresses[-1]])
    assert middle[-1] == pytest.approx(at_once[1], rel=1e-4, abs=0)


def test_an_upright_gap_that_is_shut_is_none():
    """Two blocks between mirrors that fill what is between the plates when pressed: the capacitance of one film."""
    blocks = box(0, 0.346, 0, 0.3), box(0.35, 0.7, 0, 0.3)
    (open_, *shut), moved = with_field(cell_of(0.3, 0, 0.7, *blocks), [0.0, 5e4, 1e5])
    film = EPS["x60"] * EPS0 / (0.3e-3 - moved)
    assert shut == pytest.approx(film[1:], rel=1e-3, abs=0)
    assert open_ < film[0]


def contact_force(problem, state):
    springs, places = problem.springs(state.pairs), problem.places(state.u_m)
    length, acts = springs.lengths(places)
    return springs.rows.T @ (acts * length)


def forces(run, state):
    """Of the contact on each node (n, 2) [N/m], and where the nodes are."""
    return contact_force(run.problem, state).reshape(-1, 2), run.problem.places(state.u_m)


def test_a_dovetail_is_held_on_its_undercut_flank():
    """Two trapezia that hook under each other: forces and moments of the contact cancel."""
    foot = [(0, 0), (0.45, 0), (0.25, 0.5), (0, 0.5)]
    hook = [(0.5, 0), (0.7, 0), (0.7, 0.5), (0.3, 0.5)]
    drawn = [[(x, BASE + y) for x, y in shape] for shape in (foot, hook)]
    found, run = solved(cell_of(0.5, 0, 0.7, *drawn), np.linspace(0, 2e5, 4))
    assert found.faults == ()
    assert found.displacement_m[-1] * 1e6 == pytest.approx(33.4, rel=0.005)
    force, places = forces(run, run.states[-1])
    total = np.abs(force).sum()
    assert total > 90
    assert force.sum(axis=0) == pytest.approx([0, 0], abs=1e-12 * total)
    moment = places[:, 0] * force[:, 1] - places[:, 1] * force[:, 0]
    assert moment.sum() == pytest.approx(0, abs=1e-4 * total * 0.5e-3)


def slope(drop, gap=1e-3):
    """A block cut along a slope, its upper part ``gap`` above the lower one, between mirrors."""
    left, right = BASE + 0.4, BASE + 0.4 - drop
    lower = [(0, BASE), (0.7, BASE), (0.7, right), (0, left)]
    upper = [(0, left + gap), (0.7, right + gap), (0.7, BASE + 0.6), (0, BASE + 0.6)]
    return cell_of(0.6, 0, 0.7, lower, upper)


@pytest.mark.parametrize("drop", [0.0, 0.4])
def test_a_sloping_joint_hands_an_even_pressure_on(drop):
    """Patch test: what keeps its volume between fixed walls bears p everywhere, whatever the joint's slope.

    Only the little triangles in the corners at the joint's ends differ by more than 1 %.
    """
    stresses = [0.0, 1e4, 1e5]
    cell = slope(drop)
    found, run = solved(cell, stresses)
    assert found.faults == ()
    assert found.fall_m == pytest.approx(1e-6, rel=1e-6)  # straight down, on a slope too
    outline = closing.deformed(cell, run.mesh, run.problem.faces, run.states[-1].u_m)
    filled = plane_field.capacitance(cell, plane_field.meshed(outline, cell.width_mm() / 4, 0.2), EPS)
    assert filled.middle() == pytest.approx(EPS["x60"] * EPS0 / (0.6e-3 - found.displacement_m[-1]), rel=1e-4, abs=0)
    off = np.abs(-run.states[-1].inner.pressure[:, 0] / 1e5 - 1)
    mesh = run.problem.elements.mesh
    corners = mesh.points_m[mesh.outer[:, :3]]
    sides = corners[:, 1:] - corners[:, :1]
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    assert (off * area).sum() / area.sum() < 1.2e-3
    assert area[off > 0.01].sum() / area.sum() < 0.005


def test_a_sloping_joint_that_sticks_is_none():
    """At nu = 0.3 the joint bears shear: held fast it gives way as the whole block does, loose it slides."""
    solids = {"x60": Elastic(1e6, 0.3), "etpu": Elastic(22e6, 0.3)}
    whole = cell_of(0.6, 0, 0.7, box(0, 0.7, 0, 0.6))
    one = press2d.press(whole, solids, [0.0, 1e4, 2e4], fineness=ROUGH).displacement_m
    held, loose = (
        press2d.press(slope(0.4), solids, [0.0, 1e4, 2e4], None, BoundaryConditions(contact=kind), ROUGH).displacement_m
        for kind in ("stick", "frictionless")
    )
    assert np.diff(held)[1] == pytest.approx(np.diff(one)[1], rel=0.02)
    assert np.diff(loose)[1] > 1.05 * np.diff(one)[1]


def test_the_energy_of_the_contact_is_that_of_its_forces():
    """Gap and slip: the energy's differences along a motion are the forces' work."""
    _, run = solved(slope(0.4), [0.0, 1e4], BoundaryConditions(contact="stick"), ROUGH)
    problem, state = run.problem, run.states[-1]
    assert state.pairs.sticks.any()
    ways = np.random.default_rng(1).normal(size=(2, len(state.u_m)))
    state, motion = replace(state, u_m=state.u_m + 1e-8 * ways[0]), 1e-13 * ways[1]
    there = [replace(state, u_m=state.u_m + share * motion) for share in (-1, 0, 1)]
    before, _, after = (problem.contact_energy(s) for s in there)
    force = contact_force(problem, state)
    slid = problem.slips(state.pairs, state.u_m)[:, 0] * state.pairs.sticks
    assert (state.pairs.stiffness_pa * slid**2).sum() > 0.1 * problem.contact_energy(state)
    assert (after - before) / 2 == pytest.approx(force @ motion, rel=1e-4, abs=0)
