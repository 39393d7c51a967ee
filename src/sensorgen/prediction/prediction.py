"""What a design should measure, by the cheapest models that can speak of it."""

import math
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import MissingValue, OutOfRange, SensorgenError
from sensorgen.core.units import M_PER_MM, frequency_text
from sensorgen.design.design import Design
from sensorgen.design.values import ENDS, MaterialValue, piezoresistance
from sensorgen.models import line
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction import ladder as planned
from sensorgen.prediction.capacitance import Unloaded, Unpredictable, unloaded
from sensorgen.prediction.error_budget import budget
from sensorgen.prediction.identifiability import FORCE_N, Identifiability, identify
from sensorgen.prediction.ladder import Press
from sensorgen.prediction.losses import Lost, lost
from sensorgen.prediction.plan import Plan, plain
from sensorgen.prediction.sensor_of_design import TIP_M, Sensed

TONES_HZ = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)  # thesis, Table 5.1, its 4990 corrected
NOISE = 1e-3  # standard deviation of the real and of the imaginary part, relative to the impedance's magnitude [-]
LARGEST = 2_000_000  # impedances that are kept in memory at once
ROWS = 4096  # of CSV at a time
_ASSUMED = "the cell was not solved, and is taken to give way as a solid plate"
FORCES_N = tuple(k / 10 for k in range(61))  # up to the thesis's 6 N

Complex = NDArray[np.complex128]
Data = dict[str, Any]


def prediction(
    design: Design, frequency_hz: Sequence[float] = TONES_HZ, law: str = "", tip_m: float = TIP_M,
    *, profile: str = UNIFORM, radius_m: float | None = None, accuracy: float = inf, noise: float = NOISE,
    judged: bool = True,
) -> dict[str, Any]:  # fmt: skip
    """Everything that is predicted of a design, as plain data for ``prediction.json`` (SI units).

    Parameters
    ----------
    design : Design
        As drawn.
    frequency_hz : sequence of float
        Tones of the impedance [Hz].
    law, tip_m, profile, radius_m : str, float, str, float
        Law of compression, length of the tip [m], how its pressure is spread and its radius [m], as of
        :func:`sensorgen.prediction.sensor_of_design.sensor_of`, for the card and the error budget.
    accuracy : float
        Wanted of abs(Z), relative [-]: each level is worked out as nearly as that takes.
    noise : float
        Standard deviation of Re Z and of Im Z, each, as a share of abs(Z), for the card [-].
    judged : bool
        Whether card and error budget, which take most of the time, are in it.

    Notes
    -----
    A scene that no model can speak of, as a short, or a material without a value has a reason in place of numbers.
    """
    tip: Data = {"tip_m": tip_m, "profile": profile, "radius_m": radius_m}
    press = middle(design, frequency_hz)
    try:
        sensed, plan, why = _sensed(design, press, accuracy, law, tip) if judged else (None, None, None)
        found, gone = sensed.unloaded if sensed else unloaded(design, accuracy), lost(design)
    except (Unpredictable, MissingValue) as error:
        return {"capacitance_f": None, "reason": str(error)}
    rises = piezoresistance(design)
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    resistance = _resistance_ohm(design, found)
    return {
        "model": {"capacitance": found.answer.model, "line": "line"},
        "refused": list(found.answer.refused),
        "relative_width": found.answer.capacitance_f.width(),
        "capacitance_f": _bounds(found.answer.capacitance_f),
        "capacitance_per_area_f_per_m2": _bounds(found.answer.capacitance_f.times(1 / area)),
        "electrode_resistance_ohm": resistance,
        **_line(sum(resistance.values()), found.answer.capacitance_f, gone, frequency_hz),
        **(_judged(design, sensed, press, accuracy, noise) if sensed else {}),
        **(_unjudged(why) if why else {}),
        **({"plan": plain(plan)} if plan else {}),
        "values": [vars(t) for t in (*found.taken, *rises.values(), *gone.taken)],
        "assumptions": [
            "ideal electrodes and no fringe at the sensor's edge for the capacitance",
            "electrode resistance of the plates alone: cogs can only lower it",
            _lossless(gone),
            *gone.doubts,
            _pressed(rises),
            "unloaded, as drawn",
        ],
    }


