"""Resistivity, permittivity, leak and modulus from recordings of the bench."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, pi, sqrt

import numpy as np

from sensorgen.analysis.comparison.moved import PERMITTIVITY, Movable, at_rest, moved, pressed
from sensorgen.analysis.comparison.runs import Run
from sensorgen.analysis.fit.results import LEVEL, Fitted, Untold
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.design.materials import FILM_LEAK
from sensorgen.measure.recording.samples import Complex, Real

MODULUS = "youngs_modulus_pa"
_SURE = 2.0  # standard errors on either side of a value
_UNSURE = log(3.0)  # standard error of a logarithm from which on the data do not tell
_FLOOR = 1e-4  # of ln Z: no bench is right to more
_BOUND = log(1e3)  # factors beyond are no fit
_BETWEEN, _WEIGHT = 0.1, 3  # prior of the scatter of ln of a value between prints: its size, worth so many of them


@dataclass(frozen=True, eq=False)
class OfRun:
    """What a recording says: ln of factors to the prediction, with standard errors; leak of the whole film [S]."""

    run: Run
    of: Movable
    resistivity: tuple[float, float]
    capacitance: tuple[float, float]
    leak_s: tuple[float, float]
    stiffness: tuple[float, float] | None


def of_run(run: Run, of: Movable) -> OfRun:
    """Fit a recording.

    Raises
    ------
    SensorgenError
        The line model does not apply to the design.
    """
    from scipy.optimize import least_squares

    sensor, f = of.model.sensor, run.tones_hz
    measured = np.log(run.rest_ohm)
    weight = 1 / np.maximum(np.abs(run.rest_error_ohm / run.rest_ohm), _FLOOR)
    scale = 2 * pi * float(f.min()) * sensor.capacitance_f()

    def left(at: Real) -> Real:
        found = at_rest(moved(sensor, exp(at[0]), exp(at[1]), at[2] * scale), f)
        return _parts((measured - found) * weight)

    done = least_squares(
        left, [0.0, 0.0, 1e-3], bounds=([-_BOUND, -_BOUND, 0], [_BOUND, _BOUND, np.inf]), x_scale="jac"
    )
    errors = _errors(done.jac, done.fun)
    found = moved(sensor, exp(done.x[0]), exp(done.x[1]), done.x[2] * scale)
    stiffness = None
    if run.pairs is not None and len(run.pairs.time_s) >= 3:
        stiffness = _stiffness(run, found)
    return OfRun(
        run, of, (done.x[0], errors[0]), (done.x[1], errors[1]), (done.x[2] * scale, errors[2] * scale), stiffness
    )


def _parts(values: Complex) -> Real:
    return np.concatenate([values.real.ravel(), values.imag.ravel()])


def _errors(jacobian: Real, left: Real) -> Real:
    """Standard errors, with the scatter that is left where it is more than the readings' own."""
    spread = max(1.0, float(left @ left) / max(len(left) - jacobian.shape[1], 1))
    return np.asarray(np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian)) * spread))


def _stiffness(run: Run, sensor: "object") -> tuple[float, float] | None:
    from scipy.optimize import least_squares

    pairs, f = run.pairs, run.tones_hz
    assert pairs is not None  # noqa: S101 - asked before
    moves = np.log(pairs.pressed_ohm / pairs.before_ohm)
    weight = 1 / np.maximum(np.abs(pairs.error_ohm / pairs.before_ohm), _FLOOR)

    def left(at: Real) -> Real:
        made = pressed(sensor, f, pairs.force_n, pairs.position_mm * M_PER_MM, exp(at[0]))  # type: ignore[arg-type]
        return _parts((moves - made) * weight)

    try:
        done = least_squares(left, [0.0], bounds=([-log(10.0)], [_BOUND]))
    except SensorgenError:
        return None
    return float(done.x[0]), float(_errors(done.jac, done.fun)[0])


