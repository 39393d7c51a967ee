"""A print of a design, as it might be: geometry as printed, materials drawn from their ranges, and all that drifts.

Written apart from what analyses it: an own solver of the cell (:mod:`.cell`), and an own line, a chain of short pieces.
"""

from dataclasses import dataclass, field
from functools import cached_property
from math import exp, log
from typing import Annotated

import numpy as np
from pydantic import Field

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput
from sensorgen.core.records import Finite, NotNegative, Positive, Strict
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import ENDS, film, ln_spread, material_value, resistivities
from sensorgen.measure.virtual.blank import Blank, blank, tracks

_PIECES = 60  # of the chain that the line is
_THINNEST_M = 1e-12  # of a piece
_SIZES = 0.02, 0.01  # of ln R and ln C: thickness and width of printed tracks, width of cells


Waves = Annotated[tuple[Finite, ...], Field(strict=False)]


class Truth(Strict):
    """True values of one specimen, its leads and its rig; all errors 0 by default.

    Attributes
    ----------
    resistivity, permittivity, modulus : float
        Ln of the material's value over that of the design: of the electrodes, of the dielectric, of the dielectric [-].
    tracks, cells : float
        Ln of R and C over those of the body, by widths and thicknesses that are not as printed [-].
    film_mm : float
        By which the film is thicker than as printed [mm].
    profile : tuple of float
        Of ln resistivity: amplitudes of 1, 2, ... half waves along the strip [-].
    law : tuple of float
        Of ln of the rise of C: amplitudes of 1, 2, ... half waves over ln force from 0.2 to 13 N [-].
    leak : float
        Conductance of the film over its susceptance at 1 kHz [-].
    dispersion : float
        Exponent with which C falls with frequency, from 1 kHz on [-].
    hysteresis : float
        Relative rise of the response to a force that was much higher [-].
    creep : float
        Relative rise of the response per decade of time; 0 at 1 s [-].
    drift_c, drift_r, drift_s : float
        Standard deviations of ln C and ln R over a session, and the time after which they are forgotten [-], [s].
    lead_ohm, stray_f : float
        In series with, and beside, the specimen [ohm], [F].
    force_n, position_m : float
        By which force and place are off [N], [m].
    short_ohm, short_share, short_opens_n : float
        A bridge between the electrodes, at a share of the length, and the force above which it opens; none if infinite.
    """

    resistivity: Finite = 0.0
    permittivity: Finite = 0.0
    modulus: Finite = 0.0
    tracks: Finite = 0.0
    cells: Finite = 0.0
    film_mm: Finite = 0.0
    profile: Waves = ()
    law: Waves = ()
    leak: NotNegative = 0.0
    dispersion: Finite = 0.0
    hysteresis: Finite = 0.0
    creep: Finite = 0.0
    drift_c: NotNegative = 0.0
    drift_r: NotNegative = 0.0
    drift_s: Positive = 300.0
    lead_ohm: NotNegative = 0.0
    stray_f: NotNegative = 0.0
    force_n: Finite = 0.0
    position_m: Finite = 0.0
    short_ohm: float = Field(ge=0, default_factory=lambda: np.inf)  # not in the schema: JSON has no infinity
    short_share: Annotated[float, Field(ge=0, le=1)] = 0.5
    short_opens_n: float = Field(ge=0, default_factory=lambda: np.inf)


