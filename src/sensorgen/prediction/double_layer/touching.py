"""Effect of a body that touches the sensor on its reading, with an isolation between them and without."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.models.stack import GroundTie, Press, Stack, Touch

THICKEST_MM = 10.0  # isolation that is tried: the most that a design may have
_THINNEST_MM = 1e-4
ISOLATIONS_MM = (0.0, 0.1, 0.2, 0.5, 1.0)  # 0.1 is what the thesis proposes (7.2.7)

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Wiring(NamedTuple):
    """Connection of the instrument to the two electrodes of the uppermost film."""

    words: str
    top_at_ground: bool
    bridge: bool


WIRINGS = (
    Wiring("top driven", top_at_ground=False, bridge=False),
    Wiring("top at ground", top_at_ground=True, bridge=False),
    Wiring("bridge, either way round", top_at_ground=True, bridge=True),  # by reciprocity
)


@dataclass(frozen=True)
class TouchEffect:
    """Behind an isolation [mm]: largest relative shift of the reading [-], and the force it is mistaken for [N]."""

    isolation_mm: float
    largest_shift: float
    mistaken_for_n: float


@dataclass(frozen=True)
class TouchResult:
    """Effect of a touch by one wiring, and the isolation that is needed [mm]; None where 10 mm are not enough."""

    wiring: str
    by_isolation: tuple[TouchEffect, ...]
    needed_mm: float | None


@dataclass(frozen=True)
class Touching:
    """A body that lies on the sensor without pressing, and the reading with it.

    Attributes
    ----------
    stack : Stack
        As drawn; the reading is that of its uppermost film.
    eps_r : float
        Relative permittivity of the isolation [-].
    frequency_hz : array
        Frequencies [Hz].
    press : Press
        The press that a touch is mistaken for, at the same place.
    noise : float
        Relative noise, by which frequencies are weighted [-].
    body : GroundTie
        Its coupling to ground.
    """

    stack: Stack
    eps_r: float
    frequency_hz: Real
    press: Press
    noise: float
    body: GroundTie

    @cached_property
    def _pressed_ohm(self) -> Complex:
        return self.stack.impedance(self.frequency_hz, self.press)[..., -1, -1]

    @cached_property
    def _slope_ohm_per_n(self) -> Complex:
        return self.stack.response(self.frequency_hz, self.press).by_force_ohm_per_n[..., -1, -1]

    def unloaded_ohm(self) -> Complex:
        """The reading without touch or press, per frequency [ohm]."""
        return self.stack.impedance(self.frequency_hz)[..., -1, -1]

    def press_shift(self) -> float:
        """Largest relative change of the reading by the press alone, over all frequencies [-]."""
        unloaded = self.unloaded_ohm()
        return float(np.max(np.abs(self._pressed_ohm - unloaded) / np.abs(unloaded)))

    def shift_ohm(self, isolation_mm: float, wiring: Wiring) -> Complex:
        """Change of the pressed sensor's reading by a touch without force, per frequency [ohm]."""
        n, isolation_f_per_m = len(self.stack.films), np.inf
        if isolation_mm:
            isolation_f_per_m = EPS0_F_PER_M * self.eps_r * self.stack.width_m / (isolation_mm * M_PER_MM)
        touch = Touch(self.press.left_m, self.press.length_m, isolation_f_per_m, self.press.force_n)
        driven, low = (n - 1, n) if wiring.top_at_ground else (n, n - 1)
        touched = self.stack.touched(self.frequency_hz, touch, self.body, driven, low, wiring.bridge)
        return touched - self._pressed_ohm

    def force_n(self, isolation_mm: float, wiring: Wiring) -> float:
        """The force that a touch is mistaken for, its place being known: least squares over all frequencies [N]."""
        slope, modulus = self._slope_ohm_per_n, np.abs(self._pressed_ohm)
        weighted, shift = slope / modulus, self.shift_ohm(isolation_mm, wiring) / modulus
        return float(np.vdot(weighted, shift).real / np.vdot(weighted, weighted).real)

    def thickness_mm(self, within_n: float, wiring: Wiring) -> float | None:
        """Isolation from which on the mistaken force stays within a limit; None where 10 mm are not enough [mm].

        Searched from thick to thin: the error changes its sign on the way, and is small there by accident only.
        """

        def wrong(isolation_mm: float) -> bool:
            return abs(self.force_n(isolation_mm, wiring)) > within_n

        tried = [0.0, *np.geomspace(_THINNEST_MM, THICKEST_MM, 21).tolist()]
        last = max((k for k, t in enumerate(tried) if wrong(t)), default=None)
        if last is None:
            return 0.0
        if last == len(tried) - 1:
            return None
        low, high = tried[last : last + 2]
        while high - low > 2e-3 * high:
            middle = (low + high) / 2
            low, high = (middle, high) if wrong(middle) else (low, middle)
        return float(high)

    def result(self, wiring: Wiring, within_n: float, own_mm: float) -> TouchResult:
        """Effect of a touch behind isolations of several thicknesses, the design's own among them."""
        modulus = np.abs(self.unloaded_ohm())
        effects = tuple(
            TouchEffect(t, float(np.max(np.abs(self.shift_ohm(t, wiring)) / modulus)), self.force_n(t, wiring))
            for t in sorted({*ISOLATIONS_MM, own_mm})
        )
        return TouchResult(wiring.words, effects, self.thickness_mm(within_n, wiring))
