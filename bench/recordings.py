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

from sensorgen.analysis.plots import recordings as plots  # noqa: E402
from sensorgen.analysis.plots import static  # noqa: E402
from sensorgen.measure.recording import rig  # noqa: E402
from sensorgen.measure.signal import drift, lowpass, presses, waveform  # noqa: E402
from sensorgen.measure.signal.run import of_presses, processed  # noqa: E402
from sensorgen.models.sensor import Sensor  # noqa: E402
from sensorgen.prediction.identifiability.fisher import bounds, slopes  # noqa: E402
from sensorgen.prediction.inverse.estimator import Estimator  # noqa: E402

SAMPLES = 1_000_000
THESIS_RATE_HZ = 66.6666
NOISE, RATE = 1e-3, 140.0
READ = """
import re, sys, time
from pathlib import Path
from sensorgen.measure.recording import parts
start = time.process_time()
found, *_ = next(parts(sys.argv[1]))
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
            off = found.clocks.offset_s - 12.34 - 0.03
            yield (
                f"| {count} | {run.time_s[-1]:.0f} | {off * 1e3:.2f} | {found.clocks.offset_error_s * 1e3:.2f} | "
                f"{found.clocks.explained:.3f} |"
            )


def slow_table():
    yield "\n## Offset of two clocks, by films that answer slowly: 12 presses, 1 % of C per N\n"
    yield "| film answers within [s] | ramps [s] | off by [ms] | stated error [ms] |"
    yield "|---|---|---|---|"
    with tempfile.TemporaryDirectory() as folder:
        for tau, ramp in ((1.4, 0.2), (3, 0.2), (60, 0.2), (1.4, 2), (3, 2), (60, 2)):
            found, _ = joined_run(
                Path(folder), made.presses(12, dwell_s=4.0), 12.34, 0.0, law=made.answering(0.01, tau), ramp_s=ramp
            )
            off, error = found.clocks.offset_s - 12.37, found.clocks.offset_error_s
            yield f"| {tau:g} | {ramp:g} | {off * 1e3:.2f} | {error * 1e3:.2f} |"


def joined_run(folder, plan, offset_s, skew, **how):
    run = made.run(plan, RATE, NOISE, **how)
    sio.savemat(folder / "run.mat", made.tree([run.impedance_ohm], [run.time_s], made.stamps(run.time_s)))
    log = rig(made.write_rig(folder / "rig.csv", made.rig_rows(plan, offset_s, skew, ramp_s=how.get("ramp_s", 0.2))))
    return made.joined(made.read(folder / "run.mat"), log), run


def filter_table():
    yield "\n## Butterworth of order 4 at 66.6666 samples/s: error of the settled step\n"
    yield "| cut-off [Hz] | second-order sections | polynomials (b, a) |"
    yield "|---|---|---|"
    for cutoff in (0.2727, 0.027, 0.00027):
        count = round(16 * THESIS_RATE_HZ / cutoff)
        step = np.ones(count)
        sos = signal.sosfilt(lowpass.sections(THESIS_RATE_HZ, cutoff), step)
        with np.errstate(over="ignore", invalid="ignore"):
            direct = signal.lfilter(*signal.butter(4, cutoff, fs=THESIS_RATE_HZ), step)
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
        found = impedance(shown, rate) / z
        spent = time.process_time() - start
        one, mean = (rms(x) for x in (found - 1, found.reshape(seconds, 100, 7).mean(axis=1) - 1))
        yield f"| {bits or 'all'} | {one.min():.1e}, {one.max():.1e} | {mean.min():.1e}, {mean.max():.1e} |"
    yield f"\n{seconds / spent:.0f} times faster than the waveforms last, clipping looked for too."
    yield "\n| samples/s | samples of a window | times faster than they last |"
    yield "|---|---|---|"
    for slower in (1, 6.25, 25):
        many = [x[: round(len(x) / slower)] for x in shown]
        yield f"| {rate / slower:.3g} | {round(rate / slower * 0.01)} | {speed(many, rate / slower):.0f} |"


def impedance(shown, rate):
    """Impedances of all windows of voltage and current, clipping looked for."""
    size = waveform.window_samples(rate, made.TONES_HZ)
    u, i = (waveform.phasors(each, rate, made.TONES_HZ, size) for each in shown)
    for each in shown:
        waveform.clipped(each, 1e9, size, len(u))
    return u / i


def speed(shown, rate):
    """Of demodulation, over the time that the waveforms last: the middle of five."""
    spent = []
    for _ in range(5):
        start = time.process_time()
        impedance(shown, rate)
        spent.append(time.process_time() - start)
    return len(shown[0]) / rate / sorted(spent)[2]


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
    at = presses.by_force(one.time_s, run.force_n)
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


LAWS = {
    "logarithm, 2 % per e-fold": lambda t, _: 0.02 * np.log1p(t / 20),
    "power of time, 0.3": lambda t, _: 0.02 * (t / 60) ** 0.3,
    "power of time, 0.7": lambda t, _: 0.02 * (t / 60) ** 0.7,
    "stretched exponential, 80 s, 0.5": lambda t, _: 0.04 * (1 - np.exp(-((t / 80) ** 0.5))),
    "exponential, 60 s": lambda t, _: 0.04 * (1 - np.exp(-t / 60)),
    "warming and cooling, a period of 10 min": lambda t, _: 0.02 * np.sin(t / 95.5),
    "none": lambda t, _: 0 * t,
    "creep under the tip, 1 % of C per N, 60 s": made.answering(0.01, 60.0),
    "creep under the tip, 1 % of C per N, 2 s": made.answering(0.01, 2.0),
    "creep under the tip, 1 % of C per N each, 2 s and 60 s": lambda t, f: sum(
        made.answering(0.01, x)(t, f) for x in (2, 60)
    ),
    "creep under the tip by a power of time: 0.2 % each, 1, 4, 16, 64, 256 s": lambda t, f: sum(
        made.answering(0.002, x)(t, f) for x in (1, 4, 16, 64, 256)
    ),
    "creep under the tip, 1 % of C per N, 0.3 s": made.answering(0.01, 0.3),
    "random walk, 0.2 % over the run": made.walking(0.002),
    "random walk, 2 % over the run": made.walking(0.02),
    "random walk, 2 %, and creep under the tip, 3 % of C per N, 2 s": lambda t, f: (
        made.walking(0.02)(t, f) + made.answering(0.03, 2.0)(t, f)
    ),
}


def laws():
    """What drift leaves of force and position, law by law, over two bounds."""
    yield "\n## Laws of drift: root mean square errors of force and position over the Cramer-Rao bound\n"
    yield "60 presses of 3 s. The first two columns of errors: over the bound of a sensor without drift. The last one:"
    yield "drift taken out, then force, position and C fitted together, over the bound of these three.\n"
    yield "| drift | pressed over before | law chosen | drift taken out | and C fitted beside |"
    yield "|---|---|---|---|---|"
    plan = made.presses(60, dwell_s=3.0, rest_s=3.0, seed=11)
    of, single = made.sensor(), NOISE / np.sqrt(presses.WINDOW_S * RATE)
    rest = of.impedance(made.TONES_HZ, 0.0, 0.05)
    for name, law in LAWS.items():
        run = made.run(plan, RATE, NOISE, seed=5, law=law)
        every = np.ones(len(run.time_s), bool)
        fit = drift.fitted(run.time_s, run.impedance_ohm, every, run.force_n)
        clean = fit.removed(run.time_s, run.impedance_ohm) * rest / fit.rest_ohm()
        at = presses.by_force(run.time_s, run.force_n)
        raw, free = (
            presses.pairs(run.time_s, z, every, at, run.force_n, run.position_mm) for z in (run.impedance_ohm, clean)
        )
        before = pulls(of, rest * raw.pressed_ohm / raw.before_ohm, single * 2**0.5, plan)[:2]
        after = pulls(of, free.pressed_ohm, single, plan)[:2]
        three = beside(of, free.pressed_ohm, single, plan)
        said = (", ".join(f"{x:.3g}" for x in pair) for pair in (before, after, three))
        yield "| {} | {} | {} | {} | {} |".format(name, next(said), fit.law, *said)
    wider = "The bound with C unknown over that without drift: {:.2f} for force, {:.2f} for position."
    yield "\n" + wider.format(*widths(of, plan))


def by_capacitance(of):
    """How ln Z moves with ln C at rest (m,)."""
    step = 1e-6
    more = Sensor(**{**vars(of), "capacitance_f_per_m": of.capacitance_f_per_m * (1 + step)})
    return np.log(more.impedance(made.TONES_HZ, 0.0, 0.05) / of.impedance(made.TONES_HZ, 0.0, 0.05)) / step


def parts(z):
    return np.concatenate([z.real, z.imag], -1)


def directions(of, force, at):
    """Derivatives of ln Z by force, position and ln C (presses, 2 m, 3)."""
    by_force, by_position = slopes(of, made.TONES_HZ, force, at)
    return np.stack(
        [parts(by_force), parts(by_position), np.broadcast_to(parts(by_capacitance(of)), parts(by_force).shape)], -1
    )


def errors(fisher):
    return np.sqrt(np.linalg.inv(fisher)[:, [0, 1], [0, 1]]).T


def widths(of, plan):
    force, at = np.array([m[2] for m in plan]), np.array([m[3] for m in plan]) * 1e-3
    d = directions(of, force, at)
    with_c, without = (errors(x.transpose(0, 2, 1) @ x) for x in (d, d[..., :2]))
    return np.sqrt(((with_c / without) ** 2).mean(axis=1))


def beside(of, z, noise, plan):
    """Force, position and C fitted together by Gauss-Newton from the truth: errors over their bound."""
    true = np.array([m[2] for m in plan]), np.array([m[3] for m in plan]) * 1e-3, np.zeros(len(plan))
    now = np.stack(true, -1)
    for _ in range(20):
        force, at, grown = now.T
        model = np.log(of.impedance(made.TONES_HZ, force[:, None], at[:, None])) + grown[:, None] * by_capacitance(of)
        d = directions(of, force, at)
        off = parts(np.log(z / np.exp(model)))[..., None]
        step = np.linalg.solve(d.transpose(0, 2, 1) @ d, d.transpose(0, 2, 1) @ off)[..., 0]
        now = np.clip(now + np.clip(step, [-0.3, -5e-3, -0.1], [0.3, 5e-3, 0.1]), [0.2, 0.006, -1], [10, 0.094, 1])
    bound = errors(d.transpose(0, 2, 1) @ d) * noise
    return [rms((now[:, k] - true[k]) / bound[k]) for k in (0, 1)]


def pulls(of, z, noise, plan):
    force, at = np.array([m[2] for m in plan]), np.array([m[3] for m in plan]) * 1e-3
    limits = bounds(slopes(of, made.TONES_HZ, force, at), noise)
    found = Estimator(of, made.TONES_HZ, noise).batch(z)
    off = (found.force_n - force) / limits.force_n, (found.position_m - at) / limits.position_m
    return *(np.sqrt(np.mean(o**2)) for o in off), np.median(limits.position_m)


def pictures(run, pairs):
    one = run.recording
    valid = one.valid()
    shown = plots.DrawnRecording(
        "synthetic run of known truth", made.TONES_HZ, one.time_s[valid], one.impedance_ohm[valid],
        *lowpass.filtered(one), pairs,
    )  # fmt: skip
    (PICTURES / "recordings-time.png").write_bytes(static.png(plots.series(shown)))
    for part in plots.PARTS:
        (PICTURES / f"recordings-{part}.png").write_bytes(static.png(plots.differences(shown, part)))
    sets = {}
    for seed in range(4):
        plan = made.presses(40, seed=seed)
        other = made.run(plan, RATE, (1 + seed) * NOISE, creep=0.005, seed=seed)
        every = np.ones(len(other.time_s), bool)
        at = presses.by_force(other.time_s, other.force_n)
        sets[f"print {seed + 1}"] = presses.pairs(
            other.time_s, other.impedance_ohm, every, at, other.force_n, other.position_mm
        )
    (PICTURES / "recordings-normalised.png").write_bytes(static.png(plots.compared(sets, made.TONES_HZ)))


def ways_picture():
    """Slow presses on a film that answers within three seconds."""
    plan = made.presses(5, seed=3, dwell_s=12, rest_s=6, least_n=2.0)
    with tempfile.TemporaryDirectory() as folder:
        run, _ = joined_run(Path(folder), plan, 7.25, 0.0, law=made.answering(0.01, 3.0), ramp_s=6.0)
    found = of_presses(processed(run.recording, run, law="smooth"))
    name = "synthetic film that answers within 3 s"
    (PICTURES / "recordings-ways.png").write_bytes(static.png(plots.hysteresis(found.ways, made.TONES_HZ, name)))


def main():
    lines = ["# Recordings\n", "Made by `bench/recordings.py`.\n"]
    for part in (import_table, offset_table, slow_table, filter_table, demodulation_table, truth, laws):
        lines += part()
    ways_picture()
    text = "\n".join(lines) + "\n"
    (HERE / "results" / "recordings.md").write_text(text, "utf-8")
    print(text)


if __name__ == "__main__":
    main()
