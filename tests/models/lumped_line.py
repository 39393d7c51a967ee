"""A line sensor and its bench made without sensorgen: a ladder of lumped sections, and the files of the instruments.

Two resistive tracks with a film between them, read at x = 0 and open at x = L (docs/line.md; thesis, section 2.3):
r = rho_1/(H_1 W) + rho_2/(H_2 W) [ohm/m] and c [F/m]. A tip of length l over the whole width presses with p = F/(W l),
and raises c there as the contact reference says. Nothing of sensorgen is imported here: that is the point.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

REFERENCE = Path(__file__).parents[1] / "reference"
TONES_HZ = np.array([1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3])
SECTIONS = 2000
EPOCH_S = 1_760_000_000.0
PITCH_MM = 2.0  # period of the triangles whose cell the reference files have


@dataclass(frozen=True)
class Line:
    """A sensor: outline [m], both tracks [ohm/m], film [F/m], tip [m], and (pressure [kPa], relative rise of c)."""

    ohm_per_m: float
    farad_per_m: float
    rise: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0, 100.0), (0.0, 0.0))
    length_m: float = 0.1
    width_m: float = 0.01
    tip_m: float = 0.01

    @property
    def resistance_ohm(self):
        """Both tracks, end to end [ohm]."""
        return self.ohm_per_m * self.length_m

    @property
    def capacitance_f(self):
        """Unloaded [F]."""
        return self.farad_per_m * self.length_m

    def farad_ratio(self, force_n):
        """Capacitance per length under the tip over the unloaded one."""
        kpa = force_n / (self.width_m * self.tip_m) * 1e-3
        return 1 + float(PchipInterpolator(*self.rise)(kpa))

    def impedance(self, frequency_hz, force_n=0.0, position_m=0.05, sections=SECTIONS):
        """Of the ladder at its contacts (tones,) [ohm]: each section a resistor between two halves of its capacitor."""
        dx = self.length_m / sections
        edges = np.linspace(0, self.length_m, sections + 1)
        under = _overlap(edges, position_m - self.tip_m / 2, position_m + self.tip_m / 2) / dx
        c = self.farad_per_m * (1 + under * (self.farad_ratio(force_n) - 1))
        half = 1j * np.pi * np.asarray(frequency_hz, float)[:, None] * c * dx  # admittance of C/2 [S]
        r = self.ohm_per_m * dx
        y = np.zeros(len(half), complex)
        for k in range(sections - 1, -1, -1):
            y = y + half[:, k]
            y = y / (1 + r * y) + half[:, k]
        return 1 / y


def _overlap(edges, low, high):
    """Length of each section that lies between two places."""
    return np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0, None)


def closed_form(sections, frequency_hz):
    """Impedance of uniform sections (length, ohm/m, F/m) from the contacts to the open end: tanh of each [ohm].

    Z = Z0 (Zl + Z0 tanh gl) / (Z0 + Zl tanh gl) with Z0 = sqrt(r/jwc), g = sqrt(r jwc); of the last Z0 / tanh gl.
    """
    w, load = 2j * np.pi * np.asarray(frequency_hz, float), None
    for length, r, c in reversed(sections):
        z0, t = np.sqrt(r / (w * c)), np.tanh(np.sqrt(r * w * c) * length)
        load = z0 / t if load is None else z0 * (load + z0 * t) / (z0 + load * t)
    return load


def tri(film_mm, top_ohm_m, bottom_ohm_m, cogs=1.0, electrode_mm=0.3, **more):
    """Triangles across a sensor of 100 x 10 mm: c from cells.json, its rise from contact.json.

    ``cogs`` is the top electrode's resistance as a share of that of its plate alone.
    """
    cell = _entry(json.loads((REFERENCE / "cells.json").read_text("utf-8"))["tri"], film_mm)
    pressed = json.loads((REFERENCE / "contact.json").read_text("utf-8"))[f"tri_d{film_mm:g}"]
    width_m = more.get("width_m", 0.01)
    rise = tuple(v / pressed["C0_exact_pF_per_m"] for v in pressed["dC_pF_per_m"])
    return Line(
        (top_ohm_m * cogs + bottom_ohm_m) / (electrode_mm * 1e-3 * width_m),
        cell["C_F_per_m"] * width_m / (PITCH_MM * 1e-3),
        (tuple(pressed["p_kPa"]), rise),
        **more,
    )


def plate(thickness_m, top_ohm_m, bottom_ohm_m, modulus_pa, permittivity=4.68, electrode_mm=0.3, **more):
    """A plain plate of 100 x 10 mm that gives way as a column free sideways: strain p/E (thesis, B.49)."""
    width_m = more.get("width_m", 0.01)
    kpa = np.linspace(0, 100, 201)
    strain = kpa * 1e3 / modulus_pa
    return Line(
        (top_ohm_m + bottom_ohm_m) / (electrode_mm * 1e-3 * width_m),
        8.8541878128e-12 * permittivity * width_m / thickness_m,
        (tuple(kpa), tuple(strain / (1 - strain))),
        **more,
    )


def _entry(entries, film_mm):
    return next(e for e in entries if e["d"] == film_mm)


def presses(count, seed=1, least_n=0.5, most_n=6.0, ends_mm=(10.0, 90.0)):
    """Force [N] and position [mm], at random; positions on the ladder's own grid of 0.05 mm."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.uniform(least_n, most_n, count), rng.uniform(*ends_mm, count).round(1)], -1)


