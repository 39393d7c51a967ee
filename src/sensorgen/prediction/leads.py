"""Leads, contacts and the fringe at the edge: what a meter reads beside the sensor, as ranges."""

from typing import NamedTuple

from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import lead_ranges, permittivities
from sensorgen.models.fringe import edge_fringe_f
from sensorgen.scene.slabs import is_open


class Added(NamedTuple):
    """Value, least and most of what is added to a sensor."""

    value: float
    least: float
    most: float


def added(body: Body) -> tuple[Added, Added]:
    """Capacitance in parallel [F], with the fringe of equal plates at most, and resistance in series [ohm].

    Raises
    ------
    MissingValue
        No source gives a permittivity or resistivity.
    """
    farad, ohm = (Added(*of) for of in lead_ranges(body.design))
    p, gap_mm = body.design.params, next(iter(body.cells.gap_mm.values()), 0.0)
    if is_open(body.cells.first()) or not 0 < gap_mm < p.width_mm:
        return farad, ohm  # electrodes whose fringe is in the capacitance already
    eps = max(value.value for value in permittivities(body.design))
    around, gap, across, high = (
        s * M_PER_MM for s in (2 * (p.length_mm + p.width_mm), gap_mm, p.width_mm, p.electrode_mm)
    )
    return farad._replace(most=farad.most + edge_fringe_f(around, gap, across, high, eps)), ohm
