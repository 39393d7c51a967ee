"""Recordings and what is made of them: import, clocks, filter, demodulation, and a run whose truth is known.

Writes ``results/recordings.md`` and ``docs/pictures/recordings-*.png``. Seconds are the processor's.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
import scipy.io as sio
from scipy import signal

HERE = Path(__file__).parent
PICTURES = HERE.parent / "docs" / "pictures"
sys.path.insert(0, str(HERE.parent / "tests" / "recording"))

import made  # noqa: E402 - the truth is made as for the tests

from sensorgen.card.fisher import bounds, slopes  # noqa: E402
from sensorgen.invert import Estimator  # noqa: E402
from sensorgen.plots import bench  # noqa: E402
from sensorgen.process import drift, lowpass, presses, waveform  # noqa: E402
from sensorgen.recording import joined, read, rig  # noqa: E402

SAMPLES = 1_000_000
NOISE, RATE = 1e-3, 140.0
READ = """
import re, sys, time
from pathlib import Path
from sensorgen.recording import read
start = time.process_time()
found = read(sys.argv[1])
peak = re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]
print(time.process_time() - start, int(peak) / 1024, len(found.time_s))
"""


def million(folder):
    """A million samples of seven tones, in every format."""
    rng = np.random.default_rng(0)
    t = np.arange(SAMPLES) / RATE
    z = 100 + rng.standard_normal((SAMPLES, 7)) - 1j * (50 + rng.standard_normal((SAMPLES, 7)))
    tree = made.tree([z], [t], made.stamps(t))
    sio.savemat(folder / "MATLAB 5.mat", tree)
    sio.savemat(folder / "MATLAB 5, packed.mat", tree, do_compression=True)
    with h5py.File(folder / "HDF5.h5", "w") as file:
        file["impedance_data/lockin1"], file["impedance_time"], file["timestamps"] = z, t, tree["timestamps"]
        file["settings/dem_freqs"] = made.TONES_HZ
    names = [f"{part}_ohm_{f / 1e3:g}kHz" for f in made.TONES_HZ for part in ("re", "im")]
    table = np.column_stack([t, np.stack([z.real, z.imag], -1).reshape(SAMPLES, 14)])
    np.savetxt(folder / "CSV.csv", table, "%.7g", ",", header=",".join(["time_s", *names]), comments="")
    return sorted(folder.iterdir())


def import_table():
    yield "## Import of a million samples of seven tones\n"
    yield "| format | file [MB] | seconds | peak memory [MB] |"
    yield "|---|---|---|---|"
    with tempfile.TemporaryDirectory() as folder:
        for file in million(Path(folder)):
            done = subprocess.run([sys.executable, "-c", READ, str(file)], capture_output=True, text=True, check=True)
            seconds, memory, count = map(float, done.stdout.split())
            assert count == SAMPLES
            yield f"| {file.stem} | {file.stat().st_size / 1e6:.0f} | {seconds:.2f} | {memory:.0f} |"


def offset_table():
    yield "\n## Offset of two clocks, by the force alone\n"
    yield "| presses | run [s] | off by [ms] | stated error [ms] | share explained |"
    yield "|---|---|---|---|---|"
    with tempfile.TemporaryDirectory() as folder:
        for count in (3, 10, 30, 100):
            found, run = joined_run(Path(folder), made.presses(count), 12.34, 0.0)
            off = found.offset_s - 12.34 - 0.03
            yield (
                f"| {count} | {run.time_s[-1]:.0f} | {off * 1e3:.2f} | {found.offset_error_s * 1e3:.2f} | "
                f"{found.explained:.3f} |"
            )


def joined_run(folder, plan, offset_s, skew, **how):
    run = made.run(plan, RATE, NOISE, **how)
    sio.savemat(folder / "run.mat", made.tree([run.impedance_ohm], [run.time_s], made.stamps(run.time_s)))
    log = rig(made.write_rig(folder / "rig.csv", made.rig_rows(plan, offset_s, skew)))
    return joined(read(folder / "run.mat"), log), run


def filter_table():
    yield "\n## Butterworth of order 4 at 66.6666 samples/s: error of the settled step\n"
    yield "| cut-off [Hz] | second-order sections | polynomials (b, a) |"
    yield "|---|---|---|"
    for cutoff in (0.2727, 0.027, 0.00027):
        count = round(16 * lowpass.THESIS_RATE_HZ / cutoff)
        step = np.ones(count)
        sos = signal.sosfilt(lowpass.sections(lowpass.THESIS_RATE_HZ, cutoff), step)
        with np.errstate(over="ignore", invalid="ignore"):
            direct = signal.lfilter(*signal.butter(4, cutoff, fs=lowpass.THESIS_RATE_HZ), step)
        yield f"| {cutoff:g} | {abs(sos[-1] - 1):.1e} | {abs(direct[-1] - 1):.1e} |"


def demodulation_table():
    yield "\n## Demodulation of seven tones, 6.25 million samples/s, windows of 10 ms\n"
    yield "Relative error of Z, root mean square.\n"
    rng, rate, seconds = np.random.default_rng(0), 6.25e6, 2
    t = np.arange(round(rate * 0.01)) / rate
    weights = np.array([10, 7, 4.5, 3, 2, 1.5, 1])
    current = weights * np.exp(2j * np.pi * rng.random(7))
    z = 1000 / (1 + 1j * made.TONES_HZ / 2e4)
    wave = np.exp(2j * np.pi * ((made.TONES_HZ * t[:, None]) % 1))
    u, i = (np.tile((wave * c).real.sum(axis=1), 100 * seconds) for c in (current * z, current))
    yield "| bits | one window, best and worst tone | mean over a second |"
    yield "|---|---|---|"
    for bits in (0, 14):
        shown = [u, i]
        if bits:
            steps = [1.05 * np.abs(x).max() / 2 ** (bits - 1) for x in shown]
            shown = [np.round(x / q + rng.uniform(-0.5, 0.5, len(x))) * q for x, q in zip(shown, steps, strict=True)]
        start = time.process_time()
        found = waveform.impedance(*shown, rate, made.TONES_HZ).impedance_ohm / z
        spent = time.process_time() - start
        one, mean = (rms(x) for x in (found - 1, found.reshape(seconds, 100, 7).mean(axis=1) - 1))
        yield f"| {bits or 'all'} | {one.min():.1e}, {one.max():.1e} | {mean.min():.1e}, {mean.max():.1e} |"
    yield f"\n{seconds / spent:.0f} times faster than the waveforms last."


def rms(values):
    return np.sqrt((np.abs(values) ** 2).mean(axis=0))


def truth():
    """A run of known truth: errors over the Cramer-Rao bound, and the thesis's pictures."""
    yield "\n## A run of known truth: root mean square error over the Cramer-Rao bound\n"
    yield f"60 presses of 3 s, noise {NOISE:g}, creep of 2 % per e-fold of time, clocks 7.25 s and 210 ppm apart.\n"
    yield "| readings | force | position | bound of the position, median [mm] |"
    yield "|---|---|---|---|"
    plan = made.presses(60, dwell_s=3.0, rest_s=3.0, seed=11)
    with tempfile.TemporaryDirectory() as folder:
        run, _ = joined_run(Path(folder), plan, 7.25, 2.1e-4, creep=0.02, seed=5)
    one, of = run.recording, made.sensor()
    at = presses.pressed(one.time_s, run.force_n)
    creep = drift.fitted(one.time_s, one.impedance_ohm, one.valid(), run.force_n)
    rest = of.impedance(made.TONES_HZ, 0.0, 0.05)
    raw = presses.pairs(one.time_s, one.impedance_ohm, one.valid(), at, run.force_n, run.set_position_mm)
    clean = creep.removed(one.time_s, one.impedance_ohm) * rest / creep.rest_ohm()
    free = presses.pairs(one.time_s, clean, one.valid(), at, run.force_n, run.set_position_mm)
    single = NOISE / np.sqrt(presses.WINDOW_S * RATE)
    cases = {
        "as read": (raw.pressed_ohm, single),
        "pressed over before": (rest * raw.pressed_ohm / raw.before_ohm, single * 2**0.5),
        "drift fitted and removed": (free.pressed_ohm, single),
    }
    for name, (z, noise) in cases.items():
        force, where, bound = pulls(of, z, noise, plan)
        yield f"| {name} | {force:.2f} | {where:.2f} | {bound * 1e3:.2f} |"
    pictures(run, raw)


