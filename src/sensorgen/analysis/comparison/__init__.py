"""Prediction of a specimen beside its measurements."""

from sensorgen.analysis.comparison.expected import Predicted, predicted
from sensorgen.analysis.comparison.specimens import Compared, Comparison, of_iteration

__all__ = ["Compared", "Comparison", "Predicted", "of_iteration", "predicted"]
