"""Seven tones at 1 MS/s in two channels, streamed and demodulated on one core; writes results/lab_stream.md.

Speed: time of the signal over time of computing, median of repeats that alternate with a plain FFT of the same windows.
Memory: of a process of its own, after 1 min and 60 min of simulated time. The vendor's demo device streams in real
time, if its library is there.
"""

import os

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from sensorgen.core.errors import NotInstalled
from sensorgen.measure.lab.devices import RealClock, SimulatedClock
from sensorgen.measure.lab.handyscope import Handyscope, load
from sensorgen.measure.lab.live import LiveView, Sample
from sensorgen.measure.signal.waveform import TONES_HZ
from sensorgen.measure.virtual.handyscope import SERIAL, PhasorMeter

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "lab"))

from simulated_scope import SimulatedScope

TONES = np.array(TONES_HZ)
PERIOD_S = 0.01  # of the control loop
REPEATS, PART_S, DEMO_S = 15, 10.0, 20.0
GOAL = 10


class Capacitor:
    """A specimen that costs no time."""

    def advance(self, time_s):
        pass

    def impedance(self, hz):
        return 5e3 + 1 / (2j * np.pi * hz * 1e-10)


def meter_of(kind, clock):
    """A driver with simulated samples, one whose samples are there already, or the fast one."""
    if kind == "phasors":
        meter = PhasorMeter(Capacitor(), clock)
    else:
        scope = SimulatedScope(Capacitor(), clock)
        meter = Handyscope(str(SERIAL), clock, library=scope)
        if kind == "driver":
            window = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 10_000)).astype(np.float32)

            def kept(windows):
                windows.count += 1
                return window

            scope.oscilloscope._sampled = kept
    meter.start(TONES, 1.0)
    return meter


def followed(meter, clock, seconds):
    """Poll as a run does; readings received."""
    count = 0
    for _ in range(round(seconds / PERIOD_S)):
        clock.wait_until(clock.now() + PERIOD_S)
        count += len(meter.read().time_s)
    return count


def transformed():
    """The peer: a plain FFT of each window of both channels."""
    windows = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 5, 10_000)).astype(np.float32)
    bins = np.round(TONES * 0.01).astype(int)
    for _ in range(round(PART_S / 0.05)):
        voltage, output = np.fft.rfft(windows, axis=2)[:, :, bins]
        voltage / output


def speeds():
    """Real-time factors, and how much faster than the peer the driver is."""
    meters = {}
    for kind in ("driver", "samples", "phasors"):
        clock = SimulatedClock()
        meters[kind] = (meter_of(kind, clock), clock)
    seconds = {kind: [] for kind in (*meters, "fft")}
    for _ in range(REPEATS):
        for kind, (meter, clock) in meters.items():
            start = time.perf_counter()
            followed(meter, clock, PART_S)
            seconds[kind].append(time.perf_counter() - start)
        start = time.perf_counter()
        transformed()
        seconds["fft"].append(time.perf_counter() - start)
    return {kind: [PART_S / each for each in times] for kind, times in seconds.items()}


def resident_mb():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def grown(kind):
    """Memory after 1 min and after 60 min."""
    clock = SimulatedClock()
    if kind == "page":
        with LiveView("bench", TONES) as view:
            z = Capacitor().impedance(TONES)

            def show(seconds):
                for _ in range(round(seconds / PERIOD_S)):
                    clock.wait_until(clock.now() + PERIOD_S)
                    view.update(Sample(clock.now(), 1, 10, "press", 1.0, 1.0, 40.0, z, z))

            show(60)
            first = resident_mb()
            show(3540)
            return first, resident_mb()
    meter = meter_of(kind, clock)
    followed(meter, clock, 60)
    first = resident_mb()
    followed(meter, clock, 3540)
    return first, resident_mb()


def streamed():
    """The demo device: samples per second, processor time per second, windows lost, and the longest read."""
    meter = Handyscope("demo", RealClock())
    identity = meter.identify()
    meter.start(TONES, 1.0)
    start, used, count, lost, longest = time.perf_counter(), time.process_time(), 0, 0, 0.0
    while time.perf_counter() < start + DEMO_S:
        begin = time.perf_counter()
        made = meter.read()
        longest = max(longest, time.perf_counter() - begin)
        count, lost = count + len(made.time_s), lost + made.lost
        time.sleep(PERIOD_S)
    took = time.perf_counter() - start
    used = time.process_time() - used
    meter.close()
    return identity.model, (count + 5) * 0.01 / took, used / took, lost, longest


def demo_lines():
    try:
        load()
    except NotInstalled as reason:
        return [f"The vendor's demo device was not measured: {reason}."]
    model, share, load_share, lost, longest = streamed()
    return [
        f"{model}, {DEMO_S:g} s in real time: {share:.3f} of the samples of 1 MS/s received and demodulated,"
        f" {lost} windows lost; processor time {100 * load_share:.1f} % of a core with the device's simulation;"
        f" longest call of `read` {1e3 * longest:.1f} ms."
    ]


def main():
    """Measure and write."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if len(sys.argv) > 1:
        print(json.dumps(grown(sys.argv[1])))
        return
    rows = []
    names = {
        "driver": "driver: blocks in, impedances out",
        "samples": "simulated device (samples) and driver",
        "phasors": "simulated device as phasors",
        "fft": "peer: numpy's FFT of each window, nothing else",
    }
    for kind, factors in speeds().items():
        low, middle, high = min(factors), statistics.median(factors), max(factors)
        rows.append(f"| {names[kind]} | {middle:.0f} | {low:.0f} to {high:.0f} |")
        print(rows[-1], flush=True)
        assert kind != "driver" or middle >= GOAL
    memory = []
    for kind, name in (
        ("samples", names["samples"]),
        ("phasors", names["phasors"]),
        ("page", "live page, 100 updates/s"),
    ):
        done = subprocess.run([sys.executable, __file__, kind], capture_output=True, check=True, text=True)
        first, last = json.loads(done.stdout)
        memory.append(f"| {name} | {first:.1f} | {last:.1f} |")
        print(memory[-1], flush=True)
    text = [
        f"Seven tones, 1 MS/s, two channels, one core, polled every 10 ms; goal: {GOAL} times real time."
        f" Programs that compete for {os.cpu_count()} cores: {os.getloadavg()[0]:.0f}.",
        "", f"| | times real time, median of {REPEATS} | range |", "|---|---|---|", *rows,
        "", "| memory [MB] | after 1 min | after 60 min |", "|---|---|---|", *memory, "", *demo_lines(), "",
    ]  # fmt: skip
    (Path(__file__).parent / "results" / "lab_stream.md").write_text("\n".join(text))
    print("\n".join(text))


if __name__ == "__main__":
    main()
