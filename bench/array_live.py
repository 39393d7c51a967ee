"""An array live: frames per second of a core, and memory of long recordings; writes results/array_live.md.

The device is simulated: lines of a walked print are there already, and get counter, time and checksum. All else is that
of ``sensorgen bench array``: driver, recording, inversion, page. Speed is by processor time of one process, so that
other programs do not count.
"""

import os

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from sensorgen.design.design import make
from sensorgen.measure.lab.devices import SimulatedClock
from sensorgen.measure.lab.frame_live import FrameFeed, MapView, follow, recorder
from sensorgen.measure.lab.frame_stream import FrameStream, checked
from sensorgen.measure.lab.port import SimulatedPort
from sensorgen.measure.virtual.array import sender
from sensorgen.prediction.array.live import LiveMaps
from sensorgen.prediction.array.model import array_model
from sensorgen.prediction.array.readout import ArrayReadout

PITCHES = {234: (10.0, 8.0, 100.0), 936: (5.0, 4.0, 20.0)}  # crossings: pitch, tracks [mm], goal [frames/s]
TONES_HZ = {10e3: ("capacitance", "p"), 100e3: ("siemens", "n")}  # and form and prefix of the frames
FAULTS = ("r3:8", "r2c4")  # a row broken behind a column, and a short: crossings that neighbours fill
CASES = ((10e3, ()), (10e3, FAULTS), (100e3, ()), (100e3, FAULTS))
MINUTES = {234: 60, 936: 60}  # of the recording whose memory is measured
SECONDS, PERIOD_S, LOT_S = 20.0, 0.1, 1.0  # of speed, and between two lots; of memory
REST = 100
NOTES = "## Notes\n"


class Lines:
    """Device whose values are there already: a second at rest, then the same steps again and again."""

    def __init__(self, device, rate_hz, form, prefix):
        device.form = replace(device.form, form=form, prefix=prefix)
        self.header, self.rate_hz, self.sent = device.form.header(), rate_hz, 0
        number = round(3 * rate_hz)
        each = [device._siemens(k) for k in (*range(REST), *range(number, number + round(4 * rate_hz)))]
        self.values = [device.form.frame(0, 0.0, one).partition(b",")[2].partition(b",")[2] for one in each]
        self.values = [value.rpartition(b"*")[0].decode() for value in self.values]

    def exchange(self, data, time_s):
        out = self.header if data else b""
        due = int(time_s * self.rate_hz + 1e-6)
        for k in range(self.sent, due):
            at = k if k < REST else REST + (k - REST) % (len(self.values) - REST)
            out += checked(f"{k},{k / self.rate_hz:.6f},{self.values[at]}")
        self.sent = due
        return out


def model_of(crossings):
    pitch, track, _ = PITCHES[crossings]
    parameters = {"length_mm": 260, "width_mm": 90, "between": "air", "pitch_x_mm": pitch, "pitch_y_mm": pitch,
                  "column_mm": track, "row_mm": track, "connector_mm": 2.54 if pitch > 5 else 2.0}  # fmt: skip
    cell = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}}
    regions = {"heel": [[0, 0], [130, 90]], "toe": [[130, 0], [260, 90]]}
    return array_model(make({"shape": "array", "name": "insole", "parameters": parameters, "cell": cell,
                             "regions": regions}))  # fmt: skip


class Bench:
    """One array, read at its goal by a simulated clock."""

    def __init__(self, crossings, hertz, folder, faults=()):
        self.rate_hz = PITCHES[crossings][2]
        model, readout = model_of(crossings), ArrayReadout(frequency_hz=(hertz,))
        lines = Lines(sender(model, readout, self.rate_hz, faults=faults), self.rate_hz, *TONES_HZ[hertz])
        self.clock = SimulatedClock()
        meter = FrameStream(SimulatedPort(lines, self.clock, step_s=0.01), self.clock)
        meter.identify()
        file = recorder(folder / f"{crossings}-{hertz:g}-{len(faults)}.h5", meter.shape, meter.frequency_hz)
        self.feed = FrameFeed(meter, self.clock, file, unloaded_s=REST / self.rate_hz)
        self.live, self.view = LiveMaps(model, readout), MapView("bench", model)
        self.used = dict.fromkeys(("read", "invert"), 0.0)

    def run(self, seconds, period_s=PERIOD_S):
        until = self.clock.now() + seconds
        while self.clock.now() < until:
            self.clock.wait_until(self.clock.now() + period_s)
            start = time.process_time()
            while self.feed.step():
                pass
            middle = time.process_time()
            follow(self.feed, self.live, self.view, self.clock, self.clock.now() + 1e-6)
            self.used["read"] += middle - start
            self.used["invert"] += time.process_time() - middle

    def close(self):
        self.view.close()
        self.feed.recorder.close()


