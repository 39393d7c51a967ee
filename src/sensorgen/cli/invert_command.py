"""``sensorgen invert``: force and position back from measured impedances, of a calibrated specimen or of a design."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import click
import numpy as np

from sensorgen.cli import inversion, render
from sensorgen.cli.commands import of_word
from sensorgen.cli.designs import BodyChoice, DesignGroup
from sensorgen.cli.inversion import Task
from sensorgen.cli.options import ArrayFrames, Law, LogFile
from sensorgen.core import lazy as registry
from sensorgen.core.errors import BadInput, MissingValue, UnknownName, within
from sensorgen.design import shapes

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.design.design import Design
    from sensorgen.measure.readings import FileRows, Readings
    from sensorgen.prediction.calibration.inversion import Inverter
    from sensorgen.prediction.calibration.rest import Baseline
    from sensorgen.prediction.query import Query

_REST, _TIME = "rest", "time_s"
FORMS = render.options("json", "markdown", file=False)


class _Made(NamedTuple):
    """Inverter of a calibrated sensor: largest force, number of presses that calibrated it, doubts."""

    inverter: "Inverter"
    limit_n: float
    presses: int
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class _Sensor:
    """Specimen or design: its inverter is made once readings at rest are there."""

    name: str
    inverter: Callable[[Any, Any, Any], _Made]  # of readings at rest, frequencies, noise
    tones_hz: Any = None  # of a calibration; those of the readings if None
    baseline: "Baseline | None" = None


class _ByRatio:
    """Inversion of ratios to the latest reading at rest, row by row."""

    def __init__(self, task: Task, sensor: _Sensor, source: "Readings") -> None:
        from sensorgen.prediction.calibration import answers
        from sensorgen.prediction.calibration.rest import Rest, checked

        self.task, self.sensor, self.source = task, sensor, source
        self.tones_hz = source.frequency_hz if sensor.tones_hz is None else sensor.tones_hz
        with within(task.measured):
            self.order = checked(source.frequency_hz, self.tones_hz)
        if not task.rest_file and _REST not in source.numbers:
            raise BadInput(
                f"{task.measured}: no reading at rest; expected a column 'rest' with 1 where nothing was on the "
                "sensor, or --rest FILE.csv: what counts is the ratio to it"
                f"{' (or --perfect, as if the sensor were as predicted)' * (sensor.tones_hz is None)}"
            )
        apart, at_s = _at_rest(task.rest_file, self.tones_hz) if task.rest_file else (None, np.nan)
        self.rest = Rest(apart, at_s, sensor.baseline)
        self.summary = answers.CalibratedSummary()
        self.made: _Made | None = None
        self._by_scatter, self._doubted = False, 0

    def header(self) -> str:
        return self.summary.header([_TIME] * (_TIME in self.source.numbers) + self.source.kept)

    def rows(self, block: "FileRows") -> str:
        """Rows of a block of readings; its readings at rest are the reference of those after them."""
        from sensorgen.prediction.calibration import answers
        from sensorgen.prediction.calibration.inversion import doubt_rest, nothing

        at_rest, time_s = _beside(self.source, block)
        ratio, age_s, changed = self.rest.ratios(block.impedance_ohm[:, self.order], at_rest, time_s)
        if self.rest and not at_rest.all():
            self._renew()
        presses = self.made.inverter.batch(ratio, age_s, changed) if self.made else nothing(len(ratio))
        self._doubted = doubt_rest(presses, at_rest, self._doubted)
        self.summary.add(presses, at_rest)
        times = [[repr(t) if np.isfinite(t) else ""] if _TIME in self.source.numbers else [] for t in time_s.tolist()]
        return answers.rows([[*a, *b] for a, b in zip(times, block.text, strict=True)], presses, at_rest)

    def _renew(self) -> None:
        """Make the inverter, and once more when readings at rest tell their noise."""
        by_scatter = self.rest.tells_noise and self.task.noise is None
        if self.made is None or (by_scatter and not self._by_scatter):
            self._by_scatter = self.rest.tells_noise
            noise = np.sqrt(1 + 1 / self.rest.mean()[1]) * (self.task.noise or self.rest.noise())
            self.made = self.sensor.inverter(self.rest, self.tones_hz, np.broadcast_to(noise, self.order.shape))

    def result(self) -> "Documented":
        if self.made is None and self.summary.samples:
            raise BadInput(
                f"{self.task.measured}: nothing at rest before readings under load; expected 1 in column 'rest' first"
            )
        sigma = self.task.noise or float(np.nanmedian(self.rest.noise()))
        changes = [self.rest.change.words] if self.rest.change else []
        if self.made is None:
            return self.summary.result(self.sensor.name, 0, 0, 0.0, sigma, tuple(changes))
        length_m = float(self.made.inverter.position_m[-1])
        doubts = (*changes, *self.made.doubts)
        return self.summary.result(self.sensor.name, self.made.presses, self.made.limit_n, length_m, sigma, doubts)


class _Perfect:
    """Inversion as if the sensor were as predicted."""

    def __init__(self, task: Task, body: Any, query: "Query", source: "Readings") -> None:
        from sensorgen.prediction.inverse import answers
        from sensorgen.prediction.inverse.estimator import Estimator
        from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N
        from sensorgen.prediction.query import NOISE
        from sensorgen.prediction.sensor_model import sensor_model

        model = sensor_model(body, query)[0]
        noise = NOISE if task.noise is None else task.noise
        limit_n = task.force_limit_n or FORCE_LIMIT_N
        self.estimator = Estimator(model.sensor, source.frequency_hz, noise, task.distribution, limit_n)
        self.summary, self.source = answers.Summary(self.estimator, model.doubts), source

    def header(self) -> str:
        return self.summary.header(self.source.kept)

    def rows(self, block: "FileRows") -> str:
        """Rows of the readings under load of a block."""
        from sensorgen.prediction.inverse import answers

        under_load = np.flatnonzero(~_beside(self.source, block)[0])
        presses = self.estimator.batch(block.impedance_ohm[under_load])
        self.summary.add(presses)
        prior = self.estimator.prior is not None
        return answers.rows([block.text[k] for k in under_load], presses, prior=prior)

    def result(self) -> "Documented":
        return self.summary.result()


def _beside(source: "Readings", block: "FileRows") -> tuple[Any, Any]:
    """Mask of the rows at rest, and the time of each [s]."""
    columns = dict(zip(source.numbers, block.numbers.T, strict=True))
    nothing = np.full(len(block.rows), np.nan)
    return np.nan_to_num(columns.get(_REST, nothing)) != 0, columns.get(_TIME, nothing)


def _at_rest(path: str, tones_hz: Any) -> tuple[Any, float]:
    """Readings at rest of a file, and the time of the last of them [s]."""
    from sensorgen.measure.readings import readings
    from sensorgen.prediction.calibration.rest import checked

    with readings(path, beside=(_TIME,)) as source:
        with within(path):
            order = checked(source.frequency_hz, tones_hz)
        blocks = list(source.blocks())
        if not blocks:
            raise BadInput(f"{path}: no readings; expected some with nothing on the sensor")
        times = blocks[-1].numbers[-1] if source.numbers else np.array([np.nan])
        return np.concatenate([block.impedance_ohm for block in blocks])[:, order], float(times[0])


def _of_design(
    design: "Design", task: Task, *, perfect: bool = False, law: Law = "", frames: ArrayFrames, body: BodyChoice,
) -> int:  # fmt: skip
    """Force and position by what the design alone allows.

    Parameters
    ----------
    perfect
        As if the sensor were exactly as predicted, and no reading at rest were needed: what noise alone leaves.
    """
    if design.layout:
        from sensorgen.cli import inversion

        return inversion.invert(design, task, frames, body)
    if frames.calibration:
        raise BadInput(f"--calibration is of an array; {design.name} is {design.shape}: invert its specimen by name")
    from sensorgen.prediction.query import Query

    query, printed = Query(law=law), body(design)
    if perfect:
        if task.rest_file:
            raise BadInput("--perfect needs no reading at rest; expected one of --perfect and --rest")
        return task.run((_REST,), lambda source: _Perfect(task, printed, query, source))

    def inverter(rest: Any, tones_hz: Any, noise: Any) -> _Made:
        from sensorgen.prediction.calibration import inversion
        from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N
        from sensorgen.prediction.sensor_model import sensor_model

        predicted, limit_n = sensor_model(printed, query)[0], task.force_limit_n or FORCE_LIMIT_N
        with within(task.measured):
            by = inversion.of_design(predicted, tones_hz, rest, noise, task.distribution, limit_n)
        return _Made(by, limit_n, 0, predicted.doubts)

    return task.run((_REST, _TIME), lambda source: _ByRatio(task, _Sensor(design.name, inverter), source))


def _of_specimen(name: str, task: Task, file: LogFile) -> int:
    """Force and position of a specimen that 'sensorgen calibrate' has calibrated."""
    from sensorgen.analysis.calibration import design_of, stored

    with file.existing() as log:
        names = [s.specimen for s in log.specimens()] if log else []
        try:
            of, design = design_of(log, name) if log else ("", None)
        except MissingValue:
            if name in names:
                raise
            design = None
        if log is None or design is None:
            raise UnknownName("shape or specimen", name, [*registry.names(shapes), *names])
        known = stored(log, of)
    if known is None:
        raise BadInput(
            f"{of} was never calibrated: sensorgen calibrate {of!r}, or sensorgen invert DESIGN for what its design "
            f"({design.name}) alone allows"
        )

    def inverter(rest: Any, tones_hz: Any, noise: Any) -> _Made:  # noqa: ARG001
        limit_n = task.force_limit_n or known.limit_n
        beyond = (f"forces above {known.force_n:.3g} N were not calibrated",) if limit_n > known.limit_n else ()
        by = known.inverter(noise, task.distribution, limit_n)
        return _Made(by, limit_n, known.posterior.presses, (*beyond, *known.allowance))

    sensor = _Sensor(of, inverter, known.model.frequency_hz, known.baseline)
    return task.run((_REST, _TIME), lambda source: _ByRatio(task, sensor, source))


class _Specimens(DesignGroup):
    """A word that is neither a shape nor a file is a specimen of the log."""

    def get_command(self, ctx: click.Context, name: str) -> click.Command:
        """The command for a shape, a design file, a calibration of an array, or a specimen."""
        if name.endswith(".npz"):
            return of_word(name, inversion.invert_calibrated)
        try:
            return super().get_command(ctx, name)
        except UnknownName:
            return of_word(name, _of_specimen, *FORMS)


command = _Specimens(
    "invert", _of_design, *FORMS, tip=True,
    help="Force and position behind the impedances in MEASURED.csv ('-' reads the standard input): one row per sample, "
    "columns re_ohm_1.1kHz and im_ohm_1.1kHz for every tone, 'rest' with 1 where nothing was on the sensor, and time_s "
    "if known. The first word is a specimen that was calibrated, or a design. Of an array: pressure maps of frames, "
    "CSV with columns r1c1, r1c2 ... [F], NPZ or HDF5. A calibration of an array, FILE.npz, in place of the design: "
    "pressures of any array's elements.",
)  # fmt: skip
