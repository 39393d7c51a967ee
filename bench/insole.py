"""Virtual insoles of eleven seeds, printed, calibrated and walked on as ``sensorgen demo insole`` does.

    python bench/insole.py [SEED...]

Writes ``results/insole.md``: print 1 is the first design, print 2 the changed one, without the check of the design.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from sensorgen.design.design import make
from sensorgen.workflows import insole

HERE = Path(__file__).parent
SEEDS = (1, 2, 3, *range(101, 109))
NOTES = "## Notes\n"
GOALS = {"error_kpa": 5.0, "centre_mm": 1.0, "force": 2.0}
HEAD = """# Error of virtual insoles

Made by `bench/insole.py`: two virtual insoles of each seed, as `sensorgen demo insole --seed N` prints, calibrates and
walks on them, without the check of the design. The truth has a law, a network, hysteresis, creep and drift of its own
(`measure/virtual/array.py`). Print 1 is the first design, print 2 the changed one; both have the same two faults.
Error: rms of all determined crossings and frames; centre: rms of frames above a tenth of the largest force; force: rms
over its largest; total: frames whose total force is in its interval of 90 %.
"""


def figures(folder, seed, k):
    """Result of one print, share of frames whose total force is in its interval of 90 % [%], and faults."""
    design = make(insole.designed(k))
    run, maps, true = insole.walk(folder, design, f"{seed}-{k}", seed)
    force, sigma = maps.force_n
    newtons = (true.pressure_kpa * 1e3 * maps.model.pitch_area_m2).sum((1, 2))
    total = 100 * float((np.abs(force - newtons) < 1.645 * sigma).mean())
    return run, total, insole.faults(maps.model, np.random.default_rng(seed))


def rows(seeds):
    """Rows of the table, and those of the prints within their goals."""
    within = np.zeros((2, len(GOALS) + 1), int)
    columns = "error [kPa] | centre [mm] | force [%] | in the interval of 90 % | total"
    yield f"| seed | faults | force on lost crossings [%] | 1: {columns} | 2: {columns} |"
    yield "|---" * 13 + "|"
    for seed in seeds:
        cells = []
        with tempfile.TemporaryDirectory() as folder:
            for k in (0, 1):
                run, total, faults = figures(Path(folder), seed, k)
                if k == 0:
                    cells += [f"{', '.join(faults)}", f"{run.lost:.2g}"]
                share = 100 * run.coverage
                cells += [
                    f"{run.error_kpa:.3g}",
                    f"{run.centre_mm:.2g}",
                    f"{run.force:.2g}",
                    f"{share:.3g}",
                    f"{total:.0f}",
                ]
                within[k] += [*(getattr(run, key) <= goal for key, goal in GOALS.items()), 85 <= share <= 95]
        yield f"| {seed} | {' | '.join(cells)} |"
        print(f"| {seed} | {' | '.join(cells)} |", flush=True)
    yield f"| goal | | | {' | '.join(['5', '1', '2', '85 to 95', ''] * 2)} |"
    yield f"| within | | | {' | '.join(' | '.join([*map(str, of), '']) for of in within.tolist())} |"


def main():
    """Write the page; the notes under its table stay."""
    seeds = [int(word) for word in sys.argv[1:]] or SEEDS
    target = HERE / "results" / "insole.md"
    notes = target.read_text().partition(NOTES)[2] if target.exists() else ""
    target.write_text("\n".join([HEAD, *rows(seeds)]) + f"\n\n{NOTES}{notes}")


if __name__ == "__main__":
    main()
