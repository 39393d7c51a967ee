"""A recording worked up in one go: joined with the rig, filtered, freed of drift, and cut into presses."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.join import Joined, joined
from sensorgen.measure.recording.rig import RigLog
from sensorgen.measure.recording.samples import Bools, Complex, Real, Recording
from sensorgen.measure.signal import drift, lowpass, presses


@dataclass(frozen=True, eq=False)
class Processed:
    """What a recording says.

    Attributes
    ----------
    recording : Recording
        With the rig's errors among its marks.
    force_n : (n,) array
        What pressed at each sample [N]; nan where nobody knows.
    filtered_s, filtered_ohm : (k,), (k, m) array
        Low-passed forward and backward on even steps, drift and all [s], [ohm].
    drift : Drift or None
        What was taken out of the presses' readings; None if nothing was.
    pairs : Pairs or None
        Before and under each press; None where there are none.
    by_force : bool
        Whether presses were found by the rig's force; else by the readings alone, force and position unknown.
    notes : tuple of str
        How the clocks stand, and what was left out or taken with care.
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
    """Work up a recording.

    Parameters
    ----------
    recording : Recording
        What the instrument measured.
    rig : RigLog or Joined or None
        What pressed, or the recording with that beside it already; without it, presses are looked for in the readings.
    remove_drift : bool
        Whether the drift of the rest is fitted and taken out of the presses' readings.
    law : str
        That the drift follows, of :data:`sensorgen.measure.signal.drift.LAWS`; the one that explains it best if
        not given.
        Where no force is known, one that asks for none.
    cutoff_hz : float
        Of the low-pass [Hz].

    Raises
    ------
    BadInput
        Clocks that cannot be joined; fewer than 16 samples that count.
    OutOfRange
        A cut-off that is not between 0 and half the sampling rate.
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
    spans = presses.pressed(one.time_s, force) if rig else presses.found(one.time_s[valid], one.impedance_ohm[valid])
    among = (law,) if law else drift.LAWS if rig else drift.BY_TIME
    pressing = force if rig else _told(one.time_s, spans)
    fit = _drift(one, valid, pressing, tuple(among), notes) if remove_drift and spans else None
    clean = fit.removed(one.time_s, one.impedance_ohm) if fit else one.impedance_ohm
    pairs = _pairs(one.time_s, clean, valid, spans, force, position, notes)
    return Processed(one, force, *filtered, fit, pairs, rig is not None, tuple(notes))


def _told(time_s: Real, spans: list[presses.Press]) -> Real:
    """A force that tells of nothing but when something pressed [N]."""
    found = np.zeros_like(time_s)
    for span in spans:
        found[(time_s >= span.start_s) & (time_s <= span.end_s)] = 1.0
    return found


def _drift(one: Recording, valid: Bools, force: Real, among: tuple[str, ...], notes: list[str]) -> drift.Drift | None:
    try:
        return drift.fitted(one.time_s, one.impedance_ohm, valid, force, among=among)
    except BadInput as error:
        notes.append(f"drift stays in: {error}")
        return None


def _pairs(
    time_s: Real, z: Complex, valid: Bools, spans: list[presses.Press], force: Real, position: Real, notes: list[str]
) -> presses.Pairs | None:
    if not spans:
        notes.append("nothing pressed")
        return None
    try:
        found = presses.pairs(time_s, z, valid, spans, force, position)
    except BadInput as error:
        notes.append(f"no presses: {error}")
        return None
    notes += [f"left out: {said}" for said in found.left_out]
    return found
