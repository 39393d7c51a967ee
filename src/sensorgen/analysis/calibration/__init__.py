"""Calibrate specimens by what the log has of them, and keep the result there."""

import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.analysis.calibration.readings import known_presses, nothing_recorded, readings_of
from sensorgen.core.arrays import Real
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput, MissingValue, within
from sensorgen.core.version import __version__
from sensorgen.design.body import BodyOf
from sensorgen.design.design import Design
from sensorgen.measure.log import BenchRun, Log, Reading, notes, prints
from sensorgen.measure.log import Calibration as Row
from sensorgen.measure.log.entries import Specimen
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.calibration import BEYOND, Calibration, coverage_of, from_json, held_out
from sensorgen.prediction.calibration.fitting import Data, Posterior, calibrated, gain, loosened, shared, widened
from sensorgen.prediction.calibration.inversion import InvertedPresses
from sensorgen.prediction.calibration.materials import links
from sensorgen.prediction.calibration.rest import RestChange, checked
from sensorgen.prediction.calibration.specimen import SURE, SpecimenModel
from sensorgen.prediction.calibration.specimen import Bench as Bench
from sensorgen.prediction.calibration.specimen import spread_of as spread_of
from sensorgen.prediction.inverse.verdict import chi2_limit
from sensorgen.prediction.query import TONES_HZ, Query
from sensorgen.prediction.sensor_model import SensorModel, sensor_model

FEWEST_RECHECK = 3  # presses from which on a change can be told
_ALARM = 2.5758293035489004  # normal deviate of 0.5 %
_BAKED = {True: "baked", False: "not baked", None: "of unknown bake"}
_INSTRUMENT = ("lead", "stray", "force offset", "position offset")  # shared by specimens that are measured in one go


@dataclass(frozen=True, eq=False)
class CalibrationWork:
    """A calibration, and what it was made of.

    Attributes
    ----------
    calibration : Calibration
        The result.
    data : Data
        Presses and rest.
    held : InvertedPresses or None
        The presses, each found again from the others; None of too few.
    """

    calibration: Calibration
    data: Data
    held: InvertedPresses | None

    def document(self) -> Iterator[Part]:
        """Paragraphs and tables of the calibration."""
        return self.calibration.document()

    def to_json(self) -> str:
        """The record of the log, and its parameters in their units."""
        return self.calibration.shown_json()


@dataclass(frozen=True, eq=False)
class Together:
    """Several results as one."""

    results: tuple["CalibrationWork | Recheck", ...]

    def document(self) -> Iterator[Part]:
        """One after the other."""
        for one in self.results:
            yield from one.document()

    def to_json(self) -> str:
        """One object, or a list of several."""
        texts = [one.to_json().rstrip() for one in self.results]
        return (texts[0] if len(texts) == 1 else "[" + ",\n".join(texts) + "]") + "\n"


def design_of(log: Log, specimen: str) -> tuple[str, Design]:
    """A specimen's name in the log, and the design that it was printed of.

    Raises
    ------
    BadInput
        No such specimen.
    MissingValue
        It is bound to no design.
    """
    bound = log.bound(specimen)
    name = bound.specimen if bound else specimen
    if bound is None:
        with suppress(BadInput):
            name = notes.named(specimen).specimen.specimen
    design = prints.designs(log).get(bound.design_id) if bound else None
    if design is None:
        with suppress(BadInput):
            design = notes.design_of(specimen)
    if design is None:
        raise MissingValue(
            f"no design is known of {specimen!r:.80}: sensorgen log specimen {specimen!r:.80} --design FILE binds it"
        )
    return name, design


