"""Virtual specimens: printed strips with every error that a real one may have, written apart from the package.

The strip is a product of ABCD matrices of short pieces, its capacitance and how that rises under pressure are those of
independent solvers (tests/reference), and the elastomer has creep and hysteresis.
"""

import json
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

REFERENCE = Path(__file__).parents[1] / "reference"
TONES_HZ = np.array([1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3])
LENGTH_M, WIDTH_M, PERIOD_M = 0.1, 0.01, 2e-3
PIECES = 120
AGE_S = 5.0  # of the rest reading before a press


@cache
def _curve(film_mm, boundary):
    """Pressure [Pa] and relative rise of C; with other boundary conditions from the runs that varied them."""
    found = json.loads((REFERENCE / "contact.json").read_text())
    usual = found[f"tri_d{film_mm:g}"]
    c = found["variants_L1_k60_error_about_1pc"][f"{boundary}_d{film_mm:g}"]["C"] if boundary else usual["C_pF_per_m"]
    return np.array(usual["p_kPa"]) * 1e3, np.array(c) / c[0] - 1


@cache
def _capacitance_f_per_m(film_mm):
    cells = json.loads((REFERENCE / "cells.json").read_text())["tri"]
    per_period = next(cell["C_F_per_m"] for cell in cells if cell["d"] == film_mm)
    return per_period * WIDTH_M / PERIOD_M


@dataclass(frozen=True)
class Truth:
    """What a specimen and its bench are; all errors 0 by default."""

    track_ohm_per_m: float = 1 / 1.2 / WIDTH_M * (1 / 3e-4 + 1 / 3.547e-4)  # plain and with cogs
    profile: tuple[float, ...] = ()  # of ln resistivity: amplitudes of half waves along the strip
    capacitance: float = 0.0  # ln of the factor
    law: tuple[float, ...] = ()  # of ln rise: amplitudes of half waves over ln force
    stiffness: float = 0.0  # ln of the factor
    leak: float = 0.0  # conductance over that of the capacitance at the lowest tone
    dispersion: float = 0.0  # exponent
    hysteresis: float = 0.0  # of the rise, after a peak that was much higher
    creep: float = 0.0  # of the rise, per decade of time
    gain: tuple[complex, ...] = ()  # ln, per tone
    lead_ohm: float = 0.0
    stray_f: float = 0.0
    force_offset_n: float = 0.0
    place_offset_m: float = 0.0
    wander: float = 0.0  # of ln C and ln R, standard deviation over the session
    wander_s: float = 300.0
    clock_s: float = 0.0  # by which the rig's clock is off
    noise: float = 1e-3
    noise_by_tone: tuple[float, ...] = (1.0,) * 7
    tip_m: float = 5e-3
    film_mm: float = 0.2
    boundary: str = ""  # of the solver's runs, as "free" or "stick"
    rest_averages: int = 10

    def impedance(self, force_n, place_m, peak_n=None, hold_s=None, ln_c=0.0, ln_r=0.0, frequency_hz=TONES_HZ):
        """What a bench would read without noise (n, m); the force is that on the sensor, set plus offset."""
        force, place = np.atleast_1d(force_n).astype(float), np.atleast_1d(place_m).astype(float)
        ln_c, ln_r = np.broadcast_to(ln_c, force.shape), np.broadcast_to(ln_r, force.shape)
        omega = 2 * np.pi * np.asarray(frequency_hz)
        c = _capacitance_f_per_m(self.film_mm) * np.exp(self.capacitance + ln_c)
        left, right = np.maximum(place - self.tip_m / 2, 0), np.minimum(place + self.tip_m / 2, LENGTH_M)
        rise = self.rise(force / (WIDTH_M * (right - left)), force, peak_n, hold_s)
        edges = np.linspace(0, LENGTH_M, PIECES + 1)
        a, b = np.ones((len(force), len(omega)), complex), np.zeros((len(force), len(omega)), complex)
        cc, d = b.copy(), a.copy()
        for start, end in pairwise(edges):
            under = np.clip(np.minimum(end, right) - np.maximum(start, left), 0, None) / (end - start)
            at = (start + end) / 2 / LENGTH_M
            bend = sum(k * np.cos((n + 1) * np.pi * at) for n, k in enumerate(self.profile))
            r = self.track_ohm_per_m * np.exp(bend + ln_r)[:, None] * (end - start)
            loose = c[:, None] * (omega / omega[0]) ** -self.dispersion * (1 + under * rise)[:, None] * (end - start)
            y = 1j * omega * loose * np.exp(-1j * np.pi / 2 * self.dispersion)
            y = y + self.leak * omega[0] * c[:, None] * (end - start)
            s = np.sqrt(r * y)
            ch, z0 = np.cosh(s), np.sqrt(r / y)
            m = ch, z0 * np.sinh(s), np.sinh(s) / z0, ch
            a, b, cc, d = a * m[0] + b * m[2], a * m[1] + b * m[3], cc * m[0] + d * m[2], cc * m[1] + d * m[3]
        inside = 1 / (cc / a + 1j * omega * self.stray_f)
        return (self.lead_ohm + inside) * np.exp(np.array(self.gain) if self.gain else 0.0)

    def rise(self, pressure_pa, force_n, peak_n, hold_s):
        """By how much the capacitance under the tip is above its own at rest."""
        knots, values = _curve(self.film_mm, self.boundary)
        p = pressure_pa * np.exp(-self.stiffness)
        slope = (values[-1] - values[-3]) / (knots[-1] - knots[-3])
        found = np.interp(p, knots, values) + np.maximum(p - knots[-1], 0) * slope
        at = np.clip(np.log(np.maximum(force_n, 1e-3) / 0.2) / np.log(13 / 0.2), 0, 1)
        found = found * np.exp(sum(k * np.cos(n * np.pi * at) for n, k in enumerate(self.law)))
        if peak_n is not None:
            found = found * (1 + self.hysteresis * (1 - force_n / np.maximum(np.maximum(peak_n, force_n), 1e-9)))
        if hold_s is not None:
            found = found * (1 + self.creep * np.log10(np.maximum(hold_s, 0.1)))
        return found


