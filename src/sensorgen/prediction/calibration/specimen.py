"""Model of one specimen on its bench: the line sensor with everything in which specimens differ, and its prior.

Each parameter is a standard normal number before calibration; its unit is the standard deviation of the prior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import hypot, log
from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.design.design import Design
from sensorgen.models import line
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import bodies
from sensorgen.prediction.inference import NORMAL_90, Parameter, Samples, parts, slopes
from sensorgen.prediction.inverse.forward import bearable_n, tones
from sensorgen.prediction.query import TONES_HZ, Query, Tip
from sensorgen.prediction.sensor_model import SensorModel, sensor_model

FORCES_N = (0.2, 0.5, 1.0, 2.0, 4.0, 8.0)  # on a whole tip, where the law of compression may be another
_BENDS = 4  # modes of the resistivity's profile, half waves along the strip
_PIECES = 3  # on either side of the tip
_FAR_N = 1e4  # more than any press
_NOTHING_N = 1e-6  # least force, as its logarithm counts


@dataclass(frozen=True)
class Spread:
    """Standard deviations before calibration, of a specimen by its design and of a bench that is not known.

    Attributes
    ----------
    resistance, capacitance : float
        Of ln R and ln C [-].
    profile : float
        Of ln resistivity along the strip: of one half wave; of k of them 1/k of it [-].
    law, law_shape : float
        Of ln of the capacitance's rise: as a whole, and from one force to another [-].
    law_middle : float
        Mean of ln of the rise over the predicted one [-].
    leak, leak_spread : float
        Leakage conductance of the film over its susceptance at the lowest tone: median [-], and of its ln.
    dispersion : float
        Exponent with which the capacitance falls with frequency: mean and standard deviation alike [-].
    lead_ohm, stray_f : float
        Resistance in series and capacitance beside the sensor: mean and standard deviation alike [ohm], [F].
    force_n, force_offset_n : float
        Of the force's offset, and its mean [N].
    position_m : float
        Of the position's offset [m].
    gain : float
        Of ln of each tone's gain, of real and imaginary part [-]; half of its variance is common to all tones.
    hysteresis, creep : float
        Relative change of the rise after a much higher load, and per decade of time: mean and standard deviation alike
        [-].
    scatter : float
        Median of what stays unexplained of ln of the rise, from press to press [-].
    wander : float
        Median of changes of ln R and ln C between a rest reading and its press [-].
    """

    resistance: float = 0.5
    capacitance: float = 0.2
    profile: float = 0.1
    law: float = 0.2
    law_shape: float = 0.1
    law_middle: float = 0.0
    leak: float = 1e-3
    leak_spread: float = 2.0
    dispersion: float = 0.01
    lead_ohm: float = 30.0
    stray_f: float = 5e-13
    force_n: float = 0.1
    force_offset_n: float = 0.0
    position_m: float = 1e-3
    gain: float = 5e-3
    hysteresis: float = 0.05
    creep: float = 0.02
    scatter: float = 0.02
    wander: float = 5e-4

    def __post_init__(self) -> None:
        """Refuse what is no spread."""
        for one in fields(self):
            value = getattr(self, one.name)
            if not np.isfinite(value) or (value <= 0 and one.name not in ("force_offset_n", "law_middle")):
                raise BadInput(f"{one.name} of a calibration's prior is {value:g}; expected a number above 0")


def spread_at(sensor: Sensor) -> Spread:
    """Spread of a bench whose leads a design states; the usual one where it does not."""
    return Spread(lead_ohm=sensor.lead_ohm or Spread.lead_ohm, stray_f=sensor.lead_f or Spread.stray_f)


@dataclass(frozen=True, eq=False)
class Presses(Samples):
    """Known presses, and how they came about.

    Attributes
    ----------
    force_n, position_m : (n,) array
        As the rig says [N], [m].
    unloading : (n,) array
        By which share of it the force is below the highest one of this press so far [-]; nan where unknown.
    decades : (n,) array
        Common logarithm of the time at this force over 1 s [-]; nan where unknown.
    """

    force_n: Real
    position_m: Real
    unloading: Real
    decades: Real


def unknown(force_n: Real, position_m: Real) -> Presses:
    """Presses whose course is unknown."""
    nan = np.full(len(force_n), np.nan)
    return Presses(force_n, position_m, nan, nan)


def no_presses() -> Presses:
    """Presses of a specimen that was never pressed."""
    return unknown(np.empty(0), np.empty(0))


@dataclass(frozen=True, eq=False)
class SpecimenModel:
    """A line sensor with all that may differ from it in one specimen on one bench.

    Attributes
    ----------
    sensor : Sensor
        As predicted.
    frequency_hz : (m,) array
        Tones [Hz].
    spread : Spread
        Of the parameters.
    """

    sensor: Sensor
    frequency_hz: Real
    spread: Spread = field(default_factory=Spread)

    def __post_init__(self) -> None:
        """Refuse tones that are none."""
        object.__setattr__(self, "frequency_hz", tones(self.frequency_hz))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters with their priors: resistance, capacitance and rise as factors on the predicted ones."""
        s, sensor = self.spread, self.sensor
        return (
            Parameter("resistance", 0.0, s.resistance, unit="ohm", shown=sensor.resistance_ohm()),
            *(Parameter(f"profile {k}", 0.0, s.profile / k, linear=True) for k in range(1, _BENDS + 1)),
            Parameter("capacitance", 0.0, s.capacitance, unit="pF", shown=sensor.capacitance_f() * 1e12),
            Parameter("rise", s.law_middle, s.law, unit="predicted"),
            *(Parameter(f"rise at {force:g} N", 0.0, s.law_shape, unit="predicted") for force in FORCES_N),
            Parameter("leak", log(s.leak), s.leak_spread),
            Parameter("dispersion", log(s.dispersion) - 0.5, 1.0),
            Parameter("lead", log(s.lead_ohm) - 0.5, 1.0, unit="ohm"),
            Parameter("stray", log(s.stray_f) - 0.5, 1.0, unit="pF", shown=1e12),
            Parameter("force offset", s.force_offset_n, s.force_n, linear=True, unit="N"),
            Parameter("position offset", 0.0, s.position_m, linear=True, unit="mm", shown=1e3),
            Parameter("hysteresis", log(s.hysteresis) - 0.5, 1.0, unit="%", shown=100.0),
            Parameter("creep", log(s.creep) - 0.5, 1.0, unit="%/decade", shown=100.0),
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.key for one in self.parameters)

    @cached_property
    def _at(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.names)}

    def value(self, name: str, at: Real) -> Real:
        """Value of a parameter (...) at parameters in standard deviations (..., p)."""
        k = self._at[name]
        return self.parameters[k].at(at[..., k])

    @cached_property
    def most_pa(self) -> float:
        """Pressure up to which the law of compression reaches; beyond, the rise goes on in proportion [Pa]."""
        sensor = self.sensor
        return bearable_n(sensor, _FAR_N) / (sensor.width_m * sensor.tip_m / 2)

    @cached_property
    def _shapes(self) -> Real:
        """Root of the covariance of the rise among ``FORCES_N``."""
        return np.asarray(np.linalg.cholesky(self.law_likeness()))

    @staticmethod
    def law_likeness() -> Real:
        """Correlation of the rise among ``FORCES_N`` (k, k): smooth over ln force, over a factor e."""
        distance = np.subtract.outer(np.log(FORCES_N), np.log(FORCES_N))
        return np.asarray(np.exp(-(distance**2) / 2) + 1e-6 * np.eye(len(FORCES_N)))

    def law_weights(self) -> Real:
        """Ln of the factor on the rise at each of ``FORCES_N``, per standard deviation of each parameter (k, p)."""
        weights = np.zeros((len(FORCES_N), len(self.names)))
        common = self._at["rise"]
        weights[:, common] = self.spread.law
        weights[:, common + 1 : common + 1 + len(FORCES_N)] = self.spread.law_shape * self._shapes
        return weights

    def rest(self, at: Real, frequency_hz: Real | None = None) -> Complex:
        """Ln of the impedance that the bench reads with nothing on the sensor, without its gain.

        Parameters
        ----------
        at : (..., p) array
            Parameters in standard deviations.
        frequency_hz : (k,) array, optional
            In place of the tones, by a meter at the specimen's contacts: without lead and stray [Hz].

        Returns
        -------
        (..., m) or (..., k) array
        """
        nothing = unknown(np.zeros(1), np.full(1, self.sensor.length_m / 2))
        if frequency_hz is not None:
            at = np.array(at)
            at[..., [self._at["lead"], self._at["stray"]]] = -np.inf
        return self._read(at, nothing, down=False, frequency_hz=frequency_hz)[..., 0, :]

    def ratio(self, at: Real, presses: Presses, changes: Real | None = None) -> Complex:
        """Ln of pressed over rest.

        Parameters
        ----------
        at : (..., p) array
            Parameters in standard deviations.
        presses : Presses
            n presses.
        changes : (..., 3) array, optional
            Of ln of the rise, of C and of R since the rest reading [-].

        Returns
        -------
        (..., n, m) array
        """
        # at rest, too, cut where the tip would be: what the cuts leave of a profile cancels
        return np.asarray(self._read(at, presses, changes) - self._read(at, presses, down=False))

    def _pressed(
        self, at: Real, value: Mapping[str, Real], presses: Presses, length_m: Real, rise: Real
    ) -> tuple[Real, Real]:  # fmt: skip
        """Capacitance under the tip over that at rest [-], and the pressure [Pa]."""
        sensor = self.sensor
        force = np.maximum(presses.force_n + value["force offset"], _NOTHING_N)
        stress = force / (sensor.width_m * length_m)
        share, _ = sensor.compression.capacitive_strain(np.minimum(stress, self.most_pa))
        first = self._at[f"rise at {FORCES_N[0]:g} N"]
        knots = self.spread.law_shape * (at[..., first : first + len(FORCES_N)] @ self._shapes.T)
        shares = _shares(np.log(force * sensor.tip_m / length_m))
        ln_rise = rise + np.matmul(shares, knots[..., None])[..., 0]
        for name, course in (("hysteresis", presses.unloading), ("creep", presses.decades)):
            ln_rise = ln_rise + value[name] * np.nan_to_num(course)
        beyond = np.maximum(stress / self.most_pa, 1.0)
        return 1 + share / (1 - share) * beyond * value["rise"] * np.exp(ln_rise), stress

    def _read(
        self, at: Real, presses: Presses, changes: Real | None = None, *, down: bool = True,
        frequency_hz: Real | None = None,
    ) -> Complex:  # fmt: skip
        """Ln of the impedance that the bench reads, with the tip down or not."""
        sensor = self.sensor
        value = {name: self.value(name, at)[..., None] for name in self.names}
        rise, c, r = np.moveaxis(np.zeros(3) if changes is None else changes, -1, 0)[..., None]
        position = np.clip(presses.position_m + value["position offset"], 0, sensor.length_m)
        patch = sensor.patch(position)
        length = np.broadcast_to(patch.length_m, position.shape)
        omega = 2 * np.pi * (self.frequency_hz if frequency_hz is None else frequency_hz)
        leak, stored = self._film(value, c, omega)
        track, by_pressure = sensor.track_ohm_per_m()
        whole = track * value["resistance"] * np.exp(r)
        left, right = patch.left_m, np.maximum(sensor.length_m - patch.left_m - length, 0.0)
        shares = np.arange(_PIECES + 1) / _PIECES
        ends = np.stack([*(left * k for k in shares), *(left + length + right * k for k in shares)])
        tracks = [(whole * bent)[..., None] for bent in np.exp(self._bent(value, ends[:-1], ends[1:]))]
        films, lengths = [leak + stored] * len(tracks), [one[..., None] for one in np.diff(ends, axis=0)]
        stray, lead = (value[name][..., None] for name in ("stray", "lead"))
        if down:
            lifted, stress = self._pressed(at, value, presses, length, rise)
            films[_PIECES] = leak + stored * lifted[..., None]
            tracks[_PIECES] = tracks[_PIECES] + (stress * by_pressure)[..., None]
        z = line.cascade(tracks, films, lengths, sensor.far_end)
        return np.asarray(np.log(lead + 1 / (1 / z + 1j * omega * stray)))

    def _film(self, value: Mapping[str, Real], c: Real, omega: Real) -> tuple[Complex, Complex]:
        """Admittance of the film with nothing on it [S/m]: of its leak, and of what rises with C."""
        sensor, lowest = self.sensor, 2 * np.pi * self.frequency_hz.min()
        per_m = (sensor.capacitance_f_per_m * value["capacitance"] * np.exp(c))[..., None]
        leak = value["leak"][..., None] * lowest * per_m
        exponent = np.minimum(value["dispersion"], 1.0)[..., None]
        stored = 1j * omega * (omega / lowest) ** -exponent * np.exp(-0.5j * np.pi * exponent)
        return sensor.leak_s_per_m + leak, (stored + sensor.tan_delta * omega) * per_m

    def _bent(self, value: Mapping[str, Real], start_m: Real, end_m: Real) -> Real:
        """Mean of ln resistivity over parts of the strip, less that of the whole."""
        ln = np.zeros(1)
        for k in range(1, _BENDS + 1):
            start, end = (k * np.pi / self.sensor.length_m * x for x in (start_m, end_m))
            ln = ln + value[f"profile {k}"] * np.cos((start + end) / 2) * np.sinc((end - start) / (2 * np.pi))
        return ln

    def slopes(self, at: Real, presses: Presses) -> Real:
        """Derivatives of the ratio's real and imaginary parts by the parameters, (n, 2 m, p).

        Parameters of the rise alone have a part in the derivative by ln of the rise.
        """
        position = np.clip(presses.position_m + self.value("position offset", at), 0, self.sensor.length_m)
        whole = self.sensor.tip_m / self.sensor.patch(position).length_m
        force = np.maximum(presses.force_n + self.value("force offset", at), _NOTHING_N)
        by = _shares(np.log(force * whole)) @ self.law_weights()
        for name, course in (("hysteresis", presses.unloading), ("creep", presses.decades)):
            by[:, self._at[name]] = self.value(name, at) * np.nan_to_num(course)
        derivatives = self.scatters(at, presses, [0]) * by[:, None]
        others = [k for k, name in enumerate(self.names) if not name.startswith(("rise", "hysteresis", "creep"))]
        derivatives[..., others] = slopes(lambda near: parts(self.ratio(near, presses)), at, others)
        return derivatives

    def scatters(self, at: Real, presses: Presses, which: Sequence[int] = range(3)) -> Real:
        """Derivatives of the ratio's parts by ln of the rise, of C and of R since the rest reading, (n, 2 m, 3)."""
        return slopes(lambda changes: parts(self.ratio(at, presses, changes)), np.zeros(3), which)


