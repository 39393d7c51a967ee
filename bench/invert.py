"""The way back to force and position: estimates per second against error, all methods on the same readings.

Run as ``python bench/invert.py``; writes results/invert.json, .md and .png. Times are the processor's, one thread: what
a clock shows on an idle machine, and nearly that on a busy one. Every run takes each method once; rates are medians.
"""

import dataclasses
import json
import os
import platform
import statistics
import sys
import time
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy is loaded

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "models"))

import line_fit

from sensorgen.design.design import make
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.inverse.estimator import Estimator, Prior
from sensorgen.prediction.inverse.verdict import Status
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.sensor_model import build_sensor

RESULTS = Path(__file__).parent / "results"
TONES = np.array(TONES_HZ)
NOISE = 1e-3
RUNS = 9
COUNT = {"batch": 8192, "stream": 500, "posterior": 2_000, "scipy": 60}  # a batch that one thread takes
TARGETS = {"batch": 50_000, "stream": 1_500}


def sensors():
    """Sensors that can locate a press at this noise, and the thesis's plate, which cannot."""
    tri = build_sensor(drawn(make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}}))).sensor
    plate = build_sensor(drawn(make({"shape": "reference"}))).sensor
    return {
        "tri 0.1 mm, 0.83 ohm m, tones to 100 kHz": (dataclasses.replace(tri, resistivity_ohm_m=(1 / 1.2,) * 2), TONES),
        "tri 0.1 mm, 5 ohm m, tones to 100 kHz": (dataclasses.replace(tri, resistivity_ohm_m=(5.0,) * 2), TONES),
        "tri 0.1 mm, 5 ohm m, tones to 1 MHz": (dataclasses.replace(tri, resistivity_ohm_m=(5.0,) * 2), TONES * 10),
        "the thesis's plate, tones to 100 kHz": (plate, TONES),
    }


class Case:
    """Readings of presses that a person might make: 1 to 6 N, 10 mm and more away from the ends."""

    def __init__(self, sensor, tones, seed=0):
        rng = np.random.default_rng(seed)
        self.sensor, self.tones, n = sensor, tones, COUNT["batch"]
        self.force, self.position = rng.uniform(1, 6, n), rng.uniform(0.01, 0.09, n)
        exact = sensor.impedance(tones, self.force[:, None], self.position[:, None])
        self.exact = exact
        self.z = exact * (1 + NOISE * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape)))
        self.estimator = Estimator(sensor, tones, NOISE, force_limit_n=6.5)
        self.prior = Estimator(sensor, tones, NOISE, Prior(), force_limit_n=6.5)

    def batch(self):
        found = self.estimator.batch(self.z)
        return found.force_n, found.position_m

    def stream(self):
        found = [self.estimator.batch(z[None]) for z in self.z[: COUNT["stream"]]]
        return np.concatenate([f.force_n for f in found]), np.concatenate([f.position_m for f in found])

    def posterior(self):
        found = self.prior.batch(self.z[: COUNT["posterior"]])
        return found.force_n, found.position_m

    def scipy(self):
        found = np.array([self._peer(z) for z in self.z[: COUNT["scipy"]]])
        return found[:, 0], found[:, 1] / 100

    def _peer(self, z):
        def off(p):
            u = np.log(z / self.sensor.impedance(self.tones, p[0], p[1] / 100)) / NOISE
            return np.concatenate([u.real, u.imag])

        starts = [least_squares(off, (3.0, x), bounds=([0, 0], [6.5, 10.0]), x_scale=(1, 1)) for x in (2.5, 7.5)]
        best = min(starts, key=lambda r: r.cost)
        np.linalg.pinv(best.jac.T @ best.jac)  # the covariance, which ours gives as well
        return best.x

    def thesis(self):
        """Fitted to presses without noise over the whole range, read off the highest tone."""
        c, r = line_fit.series(self.tones[-1], self.exact[:, -1])
        fit = line_fit.fit(self.force, self.position, c, r)
        roots = fit.presses(*line_fit.series(self.tones[-1], self.z[:, -1]))
        return roots.force_n, roots.choice(self.sensor.length_m)

    def forward(self):
        self.sensor.impedance(self.tones, self.force[:, None], self.position[:, None])
        return self.force, self.position

    def bound(self):
        """Root mean square of the Cramer-Rao standard errors over the presses; from the sensor's own derivatives."""
        part = slice(0, 4000)
        z, by_force, by_position = self.sensor.response(self.tones, self.force[part, None], self.position[part, None])
        j = np.stack([by_force / abs(z), by_position / abs(z)], -1) / NOISE
        covariance = np.linalg.inv((j.conj().transpose(0, 2, 1) @ j).real)
        return np.sqrt(np.mean(covariance[:, [0, 1], [0, 1]], 0))


METHODS = {
    "least squares, batch": "batch", "least squares, one by one": "stream", "posterior, uniform prior": "posterior",
    "scipy least_squares, two starts": "scipy", "thesis C.1-C.5 corrected": "thesis",
    "(forward model alone)": "forward",
}  # fmt: skip


def measured(name, sensor, tones):
    """All methods in turn on one sensor."""
    case = Case(sensor, tones)
    times = {method: [] for method in METHODS}
    answers = {}
    for _ in range(RUNS):
        for method, work in METHODS.items():
            start = time.process_time()
            answers[method] = getattr(case, work)()
            times[method].append(time.process_time() - start)
    bound_n, bound_m = case.bound()
    rows = []
    for method, (force, position) in answers.items():
        n = len(force)
        off_n, off_m = force - case.force[:n], position - case.position[:n]
        rows.append({
            "sensor": name, "method": method, "per_second": n / statistics.median(times[method]),
            "rms_n": float(np.sqrt(np.mean(off_n**2))), "rms_mm": float(np.sqrt(np.mean(off_m**2)) * 1e3),
            "bound_n": float(bound_n), "bound_mm": float(bound_m * 1e3),
        })  # fmt: skip
    return rows


