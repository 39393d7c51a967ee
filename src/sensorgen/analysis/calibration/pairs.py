"""Known presses out of the recordings of a specimen, each with the reading at rest before it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, SensorgenError, within
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.log import BenchRun, Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import joined_all
from sensorgen.measure.recording.samples import Recording
from sensorgen.measure.signal.presses import Pairs
from sensorgen.measure.signal.run import processed
from sensorgen.prediction.calibration.fitting import Data
from sensorgen.prediction.calibration.rest import checked
from sensorgen.prediction.calibration.specimen import Presses, no_presses
from sensorgen.prediction.query import TONES_HZ

_LEAST_ERROR = 3e-4  # of a mean at rest: from one recording to the next it differs by more than its noise
_UNKNOWN = 1e3  # standard deviation of what was never measured [-]
_SHORTEST_S = 0.1  # of a hold: its logarithm counts


def known_presses(log: Log, name: str, rows: Sequence[BenchRun]) -> tuple[Data, Real, list[str]]:
    """Presses of known force and position, the tones, and what was left out.

    Parameters
    ----------
    log : Log
        An open one.
    name : str
        Of the specimen.
    rows : sequence of BenchRun
        Its recordings.

    Raises
    ------
    BadInput
        No recording that can be used; recordings of different tones.
    """
    if not rows:
        raise BadInput(
            f"the log has no recording of {name}; expected one: sensorgen log bench {name!r} LCR_FILE RIG_FILE"
        )
    runs, left_out = list[_Run](), list[str]()
    for row in rows:
        try:
            runs += _runs(log, row, left_out)
        except SensorgenError as error:
            left_out.append(f"recording {row.number} left out: {error}")
    if not runs:
        raise BadInput(f"{name}: none of {len(rows)} recordings can be used: {'; '.join(left_out)[:500]}")
    with within(f"{name}: recordings at different tones; name those to use, --recording"):
        alike = [run.ordered(checked(run.tones_hz, runs[0].tones_hz)) for run in runs]
    return _data(alike), runs[0].tones_hz, left_out


@dataclass(frozen=True, eq=False)
class _Run:
    """Tones of a recording, its known presses, and its mean reading at rest with that one's relative error."""

    tones_hz: Real
    pairs: Pairs | None
    rest_ohm: Complex
    noise: Real

    def ordered(self, order: NDArray[np.intp]) -> "_Run":
        """The run with its tones in an order."""
        columns = ("before_ohm", "pressed_ohm", "difference_ohm", "error_ohm")
        pairs = self.pairs and replace(self.pairs, **{name: getattr(self.pairs, name)[:, order] for name in columns})
        return _Run(self.tones_hz[order], pairs, self.rest_ohm[order], self.noise[order])


def _runs(log: Log, row: BenchRun, left_out: list[str]) -> Iterator[_Run]:
    """Runs of a recording; notes on what is left out of them."""
    parts, rig = read_again(log, row)
    for part in parts:
        for recording, with_rig in zip(
            part, joined_all(part, rig) if rig is not None else [None] * len(part), strict=True
        ):
            result = processed(recording, with_rig, remove_drift=False)
            left_out += [f"recording {row.number}: {note}" for note in (result.pairs.left_out if result.pairs else ())]
            pairs = result.pairs if result.by_force else None
            if with_rig is not None and np.isnan(with_rig.offset_error_s):
                left_out.append(f"recording {row.number}: {with_rig.clock_text()}")
                pairs = pairs if np.isfinite(recording.epoch_s) else None
            yield _Run(recording.tones_hz, pairs, *_rest(result.recording, result.pairs))


def nothing_recorded() -> Data:
    """Of a specimen that was never on the bench: no press, nothing known at the tones of the thesis's multi-sine."""
    m = len(TONES_HZ)
    return Data.unread(no_presses(), np.zeros(m), rest_noise=np.full(m, _UNKNOWN))


def _rest(recording: Recording, pairs: Pairs | None) -> tuple[Complex, Real]:
    """Mean reading with nothing on the sensor, and its relative standard error."""
    z = pairs.before_ohm if pairs else recording.impedance_ohm[recording.valid()]
    if not len(z):
        raise BadInput("no reading at rest; expected one or more")
    mean = z.mean(axis=0)
    return mean, np.maximum(z.std(axis=0) / np.abs(mean) / np.sqrt(2 * len(z)), _LEAST_ERROR)


def _data(runs: Sequence[_Run]) -> Data:
    weight = np.array([1 / run.noise**2 for run in runs])
    rest = np.einsum("km,km->m", weight, [np.log(run.rest_ohm) for run in runs]) / weight.sum(0)
    rest_noise, pairs = 1 / np.sqrt(weight.sum(0)), [run.pairs for run in runs if run.pairs is not None]
    if not pairs:
        return Data.unread(no_presses(), np.zeros(len(rest)), rest, rest_noise)

    def all_of(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(one, name) for one in pairs])

    force, position, peak = (all_of(name) for name in ("force_n", "position_mm", "peak_n"))
    known = np.isfinite(force) & np.isfinite(position)
    before, pressed, error = (all_of(name)[known] for name in ("before_ohm", "pressed_ohm", "error_ohm"))
    decades = np.log10(np.maximum(all_of("hold_s"), _SHORTEST_S))
    presses = Presses(force, position * M_PER_MM, 1 - force / np.maximum(peak, force), decades).rows(known)
    noise = np.abs(error) / np.abs(before) / np.sqrt(2)
    means = np.sqrt((1 / all_of("samples")).sum(-1))[known]
    single = np.median(noise / means[:, None], axis=0) * np.sqrt(1.1) if len(noise) else None  # over ten at rest
    return Data(presses, np.log(pressed / before), noise, rest, rest_noise, single)
