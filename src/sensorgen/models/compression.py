"""Capacitive strain 1 - C'(0)/C'(p) versus pressure p: free and bonded plates, and curves of solved cells.

A plate of the same capacitance is thinner by this share.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Real
from sensorgen.core.errors import MissingValue, OutOfRange

if TYPE_CHECKING:
    from sensorgen.solvers.contact.pressed import Pressed

SOURCE = (
    "Thesis Eq. B.49; Gent and Lindley (1959), Chalhoub and Kelly (1991) for the bonded plate; solved cells as their "
    "file says"
)
COST = 0

PROTOTYPE_PA = 6e6  # Young's modulus of the films of the stored cells [Pa]
BLOCK_PA = 12e6  # the same of the block that stored cells were pressed with: the usual tip's [Pa]
SOLVED_RATIO = 0.4999  # Poisson's ratio of all materials of the stored cells [-]
SOLVED_PERMITTIVITY = {"x60": 4.68, "air": 1.00059}  # of the same [-]
SOLVED_OF = {(True, "etpu"), (False, "x60")}  # their bodies: whether they are electrodes, and of what
REACH = 3.0  # factor on its last stress up to which a curve is extrapolated by its last slope [-]
_PA_PER_KPA, _UM_PER_M = 1e3, 1e6
_SAME = 1e-6  # difference up to which two parameters are one, relative of moduli
_STIFF = 1e-3  # decay below which a plate counts as incompressible: 4e-7 of the modulus [-]
_NODES = np.array([0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25])  # of an average, over its last pressure
_BEND = 1e-6  # share of a straight continuation over which a curve takes its slope [-]
_EARLY = np.array([1 / 16, 1 / 4])  # of the first stress: knots of a curve that begins with a power of the stress


@dataclass(frozen=True)
class Plate:
    r"""A linearly elastic plate: capacitive strain = stress / modulus (thesis B.49).

    Attributes
    ----------
    name, source : str
        Name of the law, and its source.
    modulus_pa : float
        Stress per strain [Pa].

    Examples
    --------
    >>> [float(value) for value in Plate("free", "B.49", 6e6).capacitive_strain(np.asarray(60e3))]
    [0.01, 1.6666666666666668e-07]
    """

    name: str
    source: str
    modulus_pa: float

    def capacitive_strain(self, stress_pa: Real) -> tuple[Real, Real]:
        """Capacitive strain [-] and its derivative [1/Pa]; OutOfRange from 1 on, where the electrodes touch."""
        share = stress_pa / self.modulus_pa
        if np.any(share >= 1):
            raise OutOfRange(f"the stress thins the film by {np.max(share):.3g}: at 1 its electrodes touch (Eq. B.49)")
        return share, np.full_like(share, 1 / self.modulus_pa)

    def foundation_stiffness_pa_per_m(self, gap_m: float) -> float:
        """Pressure per displacement of the top [Pa/m], for a gap between the electrodes [m]."""
        return self.modulus_pa / gap_m

    def scaled_modulus(self, factor: float) -> "Plate":
        """Plate with its Young's modulus multiplied by a factor."""
        return replace(self, modulus_pa=self.modulus_pa * factor)

    def doubt(self, stress_pa: float) -> str:  # noqa: ARG002 - a law has no last point
        """Remark on a stress [Pa]: none."""
        return ""


