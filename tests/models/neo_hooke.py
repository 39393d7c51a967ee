"""A homogeneous neo-Hookean block in closed form, and how energy, forces and stiffness of elements hang together."""

import numpy as np
import pytest
from scipy.optimize import brentq


def stretches(stress_pa, modulus_pa, nu, period, ways):
    """Across and along the load; free in one way, as in plane strain, or in two, where nothing pulls."""
    mu = modulus_pa / (2 * (1 + nu))
    lam = np.inf if nu == 0.5 else modulus_pa * nu / ((1 + nu) * (1 - 2 * nu))

    def across(b):
        if period == "fixed":
            return 1.0
        if nu == 0.5:
            return b ** (-1 / ways)
        return brentq(lambda a: mu * a - mu / a + lam * (a**ways * b - 1) * a ** (ways - 1) * b, 0.5, 9)

    def excess(b):
        a = across(b)
        p = -(mu * a - mu / a) / (a ** (ways - 1) * b) if nu == 0.5 else lam * (a**ways * b - 1)
        return mu * b - mu / b + p * a**ways + stress_pa

    along = brentq(excess, 0.3, 1)
    return across(along), along


def check_derivatives(elements, u, inner, moved, moved_inner, h=1e-6):
    """Stiffness against differences of the forces, and those against differences of the energy."""
    along = np.concatenate([moved[elements.freedoms], moved_inner], axis=1)
    places = [(u + s * moved, inner.moved(moved_inner, s)) for s in (h, -h)]
    up, down = (elements.residual(*at) for at in places)
    matrix = elements.derivative(u, inner)
    expected = np.einsum("mij,mj->mi", matrix, along)
    assert (up - down) / (2 * h) == pytest.approx(expected, rel=1e-6, abs=1e-6 * min(1, np.abs(expected).max()))
    assert matrix == pytest.approx(matrix.transpose(0, 2, 1), abs=min(1e-12, 1e-9 * np.abs(matrix).max()))
    one, other = (elements.energy_j(*at) for at in places)
    assert (one - other) / (2 * h) == pytest.approx((elements.residual(u, inner) * along).sum(), rel=1e-6, abs=0)