def resident_mb():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def speed(crossings, hertz, folder, faults):
    """Words of a row: processor milliseconds of a frame, and frames a second of one core."""
    bench = Bench(crossings, hertz, folder, faults)
    bench.run(REST / bench.rate_hz + 2.0)  # the inverter is there
    bench.used, frames, dropped = dict.fromkeys(bench.used, 0.0), bench.feed.counts["frames"], bench.live.dropped
    bench.run(SECONDS)
    count = bench.feed.counts["frames"] - frames
    inverted = count - (bench.live.dropped - dropped)
    read, invert = bench.used["read"] / count, bench.used["invert"] / inverted
    bench.close()
    by = bench.live.plan.words().partition(":")[0]
    return (
        f"| {crossings} | {hertz / 1e3:g} kHz | {TONES_HZ[hertz][0]} | {', '.join(faults)} | {by} | {1e3 * read:.2f} | "
        f"{1e3 * invert:.2f} | "
        f"{1 / (read + invert):.0f} | {bench.rate_hz:g} |"
    )


def grown(crossings, folder):
    """Memory after 1 min and at the end, frames recorded, and the size of the file."""
    bench = Bench(crossings, next(iter(TONES_HZ)), folder)
    bench.run(60.0, LOT_S)
    first = resident_mb()
    bench.run(60.0 * (MINUTES[crossings] - 1), LOT_S)
    bench.close()
    size = sum(file.stat().st_size for file in folder.iterdir())
    return first, resident_mb(), bench.feed.counts["recorded"], bench.feed.counts["lost"], size / 1e6


def write(rows, memory):
    """Write the results."""
    text = [
        "An insole of 260 x 90 mm read live, guarded through 50 ohm, noise 0.1 %: driver, recording as HDF5, inversion "
        "with intervals and regions, page. Processor time of one core; the simulated device is counted as reading. "
        "Every frame is inverted, the cover undone. Capacitances alone at 100 kHz are refused: the phase is down to 29 "
        "degrees, where two capacitances give one reading.",
        "", "| crossings | tone | frames | faults | by | read, record [ms] | invert, show [ms] | "
        "frames/s of a core | goal |",
        "|---|---|---|---|---|---|---|---|---|", *rows, "",
        "Memory by a simulated clock, at the goal's rate and 10 kHz, a lot each second:", "",
        "| crossings | minutes | frames recorded | lost | memory after 1 min [MB] | at the end [MB] | file [MB] |",
        "|---|---|---|---|---|---|---|", *memory, "",
    ]  # fmt: skip
    page = Path(__file__).parent / "results" / "array_live.md"
    notes = page.read_text().partition(NOTES)[2] if page.exists() else ""  # by hand: they stay
    page.write_text("\n".join(text) + f"\n{NOTES}{notes}")


def memory_row(crossings, values):
    """Words of a row of :func:`grown`."""
    first, last, recorded, lost, size = values
    return f"| {crossings} | {MINUTES[crossings]} | {recorded} | {lost} | {first:.0f} | {last:.0f} | {size:.0f} |"


def main():
    """Measure and write."""
    with tempfile.TemporaryDirectory() as name:
        if len(sys.argv) > 1:
            print(json.dumps(grown(int(sys.argv[1]), Path(name))))
            return
        rows = []
        for crossings in PITCHES:
            for hertz, faults in CASES:
                rows.append(speed(crossings, hertz, Path(name), faults))
                print(rows[-1], flush=True)
    memory = []
    for crossings in PITCHES:
        done = subprocess.run([sys.executable, __file__, str(crossings)], capture_output=True, check=True, text=True)
        memory.append(memory_row(crossings, json.loads(done.stdout)))
        print(memory[-1], flush=True)
    write(rows, memory)


if __name__ == "__main__":
    main()
