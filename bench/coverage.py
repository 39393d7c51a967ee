"""How often force and position lie in their 90 % intervals, over virtual specimens with the errors that prints have.

Run as ``python bench/coverage.py [SPECIMENS [FEWER]]``; writes results/coverage.md. ``FEWER`` specimens make the rows
of a single error, in which they differ by their noise alone. Each specimen (tests/virtual_specimen, which
shares no line with the package) is pressed 30 times for its calibration and 200 times for the inversion.
"""

import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from sensorgen.prediction.calibration.coverage import inside
from sensorgen.prediction.calibration.fitting import calibrated, prior
from sensorgen.prediction.calibration.inversion import Inverter, Verdict
from sensorgen.prediction.inverse import Estimator
from virtual_specimen import TONES_HZ
from virtual_specimen.adapter import ERRORS, LIMIT_N, data, specimen_model, split

RESULTS = Path(__file__).parent / "results" / "coverage.md"
KNOWN, UNKNOWN = 30, 200


def before(model, ratio_of, others, truth):
    """As until now: the exact model of the design, no calibration, no reading at rest."""
    estimator = Estimator(model.sensor, TONES_HZ, truth.noise, force_limit_n=LIMIT_N)
    found = estimator.batch(ratio_of.pressed_ohm)
    force, position = inside(found, others.presses)
    return np.mean(found.status == 0), force.mean(), position.mean()


def row(name, truth_of, model, specimens, known=KNOWN):
    """Means over specimens, and tenth percentiles."""
    rows, seconds, verdicts = [], [], np.zeros(len(Verdict), int)
    for seed in range(specimens):
        truth = truth_of(seed)
        first, second = split(truth, known, UNKNOWN, seed)
        one, other = data(first, truth), data(second, truth)
        start = time.process_time()
        posterior = calibrated(model, one) if known else prior(model, other.noise[0])
        middle = time.process_time()
        found = Inverter(model, posterior, force_limit_n=LIMIT_N).batch(other.ratio)
        seconds.append((middle - start, (time.process_time() - middle) / UNKNOWN))
        verdicts += np.bincount(found.verdict, minlength=len(Verdict))
        force, position = inside(found, other.presses)
        widths = np.median(np.ptp(found.force_90_n, axis=1)), 1e3 * np.median(np.ptp(found.position_90_m, axis=1))
        rows.append([*before(model, second, other, truth), force.mean(), position.mean(), *widths])
    ok, force0, position0, force, position, wide_n, wide_mm = np.mean(rows, axis=0)
    tenth = np.percentile(np.array(rows)[:, 3:5], 10, axis=0)
    print(name, np.round([force, position, *tenth], 3), flush=True)
    return (
        f"| {name} | {specimens} | {known} | {ok:.0%} | {force0:.0%} / {position0:.0%} | "
        f"{force:.3f} / {position:.3f} | "
        f"{tenth[0]:.2f} / {tenth[1]:.2f} | {wide_n:.2f} N | {wide_mm:.0f} mm | "
        f"{verdicts[Verdict.NO_FIT] / verdicts.sum():.1%} |"
    ), np.median(seconds, axis=0)


def main():
    specimens = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    fewer = int(sys.argv[2]) if len(sys.argv) > 2 else specimens
    warnings.simplefilter("ignore")
    model, lines, seconds = specimen_model(), [], []
    cases = [(name, truth_of, KNOWN) for name, truth_of in ERRORS.items()]
    cases += [("all at once", ERRORS["all at once"], known) for known in (0, 10, 100)]
    for case in cases:
        line, took = row(case[0], case[1], model, specimens if case[0].startswith("all") else fewer, case[2])
        lines.append(line)
        seconds.append(took)
    fit, invert = np.median(seconds, axis=0)
    head = (
        f"Design: tri 0.2 mm, 100 mm, tip 5 mm, seven tones, noise 0.1 %; {UNKNOWN} presses each of "
        "0.1 to 6 N, half of them after a higher one, held for 0.3 to 30 s.\n\n"
        "| what is off | specimens | known presses | before: ok | force / place covered | now: force / place covered "
        "| tenth percentile | median width | | no fit |\n|---|---|---|---|---|---|---|---|---|---|\n"
    )
    foot = (
        f"\n\nA calibration takes {fit:.2f} s of processor time; an inversion in a batch {1e3 * invert:.2f} ms, its "
        "table included.\n"
    )
    RESULTS.write_text(head + "\n".join(lines) + foot)


if __name__ == "__main__":
    main()
