"""Calibration: posterior of a specimen's parameters, and of what changes from press to press."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.prediction.calibration.specimen import STEP, Presses, SpecimenModel, parts

ROUNDS = 3  # Gauss-Newton and variance components in turn
_STEPS = 12
_SETTLED = 1e-3  # of a standard deviation
_FARTHEST = 8.0  # standard deviations: beyond, readings that no specimen gives lead to numbers that no line takes
NOISE = 1e-3  # of the parts of a ratio, where no press tells
_FEWEST_COURSES = 10  # presses from which on their usual course is known
_FLOOR = 1e-5  # of ln Z: no bench is right to more
_USUAL = (0.25, 0.25), (0.5, 0.6)  # mean and standard deviation of how presses come about: unloading, decades
_SHAPE = 0.1  # of ln of the rise: what a tip changes from force to force, and what a few presses do not show
_LN_SPREAD = 1.5  # of ln of each variance component's standard deviation, before calibration
_LN_LOOSE = 3.0  # the same where presses tell: tighter, a specimen that never wanders gets the interval of one that may


@dataclass(frozen=True, eq=False)
class Meter:
    """Readings of meters, apart from the bench, with nothing on the sensor.

    Attributes
    ----------
    frequency_hz : (k,) array
        Of each reading [Hz].
    observed : callable
        From impedances at the contacts (..., k) [ohm] to what was read (..., k).
    value : (k,) array
        What was read.
    root : (k, k) array
        Inverse of the root of its covariance: turns differences to independent ones of standard deviation 1.
    ln_resistance : (float, float) or None
        Ln of both electrodes' resistance over the predicted one, and its standard deviation [-].
    """

    frequency_hz: Real
    observed: Callable[[Complex], Real]
    value: Real
    root: Real
    ln_resistance: tuple[float, float] | None = None

    def off(self, model: SpecimenModel, at: Real) -> Real:
        """Readings less what the parameters make of them, in standard deviations, (..., k + 1)."""
        expected = self.observed(np.exp(model.rest(at, self.frequency_hz)))
        ln_r, sd = self.ln_resistance or (0.0, np.inf)
        resistance = (ln_r - model.spread.resistance * at[..., model.names.index("resistance")]) / sd
        return np.concatenate([(self.value - expected) @ self.root.T, resistance[..., None]], -1)

    def slopes(self, model: SpecimenModel, at: Real) -> Real:
        """Derivatives of what is made of them by the parameters, (k + 1, p)."""
        step = np.eye(len(at)) * STEP
        more, less = np.split(self.off(model, np.concatenate([at + step, at - step])), 2)
        return (less - more).T / (2 * STEP)


@dataclass(frozen=True, eq=False)
class Data:
    """Data of a calibration.

    Attributes
    ----------
    presses : Presses
        n known presses.
    ratio : (n, m) array
        Ln of pressed over rest, complex.
    noise : (n, m) array
        Standard deviation of its real and imaginary part [-].
    rest : (m,) array
        Ln of Z/ohm at rest, complex.
    rest_noise : (m,) array
        Standard deviation of its real and imaginary part [-].
    single : (m,) array or None
        Standard deviation of the parts of a ratio of single readings, where ``ratio`` has means [-].
    meter : Meter or None
        Readings apart from the bench.
    """

    presses: Presses
    ratio: Complex
    noise: Real
    rest: Complex
    rest_noise: Real
    single: Real | None = None
    meter: Meter | None = None

    def rows(self, which: NDArray[np.intp] | Mask) -> "Data":
        """Some of the presses."""
        return replace(self, presses=self.presses.rows(which), ratio=self.ratio[which], noise=self.noise[which])


@dataclass(frozen=True, eq=False)
class Posterior:
    """Normal distribution of the parameters, and what changes from press to press.

    Attributes
    ----------
    at : (p,) array
        Mean, in standard deviations of the prior.
    covariance : (p, p) array
        In the same unit.
    scatter, wander_c, wander_r : float
        Standard deviations of ln of the rise from press to press, and of ln C and ln R since the rest reading [-].
    unloading, decades : (float, float)
        Mean and standard deviation of what is not known of a press, see :class:`Presses`.
    noise : (m,) array
        Standard deviation of the real and imaginary part of a ratio of single readings [-].
    presses : int
        Known ones that it rests on.
    """

    at: Real
    covariance: Real
    scatter: float
    wander_c: float
    wander_r: float
    unloading: tuple[float, float]
    decades: tuple[float, float]
    noise: Real
    presses: int

    @property
    def components(self) -> Real:
        """Standard deviations, in the order of :meth:`SpecimenModel.scatters`."""
        return np.array([self.scatter, self.wander_c, self.wander_r])


def prior(model: SpecimenModel, noise: Real) -> Posterior:
    """Knowledge of a specimen that was never calibrated.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    noise : (m,) array
        Standard deviation of a ratio's real and imaginary part [-].
    """
    p, spread = len(model.names), model.spread
    mean = float(np.exp(_LN_SPREAD**2 / 2))  # of a logarithmic normal, over its median
    return Posterior(
        np.zeros(p), np.eye(p), spread.scatter * mean, spread.wander * mean, spread.wander * mean, *_USUAL, noise, 0
    )


def calibrated(model: SpecimenModel, data: Data, start: Posterior | None = None) -> Posterior:
    """The posterior after known presses.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    data : Data
        Known presses, none or more, and a rest reading.
    start : Posterior, optional
        Earlier knowledge, as from an earlier calibration; the prior if not given.
    """
    single = data.single
    if single is None:
        single = np.median(data.noise, axis=0) if len(data.noise) else np.full(len(data.rest), NOISE)
    known = start or prior(model, single)
    inverse: Real = np.asarray(np.linalg.inv(known.covariance))
    at, components = known.at.copy(), known.components
    presses, spread = data.presses, model.spread
    usual = known.components if start else np.array([spread.scatter, spread.wander, spread.wander])
    for _ in range(ROUNDS if len(presses.force_n) else 1):
        at, information = _descended(model, data, at, components, (known.at, inverse))
        if len(presses.force_n):
            components = _components(model, data, at, (known.at, inverse), usual)
    at, information = _descended(model, data, at, components, (known.at, inverse))
    return Posterior(
        at, np.asarray(np.linalg.inv(information)), float(components[0]), float(components[1]), float(components[2]),
        _mean(presses.unloading, known.unloading), _mean(presses.decades, known.decades), known.noise,
        known.presses + len(presses.force_n),
    )  # fmt: skip


def by_rest(model: SpecimenModel, rest: Complex, rest_noise: Real | float, noise: Real | float) -> Posterior:
    """The posterior of a specimen of which nothing is known but a reading at rest.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    rest : (m,) array
        Ln of Z/ohm at rest, complex.
    rest_noise, noise : (m,) array or float
        Standard deviations of its parts, and of those of a ratio [-].
    """
    m, none = len(rest), np.empty(0)
    nothing = np.empty((0, m))
    data = Data(
        Presses(none, none, none, none), nothing.astype(complex), nothing, rest, np.broadcast_to(rest_noise, (m,))
    )
    return calibrated(model, data, prior(model, np.array(np.broadcast_to(noise, (m,)))))


def _mean(values: Real, otherwise: tuple[float, float]) -> tuple[float, float]:
    seen = values[np.isfinite(values)]
    return (float(seen.mean()), float(seen.std())) if len(seen) >= _FEWEST_COURSES else otherwise


def rest_gain(model: SpecimenModel) -> Real:
    """Covariance of the parts of a reading at rest by the gain alone (2 m, 2 m)."""
    m = len(model.frequency_hz)
    return np.asarray(model.spread.gain**2 / 2 * np.kron(np.eye(2), np.eye(m) + np.ones((m, m))))


def _rest_covariance(model: SpecimenModel, data: Data) -> Real:
    return np.diag(np.tile(np.maximum(data.rest_noise, _FLOOR), 2) ** 2) + rest_gain(model)


@dataclass(frozen=True, eq=False)
class _Resting:
    """All that was read with nothing on the sensor, in standard deviations."""

    model: SpecimenModel
    data: Data

    @cached_property
    def _root(self) -> Real:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(_rest_covariance(self.model, self.data))))

    def off(self, at: Real) -> Real:
        """Readings less what the parameters make of them, (q,)."""
        bench = self._root @ parts(self.data.rest - self.model.rest(at))
        meter = self.data.meter
        return np.concatenate([bench, meter.off(self.model, at)]) if meter else bench

    def slopes(self, at: Real) -> Real:
        """Derivatives of what the parameters make of them, (q, p)."""
        bench = self._root @ self.model.rest_slopes(at)
        meter = self.data.meter
        return np.concatenate([bench, meter.slopes(self.model, at)]) if meter else bench


def covariances(model: SpecimenModel, at: Real, data: Data, components: Real, vectors: Real | None = None) -> Real:
    """Of the ratios given the parameters, (n, 2 m, 2 m): noise, and what changes from press to press."""
    presses = data.presses
    found = np.zeros((len(presses.force_n), 2 * data.noise.shape[1], 2 * data.noise.shape[1]))
    k = np.arange(found.shape[1])
    found[:, k, k] = np.tile(np.maximum(data.noise, _FLOOR), 2) ** 2
    vectors = model.scatters(at, presses) if vectors is None else vectors
    variance = np.tile(components**2, (len(presses.force_n), 1))
    courses = (("hysteresis", presses.unloading), ("creep", presses.decades))
    for (name, course), (_, sd) in zip(courses, _USUAL, strict=True):
        variance[:, 0] += np.where(np.isnan(course), (memory(model, at, name) * sd) ** 2, 0.0)
    return np.asarray(found + np.einsum("nik,nk,njk->nij", vectors, variance, vectors))


def information(model: SpecimenModel, data: Data, at: Real, weight: Real) -> Real:
    """Information of presses and rest on the parameters (p, p), the prior's left out.

    Parameters
    ----------
    model, data, at
        As of :func:`covariances`.
    weight : (n, 2 m, 2 m) array
        Inverse of those.
    """
    return _information(model.slopes(at, data.presses), weight, _Resting(model, data).slopes(at))


def _information(slopes: Real, weight: Real, resting: Real) -> Real:
    of_presses = np.einsum("nia,nij,njb->ab", slopes, weight, slopes, optimize=True)
    return np.asarray(of_presses + resting.T @ resting)


def memory(model: SpecimenModel, at: Real, name: str) -> float:
    """Change of the rise by hysteresis or creep [-]."""
    return float(getattr(model.spread, name) * np.exp(at[model.names.index(name)] - 0.5))


def _descended(
    model: SpecimenModel, data: Data, at: Real, components: Real, before: tuple[Real, Real]
) -> tuple[Real, Real]:
    """Gauss-Newton with damping: the most probable parameters, and the information on them."""
    middle, inverse = before
    resting = _Resting(model, data)
    weight = np.asarray(np.linalg.inv(covariances(model, at, data, components)))

    def off(x: Real) -> tuple[Real, Real, float]:
        ratio = parts(data.ratio - model.ratio(x, data.presses))
        rest = resting.off(x)
        cost = np.einsum("ni,nij,nj->", ratio, weight, ratio) + rest @ rest
        return ratio, rest, float(cost + (x - middle) @ inverse @ (x - middle))

    ratio, rest, cost = off(at)
    damping, found = 0.0, inverse
    for _ in range(_STEPS):
        slopes, rest_slopes = model.slopes(at, data.presses), resting.slopes(at)
        found = inverse + _information(slopes, weight, rest_slopes)
        gradient = np.einsum("nia,nij,nj->a", slopes, weight, ratio, optimize=True)
        gradient = gradient + rest_slopes.T @ rest - inverse @ (at - middle)
        step = np.linalg.solve(found + damping * np.eye(len(at)), gradient)
        step *= 3.0 / max(3.0, np.abs(step).max())
        further = np.clip(at + step, -_FARTHEST, _FARTHEST)
        tried = off(further)
        if tried[2] <= cost:
            at, (ratio, rest, cost), damping = further, tried, damping / 10
            if np.abs(step).max() < _SETTLED:
                break
        else:
            damping = max(10 * damping, 1.0)
    return at, found


def _components(model: SpecimenModel, data: Data, at: Real, before: tuple[Real, Real], usual: Real) -> Real:
    """Most probable standard deviations from press to press, the parameters integrated out as if they were linear."""
    from scipy.optimize import minimize

    middle, inverse = before
    resting = _Resting(model, data)
    slopes, rest_slopes = model.slopes(at, data.presses), resting.slopes(at)
    left = parts(data.ratio - model.ratio(at, data.presses)) + slopes @ (at - middle)
    rest = resting.off(at) + rest_slopes @ (at - middle)
    fixed = inverse + rest_slopes.T @ rest_slopes
    pull = rest_slopes.T @ rest

    vectors = model.scatters(at, data.presses)

    def cost(ln: Real) -> float:
        if (usual * np.exp(ln)).max() > 1:  # no press explains these readings, and the covariance would be singular
            return np.inf
        covariance = covariances(model, at, data, usual * np.exp(ln), vectors)
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        white, by = np.einsum("nij,nj->ni", root, left), root @ slopes
        information = fixed + np.einsum("nia,nib->ab", by, by)
        gradient = pull + np.einsum("nia,ni->a", by, white)
        logs = -2 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum() + np.linalg.slogdet(information)[1]
        return float(
            logs + (white**2).sum() - gradient @ np.linalg.solve(information, gradient) + ln @ ln / _LN_LOOSE**2
        )

    count = len(usual)
    simplex = np.vstack([np.zeros(count), np.eye(count)])
    found = minimize(
        cost, simplex[0], method="Nelder-Mead", options={"xatol": 0.05, "fatol": 0.02, "initial_simplex": simplex}
    )
    return np.asarray(usual * np.exp(found.x))


def gain(model: SpecimenModel, data: Data, at: Real) -> Complex:
    """Most probable ln of each tone's gain (m,), phase as imaginary part, given the other parameters."""
    m, left = len(data.rest), parts(data.rest - model.rest(at))
    found = rest_gain(model) @ np.linalg.solve(_rest_covariance(model, data), left)
    return np.asarray(found[:m] + 1j * found[m:])


