"""A prediction with the impedance over frequency, force and position."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.core.units import M_PER_MM, si
from sensorgen.design.body import Body
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import grid
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.planning import rough_sensor, sensor_model
from sensorgen.prediction.query import Query
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sensor_model import SensorModel

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
    def impedance(self) -> grid.ImpedanceGrid:
        """Over frequency, force and position [ohm]; raises OutOfRange where there are too many to keep."""
        return grid.impedance_grid(self.model.sensor, *self.axes)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Of the sensor, and of pressures beyond the solved ones."""
        _, force_n, position_mm = self.axes
        stress_pa = self.model.sensor.stress_pa(force_n[-1], [x * M_PER_MM for x in position_mm])
        beyond = self.model.sensor.compression.doubt(float(stress_pa.max()))
        return (*self.model.doubts, *filter(None, (beyond, self.left_out)))

    def document(self) -> Iterator[Part]:
        """Ranges of R and X, how much they change, corners at the last frequency, and the judgement of a reading."""
        (frequency_hz, force, at), sensor = self.axes, self.model.sensor
        touches = float(sensor.contact_m(force[-1])[0])
        grown = f", contact {touches / M_PER_MM:.3g} mm at {force[-1]:g} N" if touches < sensor.tip_m else ""
        spread = "" if sensor.profile == "uniform" else f" ({sensor.profile}{grown})"
        where = f"{_axis(force, 'force', 'N')}, {_axis(at, 'position', 'mm')}"
        yield f"{self.prediction.design}, {self.prediction.body}: {where};"
        yield f"tip {sensor.tip_m / M_PER_MM:g} mm{spread}, compression {sensor.compression.name}"
        yield from (f"doubtful: {doubt}" for doubt in self.doubts)
        yield ""
        z, frequency = self.impedance, Column("frequency", "Hz", si=True)
        heads = ("R, least", "R, most", "X, least", "X, most")
        ends = (
            (f, row.real.min(), row.real.max(), row.imag.min(), row.imag.max())
            for f, row in zip(frequency_hz, z.impedance_ohm, strict=True)
        )
        yield Table("ends", "R and X [ohm]", (frequency, *(Column(h, digits=6) for h in heads)), tuple(ends))
        if len(force) > 1 or len(at) > 1:
            yield ""
            caption = (
                f"change of R and X in standard deviations of one reading, {self.noise:.2g} of |Z|: over force at "
                f"{at[len(at) // 2]:g} mm, over position at {force[-1]:g} N"
            )
            names = ("R by force", "R by position", "X by force", "X by position")
            changes = tuple(
                (f, *change.values()) for f, change in zip(frequency_hz, z.changes(self.noise), strict=True)
            )
            yield Table("changes", caption, (frequency, *(Column(n, digits=3) for n in names)), changes)
        yield ""
        places = _ends_and_middle(at)
        columns = [Column(f"{part}, {at[k]:g} mm", digits=7) for k in places for part in "RX"]
        corners = (
            (force[j], *(part for k in places for part in (last[j][k].real, last[j][k].imag)))
            for last in z.impedance_ohm[-1:] for j in _ends_and_middle(force)
        )  # fmt: skip
        caption = f"R and X [ohm] at {si(frequency_hz[-1], 'Hz')}"
        yield Table("corners", caption, (Column("force", "N", si=True), *columns), tuple(corners))
        yield ""
        yield from self.prediction.judgement()

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
        """R and X, a row per force and position, as :func:`sensorgen.prediction.grid.csv_blocks`."""
        return grid.csv_blocks(self.model.sensor, *self.axes)


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
    axes = query.frequency_hz, tuple(force_n) or grid.FORCES_N, tuple(position_mm) or grid.positions_mm(body.design)
    reference = grid.hardest(*axes)
    query = replace(query, force_n=reference.force_n, position_m=reference.position_m)
    rough = rough_sensor(body, query.law, query.tip_of(body.design), query.force_n)
    at_m = [x * M_PER_MM for x in axes[2]]
    whole = at_m if position_mm else [x for x in at_m if rough.sensor.whole(x)]
    grid.check_presses(rough.sensor, axes[1], whole or at_m)
    prediction, model = evaluate(body, query), sensor_model(body, query)[0]
    at, left_out = (axes[2], "") if position_mm else _pressable(model.sensor, *axes[1:])
    return Loaded(prediction, model, (*axes[:2], at), query.noise, left_out)


def _pressable(
    sensor: Sensor, force_n: Sequence[float], position_mm: Sequence[float]
) -> tuple[Sequence[float], str]:  # fmt: skip
    """Positions that can be pressed, and why others cannot; errors as of :func:`grid.check_presses`."""
    try:
        grid.check_presses(sensor, force_n, [x * M_PER_MM for x in position_mm])
    except OutOfRange as error:
        whole = tuple(x for x in position_mm if sensor.whole(x * M_PER_MM))
        grid.check_presses(sensor, force_n, [x * M_PER_MM for x in whole])
        return whole, f"only from {whole[0]:g} to {whole[-1]:g} mm, where the tip lies on the sensor whole ({error})"
    return position_mm, ""


def _axis(values: Sequence[float], name: str, unit: str) -> str:
    if len(values) == 1:
        return f"{name} {values[0]:g} {unit}"
    return f"{len(values)} {name}s {values[0]:g} to {values[-1]:g} {unit}"


def _ends_and_middle(values: Sequence[float]) -> list[int]:
    return sorted({0, len(values) // 2, len(values) - 1})
