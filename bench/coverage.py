"""How often force and position lie in their 90 % intervals, over virtual specimens with the errors that prints have.

Run as ``python bench/coverage.py [SPECIMENS [FEWER]]``; writes results/coverage.md. ``FEWER`` specimens make the rows
of a single error, in which they differ by their noise alone. Each specimen (tests/virtual_specimen, which
shares no line with the package) is pressed 30 times for its calibration and 200 times for the inversion. A fifth
of ``SPECIMENS`` of another simulator (tests/independent_sensor.py) change after their calibration.

Each coverage has the binomial interval of 95 % (Wilson) of as many presses as are independent: those of a specimen
share its calibration, so that specimens differ by more than chance.
"""

import sys
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import independent_sensor
from independent_data import data_of, model_of, none_of
from sensorgen.prediction.calibration.calibration import inside
from sensorgen.prediction.calibration.fitting import Data, by_rest, calibrated, gain, rest_gain
from sensorgen.prediction.calibration.inversion import OTHERWISE, Inverter, Verdict, doubt_rest
from sensorgen.prediction.calibration.rest import Baseline
from sensorgen.prediction.calibration.specimen import Presses
from sensorgen.prediction.inverse.estimator import Estimator
from virtual_specimen import TONES_HZ
from virtual_specimen.adapter import ERRORS, LIMIT_N, data, specimen_model, split

RESULTS = Path(__file__).parent / "results" / "coverage.md"
KNOWN, UNKNOWN, AFTER = 30, 200, 80
NOISE = 1e-3
BEFORE = {  # of 12 specimens by the inversion of November 2026, which judged a reading by its ratio to rest alone
    True: {
        0: "- | 0.63 / 0.96", 10: "0.92 | 0.93 / 0.95", "sound": "0.98 | 0.93 / 0.95",
        "second press of 2 N at 20 mm": "0.62 | 0.17", "rest read under 1 N": "0.98 | 0.43",
        "trace broken at 50 mm": "0.74 | 0.20", "hand: +0.5 pF while pressed": "0.13 | 0.00",
        "1.4 x softer (aged)": "0.74 | 0.44", "finger of 15 mm, told 5": "0.85 | 0.74",
        "edge lifted beyond 70 mm": "0.85 | 0.40", "another specimen": "0.68 | 0.49",
        "press at 96 to 99.5 mm": "0.97 | 0.88",
    },
    False: {
        0: "- | 1.00 / 0.96", 10: "1.00 | 0.94 / 0.95", "sound": "0.99 | 0.94 / 0.95",
        "second press of 2 N at 20 mm": "0.38 | 0.00", "rest read under 1 N": "0.98 | 0.00",
        "trace broken at 50 mm": "0.68 | 0.04", "hand: +0.5 pF while pressed": "0.29 | 0.00",
        "1.4 x softer (aged)": "0.75 | 0.11", "finger of 15 mm, told 5": "0.58 | 0.21",
        "edge lifted beyond 70 mm": "0.81 | 0.09", "another specimen": "0.93 | 0.54",
        "press at 96 to 99.5 mm": "0.99 | 0.83",
    },
}  # fmt: skip


def before(model, ratio_of, others, truth):
    """As until now: the exact model of the design, no calibration, no reading at rest."""
    estimator = Estimator(model.sensor, TONES_HZ, truth.noise, force_limit_n=LIMIT_N)
    found = estimator.batch(ratio_of.pressed_ohm)
    force, position = inside(found, others.presses)
    return np.mean(found.status == 0), force.mean(), position.mean()


def interval(shares, of):
    """Ends of the share that is covered, 95 %, by the shares of specimens with so many presses each."""
    shares, of = np.asarray(shares, float), np.broadcast_to(of, len(shares))
    p = np.average(shares, weights=of)
    chance = np.sum(of * (shares - p) ** 2) / max(len(shares) - 1, 1) / max(p * (1 - p), 1e-9)
    n, z = of.sum() / max(chance, 1.0), 1.96
    middle, half = p + z * z / (2 * n), z * (p * (1 - p) / n + z * z / (4 * n * n)) ** 0.5
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def told(shares, of, digits=3):
    """Coverage with its interval."""
    low, high = interval(shares, of)
    of = np.broadcast_to(of, len(shares))
    return f"{np.average(shares, weights=of):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def of_the_simulator(truth_of):
    """Session of a specimen of the simulator: known presses, others, and how many of the others a design alone gets."""

    def specimen(model, known, seed):
        truth = truth_of(seed)
        first, second = split(truth, known, UNKNOWN, seed)
        other = data(second, truth)
        return data(first, truth), other, before(model, second, other, truth)

    return specimen


