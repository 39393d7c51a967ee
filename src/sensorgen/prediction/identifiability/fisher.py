r"""Fisher information of readings on force and position, and the Cramer-Rao bound.

The real and the imaginary part of Z at each frequency carry Gaussian noise of standard deviation ``noise`` \|Z\|, all
independent. Divided by Z a reading is then ln Z with noise ``noise`` in both parts, the same at every frequency.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Mask, Real, finite
from sensorgen.core.errors import OutOfRange
from sensorgen.models import refusal
from sensorgen.models.sensor import Response, Sensor
from sensorgen.prediction.identifiability import results
from sensorgen.prediction.identifiability.results import GUESS, metres, newtons
from sensorgen.prediction.inference import cramer_rao, orthogonal

HIGHEST_HZ = 1e6  # assumed of the bridge; its oscilloscope (TiePie HS5-540) reaches far more


class Slopes(NamedTuple):
    """Relative derivatives of Z, frequencies on the last axis."""

    by_force_per_n: Complex
    by_position_per_m: Complex


class LeastErrors(NamedTuple):
    """Least standard errors of any unbiased estimate of a press; nan where they are undefined."""

    force_n: Real
    position_m: Real
    correlation: Real


@dataclass(frozen=True)
class Setup:
    """One press on one sensor, read at some frequencies.

    Attributes
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : tuple of float
        Frequencies [Hz]; one that is listed twice is read twice.
    noise : float
        Standard deviation of Re Z and of Im Z, each, relative to abs(Z) [-].
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    assumed : str
        Assumption on the law of compression of a cell that was not solved, or "".
    """

    sensor: Sensor
    frequency_hz: tuple[float, ...]
    noise: float
    force_n: float
    position_m: float
    assumed: str = ""

    def __post_init__(self) -> None:
        """Refuse readings that are none."""
        if not self.frequency_hz:
            raise OutOfRange("no frequencies to read the sensor at: expected at least one frequency")
        if not 0 < self.noise < np.inf:
            raise OutOfRange(f"noise is {self.noise:g}; expected a number above 0")

    @property
    def highest_hz(self) -> float:
        """Highest frequency of the instrument [Hz]."""
        return max(HIGHEST_HZ, *self.frequency_hz)

    def bounds(self) -> LeastErrors:
        """Bounds of the press by these readings."""
        return bounds(slopes(self.sensor, self.frequency_hz, self.force_n, self.position_m), self.noise)

    def on(self, sensor: Sensor) -> "Setup":
        """Press another sensor alike."""
        return replace(self, sensor=sensor)


def slopes(sensor: Sensor, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Slopes:
    """Exact d ln Z by force [1/N] and by position [1/m].

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : (n,) array
        Frequencies [Hz].
    force_n, position_m : float or array
        Presses [N], [m]; they broadcast, and the frequencies are a last axis.

    Raises
    ------
    OutOfRange
        As :meth:`sensorgen.models.sensor.Sensor.response`; also where Z is 0.
    """
    force, position = (np.asarray(value, float)[..., None] for value in (force_n, position_m))
    return relative(sensor.response(np.asarray(frequency_hz, float), force, position), force)


def relative(response: Response, force_n: ArrayLike) -> Slopes:
    """Derivatives of ln Z, of those of Z under a force [N]; errors as :func:`slopes`."""
    z, by_force, by_position = response
    if not z.all():
        raise OutOfRange("Z is 0: a relative change needs a resistance or a capacitance to change")
    return Slopes(
        by_force / z, np.where(np.equal(force_n, 0), 0.0, by_position / z)
    )  # at the ends rounding would leave residues


def bounds(of: Slopes, noise: float) -> LeastErrors:
    """Cramer-Rao bounds of force and position, both unknown: see :func:`sensorgen.prediction.inference.cramer_rao`.

    Slopes are those of ln Z; real and imaginary parts of all frequencies count alike.

    Parameters
    ----------
    of : Slopes
        Frequencies on the last axis.
    noise : float
        Of each part of Z, relative to abs(Z) [-].

    Returns
    -------
    Bounds
        sigma_F [N], sigma_x [m] and their correlation [-]; nan where the matrix is singular. Where Z does not
        depend on position (b = 0, as without a force) only sigma_x is nan: sigma_F then is n/norm(a).

    Examples
    --------
    Two readings, one of force alone and one of position alone:

    >>> b = bounds(Slopes(np.array([2.0 + 0j, 0]), np.array([0j, 5.0])), 0.01)
    >>> float(b.force_n), float(b.position_m)
    (0.005, 0.002)
    """
    force, position, correlation = cramer_rao(*of)
    return LeastErrors(noise * force, noise * position, correlation)


def shares(of: Slopes) -> tuple[Real, Real]:
    """Share of each frequency in the information on force, and on position, the other being unknown too [-].

    The information on one of them, 1/sigma^2, is a sum over frequencies; nan where it is undefined.
    """
    a, b = of
    with np.errstate(all="ignore"):
        force, position = (np.abs(orthogonal(u, v)) ** 2 for u, v in ((a, b), (b, a)))
        return force / force.sum(-1, keepdims=True), position / position.sum(-1, keepdims=True)


def undefined(setup: Setup, of: Slopes) -> str:
    """Why the position of a press is undefined, or ""."""
    if setup.force_n == 0:
        return "without a force there is no press to locate"
    if not of.by_position_per_m.any():
        return "Z does not depend on position"
    if np.isnan(bounds(of, setup.noise).position_m):
        return "these frequencies cannot separate it from force: both change Z in the same direction"
    return ""


def bearable(sensor: Sensor, force_n: Real, position_m: Real) -> Mask:
    """Where the law of compression is defined, in the broadcast shape of forces [N] and positions [m]."""
    stress = sensor.stress_pa(force_n, position_m)
    refused = partial(refusal, OutOfRange, sensor.compression.capacitive_strain)
    if refused(stress) is None:
        return np.ones(stress.shape, bool)
    return np.array([refused(np.asarray(one)) is None for one in stress.ravel()]).reshape(stress.shape)


def standard_errors(limits: LeastErrors) -> results.StandardErrors:
    """Bounds of one press, None where they are undefined."""
    return results.StandardErrors(
        sigma_force_n=finite(limits.force_n),
        sigma_position_m=finite(limits.position_m),
        correlation=finite(limits.correlation),
    )


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

    def errors(self) -> results.StandardErrors:
        """The required standard errors as a result."""
        return results.StandardErrors(sigma_force_n=self.force_n, sigma_position_m=self.position_m)

    def grades(self, bounds: LeastErrors) -> tuple[str, str]:
        """Verdicts on sensing force and on locating a press: yes, roughly or no."""
        return (
            _grade(float(bounds.force_n), self.force_n, self.guess_force_n),
            _grade(float(bounds.position_m), self.position_m, self.guess_position_m),
        )


def required(setup: Setup) -> Required:
    """Requirements of a press: a tenth of its force, and one length of the tip."""
    force, sensor = abs(setup.force_n), setup.sensor
    return Required(results.FORCE_SHARE * force, sensor.tip_m, GUESS * force, GUESS * sensor.length_m)


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
    certain = ": what it cannot do is certain" if "no" in need.grades(free) else ""
    return (
        f"the film is assumed to expand sideways freely, the softest case{certain}; bonded to stiff electrodes, the "
        f"stiffest, it {_ability(stiff, need)} ({newtons(stiff.force_n)}, {metres(stiff.position_m)})"
    )


def _ability(bounds: LeastErrors, need: Required) -> str:
    force, position = need.grades(bounds)
    return f"{_FORCE[force]} and {_POSITION[position]}"


SEARCHED = 40  # frequencies whose combinations are all tried
PER_DECADE = 20  # of the grid of advised frequencies
BELOW, ABOVE = 100.0, 10.0  # how far the grid reaches from the corner, as factors


def best(setup: Setup, of: Slopes, required: Required) -> tuple[results.FrequencyChoice, ...]:
    """The best one, two and three of the given frequencies, all combinations tried.

    Parameters
    ----------
    setup : Setup
        The press and the frequencies. Of more than ``SEARCHED``, as many are taken evenly from the list.
    of : Slopes
        At the frequencies, and the press.
    required : Required
        Errors that serve; the best choice has the smallest shortfall.
    """
    count = len(setup.frequency_hz)
    taken = np.unique(np.linspace(0, count - 1, min(count, SEARCHED)).astype(int))
    frequency, among = np.asarray(setup.frequency_hz)[taken], Slopes(*(slope[taken] for slope in of))
    sizes = range(1, min(3, len(taken)) + 1)
    return tuple(_best(frequency, among, size, setup.noise, required) for size in sizes)


def advised(setup: Setup, required: Required) -> results.AdvisedFrequencies:
    """The best single frequency and the best pair on a grid about the corner, up to the instrument's limit."""
    corner = _corner_hz(setup)
    low, high = corner / BELOW, min(corner * ABOVE, setup.highest_hz)
    grid = np.geomspace(low, high, round(PER_DECADE * float(np.log10(high / low))) + 1)
    on_grid = slopes(setup.sensor, grid, setup.force_n, setup.position_m)
    single, pair = (_best(grid, on_grid, size, setup.noise, required) for size in (1, 2))
    return results.AdvisedFrequencies(float(grid[0]), float(grid[-1]), single, pair)


def spread(setup: Setup) -> tuple[float, ...]:
    """As many frequencies as there are, logarithmically spaced from a tenth of the corner to ten times it [Hz]."""
    corner, count = _corner_hz(setup), len(setup.frequency_hz)
    if count == 1:
        return (corner,)
    return tuple(np.geomspace(corner / 10, min(10 * corner, setup.highest_hz), count).tolist())


def _corner_hz(setup: Setup) -> float:
    return min(setup.sensor.corner_frequency_hz(), setup.highest_hz)


def _best(frequency: Real, of: Slopes, size: int, noise: float, required: Required) -> results.FrequencyChoice:
    """The combination of ``size`` frequencies with the smallest shortfall."""
    chosen = np.array(list(combinations(range(len(frequency)), size)))
    limits = bounds(Slopes(*(slope[chosen] for slope in of)), noise)
    short = required.shortfall(limits)
    k = int(np.argmin(short))
    if np.isinf(short[k]):
        return results.FrequencyChoice(sigma_force_n=None, sigma_position_m=None)
    return results.FrequencyChoice(
        frequency_hz=tuple(frequency[chosen[k]].tolist()),
        sigma_force_n=float(limits.force_n[k]),
        sigma_position_m=float(limits.position_m[k]),
    )
