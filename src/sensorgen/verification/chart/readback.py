"""Ways back from impedance to the press: force and position that one reading gives.

The reading is that of the first line of :mod:`sensorgen.verification.chart.lines`, known to 17 digits. The error is
the larger one
of force, as a share of it, and position, as a share of the sensor's length.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression, line, line_fit
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inverse import Estimator
from sensorgen.verification.chart import lines
from sensorgen.verification.chart.measured import DIGITS, Ladder, Point, climbed

ASKED = "force and position from an impedance"
_LINE = lines.STANDARD["line, seven tones"]
_TONES = np.array(list(_LINE.known))
_READING = np.array(list(_LINE.known.values()))
_FIT_HZ, _FIT = 10.1e3, 3  # tone of the thesis's fit, and its place among all
_LENGTH_M, _TIP_M = lines.PLATE["length_m"], lines.PLATE["tip_m"]

STANDARD = {"inversion of a load": (_LINE.force_n, lines.PLATE["left_m"] + _TIP_M / 2)}  # [N], centre [m]

Press = tuple[float, float]


def points(name: str, budget_s: float) -> list[Point]:
    """Measure every inversion; what is prepared once for a sensor is not in its time.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        Of no effect: each inversion is asked once [s].
    """
    force, position = STANDARD[name]

    def judge(found: Press) -> tuple[float, str]:
        off = abs(found[0] / force - 1), abs(found[1] - position) / _LENGTH_M
        return max(*off, DIGITS), f"{found[0]:.6g} N at {1e3 * found[1]:.6g} mm"

    def by_fit(form: str) -> Press:
        found = _fitted(form).presses(*line_fit.series(_FIT_HZ, _READING[[_FIT]]))
        return float(found.force_n[0]), float(found.choice(_LENGTH_M)[0])

    def as_printed() -> Press:
        c, fit = line_fit.series(_FIT_HZ, _READING[[_FIT]])[0], _fitted("printed")
        return float(fit.force_n(c)[0]), float(fit.printed_position_m(c)[0])

    def sought() -> Press:
        found = _estimator().one(_READING)
        return found.force_n, found.position_m

    ladders: list[Ladder] = [
        *((f"line_fit: {form}", [("", partial(by_fit, form))]) for form in line_fit.FORMS),
        ("line_fit: C.5 as printed", [("", as_printed)]),
        ("invert: seven tones", [("", sought)]),
    ]
    return list(climbed(name, ladders, judge, budget_s))


def why_not_applicable(_: str) -> dict[str, str]:
    """Why models of the line are not asked: only what turns around is."""
    return {}


@cache
def _fitted(form: str) -> line_fit.LineFit:
    """The fit to presses all over the plate, by the line's own model."""
    force, x = (a.ravel() for a in np.meshgrid(np.linspace(1, 6, 6), np.linspace(0, _LENGTH_M - _TIP_M, 10)))
    z = line.impedance(replace(line.PressedLine(**lines.PLATE, frequency_hz=_FIT_HZ), force_n=force, left_m=x))
    return line_fit.fit(force, x + _TIP_M / 2, *line_fit.series(_FIT_HZ, z), form)


@cache
def _estimator() -> Estimator:
    p = lines.PLATE
    film = EPS0_F_PER_M * p["eps_r"] * p["width_m"] / p["film_m"]
    high, rho = ((p[f"top_{of}"], p[f"bottom_{of}"]) for of in ("thickness_m", "resistivity_ohm_m"))
    law = compression.unconfined(p["modulus_pa"])
    return Estimator(Sensor(_LENGTH_M, p["width_m"], high, rho, film, law, _TIP_M), _TONES)
