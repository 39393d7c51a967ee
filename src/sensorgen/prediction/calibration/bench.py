"""Bench on which specimens are pressed, and by how much they may differ there from their prediction."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import hypot, log
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.specimen import FORCES_N, SpecimenModel, Spread, spread_at
from sensorgen.prediction.inverse.verdict import NORMAL_90
from sensorgen.prediction.planning import sensor_model
from sensorgen.prediction.query import TONES_HZ, Query, Tip
from sensorgen.prediction.sensor_model import SensorModel

_SURE = 2 * NORMAL_90  # widths of a 90 % interval, in standard deviations


@dataclass(frozen=True)
class Bench:
    """Tip and force of the bench.

    Attributes
    ----------
    tip_m : float or None
        Length of the tip along the sensor [m]; the design's if None.
    force_offset_n : (float, float)
        Mean and standard deviation of what the sensor feels above the force that the rig says [N].
    block : mapping
        ``block`` and ``height_mm`` of the tip, in place of the design's.
    """

    tip_m: float | None = None
    force_offset_n: tuple[float, float] = (0.0, 0.1)
    block: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what is no tip and no deviation."""
        if not (self.tip_m is None or self.tip_m > 0) or not self.force_offset_n[1] > 0:
            raise BadInput(
                f"a tip of {(self.tip_m or 0.0) * 1e3:g} mm and an offset of {self.force_offset_n[0]:g} +- "
                f"{self.force_offset_n[1]:g} N; expected a length and a deviation above 0"
            )

    def tip(self, design: Design) -> Tip:
        """The tip that presses a design."""
        tip = design.tip.model_copy(update=dict(self.block)).tip()
        return tip if self.tip_m is None else replace(tip, length_m=self.tip_m)


def spread_of(predicted: SensorModel, bench: Bench) -> Spread:
    """Spread of the specimens of a design, from what its prediction leaves open."""
    mean, sd = bench.force_offset_n
    usual, c = spread_at(predicted.sensor), predicted.rest.capacitance
    ends = [np.log(end / r.value) for r in predicted.rest.resistance.values() for end in (r.lower, r.upper)]
    moduli = [v for v in predicted.values if v.quantity == "youngs_modulus_pa"]
    middle, by_print, by_print_shape = print_spread(predicted)
    return replace(
        usual, force_n=sd, force_offset_n=mean,
        resistance=max(usual.resistance, float(np.ptp(ends)) / _SURE) if ends else usual.resistance,
        capacitance=max(usual.capacitance, float(np.log(c.upper / c.lower)) / _SURE),
        law=hypot(usual.law if moduli else 2 * usual.law, by_print), law_middle=middle,
        law_shape=hypot(usual.law_shape, by_print_shape),
    )  # fmt: skip


def print_spread(predicted: SensorModel) -> tuple[float, float, float]:
    """Mean of ln of the rise by what is printed, and standard deviations as a whole and from force to force.

    The estimate of a print is one of several cells: electrodes between the least and the largest gap of the rules of
    slicers, the film thinner or thicker, and at best the cell as drawn. Between gaps the rise is taken to change with
    their square at most: the field over the gap, and the displacement of a film that gets thinner. All 0 for a drawing.
    """
    if predicted.body.is_drawn:
        return 0.0, 0.0, 0.0
    by_drawing = _ln_rise_as_drawn(predicted)
    ends = [0.0, *by_drawing.tolist()]
    cells = predicted.body.cells
    error, (first, *_) = cells.film.error_mm if cells.film else 0.0, cells.gap_mm.values()
    gaps = [gap for gap in cells.gap_mm.values() if error < gap < np.inf]
    if first in gaps:
        ends += [2 * log(first / end) for end in (min(gaps) - error, max(gaps) + error)]
    return (max(ends) + min(ends)) / 2, (max(ends) - min(ends)) / _SURE, float(np.ptp(by_drawing)) / _SURE


def _ln_rise_as_drawn(predicted: SensorModel) -> Real:
    """Ln of the rise of the cell as drawn over the predicted one, at forces that both laws know; 0 without a law."""
    sensor = predicted.sensor
    try:
        drawn = sensor_model(bodies.drawn(predicted.body.design), Query(tip=Tip(sensor.tip_m)))[0].sensor
    except SensorgenError:
        return np.zeros(1)
    models = [SpecimenModel(one, np.array(TONES_HZ), Spread()) for one in (drawn, sensor)]
    stress = np.minimum(np.array(FORCES_N) / (sensor.width_m * sensor.tip_m), min(one.most_pa for one in models))
    shares = [one.compression.capacitive_strain(stress)[0] for one in (drawn, sensor)]
    return np.asarray(np.subtract(*(np.log(share / (1 - share)) for share in shares)))
