"""Calibration: posterior of a specimen's parameters, and of what changes from press to press."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.prediction import inference
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel, no_presses
from sensorgen.prediction.inference import LocalFit, Normal, parts, whitening
from sensorgen.prediction.inverse.forward import pairs

ROUNDS = 3  # Gauss-Newton and variance components in turn
NOISE = 1e-3  # of the parts of a ratio, where no press tells
_FEWEST_COURSES = 10  # presses from which on their usual course is known
_FLOOR = 1e-5  # of ln Z: no bench is right to more
_USUAL = (0.25, 0.25), (0.5, 0.6)  # mean and standard deviation of how presses come about: unloading, decades
_SHAPE = 0.1  # of ln of the rise: what a tip changes from force to force, and what a few presses do not show
_LN_SPREAD = 1.5  # of ln of each variance component's standard deviation, before calibration
_LN_LOOSE = 3.0  # the same where presses tell: tighter, a specimen that never wanders gets the interval of one that may


@dataclass(frozen=True, eq=False)
class MeterReadings:
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
        resistance = (ln_r - np.log(model.value("resistance", at))) / sd
        return np.concatenate([(self.value - expected) @ self.root.T, resistance[..., None]], -1)


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
    meter : MeterReadings or None
        Readings apart from the bench.
    """

    presses: Presses
    ratio: Complex
    noise: Real
    rest: Complex
    rest_noise: Real
    single: Real | None = None
    meter: MeterReadings | None = None

    def rows(self, which: inference.Index | Mask) -> "Data":
        """Some of the presses."""
        return replace(self, presses=self.presses.rows(which), ratio=self.ratio[which], noise=self.noise[which])

    @classmethod
    def unread(
        cls, presses: Presses, noise: Real, rest: Complex | None = None, rest_noise: Real | None = None
    ) -> "Data":
        """Data of n presses that were not read, at a noise of the parts (m,)."""
        nothing = np.zeros((len(presses.force_n), len(noise)))
        rest = np.zeros(len(noise), complex) if rest is None else rest
        return cls(presses, nothing.astype(complex), nothing + noise, rest, noise if rest_noise is None else rest_noise)


@dataclass(frozen=True, eq=False)
class Posterior(Normal):
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
    before, spread = inference.standard(len(model.names)), model.spread
    mean = float(np.exp(_LN_SPREAD**2 / 2))  # of a logarithmic normal, over its median
    scatter, wander = spread.scatter * mean, spread.wander * mean
    return Posterior(before.at, before.covariance, scatter, wander, wander, *_USUAL, noise, 0)


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
    at, components = known.at, known.components
    presses = data.presses
    usual = known.components if start else usual_components(model)
    for _ in range(ROUNDS if len(presses.force_n) else 1):
        at = _descended(model, data, at, components, known).at[0]
        if len(presses.force_n):
            components = _components(model, data, at, known, usual)
    fit = _descended(model, data, at, components, known)
    scatter, wander_c, wander_r = components.tolist()
    return Posterior(
        fit.at[0], np.asarray(np.linalg.inv(fit.information[0])), scatter, wander_c, wander_r,
        _mean(presses.unloading, known.unloading), _mean(presses.decades, known.decades), known.noise,
        known.presses + len(presses.force_n),
    )  # fmt: skip


def usual_components(model: SpecimenModel) -> Real:
    """Medians of the standard deviations from press to press, before calibration."""
    return np.array([model.spread.scatter, model.spread.wander, model.spread.wander])


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
    m = len(rest)
    none = Data.unread(no_presses(), np.zeros(m), rest, np.broadcast_to(rest_noise, (m,)))
    return calibrated(model, none, prior(model, np.array(np.broadcast_to(noise, (m,)))))


def _mean(values: Real, otherwise: tuple[float, float]) -> tuple[float, float]:
    seen = values[np.isfinite(values)]
    return (float(seen.mean()), float(seen.std())) if len(seen) >= _FEWEST_COURSES else otherwise


