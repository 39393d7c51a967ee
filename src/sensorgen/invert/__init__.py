"""Force and position back from impedance, with covariance, or the word why not."""

from sensorgen.invert.estimator import NOISE, Estimates, Estimator, estimate
from sensorgen.invert.forward import FORCE_LIMIT_N
from sensorgen.invert.prior import Prior
from sensorgen.invert.single import Press
from sensorgen.invert.verdict import Status

__all__ = ["FORCE_LIMIT_N", "NOISE", "Estimates", "Estimator", "Press", "Prior", "Status", "estimate"]
