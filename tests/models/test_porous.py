"""Bounds of a porous dielectric against closed forms, limits and a field solve of its lines."""

import pytest

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.shapes import porous as shape
from sensorgen.models import porous
from sensorgen.scene.scene import Fill

SHARES = (0.05, 0.3, 0.5, 0.8, 1.0)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("solid", [1.0, 2.0, 4.68, 80.0])
def test_bounds_of_isotropic_patterns_lie_within_those_of_all(share, solid):
    every, isotropic = (porous.permittivity(solid, share, pattern) for pattern in ("rectilinear", "gyroid"))
    assert every.lower <= isotropic.lower * (1 + 1e-12) <= isotropic.upper * (1 + 1e-9) <= every.upper * (1 + 2e-9)
    assert porous.permittivity(solid, share, "grid").lower == pytest.approx(every.upper, rel=1e-12)


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_isotropic_bounds_are_those_of_coated_spheres(share):
    """Maxwell Garnett of spheres of solid in air, and of air in solid: exact for coated spheres."""
    eps = 4.68
    one = (eps - 1) / (eps + 2)
    other = (1 - eps) / (1 + 2 * eps)
    found = porous.permittivity(eps, share, "gyroid")
    assert found.lower == pytest.approx((1 + 2 * share * one) / (1 - share * one), rel=1e-12)
    air = 1 - share
    assert found.upper == pytest.approx(eps * (1 + 2 * air * other) / (1 - air * other), rel=1e-12)


@pytest.mark.parametrize("share", SHARES)
def test_stiffness_of_isotropic_voids_in_closed_form(share):
    """At a Poisson's ratio of 0.2 the bound of Hashin and Shtrikman is E share / (2 - share)."""
    found = porous.modulus(6e6, 0.2, share, "gyroid")
    assert found.lower == 0
    assert found.upper == pytest.approx(6e6 * share / (2 - share), rel=1e-12)
    assert porous.foam_modulus_pa(6e6, share) <= porous.modulus(6e6, 0.49, share, "rectilinear").upper * (1 + 1e-12)


def test_solid_is_solid():
    assert porous.permittivity(4.68, 1.0, "rectilinear").lower == pytest.approx(4.68)
    assert porous.modulus(6e6, 0.5, 1.0, "honeycomb").lower == 6e6


def test_capacitance_of_crossed_lines_lies_within_the_bounds():
    fem3d = pytest.importorskip("sensorgen.models.fem3d")
    p = shape.Params(length_mm=40.5, width_mm=40.5, dielectric_mm=0.4, layer_mm=0.2, space_mm=0.5)
    found = fem3d.capacitance(shape.scene(p, Fill()), {"x60": 4.68, "air": 1.0}, 0.02)
    plate = EPS0_F_PER_M * 40.5**2 * M_PER_MM / 0.4
    bounds = porous.permittivity(4.68, 0.5, "rectilinear")  # of half solid, but for the last line
    assert bounds.lower < found.lower / plate < found.upper / plate < bounds.upper
    assert found.width() < 0.02


@pytest.mark.parametrize(
    "ask",
    [
        lambda: porous.permittivity(0.5, 0.5, "grid"),
        lambda: porous.permittivity(float("nan"), 0.5, "grid"),
        lambda: porous.permittivity(2.0, 0.0, "grid"),
        lambda: porous.permittivity(2.0, 1.1, "grid"),
        lambda: porous.modulus(0.0, 0.3, 0.5, "grid"),
        lambda: porous.modulus(1e6, 0.6, 0.5, "grid"),
        lambda: shape.Params(dielectric_mm=0.55),
    ],
)
def test_what_has_no_bounds_is_refused(ask):
    with pytest.raises(OutOfRange):
        ask()