def drawn(design: Design, seed: int) -> Truth:
    """A random specimen of a design; equal for equal seeds."""
    rng, dielectric = np.random.default_rng(seed), (design.material(film(design)), design.used()[film(design)])
    electrode = design.slot("bottom_electrode")
    slots = {"relative_permittivity": dielectric, "resistivity_ohm_m": electrode, "youngs_modulus_pa": dielectric}
    by = {quantity: float(rng.normal(*ln_spread(*slot, quantity))) for quantity, slot in slots.items()}

    def waves(sd: float) -> tuple[float, ...]:
        return tuple((rng.normal(0.0, sd, 3) / np.arange(1, 4)).tolist())

    def normal(sd: float) -> float:
        return float(rng.normal(0.0, sd))

    return Truth(
        resistivity=by["resistivity_ohm_m"], permittivity=by["relative_permittivity"], modulus=by["youngs_modulus_pa"],
        tracks=normal(_SIZES[0]), cells=normal(_SIZES[1]), film_mm=normal(design.machine.tool_height_error_mm / 1.96),
        profile=waves(0.1), law=waves(0.05),
        leak=float(np.exp(rng.normal(np.log(1e-3), 1.0))), dispersion=float(rng.uniform(0.0, 0.02)),
        hysteresis=float(rng.uniform(0.03, 0.07)), creep=float(rng.uniform(0.01, 0.03)), drift_c=1e-3, drift_r=1e-3,
        lead_ohm=float(rng.uniform(0.0, 60.0)), stray_f=float(rng.uniform(0.0, 1e-12)), force_n=normal(0.05),
        position_m=normal(0.5e-3),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class PressedSpecimen:
    """A specimen that can be pressed.

    Attributes
    ----------
    design : Design
        What it was printed of.
    truth : Truth
        In what it differs from that.
    tip_m : float
        Length of the tip along the strip [m].
    """

    design: Design
    truth: Truth = field(default_factory=Truth)
    tip_m: float = 5e-3

    def __post_init__(self) -> None:
        """Refuse a tip that is none."""
        if not 0 < self.tip_m <= self.length_m:
            raise BadInput(
                f"a tip of {self.tip_m * 1e3:g} mm on {self.length_m * 1e3:g} mm; expected one no longer than the strip"
            )

    @cached_property
    def blank(self) -> Blank:
        """The body that it was printed as, with the materials' values by the design."""
        return blank(self.design)

    @property
    def length_m(self) -> float:
        """Along the strip [m]."""
        return self.design.params.length_mm * M_PER_MM

    def values(self) -> dict[str, float]:
        """True values of the materials, by quantity: of the dielectric, and of the electrodes.

        Where these differ by the design, the resistivity is the one at which both together resist as much.
        """
        d, t = self.design, self.truth
        dielectric = d.material(film(d)), d.used()[film(d)]
        of, of_end = resistivities(d), dict(zip(ENDS, tracks(d), strict=True))
        common = sum(of_end.values()) / sum(of_end[end] / of[end].value for end in ENDS)
        return {
            "resistivity_ohm_m": common * exp(t.resistivity),
            "relative_permittivity": material_value(*dielectric, "relative_permittivity").value * exp(t.permittivity),
            "youngs_modulus_pa": material_value(*dielectric, "youngs_modulus_pa").value * exp(t.modulus),
        }

    @cached_property
    def capacitance_f_per_m(self) -> float:
        """With nothing on it, at 1 kHz [F/m]."""
        by_size = self.truth.cells + self.blank.by_film_per_mm * self.truth.film_mm
        return self.blank.capacitance_f_per_m(self.truth.permittivity) * exp(by_size)

    @cached_property
    def track_ohm_per_m(self) -> tuple[float, float]:
        """Of the top and the bottom electrode, mean over the length of an even profile [ohm/m]."""
        top, bottom = self.blank.track_ohm_per_m
        factor = exp(self.truth.resistivity + self.truth.tracks)
        return top * factor, bottom * factor

    @cached_property
    def _curve(self) -> tuple[Real, Real]:
        return self.blank.rise(self.truth.permittivity, self.truth.modulus)

    def patch(self, position_m: float) -> tuple[float, float]:
        """Ends of the part of the strip that is under the tip [m]."""
        at = position_m + self.truth.position_m
        low, high = max(at - self.tip_m / 2, 0.0), min(at + self.tip_m / 2, self.length_m)
        return (low, high) if high > low else (low, low)

    def rise(self, force_n: float, covered_m: float, unloading: float = 0.0, decades: float = 0.0) -> float:
        """Relative rise of the capacitance under the tip.

        Parameters
        ----------
        force_n : float
            That the rig says; the specimen feels it with its offset [N].
        covered_m : float
            Length under the tip [m].
        unloading, decades : float
            Share by which an earlier force was higher; logarithm of the time at this force over 1 s [-].
        """
        felt = force_n + self.truth.force_n
        if force_n <= 0 or felt <= 0 or covered_m <= 0:
            return 0.0
        pressure, rise = self._curve
        p = felt / (self.design.params.width_mm * M_PER_MM * covered_m)
        ratio = float(np.interp(p, pressure, rise))
        if p > pressure[-1]:
            ratio += (p - pressure[-1]) * float((rise[-1] - rise[-3]) / (pressure[-1] - pressure[-3]))
        if self.truth.law:
            at = min(max(log(felt / 0.2) / log(13 / 0.2), 0.0), 1.0)
            ratio *= exp(sum(k * np.cos((n + 1) * np.pi * at) for n, k in enumerate(self.truth.law)))
        ratio *= 1 + self.truth.hysteresis * unloading
        return ratio * (1 + self.truth.creep * decades)


class VirtualLine:
    """The strip at some frequencies: a chain of short pieces of constant values, open at its far end.

    What lies left and right of the tip is worked out once for every place.

    Parameters
    ----------
    specimen : PressedSpecimen
        Whose strip it is.
    frequency_hz : (m,) array
        Frequencies [Hz].
    """

    _STEP = 1e-3

    def __init__(self, specimen: PressedSpecimen, frequency_hz: Real) -> None:
        self._of = specimen
        truth = specimen.truth
        self.frequency_hz: Real = np.array(frequency_hz, float)
        omega = 2 * np.pi * self.frequency_hz
        change = self._STEP * np.eye(3)[:, 1:]  # of ln C and ln R: none, one, the other
        c = specimen.capacitance_f_per_m * np.exp(change[:, :1])
        bend = (1j * omega / (2 * np.pi * 1e3)) ** -truth.dispersion
        self._loose: Complex = 1j * omega * c * bend
        self._leak: Real = truth.leak * 2 * np.pi * 1e3 * c * np.ones(len(omega))
        self._track: Real = sum(specimen.track_ohm_per_m) * np.exp(change[:, 1:])
        self._omega = omega
        self._short_m = truth.short_share * specimen.length_m if np.isfinite(truth.short_ohm) else np.inf
        self._sides: dict[tuple[float, float, bool], tuple[Complex, Complex]] = {}

    def impedance(
        self, lift: float, ends_m: tuple[float, float], ln_c: float = 0.0, ln_r: float = 0.0, *, shorted: bool = True,
    ) -> Complex:  # fmt: skip
        """Impedance at the ends of the leads (m,) [ohm].

        Parameters
        ----------
        lift : float
            Rise of the capacitance under the tip [-].
        ends_m : (float, float)
            Of the part under the tip [m].
        ln_c, ln_r : float
            Drift of ln C and ln R since the beginning [-].
        shorted : bool
            Whether a short of the specimen's is closed.
        """
        key = (*ends_m, shorted)
        if key not in self._sides:
            if len(self._sides) > 64:
                self._sides.clear()
            far = self._chain(ends_m[1], self._of.length_m, shorted=shorted)
            self._sides[key] = self._chain(0.0, ends_m[0], shorted=shorted), far[1, 0] / far[0, 0]
        near, y = self._sides[key]
        if ends_m[1] > ends_m[0]:
            under = self._chain(*ends_m, lift, shorted=shorted)
            y = (under[1, 0] + under[1, 1] * y) / (under[0, 0] + under[0, 1] * y)
        whole = (near[1, 0] + near[1, 1] * y) / (near[0, 0] + near[0, 1] * y)
        z = np.log(self._of.truth.lead_ohm + 1 / (whole + 1j * self._omega * self._of.truth.stray_f))
        by = (z[1:] - z[0]) / self._STEP
        return np.asarray(np.exp(z[0] + ln_c * by[0] + ln_r * by[1]))

    def _chain(self, start_m: float, end_m: float, lift: float = 0.0, *, shorted: bool) -> Complex:
        """Matrix of a part of the strip (2, 2, 3, m)."""
        length, truth = self._of.length_m, self._of.truth
        count = max(int(np.ceil((end_m - start_m) / length * _PIECES - 1e-9)), 1)
        edges = np.linspace(start_m, end_m, count + 1)
        middle, size = (edges[1:] + edges[:-1]) / 2, np.maximum(np.diff(edges), _THINNEST_M)
        waves = np.arange(1, len(truth.profile) + 1)
        bent = np.array(truth.profile) @ np.cos(waves[:, None] * np.pi * middle / length)
        y = (self._loose * (1 + lift) + self._leak)[..., None] * size
        pieces = _piece(self._track[..., None] * np.exp(bent) * size, y)
        if shorted and start_m <= self._short_m <= end_m:
            at = min(int(np.searchsorted(edges, self._short_m, side="right")), count) - 1
            pieces[:, 0, ..., at] += pieces[:, 1, ..., at] / truth.short_ohm
        return _product(pieces)


def _product(matrices: Complex) -> Complex:
    """Of all matrices along the last axis, in order; halves at a time."""
    while matrices.shape[-1] > 1:
        count = matrices.shape[-1]
        even = count - count % 2
        joined = np.einsum("ij...,jk...->ik...", matrices[..., :even:2], matrices[..., 1:even:2])
        matrices = np.concatenate([joined, matrices[..., even:]], -1)
    return matrices[..., 0]


def _piece(series: Real, shunt: Complex) -> Complex:
    """Matrix of a piece with its resistance and admittance [ohm], [S]."""
    s = np.sqrt(series * shunt)
    ch, z0 = np.cosh(s), np.sqrt(series / shunt)
    sh = np.sinh(s)
    return np.array([[ch, z0 * sh], [sh / z0, ch]])
