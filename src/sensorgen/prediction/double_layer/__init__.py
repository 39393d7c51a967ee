"""A design as a stack: what a second film tells that one does not, and what a touch does to a reading."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.design import Design
from sensorgen.models.stack import Body
from sensorgen.prediction.double_layer.designs import press_at, stacked
from sensorgen.prediction.double_layer.differencing import bounds
from sensorgen.prediction.double_layer.touching import WIRINGS, Touching, table
from sensorgen.prediction.sensor_model import TIP_M

Complex = NDArray[np.complex128]


def study(
    design: Design, frequency_hz: Sequence[float], force_n: float, position_m: float | None, noise: float, drift: float,
    within_n: float, law: str = "", tip_m: float = TIP_M,
) -> dict[str, Any]:  # fmt: skip
    """Everything about a design as a stack, as plain data (SI units; thicknesses in mm as in designs).

    Parameters
    ----------
    design : Design
        What to look at.
    frequency_hz : sequence of float
        Tones [Hz].
    force_n, position_m : float
        The press: force [N], centre of the tip [m]; the middle of the sensor where None.
    noise : float
        Relative noise of a reading [-].
    drift : float
        What the films' permittivity may have drifted by, relative [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    law, tip_m : str, float
        Law of compression; length of the tip and of the touch [m].

    Raises
    ------
    SensorgenError
        What :func:`stacked` and :func:`press_at` refuse.
    """
    found = stacked(design, law, tip_m)
    press, tones = press_at(found, force_n, position_m), np.asarray(frequency_hz, float)
    z = found.double.impedance(tones, press)
    touching = Touching(found.own, found.isolation_eps_r, tones, press, noise, Body())
    return {
        "force_n": force_n,
        "position_m": float(np.asarray(press.left_m)) + tip_m / 2,
        "noise": noise,
        "drift": drift,
        "within_n": within_n,
        "readings_ohm": [_reading(f, m) for f, m in zip(tones, z, strict=True)],
        "bounds": bounds(found.double, tones, press, noise, drift),
        "press_shift": touching.press_shift(),
        "touch": [table(touching, wiring, within_n, design.params.isolation_mm) for wiring in WIRINGS],
        "values": found.taken,
        "doubts": list(found.doubts),
        "assumptions": [
            "both films carry the same force, the lower one spread no wider; bending is left out",
            "double: the third electrode floats while the other two are read",
            "touch: 1.5 kohm of skin and 100 pF to ground (human body model, ANSI/ESDA/JEDEC JS-001)",
            "touch: the isolation has its full thickness under the body, without fringe",
        ],
    }


def _reading(frequency_hz: float, matrix: Complex) -> dict[str, float]:
    lower, upper = matrix[0, 0], matrix[1, 1]
    return {
        "frequency_hz": float(frequency_hz),
        **{f"{name}_re": float(z.real) for name, z in (("lower", lower), ("upper", upper))},
        **{f"{name}_im": float(z.imag) for name, z in (("lower", lower), ("upper", upper))},
    }
