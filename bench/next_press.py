"""How many presses the next-best press saves, on virtual specimens with all errors at once.

Run as ``python bench/next_press.py [SPECIMENS]``; writes results/next_press.md. Each specimen (tests/virtual_specimen,
which shares no line with the package) is pressed at random, as ``bench plan`` with unloading and holds of 0.3 to 30 s,
and press by press as ``sensorgen.prediction.calibration.next_press`` chooses, in the same ranges of force and place.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from sensorgen.prediction.calibration.calibration import coverage_of
from sensorgen.prediction.calibration.fitting import Data, calibrated
from sensorgen.prediction.calibration.inversion import Inverter
from sensorgen.prediction.calibration.next_press import AIMS, VALUES, NextPress, PossiblePresses
from sensorgen.prediction.calibration.specimen import Presses
from virtual_specimen import LENGTH_M, drawn, measured, session
from virtual_specimen.adapter import LIMIT_N, data, specimen_model

RESULTS = Path(__file__).parent / "results" / "next_press.md"
FORCE_N, HOLD_S, CHOSEN, UNKNOWN = (0.1, 6.0), (0.3, 30.0), 10, 100
RANDOM = (5, 10, 15, 20, 25, 30, 40, 50, 60, 80, 100)


def spread(model, posterior):
    """Ln of the determinant of the values' covariance."""
    which = [model.names.index(name) for name in VALUES]
    return np.linalg.slogdet(posterior.covariance[np.ix_(which, which)])[1]


def weight(chooser, posterior):
    """Mean variance that the posterior leaves in ratios anywhere, over their own."""
    return float(np.einsum("ab,ab->", chooser._weight(posterior), posterior.covariance))


def chosen(model, truth, aim, seed):
    """Posteriors after each chosen press."""
    tip = truth.tip_m
    first = data(session(truth, 1, seed), truth)
    known = first.rows(np.arange(0))
    found, rng = [calibrated(model, known)], np.random.default_rng(seed)
    within = PossiblePresses(FORCE_N, (tip / 2, LENGTH_M - tip / 2), HOLD_S)
    chooser = NextPress(model, within, first.noise[0], aim)
    for _ in range(CHOSEN):
        press = chooser.best(found[-1])
        row = [np.array([v]) for v in (press.force_n, press.position_m, press.peak_n, press.hold_s)]
        one = data(measured(truth, *row, rng), truth)
        presses = Presses(
            *(
                np.concatenate(both)
                for both in zip(vars(known.presses).values(), vars(one.presses).values(), strict=True)
            )
        )
        known = Data(presses, np.concatenate([known.ratio, one.ratio]), np.concatenate([known.noise, one.noise]),
                     known.rest, known.rest_noise)  # fmt: skip
        found.append(calibrated(model, known))
    return found, chooser


def random(model, truth, seed):
    """Posteriors after some numbers of random presses."""
    all_of = data(session(truth, RANDOM[-1], seed, FORCE_N), truth)
    order = np.random.default_rng(seed).permutation(RANDOM[-1])
    return [calibrated(model, all_of.rows(np.sort(order[:count]))) for count in RANDOM]


def needed(values, target):
    """Random presses for a value, straight between the counts over their logarithm; the last count where it is less."""
    return float(np.exp(np.interp(-target, -np.array(values), np.log(RANDOM))))


def inverted(model, posterior, truth, seed):
    """Coverage and widths on presses that were not known."""
    other = data(session(truth, UNKNOWN, seed + 5000, FORCE_N), truth)
    return coverage_of(Inverter(model, posterior, force_limit_n=LIMIT_N).batch(other.ratio), other.presses)


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    model, rows, widths, seconds = specimen_model(), {aim: [] for aim in AIMS}, {}, []
    for seed in range(count):
        truth = drawn(seed)
        by_chance = random(model, truth, seed)
        runs = {}
        for aim in AIMS:
            begun = time.process_time()
            found, chooser = chosen(model, truth, aim, seed)
            seconds.append((time.process_time() - begun) / CHOSEN)
            measure = (lambda p: spread(model, p)) if aim == "values" else (lambda p, c=chooser: weight(c, p))
            levels = [measure(p) for p in by_chance]
            rows[aim].append([needed(levels, measure(found[k])) / k for k in (5, CHOSEN)])
            runs[f"{CHOSEN} chosen for {aim}"] = found[-1]
        runs["10 at random"], runs["30 at random"] = by_chance[1], by_chance[5]
        for name, posterior in runs.items():
            c = inverted(model, posterior, truth, seed)
            widths.setdefault(name, []).append(
                (c.force_width_n, 1e3 * c.position_width_m, c.force / c.presses, c.position / c.presses)
            )
        print(seed, {aim: np.round(rows[aim][-1], 1).tolist() for aim in AIMS}, flush=True)
    write(count, rows, widths, float(np.median(seconds)))


def write(count, rows, widths, seconds):
    """The results' page."""
    lines = [
        f"# The next-best press\n\n{count} virtual specimens with all errors at once (design, tip and noise as in "
        "[coverage](coverage.md)). How many random presses leave the same covariance, over the number of chosen ones: "
        "median, and 10th percentile.\n\n"
        "| aim | covariance of | after 5 chosen | after 10 chosen | goal |\n|---|---|---|---|---|"
    ]
    about = {"values": f"{', '.join(VALUES)} (determinant)", "presses": "ratios of presses anywhere (mean variance)"}
    for aim, factors in rows.items():
        cells = [f"{np.median(f):.1f} ({np.percentile(f, 10):.1f})" for f in zip(*factors, strict=True)]
        lines.append(f"| {aim} | {about[aim]} | {cells[0]} | {cells[1]} | 3 |")
    lines.append(
        f"\nA factor ends at {RANDOM[-1]} random presses. Choosing one press, with the calibration before it, takes "
        f"{seconds:.2f} s of processor time.\n\n{UNKNOWN} other presses, inverted after each calibration (90 % "
        "intervals):\n\n"
        "| calibrated by | width of force | of place | force covered | place covered |\n|---|---|---|---|---|"
    )
    for name, found in widths.items():
        force, place, *covered = np.mean(found, axis=0)
        lines.append(f"| {name} | {force:.2f} N | {place:.0f} mm | {covered[0]:.3f} | {covered[1]:.3f} |")
    RESULTS.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
