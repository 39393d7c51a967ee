"""Processor time of whole predictions, drawn and printed, for shapes whose print is a stack of polygons.

Prints rows for ``results/round_prints.md``, one run each. Run it with the sources of two versions by turns for medians
of pairs: ``PYTHONPATH=other/src python bench/round_prints.py``.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
import tempfile
import time

from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate

SHAPES = {"bump": {}, "cone": {}, "pyramid": {}, "rect": {"angle_deg": 45.0}}


def row(shape: str) -> str:
    """Capacitance between certified bounds and processor time of one design of 10 mm by 10 mm."""
    design = make({"shape": shape, "parameters": {"length_mm": 10.0, "width_mm": 10.0} | SHAPES[shape]})
    with tempfile.TemporaryDirectory() as folder:
        os.environ["SENSORGEN_CACHE"] = folder
        start = time.process_time()
        found = evaluate(bodies.estimated(design))
        seconds = time.process_time() - start
    both = [one.capacitance.model for one in (found.drawn, found) if one and one.capacitance]
    cells = " | ".join(f"{c.lower * 1e12:.4f} to {c.upper * 1e12:.4f}" for c in both)
    return f"| {shape} | {cells} | {seconds:.1f} |"


if __name__ == "__main__":
    for name in sys.argv[1:] or SHAPES:
        print(row(name), flush=True)
