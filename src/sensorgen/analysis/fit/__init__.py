"""Material values out of what was measured, as a new source that the next prediction can take."""

from sensorgen.analysis.fit.fitting import STEPS, fit
from sensorgen.analysis.fit.results import Error, Fit, Fitted, Untold, text

__all__ = ["STEPS", "Error", "Fit", "Fitted", "Untold", "fit", "text"]
