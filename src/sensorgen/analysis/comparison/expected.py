"""What a design should measure: the earliest prediction in the log, else one that is made now and named so."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import log
from statistics import geometric_mean

import numpy as np

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import BadInput
from sensorgen.core.version import __version__
from sensorgen.design.body import Body
from sensorgen.measure.log import Entry, Log, Withdrawal
from sensorgen.measure.log import Prediction as Stored
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
    before : bool or None
        Whether it was stored before every reading and recording, by the order of the log's records; None where that
        proves nothing.
    order : str
        Its place in that order, in words.
    """

    design: str
    design_id: str
    prediction: Prediction
    stored_at: str
    version: str
    before: bool | None = False
    order: str = ""

    @cached_property
    def ry_ohm(self) -> Bounds | None:
        """Along one electrode [ohm]: the geometric mean of all, as the readings do not say which was measured.

        The range is that of the best and the worst, with the errors of models, print and materials; None where no
        resistance is predicted.
        """
        with_leads = self.prediction.resistance.values()
        if not with_leads:
            return None
        ends = list(map(Bounds.alone, with_leads))
        low, high = min(r.lower for r in ends), max(r.upper for r in ends)
        model, by_print, material = (
            Interval(min(part.lower for part in of), max(part.upper for part in of))
            for of in zip(*((r.model, r.print, r.material) for r in ends), strict=True)
        )
        alone = Bounds(geometric_mean(r.value for r in ends), low, high, "ohm", model, by_print, material)
        return alone.plus(0.0, 0.0, max(r.upper for r in with_leads) - high)

    @property
    def capacitance_f(self) -> Interval | None:
        """Between the electrodes, with the errors of models, print and materials [F]; None where none is predicted."""
        c = self.prediction.capacitance
        return Interval(c.lower, c.upper) if c else None

    @cached_property
    def touches(self) -> bool:
        """Whether the electrodes touch as printed, so that the film is a short by design."""
        return self.prediction.status == "short"

    @property
    def parted(self) -> bool:
        """Whether the electrodes touch as drawn, but have a gap as printed."""
        return self.prediction.drawn is not None and self.prediction.drawn.status == "short" and not self.touches

    def impedance_at(self, frequency_hz: float) -> tuple[complex, complex, complex] | None:
        """Predicted Z, and the ends of its range, R and -X at their least and at their largest [ohm].

        Power laws between the predicted frequencies, and below the lowest; None above the highest, where the
        line's far end drops out, and of what is no capacitor.
        """
        known = self.prediction.impedance
        if len(known) < 2 or frequency_hz > known[-1].frequency_hz * (1 + 1e-9):
            return None
        ln_f = np.log([one.frequency_hz for one in known])
        at = min(max(int(np.searchsorted(ln_f, log(frequency_hz))), 1), len(known) - 1)
        share = (log(frequency_hz) - ln_f[at - 1]) / (ln_f[at] - ln_f[at - 1])

        def part(values: Sequence[float]) -> float:
            low, high = values[at - 1], values[at]
            return float(low * (high / low) ** share if low * high > 0 else low + (high - low) * share)

        ends = [
            complex(part([getattr(one.re, r) for one in known]), part([getattr(one.im, x) for one in known]))
            for r, x in (("value", "value"), ("lower", "upper"), ("upper", "lower"))
        ]  # fmt: skip
        return (ends[0], ends[1], ends[2]) if ends[0].imag < 0 else None

    @property
    def reason(self) -> str:
        """Why there is no capacitance."""
        return self.prediction.reason

    @property
    def provenance(self) -> str:
        """Where the prediction comes from, in words."""
        if self.stored_at:
            return f"stored {self.stored_at} by sensorgen {self.version}; {self.order}"
        return f"made afterwards by sensorgen {self.version}: none was stored before"


def predicted(body: Body) -> Predicted:
    """A prediction that is made now."""
    return Predicted(body.design.name, body.design.id(), evaluate(body), "", __version__)


def stored_or_made(
    body: Body, log: Log, stored: Sequence[Stored], measured: Sequence[Entry], left_out: list[tuple[str, str]]
) -> Predicted:
    """The earliest prediction that the log has of a body's design, else one that is made now.

    Parameters
    ----------
    body : Body
        That was measured.
    log : Log
        An open one.
    stored : sequence of Stored
        The log's predictions of this very design, withdrawn ones too.
    measured : sequence of Entry
        Readings and recordings of it.
    left_out : list of (str, str)
        Grows by predictions that were withdrawn or cannot be read, and why.
    """
    for first in sorted(stored, key=lambda p: p.number):
        try:
            found = from_json(first.data)
            why = next((row.reason for row in log.superseding(first) if isinstance(row, Withdrawal)), "")
        except BadInput as error:
            why = str(error)
        if why:
            left_out.append((f"prediction {first.number} of {first.design}", why))
            continue
        before = log.before(first, measured)
        order = {
            True: "before anything was measured",
            False: "AFTER something was measured",
            None: "before or after the measurement only by clocks",
        }[before]
        place = f"record {log.record_of(first)[0]} of the log, {order}"
        if proof := log.anchored(first):
            anchor, later = proof
            place += f"; anchored {anchor.logged_at} in {anchor.file}"
            place += f", {later} record{'s' * (later > 1)} later" if later else ""
        return Predicted(body.design.name, body.design.id(), found, first.logged_at, first.version, before, place)
    return predicted(body)
