"""Cross-sections that nobody drew: random patches, between two bounds by adaptive elements of scikit-fem."""

import numpy as np
import pytest
from quilts import Quilt, by_adaptive_elements

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import fem2d

UNKNOWNS = 1500  # where scikit-fem's two bounds are 1e-4 to 2e-2 apart
PER_MM = 1e3 / EPS0_F_PER_M  # of a sensor 1 mm deep


def permittivity(seed: int, decades: float = 1.5) -> dict[str, float]:
    x60, pva = 10 ** np.random.default_rng(seed).uniform(0, decades, 2)
    return {"air": 1.0, "x60": float(x60), "pva": float(pva)}


def overlap(a, b) -> bool:
    return a.lower <= b.upper and b.lower <= a.upper


@pytest.mark.parametrize("seed", [2, 8, 22, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (0, 4))])
def test_two_bounds_of_another_program_hold_both_of_ours(seed):
    """Each of its bounds is a potential between two ends; where no electrode is an island, the mirrors are such."""
    quilt, eps = Quilt.random(seed), permittivity(seed)
    found = fem2d.capacitance(quilt.scene(), eps, 1e-6).times(PER_MM)
    above = by_adaptive_elements(quilt, eps, UNKNOWNS)[-1].real
    below = 1 / by_adaptive_elements(quilt, {m: 1 / e for m, e in eps.items()}, UNKNOWNS, ("left", "right"))[-1].real
    assert found.width() <= 1e-6
    assert below < found.lower < found.upper < above < below * 1.03


@pytest.mark.parametrize("seed", [30, 35, 36])
def test_symmetries(seed):
    """Left for right, upside down, three times the permittivity, and the losses' own solver: all hold one value."""
    quilt, eps = Quilt.random(seed), permittivity(seed, 3.0)
    scene = quilt.scene()
    if fem2d.why_not_applicable(scene):
        assert "touch" in fem2d.why_not_applicable(scene)
        return
    found = fem2d.capacitance(scene, eps, 1e-4)
    real = fem2d.lossy(scene, {m: complex(e) for m, e in eps.items()}, 1e-4)
    assert found.width() <= 1e-4
    assert overlap(found, fem2d.capacitance(quilt.mirrored().scene(), eps, 3e-6))
    assert overlap(found, fem2d.capacitance(quilt.swapped().scene(), eps, 1e-5))
    assert overlap(found, fem2d.capacitance(scene, {m: 3 * e for m, e in eps.items()}, 1e-6).times(1 / 3))
    assert found.lower - real.radius <= real.centre.real <= found.upper + real.radius