def rest_gain(model: SpecimenModel) -> Real:
    """Covariance of the parts of a reading at rest by the gain alone (2 m, 2 m)."""
    m = len(model.frequency_hz)
    return np.asarray(model.spread.gain**2 / 2 * np.kron(np.eye(2), np.eye(m) + np.ones((m, m))))


def _rest_covariance(model: SpecimenModel, data: Data) -> Real:
    return np.diag(np.tile(np.maximum(data.rest_noise, _FLOOR), 2) ** 2) + rest_gain(model)


def covariances(model: SpecimenModel, at: Real, data: Data, components: Real, vectors: Real | None = None) -> Real:
    """Of the ratios given the parameters, (n, 2 m, 2 m): noise, and what changes from press to press."""
    presses = data.presses
    own = (np.tile(np.maximum(data.noise, _FLOOR), 2) ** 2)[:, None] * np.eye(2 * data.noise.shape[1])
    vectors = model.scatters(at, presses) if vectors is None else vectors
    variance = np.tile(components**2, (len(presses.force_n), 1))
    courses = (("hysteresis", presses.unloading), ("creep", presses.decades))
    for (name, course), (_, sd) in zip(courses, _USUAL, strict=True):
        variance[:, 0] += np.where(np.isnan(course), (model.value(name, at) * sd) ** 2, 0.0)
    return np.asarray(own + np.einsum("nik,nk,njk->nij", vectors, variance, vectors))


def usual_presses(posterior: Posterior, force_n: Real, position_m: Real) -> Presses:
    """Presses with the usual course."""
    unloading, decades = (np.full(len(force_n), mean) for mean, _ in (posterior.unloading, posterior.decades))
    return Presses(force_n, position_m, unloading, decades)


def readings(model: SpecimenModel, posterior: Posterior, force_n: Real, position_m: Real) -> tuple[Real, Real]:
    """Expected parts of ratios (points, 2 m), and their covariance with all that is open (points, 2 m, 2 m).

    Parameters
    ----------
    model, posterior
        Of the specimen.
    force_n, position_m : (f,), (x,) array
        Of a grid, whose points go along positions first [N], [m].
    """
    force, position = pairs(force_n, position_m)
    presses = usual_presses(posterior, force, position)
    slopes = model.slopes(posterior.at, presses)
    vectors = model.scatters(posterior.at, presses)
    components = posterior.components.copy()
    courses = (("hysteresis", posterior.unloading[1]), ("creep", posterior.decades[1]))
    unknown_course = [model.value(name, posterior.at) * sd for name, sd in courses]
    components[0] = np.sqrt(components[0] ** 2 + np.sum(np.square(unknown_course)))
    own = covariances(model, posterior.at, Data.unread(presses, posterior.noise), components, vectors)
    shared = slopes @ posterior.covariance @ slopes.transpose(0, 2, 1)
    return parts(model.ratio(posterior.at, presses)), own + shared


@dataclass(frozen=True, eq=False)
class _Specimen(inference.LeastSquares):
    """Known presses and readings at rest, of parameters with what was known before."""

    model: SpecimenModel
    data: Data
    before: Normal
    root: Real
    """(n, 2 m, 2 m): whitens the ratios."""
    reach = 3.0
    bound = 8.0  # beyond, readings that no specimen gives lead to numbers that no line takes

    def fit(self, at: Real, rows: inference.Index) -> LocalFit:  # noqa: ARG002
        """Sum of squares at parameters (1, p)."""
        fit = _pressed(at, *self.ratios(at[0]), self.root) + self.resting(at)
        return fit.with_prior(self.before.at, self.before.information)

    def ratios(self, at: Real) -> tuple[Real, Real]:
        """Ratios less the model's (n, 2 m), and derivatives of these (n, 2 m, p)."""
        presses = self.data.presses
        return parts(self.data.ratio - self.model.ratio(at, presses)), self.model.slopes(at, presses)

    def resting(self, at: Real) -> LocalFit:
        """Sum of squares of all that was read with nothing on the sensor, at parameters (1, p)."""
        data, root = self.data, whitening(_rest_covariance(self.model, self.data))

        def off(near: Real) -> Real:
            bench = parts(data.rest - self.model.rest(near)) @ root.T
            return np.concatenate([bench, data.meter.off(self.model, near)], -1) if data.meter else bench

        return LocalFit.of(at, off(at), -inference.slopes(off, at[0]).T[None])