def _shares(ln_force: Real) -> Real:
    """Shares that each of ``FORCES_N`` has in a value between them, straight over ln force (..., n, k)."""
    place = np.interp(ln_force, np.log(FORCES_N), np.arange(len(FORCES_N)))
    return np.asarray(np.maximum(0.0, 1 - np.abs(place[..., None] - np.arange(len(FORCES_N)))))


SURE = 2 * NORMAL_90  # widths of a 90 % interval, in standard deviations


@dataclass(frozen=True)
class Bench:
    """Tip and force of the bench.

    Attributes
    ----------
    tip_m : float or None
        Length of the tip along the sensor [m]; the design's if None.
    force_offset_n : (float, float)
        Mean and standard deviation of what the sensor feels above the force that the rig says [N].
    block : mapping
        ``block`` and ``height_mm`` of the tip, in place of the design's.
    """

    tip_m: float | None = None
    force_offset_n: tuple[float, float] = (0.0, 0.1)
    block: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what is no tip and no deviation."""
        if not (self.tip_m is None or self.tip_m > 0) or not self.force_offset_n[1] > 0:
            raise BadInput(
                f"a tip of {(self.tip_m or 0.0) * 1e3:g} mm and an offset of {self.force_offset_n[0]:g} +- "
                f"{self.force_offset_n[1]:g} N; expected a length and a deviation above 0"
            )

    def tip(self, design: Design) -> Tip:
        """The tip that presses a design."""
        tip = design.tip.model_copy(update=dict(self.block)).tip()
        return tip if self.tip_m is None else replace(tip, length_m=self.tip_m)


def spread_of(predicted: SensorModel, bench: Bench) -> Spread:
    """Spread of the specimens of a design, from what its prediction leaves open."""
    mean, sd = bench.force_offset_n
    usual, c = spread_at(predicted.sensor), predicted.rest.capacitance
    ends = [np.log(end / r.value) for r in predicted.rest.resistance.values() for end in (r.lower, r.upper)]
    moduli = [v for v in predicted.values if v.quantity == "youngs_modulus_pa"]
    middle, by_print, by_print_shape = print_spread(predicted)
    return replace(
        usual, force_n=sd, force_offset_n=mean,
        resistance=max(usual.resistance, float(np.ptp(ends)) / SURE) if ends else usual.resistance,
        capacitance=max(usual.capacitance, float(np.log(c.upper / c.lower)) / SURE),
        law=hypot(usual.law if moduli else 2 * usual.law, by_print), law_middle=middle,
        law_shape=hypot(usual.law_shape, by_print_shape),
    )  # fmt: skip


def print_spread(predicted: SensorModel) -> tuple[float, float, float]:
    """Mean of ln of the rise by what is printed, and standard deviations as a whole and from force to force.

    The estimate of a print is one of several cells: electrodes between the least and the largest gap of the rules of
    slicers, the film thinner or thicker, and at best the cell as drawn. Between gaps the rise is taken to change with
    their square at most: the field over the gap, and the displacement of a film that gets thinner. All 0 for a drawing.
    """
    if predicted.body.is_drawn:
        return 0.0, 0.0, 0.0
    by_drawing = _ln_rise_as_drawn(predicted)
    ends = [0.0, *by_drawing.tolist()]
    cells = predicted.body.cells
    error, (first, *_) = cells.film.error_mm if cells.film else 0.0, cells.gap_mm.values()
    gaps = [gap for gap in cells.gap_mm.values() if error < gap < np.inf]
    if first in gaps:
        ends += [2 * log(first / end) for end in (min(gaps) - error, max(gaps) + error)]
    return (max(ends) + min(ends)) / 2, (max(ends) - min(ends)) / SURE, float(np.ptp(by_drawing)) / SURE


def _ln_rise_as_drawn(predicted: SensorModel) -> Real:
    """Ln of the rise of the cell as drawn over the predicted one, at forces that both laws know; 0 without a law."""
    sensor = predicted.sensor
    try:
        drawn = sensor_model(bodies.drawn(predicted.body.design), Query(tip=Tip(sensor.tip_m)))[0].sensor
    except SensorgenError:
        return np.zeros(1)
    models = [SpecimenModel(one, np.array(TONES_HZ), Spread()) for one in (drawn, sensor)]
    stress = np.minimum(np.array(FORCES_N) / (sensor.width_m * sensor.tip_m), min(one.most_pa for one in models))
    shares = [one.compression.capacitive_strain(stress)[0] for one in (drawn, sensor)]
    return np.asarray(np.subtract(*(np.log(share / (1 - share)) for share in shares)))