def of_the_prior(model, known, seed):
    """Session of a specimen as the calibration expects them: drawn from its own prior, read with its own noise."""
    rng, spread, n = np.random.default_rng(seed), model.spread, known + UNKNOWN
    at = rng.standard_normal(len(model.names))
    unloading = np.where(rng.random(n) < 0.5, 0.0, abs(rng.normal(0.25, 0.25, n)))
    presses = Presses(
        rng.uniform(0.1, 6, n), rng.uniform(0, model.sensor.length_m, n), unloading, rng.normal(0.5, 0.6, n)
    )
    changes = rng.standard_normal((n, 3)) * [spread.scatter, spread.wander, spread.wander]
    ratio = np.concatenate([model.ratio(at, presses.rows([k]), changes[k]) for k in range(n)])
    noise = np.full(ratio.shape, NOISE)
    ratio = ratio + NOISE * (rng.standard_normal(ratio.shape) + 1j * rng.standard_normal(ratio.shape))
    real, imaginary = np.split(np.linalg.cholesky(rest_gain(model)) @ rng.standard_normal(2 * len(TONES_HZ)), 2)
    rest = model.rest(at) + real + 1j * imaginary
    every = Data(presses, ratio, noise, rest, noise[0] / n**0.5)
    return every.rows(np.arange(known)), every.rows(np.arange(known, n)), (np.nan,) * 3


def row(name, specimen, model, specimens, known=KNOWN):
    """Means over specimens, and tenth percentiles."""
    rows, seconds, verdicts = [], [], np.zeros(len(Verdict), int)
    for seed in range(specimens):
        one, other, without = specimen(model, known, seed)
        start = time.process_time()
        posterior = calibrated(model, one) if known else by_rest(model, other.rest, other.rest_noise, other.noise[0])
        middle = time.process_time()
        inverted = Inverter(model, posterior, force_limit_n=LIMIT_N).batch(other.ratio)
        seconds.append((middle - start, (time.process_time() - middle) / UNKNOWN))
        verdicts += np.bincount(inverted.verdict, minlength=len(Verdict))
        force, position = inside(inverted, other.presses)
        widths = np.median(np.ptp(inverted.force_90_n, axis=1)), 1e3 * np.median(np.ptp(inverted.position_90_m, axis=1))
        rows.append([*without, force.mean(), position.mean(), *widths])
    ok, force0, position0, force, position, wide_n, wide_mm = np.mean(rows, axis=0)
    by_specimen = np.array(rows)[:, 3:5].T
    tenth = np.percentile(np.array(rows)[:, 3:5], 10, axis=0)
    print(name, known, np.round([force, position, *tenth], 3), flush=True)
    uncalibrated = "- | -" if np.isnan(ok) else f"{ok:.0%} | {force0:.0%} / {position0:.0%}"
    return (
        f"| {name} | {specimens} | {known} | {uncalibrated} | "
        f"{' / '.join(told(shares, UNKNOWN) for shares in by_specimen)} | "
        f"{tenth[0]:.2f} / {tenth[1]:.2f} | {wide_n:.2f} N | {wide_mm:.0f} mm | "
        f"{verdicts[Verdict.NO_FIT] / verdicts.sum():.1%} |"
    ), np.median(seconds, axis=0)


def after(model, posterior, reference, strip, seed, where):
    """Presses of another day: which readings are answered, ok or of force only; whether force and position hold."""
    made = independent_sensor.run(independent_sensor.next_day(strip, seed), AFTER, seed + 77, where)
    unseen = data_of(made, strip.noise)
    base, averages = Baseline(model, posterior, reference), independent_sensor.AVERAGES
    changed = np.array([bool(base.change(z, strip.noise / averages**0.5)) for z in made.rest_ohm])
    known = posterior.presses > 0
    allowed = {"otherwise": OTHERWISE, "session": True} if known else {}
    inverter = Inverter(model, posterior, force_limit_n=7.5 if known else 13.0, **allowed)
    inverted = inverter.batch(unseen.ratio, changed=changed)
    doubt_rest(inverted, np.zeros(AFTER, bool), 0)
    ok = inverted.verdict == Verdict.OK
    return (
        ok,
        ok | (inverted.verdict == Verdict.FORCE_ONLY),
        *inside(inverted, unseen.presses),
        np.ptp(inverted.force_90_n, axis=1),
    )


