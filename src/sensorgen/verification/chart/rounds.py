"""A soft cylinder or sphere on a stiff flat, against Hertz's contact: how wide it touches.

Johnson, Contact Mechanics (1985), Eqs. 4.43 and 4.22; sides of a polygon about the circle grow from where it touches.
"""

from functools import partial
from math import pi, tan

import numpy as np

from sensorgen.core.units import M_PER_MM
from sensorgen.models import press2d, press_round, pressure
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Prism, Scene, box
from sensorgen.solvers.contact.cell import ContactCell
from sensorgen.verification.chart.measured import DIGITS, ChartPoint, Ladder, climbed, relative
from sensorgen.verification.chart.presses import has_mesher

ASKED = "how wide a round body touches"
_RADIUS_MM, _HALF_MM, _DEEP_MM, _FLAT_MM = 1.0, 0.02, 10.0, 0.1
_SOLIDS = {"soft": Elastic(6e6, 0.3), "stiff": Elastic(6e11, 0.3)}
_PLANE_PA = 6e6 / (1 - 0.3**2)
_SIDES_MM = (8e-3, 4e-3, 2e-3)  # where it touches

SPHERE = "sphere on a flat"
STANDARD = dict.fromkeys(("cylinder on a flat", SPHERE), 2 * _HALF_MM * M_PER_MM)  # length of the contact [m]


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure every model of a contact.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A finer mesh is not tried where that would take longer, estimated as ten times the last one [s].
    """
    levels = [(f"sides of {1e3 * side:g} µm, ", partial(_solved, side)) for side in _SIDES_MM if has_mesher()]
    turned = [(f"sides of {1e3 * side:g} µm, ", partial(_turned, side)) for side in _SIDES_MM if has_mesher()]
    ladders: list[Ladder] = [("pressure: hertz", [("", _formula)]), ("press2d", levels)]
    ladders = [("press_round", turned)] if name == SPHERE else ladders
    return list(climbed(name, ladders, relative(STANDARD[name], DIGITS, "off by {:+.3g}"), budget_s))


def why_not_applicable(name: str) -> dict[str, str]:
    """Why models of compression do not apply to it."""
    no_film, missing = (
        "it gives the displacement of the top, and not where bodies touch",
        "the mesher is not installed (extra fem)",
    )
    why = {
        "press2d": missing,
        "press_round": missing,
        "press3d": "a round body is no box",
        "springs": no_film,
        "compression": no_film,
    }
    if name == SPHERE:
        return why | {"press2d": "a sphere is no prism", "pressure": "its contacts are as long as the sensor is wide"}
    return why | {"press_round": "a cylinder that lies has no upright axis"}


def _load_n_per_m() -> float:
    """That makes a contact of the standard's length, by Hertz."""
    return pi * _PLANE_PA * (_HALF_MM * M_PER_MM) ** 2 / (4 * _RADIUS_MM * M_PER_MM)


def _formula() -> float:
    length, _ = pressure.hertz(_RADIUS_MM * M_PER_MM, _PLANE_PA).length_m(np.asarray(_load_n_per_m()), 1.0)
    return float(length)


def _solved(side_mm: float) -> float:
    """Length of a half ellipse of pressure that has the second moment of what the faces push."""
    stress_pa = _load_n_per_m() / (2 * _RADIUS_MM * M_PER_MM)
    moment = _moment_m2(_cylinder(side_mm), stress_pa, Fineness(side_mm, 0.1, 0.1, 0.3))
    return float(4 * np.sqrt(moment))


def _turned(side_mm: float) -> float:
    """Diameter of a half ellipsoid of pressure, likewise."""
    width, high, cut = 3 * _RADIUS_MM, _RADIUS_MM / 2, _RADIUS_MM * 0.75**0.5
    corners = ((0.0, _FLAT_MM), (cut, _FLAT_MM + high), (0.0, _FLAT_MM + high))
    dome = Revolved(width / 2, width / 2, corners, (tan(pi / 12), 0.0, 0.0))
    top = _FLAT_MM + high + 2 * _RADIUS_MM
    bodies = (
        Body("flat", "stiff", (box(0, width, 0, width, 0, _FLAT_MM),), "bottom"),
        Body("sphere", "soft", (dome, box(0, width, 0, width, _FLAT_MM + high, top)), "top"),
    )
    fineness = Fineness(side_mm, 0.05, 0.3, 0.25)
    stress_pa = 4 / 3 * _PLANE_PA * (_HALF_MM * M_PER_MM) ** 3 / (_RADIUS_MM * M_PER_MM * (width * M_PER_MM) ** 2)
    moment = _moment_m2(press_round.cell(Scene(bodies, (width, width, top)), fineness), stress_pa, fineness)
    return float(2 * np.sqrt(2.5 * moment))


def _moment_m2(cell: ContactCell, stress_pa: float, fineness: Fineness) -> float:
    """Mean square of the distance from the middle, weighted with what the faces push [m2]."""
    boundary = BoundaryConditions(top="rigid")
    _, run = press2d._solved(cell, _SOLIDS, [0.0, stress_pa], boundary, fineness, lambda _: None)
    state = run.states[-1]
    places = run.problem.places(state.u_m)
    here = run.problem.faces.rays(places).here_m
    push = np.maximum(-run.problem.gaps(state.pairs, state.u_m), 0) * state.pairs.stiffness_pa
    x = here[state.pairs.point % len(here), 0] - (0.0 if cell.turned else places[:, 0].max())
    return float((push * x**2).sum() / push.sum())


def _cylinder(side_mm: float) -> ContactCell:
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
