"""Predictions over force, position and frequency, and along values of one setting."""

import json
import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex
from sensorgen.core.display import Boundless, Displayed
from sensorgen.core.document import Cell, Column, Part, Table, apart
from sensorgen.core.errors import MissingValue, OutOfRange, SensorgenError
from sensorgen.core.units import M_PER_MM, frequency_text, si
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.models import refusal
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE
from sensorgen.prediction.query import Query
from sensorgen.prediction.results import Prediction, timeless
from sensorgen.prediction.sensor_model import SensorModel, rough_sensor, sensor_model
from sensorgen.prediction.sweep import Sweeper

LARGEST = 2_000_000  # impedances that are kept in memory at once
ROWS = 4096  # of CSV at a time
FORCES_N = tuple(k / 10 for k in range(61))  # up to the thesis's 6 N


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

    def changes(self, noise: float) -> Iterator[tuple[float | None, ...]]:
        """Ranges of R and X of each frequency over force and over position, in standard deviations of a reading.

        Parameters
        ----------
        noise : float
            Standard deviation of Re Z and of Im Z of one reading, relative to abs(Z) [-].

        Yields
        ------
        tuple
            Of R over force at the middle position, of R over position at the largest force, and both of X [-]; None
            along an axis of one value.
        """
        for z in self.impedance_ohm:
            deviation, middle = noise * np.abs(z).max(), z.shape[1] // 2
            parts = (part for values in (z.real, z.imag) for part in (values[:, middle], values[-1]))
            yield tuple(float(np.ptp(part) / deviation) if len(part) > 1 else None for part in parts)


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
    return sensor.impedance(f[:, None, None], force[:, None], at)


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
    return (refusal(OutOfRange, sensor.check_press, force_n, position_m) or "").partition(": press less")[0]


def positions_mm(design: Design) -> tuple[float, ...]:
    """A hundred equal steps along a design's sensor [mm]."""
    length = float(design.params.length_mm)
    return (*(length * k / 100 for k in range(100)), length)


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


_SHOWN = (
    ("capacitance", "pF", 1e-12), ("sensitivity", "1/kPa", 1.0), ("force_resolution", "N", 1.0),
    ("position_resolution", "mm", 1e-3),
)  # fmt: skip


@dataclass(frozen=True)
class PredictedPoint(Boundless):
    """A prediction at one value of a sweep.

    Attributes
    ----------
    design : str
        Name of the design.
    reason : str
        Why nothing is predicted, or "".
    prediction : Prediction or None
        Of the body; None where it cannot be predicted at all.
    accuracy : float or None
        Of abs(Z), that was asked for [-].
    """

    design: str
    reason: str = ""
    prediction: Prediction | None = None
    accuracy: float | None = None

    @property
    def source(self) -> str:
        """Slicer and version, "estimated", or "drawn"."""
        body = self.prediction.body if self.prediction else ""
        return body.removeprefix("printed, ").partition(" (")[0].partition(", ")[0]

    def table(self) -> Table:
        """One row: each number with its range."""
        columns = [
            Column(f"{name.replace('_', ' ')}{end}", unit, hidden=bool(end))
            for name, unit, _ in _SHOWN for end in ("", ", least", ", most")
        ]  # fmt: skip
        return Table("predictions", "", (*columns, Column("status"), Column("source")), (tuple(self._cells()),))

    def _cells(self) -> Iterator[Cell]:
        prediction = self.prediction
        if prediction is None:
            yield from (*[None] * 3 * len(_SHOWN), "not predicted", "")
            return
        values = (prediction.capacitance, prediction.sensitivity, *prediction.bench())
        for (_, _, size), bounds, words in zip(_SHOWN, values, ("", "", *prediction.resolved()), strict=True):
            if bounds is None:
                yield from (None, None, None)
                continue
            yield words if words in (CANNOT_SENSE, CANNOT_LOCATE) else bounds.value / size
            yield from (bounds.lower / size, bounds.upper / size)
        yield from (prediction.status, self.source)

    def remarks(self) -> Sequence[str]:
        """Source, and what is doubtful."""
        return (
            [f"source: {self.source}", *(f"doubtful: {d}" for d in self.prediction.doubts)] if self.prediction else []
        )

    def problems(self) -> Sequence[str]:
        """Why it is not predicted, or not within the accuracy."""
        return [self.reason] if self.reason else self.prediction.problems(self.accuracy) if self.prediction else ()


def _point(body: Body, asked: Query) -> PredictedPoint:
    prediction = timeless(evaluate(body, asked))
    reason = prediction.reason if prediction.capacitance is None else ""
    return PredictedPoint(prediction.design, reason, prediction, asked.accuracy)


def _unpredicted(body: Body, reason: str) -> PredictedPoint:
    return PredictedPoint(body.design.name, reason)


