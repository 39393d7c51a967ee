"""What a design should measure: the earliest prediction in the log, else one that is made now and named so."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import geometric_mean

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.version import __version__
from sensorgen.design.body import Body
from sensorgen.measure import log
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Prediction, from_json


@dataclass(frozen=True)
class Predicted:
    """A prediction and where it comes from.

    Attributes
    ----------
    design, design_id : str
        Name and identity of the design.
    prediction : Prediction
        Of the print, unless it was stored by an older version.
    stored_at : str
        When the log stored it, UTC; "" where it was made now, after the measurement.
    version : str
        Of sensorgen, which made it.
    """

    design: str
    design_id: str
    prediction: Prediction
    stored_at: str
    version: str

    @cached_property
    def ry_ohm(self) -> Bounds | None:
        """Along one electrode [ohm]: the geometric mean of all, as the readings do not say which was measured.

        The range is that of the best and the worst, with the errors of models, print and materials; None where no
        resistance is predicted.
        """
        ends = self.prediction.resistance.values()
        if not ends:
            return None
        low, high = min(r.lower for r in ends), max(r.upper for r in ends)
        model, by_print, material = (
            Interval(min(part.lower for part in of), max(part.upper for part in of))
            for of in zip(*((r.model, r.print, r.material) for r in ends), strict=True)
        )
        return Bounds(geometric_mean(r.value for r in ends), low, high, "ohm", model, by_print, material)

    @property
    def capacitance_f(self) -> Interval | None:
        """Between the electrodes, with the errors of models, print and materials [F]; None where none is predicted."""
        c = self.prediction.capacitance
        return Interval(c.lower, c.upper) if c else None

    @cached_property
    def touches(self) -> bool:
        """Whether the electrodes touch as drawn, so that the film is a short by design."""
        return (self.prediction.drawn or self.prediction).status == "short"

    @property
    def reason(self) -> str:
        """Why there is no capacitance."""
        return self.prediction.reason

    @property
    def provenance(self) -> str:
        """Where the prediction comes from, in words."""
        if self.stored_at:
            return f"stored {self.stored_at} by sensorgen {self.version}"
        return f"made afterwards by sensorgen {self.version}: none was stored before"


def predicted(body: Body, stored: Sequence[log.Prediction] = ()) -> Predicted:
    """The earliest prediction that the log has of a body's design, else one that is made now.

    Parameters
    ----------
    body : Body
        That was measured.
    stored : sequence of log.Prediction
        The log's predictions of this very design.
    """
    design = body.design
    first = min(stored, key=lambda p: p.number, default=None)
    if first:
        return Predicted(design.name, design.id(), from_json(first.data), first.logged_at, first.version)
    return Predicted(design.name, design.id(), evaluate(body), "", __version__)
