"""Batches: our own work beside the slicer's, and how both grow with the number of specimens.

Seconds are the processor's, ours of this process, the slicer's of its own. Imports are paid once and stand apart.
Plates are of 100 x 10 mm sensors, half of them plain plates. Writes ``results/batch.md``.
"""

import resource
import tempfile
import time
from pathlib import Path

START = time.process_time()

from sensorgen.design.printer import load_printer, load_quality  # noqa: E402
from sensorgen.workflows.batch import STEPS, make  # noqa: E402 - timed
from sensorgen.workflows.batch.layout import packed, room  # noqa: E402

IMPORTS_S = time.process_time() - START
HERE = Path(__file__).parent
CASES = (("tri", 2), ("tri", 10), ("tri", 20), ("tri", 32), ("rect", 20))
PLAN = (
    "iteration: 1\ndesigns:\n  - {{shape: {shape}, replicates: {half}}}\n  - {{shape: reference, replicates: {half}}}\n"
)


def of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Clock:
    """Processor time between the steps that a batch tells of."""

    def __init__(self):
        self.spent, self.name, self.last = dict.fromkeys(STEPS, 0.0), STEPS[0], time.process_time()

    def __call__(self, name):
        now = time.process_time()
        self.spent[self.name] += now - self.last
        self.name, self.last = name, now


def rows():
    yield (
        "| specimens | lines | ours [s] | checks, predictions | 3MF, labels | G-code | as printed | slicer [s] "
        "| ours/slicer |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for shape, number in (CASES[0], *CASES):  # the first fills caches
        with tempfile.TemporaryDirectory() as folder:
            plan = Path(folder) / "plan.yaml"
            plan.write_text(PLAN.format(shape=shape, half=number // 2))
            clock, before, start = Clock(), of_children(), time.process_time()
            made = make(plan, Path(folder) / "out", step=clock)
            ours, slicer = time.process_time() - start, of_children() - before
            lines = (made.folder / "plan.prusa.gcode").read_bytes().count(b"\n")
        s = clock.spent
        row = (
            f"| {number}, {shape} and plates | {lines} | {ours:.2f} | {s['checks'] + s['predictions']:.2f} "
            f"| {s['3MF']:.2f} | {s['slicing'] + s['record']:.2f} | {s['as printed']:.2f} | {slicer:.1f} "
            f"| {ours / slicer:.1%} |"
        )
        print(row, flush=True)
        yield row


def packing():
    yield "| specimens | packed in [ms] | plates |"
    yield "|---|---|---|"
    here = room(load_printer("diabase-h5"), load_quality("fine"), 2, 5.0, 0.0)
    for number in (10, 100, 1000):
        sizes = [(20.0 + 7 * (k % 13), 6.0 + k % 5) for k in range(number)]
        start = time.process_time()
        plates = packed(sizes, here)
        yield f"| {number} of many sizes | {1000 * (time.process_time() - start):.1f} | {len(plates)} |"


def main() -> None:
    measured = list(rows())
    del measured[2]
    text = [
        "# Batches", "",
        f"Processor seconds; imports, {IMPORTS_S:.2f} s, are paid once and not in them. PrusaSlicer, fine layers.", "",
        *measured, "",
        *packing(), "",
    ]  # fmt: skip
    (HERE / "results" / "batch.md").write_text("\n".join(text), "utf-8")
    print("\n".join(text))


if __name__ == "__main__":
    main()