@dataclass(frozen=True, eq=False)
class SpecimenEntries:
    """Entries of the log about a specimen, and the model that it is compared with.

    Attributes
    ----------
    specimen : str
        Its name.
    design : Design
        What it was printed of.
    predicted : SensorModel
        Of its body.
    model : SpecimenModel
        That, with all in which specimens differ.
    data : Data
        Presses, rest, readings of meters.
    rows : tuple of str
        Of the log.
    left_out, notes : tuple of str
        What was left out; all remarks on the data.
    """

    specimen: str
    design: Design
    predicted: SensorModel
    model: SpecimenModel
    data: Data
    rows: tuple[str, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def recorded(self) -> bool:
        """True if the bench measured it."""
        return bool((self.data.rest_noise < 1).all())


def known(
    log: Log, specimen: str, bench: Bench, recordings: Sequence[int] = (), body_of: BodyOf = bodies.default_body
) -> SpecimenEntries:
    """Gather what the log has of a specimen; parameters and errors as of :func:`calibrate`."""
    name, design = design_of(log, specimen)
    rows = _chosen(log, name, recordings)
    body = body_of(design)
    predicted, _ = sensor_model(body, Query(tip=bench.tip(design)))
    meter, read, unfit = readings_of(log, name, body_of, predicted.sensor.common_resistivity_ohm_m())
    if rows or meter is None:
        with within("; ".join(unfit)):
            data, tones, left_out = known_presses(log, name, rows)
        notes = list(left_out)
    else:
        data, tones, left_out = nothing_recorded(), np.array(TONES_HZ), []
        notes = ["no recording: R, C and leak by meters alone"]
    left_out += unfit
    notes += unfit
    if simulated := [str(row.number) for row in rows if row.simulated]:
        notes.insert(0, f"simulated, not measured: recording{'s' * (len(simulated) > 1)} {', '.join(simulated)}")
    model = SpecimenModel(predicted.sensor, tones, spread_of(predicted, bench))
    _check_presses(name, model, data)
    if meter:
        count = "1 reading of a meter counts" if len(read) == 1 else f"{len(read)} readings of meters count"
        notes.append(f"{count}, {_BAKED[read[-1].baked]}")
    uids = (*(row.uid for row in rows), *(one.uid for one in read))
    return SpecimenEntries(
        name, design, predicted, model, replace(data, meter=meter), uids, tuple(left_out), (*notes, *predicted.doubts)
    )


def stored(log: Log, specimen: str) -> Calibration | None:
    """The latest calibration of a specimen that the log has, or None.

    Raises
    ------
    BadInput
        One of another design than the specimen has now, or one of recordings that were withdrawn.
    """
    row = next(iter(log.entries(Row, last=1, specimen=specimen)), None)
    if row is None:
        return None
    calibration = from_json(row.data)
    again = f"calibrate it again: sensorgen calibrate {specimen!r}"
    if design_of(log, specimen)[1].id() != calibration.design_id:
        raise BadInput(
            f"{specimen} was calibrated as {calibration.design} ({calibration.design_id}), but is no longer; {again}"
        )
    current = {row.uid for row in (*log.recordings(specimen=specimen), *log.entries(Reading, specimen=specimen))}
    if lost := set(calibration.rows) - current:
        raise BadInput(
            f"{specimen}: {len(lost)} recordings or readings of its calibration were withdrawn or corrected; {again}"
        )
    return calibration


def calibrate(
    log: Log, specimens: Sequence[str], bench: Bench | None = None, recordings: Sequence[int] = (), *,
    body_of: BodyOf = bodies.default_body, step: Callable[[str], None] = lambda _: None,
) -> list[CalibrationWork]:  # fmt: skip
    """Calibrate specimens that were measured in one go: they share the bench.

    Parameters
    ----------
    log : Log
        An open one.
    specimens : sequence of str
        Their names.
    bench : Bench, optional
        Its tip and force.
    recordings : sequence of int
        Numbers of the only recordings to use; all of the specimens if empty.
    body_of : callable
        Makes the body of a design.
    step : callable
        Called with what is done next.

    Raises
    ------
    BadInput, MissingValue
        As :func:`design_of`; nothing recorded of a specimen; recordings at different frequencies; known presses beyond
        the sensor.
    """
    bench = bench or Bench()
    if len(set(specimens)) < len(specimens):
        raise BadInput(f"a specimen stands twice in {', '.join(specimens)}; expected each once")
    _check_numbers(log, [design_of(log, specimen)[0] for specimen in specimens], recordings)
    entries = []
    for specimen in specimens:
        step(specimen)
        entries.append(known(log, specimen, bench, recordings, body_of))
    posteriors = [calibrated(one.model, one.data) for one in entries]
    if len(posteriors) > 1:
        posteriors = shared([one.model for one in entries], posteriors, _INSTRUMENT)
    return [_work(one, posterior, entries, step) for one, posterior in zip(entries, posteriors, strict=True)]


def _work(
    one: SpecimenEntries, posterior: Posterior, entries: Sequence[SpecimenEntries], step: Callable[[str], None]
) -> CalibrationWork:  # fmt: skip
    """Calibration by a posterior, tested on presses that are held out of it."""
    most = float(one.data.presses.force_n.max(initial=0.0)) or 6.0
    coverage, inverted = held_out(one.model, one.data, BEYOND * most, step) or (None, None)
    others = ", ".join(other.specimen for other in entries if other is not one)
    notes = (*one.notes, *_off(one, posterior.at))
    notes += (f"lead, stray and offsets shared with {others}",) if others else ()
    gains = tuple(gain(one.model, one.data, posterior.at).tolist()) if one.recorded else ()
    calibration = Calibration(
        one.specimen, one.design.name, one.design.id(), one.model, posterior, most, coverage, one.rows, gains, notes,
        links(one.predicted),
    )  # fmt: skip
    return CalibrationWork(replace(calibration, notes=(*notes, *calibration.departures())), one.data, inverted)


def _chosen(log: Log, name: str, numbers: Sequence[int]) -> list[BenchRun]:
    """Recordings of a specimen: those of these numbers, or all."""
    return [run for run in log.recordings(specimen=name) if not numbers or run.number in numbers]


def _check_numbers(log: Log, names: Sequence[str], numbers: Sequence[int]) -> None:
    """Refuse numbers of recordings that none of the specimens has."""
    own = sorted(run.number for name in names for run in log.recordings(specimen=name))
    if missing := sorted(set(numbers) - set(own)):
        has = ", ".join(map(str, own)) or "none"
        raise BadInput(f"no recording {missing[0]} of {', '.join(names)}; expected one of its own: {has}")


def _off(one: SpecimenEntries, at: Real) -> tuple[str, ...]:
    """A remark on readings of meters that no specimen of the design can have."""
    meter = one.data.meter
    off = meter.off(one.model, at) if meter else np.zeros(1)
    if off @ off <= chi2_limit(np.array(len(off))):
        return ()
    return ("the readings of meters fit no specimen of this design: check their signs, units and frequencies",)


def _check_presses(name: str, model: SpecimenModel, data: Data) -> None:
    at, length = data.presses.position_m, model.sensor.length_m
    if ((at < 0) | (at > length)).any():
        worst = float(at[(at < 0) | (at > length)][0])
        raise BadInput(
            f"{name}: a press at {worst * 1e3:.4g} mm, but the sensor is {length * 1e3:.4g} mm long; expected the "
            "centre of the tip from the contacts' end on"
        )


@dataclass(frozen=True, eq=False)
class Recheck:
    """Known presses compared with a calibration.

    Attributes
    ----------
    calibration : Calibration
        Mended by the presses.
    presses, inside : int
        Known ones, and those of them in their intervals by the old calibration.
    z : float
        Mean of force less median over its standard deviation, times the root of the number of presses [-].
    change : RestChange
        Of the reading at rest.
    """

    calibration: Calibration
    presses: int
    inside: int
    z: float
    change: RestChange

    @property
    def alarm(self) -> bool:
        """The old calibration no longer holds."""
        return abs(self.z) > _ALARM or bool(self.change)

    def document(self) -> Iterator[Part]:
        """Paragraphs and tables of the presses."""
        verdict = "ALARM: the calibration no longer held" if self.alarm else "the calibration still held"
        yield (
            f"{verdict}: {self.inside} of {self.presses} known forces in their 90 % intervals, their mean off by "
            f"{self.z:+.1f} standard errors"
        )
        if self.change:
            yield f"{self.change.words}; mended by {self.presses} presses alone, 30 make a calibration of it"
        yield from self.calibration.document()

    def to_json(self) -> str:
        """The mended calibration, and what the presses said of the old one."""
        return self.calibration.shown_json(recheck={"presses": self.presses, "inside": self.inside, "z": self.z,
                                                    "alarm": self.alarm,
                                                    "at_rest": self.change.words if self.change else ""})  # fmt: skip


def recheck(log: Log, specimen: str, recordings: Sequence[int]) -> Recheck:
    """Compare a calibration with a few new known presses, and mend it by them.

    Parameters
    ----------
    log : Log
        An open one.
    specimen : str
        Its name.
    recordings : sequence of int
        Numbers of the recordings with the presses; those after the calibration's if empty.

    Raises
    ------
    BadInput
        Never calibrated; recorded at different frequencies; fewer presses than ``FEWEST_RECHECK``.
    """
    name, _ = design_of(log, specimen)
    old = stored(log, name)
    if old is None:
        raise BadInput(f"{name} was never calibrated: sensorgen calibrate {name!r} first")
    _check_numbers(log, [name], recordings)
    rows = [row for row in _chosen(log, name, recordings) if row.uid not in old.rows]
    data, tones, left_out = known_presses(log, name, rows)
    with within(name):
        order = checked(tones, old.model.frequency_hz)
    data = replace(
        data, ratio=data.ratio[:, order], noise=data.noise[:, order], rest=data.rest[order],
        rest_noise=data.rest_noise[order],
    )  # fmt: skip
    count = len(data.presses.force_n)
    if count < FEWEST_RECHECK:
        raise BadInput(
            f"{name}: {count} new known presses; expected {FEWEST_RECHECK} to 5, spread over force and place"
        )
    most = max(old.force_n, float(data.presses.force_n.max()))
    known = replace(old, rechecked=True)  # without the allowance that these presses decide on
    at = known.inverter(np.median(data.noise, axis=0), limit_n=BEYOND * most).batch(data.ratio)
    sd = np.ptp(at.force_90_n, axis=1) / SURE
    z = float(np.mean((data.presses.force_n - at.force_n) / sd) * np.sqrt(count))
    change = old.baseline.change(np.exp(data.rest), data.rest_noise)
    if change:
        posterior = calibrated(old.model, data)
    else:  # the gain behind the reading at rest is known from the first calibration
        start = widened(old.model, old.posterior) if abs(z) > _ALARM else loosened(old.model, old.posterior)
        posterior = calibrated(old.model, replace(data, rest_noise=np.ones(len(tones))), start)
    new = replace(
        known, posterior=posterior, force_n=most, held_out=None, rows=(*old.rows, *(row.uid for row in rows)),
        gain=tuple(gain(old.model, data, posterior.at).tolist()),
    )  # fmt: skip
    new = replace(new, notes=(*left_out, f"mended by {count} presses after a recheck", *new.departures()))
    return Recheck(new, count, coverage_of(at, data.presses).force, z, change)


def rows(log: Log, calibrations: Sequence[Calibration]) -> list[Row]:
    """Rows of the log for calibrations."""
    known, logged = {one.specimen: one for one in reversed(log.specimens())}, []
    for one in calibrations:
        of = known.get(one.specimen, Specimen(specimen=one.specimen))
        logged.append(Row(
            **vars(of), uid=uuid.uuid4().hex, written=one.specimen, design_id=one.design_id, design=one.design,
            source="sensorgen calibrate", version=__version__, data=one.to_json(),
        ))  # fmt: skip
    return logged