def _pressed(at: Real, residual: Real, slope: Real, root: Real) -> LocalFit:
    """Sum of squares at parameters (1, p) of n ratios (n, k), their slopes (n, k, p) and whitening (n, k, k)."""
    white, by = np.einsum("nij,nj->ni", root, residual), root @ slope
    return LocalFit.of(at, white.reshape(1, -1), by.reshape(1, -1, at.shape[1]).transpose(0, 2, 1))


def _descended(model: SpecimenModel, data: Data, at: Real, components: Real, before: Normal) -> LocalFit:
    """Most probable parameters (1, p), and the information on them."""
    return inference.descend(
        _Specimen(model, data, before, whitening(covariances(model, at, data, components))), at[None]
    )


def information(model: SpecimenModel, data: Data, at: Real, components: Real) -> Real:
    """Information of presses and rest on the parameters (p, p), the prior's left out; parameters as covariances."""
    root = whitening(covariances(model, at, data, components))
    specimen = _Specimen(model, data, inference.standard(len(at)), root)
    fit = _pressed(at[None], *specimen.ratios(at), root) + specimen.resting(at[None])
    return np.asarray(fit.information[0])


def _components(model: SpecimenModel, data: Data, at: Real, before: Normal, usual: Real) -> Real:
    """Most probable standard deviations from press to press, the parameters integrated out as if they were linear."""
    from scipy.optimize import minimize

    specimen, vectors = _Specimen(model, data, before, np.empty(0)), model.scatters(at, data.presses)
    ratios, fixed = specimen.ratios(at), specimen.resting(at[None]).with_prior(before.at, before.information)

    def cost(ln: Real) -> float:
        if (usual * np.exp(ln)).max() > 1:  # no press explains these readings, and the covariance would be singular
            return np.inf
        root = whitening(covariances(model, at, data, usual * np.exp(ln), vectors))
        evidence = (_pressed(at[None], *ratios, root) + fixed).log_evidence()[0]
        evidence += np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
        return float(ln @ ln / _LN_LOOSE**2 - 2 * evidence)

    simplex = np.vstack([np.zeros(len(usual)), np.eye(len(usual))])
    options = {"xatol": 0.05, "fatol": 0.02, "initial_simplex": simplex}
    return np.asarray(usual * np.exp(minimize(cost, simplex[0], method="Nelder-Mead", options=options).x))


def gain(model: SpecimenModel, data: Data, at: Real) -> Complex:
    """Most probable ln of each tone's gain (m,), phase as imaginary part, given the other parameters."""
    off = parts(data.rest - model.rest(at))
    real, imaginary = np.split(rest_gain(model) @ np.linalg.solve(_rest_covariance(model, data), off), 2)
    return np.asarray(real + 1j * imaginary)


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
    told = [p.part(which).beyond(inference.standard(len(which))) for p in posteriors]
    covariance = np.asarray(np.linalg.inv(np.eye(len(which)) + sum(information for information, _ in told)), float)
    common = Normal(covariance @ sum(pull for _, pull in told), covariance)
    return [p.given(which, common) for p in posteriors]


def widened(model: SpecimenModel, posterior: Posterior) -> Posterior:
    """A posterior that no longer knows how the film yields under the tip, nor where that is: another tip, or day."""
    fixed = [k for k, name in enumerate(model.names) if not name.startswith(("rise", "force", "position"))]
    loose = np.setdiff1d(np.arange(len(model.names)), fixed)
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
