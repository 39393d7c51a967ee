"""The engine of inference against SciPy, closed forms of normal distributions, and itself in other coordinates."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import multivariate_normal

from sensorgen.prediction import inference
from sensorgen.prediction.inference import LeastSquares, LocalFit, Normal, Parameter

TIMES = np.linspace(0.1, 3.0, 20)


class Decay(LeastSquares):
    """Exponentials of n samples, each with a rate and an amplitude: a problem that is not linear."""

    bound, settled = 2.0, 1e-9

    def __init__(self, data):
        self.data = data

    def fit(self, at, rows):
        curve = at[:, :1] * np.exp(-at[:, 1:] * TIMES)
        slope = np.stack([np.exp(-at[:, 1:] * TIMES), -TIMES * curve], 1)
        return LocalFit.of(at, (self.data[rows] - curve) / 0.01, slope / 0.01)


def normal(seed, p=4):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(p, p))
    return Normal(rng.normal(size=p), root @ root.T + 0.1 * np.eye(p))


@pytest.mark.parametrize("amplitude", [1.2, 3.0])  # the other one lies beyond the bound
def test_descent_is_the_bounded_least_squares_of_scipy(amplitude):
    rng = np.random.default_rng(1)
    truth = np.column_stack([np.full(5, amplitude), np.linspace(0.3, 1.5, 5)])
    data = truth[:, :1] * np.exp(-truth[:, 1:] * TIMES) + rng.normal(0, 0.01, (5, len(TIMES)))
    best = inference.descend(Decay(data), np.full((5, 2), 0.5))
    for k, one in enumerate(data):
        peer = least_squares(
            lambda p, one=one: (one - p[0] * np.exp(-p[1] * TIMES)) / 0.01, (0.5, 0.5), bounds=(-2.0, 2.0),
            xtol=1e-14, ftol=1e-14, gtol=1e-12,
        )  # fmt: skip
        assert best.chi2[k] == pytest.approx(2 * peer.cost, rel=1e-6)
        assert best.at[k] == pytest.approx(peer.x, abs=1e-6)


def test_a_step_too_far_is_damped():
    """From where the undamped step makes the sum of squares ten times larger."""
    problem, start, rows = Decay(1.9 * np.exp(-0.3 * TIMES)[None]), np.array([[0.5, 0.5]]), np.zeros(1, int)
    first = problem.fit(start, rows)
    assert problem.fit(start + problem.step(first, np.zeros(1)), rows).chi2[0] > 10 * first.chi2[0]
    assert inference.descend(problem, start).at[0] == pytest.approx([1.9, 0.3], abs=1e-6)


def test_no_step_along_a_bound_is_longer_than_the_reach():
    problem = Decay(np.zeros((1, len(TIMES))))
    problem.bound, problem.reach = 1.0, 0.5
    far = LocalFit(np.array([[0.0, 0.9]]), np.zeros(1), np.eye(2)[None], np.array([[40.0, 50.0]]))
    step = problem.step(far, np.zeros(1))
    assert step[0] == pytest.approx([0.5, 0.1 * 0.5 / 40], rel=0.1)


class Stubborn(LeastSquares):
    """A parabola whose first three trials fail, as beyond a kink: damped steps are short, and not the last."""

    settled = 1e-2

    def __init__(self):
        self.trials = 0

    def fit(self, at, rows):
        self.trials += 1
        fit = LocalFit.of(at, 1.0 - at, np.ones((len(at), 1, 1)))
        return LocalFit(fit.at, fit.chi2 + (100.0 if 1 < self.trials < 6 else 0.0), fit.information, fit.gradient)


def test_a_step_that_damping_makes_short_is_not_the_last():
    assert inference.descend(Stubborn(), np.zeros((1, 1))).at[0, 0] == pytest.approx(1.0, abs=1e-2)


def test_evidence_of_a_linear_model_is_the_density_of_its_data():
    rng = np.random.default_rng(2)
    slope, prior, noise = rng.normal(size=(6, 3)), normal(3, 3), np.diag(rng.uniform(0.5, 2.0, 6))
    data = rng.normal(size=6)
    root = inference.whitening(noise)
    at = rng.normal(size=(1, 3))
    fit = LocalFit.of(at, (root @ (data - slope @ at[0]))[None], (root @ slope).T[None]).with_prior(
        prior.at, prior.information
    )
    known = np.linalg.slogdet(prior.covariance)[1] + np.linalg.slogdet(2 * np.pi * noise)[1]
    expected = multivariate_normal(slope @ prior.at, noise + slope @ prior.covariance @ slope.T).logpdf(data)
    assert fit.log_evidence()[0] - known / 2 == pytest.approx(expected, rel=1e-10)
    gain = prior.covariance @ slope.T @ np.linalg.inv(noise + slope @ prior.covariance @ slope.T)  # Kalman's
    assert at[0] + fit.step()[0] == pytest.approx(prior.at + gain @ (data - slope @ prior.at), rel=1e-9)


def test_readings_beyond_a_prior_are_what_was_read():
    """Of a parameter and of combinations: the information and the estimate of the readings alone."""
    prior, rng = normal(5), np.random.default_rng(5)
    slope, data = rng.normal(size=(9, 4)), rng.normal(size=9)
    covariance = np.linalg.inv(prior.information + slope.T @ slope)
    after = Normal(covariance @ (prior.information @ prior.at + slope.T @ data), covariance)
    information, pull = after.beyond(prior)
    assert information == pytest.approx(slope.T @ slope)
    assert pull == pytest.approx(slope.T @ data)
    weights = rng.normal(size=(2, 4))
    drawn = rng.multivariate_normal(after.at, after.covariance, 200_000) @ weights.T
    assert after.of(weights).at == pytest.approx(drawn.mean(0), abs=0.02)
    assert after.of(weights).covariance == pytest.approx(np.cov(drawn.T), abs=0.05)


def test_a_part_that_is_known_exactly_conditions_the_others():
    whole, which, others = normal(6), [1, 3], [0, 2]
    exact = whole.given(which, Normal(np.array([0.3, -0.2]), 1e-14 * np.eye(2)))
    c = whole.covariance
    by = c[np.ix_(others, which)] @ np.linalg.inv(c[np.ix_(which, which)])
    assert exact.at[others] == pytest.approx(whole.at[others] + by @ ([0.3, -0.2] - whole.at[which]))
    schur = c[np.ix_(others, others)] - by @ c[np.ix_(which, others)]
    assert exact.covariance[np.ix_(others, others)] == pytest.approx(schur)
    same = whole.given(which, whole.part(which))
    assert (same.at, same.covariance) == (pytest.approx(whole.at), pytest.approx(whole.covariance))


def test_cramer_rao_is_the_inverse_of_the_fisher_matrix():
    rng = np.random.default_rng(7)
    a, b = rng.normal(size=(2, 3, 5)) + 1j * rng.normal(size=(2, 3, 5))
    first, second, correlation = inference.cramer_rao(a, b)
    for k in range(3):
        rows = np.stack([inference.parts(a[k]), inference.parts(b[k])])
        inverse = np.linalg.inv(rows @ rows.T)
        assert [first[k], second[k]] == pytest.approx(np.sqrt(np.diag(inverse)))
        assert correlation[k] == pytest.approx(inverse[0, 1] / np.sqrt(inverse[0, 0] * inverse[1, 1]))
    alone = inference.cramer_rao(a, 0 * b)
    assert alone[0] == pytest.approx(1 / np.linalg.norm(a, axis=1))
    assert np.isnan(alone[1:]).all()
    assert np.isnan(inference.cramer_rao(a, 2.5 * a)[:2]).all()


def test_parameters_by_their_priors():
    ln, straight = Parameter("c", np.log(3.0), 0.5), Parameter("x", 2.0, 0.1, linear=True)
    assert ln.at(np.array([0.0, 2.0])) == pytest.approx([3.0, 3.0 * np.e])
    assert straight.at(np.array([-1.0])) == pytest.approx([1.9])
    assert 0 <= ln.at(np.array(-np.inf)) < 1e-30


def test_slopes_are_those_of_the_function():
    at = np.array([0.4, -0.3])
    assert inference.slopes(lambda x: np.stack([np.sin(x[:, 0]), x[:, 0] * x[:, 1] ** 2], 1), at) == pytest.approx(
        np.array([[np.cos(0.4), 0.0], [0.09, 2 * 0.4 * -0.3]]), abs=1e-6
    )
