"""Resistivity, permittivity, leak and modulus from recordings and LCR meters' readings of specimens.

Each specimen is calibrated (:mod:`sensorgen.prediction.calibration`); what its readings say beyond the prior counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, log, pi, sqrt

import numpy as np

from sensorgen.analysis.calibration import Known
from sensorgen.analysis.comparison.moved import PERMITTIVITY, Movable
from sensorgen.analysis.fit.results import LEVEL, Fitted, Untold
from sensorgen.core.arrays import Real
from sensorgen.design.materials import FILM_LEAK
from sensorgen.prediction.calibration.fitting import Posterior, calibrated
from sensorgen.prediction.calibration.specimen import FORCES_N, SpecimenModel

MODULUS = "youngs_modulus_pa"
_SURE = 2.0  # standard errors on either side of a value
_UNSURE = log(3.0)  # standard error of a logarithm from which on the data do not tell
_BETWEEN, _WEIGHT = 0.1, 3  # prior of the scatter of ln of a value between prints: its size, worth so many of them
_OPEN = 0.95  # of the prior's standard deviation, from which on nothing was learnt of the leak
_LEAST = 1e-3  # of a parameter's variance that readings must have taken away: with less they say nothing
_SOFTER = 1.05  # factor on a force, to see how the rise depends on it


@dataclass(frozen=True, eq=False)
class OfSpecimen:
    """Evidence of a specimen: ln of factors to the prediction, with standard errors; leak of the whole film [S]."""

    name: str
    print_: str
    of: Movable
    resistivity: tuple[float, float]
    capacitance: tuple[float, float]
    leak_s: tuple[float, float] | None
    stiffness: tuple[float, float] | None


def of_specimen(known: Known, print_: str, of: Movable) -> OfSpecimen:
    """Calibrate a specimen, and take what its readings say.

    Parameters
    ----------
    known : Known
        What the log has of it.
    print_ : str
        Name of its print bed; its own if that is unknown.
    of : Movable
        Its body.
    """
    model, found = known.model, calibrated(known.model, known.data)
    c = model.sensor.capacitance_f() * exp(model.spread.capacitance * _at(model, found, "capacitance")[0])
    leak, sd = _at(model, found, "leak")
    at, ln = model.spread.leak * exp(model.spread.leak_spread * leak), model.spread.leak_spread * sd
    siemens = at * 2 * pi * float(model.frequency_hz.min()) * c
    stiffness = _stiffness(known, found) if len(known.data.presses.force_n) >= 3 else None
    return OfSpecimen(
        known.specimen, print_, of, _alone(model, found, "resistance", model.spread.resistance),
        _alone(model, found, "capacitance", model.spread.capacitance),
        (siemens, siemens * (exp(_SURE * ln) - 1) / _SURE) if sd < _OPEN else None, stiffness,
    )  # fmt: skip


def _at(model: SpecimenModel, found: Posterior, name: str) -> tuple[float, float]:
    k = model.names.index(name)
    return float(found.at[k]), sqrt(found.covariance[k, k])


def _alone(model: SpecimenModel, found: Posterior, name: str, scale: float) -> tuple[float, float]:
    """Estimate of a parameter by the readings without the prior, which is standard normal."""
    at, sd = _at(model, found, name)
    known = 1 - sd**2
    return (scale * at / known, scale * sd / sqrt(known)) if known > _LEAST else (0.0, inf)


def _stiffness(known: Known, found: Posterior) -> tuple[float, float]:
    """Ln of one factor on all moduli by the rise at each force, whose own deviations from the law are marginalised."""
    model, sensor = known.model, known.model.sensor
    weights = model.law_weights()
    prior = np.linalg.inv(weights @ weights.T)
    posterior = np.linalg.inv(weights @ found.covariance @ weights.T)
    by_readings = posterior - prior  # of the readings alone, over the predicted rise
    pull = posterior @ (weights @ found.at) + by_readings.sum(1) * model.spread.law_middle
    common = weights[:, model.names.index("rise")]
    shape = np.linalg.inv(weights @ weights.T - np.outer(common, common))
    through = shape @ np.linalg.inv(by_readings + shape)
    slope = -_slopes(model)  # a film that is stiffer by a factor answers as to a weaker press
    in_range = np.array(FORCES_N) <= sensor.width_m * sensor.tip_m * model.most_pa
    slope = np.where(in_range, slope, 0.0)
    information = float(slope @ through @ by_readings @ slope)
    return (float(slope @ through @ pull) / information, 1 / sqrt(information)) if information > 0 else (0.0, inf)


def _slopes(model: SpecimenModel) -> Real:
    """Of ln of the predicted rise over ln force at ``FORCES_N``."""
    sensor = model.sensor

    def rise(force_n: Real) -> Real:
        share, _ = sensor.compression.capacitive_strain(force_n / (sensor.width_m * sensor.tip_m))
        return np.log(share / (1 - share))

    force = np.minimum(np.array(FORCES_N), sensor.width_m * sensor.tip_m * model.most_pa / _SOFTER)
    return np.asarray((rise(force * _SOFTER) - rise(force)) / log(_SOFTER))


def values(fits: Sequence[OfSpecimen]) -> list[Fitted | Untold]:
    """Values by all recordings, of equal weight."""
    if not fits:
        none = "no recording of the bench: resistances at direct current do not depend on it"
        return [Untold(PERMITTIVITY, none), Untold(MODULUS, none)]
    sensor, film = fits[0].of.model.sensor, fits[0].of.film
    electrode = fits[0].of.body.design.slot("top_electrode")[0].name
    of_r, of_c, of_e = (
        [fit for fit in fits if (found := getattr(fit, name)) and found[1] < _UNSURE]
        for name in ("resistivity", "capacitance", "stiffness")
    )
    along = [
        (fit.resistivity[0] + log(fit.of.model.sensor.common_resistivity_ohm_m()), fit.resistivity[1]) for fit in of_r
    ]
    pressed = [
        (fit, (fit.stiffness[0] + log(t.value), fit.stiffness[1])) for fit in of_e if fit.stiffness
        for t in fit.of.model.values if t.material == film and t.quantity == MODULUS
    ]  # fmt: skip
    rho: Fitted | Untold = Untold("resistivity_ohm_m along", "no reading of a specimen depends on it")
    if along:
        note = f"Re Z of {_specimens(len(along))}: one value for both electrodes, along them"
        rho = _value(electrode, "resistivity_ohm_m", _together(along, _prints(of_r)), note, len(along))
    modulus: Fitted | Untold = Untold(MODULUS, "no recording with presses whose force and position are known")
    if pressed:
        moduli = [pair for _, pair in pressed]
        together = _together(moduli, _prints([fit for fit, _ in pressed]))
        law = f"by the law of compression {sensor.compression.name}; all moduli move together"
        modulus = _value(film, MODULUS, together, f"presses of {_specimens(len(moduli))}, {law}", len(moduli))
    return [rho, _permittivity(of_c, film), modulus, _leak(fits, film)]


def _value(material: str, quantity: str, ln: tuple[float, float], note: str, count: int) -> Fitted | Untold:
    """A value by the logarithm and its standard error, unless that leaves it open."""
    at, error = ln
    if error > _UNSURE:
        return Untold(quantity, f"{_specimens(count)} leave a factor of {exp(error):.3g} open")
    return Fitted(material, quantity, exp(at), exp(at - _SURE * error), exp(at + _SURE * error), note)


def _specimens(count: int) -> str:
    return f"{count} specimen{'s' * (count != 1)}"


def _prints(fits: Sequence[OfSpecimen]) -> list[str]:
    return [fit.print_ for fit in fits]


def _together(
    found: Sequence[tuple[float, float]], prints: Sequence[str], usual: float = _BETWEEN
) -> tuple[float, float]:
    """Mean over prints, and its standard error from the errors or from the scatter between prints, whichever is more.

    Specimens of one plate count as one print: they share its conditions. Few
    prints tell their own scatter badly: a prior stands in for it, and it counts as much more as Student's interval is
    wider. One print alone therefore never gives its own value for the material's.
    """
    from scipy.special import stdtrit

    of = {name: [pair for pair, print_ in zip(found, prints, strict=True) if print_ == name] for name in prints}
    means = np.array([np.mean(pairs, axis=0) for pairs in of.values()])
    at, errors = means.T
    own, count = sqrt(float((errors**2).sum())) / len(at), len(at)
    degrees = _WEIGHT + count - 1
    scatter = sqrt((_WEIGHT * usual**2 + float(((at - at.mean()) ** 2).sum())) / degrees)
    wider = float(stdtrit(degrees, (1 + LEVEL) / 2)) / _SURE
    return float(at.mean()), max(own, wider * scatter / sqrt(count))


def _permittivity(fits: Sequence[OfSpecimen], film: str) -> Fitted | Untold:
    if not fits:
        return Untold(PERMITTIVITY, "no reading of a specimen depends on it")
    found, open_ = [], 0.0
    for fit in fits:
        factor, curve = fit.of.by_permittivity
        if not curve[0] <= fit.capacitance[0] <= curve[-1]:
            return Untold(
                PERMITTIVITY,
                f"{fit.name} has {exp(fit.capacitance[0]):.3g} times the predicted capacitance; a permittivity of "
                f"{fit.of.permittivity * exp(factor[0]):.3g} to {fit.of.permittivity * exp(factor[-1]):.3g} makes none",
            )
        slope = float(np.interp(fit.capacitance[0], curve, np.gradient(curve, factor)))
        at = float(np.interp(fit.capacitance[0], curve, factor))
        c = fit.of.model.rest.capacitance  # what model and print leave open
        open_ = max(open_, log(c.model.upper / c.model.lower * c.print.upper / c.print.lower) / 2 / _SURE / slope)
        found.append((log(fit.of.permittivity) + at, fit.capacitance[1] / slope))
    at, between = _together(found, _prints(fits))
    error = between + open_  # bounds of a model do not average out, and prints scatter about their ends too
    note = f"Im Z of {_specimens(len(fits))}; the interval holds the bounds of the cell's model"
    return _value(film, PERMITTIVITY, (at, error), note, len(fits))


def _leak(fits: Sequence[OfSpecimen], film: str) -> Fitted | Untold:
    """Per area, where it stands out of its error in every recording."""
    known = [(fit, fit.leak_s, fit.of.model.sensor) for fit in fits if fit.leak_s]
    if not known:
        return Untold("leak", "no reading of a specimen depends on it")
    found = [(at / (s.length_m * s.width_m), error / (s.length_m * s.width_m)) for _, (at, error), s in known]
    if any(at < _SURE * error for at, error in found):
        most = max(at + _SURE * error for at, error in found)
        return Untold("leak", f"in {_specimens(len(found))} no more than {most:.2g} S/m2, and none of it certain")
    typical = sum(at for at, _ in found) / len(found)
    at, error = _together(found, _prints([fit for fit, _, _ in known]), _BETWEEN * typical)
    if at <= _SURE * error:
        return Untold("leak", f"{_specimens(len(found))} differ too much: {at:.2g} S/m2, give or take {error:.2g}")
    return Fitted(film, FILM_LEAK, at, at - _SURE * error, at + _SURE * error,
                  f"Z of {_specimens(len(found))} at their lowest tones")  # fmt: skip
