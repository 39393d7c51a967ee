"""What was predicted of a specimen beside what was measured of it."""

from sensorgen.comparison.expected import Predicted, predicted
from sensorgen.comparison.specimens import Compared, Comparison, of_iteration

__all__ = ["Compared", "Comparison", "Predicted", "of_iteration", "predicted"]