sweep = Sweeper(_point, _unpredicted, refused=(SensorgenError,))


_FREQUENCY = Column("frequency", "Hz", si=True)

Axes = tuple[Sequence[float], Sequence[float], Sequence[float]]  # frequency [Hz], force [N], position [mm]


@dataclass(frozen=True, eq=False)
class Loaded(Displayed):
    """A prediction, and the impedance over force and position.

    Attributes
    ----------
    prediction : Prediction
        At rest, and at the largest force in the middle position.
    model : SensorModel
        The sensor in numbers.
    axes : tuple of sequence of float
        Frequencies [Hz], forces [N] and positions [mm].
    noise : float
        Standard deviation of a reading, relative to abs(Z) [-].
    left_out : str
        Positions without an answer, and the reason; or "".
    """

    prediction: Prediction
    model: SensorModel
    axes: Axes
    noise: float
    left_out: str = ""

    @cached_property
    def impedance(self) -> ImpedanceGrid:
        """Over frequency, force and position [ohm]; raises OutOfRange where there are too many to keep."""
        frequency_hz, force_n, position_mm = map(tuple, self.axes)
        counts = [len(axis) for axis in self.axes]
        if math.prod(counts) > LARGEST:
            raise OutOfRange(
                f"{' x '.join(map(str, counts))} frequencies, forces and positions; expected at most {LARGEST} "
                "impedances at once: use larger steps, or CSV"
            )
        z = grid(self.model.sensor, frequency_hz, force_n, np.asarray(position_mm) * M_PER_MM)
        return ImpedanceGrid(frequency_hz, force_n, position_mm, z)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Of the sensor, and of pressures beyond the solved ones."""
        _, force_n, position_mm = self.axes
        stress_pa = self.model.sensor.stress_pa(force_n[-1], [x * M_PER_MM for x in position_mm])
        beyond = self.model.sensor.compression.doubt(float(stress_pa.max()))
        return (*self.model.doubts, *filter(None, (beyond, self.left_out)))

    def document(self) -> Iterator[Part]:
        """Ranges of R and X, how much they change, corners at the last frequency, and the judgement of a reading."""
        _, force, at = self.axes
        yield from self._ranges()
        changes = [self._changes()] if len(force) > 1 or len(at) > 1 else ()
        yield from apart(changes, [self._corners()], self.prediction.judgement())

    def _ranges(self) -> Iterator[Part]:
        """For which presses, and ranges of R and X."""
        (_, force, at), sensor = self.axes, self.model.sensor
        touches = float(sensor.contact_m(force[-1])[0])
        grown = f", contact {touches / M_PER_MM:.3g} mm at {force[-1]:g} N" if touches < sensor.tip_m else ""
        spread = "" if sensor.profile == "uniform" else f" ({sensor.profile}{grown})"
        where = f"{_axis(force, 'force', 'N')}, {_axis(at, 'position', 'mm')}"
        yield f"{self.prediction.design}, {self.prediction.body}: {where};"
        yield f"tip {sensor.tip_m / M_PER_MM:g} mm{spread}, compression {sensor.compression.name}"
        yield from (f"doubtful: {doubt}" for doubt in self.doubts)
        yield ""
        yield self._ends()

    def _ends(self) -> Table:
        """Least and largest R and X of each frequency."""
        columns = (_FREQUENCY, *(Column(head, digits=6) for head in ("R, least", "R, most", "X, least", "X, most")))
        rows = (
            (f, z.real.min(), z.real.max(), z.imag.min(), z.imag.max())
            for f, z in zip(self.axes[0], self.impedance.impedance_ohm, strict=True)
        )
        return Table("ends", "R and X [ohm]", columns, tuple(rows))

    def _changes(self) -> Table:
        """Changes of R and X over force and over position."""
        frequency_hz, force, at = self.axes
        caption = (
            f"change of R and X in standard deviations of one reading, {self.noise:.2g} of |Z|: over force at "
            f"{at[len(at) // 2]:g} mm, over position at {force[-1]:g} N"
        )
        names = ("R by force", "R by position", "X by force", "X by position")
        changes = zip(frequency_hz, self.impedance.changes(self.noise), strict=True)
        columns = (_FREQUENCY, *(Column(name, digits=3) for name in names))
        return Table("changes", caption, columns, tuple((f, *change) for f, change in changes))

    def _corners(self) -> Table:
        """R and X at the last frequency, at the ends and in the middle of both axes."""
        frequency_hz, force, at = self.axes
        places, last = _ends_and_middle(at), self.impedance.impedance_ohm[-1]
        columns = [Column(f"{part}, {at[k]:g} mm", digits=7) for k in places for part in "RX"]
        rows = (
            (force[j], *(part for z in last[j][places] for part in (z.real, z.imag))) for j in _ends_and_middle(force)
        )
        caption = f"R and X [ohm] at {si(frequency_hz[-1], 'Hz')}"
        return Table("corners", caption, (Column("force", "N", si=True), *columns), tuple(rows))

    def to_json(self) -> str:
        """Prediction and impedances, a line per key: for long lists of numbers."""
        z, sensor = self.impedance, self.model.sensor
        data = {
            "prediction": json.loads(self.prediction.to_json()),
            "tip_mm": sensor.tip_m / M_PER_MM,
            "profile": sensor.profile,
            "contact_mm": float(sensor.contact_m(z.force_n[-1])[0]) / M_PER_MM,
            "compression": self.model.law.compression.name,
            "doubts": self.doubts,
            "axes": ["frequency_hz", "force_n", "position_mm"],
            "frequency_hz": z.frequency_hz,
            "force_n": z.force_n,
            "position_mm": z.position_mm,
            "re_ohm": z.impedance_ohm.real.tolist(),
            "im_ohm": z.impedance_ohm.imag.tolist(),
        }
        lines = (f"  {json.dumps(k)}: {json.dumps(v, ensure_ascii=False, allow_nan=False)}" for k, v in data.items())
        return "{\n" + ",\n".join(lines) + "\n}\n"

    def to_xarray(self) -> Any:
        """Impedance [ohm] as an xarray DataArray; raises MissingValue where xarray is not installed."""
        try:
            import xarray as xr
        except ImportError as error:
            raise MissingValue("to_xarray() needs xarray: pip install xarray") from error
        axes = zip(("frequency_hz", "force_n", "position_mm"), self.axes, strict=True)
        return xr.DataArray(self.impedance.impedance_ohm, dict(axes), name="impedance_ohm")

    def csv(self) -> Iterator[str]:
        """R and X, a row per force and position, as :func:`sensorgen.prediction.loaded.csv_blocks`."""
        return csv_blocks(self.model.sensor, *self.axes)

    def overview(self) -> Iterator[Part]:
        """The first screen: ranges of R and X, corners at the last frequency, and the verdict on a press."""
        yield from self._ranges()
        known = self.prediction.identifiability
        verdict = f"{known.verdict}." if known else f"no load: {self.prediction.reason}"
        yield from apart([self._corners()], [verdict])
        yield "(--details: changes of R and X, what would improve the sensor, error budget)"


def loaded(body: Body, query: Query, force_n: Sequence[float] = (), position_mm: Sequence[float] = ()) -> Loaded:
    """The prediction of a body at the largest force in the middle position, with all of both axes.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    query : Query
        Frequencies, tip, law, accuracy and noise.
    force_n, position_mm : sequence of float
        Rising [N], [mm]; if not given, 0 to 6 N, and the whole sensor in 100 steps: without those where the tip
        overhangs an end, if there the pressure is beyond the law.

    Raises
    ------
    SensorgenError
        As :func:`sensorgen.prediction.evaluate.sensor_model`; a load that the sensor cannot take.
    """
    axes = query.frequency_hz, tuple(force_n) or FORCES_N, tuple(position_mm) or positions_mm(body.design)
    query = replace(query, force_n=axes[1][-1], position_m=axes[2][len(axes[2]) // 2] * M_PER_MM)
    rough = rough_sensor(body, query.law, query.tip_of(body.design), query.force_n)
    at_m = [x * M_PER_MM for x in axes[2]]
    whole = at_m if position_mm else [x for x in at_m if rough.sensor.whole(x)]
    check_presses(rough.sensor, axes[1], whole or at_m)
    prediction, model = evaluate(body, query), sensor_model(body, query)[0]
    at, left_out = (axes[2], "") if position_mm else _pressable(model.sensor, *axes[1:])
    return Loaded(prediction, model, (*axes[:2], at), query.noise, left_out)


def _pressable(
    sensor: Sensor, force_n: Sequence[float], position_mm: Sequence[float]
) -> tuple[Sequence[float], str]:  # fmt: skip
    """Positions that can be pressed, and why others cannot; errors as of :func:`check_presses`."""
    try:
        check_presses(sensor, force_n, [x * M_PER_MM for x in position_mm])
    except OutOfRange as error:
        whole = tuple(x for x in position_mm if sensor.whole(x * M_PER_MM))
        check_presses(sensor, force_n, [x * M_PER_MM for x in whole])
        return whole, f"only from {whole[0]:g} to {whole[-1]:g} mm, where the tip lies on the sensor whole ({error})"
    return position_mm, ""


def _axis(values: Sequence[float], name: str, unit: str) -> str:
    if len(values) == 1:
        return f"{name} {values[0]:g} {unit}"
    return f"{len(values)} {name}s {values[0]:g} to {values[-1]:g} {unit}"


def _ends_and_middle(values: Sequence[float]) -> list[int]:
    return sorted({0, len(values) // 2, len(values) - 1})
