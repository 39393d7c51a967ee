"""Recording and rig on one time: what pressed when each sample was taken."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.offset import Offset, estimated
from sensorgen.measure.recording.rig import RigLog
from sensorgen.measure.recording.samples import Real, Recording

_GAP = 5.0  # typical distances of the rig's rows: beyond it the rig is silent


@dataclass(frozen=True, eq=False)
class Joined:
    """What was measured, and what was done to the sensor then.

    Attributes
    ----------
    recording : Recording
        With the mark "rig error" where the rig was silent or in trouble.
    force_n : (n,) array
        Measured force, or the set one where none was measured, at each sample [N]; nan where the rig was silent.
    set_force_n, set_position_mm : (n,) array
        What the rig was told at that time [N], [mm].
    offset_s : float
        To be added to the rig's time to have the recording's real time, in the middle of the run [s].
    offset_error_s : float
        Its standard error [s]; nan where the clocks were believed because the sensor does not tell.
    skew, skew_error : float
        Rate of the recording's clock over the rig's, less 1; 0 unless it stands out of its error [-].
    explained : float
        Share of the signal's variance that the force explains at that offset [-].
    notes : tuple of str
        In words.
    """

    recording: Recording
    force_n: Real
    set_force_n: Real
    set_position_mm: Real
    offset_s: float
    offset_error_s: float
    skew: float
    skew_error: float
    explained: float
    notes: tuple[str, ...] = ()

    def words(self) -> str:
        """The offset, as a person reads it."""
        if np.isnan(self.offset_error_s):
            return f"the clocks are believed: the force explains {self.explained:.1%} of the signal and tells no offset"
        skew = f", skew {self.skew * 1e6:.3g} +- {self.skew_error * 1e6:.2g} ppm" if self.skew else ""
        return f"rig's clock + {self.offset_s:.4f} +- {self.offset_error_s:.2g} s{skew}"


def joined(recording: Recording, rig: RigLog, within_s: float = np.inf) -> Joined:
    """A recording with the rig's log beside it; parameters and errors as :func:`joined_all`."""
    return joined_all((recording,), rig, within_s)[0]


def joined_all(recordings: Sequence[Recording], rig: RigLog, within_s: float = np.inf) -> tuple[Joined, ...]:
    """All lock-ins of a file, each with the rig's log beside it.

    They share one clock: the lock-in that tells its offset with the least error tells it for all of them, also for one
    that no force moves.

    Parameters
    ----------
    recordings : sequence of Recording
        What the instrument measured.
    rig : RigLog
        What the rig did meanwhile; its rows with errors count for nothing.
    within_s : float
        How far the two clocks may be apart at most [s]; everything that leaves half of the shorter one to compare, if
        not given.

    Raises
    ------
    BadInput
        Too little to compare; no force that moves the readings, and no common clock to believe instead.
    """
    common = all(np.isfinite(one.epoch_s) for one in recordings)
    times = [one.real_s() if common else one.time_s for one in recordings]
    found = _surest(recordings, times, rig, within_s)
    if found.by_chance:
        if not common:
            raise BadInput(
                f"the force explains {found.explained:.1%} of the readings: too little to find the offset of the "
                "clocks, and the recording has no time stamps to go by"
            )
        found = found._replace(offset_s=0.0, error_s=np.nan, skew=0.0, skew_error=np.nan)
    return tuple(_beside(one, rig, time, found) for one, time in zip(recordings, times, strict=True))


def _surest(recordings: Sequence[Recording], times: Sequence[Real], rig: RigLog, within_s: float) -> Offset:
    """The offset by the lock-in that tells it best; a dead one is no fault where another lives."""
    found: list[Offset] = []
    faults: list[BadInput] = []
    for one, time in zip(recordings, times, strict=True):
        try:
            found.append(estimated(one, time, rig, within_s))
        except BadInput as error:
            faults.append(error)
    if not found:
        raise faults[0]
    return min(found, key=lambda offset: (offset.by_chance, offset.error_s))


def _beside(recording: Recording, rig: RigLog, time: Real, found: Offset) -> Joined:
    """The rig's columns at the recording's times."""
    at = time - found.offset_s - found.skew * (time - found.middle_s)
    good = ~rig.error
    rows = rig.time_s[good]
    where = np.searchsorted(rows, at, side="right") - 1
    known = (where >= 0) & (at <= rows[-1])
    held = np.clip(where, 0, len(rows) - 1)
    step = float(np.median(np.diff(rows)))
    after = np.minimum(held + 1, len(rows) - 1)
    silent = ~known | ((rows[after] - rows[held] > _GAP * step) & (at - rows[held] > step))
    troubled = _troubled(rig, at)
    force = np.where(np.isfinite(rig.force_n), rig.force_n, rig.set_force_n)[good]
    blank = np.where(silent, np.nan, 1.0)
    marks = dict(recording.marks) | {"rig error": recording.marks["rig error"] | silent | troubled}
    notes = list(rig.notes)
    if silent.any():
        notes.append(f"{np.count_nonzero(silent)} samples while the rig was silent")
    return Joined(
        replace(recording, marks=marks), np.interp(at, rows, force) * blank, rig.set_force_n[good][held] * blank,
        rig.set_position_mm[good][held] * blank, found.offset_s, found.error_s, found.skew, found.skew_error,
        found.explained, tuple(notes),
    )  # fmt: skip


def _troubled(rig: RigLog, at: Real) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples to which the nearest row before or after has an error."""
    finite = np.isfinite(rig.time_s)
    order = np.argsort(rig.time_s[finite], kind="stable")
    rows, bad = rig.time_s[finite][order], rig.error[finite][order]
    after = np.clip(np.searchsorted(rows, at), 1, len(rows) - 1)
    nearest = np.where(at - rows[after - 1] <= rows[after] - at, after - 1, after)
    return np.asarray(bad[nearest])
