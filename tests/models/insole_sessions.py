"""Simulated insole under a bladder over several days, no code shared with the calibration.

Elements creep (two times of relaxation), have play between loading and unloading, a stiffening law, scatter of gain,
zeros that differ from day to day, gains that wander and drift, noise, and dead ones. Sized so that a static cubic errs
as on the published recordings of an insole of 280 elements, 84 of them bad: some 0.25 bar, 0.13 bar with a tare.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Insole:
    """One insole, and its days."""

    elements: int = 280
    bad: int = 84
    seed: int = 0
    creep: float = 0.12  # share of the strain that comes with 100 s
    play_kpa: float = 6.0
    zero: float = 0.035  # of the rise at 4 bar, from day to day
    wander: float = 0.02  # of the gain, from day to day
    drift: float = -0.004  # of the gain, a day
    rate_hz: float = 2.0
    minutes: float = 6.0

    def sessions(self, days=(0.0, 0.1, 0.2, 1.0, 4.0, 7.0)):
        """(day, time_s, counts (k, n), bladder_kpa (k,)) of each day."""
        print_ = np.random.default_rng(self.seed)
        gain = np.exp(0.12 * print_.normal(size=self.elements)) * 900.0  # counts at 4 bar
        stiffening = 0.5 * np.exp(0.2 * print_.normal(size=self.elements))
        base = 3000 + 200 * print_.normal(size=self.elements)
        dead = print_.permutation(self.elements)[: self.bad]
        for number, day in enumerate(days):
            draw = np.random.default_rng([self.seed, number])
            time_s, kpa = self.course(draw)
            zero = self.zero * 900 * (draw.normal() + 0.5 * draw.normal(size=self.elements))
            own = gain * (1 + self.wander * draw.normal() + self.wander * draw.normal(size=self.elements))
            counts = base + zero + own * np.exp(-self.drift * day) * self.strain(time_s, kpa, stiffening)
            counts[:, dead] = base[dead] + 5 * draw.normal(size=(len(kpa), self.bad)).cumsum(0) / 30
            yield day, time_s, np.round(counts + draw.normal(size=counts.shape)), kpa

    def course(self, draw):
        """20 s without load, then ramps to levels and back, and a standing load of a minute."""
        n = round(60 * self.minutes * self.rate_hz)
        time_s = np.arange(n) / self.rate_hz
        knots, values, t = [0.0, 22.0], [0.0, 0.0], 22.0
        while t < time_s[-1]:
            level = draw.uniform(60, 400)
            low = draw.uniform(0, 60)
            for shortest, longest, value in ((4, 12, level), (3, 60, level), (4, 12, low), (2, 20, low)):
                t += draw.uniform(shortest, longest)
                knots.append(t)
                values.append(value)
        return time_s, np.interp(time_s, knots, values)

    def strain(self, time_s, kpa, stiffening):
        """Strain of each element under the bladder, 1 at 4 bar, by a play, creep and a law that stiffens."""
        play, late, slow = 0.0, 0.0, 0.0
        felt = np.empty(len(kpa))
        for k, p in enumerate(kpa):
            dt = time_s[k] - time_s[k - 1] if k else 0.0
            play = min(max(play, p - self.play_kpa), p + self.play_kpa)
            late += (p - late) * dt / 3.0
            slow += (p - slow) * dt / 100.0
            felt[k] = (1 - 0.05 - self.creep) * 0.5 * (p + play) + 0.05 * late + self.creep * slow
        x = np.maximum(felt, 0.0)[:, None] / 400.0
        return x * (1 + stiffening) / (1 + stiffening * x)
