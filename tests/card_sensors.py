"""Sensors whose identifiability is known: the thesis's plate, free or bonded, and a cell of triangles."""

from dataclasses import replace

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability.fisher import Setup
from sensorgen.prediction.query import TONES_HZ

# Table 3.1: 100 x 10 mm, H 0.3 mm, h 0.6 mm, eps 4.68, E 6 MPa; electrodes of Table C.1
PLATE = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.07, 0.2), EPS0_F_PER_M * 4.68 * 0.01 / 6e-4, compression.unconfined(6e6))
BONDED = replace(PLATE, compression=compression.bonded(6e6, 0.01, 6e-4))
CAPACITOR = replace(PLATE, resistivity_ohm_m=(0.0, 0.0))
_CELL = {"dielectric_mm": 0.1, "period_mm": 2.0, "hang_height_mm": 0.5, "lower_height_mm": 0.24}
TRI = replace(  # the same outline over a cell of triangles: 79.8 pF unloaded
    PLATE, capacitance_f_per_m=798.26e-12, compression=compression.solved("tri", _CELL, {"x60": 6e6, "etpu": 22e6})
)


def of_resistivity(sensor: Sensor, rho: float) -> Sensor:
    """A sensor with both electrodes of one resistivity [ohm m]."""
    return replace(sensor, resistivity_ohm_m=(rho, rho))


def setup(sensor: Sensor = PLATE, tones=TONES_HZ, noise=1e-3, force=6.0, place=0.05) -> Setup:
    return Setup(sensor, tuple(tones), noise, force, place)
