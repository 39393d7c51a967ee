"""Pictures of docs/invert.md: a run with its errors, two presses behind one reading, and what a prior is worth.

Run as ``python bench/invert_pictures.py``; writes docs/pictures/invert-*.png.
"""

import dataclasses
from pathlib import Path

import matplotlib as mpl
import numpy as np

from sensorgen.design.design import make
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.inverse.estimator import Estimator, Prior
from sensorgen.prediction.inverse.verdict import Status
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.sensor_model import build_sensor

mpl.use("Agg")
import matplotlib.pyplot as plt

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
TONES = np.array(TONES_HZ)
NOISE = 1e-3
COLOURS = {
    Status.OK: "tab:blue", Status.AMBIGUOUS: "tab:orange", Status.AT_THE_END: "tab:green", Status.FORCE_ONLY: "tab:red",
    Status.NOT_IDENTIFIABLE: "0.5", Status.NO_FIT: "k",
}  # fmt: skip


def tri(resistivity_ohm_m):
    sensor = build_sensor(drawn(make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}}))).sensor
    return dataclasses.replace(sensor, resistivity_ohm_m=(resistivity_ohm_m,) * 2)


def noisy(z, noise, seed=0):
    rng = np.random.default_rng(seed)
    return z * (1 + noise * (rng.normal(size=z.shape) + 1j * rng.normal(size=z.shape)))


def readings(sensor, tones, force, position, noise, seed=0):
    return noisy(sensor.impedance(tones, np.asarray(force)[:, None], np.asarray(position)[:, None]), noise, seed)


def run(path):
    """A tip at 3 N that slides along the sensor, then presses harder and lets go at 60 mm."""
    n = 160
    force = np.concatenate([np.full(n, 3.0), 3 + 3 * np.sin(np.linspace(0, 1.5 * np.pi, n)), np.zeros(n // 8)])
    position = np.concatenate([np.linspace(0, 0.1, n), np.full(n + n // 8, 0.06)])
    sensor = tri(1 / 1.2)
    found = Estimator(sensor, TONES, NOISE, force_limit_n=8.0).batch(readings(sensor, TONES, force, position, NOISE))
    error = 1.645 * np.sqrt(found.covariance[:, [0, 1], [0, 1]])
    figure, axes = plt.subplots(2, 1, figsize=(9, 5.6), sharex=True)
    place = np.arange(len(force))
    force_part, position_part = (found.force_n, 1, force), (found.position_m * 1e3, 1e3, position * 1e3)
    for k, (ax, (got, scale, true)) in enumerate(zip(axes, (force_part, position_part), strict=True)):
        for status, colour in COLOURS.items():
            counts = status <= (Status.FORCE_ONLY, Status.AT_THE_END)[k]
            rows = np.flatnonzero((found.status == status) & counts)
            ax.errorbar(
                place[rows], got[rows], error[rows, k] * scale, fmt=".", ms=4, lw=0.7, color=colour, alpha=0.8,
                label=status.words if len(rows) else None,
            )  # fmt: skip
        ax.plot(place, true, "k", lw=1.2, label="pressed")
        ax.grid(alpha=0.3)
    axes[0].set(ylabel="force [N]", ylim=(-0.5, 8))
    axes[1].set(ylabel="position [mm]", ylim=(-10, 125), xlabel="sample")
    handles, labels = axes[0].get_legend_handles_labels()
    axes[0].legend(handles, labels, ncol=len(labels), loc="upper right", fontsize="small")
    axes[0].set_title(
        "tri, 0.1 mm film, 0.83 ohm m, seven tones to 99.7 kHz, 0.1 % noise: 90 % intervals\n"
        "(no position is shown where the reading does not say)", fontsize="medium",
    )  # fmt: skip
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def two_presses(path):
    """The sum of squares over all presses, for a reading that two of them explain."""
    sensor, force, position = tri(1 / 1.2), 4.25, 0.0883
    z = sensor.impedance(TONES, force, position)
    f, x = np.meshgrid(np.linspace(3.5, 6.5, 241), np.linspace(0.07, 0.1, 241), indexing="ij")
    square = (abs(np.log(z)[:, None, None] - np.log(sensor.impedance(TONES[:, None, None], f, x))) ** 2).sum(0)
    found = Estimator(sensor, TONES, NOISE).batch(z[None])
    figure, ax = plt.subplots(figsize=(7, 4.6))
    levels = [0, 0.1, 1, 2.3, 4.6, 9.2, 30, 100, 300, 1000, 3000, 1e4]
    norm = mpl.colors.BoundaryNorm(levels, 256)
    filled = ax.contourf(x * 1e3, f, square / NOISE**2, levels, cmap="viridis_r", norm=norm)
    figure.colorbar(filled, label="chi squared at 0.1 % noise", ticks=levels, format="%g")
    ax.contour(x * 1e3, f, square / NOISE**2, [9.21], colors="w", linewidths=1.2)
    ax.plot(found.position_m * 1e3, found.force_n, "o", color="w", mec="k", label="the best press (the true one)")
    ax.plot(found.other_position_m * 1e3, found.other_force_n, "s", color="w", mec="k", label="the other one")
    ax.axvline(95, color="k", ls=":", lw=1)
    ax.text(
        94.9, 3.55, "right of here the tip\noverhangs the end", fontsize="small", va="bottom", ha="right", color="w"
    )
    ax.set(xlabel="position [mm]", ylabel="force [N]", title="One reading, two presses (inside the white line: 99 %)")
    ax.legend(loc="upper left")
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def prior(path):
    """Error over noise: least squares against a uniform prior, the bound, and a guess."""
    sensor = build_sensor(drawn(make({"shape": "reference"}))).sensor
    rng = np.random.default_rng(4)
    n, limit = 1500, 6.0
    force, position = rng.uniform(0, limit, n), rng.uniform(0, 0.1, n)
    noises = np.geomspace(1e-6, 1e-2, 13)
    rows = {"least squares": [], "posterior mean, uniform prior": []}
    for noise in noises:
        z = readings(sensor, TONES, force, position, noise, 5)
        for name, known in zip(rows, (None, Prior()), strict=True):
            found = Estimator(sensor, TONES, noise, known, limit).batch(z)
            off = np.stack([found.force_n - force, (found.position_m - position) * 1e3])
            rows[name].append(np.sqrt(np.mean(off**2, 1)))
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 4))
    for k, (ax, guess, unit) in enumerate(zip(axes, (limit, 100), ("force [N]", "position [mm]"), strict=True)):
        for (name, values), mark in zip(rows.items(), ("o-", "s-"), strict=True):
            ax.loglog(noises * 100, np.array(values)[:, k], mark, ms=4, label=name)
        ax.axhline(guess / 12**0.5, color="0.5", ls=":", label="a guess: the middle of the range")
        ax.axvline(0.1, color="0.8", lw=4, zorder=0, label="0.1 %, the bench")
        ax.set(xlabel="noise [% of |Z|]", ylabel=f"rms error of {unit}")
        ax.grid(alpha=0.3)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter("")
    axes[1].set_yticks([5, 10, 20, 50])
    axes[0].legend(fontsize="small")
    figure.suptitle("The thesis's plate with its own electrodes, 0 to 6 N over the whole sensor")
    figure.tight_layout()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    run(PICTURES / "invert-run.png")
    two_presses(PICTURES / "invert-two-presses.png")
    prior(PICTURES / "invert-prior.png")
