"""Join a recording with the rig's log: force and position at every sample."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.rig import Offset, RigLog, estimated
from sensorgen.measure.recording.samples import Recording

_SILENT = 5.0  # median row distances beyond which the rig's log has a gap
_STAMPED_S = 1.0  # by which stamps of one computer differ at most: blocks that wait, instruments that take their time


@dataclass(frozen=True, eq=False)
class Joined:
    """A recording with force and position.

    Attributes
    ----------
    recording : Recording
        With the mark "rig error" where the rig's log has a gap or an error.
    force_n : (n,) array
        Measured force, or the set force where none was measured [N]; nan in gaps of the rig's log.
    set_force_n, set_position_mm : (n,) array
        Set force [N] and position [mm]; nan in gaps of the rig's log.
    offset_s : float
        To be added to the rig's time to get the recording's real time, in the middle of the run [s].
    offset_error_s : float
        Standard error of the offset [s]; nan where it cannot be estimated and the clocks are assumed to agree.
    skew, skew_error : float
        Rate of the recording's clock over the rig's, less 1, and its standard error; 0 unless significant [-].
    explained : float
        Share of the signal's variance that the force explains at that offset [-].
    notes : tuple of str
        Remarks.
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

    def clock_text(self) -> str:
        """The offset as text."""
        if np.isnan(self.offset_error_s):
            return f"clocks assumed to agree: no response to the force (it explains {self.explained:.1%} of the signal)"
        skew = f", skew {self.skew * 1e6:.3g} +- {self.skew_error * 1e6:.2g} ppm" if self.skew else ""
        return f"rig's clock + {self.offset_s:.4f} +- {self.offset_error_s:.2g} s{skew}"


def joined(recording: Recording, rig: RigLog, within_s: float = np.inf) -> Joined:
    """One recording joined with the rig's log; parameters and errors as :func:`joined_all`."""
    return joined_all((recording,), rig, within_s)[0]


def joined_all(recordings: Sequence[Recording], rig: RigLog, within_s: float = np.inf) -> tuple[Joined, ...]:
    """All lock-ins of a file, each joined with the rig's log.

    They share one clock: the offset with the least standard error is used for all of them, also for a lock-in that
    does not respond to the force.

    Parameters
    ----------
    recordings : sequence of Recording
        Recordings of the lock-ins.
    rig : RigLog
        Log of the rig; rows with errors are ignored.
    within_s : float
        Largest offset of the clocks; if not given, any offset with half of the shorter record in common, or a second
        where one computer stamped both [s].

    Raises
    ------
    BadInput
        Too few samples or rows; no response to the force, and no common clock to assume instead.
    """
    common_clock = all(np.isfinite(one.epoch_s) for one in recordings)
    stamped = common_clock and rig.stamped
    within_s = min(within_s, _STAMPED_S) if stamped else within_s
    times = [one.real_s() if common_clock else one.time_s for one in recordings]
    best = _best(recordings, times, rig, within_s)
    if best.by_chance or (stamped and abs(best.offset_s) > within_s):  # its refinement looks beyond
        if not common_clock and not _overlap(times[0], rig):
            raise BadInput(
                f"the force explains {best.explained:.1%} of the readings: too little to find the offset of the "
                "clocks; expected time stamps, or times of both files that count from the same moment"
            )
        best = replace(best, offset_s=0.0, error_s=np.nan, skew=0.0, skew_error=np.nan)
    return tuple(_joined(one, rig, time, best) for one, time in zip(recordings, times, strict=True))


def _best(recordings: Sequence[Recording], times: Sequence[Real], rig: RigLog, within_s: float) -> Offset:
    """Offset with the least standard error; one of a lock-in that responds goes before."""
    offsets: list[Offset] = []
    faults: list[BadInput] = []
    for one, time in zip(recordings, times, strict=True):
        try:
            offsets.append(estimated(one, time, rig, within_s))
        except BadInput as error:  # no fault where another lock-in responds
            faults.append(error)
    if not offsets:
        raise faults[0]
    return min(offsets, key=lambda offset: (offset.by_chance, offset.error_s))


def _overlap(time: Real, rig: RigLog) -> bool:
    """True if half of the shorter record lies in the other, as with clocks that agree."""
    rows = rig.sound()[0]
    common = min(time[-1], rows[-1]) - max(time[0], rows[0])
    return bool(common >= 0.5 * min(np.ptp(time), np.ptp(rows)))


def _joined(recording: Recording, rig: RigLog, time: Real, offset: Offset) -> Joined:
    """Columns of the rig at the samples' times."""
    at = time - offset.offset_s - offset.skew * (time - offset.middle_s)
    rows, force, set_force, position = rig.sound()
    before = np.searchsorted(rows, at, side="right") - 1
    inside = (before >= 0) & (at <= rows[-1])
    last = np.clip(before, 0, len(rows) - 1)
    step = float(np.median(np.diff(rows)))
    after = np.minimum(last + 1, len(rows) - 1)
    silent = ~inside | ((rows[after] - rows[last] > _SILENT * step) & (at - rows[last] > step))
    mask = np.where(silent, np.nan, 1.0)
    finite = np.isfinite(rig.time_s)
    order = np.argsort(rig.time_s[finite], kind="stable")
    every, error = rig.time_s[finite][order], rig.error[finite][order]
    later = np.clip(np.searchsorted(every, at), 1, len(every) - 1)
    nearest = np.where(at - every[later - 1] <= every[later] - at, later - 1, later)
    marks = dict(recording.marks)
    marks["rig error"] = marks["rig error"] | silent | error[nearest]  # of the nearest row
    notes = list(rig.notes)
    if silent.any():
        notes.append(f"{np.count_nonzero(silent)} samples while the rig was silent")
    return Joined(
        replace(recording, marks=marks), np.interp(at, rows, force) * mask, set_force[last] * mask,
        position[last] * mask, offset.offset_s, offset.error_s, offset.skew, offset.skew_error,
        offset.explained, tuple(notes),
    )  # fmt: skip