@dataclass(frozen=True)
class CapacitanceCurve:
    """Capacitance versus stress: monotone cubic Hermite interpolation between points.

    Attributes
    ----------
    name, source : str
        Name of the law, and its source.
    stress_pa, ratio, slope_per_pa : tuple of float
        Stress from 0 on [Pa]; C'(stress)/C'(0) [-], from 1 on, and its derivative [1/Pa].
    within : float
        Relative error of the rise [-].
    stiff_change : float
        Relative change of the rise under a stiff plate, from that under an even pressure [-].
    block_changes : tuple of float
        The same under the usual block, at each stress above 0, or one for all [-]; empty where it was not solved.
    boundary_changes : tuple of float
        Relative changes of the rise under other boundary and contact conditions of this cell [-].
    displacement_m : float or None
        Of the top at the last stress [m]; None if unknown.
    doubts : tuple of str
        What its solution is to be doubted for.
    onset : float
        Factor on the distance from 1 of the power of the stress with which the curve begins [-].

    Examples
    --------
    >>> law = curve("example", "made up", [0.0, 5e4, 1e5], [1.0, 1.25, 2.0])
    >>> [round(float(value), 6) for value in law.capacitive_strain(np.asarray(1e5))]
    [0.5, 5e-06]
    """

    name: str
    source: str
    stress_pa: tuple[float, ...]
    ratio: tuple[float, ...]
    slope_per_pa: tuple[float, ...]
    within: float = 0.0
    stiff_change: float = 0.0
    block_changes: tuple[float, ...] = ()
    boundary_changes: tuple[float, ...] = ()
    displacement_m: float | None = None
    onset: float = 1.0
    doubts: tuple[str, ...] = ()

    def capacitive_strain(self, stress_pa: Real) -> tuple[Real, Real]:
        """Capacitive strain [-] and its derivative [1/Pa]; OutOfRange below 0 and far beyond the last point."""
        last = self.stress_pa[-1]
        if np.any(stress_pa < 0):
            raise OutOfRange(f"a stress of {np.min(stress_pa):.3g} Pa pulls; the curve {self.name!r} begins at 0")
        if np.any(stress_pa > REACH * last):
            raise OutOfRange(
                f"a stress of {np.max(stress_pa):.4g} Pa; the curve {self.name!r} ends at {last:.4g} Pa and is "
                f"extended up to {REACH:g} times that: press less, or with a larger tip"
            )
        # C'/C'(0) - 1, accurate for small stresses too [-], and its derivative [1/Pa]
        starts, *pieces = self._cubics
        k = np.clip(np.searchsorted(starts, stress_pa, side="right") - 1, 0, None)
        h, before, linear, quadratic, cubic = (piece[k] for piece in pieces)
        inside = np.minimum(stress_pa, self.stress_pa[-1])
        t = (inside - starts[k]) / h
        value = before + t * (linear + t * (quadratic + t * cubic))
        slope = (linear + t * (2 * quadratic + 3 * t * cubic)) / h
        rise = value + (stress_pa - inside) * self.slope_per_pa[-1]
        return rise / (1 + rise), slope / (1 + rise) ** 2

    def foundation_stiffness_pa_per_m(self, gap_m: float) -> float:  # noqa: ARG002 - the cell's own height is in it
        """Pressure per displacement of the top up to the last stress [Pa/m]; MissingValue if this is unknown."""
        if self.displacement_m is None:
            raise MissingValue(f"the curve {self.name!r} does not give the displacement of the top")
        return self.stress_pa[-1] / self.displacement_m

    def scaled_modulus(self, factor: float) -> "CapacitanceCurve":
        """Cell with all Young's moduli multiplied by a factor: stresses scale."""
        return replace(
            self,
            stress_pa=tuple(p * factor for p in self.stress_pa),
            slope_per_pa=tuple(m / factor for m in self.slope_per_pa),
        )

    def scaled_rise(self, factor: float) -> "CapacitanceCurve":
        """Curve with its rise C/C(0) - 1 multiplied by a factor."""
        return replace(
            self,
            ratio=tuple(1 + (g - 1) * factor for g in self.ratio),
            slope_per_pa=tuple(m * factor for m in self.slope_per_pa),
        )

    def under_block(self, *, usual: bool) -> "CapacitanceCurve":
        """The cell under a block on its top; one that is not the usual lies between even pressure and stiff plate."""
        if not (usual and self.block_changes):
            half = self.stiff_change / 2
            return replace(self.scaled_rise(1 + half), within=self.within + abs(half))
        ratio = 1 + (np.array(self.ratio) - 1) * np.append(1.0, 1 + np.resize(self.block_changes, len(self.ratio) - 1))
        slopes = _slopes(np.array(self.stress_pa), ratio)
        return replace(self, ratio=tuple(ratio.tolist()), slope_per_pa=tuple(slopes.tolist()))

    def doubt(self, stress_pa: float) -> str:
        """Remark on a stress beyond the last point [Pa]."""
        last = self.stress_pa[-1]
        return f"above {last / _PA_PER_KPA:g} kPa the curve is extended by its last slope" if stress_pa > last else ""

    @cached_property
    def _cubics(self) -> tuple[Real, ...]:
        """Start and length of each piece [Pa], and its coefficients in powers of the share of that length."""
        p, r, m = self._knots()
        h, rise = np.diff(p), np.diff(r)
        return p[:-1], h, r[:-1], h * m[:-1], 3 * rise - h * (2 * m[:-1] + m[1:]), h * (m[:-1] + m[1:]) - 2 * rise

    def _knots(self) -> tuple[Real, Real, Real]:
        """Knots of the cubics: stress [Pa], rise [-] and slope [1/Pa].

        Concave data mean contact from zero load: a power law below the first load, where a cubic starts too flat.
        """
        p, r, m = np.asarray(self.stress_pa), np.asarray(self.ratio) - 1, np.asarray(self.slope_per_pa)
        power = 1 - self.onset * (1 - m[1] * p[1] / r[1])
        if not 0 < power < 1:
            return p, r, m
        early, begun = p[1] * _EARLY, r[1] * _EARLY**power
        slope = power * begun / early
        first = (2 - power) * begun[0] / early[0]  # a parabola to the first of them
        return np.insert(p, 1, early), np.insert(r, 1, begun), np.concatenate([[first], slope, m[1:]])


