r"""Drift of the elastomer, fitted to the rest between presses and taken out.

Where nothing presses, ln Z moves by

.. math:: \ln Z(t) = a_0 + \sum_i a_i b_i(t) + \sum_k c_k \int_0^t F(s)\, e^{-(t - s)/\tau_k} \frac{ds}{\tau_k} + w(t)

with courses b that depend on the time alone, what the film remembers of the presses before, and what wanders: see
:mod:`sensorgen.measure.signal.laws`. Each law has some of these terms. The one is taken that explains the rest with
the least
of Schwarz's criterion (BIC): the logarithm of what is left, and a price for every number that was fitted. The fit is
made in ln Z because a permittivity that creeps multiplies Z and does not add to it, and taken out of the pressed
readings too.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.measure.recording.samples import Bools, Complex, Real
from sensorgen.measure.signal import laws

SETTLE_S = 1.0
LAWS = {
    "line": "a straight line over time",
    "smooth": "a cubic and five logarithms of time",
    "memory": "smooth, and what the film remembers of the presses before",
    "wandering": "smooth, and what wanders from rest to rest",
    "memory+wandering": "smooth, what the film remembers of the presses before, and what wanders from rest to rest",
}
"""Laws of drift by their names, and what each means."""

BY_TIME = ("line", "smooth", "wandering")
"""Laws that ask for no force."""

_LEAST = 100


@dataclass(frozen=True, eq=False)
class Drift:
    """What the rest did.

    Attributes
    ----------
    law : str
        Of :data:`LAWS`.
    reason : str
        Why this one, in words.
    start_s : float
        When the readings began [s].
    fit : Fit
        The law with its numbers: ln Z at rest, at any time.
    """

    law: str
    reason: str
    start_s: float
    fit: laws.Fit

    def at(self, time_s: Real) -> Complex:
        """Relative drift of ln Z since the begin (n, m), at any times [s]."""
        return np.asarray(self.fit.at(time_s) - self.fit.at(np.array([self.start_s])))

    def removed(self, time_s: Real, impedance_ohm: Complex) -> Complex:
        """Readings as they would be without drift [ohm]."""
        return np.asarray(impedance_ohm * np.exp(-self.at(time_s)))

    def rest_ohm(self) -> Complex:
        """What the sensor has at rest, when the readings begin (m,) [ohm]."""
        return np.asarray(np.exp(self.fit.at(np.array([self.start_s]))[0]))


def fitted(
    time_s: Real, impedance_ohm: Complex, valid: Bools, force_n: Real, settle_s: float = SETTLE_S,
    among: Collection[str] = tuple(LAWS),
) -> Drift:  # fmt: skip
    """The drift of the rest between presses.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings [ohm].
    valid : (n,) array of bool
        Readings that count.
    force_n : (n,) array
        What pressed; rest is where it is below a tenth of a newton, and was for ``settle_s`` [N].
    settle_s : float
        How long the sensor needs to come back after a press [s].
    among : collection of str
        Names of :data:`LAWS` to choose from.

    Raises
    ------
    BadInput
        Too little rest to fit to, or no law to choose from.
    UnknownName
        No such law.
    """
    for name in among:
        check(name)
    rest = valid & ~_disturbed(time_s, force_n, settle_s)
    if np.count_nonzero(rest) < _LEAST:
        raise BadInput(f"{np.count_nonzero(rest)} readings at rest; expected {_LEAST} or more to fit a drift to")
    z, start = impedance_ohm[rest], float(time_s[0])
    bins = laws.binned(time_s[rest], np.log(np.abs(z)) + 1j * np.unwrap(np.angle(z), axis=0))
    seconds = max(float(time_s[-1]) - start, 1e-9)
    smooth = laws.explained(bins, (laws.Smooth(start, seconds),))
    found = {"line": laws.explained(bins, (laws.Line(start, seconds),)), "smooth": smooth}
    if any("memory" in name for name in among):
        found["memory"] = laws.remembering(bins, smooth, time_s, force_n, settle_s / 2)
    for name in among:
        if "wandering" in name:
            found[name] = laws.wandering(bins, found["memory" if "memory" in name else "smooth"])
    return _chosen({name: found[name] for name in LAWS if name in among}, start)


def check(law: str) -> None:
    """Refuse what is no name of a law."""
    if law not in LAWS:
        raise UnknownName("law of drift", law, LAWS)


def _chosen(found: Mapping[str, laws.Fit], start_s: float) -> Drift:
    """The law that explains the rest best, and by how much."""
    if not found:
        raise BadInput(f"no law of drift to choose from; expected some of {', '.join(LAWS)}")
    scores = {name: fit.bic() for name, fit in found.items()}
    name = min(scores, key=lambda name: scores[name])
    others = [f"{other} {scores[other] - scores[name]:.0f}" for other in scores if scores[other] > scores[name]]
    reason = f"BIC higher of {', '.join(others)}" if others else "no other explains it otherwise"
    return Drift(name, f"{LAWS[name]} ({reason})", start_s, found[name])


def _disturbed(time_s: Real, force_n: Real, settle_s: float) -> Bools:
    """Where something presses, did until just now, or where nobody knows."""
    pressing = ~(np.abs(force_n) < 0.1)
    last = np.maximum.accumulate(np.where(pressing, time_s, -np.inf))
    coming = np.minimum.accumulate(np.where(pressing, time_s, np.inf)[::-1])[::-1]
    return np.asarray((time_s - last < settle_s) | (coming - time_s < settle_s / 10))
