"""Inversion of one reading, that of the first line of :mod:`sensorgen.verification.chart.lines`, known to 17 digits.

The error is the larger one of force, as a share of it, and position, as a share of the sensor's length.
"""

from functools import cache

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inverse.estimator import Estimator
from sensorgen.verification.chart import lines
from sensorgen.verification.chart.measured import DIGITS, ChartPoint, climbed

ASKED = "force and position from an impedance"
_LINE = lines.STANDARD["line, seven tones"]
_TONES = np.array(list(_LINE.known))
_READING = np.array(list(_LINE.known.values()))
_LENGTH_M, _TIP_M = lines.PLATE["length_m"], lines.PLATE["tip_m"]

STANDARD = {"inversion of a load": (_LINE.force_n, lines.PLATE["left_m"] + _TIP_M / 2)}  # [N], centre [m]

Press = tuple[float, float]


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure the inversion; what is prepared once for a sensor is not in its time.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        Of no effect: it is asked once [s].
    """
    force, position = STANDARD[name]

    def judge(press: Press) -> tuple[float, str]:
        off = abs(press[0] / force - 1), abs(press[1] - position) / _LENGTH_M
        return max(*off, DIGITS), f"{press[0]:.6g} N at {1e3 * press[1]:.6g} mm"

    def sought() -> Press:
        inverted = _estimator().one(_READING)
        return inverted.force_n, inverted.position_m

    return list(climbed(name, [("invert: seven tones", [("", sought)])], judge, budget_s))


def why_not_applicable(_: str) -> dict[str, str]:
    """Why models of the line are not asked: only what turns around is."""
    return {}


@cache
def _estimator() -> Estimator:
    p = lines.PLATE
    film = EPS0_F_PER_M * p["eps_r"] * p["width_m"] / p["film_m"]
    high, rho = ((p[f"top_{of}"], p[f"bottom_{of}"]) for of in ("thickness_m", "resistivity_ohm_m"))
    law = compression.unconfined(p["modulus_pa"])
    return Estimator(Sensor(_LENGTH_M, p["width_m"], high, rho, film, law, _TIP_M), _TONES)