@dataclass(frozen=True)
class Session:
    """Presses of a specimen: what was set, what was read."""

    force_n: np.ndarray
    position_m: np.ndarray
    peak_n: np.ndarray
    hold_s: np.ndarray
    rest_ohm: np.ndarray
    pressed_ohm: np.ndarray

    def rows(self, which):
        return Session(*(value[which] for value in vars(self).values()))


def session(truth, count, seed, force_n=(0.1, 6.0)):
    """Presses at random places and forces, half of them during unloading, held for 0.3 to 30 s.

    Force and position are those that the rig says; the sensor feels them with their offsets.
    """
    rng = np.random.default_rng(seed)

    def spread():
        return (rng.permutation(count) + rng.random(count)) / count

    force = force_n[0] + (force_n[1] - force_n[0]) * spread()
    place = truth.tip_m / 2 + (LENGTH_M - truth.tip_m) * spread()
    back = rng.permutation(count) < count // 2
    peak = np.where(back, force + (force_n[1] * 1.1 - force) * rng.random(count), force)
    return measured(truth, force, place, peak, 0.3 * 100 ** spread(), rng)


def measured(truth, force, place, peak, hold, rng):
    """What a bench reads of given presses, and of the rest before each."""
    count = len(force)
    time = np.cumsum(hold + 20.0)
    drift = np.stack([_walk(np.concatenate([time - hold - AGE_S, time]), truth, rng) for _ in range(2)])
    before, under = drift[:, :count], drift[:, count:]
    rest = truth.impedance(np.zeros(count), np.full(count, LENGTH_M / 2), ln_c=before[0], ln_r=before[1])
    pressed = truth.impedance(
        np.maximum(force + truth.force_offset_n, 0), np.clip(place + truth.place_offset_m, 0, LENGTH_M),
        peak + truth.force_offset_n, hold + truth.clock_s, under[0], under[1],
    )  # fmt: skip
    sigma = truth.noise * np.array(truth.noise_by_tone)

    def noisy(z, averages):
        white = rng.standard_normal((2, *z.shape))
        return z + np.abs(z) * sigma / np.sqrt(averages) * (white[0] + 1j * white[1])

    return Session(force, place, peak, hold, noisy(rest, truth.rest_averages), noisy(pressed, 1))


def _walk(time_s, truth, rng):
    """A wander that forgets: normal at all times, correlated over its time."""
    if not truth.wander:
        return np.zeros(len(time_s))
    order = np.argsort(time_s)
    gap = np.diff(time_s[order], prepend=time_s[order][0])
    keep, value, found = np.exp(-gap / truth.wander_s), rng.standard_normal(), np.empty(len(time_s))
    for k, at in enumerate(order):
        value = keep[k] * value + np.sqrt(1 - keep[k] ** 2) * rng.standard_normal()
        found[at] = value * truth.wander
    return found