def pulls(of, z, noise, plan):
    force, at = np.array([m[2] for m in plan]), np.array([m[3] for m in plan]) * 1e-3
    limits = bounds(slopes(of, made.TONES_HZ, force, at), noise)
    found = Estimator(of, made.TONES_HZ, noise).batch(z)
    off = (found.force_n - force) / limits.force_n, (found.position_m - at) / limits.position_m
    return *(np.sqrt(np.mean(o**2)) for o in off), np.median(limits.position_m)


def pictures(run, pairs):
    one = run.recording
    valid = one.valid()
    shown = bench.Run(
        "synthetic run of known truth", made.TONES_HZ, one.time_s[valid], one.impedance_ohm[valid],
        *lowpass.filtered(one), pairs,
    )  # fmt: skip
    (PICTURES / "recordings-time.png").write_bytes(bench.over_time(shown))
    for part in bench.PARTS:
        (PICTURES / f"recordings-{part}.png").write_bytes(bench.surfaces(shown, part))
    sets = {}
    for seed in range(4):
        plan = made.presses(40, seed=seed)
        other = made.run(plan, RATE, (1 + seed) * NOISE, creep=0.005, seed=seed)
        every = np.ones(len(other.time_s), bool)
        at = presses.pressed(other.time_s, other.force_n)
        sets[f"print {seed + 1}"] = presses.pairs(
            other.time_s, other.impedance_ohm, every, at, other.force_n, other.position_mm
        )
    (PICTURES / "recordings-normalised.png").write_bytes(bench.normalised_differences(sets, made.TONES_HZ))


def main():
    lines = ["# Recordings\n", "Made by `bench/recordings.py`.\n"]
    for part in (import_table, offset_table, filter_table, demodulation_table, truth):
        lines += part()
    text = "\n".join(lines) + "\n"
    (HERE / "results" / "recordings.md").write_text(text, "utf-8")
    print(text)


if __name__ == "__main__":
    main()