def fixed(sensor, tones, force=3.0, position=0.045, n=10_000):
    """Error over the bound and coverage at one press; and the largest error without noise over the whole sensor."""
    rng = np.random.default_rng(1)
    estimator = Estimator(sensor, tones, NOISE)
    z = np.tile(sensor.impedance(tones, force, position), (n, 1))
    found = estimator.batch(z * (1 + NOISE * (rng.normal(size=z.shape) + 1j * rng.normal(size=z.shape))))
    zz, by_force, by_position = sensor.response(tones, force, position)
    j = np.stack([by_force / abs(zz), by_position / abs(zz)], -1) / NOISE
    limit = np.sqrt(np.diag(np.linalg.inv((j.conj().T @ j).real)))
    off = np.stack([found.force_n - force, found.position_m - position], -1)
    cover = [
        float(np.mean((interval[:, 0] < truth) & (truth < interval[:, 1])))
        for interval, truth in ((found.force_90_n, force), (found.position_90_m, position))
    ]
    f, x = rng.uniform(0.2, 6, n), rng.uniform(0, sensor.length_m, n)
    exact = estimator.batch(sensor.impedance(tones, f[:, None], x[:, None]))
    told = exact.status <= Status.AMBIGUOUS
    return {
        "bound_n": float(limit[0]), "bound_mm": float(limit[1] * 1e3),
        "rms_over_bound": (np.sqrt(np.mean(off**2, 0)) / limit).tolist(), "coverage_90": cover,
        "without_noise_n": float(abs(exact.force_n - f)[told].max(initial=0.0)),
        "without_noise_mm": float(abs(exact.position_m - x)[told].max(initial=0.0) * 1e3), "told": float(told.mean()),
    }  # fmt: skip


def table(rows, checks):
    lines = [
        "| sensor | method | estimates/s | rms F [N] | bound | rms x [mm] | bound |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        error = (
            "| | | | |"
            if r["method"].startswith("(")
            else (f"| {r['rms_n']:.3g} | {r['bound_n']:.3g} | {r['rms_mm']:.3g} | {r['bound_mm']:.3g} |")
        )
        lines.append(f"| {r['sensor']} | {r['method']} | {r['per_second']:,.0f} {error}")
    lines += [
        "",
        "At 3 N and 45 mm, 10 000 samples; without noise over the whole sensor, 0.2 to 6 N, 10 000 presses:",
        "",
    ]
    lines += ["| sensor | bound F, x | rms over bound F, x | 90 % intervals cover | largest error without noise |"]
    lines += ["|---|---|---|---|---|"]
    for name, c in checks.items():
        lines.append(
            f"| {name} | {c['bound_n']:.3g} N, {c['bound_mm']:.3g} mm | "
            f"{c['rms_over_bound'][0]:.3f}, {c['rms_over_bound'][1]:.3f} | "
            f"{c['coverage_90'][0]:.1%}, {c['coverage_90'][1]:.1%} | "
            f"{_without_noise(c)} |"
        )
    return "\n".join(lines) + "\n"


def _without_noise(check):
    if not check["told"]:
        return "no position is identifiable"
    return f"{check['without_noise_n']:.1e} N, {check['without_noise_mm']:.1e} mm ({check['told']:.0%} identifiable)"


def picture(rows, path):
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(r["sensor"] for r in rows))
    figure, axes = plt.subplots(
        2, len(names), figsize=(3.6 * len(names), 6.4), sharex=True, sharey="row", squeeze=False
    )
    marks = dict(zip(METHODS, "osD^vx", strict=True))
    for column, name in enumerate(names):
        for row, (key, unit) in enumerate((("n", "force [N]"), ("mm", "position [mm]"))):
            ax = axes[row, column]
            mine = [r for r in rows if r["sensor"] == name and not r["method"].startswith("(")]
            for r in mine:
                ax.loglog(r["per_second"], r[f"rms_{key}"], marks[r["method"]], ms=8, label=r["method"])
            guess = {"n": 5 / 12**0.5, "mm": 80 / 12**0.5}[key]
            ax.axhline(guess, color="0.6", ls=":", label="a guess (middle of the range)")
            ax.axhline(mine[0][f"bound_{key}"], color="k", ls="--", lw=1, label="Cramér-Rao bound")
            ax.grid(alpha=0.3, which="major")
            if not column:
                ax.set_ylabel(f"rms error of {unit}")
        axes[0, column].set_title(name.replace(", tones", ",\ntones"), fontsize=10)
        axes[1, column].set_xlabel("estimates per second")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=4, frameon=False)
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    figure.savefig(path, dpi=120)


def main():
    rows, checks = [], {}
    for name, (sensor, tones) in sensors().items():
        rows += measured(name, sensor, tones)
        checks[name] = fixed(sensor, tones)
        print(table(rows, checks))
    machine = {"python": platform.python_version(), "numpy": np.__version__, "machine": platform.machine()}
    data = {"noise": NOISE, "targets": TARGETS, "machine": machine, "rows": rows, "checks": checks}
    (RESULTS / "invert.json").write_text(json.dumps(data, indent=1) + "\n")
    (RESULTS / "invert.md").write_text(table(rows, checks))
    picture(rows, RESULTS / "invert.png")


if __name__ == "__main__":
    main()
