"""Inverse problem: force and position from impedance, with covariance, or a status."""

from sensorgen.prediction.inverse.estimator import NOISE, Estimates, Estimator, estimate
from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N
from sensorgen.prediction.inverse.prior import Prior
from sensorgen.prediction.inverse.single import Press
from sensorgen.prediction.inverse.verdict import Status

__all__ = ["FORCE_LIMIT_N", "NOISE", "Estimates", "Estimator", "Press", "Prior", "Status", "estimate"]