def _lossless(gone: Lost) -> str:
    said = " and ".join(f"{t.quantity} of {t.material}" for t in gone.taken)
    return (
        f"of dielectric loss and leak, {said} as given"
        if said
        else "no dielectric loss and no leak: the sources give none"
    )


def _pressed(rises: Mapping[str, MaterialValue]) -> str:
    if not rises:
        return "resistivity under the tip as elsewhere: no source says how it moves with pressure"
    said = [
        f"{rises[end].value:g} 1/Pa ({end} electrode, {rises[end].material}, {rises[end].source})"
        if end in rises
        else f"not ({end} electrode, no source)"
        for end in ENDS
    ]
    return f"resistivity rises in proportion to the pressure under the tip: {', '.join(said)}"


def middle(design: Design, frequency_hz: Sequence[float]) -> Press:
    """The press that an unpressed prediction is judged by: ``FORCE_N`` in the middle."""
    return Press(tuple(frequency_hz), FORCE_N, float(design.params.length_mm) * M_PER_MM / 2)


def _sensed(
    design: Design, press: Press, accuracy: float, law: str, tip: Data
) -> tuple[Sensed | None, Plan | None, SensorgenError | None]:
    """The sensor, how it was planned where an accuracy is wanted; or why there is none."""
    try:
        return *planned.sensed(design, planned.drawn(design, **tip), press, accuracy, law), None
    except SensorgenError as error:
        return None, None, error


def _judged(design: Design, sensed: Sensed, press: Press, accuracy: float, noise: float) -> Data:
    """Identifiability card and error budget of a press; or why there are none."""
    from pydantic import TypeAdapter

    law = sensed.law
    stiffest = (
        replace(sensed.sensor, compression=law.others[0])
        if law.compression.name == "unconfined" and law.bounded
        else None
    )
    try:
        found = identify(
            sensed.sensor, press.frequency_hz, noise, force_n=press.force_n or FORCE_N, position_m=press.position_m,
            stiffest=stiffest, assumed="" if law.bounded else _ASSUMED,
        )  # fmt: skip
        found = replace(found, doubts=() if stiffest else tuple(sensed.doubts))  # the stiffest law says it in numbers
        return {
            "identifiability": TypeAdapter(Identifiability).dump_python(found, mode="json"),
            "budget": budget(design, sensed, press.frequency_hz, press.force_n, press.position_m, accuracy),
        }
    except SensorgenError as error:
        return _unjudged(error)


def _unjudged(error: SensorgenError) -> Data:
    return {"identifiability": {"verdict": None, "reason": str(error)}, "budget": None}


def _resistance_ohm(design: Design, found: Unloaded) -> dict[str, float]:
    """Resistance of each electrode's plate from end to end, rho L / (H W) [ohm]."""
    p = design.params
    squares_per_m = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    return {end: rho * squares_per_m for end, rho in zip(("top", "bottom"), found.resistivity_ohm_m, strict=True)}


def _line(resistance_ohm: float, capacitance_f: Interval, gone: Lost, frequency_hz: Sequence[float]) -> dict[str, Any]:
    """Corner frequency and impedance at the tones, for both bounds of the capacitance."""
    ends = (capacitance_f.lower, capacitance_f.middle(), capacitance_f.upper)
    corner = [line.corner_frequency_hz(resistance_ohm, c) for c in ends]
    admittance = [[2 * math.pi * f * c * (1j + gone.tan_delta) + gone.leak_s for c in ends] for f in frequency_hz]
    rows = line.cascade([resistance_ohm], [admittance], [1.0])  # per the sensor's own length
    return {
        "corner_frequency_hz": {"lower": corner[2], "middle": corner[1], "upper": corner[0]},
        "impedance_ohm": [
            {
                "frequency_hz": f,
                "re": float(row[1].real),
                "im": float(row[1].imag),
                "re_range": [float(row.real.min()), float(row.real.max())],
                "im_range": [float(row.imag.min()), float(row.imag.max())],
            }
            for f, row in zip(frequency_hz, rows, strict=True)
        ],
    }


def _bounds(interval: Interval) -> dict[str, float]:
    return {"lower": interval.lower, "middle": interval.middle(), "upper": interval.upper}


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
        sensor.compression.thinning(stress)
        sensor.check_tracks(stress)
    except OutOfRange as error:
        return str(error).partition(": press less")[0]
    return ""