def values(fits: Sequence[OfRun]) -> list[Fitted | Untold]:
    """What the recordings say together, each counting the same."""
    if not fits:
        none = "no recording of the bench: resistances at direct current do not depend on it"
        return [Untold(PERMITTIVITY, none), Untold(MODULUS, none)]
    sensor, film = fits[0].of.model.sensor, fits[0].of.film
    electrode = fits[0].of.body.design.slot("top_electrode")[0].name
    along = [
        (fit.resistivity[0] + log(fit.of.model.sensor.common_resistivity_ohm_m()), fit.resistivity[1]) for fit in fits
    ]
    pressed = [
        (fit, (fit.stiffness[0] + log(t.value), fit.stiffness[1])) for fit in fits if fit.stiffness
        for t in fit.of.model.values if t.material == film and t.quantity == MODULUS
    ]  # fmt: skip
    rho = f"Re Z of {len(fits)} recordings: one value for both electrodes, along them"
    law = f"by the law of compression {sensor.compression.name}; all moduli move together"
    modulus: Fitted | Untold = Untold(MODULUS, "no recording with presses whose force and position are known")
    if pressed:
        moduli = [pair for _, pair in pressed]
        together = _together(moduli, _prints([fit for fit, _ in pressed]))
        modulus = _value(film, MODULUS, together, f"presses of {len(moduli)} recordings, {law}", len(moduli))
    return [
        _value(electrode, "resistivity_ohm_m", _together(along, _prints(fits)), rho, len(fits)),
        _permittivity(fits, film), modulus, _leak(fits, film),
    ]  # fmt: skip


def _value(material: str, quantity: str, ln: tuple[float, float], note: str, count: int) -> Fitted | Untold:
    """A value by the logarithm and its standard error, unless that leaves it open."""
    at, error = ln
    if error > _UNSURE:
        return Untold(quantity, f"{count} recordings leave a factor of {exp(error):.3g} open")
    return Fitted(material, quantity, exp(at), exp(at - _SURE * error), exp(at + _SURE * error), note)


def _prints(fits: Sequence[OfRun]) -> list[str]:
    return [fit.run.entry.batch or fit.run.entry.specimen for fit in fits]


def _together(
    found: Sequence[tuple[float, float]], prints: Sequence[str], usual: float = _BETWEEN
) -> tuple[float, float]:
    """Mean over prints, and its standard error from the errors or from the scatter between prints, whichever is more.

    Recordings of one specimen count as one print, and specimens of one plate as one: they share its conditions. Few
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


def _permittivity(fits: Sequence[OfRun], film: str) -> Fitted | Untold:
    found = []
    for fit in fits:
        factor, curve = fit.of.by_permittivity
        if not curve[0] <= fit.capacitance[0] <= curve[-1]:
            return Untold(
                PERMITTIVITY,
                f"{fit.run.name} has {exp(fit.capacitance[0]):.3g} times the predicted capacitance; a permittivity of "
                f"{fit.of.permittivity * exp(factor[0]):.3g} to {fit.of.permittivity * exp(factor[-1]):.3g} makes none",
            )
        slope = float(np.interp(fit.capacitance[0], curve, np.gradient(curve, factor)))
        at = float(np.interp(fit.capacitance[0], curve, factor))
        c = fit.of.model.rest.capacitance  # what model and print leave open
        open_ = log(c.model.upper / c.model.lower * c.print.upper / c.print.lower) / 2 / _SURE
        found.append((log(fit.of.permittivity) + at, sqrt(fit.capacitance[1] ** 2 + open_**2) / slope))
    at, between = _together(found, _prints(fits))
    error = max(between, max(e for _, e in found))  # bounds of a model do not average out
    note = f"Im Z of {len(fits)} recordings; the interval holds the bounds of the cell's model"
    return _value(film, PERMITTIVITY, (at, error), note, len(fits))


def _leak(fits: Sequence[OfRun], film: str) -> Fitted | Untold:
    """Per area, where it stands out of its error in every recording."""
    areas = [fit.of.model.sensor.length_m * fit.of.model.sensor.width_m for fit in fits]
    found = [(fit.leak_s[0] / a, fit.leak_s[1] / a) for fit, a in zip(fits, areas, strict=True)]
    if any(at < _SURE * error for at, error in found):
        most = max(at + _SURE * error for at, error in found)
        return Untold("leak", f"in {len(found)} recordings no more than {most:.2g} S/m2, and none of it certain")
    typical = sum(at for at, _ in found) / len(found)
    at, error = _together(found, _prints(fits), _BETWEEN * typical)
    if at <= _SURE * error:
        return Untold("leak", f"{len(found)} recordings differ too much: {at:.2g} S/m2, give or take {error:.2g}")
    return Fitted(film, FILM_LEAK, at, at - _SURE * error, at + _SURE * error,
                  f"Z of {len(found)} recordings at their lowest tones")  # fmt: skip
