"""Sensors that change after their calibration: a ladder of RC sections that shares no line with the package.

The strip is a chain of lumped T sections, each two half resistances and a shunt; its capacitance and the rise of that
are contact solutions of another program (tests/reference/contact.json) or, of a blunt print, a gap that closes in
proportion. On top come what a bench has: offsets, gain, lead, stray, leak, dispersion, hysteresis, creep, temperature.
"""

import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

TONES_HZ = np.array([1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3])
LENGTH_M, WIDTH_M, SECTIONS = 0.1, 0.01, 200
AVERAGES = 10  # readings at rest before each press
DRAWN_F = 64.26e-12
GAPS_MM = 0.18, 0.42  # between the electrodes of the print, drawn 0.2
LAWS = ("", "stick", "free", "rigid", "tip")  # of the cell as drawn; the last a law of its own
BLUNT_PER_PA = 7e-7  # rise of a blunt print with a gap of 0.3 mm


@cache
def _knots(law):
    """Pressure [Pa] and relative rise."""
    found = json.loads((Path(__file__).parent / "reference" / "contact.json").read_text())
    usual = found["tri_d0.2"]
    known = law in LAWS[1:4]
    c = np.array(found["variants_L1_k60_error_about_1pc"][f"{law}_d0.2"]["C"] if known else usual["C_pF_per_m"])
    rise = c / c[0] - 1
    return np.array(usual["p_kPa"]) * 1e3, rise * np.linspace(1.15, 0.9, len(rise)) if law == "tip" else rise


@dataclass(frozen=True)
class Strip:
    """A specimen on its bench; the defaults are a sound one without errors."""

    resistance_ohm: float = 8640.0
    capacitance_f: float = DRAWN_F
    profile: tuple = ()
    law: str = ""
    gap_mm: float = 0.0  # of a blunt print; 0 for the cell as drawn
    softer: float = 1.0
    bend: float = 0.0  # of ln rise, per e-fold of the force
    leak: float = 0.0
    exponent: float = 0.0
    hysteresis: float = 0.0
    creep: float = 0.0
    gain: tuple = ()
    lead_ohm: float = 0.0
    stray_f: float = 0.0
    force_offset_n: float = 0.0
    place_offset_m: float = 0.0
    tip_m: float = 5e-3
    kelvin: float = 0.0
    c_per_k: float = 3e-3
    r_per_k: float = -4e-3
    drift_k: float = 0.05  # from a reading at rest to its press
    noise: float = 1e-3
    lifted_from_m: float = np.inf  # beyond, the film is an air gap besides
    broken_at_m: float = np.inf
    broken_ohm: float = 1e7
    hole_ohm: float = np.inf  # between the electrodes, in the middle
    hand_f: float = 0.0  # beside the sensor while it is pressed
    second: tuple = ()  # force [N] and position [m] of another press
    resting_n: float = 0.0  # on the tip when the reading at rest is taken

    def rise(self, pressure_pa, force_n):
        """Relative rise of the capacitance under the tip."""
        p = pressure_pa * self.softer
        if self.gap_mm:
            share = BLUNT_PER_PA * p * (0.3 / self.gap_mm) ** 1.5
            found = share * (1 + share)
        else:
            knots, values = _knots(self.law)
            slope = (values[-1] - values[-3]) / (knots[-1] - knots[-3])
            found = np.interp(p, knots, values) + np.maximum(p - knots[-1], 0) * slope
        return found * np.maximum(force_n, 0.05) ** self.bend

    def impedance(self, presses, kelvin=0.0, hand=False, frequency_hz=TONES_HZ):
        """Readings without noise (n, m) under any number of presses: (force, position, factor on the rise) each (n,).

        The factor is what hysteresis and creep make of the rise.
        """
        kelvin = np.asarray(kelvin, float) + self.kelvin
        n, dx = len(presses[0][0]) if presses else len(np.atleast_1d(kelvin)), LENGTH_M / SECTIONS
        start = np.arange(SECTIONS) * dx
        omega = 2 * np.pi * np.asarray(frequency_hz)
        lifted = np.ones((n, SECTIONS))
        for force, place, factor in presses:
            low, high = np.maximum(place - self.tip_m / 2, 0), np.minimum(place + self.tip_m / 2, LENGTH_M)
            under = np.clip(np.minimum(start + dx, high[:, None]) - np.maximum(start, low[:, None]), 0, None) / dx
            lifted += under * (self.rise(force / (WIDTH_M * (high - low)), force) * factor)[:, None]
        lifted = np.where(start >= self.lifted_from_m, 0.3, lifted)
        c = self.capacitance_f / SECTIONS * np.exp(self.c_per_k * kelvin)[..., None] * lifted
        at = (start + dx / 2) / LENGTH_M
        bend = sum(k * np.cos((j + 1) * np.pi * at) for j, k in enumerate(self.profile))
        r = self.resistance_ohm / SECTIONS * np.exp(np.atleast_1d(self.r_per_k * kelvin)[:, None] + bend)
        r = np.where((start <= self.broken_at_m) & (self.broken_at_m < start + dx), r + self.broken_ohm, r)
        fade = (omega / omega[0]) ** -self.exponent * np.exp(-0.5j * np.pi * self.exponent)
        y = np.zeros((n, len(omega)), complex)  # looking away from the contacts
        for k in reversed(range(SECTIONS)):
            half = r[:, k, None] / 2
            y = y / (1 + half * y) + 1j * omega * c[:, k, None] * fade + self.leak * omega[0] * c[:, k, None]
            if k == SECTIONS // 2:
                y = y + 1 / self.hole_ohm
            y = y / (1 + half * y)
        y = y + 1j * omega * (self.stray_f + self.hand_f * hand)
        return (self.lead_ohm + 1 / y) * np.exp(np.array(self.gain) if self.gain else 0.0)


