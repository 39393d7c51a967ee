"""Verdict on the bounds: whether a design senses force and locates a press, as text."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.prediction.identifiability.fisher import LeastErrors, Setup
from sensorgen.prediction.identifiability.results import FORCE_SHARE, GUESS, StandardErrors, metres, newtons

_FORCE = {"yes": "senses force", "roughly": "senses force only roughly", "no": "cannot sense force"}
_POSITION = {"yes": "locates a press", "roughly": "locates a press only roughly", "no": "cannot locate a press"}


@dataclass(frozen=True)
class Required:
    """Required standard errors of a press.

    A quantity is sensed ("yes") where its standard error is at most the required one: a tenth of the force, one length
    of the tip. It is not ("no") where the error is that of a uniform distribution or more: force range/sqrt(12),
    sensor length/sqrt(12); a reading then has no information. Between the two it is sensed "roughly".

    Attributes
    ----------
    force_n, position_m : float
        Required standard errors [N], [m].
    guess_force_n, guess_position_m : float
        Those of a uniform distribution [N], [m].
    """

    force_n: float
    position_m: float
    guess_force_n: float
    guess_position_m: float

    def shortfall(self, bounds: LeastErrors) -> Real:
        """By what factor the worse of both errors exceeds what is required [-]; infinite where undefined."""
        with np.errstate(all="ignore"):  # without force, nothing is required
            worse = np.maximum(bounds.force_n / self.force_n, bounds.position_m / self.position_m)
        return np.where(np.isnan(worse), np.inf, worse)

    def errors(self) -> StandardErrors:
        """The required standard errors as a result."""
        return StandardErrors(sigma_force_n=self.force_n, sigma_position_m=self.position_m)

    def force(self, sigma_n: float) -> str:
        """Verdict on sensing force at a standard error [N]: yes, roughly or no."""
        return _grade(sigma_n, self.force_n, self.guess_force_n)

    def position(self, sigma_m: float) -> str:
        """Verdict on locating a press at a standard error [m]: yes, roughly or no."""
        return _grade(sigma_m, self.position_m, self.guess_position_m)


def required(setup: Setup) -> Required:
    """Requirements of a press: a tenth of its force, and one length of the tip."""
    force, sensor = abs(setup.force_n), setup.sensor
    return Required(FORCE_SHARE * force, sensor.tip_m, GUESS * force, GUESS * sensor.length_m)


def _grade(sigma: float, serves: float, guess: float) -> str:
    if sigma <= min(serves, guess):
        return "yes"
    return "roughly" if sigma < guess else "no"


def verdict(setup: Setup, bounds: LeastErrors, need: Required, reason: str) -> str:
    """Verdict on a design, in one sentence; ``reason`` says why position is undefined."""
    where = f"at {setup.force_n:g} N and {setup.position_m * 1e3:g} mm"
    unless = f"not known, as {setup.assumed}; if it did: " if setup.assumed else ""
    position = f", but {reason}" if reason else f", position to {metres(bounds.position_m)}"
    return (
        f"{unless}at {setup.noise * 100:g} % noise this design {_ability(bounds, need)}: {where} "
        f"force is known to {newtons(bounds.force_n)}{position}; the sensor is {metres(setup.sensor.length_m)} long"
    )


def bracket(free: LeastErrors, stiff: LeastErrors, need: Required) -> str:
    """The verdict where the law of compression lies anywhere between a free and a confined film."""
    certain = ": what it cannot do is certain" if "no" in _grades(free, need) else ""
    return (
        f"the film is assumed to expand sideways freely, the softest case{certain}; bonded to stiff electrodes, the "
        f"stiffest, it {_ability(stiff, need)} ({newtons(stiff.force_n)}, {metres(stiff.position_m)})"
    )


def _ability(bounds: LeastErrors, need: Required) -> str:
    force, position = _grades(bounds, need)
    return f"{_FORCE[force]} and {_POSITION[position]}"


def _grades(bounds: LeastErrors, need: Required) -> tuple[str, str]:
    return need.force(float(bounds.force_n)), need.position(float(bounds.position_m))
