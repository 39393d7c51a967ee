"""Sensitivity of a microstructure to a press, beside a plate under the same boundary conditions."""

from dataclasses import dataclass, replace

import numpy as np

from sensorgen.design.design import Design
from sensorgen.models.compression import Compression
from sensorgen.models.press2d import BoundaryConditions
from sensorgen.prediction import bodies
from sensorgen.prediction.compression_law import solved
from sensorgen.prediction.identifiability.fisher import bounds, slopes
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import build_sensor

BOUNDARIES = {"free": BoundaryConditions("sliding", "free"), "bonded": BoundaryConditions()}
NOISE = 1e-3


@dataclass(frozen=True)
class Sensitivity:
    """A press on one sensor.

    Attributes
    ----------
    capacitance_f : float
        Unloaded [F].
    rise : float
        Of the capacitance under the tip [-].
    per_newton : float
        Of the same, per force, at this press [1/N].
    sigma_force_n, sigma_position_m : float
        Cramer-Rao bounds at ``NOISE`` [N], [m].
    """

    capacitance_f: float
    rise: float
    per_newton: float
    sigma_force_n: float
    sigma_position_m: float


def sensitivity(
    design: Design,
    law: Compression | str,
    frequency_hz: tuple[float, ...],
    force_n: float,
    *,
    resistivity_ohm_m: float | None = None,
    accuracy: float = 1e-3,
) -> Sensitivity:
    """Response of a design to a press in its middle.

    Parameters
    ----------
    design : Design
        As drawn.
    law : Compression or str
        Law of compression, or "free" or "bonded": its cell is then solved with these boundary conditions.
    frequency_hz : tuple of float
        Frequencies [Hz].
    force_n : float
        The press, by a flat tip of 10 mm [N].
    resistivity_ohm_m : float
        Of both electrodes; the design's own unless given [ohm m].
    accuracy : float
        Of the capacitance, relative [-].

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        As :func:`sensorgen.prediction.compression_law.solved`; a press beyond the law.

    Notes
    -----
    "free" slides on its base and widens as it likes, "bonded" can do neither. A plate that is bonded over an unbounded
    area deforms by its bulk modulus alone; over a width of 10 mm it is :func:`sensorgen.models.compression.bonded`.
    """
    body = bodies.drawn(design)
    given = build_sensor(body, "unconfined", rest=rest_state(body, accuracy)).sensor
    how = solved(design, boundary=BOUNDARIES[law]).compression if isinstance(law, str) else law
    sensor = replace(given, compression=how)
    if resistivity_ohm_m is not None:
        sensor = replace(sensor, resistivity_ohm_m=(resistivity_ohm_m,) * 2)
    middle = sensor.length_m / 2
    thinning, slope = how.capacitive_strain(sensor.stress_pa(force_n, middle))
    known = bounds(slopes(sensor, frequency_hz, force_n, middle), NOISE)
    return Sensitivity(
        sensor.capacitance_f(),
        float(thinning / (1 - thinning)),
        float(slope / (1 - thinning) ** 2 / (sensor.width_m * sensor.tip_m)),
        float(known.force_n),
        float(np.asarray(known.position_m)),
    )
