"""The reading at rest of a calibration, with which later readings at rest are compared.

Ratios to a fresh reading at rest do not depend on what has happened to R and C since, so that they show no broken
trace, no lifted edge and no other specimen: the reading at rest itself does.
"""

from dataclasses import dataclass
from math import expm1, hypot

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.prediction.calibration.fitting import Posterior, rest_gain
from sensorgen.prediction.calibration.specimen import SpecimenModel
from sensorgen.prediction.inference import parts, slopes
from sensorgen.prediction.inverse.verdict import chi2_limit

SESSION_C, SESSION_R = 0.01, 0.03  # standard deviations of ln C and ln R from one session to another: guesses, some K
_LEADS = {"lead": 10.0, "stray": 2e-13}  # ohm and farad by which leads that are connected anew differ: guesses
_METER = 1e-3  # of abs(Z): the bench reads the same from one session to another
_SURE = 3.0  # standard deviations


@dataclass(frozen=True)
class RestChange:
    """Difference of a reading at rest from the one of the calibration.

    Attributes
    ----------
    ln_c, ln_r : float
        Of ln of capacitance and of resistance [-].
    usual_c, usual_r : float
        Largest differences that another session may make, with the errors of these [-].
    other : bool
        Nothing but R, C and leads has changed.
    """

    ln_c: float
    ln_r: float
    usual_c: float
    usual_r: float
    other: bool

    def __bool__(self) -> bool:
        """The specimen is not what was calibrated."""
        return abs(self.ln_c) > self.usual_c or abs(self.ln_r) > self.usual_r or self.other

    @property
    def words(self) -> str:
        """The change, and its likely causes."""
        c, r = (f"{expm1(min(x, 5.0)):+.0%}" for x in (self.ln_c, self.ln_r))
        usual_c, usual_r = (f"{expm1(min(x, 5.0)):.0%}" for x in (self.usual_c, self.usual_r))
        if self.ln_c < -self.usual_c:
            cause = "a broken trace, a lifted edge or another specimen"
        elif self.ln_c > self.usual_c:
            cause = "a load or moisture on it, or another specimen"
        else:
            cause = "another specimen, a bad contact or a leak"
        return f"C {c} (usual: {usual_c}) and R {r} ({usual_r}) at rest since the calibration: {cause}"


class Baseline:
    """Reading at rest of a calibrated specimen.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    posterior : Posterior
        Of its calibration.
    gain : (m,) array, optional
        Ln of each tone's gain, by which the parameters and the reading at rest agree; None where the bench never read
        the specimen.
    """

    def __init__(self, model: SpecimenModel, posterior: Posterior, gain: Complex | None = None) -> None:
        at, m = posterior.at, len(model.frequency_hz)
        self._ln_z = model.rest(at) + (0.0 if gain is None else gain)
        by_parameter = slopes(lambda near: parts(model.rest(near)), at)

        def by(name: str) -> Real:
            return by_parameter[:, model.names.index(name)]

        leads = np.stack([by(name) * change / model.value(name, at) for name, change in _LEADS.items()], 1)
        self._weights = np.stack([by(name) / getattr(model.spread, name) for name in ("capacitance", "resistance")], 1)
        self._covariance = leads @ leads.T + _METER**2 * np.eye(2 * m)
        if gain is None:
            self._covariance += by_parameter @ posterior.covariance @ by_parameter.T + rest_gain(model)

    def change(self, z_ohm: Complex, noise: Real | float) -> RestChange:
        """Difference of a reading at rest.

        Parameters
        ----------
        z_ohm : (m,) array
            Mean reading with nothing on the sensor [ohm]; nan where none was measured.
        noise : (m,) array or float
            Standard deviation of its parts, relative [-].
        """
        kept = np.flatnonzero(np.tile(np.isfinite(z_ohm), 2))
        off = parts(np.log(z_ohm) - self._ln_z)[kept]
        covariance = self._covariance + np.diag(
            np.broadcast_to(np.tile(noise, 2 if np.ndim(noise) else 1), len(self._covariance)) ** 2
        )
        weights, inverse = self._weights[kept], np.linalg.inv(covariance[np.ix_(kept, kept)])
        variance = np.linalg.pinv(weights.T @ inverse @ weights)
        found = variance @ weights.T @ inverse @ off
        left = off - weights @ found
        usual_c, usual_r = (
            _SURE * hypot(session, float(variance[k, k]) ** 0.5) for k, session in enumerate((SESSION_C, SESSION_R))
        )
        other = float(left @ inverse @ left) > float(chi2_limit(np.array(max(len(kept) - 2, 0))))
        return RestChange(float(found[0]), float(found[1]), usual_c, usual_r, other)