@dataclass(frozen=True)
class Run:
    """Presses of known force and position, in order, and what was read."""

    force_n: np.ndarray
    position_m: np.ndarray
    peak_n: np.ndarray
    hold_s: np.ndarray
    rest_ohm: np.ndarray
    pressed_ohm: np.ndarray


def run(strip, count, seed, places_m=None, top_n=6.0):
    """Random presses, half of them after a higher one, each after ten readings at rest."""
    rng = np.random.default_rng(seed)
    force = 0.1 + (top_n - 0.1) * (rng.permutation(count) + rng.random(count)) / count
    low, high = places_m or (2.5e-3, LENGTH_M - 2.5e-3)
    place = low + (high - low) * (rng.permutation(count) + rng.random(count)) / count
    peak = np.where(rng.permutation(count) < count // 2, force + (1.1 * top_n - force) * rng.random(count), force)
    hold = 0.3 * 100 ** rng.random(count)
    day = np.cumsum(rng.normal(0, 0.02, count))
    felt = np.maximum(force + strip.force_offset_n, 0)
    memory = (1 + strip.hysteresis * (1 - force / peak)) * (1 + strip.creep * np.log10(hold))
    where = np.clip(place + strip.place_offset_m, 0, LENGTH_M)
    presses = [(felt, where, memory)]
    if strip.second:
        presses.append((np.full(count, strip.second[0]), np.full(count, strip.second[1]), np.ones(count)))
    resting = [(np.full(count, strip.resting_n), where, np.ones(count))] if strip.resting_n else []
    rest = strip.impedance(resting, day)
    pressed = strip.impedance(presses, day + rng.normal(0, strip.drift_k, count), hand=True)

    def noisy(z, averages):
        white = rng.standard_normal((2, *z.shape))
        return z * 1 + np.abs(z) * strip.noise / np.sqrt(averages) * (white[0] + 1j * white[1])

    return Run(force, place, peak, hold, noisy(rest, AVERAGES), noisy(pressed, 1))


def drawn_at_random(seed, printed=False, **fixed):
    """A specimen of the family; of a print, with a gap of its range or, one in three, as drawn."""
    rng = np.random.default_rng(seed)
    normal, even = rng.normal, rng.uniform
    gap = float(even(*GAPS_MM)) if printed and seed % 3 else 0.0
    m = len(TONES_HZ)
    made = Strip(
        resistance_ohm=8640 * float(np.exp(normal(0, 0.3))),
        capacitance_f=DRAWN_F * (0.3 / gap if gap else 1.0) ** 0.5 * float(np.exp(normal(0, 0.1))),
        profile=tuple(normal(0, 0.1, 3) / np.arange(1, 4)), law=LAWS[seed % len(LAWS)], gap_mm=gap,
        softer=float(np.exp(normal(0, 0.15))), bend=float(normal(0, 0.04)), leak=abs(float(normal(0, 5e-3))),
        exponent=float(even(0, 0.02)), hysteresis=float(even(0.03, 0.08)), creep=float(even(0.01, 0.03)),
        gain=tuple(normal(0, 3e-3) + normal(0, 3e-3, m) + 1j * np.deg2rad(normal(0, 0.2, m))),
        lead_ohm=float(even(0, 60)), stray_f=float(even(0, 1e-12)), force_offset_n=float(normal(0, 0.05)),
        place_offset_m=float(normal(0, 5e-4)), tip_m=float(even(4.6e-3, 5.5e-3)),
    )  # fmt: skip
    return replace(made, **fixed)


def next_day(strip, seed):
    """The sound sensor at another temperature, its leads connected anew."""
    rng = np.random.default_rng(seed + 10_000)
    lead, stray = abs(strip.lead_ohm + rng.normal(0, 5)), abs(strip.stray_f + rng.normal(0, 1e-13))
    return replace(strip, kelvin=float(rng.normal(0, 1.5)), lead_ohm=lead, stray_f=stray)


CHANGES = {  # after the calibration, of a strip by its seed; and where it is pressed
    "sound": (lambda s, _: s, None),
    "second press of 2 N at 20 mm": (lambda s, _: replace(s, second=(2.0, 0.02)), None),
    "rest read under 1 N": (lambda s, _: replace(s, resting_n=1.0), None),
    "trace broken at 50 mm": (lambda s, _: replace(s, broken_at_m=0.05), None),
    "hand: +0.5 pF while pressed": (lambda s, _: replace(s, hand_f=5e-13), None),
    "1.4 x softer (aged)": (lambda s, _: replace(s, softer=1.4 * s.softer), None),
    "finger of 15 mm, told 5": (lambda s, _: replace(s, tip_m=0.015), None),
    "edge lifted beyond 70 mm": (lambda s, _: replace(s, lifted_from_m=0.07), None),
    "another specimen": (lambda s, seed: drawn_at_random(seed + 500, bool(s.gap_mm)), None),
    "press at 96 to 99.5 mm": (lambda s, _: s, (0.096, 0.0995)),
}
