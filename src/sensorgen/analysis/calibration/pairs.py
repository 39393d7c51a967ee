"""Known presses out of the recordings of a specimen, each with the reading at rest before it."""

from collections.abc import Sequence
from dataclasses import replace

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
from sensorgen.prediction.calibration.specimen import Presses
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
    found, left_out = list[tuple[Real, Pairs | None, Complex, Real]](), list[str]()
    for row in rows:
        try:
            parts, rig = read_again(log, row)
            for part in parts:
                beside = joined_all(part, rig) if rig is not None else [None] * len(part)
                for recording, with_rig in zip(part, beside, strict=True):
                    done = processed(recording, with_rig, remove_drift=False)
                    left_out += [
                        f"recording {row.number}: {note}" for note in (done.pairs.left_out if done.pairs else ())
                    ]
                    pairs = done.pairs if done.by_force else None
                    if with_rig is not None and np.isnan(with_rig.offset_error_s):
                        left_out.append(f"recording {row.number}: {with_rig.clock_text()}")
                        pairs = pairs if np.isfinite(recording.epoch_s) else None
                    found.append((recording.tones_hz, pairs, *_rest(done.recording, done.pairs)))
        except SensorgenError as error:
            left_out.append(f"recording {row.number} left out: {error}")
    if not found:
        raise BadInput(f"{name}: none of {len(rows)} recordings can be used: {'; '.join(left_out)[:500]}")
    tones = found[0][0]
    same = []
    for other, pairs, rest, noise in found:
        with within(f"{name}: recordings at different tones; name those to use, --recording"):
            order = checked(other, tones)
        same.append((pairs and _ordered(pairs, order), rest[order], noise[order]))
    return _data(same), tones, left_out


def nothing_recorded() -> Data:
    """Of a specimen that was never on the bench: no press, nothing known at the tones of the thesis's multi-sine."""
    m, none = len(TONES_HZ), np.empty(0)
    nothing = np.empty((0, m))
    return Data(
        Presses(none, none, none, none), nothing.astype(complex), nothing, np.zeros(m, complex), np.full(m, _UNKNOWN)
    )


def _ordered(pairs: Pairs, order: NDArray[np.intp]) -> Pairs:
    columns = ("before_ohm", "pressed_ohm", "difference_ohm", "error_ohm")
    return replace(pairs, **{name: getattr(pairs, name)[:, order] for name in columns})


def _rest(recording: Recording, pairs: Pairs | None) -> tuple[Complex, Real]:
    """Mean reading with nothing on the sensor, and its relative standard error."""
    z = pairs.before_ohm if pairs else recording.impedance_ohm[recording.valid()]
    if not len(z):
        raise BadInput("no reading at rest; expected one or more")
    mean = z.mean(axis=0)
    return mean, np.maximum(z.std(axis=0) / np.abs(mean) / np.sqrt(2 * len(z)), _LEAST_ERROR)


def _data(found: Sequence[tuple[Pairs | None, Complex, Real]]) -> Data:
    weight = np.array([1 / noise**2 for _, _, noise in found])
    rest = np.einsum("km,km->m", weight, [np.log(mean) for _, mean, _ in found]) / weight.sum(0)
    m = len(rest)
    held = [pairs for pairs, _, _ in found if pairs is not None]

    def all_of(name: str) -> Real:
        return np.concatenate([getattr(pairs, name) for pairs in held]) if held else np.empty(0)

    force, peak = all_of("force_n"), all_of("peak_n")
    known = np.isfinite(force) & np.isfinite(all_of("position_mm"))
    before, pressed, error = (
        np.concatenate([getattr(pairs, name) for pairs in held])[known] if held else np.empty((0, m), complex)
        for name in ("before_ohm", "pressed_ohm", "error_ohm")
    )
    presses = Presses(
        force, all_of("position_mm") * M_PER_MM, 1 - force / np.maximum(peak, force),
        np.log10(np.maximum(all_of("hold_s"), _SHORTEST_S)),
    ).rows(known)  # fmt: skip
    noise = np.abs(error) / np.abs(before) / np.sqrt(2)
    means = np.sqrt((1 / all_of("samples")).sum(-1))[known] if held else np.empty(0)
    single = np.median(noise / means[:, None], axis=0) * np.sqrt(1.1) if len(noise) else None  # over ten at rest
    return Data(presses, np.log(pressed / before), noise, rest, 1 / np.sqrt(weight.sum(0)), single)