def drawn(seed, scale=1.0, **fixed):
    """A random specimen with all errors at once; ``scale`` doubles them."""
    rng = np.random.default_rng(seed)

    def normal(sd, *shape):
        return scale * sd * rng.standard_normal(shape)

    def even(low, high):
        return low + (high - low) * rng.random() * scale

    m = len(TONES_HZ)
    base = Truth()
    made = Truth(
        track_ohm_per_m=base.track_ohm_per_m * float(np.exp(normal(0.2))),
        profile=tuple(normal(0.1, 3) / np.arange(1, 4)), capacitance=float(normal(0.15)),
        law=tuple(normal(0.1, 3) / np.arange(1, 4)), leak=abs(float(normal(5e-3))), dispersion=even(0.0, 0.02),
        hysteresis=even(0.03, 0.07) if scale == 1 else even(0.06, 0.10), creep=even(0.01, 0.03),
        gain=tuple(normal(5e-3, m) + 1j * np.deg2rad(normal(0.2, m))), lead_ohm=even(0, 60), stray_f=even(0, 1e-12),
        force_offset_n=float(normal(0.05)), place_offset_m=float(normal(0.5e-3)), wander=scale * 3e-3,
        clock_s=float(normal(0.05)),
    )  # fmt: skip
    return replace(made, **fixed)


def recorded(truth, folder, count=30, seed=1, force_n=(0.3, 6.0), rate_hz=20.0, name="run"):
    """A run of random presses as the bench would write it: ``NAME-lcr.csv`` and ``NAME-rig.csv``; returns them."""
    rng = np.random.default_rng(seed)
    shares = (np.stack([rng.permutation(count) for _ in range(3)]) + rng.random((3, count))) / count
    force = force_n[0] + (force_n[1] - force_n[0]) * shares[0]
    place = truth.tip_m / 2 + (LENGTH_M - truth.tip_m) * shares[1]
    back = rng.permutation(count) < count // 2
    peak = np.where(back, force + (1.1 * force_n[1] - force) * rng.random(count), force)
    hold = 1.6 * 5 ** shares[2]
    times, sets, places, peaks, holds = [], [], [], [], []
    now = 0.0
    for f, x, p, h in zip(force, place, peak, hold, strict=True):
        for span, start, end, high, held in (
            (5.0, 0.0, 0.0, 0.0, False), (0.3, 0.0, p, None, False), (0.3, p, f, p, False), (h, f, f, p, True),
            (0.3, f, 0.0, p, False),
        ):  # fmt: skip
            n = max(round(span * rate_hz), 1)
            t = np.arange(n) / rate_hz
            values = start + (end - start) * t / span
            times.append(now + t)
            sets.append(values)
            places.append(np.full(n, x))
            peaks.append(values if high is None else np.full(n, high))
            holds.append(t + 0.1 if held else np.full(n, 0.1))
            now += n / rate_hz
    time, force, place, peak, hold = (np.concatenate(v) for v in (times, sets, places, peaks, holds))
    steps = _walk(time, truth, rng), _walk(time, truth, rng)
    felt = np.where(force > 0, np.maximum(force + truth.force_offset_n, 0), 0)
    z = truth.impedance(
        felt, np.clip(place + truth.place_offset_m, 0, LENGTH_M), np.maximum(peak, felt), hold, steps[0], steps[1]
    )
    sigma = truth.noise * np.array(truth.noise_by_tone)
    white = rng.standard_normal((2, *z.shape))
    z = z + np.abs(z) * sigma * (white[0] + 1j * white[1])
    lcr, rig = folder / f"{name}-lcr.csv", folder / f"{name}-rig.csv"
    write_csv(lcr, time, z, TONES_HZ)
    head = "time_s,set_force_n,set_position_mm,force_n"
    np.savetxt(
        rig, np.column_stack([time + truth.clock_s, force, place * 1e3, force]), "%.9g", ",", header=head, comments=""
    )
    return lcr, rig


def write_csv(path, time_s, impedance_ohm, frequency_hz, **more):
    """Readings as a table: time, two columns per tone, and more columns."""
    names = [f"{part}_ohm_{f / 1e3:g}kHz" for f in frequency_hz for part in ("re", "im")]
    both = np.stack([impedance_ohm.real, impedance_ohm.imag], -1).reshape(len(time_s), -1)
    table = np.column_stack([time_s, both, *more.values()])
    np.savetxt(path, table, "%.9g", ",", header=",".join(["time_s", *names, *more]), comments="")
