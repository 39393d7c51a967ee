"""Runs of a rig whose truth is known, and instrument files written by other programs than the reader."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sensorgen.measure.recording import Recording, Source, joined_all, parts
from sensorgen.models.compression import unconfined
from sensorgen.models.sensor import Sensor

TONES_HZ = np.array([1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3])
EPOCH_S = 1_661_419_320.0
BLOCK = 14


def read_all(path, columns=None):
    """Recordings of all lock-ins in a file of one part."""
    (lockins,) = parts(path, columns)
    return lockins


def read(path, columns=None):
    """Recording of the one lock-in in a file of one part."""
    (recording,) = read_all(path, columns)
    return recording


def rebuilt(count, time_s, stamp_s):
    """A recording of ones with the rebuilt clock."""
    return Recording.rebuilt(np.ones((count, 1), complex), TONES_HZ[:1], time_s, stamp_s, Source("", ""))


def joined(recording, log):
    """One recording with the rig's log."""
    return joined_all((recording,), log)[0]


def sensor():
    """Tones on both sides of its corner, so that they tell force and position."""
    return Sensor(0.1, 0.01, (3e-4, 3e-4), (5.0, 5.0), 7.6e-10, unconfined(6e5), tip_m=0.01)


@dataclass
class Run:
    """The truth of a run: a press is (start, end, force, position in mm), in the instrument's time."""

    time_s: np.ndarray
    force_n: np.ndarray
    position_mm: np.ndarray
    clean_ohm: np.ndarray
    drift: np.ndarray
    impedance_ohm: np.ndarray
    presses: list


def presses(count, seed=0, dwell_s=4.0, rest_s=4.0, least_n=0.5, most_n=6.0, ends_mm=(10.0, 90.0)):
    rng = np.random.default_rng(seed)
    found, at = [], rest_s
    for _ in range(count):
        found.append((at, at + dwell_s, rng.uniform(least_n, most_n), rng.uniform(*ends_mm)))
        at += dwell_s + rest_s * rng.uniform(0.9, 1.3)
    return found


def force_at(time_s, made, ramp_s=0.2):
    """Force with straight ramps, and where the tip is, which moves while it is up."""
    force, position = np.zeros_like(time_s), np.full_like(time_s, made[0][3])
    for start, end, f, x in made:
        force += f * np.clip(np.minimum((time_s - start) / ramp_s, (end - time_s) / ramp_s), 0, 1)
        position[time_s >= start - 1.0] = x
    return force, position


def run(
    made, rate_hz=140.0, noise=1e-3, creep=0.0, slope_per_s=0.0, seed=1, of=None, tones_hz=TONES_HZ, law=None,
    ramp_s=0.2,
):  # fmt: skip
    of = of or sensor()
    rng = np.random.default_rng(seed)
    time = np.arange(round((made[-1][1] + 4) * rate_hz)) / rate_hz
    force, position = force_at(time, made, ramp_s)
    pressed, unpressed = force > 0, of.impedance(tones_hz, 0.0, 0.05)
    clean = np.tile(unpressed, (len(time), 1))
    clean[pressed] = of.impedance(tones_hz, force[pressed, None], position[pressed, None] * 1e-3)
    # the film creeps: its capacitance grows, and Z moves as a change of C moves it
    step = 1e-6
    more = Sensor(**{**vars(of), "capacitance_f_per_m": of.capacitance_f_per_m * (1 + step)})
    by_c = np.log(more.impedance(tones_hz, 0.0, 0.05) / unpressed) / step
    grown = law(time, force) if law else creep * np.log1p(time / 20) + slope_per_s * time
    drift = grown[:, None] * by_c
    z = clean * np.exp(drift)
    z = z + noise * np.abs(z) * (rng.standard_normal(z.shape) + 1j * rng.standard_normal(z.shape))
    return Run(time, force, position, clean, drift, z, made)


def answering(share_per_n, tau_s):
    """A film that creeps under the tip, and forgets, with one time constant."""

    def law(time_s, force_n):
        kept = np.exp(-(time_s[1] - time_s[0]) / tau_s)
        return share_per_n * lfilter([(1 - kept) / 2] * 2, [1, -kept], force_n)

    return law


def walking(share, seed=7):
    """A film that wanders at random, by that share in a standard deviation at the end."""

    def law(time_s, _):
        return share * np.random.default_rng(seed).standard_normal(len(time_s)).cumsum() / np.sqrt(len(time_s))

    return law


def stamps(time_s, seed=2, jitter_s=0.005, skew=0.0, late_s=0.03, block=BLOCK):
    """As the instrument's program makes them: a block's first by the computer's clock, the rest by counting on."""
    rng = np.random.default_rng(seed)
    count = len(time_s)
    first = np.arange(count) // block * block
    lag = rng.normal(0, jitter_s, count // block + 1)[np.arange(count) // block]
    inside = (np.arange(count) - first) * (0.1 / (block - 1))
    return EPOCH_S + (1 + skew) * time_s[first] + late_s + lag + inside


def rig_rows(made, offset_s=0.0, skew=0.0, rate_hz=20.0, seed=3, noise_n=0.02, end_s=None, ramp_s=0.2):
    """Columns of the rig's log; its clock shows ``offset_s`` less than real time in the middle of the run."""
    rng = np.random.default_rng(seed)
    end = end_s or made[-1][1] + 4
    time = np.arange(0, end, 1 / rate_hz)
    force, position = force_at(time, made, ramp_s)
    told = np.zeros_like(time)
    for start, stop, f, _ in made:
        told[(time >= start) & (time < stop)] = f
    shown = EPOCH_S + time - offset_s - skew * (time - end / 2)
    return shown, told, position, force + noise_n * rng.standard_normal(len(time))


def write_rig(path, columns, errors=None, header="time_s,set_force_n,set_position_mm,force_n,error"):
    errors = errors or {}
    rows = [
        f"{t:.4f},{f:.3f},{x:.3f},{m:.4f},{errors.get(i, '')}"
        for i, (t, f, x, m) in enumerate(zip(*columns, strict=True))
    ]
    path.write_text("\n".join([header, *rows]) + "\n", "utf-8")
    return path


def settings(tones_hz, **more):
    return {
        "bandwidth": 10.0, "dem_freqs": np.asarray(tones_hz, float), "version": "V1.0.3", "gain": 1,
        "scope_range_list": np.array([0.2, 0.4, 0.8, 2.0, 4.0]), "scope_ranges": np.array([2, 2], np.int32),
        "calibration": {"gain_list": np.array([1, 50])},
    } | more  # fmt: skip


def cell(*members):
    found = np.empty((1, len(members)), object)
    for i, member in enumerate(members):
        found[0, i] = member
    return found


def tree(impedances, times, stamped=None, tones_hz=(TONES_HZ,), offsets=None):
    """What the instrument's program hands to savemat: equal lengths as matrices, unequal ones as cells."""
    equal = len({len(t) for t in times}) == 1
    found = {
        "impedance_data": {f"lockin{k}": np.asarray(z) for k, z in enumerate(impedances, 1)},
        "impedance_time": np.vstack(times) if equal else cell(*times),
        "settings": cell(*(settings(t) for t in tones_hz)),
    }
    if stamped is not None:
        found["timestamps"] = np.asarray(stamped)[:, None]
    if offsets is not None:
        found |= offsets
    return found
