"""Process a recording: join it with the rig, filter it, remove its drift, and average its presses."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.join import Joined, joined
from sensorgen.measure.recording.rig import RigLog
from sensorgen.measure.recording.samples import Complex, Real, Recording
from sensorgen.measure.signal import drift, lowpass, presses


@dataclass(frozen=True, eq=False)
class Processed:
    """A processed recording.

    Attributes
    ----------
    recording : Recording
        With the rig's errors among its marks.
    force_n : (n,) array
        Force at each sample [N]; nan where unknown.
    filtered_s, filtered_ohm : (k,), (k, m) array
        Low-passed forward and backward on even steps, with drift [s], [ohm].
    drift : Drift or None
        Drift removed from the presses' readings; None if none was.
    pairs : Pairs or None
        Readings before and under each press; None where there are none.
    by_force : bool
        Whether presses were detected by the rig's force; else by the readings alone, force and position unknown.
    notes : tuple of str
        Offset of the clocks, presses left out, other remarks.
    """

    recording: Recording
    force_n: Real
    filtered_s: Real
    filtered_ohm: Complex
    drift: drift.Drift | None
    pairs: presses.Pairs | None
    by_force: bool
    notes: tuple[str, ...]


def processed(
    recording: Recording, rig: RigLog | Joined | None = None, *, remove_drift: bool = True, law: str = "",
    cutoff_hz: float = lowpass.CUTOFF_HZ,
) -> Processed:  # fmt: skip
    """Process a recording.

    Parameters
    ----------
    recording : Recording
        Recording of one lock-in.
    rig : RigLog or Joined or None
        Log of the rig, or the recording joined with it; without it, presses are detected in the readings.
    remove_drift : bool
        Whether to fit the drift between presses and remove it from the presses' readings.
    law : str
        Law of drift, of :data:`sensorgen.measure.signal.drift.LAWS`; the best by BIC if not given, without a log of
        the rig among those that need no force.
    cutoff_hz : float
        Cut-off frequency of the low-pass [Hz].

    Raises
    ------
    BadInput
        Clocks that cannot be joined; fewer than 16 valid samples.
    OutOfRange
        A cut-off frequency that is not between 0 and half the sampling rate.
    UnknownName
        No such law of drift.
    """
    if law:
        drift.check(law)
    notes, one = list(recording.source.notes), recording
    force = position = np.full(len(one.time_s), np.nan)
    if rig is not None:
        beside = joined(one, rig) if isinstance(rig, RigLog) else rig
        one, force, position = beside.recording, beside.force_n, beside.set_position_mm
        notes += [beside.clock_text(), *beside.notes]
    valid = one.valid()
    filtered = lowpass.filtered(one, cutoff_hz)
    if rig:
        spans = presses.by_force(one.time_s, force)
    else:
        spans = presses.by_readings(one.time_s[valid], one.impedance_ohm[valid])
    removed, pairs, z = None, None, one.impedance_ohm
    if remove_drift and spans:
        among = (law,) if law else drift.LAWS if rig else drift.BY_TIME
        unit = np.zeros(len(one.time_s))
        for start, end in spans:
            unit[np.searchsorted(one.time_s, start) : np.searchsorted(one.time_s, end, side="right")] = 1.0
        pressing = force if rig else unit  # 1 N, for laws of drift that need only the times of presses
        try:
            removed = drift.fitted(one.time_s, z, valid, pressing, among=tuple(among))
            z = removed.removed(one.time_s, z)
        except BadInput as error:
            notes.append(f"drift not removed: {error}")
    try:
        pairs = presses.pairs(one.time_s, z, valid, spans, force, position) if spans else None
        notes += [f"left out: {press}" for press in pairs.left_out] if pairs else ["nothing pressed"]
    except BadInput as error:
        notes.append(f"no presses: {error}")
    return Processed(one, force, *filtered, removed, pairs, rig is not None, tuple(notes))