def columns(frequency_hz):
    """Names of the columns of the tones."""
    return [f"{part}_ohm_{f:g}Hz" for f in frequency_hz for part in ("re", "im")]


def noisy(z, share, rng):
    """With a standard deviation of the real and of the imaginary part, as a share of the modulus."""
    return z + share * np.abs(z) * (rng.standard_normal(z.shape) + 1j * rng.standard_normal(z.shape))


def readings_csv(path, line, made, frequency_hz=TONES_HZ, noise=1e-3, seed=2):
    """A row for every press after ten at rest, as invert reads it; the truth stands beside it."""
    made = np.concatenate([np.zeros((10, 2)), made])
    z = np.stack([line.impedance(frequency_hz, f, x * 1e-3) for f, x in made])
    z = noisy(z, noise, np.random.default_rng(seed))
    names = ["rest", "true_force_n", "true_position_mm", *columns(frequency_hz)]
    write(path, names, np.hstack([made[:, :1] == 0, made, _parts(z)]))
    return path


def bench_csv(lcr, rig, line, made, frequency_hz=TONES_HZ, noise=1e-4, seed=3, rate_hz=20.0, dwell_s=3.0, rest_s=3.0):
    """A recording: the analyser's file and the rig's, each press held for a time with rest before and after it."""
    rng = np.random.default_rng(seed)
    start = rest_s + np.arange(len(made)) * (dwell_s + rest_s) + rng.uniform(0, 0.3 * rest_s, len(made))
    time = np.arange(round((start[-1] + dwell_s + rest_s) * rate_hz)) / rate_hz
    which = np.full(len(time), -1)
    for k, at in enumerate(start):
        which[(time >= at) & (time < at + dwell_s)] = k
    rest = line.impedance(frequency_hz)
    pressed = np.stack([line.impedance(frequency_hz, f, x * 1e-3) for f, x in made])
    z = noisy(np.where(which[:, None] < 0, rest, pressed[which]), noise, rng)
    write(lcr, ["time_s", "stamp_s", *columns(frequency_hz)], np.column_stack([time, EPOCH_S + time, _parts(z)]))
    force = np.where(which < 0, 0.0, made[which, 0])
    near = np.abs(time[:, None] - (start + dwell_s / 2)).argmin(1)  # the tip moves while it is up
    told = np.column_stack([EPOCH_S + time, force, made[near, 1], force + 0.01 * rng.standard_normal(len(time))])
    write(rig, ["time_s", "set_force_n", "set_position_mm", "force_n"], told)
    return lcr, rig


def _parts(z):
    return np.stack([z.real, z.imag], -1).reshape(len(z), -1)


def write(path, names, rows):
    """Rows of numbers as CSV."""
    lines = [",".join(f"{v:.3f}" if v > 1e6 else f"{v:.7g}" for v in row) for row in np.asarray(rows).tolist()]
    Path(path).write_text("\n".join([",".join(names), *lines]) + "\n", "utf-8")
