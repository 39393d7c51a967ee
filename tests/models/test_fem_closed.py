"""Cross-sections that textbooks know, with open floors, drawn by few or many corners."""

from dataclasses import replace

import numpy as np
import pytest
from cell_scenes import MM, close, prism
from scipy.special import ellipk

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import fem2d
from sensorgen.scene.scene import Body, Scene, box

VACUUM = {"air": 1.0}


def _closed_below(cell):
    """Triangles of a scene whose floor is a mirror: where no electrode lies on the floor, by intent here."""
    from sensorgen.solvers.electrostatics import triangles as _fem_triangles

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_fem_triangles, "_refuse_open", lambda *_: None)
        return _fem_triangles.triangles(cell)


def _open_floor(scene, permittivity, width):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sensorgen.models.fem2d.triangles", _closed_below)
        return fem2d.capacitance(scene, permittivity, width)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75])
def test_interdigital_strips_on_a_half_space(share):
    """Fingers that fill a share of their plane: C = eps0 K(k)/K(k') from one finger to the plane half way to the next,
    k = sin(pi share / 2) (Igreja and Dias 2004), so half of it from finger to finger.

    Between two fingers' middles the upper half space; its lid, 4 pitches up, carries e^-25 of the field.
    """
    edge = 2.0 * share / 2
    low = Body("low", "etpu", (box(0, edge, 0, 1, 0, 0.1),), "bottom")
    high = Body("high", "etpu", (box(2 - edge, 2, 0, 1, 0, 0.1),), "top")
    gap = Body("wall", "wall", (box(edge, 2 - edge, 0, 1, 0, 0.1),))
    found = _open_floor(Scene((low, gap, high), (2.0, 1.0, 8.1)), {"air": 1.0, "wall": 1e-10}, 1e-6)
    k = np.sin(np.pi * share / 2)
    assert found.middle() == close(EPS0_F_PER_M * ellipk(k**2) / ellipk(1 - k**2) / 2 * MM, 2e-6)


def eccentric_half(corners: int, apart: float) -> Scene:
    """The upper half of a line of radii 1 and 2 whose axes are apart, on a mirror through both."""
    inner, outer = ([(r * np.cos(a), r * np.sin(a)) for a in np.linspace(np.pi, 0, corners + 1)] for r in (1, 2))
    low = prism(*((x + apart + 2.2, z if 0 < k < corners else 0.0) for k, (x, z) in enumerate(inner)))
    arc = [(x + 2.2, z if 0 < k < corners else 0.0) for k, (x, z) in enumerate(outer)]
    high = prism((0, 0), *arc, (4.4, 0), (4.4, 2.2), (0, 2.2))
    bodies = Body("low", "etpu", (_neat(low),), "bottom"), Body("high", "etpu", (_neat(high),), "top")
    return Scene(bodies, (4.4, 1.0, 2.2))


@pytest.mark.parametrize("apart", [0.0, 0.3, 0.7])
def test_eccentric_cylinders_are_met_with_the_square_of_their_corners(apart):
    """C = 2 pi eps0 / acosh((a^2 + b^2 - e^2) / (2 a b)), a = 1, b = 2; half of it above the mirror."""
    exact = np.pi * EPS0_F_PER_M / np.arccosh((5 - apart**2) / 4) * MM
    errors = []
    for corners in (8, 16):
        found = _open_floor(eccentric_half(corners, apart), VACUUM, 1e-5)
        assert found.width() < 1e-5
        errors.append(found.middle() / exact - 1)
    assert abs(errors[1]) < 4e-3
    assert errors[0] / errors[1] > 3.9


def _neat(p):
    return replace(p, outline=tuple((round(u, 12), round(v, 12)) for u, v in p.outline))