def shared(models: Sequence[SpecimenModel], posteriors: Sequence[Posterior], names: Sequence[str]) -> list[Posterior]:
    """Posteriors of specimens that have some parameters in common, from those of each alone.

    What each says of them, beyond the prior, is added up; its other parameters follow by their correlation.

    Parameters
    ----------
    models : sequence of SpecimenModel
        Of the specimens.
    posteriors : sequence of Posterior
        Of each alone, all from the same prior.
    names : sequence of str
        Parameters in common.
    """
    which = [models[0].names.index(name) for name in names]
    information, pull = np.eye(len(which)), np.zeros(len(which))
    for p in posteriors:
        own = np.linalg.inv(p.covariance[np.ix_(which, which)])
        information, pull = information + own - np.eye(len(which)), pull + own @ p.at[which]
    covariance = np.linalg.inv(information)
    mean = covariance @ pull
    found = []
    for p in posteriors:
        by = p.covariance[:, which] @ np.linalg.inv(p.covariance[np.ix_(which, which)])
        spread = p.covariance + by @ (covariance - p.covariance[np.ix_(which, which)]) @ by.T
        found.append(replace(p, at=p.at + by @ (mean - p.at[which]), covariance=spread))
    return found


def widened(model: SpecimenModel, posterior: Posterior) -> Posterior:
    """A posterior that no longer knows how the film yields under the tip, nor where that is: another tip, or day."""
    kept = [k for k, name in enumerate(model.names) if not name.startswith(("rise", "force", "position"))]
    loose = np.setdiff1d(np.arange(len(model.names)), kept)
    covariance = posterior.covariance.copy()
    covariance[loose] = covariance[:, loose] = 0.0
    usual = min(_SHAPE / model.spread.law_shape, 1.0)  # a print's laws differ by more than those of two tips
    covariance[loose, loose] = [usual**2 if model.names[k].startswith("rise at") else 1.0 for k in loose]
    return replace(posterior, covariance=covariance)


def loosened(model: SpecimenModel, posterior: Posterior) -> Posterior:
    """A posterior whose rise may have changed by what a recheck of a few presses does not show."""
    covariance = posterior.covariance.copy()
    k = model.names.index("rise")
    covariance[k, k] += (_SHAPE / model.spread.law) ** 2
    return replace(posterior, covariance=covariance)
