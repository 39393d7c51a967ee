"""Calibrate specimens by what the log has of them, and keep the result there."""

import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.analysis.calibration.pairs import known_presses
from sensorgen.core.arrays import Real
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput, MissingValue, within
from sensorgen.core.version import __version__
from sensorgen.design.body import Body, BodyOf
from sensorgen.design.design import Design
from sensorgen.measure.log import BenchRun, Log, batches, notes
from sensorgen.measure.log import Calibration as Row
from sensorgen.measure.log.entries import Specimen
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.calibration import BEYOND, Calibration, from_json
from sensorgen.prediction.calibration.coverage import coverage_of, held_out
from sensorgen.prediction.calibration.fitting import Data, calibrated, gain, shared, widened
from sensorgen.prediction.calibration.inversion import Found
from sensorgen.prediction.calibration.rest import checked
from sensorgen.prediction.calibration.specimen import SpecimenModel, Spread
from sensorgen.prediction.inverse.verdict import NORMAL_90
from sensorgen.prediction.planning import sensor_model
from sensorgen.prediction.query import Query, Tip
from sensorgen.prediction.sensor_model import SensorModel

FEWEST_RECHECK = 3  # presses from which on a change can be told
_ALARM = 2.5758293035489004  # normal deviate of 0.5 %
_SURE = 2 * NORMAL_90  # widths of a 90 % interval, in standard deviations
_INSTRUMENT = ("lead", "stray", "force offset", "position offset")  # shared by specimens that are measured in one go


@dataclass(frozen=True, eq=False)
class Made:
    """A calibration, and what it was made of.

    Attributes
    ----------
    calibration : Calibration
        The result.
    data : Data
        Presses and rest.
    held : Found or None
        The presses, each found again from the others; None of too few.
    """

    calibration: Calibration
    data: Data
    held: Found | None

    def document(self) -> Iterator[Part]:
        """What the calibration says."""
        return self.calibration.document()

    def to_json(self) -> str:
        """The record of the log, and its parameters in their units."""
        return self.calibration.shown_json()


@dataclass(frozen=True, eq=False)
class Together:
    """Several results as one."""

    results: tuple["Made | Recheck", ...]

    def document(self) -> Iterator[Part]:
        """One after the other."""
        for one in self.results:
            yield from one.document()

    def to_json(self) -> str:
        """One object, or a list of several."""
        texts = [one.to_json().rstrip() for one in self.results]
        return (texts[0] if len(texts) == 1 else "[" + ",\n".join(texts) + "]") + "\n"


@dataclass(frozen=True)
class Bench:
    """Tip and force of the bench.

    Attributes
    ----------
    tip_m : float
        Length of the tip along the sensor [m].
    force_offset_n : (float, float)
        Mean and standard deviation of what the sensor feels above the force that the rig says [N].
    """

    tip_m: float = 5e-3
    force_offset_n: tuple[float, float] = (0.0, 0.1)

    def __post_init__(self) -> None:
        """Refuse what is no tip and no deviation."""
        if not self.tip_m > 0 or not self.force_offset_n[1] > 0:
            raise BadInput(
                f"a tip of {self.tip_m * 1e3:g} mm and an offset of {self.force_offset_n[0]:g} +- "
                f"{self.force_offset_n[1]:g} N; expected a length and a deviation above 0"
            )


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
            name = notes.specimen(specimen).specimen
    found = batches.designs(log).get(bound.design_id) if bound else None
    if found is None:
        with suppress(BadInput):
            found = notes.design_of(specimen)
    if found is None:
        raise MissingValue(
            f"no design is known of {specimen!r:.80}: sensorgen log specimen {specimen!r:.80} --design FILE binds it"
        )
    return name, found


def model_of(body: Body, frequency_hz: Real, bench: Bench) -> tuple[SpecimenModel, SensorModel]:
    """The model of a specimen, its spread from what the prediction leaves open."""
    found, _ = sensor_model(body, Query(tip=Tip(bench.tip_m)))
    mean, sd = bench.force_offset_n
    usual, c = Spread(), found.rest.capacitance
    ends = [np.log(end / r.value) for r in found.rest.resistance.values() for end in (r.lower, r.upper)]
    moduli = [v for v in found.values if v.quantity == "youngs_modulus_pa"]
    spread = replace(
        usual, force_n=sd, force_offset_n=mean,
        resistance=max(usual.resistance, float(np.ptp(ends)) / _SURE) if ends else usual.resistance,
        capacitance=max(usual.capacitance, float(np.log(c.upper / c.lower)) / _SURE),
        law=usual.law if moduli else 2 * usual.law,
    )  # fmt: skip
    return SpecimenModel(found.sensor, frequency_hz, spread), found


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
    found = from_json(row.data)
    again = f"calibrate it again: sensorgen calibrate {specimen!r}"
    if design_of(log, specimen)[1].id() != found.design_id:
        raise BadInput(f"{specimen} was calibrated as {found.design} ({found.design_id}), but is no longer; {again}")
    current = {run.uid for run in log.recordings(specimen=specimen)}
    if lost := set(found.recordings) - current:
        raise BadInput(f"{specimen}: {len(lost)} recordings of its calibration were withdrawn or corrected; {again}")
    return found


