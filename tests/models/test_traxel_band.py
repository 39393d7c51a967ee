"""Sparse factors and multigrid against dense solves."""

import numpy as np
import pytest
import scipy.sparse.linalg
from scipy.sparse import csr_array, diags_array

from sensorgen.core.errors import OutOfRange
from sensorgen.solvers import network as _traxel_band


def network(n, reach, seed=1):
    """Random resistors between nodes up to some apart, numbered at random, each with a little one to earth."""
    rng = np.random.default_rng(seed)
    a = np.concatenate([rng.integers(0, n - reach, 4 * n), np.arange(n - 1)])
    b = np.concatenate([a[: 4 * n] + rng.integers(1, reach + 1, 4 * n), np.arange(1, n)])
    matrix = np.zeros((n, n))
    np.add.at(matrix, (a, b), -rng.uniform(0.1, 1.0, len(a)))
    matrix += matrix.T
    matrix[np.diag_indices(n)] = 1e-3 - matrix.sum(axis=1)
    order = rng.permutation(n)
    return matrix[order][:, order], rng.normal(size=(2, n))


@pytest.mark.parametrize(("n", "reach"), [(3, 1), (600, 40)])
def test_a_product_is_that_of_a_dense_solve(n, reach):
    matrix, (one, other) = network(n, reach)
    found = _traxel_band.product(csr_array(matrix), one, other)
    assert found == pytest.approx(one @ np.linalg.solve(matrix, other), rel=1e-10)


@pytest.mark.parametrize("most", [_traxel_band._ITERATIONS, 1])
def test_a_wide_band_has_the_same_product(most, monkeypatch):
    """By multigrid, and by a sparse factor where that takes too many iterations."""
    matrix, (one, other) = network(600, 9)
    monkeypatch.setattr(_traxel_band, "_MOST", 4)
    monkeypatch.setattr(_traxel_band, "_COARSEST", 20)
    monkeypatch.setattr(_traxel_band, "_ITERATIONS", most)
    factors, factor = [], scipy.sparse.linalg.splu
    monkeypatch.setattr(scipy.sparse.linalg, "splu", lambda m, **how: factors.append(m.shape[0]) or factor(m, **how))
    found = _traxel_band.product(csr_array(matrix), one, other)
    assert found == pytest.approx(one @ np.linalg.solve(matrix, other), rel=1e-8)
    assert (600 in factors) == (most == 1)


def test_multigrid_has_equal_bits_each_time_and_leaves_random_numbers_alone(monkeypatch):
    matrix, (one, other) = network(600, 9)
    monkeypatch.setattr(_traxel_band, "_MOST", 4)
    monkeypatch.setattr(_traxel_band, "_COARSEST", 20)
    before = np.random.get_state()[1:3]
    found = {_traxel_band.product(csr_array(matrix), one, other) for _ in range(3)}
    assert len(found) == 1
    assert all(np.array_equal(a, b) for a, b in zip(np.random.get_state()[1:3], before, strict=True))


def test_a_chain_of_ten_thousand_is_a_divider():
    """Unit resistors in series, both ends held: a current of 1 in at node k makes k (n - k) / n volts there."""
    n, k = 10_000, 3000
    matrix = diags_array([-np.ones(n - 2), np.full(n - 1, 2.0), -np.ones(n - 2)], offsets=[-1, 0, 1])
    at = np.zeros(n - 1)
    at[k - 1] = 1.0
    assert _traxel_band.product(csr_array(matrix), at, at) == pytest.approx(k * (n - k) / n, rel=1e-9)


@pytest.mark.parametrize("most", [_traxel_band._MOST, 0], ids=["narrow", "wide"])
def test_what_hangs_together_by_nothing_is_refused(most, monkeypatch):
    monkeypatch.setattr(_traxel_band, "_MOST", most)
    with pytest.raises(OutOfRange, match="hardly connected"):
        _traxel_band.product(csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]])), np.ones(2), np.ones(2))