def changes(printed, specimens):
    """Rows of the table: the sound sensor with 0, 10 and 30 known presses, and what changed after 30."""
    model, rows = model_of(printed), {}
    for seed in range(specimens):
        strip = independent_sensor.drawn_at_random(seed, printed)
        data = data_of(independent_sensor.run(strip, KNOWN, seed), strip.noise)
        for known in (0, 10, KNOWN):
            some = data.rows(np.arange(known)) if known else none_of(data)
            posterior = calibrated(model, some) if known else by_rest(model, some.rest, 3e-4, some.single)
            reference = gain(model, some, posterior.at)
            for name, (change, where) in independent_sensor.CHANGES.items():
                if known == KNOWN or name == "sound":
                    found = after(model, posterior, reference, change(strip, seed), seed, where)
                    rows.setdefault(known if known < KNOWN else name, []).append(found)
    for key, found in rows.items():
        ok, answered, width = (np.concatenate([one[k] for one in found]) for k in (0, 1, 4))
        sound = key == "sound" or isinstance(key, int)
        counted = [[one[2 + k][slice(None) if sound else one[1]] for one in found] for k in range(1 + sound)]
        parts = [[part for part in parts if part.size] for parts in counted]
        covered = " / ".join(told([p.mean() for p in of], [p.size for p in of], 2) for of in parts if of) or "-"
        given = "-" if key == 0 else f"{answered.mean():.2f} ({ok.mean():.2f})"
        name = f"sound, {KNOWN if key == 'sound' else key} known presses" if sound else key
        line = f"| {'printed' if printed else 'drawn'} | {name} | {BEFORE[printed][key]} | {given} | {covered} | "
        print(line, flush=True)
        yield line + f"{np.median(width):.2f} N |"


def changes_text(specimens):
    """Section on sensors that changed, as printed and as drawn."""
    head = (
        "\n## Changed after the calibration\n\n"
        f"Design: tri 0.2 mm, 100 mm, told a tip of 5 mm (4.6 to 5.5 mm), seven tones, noise 0.1 %; {specimens} "
        f"specimens of a simulator that shares no code, {AFTER} presses each on another day: 1.5 K, 5 ohm, 0.1 pF off. "
        "Prints have gaps of 0.18 to 0.42 mm, every third is as drawn. Answered: ok or force only; covered: the 90 % "
        "interval of the force (and of the position) holds it, of a changed sensor among those answered.\n\n"
        "| body | sensor | before: answered | covered | now: answered (ok) | covered | median width |\n"
        "|---|---|---|---|---|---|---|\n"
    )
    rows = [row for printed in (True, False) for row in changes(printed, specimens)]
    foot = (
        "\n\nAt 0.1 % noise the frequencies cannot tell one press from two, or from a hand: their second-order "
        "difference is below 0.03 % of Z. At 0.01 % on electrodes of 50 kohm half to four fifths of them are seen as "
        "more than one press. A rest read under 1 N shifts C of a blunt print by 0.07 %: less than a day does; the "
        "readings of a session that lie below it show it together. At the end half of the tip presses twice as hard "
        "and C of a sharp cell rises less: one reading tells the place to 67 mm, those of a session together that all "
        "are there. After a recheck by 5 presses the sound sensor's median width is 1.2 N as drawn and 1.9 N as "
        "printed, covered by 0.94 to 0.95; softened by 1.4, 1.0 and 1.6 N, 0.94 to 0.96.\n"
    )
    return head + "\n".join(rows) + foot


def main():
    specimens = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    fewer = int(sys.argv[2]) if len(sys.argv) > 2 else specimens
    warnings.simplefilter("ignore")
    changed = changes_text(max(specimens // 5, 3))
    model, lines, seconds = specimen_model(), [], []
    cases = [(name, of_the_simulator(truth_of), KNOWN) for name, truth_of in ERRORS.items()]
    cases += [("all at once", of_the_simulator(ERRORS["all at once"]), known) for known in (0, 10, 100)]
    cases += [("all, drawn from the prior", of_the_prior, known) for known in (0, 10, KNOWN)]
    for name, specimen, known in cases:
        line, took = row(name, specimen, model, specimens if name.startswith("all") else fewer, known)
        lines.append(line)
        seconds.append(took)
    fit, invert = np.median(seconds, axis=0)
    head = (
        f"Design: tri 0.2 mm, 100 mm, tip 5 mm, seven tones, noise 0.1 %; {UNKNOWN} presses each of "
        "0.1 to 6 N, half of them after a higher one, held for 0.3 to 30 s. In brackets the binomial interval of 95 %, "
        "of as many presses as the scatter between specimens makes independent. Without known presses a reading at "
        "rest is all that is known of a specimen.\n\n"
        "| what is off | specimens | known presses | before: ok | force / place covered | now: force / place covered "
        "| tenth percentile | median width | | no fit |\n|---|---|---|---|---|---|---|---|---|---|\n"
    )
    foot = (
        "\n\nSpecimens of a single error hold more than 90 % because they have neither scatter nor wander, "
        "hysteresis, creep or leak, which 30 presses cannot exclude; those with all errors, without known presses, "
        "because they vary less than the prior: R by 20 % against a factor of 3.3 (one standard deviation), C by 15 "
        "against 20 %, the rise by 11 against 22 %, as their modulus is that of the design. Specimens drawn from the "
        "prior do not.\n"
        f"\nA calibration takes {fit:.2f} s of processor time; an inversion in a batch {1e3 * invert:.2f} ms, its "
        "table included.\n"
    )
    RESULTS.write_text(head + "\n".join(lines) + foot + changed)


if __name__ == "__main__":
    main()
