"""Models of the pressed line on a plate whose impedance is known to 17 digits, and the inversion of such an impedance.

One press is that of a round tip (Hertz's ellipse of pressure); what models of a flat tip are off is what it counts.
The error is the larger one of abs(Z) and of Re Z by itself, at the worst frequency: Re Z, which holds the position, is
a thousandth of abs(Z) at low tones, and is lost first. That of the inversion is the larger one of force, as a share of
it, and position, as a share of the sensor's length.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inverse.estimator import Estimator
from sensorgen.solvers.line.inputs import PressedLine
from sensorgen.verification import line_models, peers
from sensorgen.verification.chart import design
from sensorgen.verification.chart.results import DIGITS, OWN, Question, Series, Values, of_line, of_scene, own

# The plate of Table 3.1, pressed in its middle.
PLATE = {
    "length_m": 0.1,
    "width_m": 0.01,
    "top_thickness_m": 3e-4,
    "bottom_thickness_m": 3e-4,
    "top_resistivity_ohm_m": 0.07,
    "bottom_resistivity_ohm_m": 0.2,
    "film_m": 6e-4,
    "eps_r": 4.68,
    "modulus_pa": 6e6,
    "tip_m": 0.01,
    "left_m": 0.045,
}


@dataclass(frozen=True)
class KnownPlatePress:
    """A press on the plate.

    Attributes
    ----------
    known : dict of float to complex
        Impedance [ohm] by frequency [Hz]: transfer matrices in 60 digits; under a round tip a Taylor series in 30.
    force_n : float
        On the tip [N].
    profile : str
        How its pressure is spread.
    """

    known: dict[float, complex]
    force_n: float = 3.0
    profile: str = "uniform"

    def line(self) -> PressedLine:
        """Inputs of models of a flat tip."""
        return PressedLine(**PLATE, force_n=self.force_n, frequency_hz=np.array(list(self.known)))


STANDARD = {
    "line, seven tones": KnownPlatePress({
        1.1e3: 3000.3727298841273 - 2093949.0417808136j,
        2.3e3: 3000.3715445141763 - 1001455.2752495972j,
        5.3e3: 3000.3649204154106 - 434597.15912340827j,
        10.1e3: 3000.3434447099399 - 228061.65201439313j,
        19.9e3: 3000.2580348134131 - 115761.42355379636j,
        49.9e3: 2999.64993089581 - 46198.143984803854j,
        99.7e3: 2997.4895813800539 - 23180.507246802561j,
    }),
    "line, 1 mHz to 100 MHz": KnownPlatePress({
        1e-3: 3000.3730814279532 - 2303343000759.7946j,
        1.0: 3000.3730814276627 - 2303343000.7605758j,
        1e6: 2748.5461764976843 - 2986.339472756103j,
        1e8: 322.02875456248957 - 322.02875461574191j,
    }),
    "line under a round tip, 60 N": KnownPlatePress({
        1.1e3: 3008.3362535807886 - 2071759.8206417623j,
        2.3e3: 3008.3350669899552 - 990843.04192650195j,
        5.3e3: 3008.3284360686263 - 429991.85729211865j,
        10.1e3: 3008.3069382438599 - 225645.02033600015j,
        19.9e3: 3008.2214403754716 - 114534.91583195183j,
        49.9e3: 3007.6127100033606 - 45709.083630459323j,
        99.7e3: 3005.4501333850121 - 22935.852798041187j,
    }, 60.0, "hertz"),
}  # fmt: skip

_PIECES = (1, 4, 16, 64, 256)  # of a tip


def question(name: str) -> Question:
    """Impedance of a pressed line, by every model of it and by programs of others [ohm]."""
    standard, pressure = STANDARD[name], "a flat tip presses evenly"
    levels: dict[str, Any] = dict(line_models.LEVELS)
    refused = {program: why for program in line_models.PROGRAMS if (why := peers.missing(program))}
    if standard.profile != "uniform":
        levels["line_tip"] = [{"pieces": n, "profile": standard.profile} for n in _PIECES]
        refused = dict.fromkeys(line_models.PROGRAMS, "its tip is flat")
        pressure = "it cuts the tip into the pieces of line_tip"
    series = (
        Series("pressure", OWN, (), pressure),
        *design.lines(standard.line(), levels, lambda model: refused.get(model, "")),
    )
    known = list(standard.known.values())
    return of_scene(name, "the impedance of a pressed line", series, known, DIGITS, of_line)


_LINE = STANDARD["line, seven tones"]
_TONES = np.array(list(_LINE.known))
_READING = np.array(list(_LINE.known.values()))
_LENGTH_M, _TIP_M = PLATE["length_m"], PLATE["tip_m"]

INVERSION = {"inversion of a load": (_LINE.force_n, PLATE["left_m"] + _TIP_M / 2)}  # [N], centre [m]


def inversion(name: str) -> Question:
    """Force and position of a press [N], [m]; what is prepared once for a sensor is not in its time."""

    def sought() -> list[float]:
        inverted = _estimator().batch(_READING[None])
        return [float(inverted.force_n[0]), float(inverted.position_m[0])]

    series = own([("invert: seven tones", [("", sought)])], {})
    return of_scene(name, "force and position from an impedance", series, INVERSION[name], DIGITS, _of_press)


def _of_press(answer: Values, known: Values) -> float:
    """Larger one of force, as a share of it, and position, as a share of the sensor's length [-]."""
    return max(abs(answer[0] / known[0] - 1), abs(answer[1] - known[1]) / _LENGTH_M)


@cache
def _estimator() -> Estimator:
    p = PLATE
    film = EPS0_F_PER_M * p["eps_r"] * p["width_m"] / p["film_m"]
    high, rho = ((p[f"top_{of}"], p[f"bottom_{of}"]) for of in ("thickness_m", "resistivity_ohm_m"))
    law = compression.unconfined(p["modulus_pa"])
    return Estimator(Sensor(_LENGTH_M, p["width_m"], high, rho, film, law, _TIP_M), _TONES)
