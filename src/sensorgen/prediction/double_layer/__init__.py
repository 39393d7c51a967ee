"""Double sensors: information of a second film, and the effect of a touching body with and without isolation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue
from sensorgen.models.stack import Body
from sensorgen.prediction.double_layer.designs import press_at, stacked
from sensorgen.prediction.double_layer.differencing import ReadingErrors, bounds
from sensorgen.prediction.double_layer.touching import WIRINGS, Touching, TouchResult
from sensorgen.prediction.query import TIP_M

__all__ = ["FilmReadings", "ReadingErrors", "StackStudy", "TouchResult", "study"]

_ASSUMPTIONS = (
    "both films carry the same force, the lower one spread no wider; bending is neglected",
    "double: the third electrode floats while the other two are read",
    "touch: 1.5 kohm of skin and 100 pF to ground (human body model, ANSI/ESDA/JEDEC JS-001)",
    "touch: the isolation has its full thickness under the body, without fringe",
)


@dataclass(frozen=True)
class FilmReadings:
    """Impedances of the lower and the upper film at one frequency [Hz], real and imaginary parts [ohm]."""

    frequency_hz: float
    lower_re: float
    lower_im: float
    upper_re: float
    upper_im: float


@dataclass(frozen=True)
class StackStudy:
    """A design as a stack.

    Attributes
    ----------
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    noise, drift : float
        Of a reading, relative to its modulus; of the films' permittivity, relative [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    readings_ohm : tuple of FilmReadings
        Under the press, per frequency.
    bounds : tuple of ReadingErrors
        Standard errors of force and position per way of reading.
    press_shift : float
        Largest relative change of the reading by the press [-].
    touch : tuple of TouchResult
        Effect of a touch, per wiring.
    values : tuple of MaterialValue
        Material values used.
    doubts, assumptions : tuple of str
        Why the numbers are uncertain, and what they assume.
    """

    force_n: float
    position_m: float
    noise: float
    drift: float
    within_n: float
    readings_ohm: tuple[FilmReadings, ...]
    bounds: tuple[ReadingErrors, ...]
    press_shift: float
    touch: tuple[TouchResult, ...]
    values: tuple[MaterialValue, ...]
    doubts: tuple[str, ...]
    assumptions: tuple[str, ...] = _ASSUMPTIONS


def study(
    design: Design, frequency_hz: Sequence[float], force_n: float, position_m: float | None, noise: float, drift: float,
    within_n: float, law: str = "", tip_m: float = TIP_M,
) -> StackStudy:  # fmt: skip
    """Evaluate a design as a stack.

    Parameters
    ----------
    design : Design
        Double, or any other: it is then stacked twice.
    frequency_hz : sequence of float
        Frequencies of the readings [Hz].
    force_n, position_m : float
        The press: force [N], centre of the tip [m]; the middle of the sensor where None.
    noise : float
        Relative noise of a reading [-].
    drift : float
        Relative drift of the films' permittivity [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    law, tip_m : str, float
        Law of compression; length of the tip and of the touch [m].

    Raises
    ------
    SensorgenError
        As :func:`stacked` and :func:`press_at`.
    """
    found = stacked(design, law, tip_m)
    press, frequency = press_at(found, force_n, position_m), np.asarray(frequency_hz, float)
    z = found.double.impedance(frequency, press)
    touching = Touching(found.own, found.isolation_eps_r, frequency, press, noise, Body())
    return StackStudy(
        force_n, float(np.asarray(press.left_m)) + tip_m / 2, noise, drift, within_n,
        tuple(
            FilmReadings(float(f), *(float(part) for k in (0, 1) for part in (m[k, k].real, m[k, k].imag)))
            for f, m in zip(frequency, z, strict=True)
        ),
        bounds(found.double, frequency, press, noise, drift), touching.press_shift(),
        tuple(touching.result(wiring, within_n, design.params.isolation_mm) for wiring in WIRINGS),
        found.taken, found.doubts,
    )  # fmt: skip