def calibrate(
    log: Log, specimens: Sequence[str], bench: Bench | None = None, recordings: Sequence[int] = (), *,
    body_of: BodyOf = bodies.default_body, step: Callable[[str], None] = lambda _: None,
) -> list[Made]:  # fmt: skip
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
    fitted: list[tuple[str, Design, SpecimenModel, Data, list[BenchRun], list[str]]] = []
    if len(set(specimens)) < len(specimens):
        raise BadInput(f"a specimen stands twice in {', '.join(specimens)}; expected each once")
    for specimen in specimens:
        step(specimen)
        name, design = design_of(log, specimen)
        rows = _chosen(log, name, recordings)
        data, tones, left_out = known_presses(log, name, rows)
        model, found = model_of(body_of(design), tones, bench)
        _check_presses(name, model, data)
        fitted.append((name, design, model, data, rows, [*left_out, *found.doubts]))
    posteriors = [calibrated(model, data) for _, _, model, data, _, _ in fitted]
    if len(posteriors) > 1:
        posteriors = shared([model for _, _, model, *_ in fitted], posteriors, _INSTRUMENT)
    made = []
    for (name, design, model, data, rows, left_out), posterior in zip(fitted, posteriors, strict=True):
        most = float(data.presses.force_n.max(initial=0.0)) or 6.0
        held = held_out(model, data, BEYOND * most, step)
        if len(fitted) > 1:
            left_out.append(f"lead, stray and offsets shared with {', '.join(f[0] for f in fitted if f[0] != name)}")
        calibration = Calibration(
            name, design.name, design.id(), model, posterior, most, held[0] if held else None,
            tuple(row.uid for row in rows), tuple(gain(model, data, posterior.at).tolist()), tuple(left_out),
        )  # fmt: skip
        made.append(Made(calibration, data, held[1] if held else None))
    return made


def _chosen(log: Log, name: str, numbers: Sequence[int]) -> list[BenchRun]:
    """Recordings of a specimen: those of these numbers, or all."""
    runs = log.recordings(specimen=name)
    if missing := sorted(set(numbers) - {run.number for run in runs}):
        has = ", ".join(str(run.number) for run in runs) or "none"
        raise BadInput(f"no recording {missing[0]} of {name}; expected one of its own: {has}")
    return [run for run in runs if not numbers or run.number in numbers]


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
    """

    calibration: Calibration
    presses: int
    inside: int
    z: float

    @property
    def alarm(self) -> bool:
        """Whether the old calibration no longer holds."""
        return abs(self.z) > _ALARM

    def document(self) -> Iterator[Part]:
        """What the presses say."""
        said = "ALARM: the calibration no longer held" if self.alarm else "the calibration still held"
        yield (
            f"{said}: {self.inside} of {self.presses} known forces in their 90 % intervals, their mean off by "
            f"{self.z:+.1f} standard errors"
        )
        yield from self.calibration.document()

    def to_json(self) -> str:
        """The mended calibration, and what the presses said of the old one."""
        return self.calibration.shown_json(recheck={"presses": self.presses, "inside": self.inside, "z": self.z,
                                                    "alarm": self.alarm})  # fmt: skip


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
    rows = [row for row in _chosen(log, name, recordings) if row.uid not in old.recordings]
    data, tones, left_out = known_presses(log, name, rows)
    with within(name):
        order = checked(tones, old.model.frequency_hz)
    data = replace(
        data, ratio=data.ratio[:, order], noise=data.noise[:, order], rest=data.rest[order],
        rest_noise=np.ones(len(tones)),  # the gain behind it is known from the first calibration
    )  # fmt: skip
    count = len(data.presses.force_n)
    if count < FEWEST_RECHECK:
        raise BadInput(
            f"{name}: {count} new known presses; expected {FEWEST_RECHECK} to 5, spread over force and place"
        )
    most = max(old.force_n, float(data.presses.force_n.max()))
    at = old.inverter(np.median(data.noise, axis=0), limit_n=BEYOND * most).batch(data.ratio)
    sd = np.ptp(at.force_90_n, axis=1) / _SURE
    z = float(np.mean((data.presses.force_n - at.force_n) / sd) * np.sqrt(count))
    posterior = calibrated(old.model, data, widened(old.model, old.posterior))
    new = replace(
        old, posterior=posterior, force_n=most, held_out=None,
        recordings=(*old.recordings, *(row.uid for row in rows)),
        notes=(*left_out, f"mended by {count} presses after a recheck"),
    )  # fmt: skip
    return Recheck(new, count, coverage_of(at, data.presses).force, z)


def rows(log: Log, calibrations: Sequence[Calibration]) -> list[Row]:
    """Rows of the log for calibrations."""
    found = []
    for made in calibrations:
        of = next((s for s in log.specimens() if s.specimen == made.specimen), Specimen(specimen=made.specimen))
        found.append(Row(
            **vars(of), uid=uuid.uuid4().hex, written=made.specimen, design_id=made.design_id, design=made.design,
            source="sensorgen calibrate", version=__version__, data=made.to_json(),
        ))  # fmt: skip
    return found
