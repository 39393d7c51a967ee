"""Line sensor: two tracks, a film with a law of compression, and a tip that presses. SI units.

The tip lies across the whole width, centred at a position along the sensor. Where it overhangs an end, the force rests
on the part of the tip that lies on the sensor, distributed by the profile of its pressure.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models import line, line_tip
from sensorgen.models.compression import Compression
from sensorgen.models.pressure import RoundContact
from sensorgen.solvers.line.inputs import in_range

UNIFORM = "uniform"
PIECES = 16  # changes of Z under a tip of another profile are then right to 1e-3


class Patch(NamedTuple):
    """Part of the sensor under the tip; arrays of the positions' shape, or numbers where they are equal."""

    left_m: Real
    length_m: Real


class Response(NamedTuple):
    """Impedance and its derivatives, in the shape that frequency, force and position broadcast to."""

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
        Thickness of the top and the bottom electrode; of one with cogs, of the plain plate of the same resistance [m].
    resistivity_ohm_m : (float, float)
        Of the top and the bottom electrode [ohm m].
    capacitance_f_per_m : float
        Unloaded, per length [F/m].
    compression : Compression
        Capacitive strain of the film over pressure.
    tip_m : float
        Length of the tip along the sensor [m].
    profile : str
        Distribution of its pressure: one of :data:`sensorgen.models.pressure.PROFILES`.
    contact : RoundContact or None
        Growth of a round tip's contact with the force, up to ``tip_m``; None where all of the tip always touches.
    pieces : int
        Number of pieces that a tip whose pressure is not uniform is cut into.
    tan_delta : float
        Loss tangent of the film [-].
    leak_s_per_m : float
        Leakage conductance of the film per length, the same under the tip [S/m].
    piezoresistance_per_pa : (float, float)
        Relative rise of the top and the bottom resistivity per pressure under the tip, of either sign [1/Pa].
    far_end : str or float
        "open", "short", or a resistor [ohm].
    lead_ohm, lead_f : float
        Resistance of leads and contacts in series, and capacitance of the leads in parallel with the sensor [ohm], [F].
    """

    length_m: float
    width_m: float
    electrode_m: tuple[float, float]
    resistivity_ohm_m: tuple[float, float]
    capacitance_f_per_m: float
    compression: Compression
    tip_m: float = 0.01
    profile: str = UNIFORM
    contact: RoundContact | None = None
    pieces: int = PIECES
    tan_delta: float = 0.0
    leak_s_per_m: float = 0.0
    piezoresistance_per_pa: tuple[float, float] = (0.0, 0.0)
    far_end: str | float = "open"
    lead_ohm: float = 0.0
    lead_f: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values out of range."""
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
        low, high = at - self.tip_m / 2, at + self.tip_m / 2
        if self.whole(at).all():  # one length for all keeps the axes of a grid apart
            return Patch(low, np.asarray(self.tip_m))
        left, right = np.maximum(low, 0.0), np.minimum(high, self.length_m)
        return Patch(left, np.where(self.whole(at), self.tip_m, right - left))

    def whole(self, position_m: ArrayLike) -> Mask:
        """Mask: true where a tip centred at ``position_m`` [m] lies on the sensor whole, flush with an end or not."""
        at = np.asarray(position_m, float)
        return np.asarray((at - self.tip_m / 2 >= 0) & (at + self.tip_m / 2 <= self.length_m))

    def stress_pa(self, force_n: ArrayLike, position_m: ArrayLike) -> Real:
        """Highest pressure under the tip [Pa], that of all of it if uniform; in the broadcast shape."""
        return self._tip(force_n, position_m).highest_pa()

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

    def check_press(self, force_n: ArrayLike, position_m: ArrayLike) -> None:
        """Refuse presses under which electrodes touch, or beyond the law of compression; as :meth:`check_tracks`."""
        stress = self.stress_pa(force_n, position_m)
        self.compression.capacitive_strain(stress)
        self.check_tracks(stress)

    def contact_m(self, force_n: ArrayLike) -> tuple[Real, Real]:
        """Length of the contact where it lies on the sensor whole [m], and its derivative by the force [m/N]."""
        if self.contact is None:
            return np.asarray(self.tip_m), np.zeros(())
        length, by_load = self.contact.length_m(np.asarray(force_n, float) / self.width_m, self.tip_m)
        return length, by_load / self.width_m

    def _tip(self, force_n: ArrayLike, position_m: ArrayLike) -> line_tip.LineContact:
        """The tip in pieces, one if its pressure is uniform; the same ones wherever it lies whole on the sensor."""
        self.patch(position_m)  # refuses positions out of range
        force, pieces = in_range("force_n", force_n), 1 if self.profile == UNIFORM else self.pieces
        return line_tip.resting(
            self.length_m, self.width_m, (self.profile, pieces), force, np.asarray(position_m, float),
            self.contact_m(force),
        )  # fmt: skip

    def track_ohm_per_m(self) -> tuple[float, float]:
        """Both electrodes together, per length: not pressed [ohm/m], and its rise per pressure [ohm/m/Pa]."""
        per_m = [rho / (h * self.width_m) for rho, h in zip(self.resistivity_ohm_m, self.electrode_m, strict=True)]
        return sum(per_m), sum(r * rise for r, rise in zip(per_m, self.piezoresistance_per_pa, strict=True))

    def common_resistivity_ohm_m(self) -> float:
        """The one resistivity of both electrodes at which they together have the resistance that they have [ohm m]."""
        return self.track_ohm_per_m()[0] / sum(1 / (h * self.width_m) for h in self.electrode_m)

    def _pressed(
        self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike
    ) -> tuple[line_tip.RestLine, line_tip.LineContact, Compression, Real]:
        frequency, tip = in_range("frequency_hz", frequency_hz), self._tip(force_n, position_m)
        self.check_tracks(tip.highest_pa())
        track = line_tip.RestLine(
            self.length_m, *self.track_ohm_per_m(), self.capacitance_f_per_m, self.tan_delta, self.leak_s_per_m,
            self.far_end,
        )  # fmt: skip
        return track, tip, self.compression, frequency

    def impedance(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Complex:
        """Impedance at the contacts [ohm], in the broadcast shape.

        Parameters
        ----------
        frequency_hz, force_n, position_m : float or array
            Frequencies [Hz], forces [N], centres of the tip [m]; they broadcast.

        Raises
        ------
        OutOfRange
            As :meth:`patch`, :meth:`check_tracks` and the law of compression.
        """
        return self.at_leads(line_tip.impedance(*self._pressed(frequency_hz, force_n, position_m)), frequency_hz)

    def response(self, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Response:
        """Impedance and its exact derivatives by force and position.

        Parameters and errors as :meth:`impedance`; also OutOfRange where Z is infinite.
        """
        z, *slopes = line_tip.response(*self._pressed(frequency_hz, force_n, position_m))
        share = 1 / (1 + 2j * np.pi * np.asarray(frequency_hz) * self.lead_f * z)  # of the current through the sensor
        return Response(self.at_leads(z, frequency_hz), *(share**2 * slope for slope in slopes))

    def at_leads(self, impedance_ohm: Complex, frequency_hz: ArrayLike) -> Complex:
        """Impedance at the meter of a sensor at the end of its leads [ohm], in the broadcast shape."""
        if not self.lead_f and not self.lead_ohm:
            return impedance_ohm
        parallel = 1 + 2j * np.pi * np.asarray(frequency_hz) * self.lead_f * impedance_ohm
        return np.asarray(self.lead_ohm + impedance_ohm / parallel)
