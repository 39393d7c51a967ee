"""Impedance over frequency, force and position."""

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM, frequency_text
from sensorgen.design.design import Design
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.query import Load

LARGEST = 2_000_000  # impedances that are kept in memory at once
ROWS = 4096  # of CSV at a time
FORCES_N = tuple(k / 10 for k in range(61))  # up to the thesis's 6 N

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class ImpedanceGrid:
    """Impedance of a sensor over three axes.

    Attributes
    ----------
    frequency_hz, force_n, position_mm : tuple of float
        The axes [Hz], [N], [mm].
    impedance_ohm : (n_frequency, n_force, n_position) complex array
        Impedance [ohm].
    """

    frequency_hz: tuple[float, ...]
    force_n: tuple[float, ...]
    position_mm: tuple[float, ...]
    impedance_ohm: Complex

    def changes(self, noise: float) -> list[dict[str, float | None]]:
        """Range of R and X of each frequency over force and over position, in standard deviations of a reading.

        Parameters
        ----------
        noise : float
            Standard deviation of Re Z and of Im Z of one reading, relative to abs(Z) [-].

        Returns
        -------
        list of dict
            Per frequency: over force at the middle position, over position at the largest force [-]; None along an
            axis of one value.
        """
        found = []
        for z in self.impedance_ohm:
            deviation, middle = noise * np.abs(z).max(), z.shape[1] // 2
            found.append(
                {
                    f"{name}_by_{axis}": float(np.ptp(part) / deviation) if len(part) > 1 else None
                    for name, values in (("re", z.real), ("im", z.imag))
                    for axis, part in (("force", values[:, middle]), ("position", values[-1]))
                }
            )
        return found


def impedance_grid(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> ImpedanceGrid:
    """Impedance for every frequency [Hz], force [N] and position [mm], each rising.

    Raises
    ------
    OutOfRange
        As :func:`grid`; also more than ``LARGEST`` impedances.
    """
    counts = [len(axis) for axis in (frequency_hz, force_n, position_mm)]
    if math.prod(counts) > LARGEST:
        raise OutOfRange(
            f"{' x '.join(map(str, counts))} frequencies, forces and positions; expected at most {LARGEST} impedances "
            "at once: use larger steps, or CSV"
        )
    z = grid(sensor, frequency_hz, force_n, np.asarray(position_mm) * M_PER_MM)
    return ImpedanceGrid(tuple(frequency_hz), tuple(force_n), tuple(position_mm), z)


def grid(sensor: Sensor, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Complex:
    """Impedance for every tone, force and position, in this order of axes [ohm].

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz, force_n, position_m : (n,) array
        Tones [Hz], forces [N] and centres of the tip [m].

    Returns
    -------
    (n_frequency, n_force, n_position) complex array
        Impedance [ohm]; memory is that of the answer.

    Raises
    ------
    OutOfRange
        A position outside the sensor, or a force that it cannot bear; the message names it.

    Examples
    --------
    >>> from sensorgen.models.compression import unconfined
    >>> plate = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.07, 0.2), 69.06e-11, unconfined(6e6))
    >>> grid(plate, [1.1e3, 99.7e3], [0.0, 3.0, 6.0], [0.02, 0.05]).shape
    (2, 3, 2)
    """
    f, force, at = (np.asarray(values, float) for values in (frequency_hz, force_n, position_m))
    check_presses(sensor, force, at)
    ends = [0, *(np.flatnonzero(np.diff(sensor.whole(at))) + 1).tolist(), at.size]
    runs = [at[start:end] for start, end in pairwise(ends)]  # tips that lie whole on the sensor all press alike
    found = [sensor.impedance(f[:, None, None], force[:, None], run) for run in runs]
    return found[0] if len(found) == 1 else np.concatenate(found, axis=-1)


def check_presses(sensor: Sensor, force_n: ArrayLike, position_m: ArrayLike) -> None:
    """Refuse presses that the sensor has no answer for.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    force_n, position_m : (n,) array
        Forces, rising [N]; centres of the tip [m].

    Raises
    ------
    OutOfRange
        A position outside the sensor; a force that makes the electrodes touch or is beyond the law of compression:
        the first one, where the tip rests on least.
    """
    force, at = np.asarray(force_n, float), np.asarray(position_m, float)
    hardest = float(at[np.argmin(sensor.patch(at).length_m)])
    first = bisect_left(force, True, key=lambda value: bool(_refusal(sensor, value, hardest)))
    if first < len(force):
        fine = f"up to {force[first - 1]:g} N there" if first else "less"
        larger = "rounder" if sensor.contact else "longer"
        where = f"force {force[first]:g} N at position {hardest / M_PER_MM:g} mm"
        raise OutOfRange(f"{where}: {_refusal(sensor, force[first], hardest)}; expected {fine}, or a {larger} tip")


def _refusal(sensor: Sensor, force_n: float, position_m: float) -> str:
    """Why a press has no answer, "" if it has one."""
    try:
        stress = sensor.stress_pa(force_n, position_m)
        sensor.compression.capacitive_strain(stress)
        sensor.check_tracks(stress)
    except OutOfRange as error:
        return str(error).partition(": press less")[0]
    return ""


def positions_mm(design: Design) -> tuple[float, ...]:
    """A hundred equal steps along a design's sensor [mm]."""
    length = float(design.params.length_mm)
    return (*(length * k / 100 for k in range(100)), length)


def hardest(frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]) -> Load:
    """The reference load of a grid: the largest force at the middle position."""
    return Load(tuple(frequency_hz), force_n[-1], position_mm[len(position_mm) // 2] * M_PER_MM)


def csv_blocks(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> Iterator[str]:
    """Impedances as CSV, a row per force and position, ``ROWS`` rows at a time after the head.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz, force_n, position_mm : sequence of float
        Tones [Hz], forces [N] and centres of the tip [mm].

    Raises
    ------
    OutOfRange
        As :func:`grid`, before the first block.
    """
    tones, force, at = (np.asarray(values, float) for values in (frequency_hz, force_n, position_mm))
    check_presses(sensor, force, at * M_PER_MM)
    names = [f"{part}_ohm_{frequency_text(f)}" for f in frequency_hz for part in ("re", "im")]
    yield ",".join(["force_n", "position_mm", *names]) + "\n"
    for start in range(0, force.size * at.size, ROWS):
        by_force, by_position = np.divmod(np.arange(start, min(start + ROWS, force.size * at.size)), at.size)
        f, x = force[by_force], at[by_position]
        z = sensor.impedance(tones[:, None], f, x * M_PER_MM)
        rows = np.column_stack([f, x, *(part for row in z for part in (row.real, row.imag))]).tolist()
        yield "".join(",".join(map(repr, row)) + "\n" for row in rows)
