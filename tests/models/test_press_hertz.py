"""A cylinder on a stiff flat against Hertz's line contact: half width, peak of the pressure, and approach."""

import numpy as np
import pytest

from sensorgen.scene.scene import Body, Prism, Scene, rectangle

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness

RADIUS_MM, HALF_WIDTH_MM, E_PA = 1.0, 0.02, 6e6


def cylinder(side_mm):
    """The lower half of a polygon about a circle, on a flat; sides grow from where it touches."""
    sizes = np.minimum(side_mm * np.exp(0.25 * np.maximum(np.arange(400) - 2 * HALF_WIDTH_MM / side_mm, 0)), 0.1)
    angle = np.cumsum(sizes)
    angle = np.append(angle[angle < np.pi / 2 - 0.05], np.pi / 2)
    angle = np.concatenate([-angle[::-1], [0.0], angle])
    outline = np.column_stack([1.5 + np.sin(angle), 1.1 - np.cos(angle)]).round(9)
    bodies = (
        Body("flat", "stiff", (Prism("y", rectangle(0, 3, 0, 0.1), 0.0, 10.0),)),
        Body("cylinder", "soft", (Prism("y", tuple(map(tuple, outline.tolist())), 0.0, 10.0),)),
    )
    return press2d.cell(Scene(bodies, (3.0, 10.0, 1.1)), 3.0)


def over_hertz(side_mm, nu=0.3):
    """Half width of the contact and approach, each over the closed form, less 1."""
    plane, wide = E_PA / (1 - nu**2), HALF_WIDTH_MM * 1e-3
    force = np.pi * plane * wide**2 / (4 * RADIUS_MM * 1e-3)  # both halves [N/m]
    solids = {"soft": Elastic(E_PA, nu), "stiff": Elastic(1e5 * E_PA, 0.3)}
    stress = [0.0, force / (2 * RADIUS_MM * 1e-3)]
    fineness = Fineness(side_mm, 0.1, 0.1, 0.3)
    found, run = press2d._solved(cylinder(side_mm), solids, stress, BoundaryConditions(top="rigid"), fineness)
    assert found.faults == ()
    state, places = run.states[-1], run.problem.places(run.states[-1].u_m)
    push = np.maximum(-run.problem.gaps(state.pairs, state.u_m), 0) * state.pairs.stiffness_pa
    here = run.problem.faces.rays(places).here_m
    x = here[state.pairs.point % len(here), 0] - places[:, 0].max()
    half_width = 2 * np.sqrt((push * x**2).sum() / push.sum())  # of a half ellipse
    approach = force / (np.pi * plane) * (2 * np.log(4 * RADIUS_MM * 1e-3 / wide) - 1)
    return np.array([half_width / wide, found.displacement_m[-1] / approach]) - 1


def test_half_width_and_approach_converge_to_the_closed_form():
    """Johnson, Contact Mechanics, Eqs. 4.43 and 5.57: cylinder between flats, its middle plane the stiff top."""
    coarse, middle, fine = (over_hertz(side) for side in (8e-3, 4e-3, 2e-3))
    assert fine == pytest.approx([0, 0], abs=0.01)
    assert fine[1] == pytest.approx(0, abs=0.0025)
    assert 2 * fine[0] < middle[0] < coarse[0] / 1.5  # towards first order and better; 8 um is 2/5 of the half width
    assert abs(middle[1] - fine[1]) < abs(coarse[1] - middle[1]) / 2
