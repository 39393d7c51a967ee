r"""Drift of the elastomer: fitted to the rest between presses, and removed.

Without load, ln Z drifts by

.. math:: \ln Z(t) = a_0 + \sum_i a_i b_i(t) + \sum_k c_k \int_0^t F(s)\, e^{-(t - s)/\tau_k} \frac{ds}{\tau_k} + w(t)

with functions b of time alone, relaxation after earlier presses, and a random walk w: see
:mod:`sensorgen.measure.signal.laws`. Each law has some of these terms; the law with the least Schwarz criterion (BIC)
is used. The fit is made in ln Z because creep of the permittivity multiplies Z, and is removed from the pressed
readings too.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.measure.recording.samples import Bools, Complex, Real
from sensorgen.measure.signal import laws

SETTLE_S = 1.0
LAWS = {
    "line": "a straight line over time",
    "smooth": "a cubic and five logarithms of time",
    "memory": "smooth, and relaxation after earlier presses",
    "wandering": "smooth, and a random walk from rest to rest",
    "memory+wandering": "smooth, relaxation after earlier presses, and a random walk from rest to rest",
}
"""Laws of drift, and their terms."""

BY_TIME = ("line", "smooth", "wandering")
"""Laws that need no force."""

_LEAST = 100
_BLOCK = 1 << 14  # samples whose drift is removed at once


@dataclass(frozen=True, eq=False)
class Drift:
    """Drift at rest.

    Attributes
    ----------
    law : str
        Of :data:`LAWS`.
    reason : str
        Reason for the law.
    start_s : float
        Time of the first reading [s].
    fit : LawFit
        ln Z at rest, at any time.
    """

    law: str
    reason: str
    start_s: float
    fit: laws.LawFit

    def at(self, time_s: Real) -> Complex:
        """Drift of ln Z since the first reading, at any times [s] (n, m) [-]."""
        return np.asarray(self.fit.at(time_s) - self.fit.at(np.array([self.start_s])))

    def removed(self, time_s: Real, impedance_ohm: Complex) -> Complex:
        """Readings without drift [ohm]."""
        found = np.empty_like(impedance_ohm)
        for k in range(0, len(time_s), _BLOCK):
            at = slice(k, k + _BLOCK)
            found[at] = impedance_ohm[at] * np.exp(-self.at(time_s[at]))
        return found

    def rest_ohm(self) -> Complex:
        """Impedance at rest at the first reading (m,) [ohm]."""
        return np.asarray(np.exp(self.fit.at(np.array([self.start_s]))[0]))


def fitted(
    time_s: Real, impedance_ohm: Complex, valid: Bools, force_n: Real, settle_s: float = SETTLE_S,
    among: Collection[str] = tuple(LAWS),
) -> Drift:  # fmt: skip
    """Fit the drift to the rest between presses.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings [ohm].
    valid : (n,) array of bool
        Valid readings.
    force_n : (n,) array
        Force; the sensor rests where it has been below 0.1 N for ``settle_s`` [N].
    settle_s : float
        Time to recover after a press [s].
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
    if not among:
        raise BadInput(f"no law of drift to choose from; expected some of {', '.join(LAWS)}")
    rest = valid & ~_disturbed(time_s, force_n, settle_s)
    if np.count_nonzero(rest) < _LEAST:
        raise BadInput(f"{np.count_nonzero(rest)} readings at rest; expected {_LEAST} or more to fit a drift to")
    start = float(time_s[0])
    columns = (column[rest] for column in impedance_ohm.T)  # one by one, to save memory
    each = [laws.binned(time_s[rest], (np.log(np.abs(z)) + 1j * np.unwrap(np.angle(z)))[:, None]) for z in columns]
    bins = replace(each[0], values=np.hstack([of.values for of in each]))
    seconds = max(float(time_s[-1]) - start, 1e-9)
    smooth = laws.explained(bins, (laws.smooth(start, seconds),))
    fits = {"line": laws.explained(bins, (laws.linear(start, seconds),)), "smooth": smooth}
    if any("memory" in name for name in among):
        fits["memory"] = laws.relaxing(bins, smooth, time_s, force_n, settle_s / 2)
    for name in among:
        if "wandering" in name:
            fits[name] = laws.wandering(bins, fits["memory" if "memory" in name else "smooth"])
    scores = {name: fits[name].bic() for name in LAWS if name in among}
    best = min(scores, key=lambda name: scores[name])
    others = [f"{other} {scores[other] - scores[best]:.0f}" for other in scores if scores[other] > scores[best]]
    reason = f"BIC higher of {', '.join(others)}" if others else "the only law"
    return Drift(best, f"{LAWS[best]} ({reason})", start, fits[best])


def check(law: str) -> None:
    """Refuse an unknown law."""
    if law not in LAWS:
        raise UnknownName("law of drift", law, LAWS)


def _disturbed(time_s: Real, force_n: Real, settle_s: float) -> Bools:
    """Samples under a press or just after one, or with an unknown force."""
    pressing = ~(np.abs(force_n) < 0.1)
    last = np.maximum.accumulate(np.where(pressing, time_s, -np.inf))
    coming = np.minimum.accumulate(np.where(pressing, time_s, np.inf)[::-1])[::-1]
    return np.asarray((time_s - last < settle_s) | (coming - time_s < settle_s / 10))