def positions_mm(design: Design) -> tuple[float, ...]:
    """A hundred equal steps along a design's sensor [mm]."""
    length = float(design.params.length_mm)
    return (*(length * k / 100 for k in range(100)), length)


def presses(
    design: Design,
    sensed: Sensed,
    frequency_hz: Sequence[float],
    force_n: Sequence[float],
    position_mm: Sequence[float],
    accuracy: float = inf,
    noise: float = NOISE,
    plan: Plan | None = None,
) -> dict[str, Any]:
    """Impedance over tone, force and position, and what it rests on, as plain data.

    Parameters
    ----------
    design : Design
        As drawn.
    sensed : Sensed
        Its sensor.
    frequency_hz, force_n, position_mm : sequence of float
        Tones [Hz], forces [N] and centres of the tip [mm], each rising.
    accuracy : float
        Wanted of abs(Z), relative, for the error budget of the largest force at the middle position [-].
    noise : float
        As of :func:`prediction`, for the card of that press [-].
    plan : Plan
        How the sensor came to be as near as wanted.

    Returns
    -------
    dict
        ``re_ohm`` and ``im_ohm`` are nested lists with the axes that ``axes`` names.

    Raises
    ------
    OutOfRange
        As :func:`grid`; also more than ``LARGEST`` impedances.
    """
    check_size(LARGEST, frequency_hz, force_n, position_mm)
    sensor, position_m = sensed.sensor, np.asarray(position_mm) * M_PER_MM
    z = grid(sensor, frequency_hz, force_n, position_m)
    law = sensor.compression
    beyond = law.doubt(float(sensor.stress_pa(force_n[-1], position_m).max()))
    return {
        "design": design.name,
        "design_id": design.id(),
        "model": {"capacitance": sensed.unloaded.answer.model, "line": "line", "compression": law.name},
        "compression": law.source,
        "tip_mm": sensor.tip_m / M_PER_MM,
        "profile": sensor.profile,
        "contact_mm": float(sensor.contact_m(force_n[-1])[0]) / M_PER_MM,
        "noise": noise,
        **_judged(design, sensed, hardest(frequency_hz, force_n, position_mm), accuracy, noise),
        **({"plan": plain(plan)} if plan else {}),
        "doubts": [*sensed.doubts, *([beyond] if beyond else [])],
        "values": [vars(t) for t in sensed.taken],
        "axes": ["frequency_hz", "force_n", "position_mm"],
        "frequency_hz": list(frequency_hz),
        "force_n": list(force_n),
        "position_mm": list(position_mm),
        "re_ohm": z.real.tolist(),
        "im_ohm": z.imag.tolist(),
    }


def hardest(frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]) -> Press:
    """The press that others are judged by: the largest force at the middle position."""
    return Press(tuple(frequency_hz), force_n[-1], position_mm[len(position_mm) // 2] * M_PER_MM)


def check_size(most: int, *axes: Sequence[float]) -> None:
    """Refuse more than ``most`` impedances."""
    counts = [len(axis) for axis in axes]
    if math.prod(counts) > most:
        said = " x ".join(map(str, counts))
        raise OutOfRange(
            f"{said} tones, forces and positions; expected at most {most} impedances at once: use larger steps, or CSV"
        )


def moves(predicted: Mapping[str, Any]) -> list[dict[str, float | None]]:
    """How far presses move R and X of each tone, in standard deviations of one reading.

    Parameters
    ----------
    predicted : mapping
        As of :func:`presses`, with the noise of a reading.

    Returns
    -------
    list of dict
        Per tone: by force at the middle position, and by position at the largest force [-]; None along an axis of
        one value.
    """
    found = []
    for re, im in zip(np.asarray(predicted["re_ohm"]), np.asarray(predicted["im_ohm"]), strict=True):
        deviation, middle = predicted["noise"] * np.hypot(re, im).max(), re.shape[1] // 2
        found.append(
            {
                f"{name}_by_{axis}": float(np.ptp(part) / deviation) if len(part) > 1 else None
                for name, values in (("re", re), ("im", im))
                for axis, part in (("force", values[:, middle]), ("position", values[-1]))
            }
        )
    return found


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
