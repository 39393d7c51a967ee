"""The sensor as its terminals see it: two tracks, a film, a tip that presses, and what gives way. SI units.

A press is a tip across the whole width, centred at a position along the sensor. Where it overhangs an end, the force
rests on the part of the tip that lies on the sensor, spread there as the profile of its pressure says.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line, line_tip
from sensorgen.models.compression import Compression
from sensorgen.models.pressure import Contact

UNIFORM = "uniform"
PIECES = 16  # what the press changes of Z is then right to 1e-3

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Patch(NamedTuple):
    """Where the tip rests on the sensor; arrays of the positions' shape, or numbers where they are all the same."""

    left_m: Real
    length_m: Real
    left_slope: Real
    """Derivative of ``left_m`` by the position [-]."""
    length_slope: Real
    """Derivative of ``length_m`` by the position [-]."""


class Response(NamedTuple):
    """Impedance and how it moves with a press, in the shape that frequency, force and position broadcast to."""

    impedance_ohm: Complex
    by_force_ohm_per_n: Complex
    by_position_ohm_per_m: Complex


@dataclass(frozen=True)
class Sensor:
    """A line sensor with contacts at x = 0.

    Attributes
    ----------
    length_m, width_m : float
        Outline [m].
    electrode_m : (float, float)
        Thickness of the top and the bottom electrode [m].
    resistivity_ohm_m : (float, float)
        Of the top and the bottom electrode [ohm m].
    capacitance_f_per_m : float
        Unloaded, per length [F/m].
    compression : Compression
        How the film gives way.
    tip_m : float
        Length of the tip along the sensor [m].
    profile : str
        How its pressure is spread: one of :data:`sensorgen.models.pressure.PROFILES`.
    contact : Contact or None
        How the contact of a round tip grows with the force, up to ``tip_m``; None where all of the tip always touches.
    pieces : int
        That a tip whose pressure is not uniform is cut into.
    tan_delta : float
        Loss tangent of the film [-].
    leak_s_per_m : float
        Leak through the film per length, the same under the tip [S/m].
    piezoresistance_per_pa : (float, float)
        Relative rise of the top and the bottom resistivity per pressure under the tip, of either sign [1/Pa].
    far_end : str or float
        "open", "short", or a resistor [ohm].
    """

    length_m: float
    width_m: float
    electrode_m: tuple[float, float]
    resistivity_ohm_m: tuple[float, float]
    capacitance_f_per_m: float
    compression: Compression
    tip_m: float = 0.01
    profile: str = UNIFORM
    contact: Contact | None = None
    pieces: int = PIECES
    tan_delta: float = 0.0
    leak_s_per_m: float = 0.0
    piezoresistance_per_pa: tuple[float, float] = (0.0, 0.0)
    far_end: str | float = "open"

    def __post_init__(self) -> None:
        """Refuse what is no sensor, before arithmetic does."""
        above = {"length_m": self.length_m, "width_m": self.width_m, "electrode_m": min(self.electrode_m)}
        above |= {"capacitance_f_per_m": self.capacitance_f_per_m}
        for name, value in above.items():
            if not 0 < value < np.inf:
                raise OutOfRange(f"{name} is {value:g}; expected a number above 0")
        if not min(self.resistivity_ohm_m) >= 0:
            raise OutOfRange(f"resistivity_ohm_m is {self.resistivity_ohm_m}; expected numbers from 0 on")

    def resistance_ohm(self) -> float:
        """Both electrodes together, end to end [ohm]."""
        return self.track_ohm_per_m()[0] * self.length_m

    def capacitance_f(self) -> float:
        """Unloaded, between the electrodes [F]."""
        return self.capacitance_f_per_m * self.length_m

    def corner_frequency_hz(self) -> float:
        """Frequency above which the current no longer reaches the far end [Hz]."""
        return line.corner_frequency_hz(self.resistance_ohm(), self.capacitance_f())

    def patch(self, position_m: ArrayLike) -> Patch:
        """The part of the sensor under a tip centred at ``position_m`` [m].

        Raises
        ------
        OutOfRange
            A position outside the sensor, or a tip that is longer than the sensor.
        """
        at = np.asarray(position_m, float)
        bad = ~((at >= 0) & (at <= self.length_m))
        if bad.any():
            where = float(at[bad].flat[0]) * 1e3
            raise OutOfRange(f"position {where:g} mm is outside the sensor; expected 0 to {self.length_m * 1e3:g} mm")
        if not 0 < self.tip_m <= self.length_m:
            raise OutOfRange(
                f"a tip of {self.tip_m * 1e3:g} mm; expected up to the sensor's {self.length_m * 1e3:g} mm"
            )
        whole, low, high = self.whole(at), at - self.tip_m / 2, at + self.tip_m / 2
        if whole.all():  # one length for all keeps the axes of a grid apart
            return Patch(low, np.asarray(self.tip_m), np.ones(()), np.zeros(()))
        left, right = np.maximum(low, 0.0), np.minimum(high, self.length_m)
        moves_left, moves_right = (low >= 0).astype(float), (high <= self.length_m).astype(float)
        return Patch(left, np.where(whole, self.tip_m, right - left), moves_left, moves_right - moves_left)

    def whole(self, position_m: ArrayLike) -> NDArray[np.bool_]:
        """Whether a tip centred at ``position_m`` [m] lies on the sensor whole, flush with an end or not."""
        at = np.asarray(position_m, float)
        return np.asarray((at - self.tip_m / 2 >= 0) & (at + self.tip_m / 2 <= self.length_m))

    def stress_pa(self, force_n: ArrayLike, position_m: ArrayLike) -> Real:
        """Highest pressure under the tip [Pa], which a uniform one has everywhere; in the broadcast shape."""
        force = np.asarray(force_n, float)
        if self.profile == UNIFORM:
            return force / (self.width_m * self.patch(position_m).length_m)
        return self._tip(force, position_m).highest_pa()

    def check_tracks(self, stress_pa: Real) -> None:
        """Refuse pressures that the electrodes' piezoresistance does not reach to.

        Raises
        ------
        OutOfRange
            The resistivity under the tip would be negative.
        """
        for rise in self.piezoresistance_per_pa:
            at = np.asarray(rise * stress_pa)
            if rise and at.min(initial=0.0) < -1:
                raise OutOfRange(
                    f"the resistivity under the tip would be negative ({rise:g} 1/Pa at {at.min() / rise * 1e-3:.3g} "
                    "kPa): press less, or set a piezoresistance nearer to 0"
                )

    def line_inputs(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> dict[str, Any]:
        """Inputs of :func:`sensorgen.models.line.impedance` for presses of a uniform tip on this sensor.

        The film is the plate of relative permittivity 1 that has the same capacitance, and its modulus the secant one.

        Parameters
        ----------
        frequency_hz, force_n, position_m : float or array
            Tones [Hz], forces [N], centres of the tip [m]; they broadcast.

        Raises
        ------
        OutOfRange
            As :meth:`patch`, :meth:`check_tracks` and the law of compression; a tip whose pressure is not uniform.

        Notes
        -----
        The line's S_n, per force (thesis, Eq. B.50), is the piezoresistance over the area that the tip rests on.
        """
        if self.profile != UNIFORM:
            raise OutOfRange(
                f"a tip with a pressure like a {self.profile!r} makes no single patch; expected a uniform one"
            )
        patch, stress = self.patch(position_m), self.stress_pa(force_n, position_m)
        thinning, slope = self.compression.capacitive_strain(stress)
        self.check_tracks(stress)
        with np.errstate(divide="ignore", invalid="ignore"):
            secant = np.where(thinning == 0, 1 / slope, stress / thinning)
        return self._tracks(self.width_m * patch.length_m) | {
            "f_Hz": frequency_hz, "F_N": force_n, "E_Pa": secant,
            "x_p_left_edge_m": patch.left_m, "L_p_m": patch.length_m,
        }  # fmt: skip

    def _tracks(self, area_m2: Real) -> dict[str, Any]:
        (top_m, bottom_m), (top, bottom) = self.electrode_m, self.resistivity_ohm_m
        s_top, s_bottom = (rise / area_m2 if rise else 0.0 for rise in self.piezoresistance_per_pa)
        return {
            "L_m": self.length_m, "W_m": self.width_m, "H_top_m": top_m, "H_bottom_m": bottom_m, "rho_top_ohm_m": top,
            "rho_bottom_ohm_m": bottom, "d_m": EPS0_F_PER_M * self.width_m / self.capacitance_f_per_m, "eps_r": 1.0,
            "tan_delta": self.tan_delta, "G_S_per_m": self.leak_s_per_m, "S_n_top_per_N": s_top,
            "S_n_bottom_per_N": s_bottom, "far_end": self.far_end,
        }  # fmt: skip

    def contact_m(self, force_n: ArrayLike) -> tuple[Real, Real]:
        """Length of the contact where it lies on the sensor whole [m], and its derivative by the force [m/N]."""
        if self.contact is None:
            return np.asarray(self.tip_m), np.zeros(())
        length, by_load = self.contact.length_m(np.asarray(force_n, float) / self.width_m, self.tip_m)
        return length, by_load / self.width_m

    def _tip(self, force_n: Real, position_m: ArrayLike) -> line_tip.Tip:
        """A tip that is cut into pieces; where it lies on the sensor whole, always into the same."""
        self.patch(position_m)  # refuses what is no place
        return line_tip.resting(
            self.length_m, self.width_m, (self.profile, self.pieces), force_n, np.asarray(position_m, float),
            self.contact_m(force_n),
        )  # fmt: skip

    def track_ohm_per_m(self) -> tuple[float, float]:
        """Both electrodes together, per length: not pressed [ohm/m], and what each pascal adds [ohm/m/Pa]."""
        per_m = [rho / (h * self.width_m) for rho, h in zip(self.resistivity_ohm_m, self.electrode_m, strict=True)]
        return sum(per_m), sum(r * rise for r, rise in zip(per_m, self.piezoresistance_per_pa, strict=True))

    def _track(self) -> line_tip.Track:
        return line_tip.Track(
            self.length_m, *self.track_ohm_per_m(), self.capacitance_f_per_m, self.tan_delta, self.leak_s_per_m,
            self.far_end,
        )  # fmt: skip

    def impedance(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Complex:
        """Impedance at the contacts [ohm], in the broadcast shape; parameters and errors as :meth:`line_inputs`."""
        if self.profile == UNIFORM:
            return line.impedance(**self.line_inputs(frequency_hz, force_n, position_m))
        tip = self._tip(np.asarray(force_n, float), position_m)
        self.check_tracks(tip.highest_pa())
        return line_tip.impedance(self._track(), tip, self.compression, np.asarray(frequency_hz, float))

    def response(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Response:
        """Impedance and its exact derivatives by force and position, whatever the profile of the pressure.

        Parameters and errors as :meth:`line_inputs`; also OutOfRange where Z is infinite.
        """
        if self.profile == UNIFORM:
            return self._uniform_response(frequency_hz, force_n, position_m)
        tip = self._tip(np.asarray(force_n, float), position_m)
        self.check_tracks(tip.highest_pa())
        found = line_tip.response(self._track(), tip, self.compression, np.asarray(frequency_hz, float))
        return Response(*found)

    def _uniform_response(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Response:
        r"""Of one patch, whose film has the secant modulus E = p/s, with thinning s(p) and p = F/(W l).

        The line knows the derivative at constant E; what is missing is (E s' - 1) of the film's part of it, which -E/F
        times the derivative by E is. Likewise at constant S_n, which falls as a longer patch spreads the pressure.
        """
        inputs, patch = self.line_inputs(frequency_hz, force_n, position_m), self.patch(position_m)
        moves = bool(np.any(patch.length_slope))
        soft = [name for name in ("S_n_top_per_N", "S_n_bottom_per_N") if np.any(inputs[name])]
        of = ("F_N", "x_p_left_edge_m", "E_Pa", *(["L_p_m", *soft] if moves else []))
        z, by = line.sensitivities(of=of, **inputs)
        force, secant = np.asarray(force_n, float), inputs["E_Pa"]
        excess = secant * self.compression.capacitive_strain(self.stress_pa(force, position_m))[1] - 1
        by_force = by["F_N"] - by["E_Pa"] * (excess * secant / np.where(force == 0, 1.0, force))
        by_position = by["x_p_left_edge_m"] * patch.left_slope
        if moves:
            by_length = by["L_p_m"] + by["E_Pa"] * (excess * secant / patch.length_m)
            by_length = by_length - sum(by[name] * inputs[name] for name in soft) / patch.length_m
            by_position = by_position + by_length * patch.length_slope
        return Response(z, by_force, by_position)
