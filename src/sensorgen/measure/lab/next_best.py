"""Choose presses during a run by what each is expected to tell: by a model of the specimen and all presses so far."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.lab.experiment import Next
from sensorgen.measure.lab.plans import Choice, DonePress
from sensorgen.prediction.calibration.fitting import NOISE, Data, Posterior, by_rest, calibrated
from sensorgen.prediction.calibration.next_press import NextPress, PossiblePresses
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel, unknown

_LEAST = 3e-4  # relative error of a mean at rest: from one place and time to the next it differs by more than noise
_SHORTEST_S = 0.1  # of a hold: its logarithm counts
_WIDTH = 2 * 1.959963984540054  # of a 95 % interval, in standard deviations
_OF = {"resistance": "resistance", "capacitance": "capacitance", "rise": "law"}  # parameter, and its spread


@dataclass(frozen=True, eq=False)
class ByModel:
    """The choice by a specimen's model; a :data:`sensorgen.measure.lab.plans.NextPress`.

    Attributes
    ----------
    model : SpecimenModel
        Of the specimen, for the tones of the run.
    """

    model: SpecimenModel

    def __call__(self, part: Next, pressed: Sequence[DonePress], rest_ohm: Complex) -> Choice:
        """The best next press.

        Parameters
        ----------
        part : Next
            With the places that are possible.
        pressed : sequence of DonePress
            All so far.
        rest_ohm : (m,) array
            The latest mean at rest [ohm].

        Raises
        ------
        BadInput
            No reading at rest, or a part without places.
        """
        if not np.isfinite(rest_ohm).all() or part.position_mm is None:
            raise BadInput("the next press needs a reading at rest, and places that are possible")
        known = self._known(pressed, rest_ohm)
        low, high = part.position_mm
        within = PossiblePresses(part.force_n, (low * M_PER_MM, high * M_PER_MM), part.hold_s)
        noise = np.median([press.noise for press in pressed], axis=0) if pressed else np.full(len(rest_ohm), NOISE)
        best = NextPress(self.model, within, np.maximum(noise, _LEAST), part.aim).best(known)
        interval = self._interval(known) if pressed else inf
        place = round(best.position_m / M_PER_MM, 3)
        return Choice(round(best.force_n, 3), place, round(best.peak_n, 3), round(best.hold_s, 3), interval)

    def predicted(self, force_n: float, place_mm: float, rest_ohm: Complex) -> Complex:
        """Expected impedances under a press, by the design and what was read at rest before it (m,) [ohm]."""
        press = unknown(np.array([force_n]), np.array([place_mm * M_PER_MM]))
        return np.asarray(rest_ohm * np.exp(self.model.ratio(np.zeros(len(self.model.names)), press)[0]))

    def _known(self, pressed: Sequence[DonePress], rest_ohm: Complex) -> Posterior:
        if not pressed:
            return by_rest(self.model, np.log(rest_ohm), _LEAST, NOISE)
        steps = [press.step for press in pressed]
        force, peak = (np.array([getattr(step, name) for step in steps]) for name in ("force_n", "peak_n"))
        place, hold = (np.array([getattr(step, name) for step in steps]) for name in ("place_mm", "hold_s"))
        presses = Presses(
            force, place * M_PER_MM, 1 - force / np.maximum(peak, force), np.log10(np.maximum(hold, _SHORTEST_S))
        )
        rest = np.log([press.before_ohm for press in pressed])
        ratio = np.log([press.pressed_ohm for press in pressed]) - rest
        noise: Real = np.maximum([press.noise for press in pressed], _LEAST)
        return calibrated(self.model, Data(presses, ratio, noise, rest.mean(axis=0), np.full(rest.shape[1], _LEAST)))

    def _interval(self, known: Posterior) -> float:
        """Widest 95 % interval of resistance, capacitance and the rise under load, relative [-]."""
        sd = np.sqrt(np.diag(known.covariance))
        widths = (
            _WIDTH * float(sd[self.model.names.index(name)]) * getattr(self.model.spread, spread)
            for name, spread in _OF.items()
        )
        return float(max(widths))
