"""How often intervals of material values, force and position hold the truth, over random virtual specimens.

Run as ``python bench/lab_truths.py [SPECIMENS]``; writes results/lab_truths.md. The specimens
(sensorgen.measure.virtual.specimen) share neither solver nor line with what analyses them; tests/lab/truths.py presses
each 30 times for its calibration and 20 times for the inversion.
"""

import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "lab"))

import truths

RESULTS = Path(__file__).parent / "results" / "lab_truths.md"
UNITS = {
    "resistivity_ohm_m": ("rho of the electrodes", "%"), "relative_permittivity": ("eps of the dielectric", "%"),
    "youngs_modulus_pa": ("E of the dielectric", "%"), "F": ("F of a new press", "N"), "x": ("x of a new press", "mm"),
}  # fmt: skip


def one(seed):
    """A specimen, without warnings of its logarithms."""
    warnings.simplefilter("ignore")
    return truths.outcome(seed)


def lines(found):
    """Rows of the table."""
    for name, (words, unit) in UNITS.items():
        cells = []
        for level in truths.LEVELS:
            held = np.concatenate([one.held[name, level] for one in found])
            by_specimen = np.array([np.mean(one.held[name, level]) for one in found])
            error = by_specimen.std(ddof=1) / np.sqrt(len(found))
            width = np.median([one.width[name, level] for one in found])
            shown = f"{100 * np.expm1(width):.1f} %" if unit == "%" else f"{width:.2f} {unit}"
            cells += [f"{held.mean():.3f} ± {error:.3f}", shown]
        yield f"| {words} | {' | '.join(cells)} |"


def text(found):
    """The page."""
    head = (
        f"{len(found)} random specimens of tri 0.2 mm as printed: materials, sizes, film, profile, law, leak, "
        "dispersion, hysteresis, creep, drift, lead, stray, offsets and gains all drawn at once; "
        f"{truths.KNOWN} known presses of 0.3 to 6 N calibrate each, {truths.NEW} others are inverted. Share of "
        "intervals that hold the truth, with its standard error, and their median width (of material values: upper "
        "over lower end, less 1).\n\n"
        "| value | held at 90 % | width | held at 95 % | width |\n|---|---|---|---|---|\n"
    )
    return head + "\n".join(lines(found)) + "\n"


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    truths.model(), truths.outcome(0)  # so that both processes find the bodies solved
    start, found = time.perf_counter(), []
    with ProcessPoolExecutor(2) as pool:
        for k, each in enumerate(pool.map(one, range(count), chunksize=5), 1):
            found.append(each)
            if k % 50 == 0:
                print(f"{k} of {count}, {time.perf_counter() - start:.0f} s", *lines(found), sep="\n", flush=True)
                RESULTS.write_text(text(found), "utf-8")
    RESULTS.write_text(text(found), "utf-8")


if __name__ == "__main__":
    main()
