"""How often hidden values lie in the intervals of ``sensorgen characterise``, over labs that measure by other models.

Run as ``python bench/characterise.py [LABS]``; writes results/characterise.md. Each lab (tests/models/virtual_lab.py)
prints lines too thin by up to 10 %, measures with 1 % noise, and half of the labs have a dead coupon.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "models"))

import virtual_lab

from sensorgen.analysis.characterise import Meters
from sensorgen.analysis.characterise import posterior as posteriors
from sensorgen.analysis.characterise.posterior import posterior
from sensorgen.workflows.characterise import HOURS, MOST, Study, named

RESULTS = Path(__file__).parent / "results" / "characterise.md"


def labs(study, coupons, count, *, dead, seed):
    """Covered (labs, targets), half widths [%], errors in standard deviations, and how many dead coupons were found."""
    rng, meters = np.random.default_rng(seed), Meters()
    covered, widths, errors, found_dead = [], [], [], 0
    for _ in range(count):
        truth = virtual_lab.hidden(rng, [c.name for c in coupons])
        truth = truth if dead else replace(truth, dead="")
        found = posterior([virtual_lab.measured(c, truth, meters, rng) for c in coupons], study.unknowns)
        found_dead += truth.dead in found.dead()
        values = virtual_lab.true_targets(truth)
        rows = []
        for target in study.targets:
            role = "conductor" if target.material == study.conductor else "dielectric"
            value, interval = values[role, target.quantity], found.interval(target)
            sigma = (interval.high - interval.low) / 3.92
            rows.append(
                (interval.low <= value <= interval.high, 100 * interval.half_width(), (interval.value - value) / sigma)
            )
        covered.append([r[0] for r in rows])
        widths.append([r[1] for r in rows])
        errors.append([r[2] for r in rows])
    return np.array(covered), np.array(widths), np.array(errors), found_dead


def main(count=200):
    study = Study.of("diabase-h5", ["etpu", "x60"])
    found = posteriors.candidates(study.coupons, study.unknowns, study.targets, Meters())
    chosen = posteriors.select(
        found, MOST - 1, lambda s: study.hours([study.coupons[k] for k in s]) <= HOURS
    )  # fmt: skip
    coupons = named([study.coupons[k] for k in chosen])
    expected = found.expected(chosen, study.unknowns)
    before = time.process_time()
    sound, dead = (labs(study, coupons, count, dead=dead, seed=17 + dead) for dead in (False, True))
    seconds = (time.process_time() - before) / 2 / count
    lines = [
        f"{count} labs with sound coupons and {count} with one dead coupon; 95 % intervals, 1 % meters, lines extruded "
        "to 90 to 100 %. Coupons: " + ", ".join(c.name for c in coupons) + ".", "",
        "| quantity | goal [%] | expected [%] | sound: median, tenth largest half width [%] | covered | mean error "
        "[sigma] | one dead: median | covered |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for k, target in enumerate(study.targets):
        goal = f"{100 * target.goal:g}" if target.goal else ""
        wide = f"{100 * expected.interval(target).half_width():.1f}" if target.goal else ""
        lines.append(
            f"| {target.title}, {target.material} | {goal} | {wide} | {np.median(sound[1][:, k]):.1f}, "
            f"{np.quantile(sound[1][:, k], 0.9):.1f} | {sound[0][:, k].mean():.0%} | {sound[2][:, k].mean():+.2f} | "
            f"{np.median(dead[1][:, k]):.1f} | {dead[0][:, k].mean():.0%} |"
        )
    lines += [
        "", f"Together: {sound[0].mean():.1%} covered with sound coupons, {dead[0].mean():.1%} with a dead one; "
        f"{dead[3]} of {count} dead coupons were found. {seconds:.2f} s of processor time for a lab, its own models "
        "included.",
    ]  # fmt: skip
    RESULTS.write_text("\n".join(lines) + "\n", "utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