Compression = Plate | CapacitanceCurve


def unconfined(youngs_modulus_pa: float) -> Plate:
    """A plate that is free to expand sideways: the softest case (thesis B.49)."""
    return Plate("unconfined", "thesis B.49: strain = stress / E, free to expand sideways", youngs_modulus_pa)


def bonded(youngs_modulus_pa: float, width_m: float, thickness_m: float, bulk_pa: float = np.inf) -> Plate:
    r"""A long plate bonded to stiff faces: the stiffest case.

    .. math:: \frac{\sigma}{\varepsilon} = \frac{4}{3} E + K \left(1 - \frac{\tanh \lambda}{\lambda}\right),
              \quad \lambda = \frac{W}{d} \sqrt{\frac{E}{K}}

    Parameters
    ----------
    youngs_modulus_pa, width_m, thickness_m : float
        E [Pa]; W and d [m].
    bulk_pa : float
        K; infinite for an incompressible plate [Pa].

    Notes
    -----
    Chalhoub and Kelly, J. Eng. Mech. 117, 1961 (1991), plane strain. Incompressible it is Gent and Lindley, Proc. Inst.
    Mech. Eng. 173, 111 (1959): :math:`\frac{4}{3} E (1 + S^2)`, S = W / 2d. Electrodes that the film stretches:
    :mod:`sensorgen.models.sandwich`.

    Examples
    --------
    >>> round(bonded(1.0, 10e-3, 0.6e-3).modulus_pa, 1)
    93.9
    >>> round(bonded(6e6, 10e-3, 0.6e-3, 1e10).modulus_pa / 6e6, 1)
    88.1
    """
    e = youngs_modulus_pa
    decay = width_m / thickness_m * (e / bulk_pa) ** 0.5
    film = e * (width_m / thickness_m) ** 2 / 3 if decay < _STIFF else bulk_pa * (1 - np.tanh(decay) / decay)
    stiffer = 4 / 3 + float(film) / e
    return Plate("bonded", f"bonded to stiff faces: {stiffer:.4g} E", stiffer * e)


def symmetric(youngs_modulus_pa: float, poisson_ratio: float) -> Plate:
    """A plate that its neighbours keep from widening: the modulus of one of unlimited cells, (K + 4 G / 3) [Pa].

    >>> round(symmetric(6e6, 0.4999).modulus_pa / 1e10, 3)
    1.0
    """
    nu = poisson_ratio
    if not 0 <= nu < 0.5:
        raise OutOfRange(f"a Poisson's ratio of {nu:g}, and sides that do not move: expected one from 0, below 0.5")
    modulus = youngs_modulus_pa * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    return Plate("symmetric", f"no sideways expansion: {modulus / youngs_modulus_pa:.4g} E", modulus)


