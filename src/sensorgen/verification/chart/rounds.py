"""A soft cylinder on a stiff flat, against Hertz's line contact: how wide it touches.

Johnson, Contact Mechanics (1985), Eq. 4.43; sides of a polygon about the circle grow from where it touches.
"""

from functools import partial
from math import pi

import numpy as np

from sensorgen.core.units import M_PER_MM
from sensorgen.models import press2d, pressure
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.scene.scene import Body, Prism, Scene, box
from sensorgen.solvers.contact.cell import Cell
from sensorgen.verification.chart.measured import DIGITS, Ladder, Point, climbed, relative
from sensorgen.verification.chart.presses import has_mesher

ASKED = "how wide a round body touches"
_RADIUS_MM, _HALF_MM, _DEEP_MM, _FLAT_MM = 1.0, 0.02, 10.0, 0.1
_SOLIDS = {"soft": Elastic(6e6, 0.3), "stiff": Elastic(6e11, 0.3)}
_PLANE_PA = 6e6 / (1 - 0.3**2)
_SIDES_MM = (8e-3, 4e-3, 2e-3)  # where it touches

STANDARD = {"cylinder on a flat": 2 * _HALF_MM * M_PER_MM}  # length of the contact [m]


def points(name: str, budget_s: float) -> list[Point]:
    """Measure every model of a contact.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A finer mesh is not tried where that would take longer, estimated as ten times the last one [s].
    """
    levels = [(f"sides of {1e3 * side:g} µm, ", partial(_solved, side)) for side in _SIDES_MM if has_mesher()]
    ladders: list[Ladder] = [("pressure: hertz", [("", _formula)]), ("press2d", levels)]
    return list(climbed(name, ladders, relative(STANDARD[name], DIGITS, "off by {:+.3g}"), budget_s))


def why_not_applicable(_: str) -> dict[str, str]:
    """Why models of compression do not apply to it."""
    no_film = "it gives the displacement of the top, and not where bodies touch"
    return {"press2d": "the mesher is not installed (extra fem)", "press3d": "a prism is no box",
            "springs": no_film, "compression": no_film}  # fmt: skip


def _load_n_per_m() -> float:
    """That makes a contact of the standard's length, by Hertz."""
    return pi * _PLANE_PA * (_HALF_MM * M_PER_MM) ** 2 / (4 * _RADIUS_MM * M_PER_MM)


def _formula() -> float:
    length, _ = pressure.hertz(_RADIUS_MM * M_PER_MM, _PLANE_PA).length_m(np.asarray(_load_n_per_m()), 1.0)
    return float(length)


def _solved(side_mm: float) -> float:
    """Length of a half ellipse of pressure that has the second moment of what the faces push."""
    stress = [0.0, _load_n_per_m() / (2 * _RADIUS_MM * M_PER_MM)]
    fineness = Fineness(side_mm, 0.1, 0.1, 0.3)
    _, run = press2d._solved(
        _cylinder(side_mm), _SOLIDS, stress, BoundaryConditions(top="rigid"), fineness, lambda _: None
    )
    state = run.states[-1]
    places = run.problem.places(state.u_m)
    here = run.problem.faces.rays(places).here_m
    push = np.maximum(-run.problem.gaps(state.pairs, state.u_m), 0) * state.pairs.stiffness_pa
    x = here[state.pairs.point % len(here), 0] - places[:, 0].max()
    return float(4 * np.sqrt((push * x**2).sum() / push.sum()))


def _cylinder(side_mm: float) -> Cell:
    """The lower half of a polygon about a circle, on a flat."""
    sizes = np.minimum(side_mm * np.exp(0.25 * np.maximum(np.arange(400) - 2 * _HALF_MM / side_mm, 0)), 0.1)
    angle = np.cumsum(sizes)
    angle = np.append(angle[angle < pi / 2 - 0.05], pi / 2)
    angle = np.concatenate([-angle[::-1], [0.0], angle])
    middle, top = 1.5 * _RADIUS_MM, _FLAT_MM + _RADIUS_MM
    outline = np.column_stack([middle + np.sin(angle), top - np.cos(angle)]).round(9)
    bodies = (
        Body("flat", "stiff", (box(0, 2 * middle, 0, _DEEP_MM, 0, _FLAT_MM),)),
        Body("cylinder", "soft", (Prism("y", tuple(map(tuple, outline.tolist())), 0.0, _DEEP_MM),)),
    )
    return press2d.cell(Scene(bodies, (2 * middle, _DEEP_MM, top)), 2 * middle)
