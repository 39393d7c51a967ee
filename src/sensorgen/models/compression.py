"""How much thinner a film seems to its capacitance under stress: plates free or bonded, and curves that were solved.

The *thinning* is the share by which a plate of the same capacitance would be thinner, 1 - C'(0)/C'(stress).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core import yamlfile
from sensorgen.core.errors import MissingValue, OutOfRange

if TYPE_CHECKING:
    from sensorgen.solvers.contact.pressed import Pressed

SOURCE = "Thesis Eq. B.49; Gent and Lindley (1959) for the bonded plate; solved cells as their file says"
COST = 0

PROTOTYPE_PA = 6e6  # Young's modulus of the films of the cells that were solved once and for all [Pa]
SOLVED_RATIO = 0.4999  # Poisson's ratio of all materials of the cells that were solved once and for all [-]
REACH = 3.0  # how far beyond its last stress a curve is extended by its last slope, as a factor [-]
_PA_PER_KPA, _UM_PER_M = 1e3, 1e6
_SAME = 1e-6  # relative difference up to which two parameters are one
_EARLY = np.array([1 / 16, 1 / 4])  # of the first stress, where a curve that begins with a power of it is held

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Plate:
    r"""A plate that obeys Hooke's law, thinning = stress / modulus (B.49).

    Attributes
    ----------
    name, source : str
        What it is, and who says so.
    modulus_pa : float
        Stress per thinning [Pa].

    Examples
    --------
    >>> [float(value) for value in Plate("free", "B.49", 6e6).thinning(np.asarray(60e3))]
    [0.01, 1.6666666666666668e-07]
    """

    name: str
    source: str
    modulus_pa: float

    def thinning(self, stress_pa: Real) -> tuple[Real, Real]:
        """Thinning [-] and its derivative [1/Pa]; from 1 on the electrodes touch, and it raises OutOfRange."""
        share = stress_pa / self.modulus_pa
        if np.any(share >= 1):
            raise OutOfRange(f"the stress thins the film by {np.max(share):.3g}: at 1 its electrodes touch (Eq. B.49)")
        return share, np.full_like(share, 1 / self.modulus_pa)

    def bed_pa_per_m(self, gap_m: float) -> float:
        """Pressure per displacement of the top [Pa/m], of a plate that fills a gap between its electrodes [m]."""
        return self.modulus_pa / gap_m

    def stiffer(self, factor: float) -> "Plate":
        """The same of a material that many times as stiff."""
        return replace(self, modulus_pa=self.modulus_pa * factor)

    def doubt(self, stress_pa: float) -> str:  # noqa: ARG002 - a law has no last point
        """Nothing."""
        return ""


@dataclass(frozen=True)
class Curve:
    """Capacitance over stress, point by point, with a cubic between (Hermite) that keeps it rising.

    Attributes
    ----------
    name, source : str
        What it is, and who says so.
    stress_pa, ratio, slope_per_pa : tuple of float
        Stress from 0 on [Pa]; C'(stress)/C'(0) [-], from 1 on, and its derivative [1/Pa].
    within : float
        Share by which its rise may be off [-].
    held : tuple of float
        Shares by which the rise differs for the same cell held or touched otherwise [-].
    moved_m : float or None
        How far the top has come down at the last stress [m]; None where nobody says.
    onset : float
        How much further below 1 the power of the stress is with which it begins than it seems, as a factor [-].

    Examples
    --------
    >>> law = curve("example", "made up", [0.0, 5e4, 1e5], [1.0, 1.25, 2.0])
    >>> [round(float(value), 6) for value in law.thinning(np.asarray(1e5))]
    [0.5, 5e-06]
    """

    name: str
    source: str
    stress_pa: tuple[float, ...]
    ratio: tuple[float, ...]
    slope_per_pa: tuple[float, ...]
    within: float = 0.0
    held: tuple[float, ...] = ()
    moved_m: float | None = None
    onset: float = 1.0

    def thinning(self, stress_pa: Real) -> tuple[Real, Real]:
        """Thinning [-] and its derivative [1/Pa]; raises OutOfRange for a pull and far beyond the last point."""
        last = self.stress_pa[-1]
        if np.any(stress_pa < 0):
            raise OutOfRange(f"a stress of {np.min(stress_pa):.3g} Pa pulls; the curve {self.name!r} begins at 0")
        if np.any(stress_pa > REACH * last):
            raise OutOfRange(
                f"a stress of {np.max(stress_pa):.4g} Pa; the curve {self.name!r} ends at {last:.4g} Pa and is "
                f"extended up to {REACH:g} times that: press less, or with a larger tip"
            )
        rise, slope = self._rise(stress_pa)
        return rise / (1 + rise), slope / (1 + rise) ** 2

    def bed_pa_per_m(self, gap_m: float) -> float:  # noqa: ARG002 - the cell's own height is in it
        """Pressure per displacement of the top up to the last stress [Pa/m]; raises MissingValue where nobody says."""
        if self.moved_m is None:
            raise MissingValue(f"the curve {self.name!r} does not say how far the top comes down")
        return self.stress_pa[-1] / self.moved_m

    def stiffer(self, factor: float) -> "Curve":
        """The same of materials that are all that many times as stiff: stresses scale."""
        return replace(
            self,
            stress_pa=tuple(p * factor for p in self.stress_pa),
            slope_per_pa=tuple(m / factor for m in self.slope_per_pa),
        )

    def rising(self, factor: float) -> "Curve":
        """A curve that rises that many times as much."""
        return replace(
            self,
            ratio=tuple(1 + (g - 1) * factor for g in self.ratio),
            slope_per_pa=tuple(m * factor for m in self.slope_per_pa),
        )

    def doubt(self, stress_pa: float) -> str:
        """Whether the stress is beyond the last point."""
        last = self.stress_pa[-1]
        return f"above {last / _PA_PER_KPA:g} kPa the curve is extended by its last slope" if stress_pa > last else ""

    @cached_property
    def _cubics(self) -> tuple[Real, ...]:
        """Stress where each piece begins, its length, and its coefficients in the share of that length."""
        p, r, m = self._knots()
        h, rise = np.diff(p), np.diff(r)
        return p[:-1], h, r[:-1], h * m[:-1], 3 * rise - h * (2 * m[:-1] + m[1:]), h * (m[:-1] + m[1:]) - 2 * rise

    def _knots(self) -> tuple[Real, Real, Real]:
        """Stresses [Pa], rises [-] and slopes [1/Pa] between which cubics lie.

        Where the points bend down from the first on, a contact grows from nothing: up to there the rise goes with a
        power of the stress, which a cubic by itself would begin too flat.
        """
        p, r, m = np.asarray(self.stress_pa), np.asarray(self.ratio) - 1, np.asarray(self.slope_per_pa)
        power = 1 - self.onset * (1 - m[1] * p[1] / r[1])
        if not 0 < power < 1:
            return p, r, m
        early, begun = p[1] * _EARLY, r[1] * _EARLY**power
        slope = power * begun / early
        first = (2 - power) * begun[0] / early[0]  # a parabola to the first of them
        return np.insert(p, 1, early), np.insert(r, 1, begun), np.concatenate([[first], slope, m[1:]])

    def _rise(self, at: Real) -> tuple[Real, Real]:
        """C'/C'(0) - 1, which keeps its digits where little presses, and its derivative [1/Pa]."""
        starts, *pieces = self._cubics
        k = np.clip(np.searchsorted(starts, at, side="right") - 1, 0, None)
        h, before, linear, quadratic, cubic = (piece[k] for piece in pieces)
        inside = np.minimum(at, self.stress_pa[-1])
        t = (inside - starts[k]) / h
        value = before + t * (linear + t * (quadratic + t * cubic))
        slope = (linear + t * (2 * quadratic + 3 * t * cubic)) / h
        return value + (at - inside) * self.slope_per_pa[-1], slope


Compression = Plate | Curve


def unconfined(youngs_modulus_pa: float) -> Plate:
    """A plate that is free to give way sideways: the softest case (B.49)."""
    return Plate("unconfined", "thesis B.49: strain = stress / E, free to give way sideways", youngs_modulus_pa)


def bonded(youngs_modulus_pa: float, width_m: float, thickness_m: float) -> Plate:
    r"""A long incompressible plate bonded to stiff faces: the stiffest case.

    .. math:: \frac{\sigma}{\varepsilon} = \frac{4}{3} E (1 + S^2), \quad S = \frac{W}{2 d}

    Parameters
    ----------
    youngs_modulus_pa, width_m, thickness_m : float
        E [Pa]; W and d [m].

    Notes
    -----
    Gent and Lindley, Proc. Inst. Mech. Eng. 173, 111 (1959), plane strain. At nu = 0.45 the film is at most 3.8 times
    stiffer than E, however thin: the two laws bracket a plate.

    Examples
    --------
    >>> round(bonded(1.0, 10e-3, 0.6e-3).modulus_pa, 1)
    93.9
    """
    stiffer = 4 / 3 * (1 + (width_m / (2 * thickness_m)) ** 2)
    return Plate("bonded", f"bonded and incompressible: {stiffer:.4g} E", stiffer * youngs_modulus_pa)


def curve(name: str, source: str, stress_pa: Sequence[float], ratio: Sequence[float]) -> Curve:
    """A curve through points, its slopes by the monotone rule of Fritsch and Butland.

    Parameters
    ----------
    name, source : str
        What it is, and who says so.
    stress_pa, ratio : sequence of float
        Stress, from 0 on and rising [Pa]; C'(stress)/C'(0), from 1 on and rising [-].

    Raises
    ------
    OutOfRange
        Fewer than two points, or points that do not start at (0, 1) and rise.
    """
    p, g = np.asarray(stress_pa, float), np.asarray(ratio, float)
    if not (len(p) == len(g) > 1 and p[0] == 0 and g[0] == 1 and (np.diff(p) > 0).all() and (np.diff(g) > 0).all()):
        raise OutOfRange(f"{name}: expected stress from 0 and ratio C/C(0) from 1, two points or more, both rising")
    return Curve(name, source, tuple(p.tolist()), tuple(g.tolist()), tuple(_slopes(p, g).tolist()))


def curve_of(pressed: "Pressed", name: str = "solved") -> Curve:
    """The pressure law of a solved cell.

    Raises
    ------
    OutOfRange
        The solution has faults, or the capacitance is not known at two pressures at least.
    """
    if pressed.faults:
        raise OutOfRange(f"the solved cell is not to be trusted: {'; '.join(pressed.faults)}")
    known = [(p, c.middle()) for p, c in zip(pressed.stress_pa, pressed.capacitance_f_per_m2, strict=True) if c]
    ratio = [c / known[0][1] for _, c in known] if known else []
    return curve(name, pressed.source, [float(p) for p, _ in known], ratio)


def _slopes(p: Real, g: Real) -> Real:
    """Harmonic means within (Fritsch and Butland, 1984), one-sided parabolas at the ends, never against the rise.

    As SciPy's PCHIP, without its import: that takes longer than a whole prediction.
    """
    h, s = np.diff(p), np.diff(g) / np.diff(p)
    if len(s) == 1:
        return np.repeat(s, 2)
    w1, w2 = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    inner = (w1 + w2) / (w1 / s[:-1] + w2 / s[1:])
    ends = [((2 * h[i] + h[j]) * s[i] - h[i] * s[j]) / (h[i] + h[j]) for i, j in ((0, 1), (-1, -2))]
    return np.array([max(ends[0], 0.0), *inner, max(ends[1], 0.0)])


def solved(shape: str, parameters: Mapping[str, Any], youngs_modulus_pa: Mapping[str, float]) -> Curve | None:
    """The solved curve of a cell, or None where this cell was not solved.

    Parameters
    ----------
    shape : str
        Name of the shape.
    parameters : mapping
        All its parameters.
    youngs_modulus_pa : mapping of str to float
        By material [Pa]. The stress scales with them, as long as their ratio is that of the solved cell.
    """
    for cell in _cells()["cells"]:
        moduli = cell["youngs_modulus_pa"]
        factors = [youngs_modulus_pa.get(name, 0.0) / modulus for name, modulus in moduli.items()]
        same = all(abs(parameters.get(k, np.inf) / v - 1) < _SAME for k, v in cell["parameters"].items())
        if cell["shape"] == shape and same and min(factors) > 0 and max(factors) / min(factors) - 1 < _SAME:
            return _curve(cell, factors[0])
    return None


def prototype(shape: str) -> Curve:
    """The first solved curve of a shape, of films of ``PROTOTYPE_PA``: what a cell like it can be expected to do."""
    return _curve(next(cell for cell in _cells()["cells"] if cell["shape"] == shape), 1.0)


def _curve(cell: Mapping[str, Any], stiffer: float) -> Curve:
    """A solved cell's curve, its materials that many times as stiff."""
    stress = [kpa * _PA_PER_KPA * stiffer for kpa in cell["stress_kpa"]]
    found = curve("solved", cell["source"], stress, [1 + percent / 100 for percent in cell["rise_percent"]])
    moved_m = cell["displacement_um"] / _UM_PER_M
    return replace(found, within=cell["within"], held=tuple(cell["held"].values()), moved_m=moved_m)


@cache
def _cells() -> dict[str, Any]:
    file = "solved_cells.yaml"
    return yamlfile.parse((resources.files("sensorgen.models") / file).read_text("utf-8"), file)