def curve(name: str, source: str, stress_pa: Sequence[float], ratio: Sequence[float]) -> CapacitanceCurve:
    """A curve through points, its slopes by the monotone rule of Fritsch and Butland.

    Parameters
    ----------
    name, source : str
        Name of the law, and its source.
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
    return CapacitanceCurve(name, source, tuple(p.tolist()), tuple(g.tolist()), tuple(_slopes(p, g).tolist()))


def averaged(law: Compression, shares: Callable[[float], Real], last_pa: float) -> CapacitanceCurve:
    """The law of a sensor with uneven pressure over its width: parts beside each other, each at its own pressure.

    Parameters
    ----------
    law : Compression
        Of each part.
    shares : function
        Pressures of equal parts over their mean (n,) [-], by that mean [Pa].
    last_pa : float
        Last mean pressure [Pa].

    Raises
    ------
    OutOfRange
        The highest pressure is beyond the law.
    """
    stress = last_pa * _NODES
    ratio = [float(np.mean(1 / (1 - law.capacitive_strain(shares(p) * p)[0]))) for p in stress[1:].tolist()]
    return curve(f"{law.name}, averaged", law.source, stress.tolist(), [1.0, *ratio])


def beyond(law: Compression, mean_pa: float, shares: Callable[[float], Real]) -> tuple[Compression, ...]:
    """Bounds of a law up to the highest local pressure; the law alone where it reaches that far.

    The rise of a cell whose gaps close flattens: it lies between none beyond the last point, and its last slope.

    Parameters
    ----------
    law, shares
        As of :func:`averaged`.
    mean_pa : float
        Mean pressure [Pa].
    """
    most_pa = float(max((shares(p) * p).max() for p in mean_pa * _NODES[1:]))
    if isinstance(law, Plate) or most_pa <= REACH * law.stress_pa[-1]:
        return (law,)
    return tuple(extended(law, most_pa, by) for by in (0.0, law.slope_per_pa[-1]))


def extended(law: CapacitanceCurve, most_pa: float, slope_per_pa: float) -> CapacitanceCurve:
    """Curve with a straight line from its last point to a pressure [Pa], its rise by that slope [1/Pa]."""
    last_pa, down = law.stress_pa[-1], law.displacement_m
    bend_pa = _BEND * (most_pa - last_pa)  # a steep line that began at the last point would bend the cubic before it
    rises = (slope_per_pa * bend_pa, slope_per_pa * (most_pa - last_pa))
    return replace(
        law, stress_pa=(*law.stress_pa, last_pa + bend_pa, most_pa),
        ratio=(*law.ratio, *(law.ratio[-1] + rise for rise in rises)),
        slope_per_pa=(*law.slope_per_pa, slope_per_pa, slope_per_pa),
        displacement_m=None if down is None else down * most_pa / last_pa,
    )  # fmt: skip


def curve_of(pressed: "Pressed") -> CapacitanceCurve:
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
    return curve("solved", pressed.source, [float(p) for p, _ in known], ratio)


def _slopes(p: Real, g: Real) -> Real:
    """Harmonic means within (Fritsch and Butland, 1984), one-sided parabolas at the ends, at least 0.

    As SciPy's PCHIP, whose import takes longer than a whole prediction.
    """
    h, s = np.diff(p), np.diff(g) / np.diff(p)
    if len(s) == 1:
        return np.repeat(s, 2)
    w1, w2 = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    inner = (w1 + w2) / (w1 / s[:-1] + w2 / s[1:])
    ends = [((2 * h[i] + h[j]) * s[i] - h[i] * s[j]) / (h[i] + h[j]) for i, j in ((0, 1), (-1, -2))]
    return np.array([max(ends[0], 0.0), *inner, max(ends[1], 0.0)])


def solved(
    shape: str, parameters: Mapping[str, Any], youngs_modulus_pa: Mapping[str, float]
) -> CapacitanceCurve | None:
    """The stored curve of a cell, or None if this cell is not stored.

    Parameters
    ----------
    shape : str
        Name of the shape.
    parameters : mapping
        Its parameters; one that is not given is that of the stored cell.
    youngs_modulus_pa : mapping of str to float
        By material [Pa]. The stress scales with them, as long as their ratio is that of the solved cell.
    """
    for cell in _read("solved_cells.yaml")["cells"]:
        moduli = cell["youngs_modulus_pa"]
        factors = [youngs_modulus_pa.get(name, 0.0) / modulus for name, modulus in moduli.items()]
        same = all(abs(parameters.get(k, v) - v) < _SAME for k, v in cell["parameters"].items())
        if cell["shape"] == shape and same and min(factors) > 0 and max(factors) / min(factors) - 1 < _SAME:
            return _curve(cell, factors[0])
    return None


def solved_print(content: str, youngs_modulus_pa: Mapping[str, float]) -> CapacitanceCurve | None:
    """The stored curve of a printed cell, by the identity of its cross-section, for the same moduli [Pa]; else None."""
    cells = _read("solved_prints.yaml")
    cell = cells["cells"].get(content)
    return _curve(cells | cell, 1.0) if cell and cells["youngs_modulus_pa"] == dict(youngs_modulus_pa) else None


def prototype(shape: str) -> CapacitanceCurve:
    """The first stored curve of a shape, for films of ``PROTOTYPE_PA``: an estimate for similar cells."""
    return _curve(next(cell for cell in _read("solved_cells.yaml")["cells"] if cell["shape"] == shape), 1.0)


def _curve(cell: Mapping[str, Any], scale: float) -> CapacitanceCurve:
    """A stored cell's curve, its moduli multiplied by a factor."""
    stress = [kpa * _PA_PER_KPA * scale for kpa in cell["stress_kpa"]]
    solved_curve = curve("solved", cell["source"], stress, [1 + percent / 100 for percent in cell["rise_percent"]])
    changes, block = dict(cell.get("held", {})), cell.get("block", ()) if abs(scale - 1) < _SAME else ()
    return replace(
        solved_curve, within=cell["within"], stiff_change=cell["stiff"], block_changes=tuple(block),
        boundary_changes=tuple(changes.values()), displacement_m=cell["displacement_um"] / _UM_PER_M,
        doubts=tuple(cell.get("doubts", ())),
    )  # fmt: skip


@cache
def _read(file: str) -> dict[str, Any]:
    return yamlfile.parse((resources.files("sensorgen.models") / file).read_text("utf-8"), file)
