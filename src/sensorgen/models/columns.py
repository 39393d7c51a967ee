"""Vertical columns side by side: certified lower bound, and upper bound from the columns' own potential.

Flux that may only run straight up is admissible for Thomson's principle, so the columns in parallel bound the
capacitance from below. Any potential that is right on the electrodes bounds it from above (Dirichlet): we try
the columns' own potential where it has no jumps, and the best potential that depends on the height alone.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.bounds import Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.layers import OverlayPart, overlay_parts
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import ROUNDING_MM, Layer, SectionColumn, sections
from sensorgen.solvers.electrostatics.bounds import third_conductor
from sensorgen.solvers.electrostatics.triangles import energy as straight

SOURCE = "Thesis 3.2.1 and 3.2.2, Eqs. 3.10 to 3.49, corrected; Dirichlet's and Thomson's principles"
COST = 1
WIDTH = inf  # the bounds have the width that they have

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_ROUNDING = 1e-9  # by which exact bounds may seem to cross
_JUMP = 1e-9  # a potential is continuous when its two sides differ by less, of 1 V


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    if reason := third_conductor(scene):
        return reason
    try:
        gaps = [_gap(column) for part in overlay_parts(scene) for column in _distinct(part).values()]
    except ValueError as error:
        return str(error)
    if not all(gaps):
        return "an electrode does not cover the whole sensor"
    floors, roofs = np.array([(gap[0].top_mm, gap[-1].bottom_mm) for gap in gaps]).swapaxes(0, 1)
    if (roofs - floors).min() <= 0:
        return "the electrodes touch: the capacitance grows without bound"
    if floors.max() >= roofs.min() and not _is_one_section(scene):
        return "the electrodes reach into each other, and the scene is no single cross-section"
    return None


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:  # noqa: ARG001
    r"""Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    .. math:: C_{lower} = \varepsilon_0 \int \frac{dA}{s}, \quad s = \sum_k \frac{t_k}{\varepsilon_k}

    .. math:: C_{upper} = \varepsilon_0 \int \varepsilon_r |\nabla u|^2 dV

    with the column potential u, rising by dz / (s eps) in each layer, where it is continuous; or the best u(z), which
    rises between the highest place of the lower electrode and the lowest of the upper one; or, for one section, the
    best u that is straight on each of its triangles: whichever is least.

    Parameters
    ----------
    scene : Scene
        As drawn, for which :func:`why_not_applicable` is None.
    permittivity : mapping of str to float
        Relative permittivity of each material that lies between the electrodes, and of "air" [-].
    width : float
        Not used: the bounds have one width.

    Returns
    -------
    Interval
        Capacitance of the whole sensor [F].

    Raises
    ------
    KeyError
        A material between the electrodes has no permittivity.
    ValueError
        The model does not apply to the scene.
    ArithmeticError
        The bounds have crossed, which no geometry can make them do.
    """
    rows = [_Row.of(part, permittivity) for part in overlay_parts(scene)]
    lower = sum(row.total(_Stack.upright) for row in rows)
    tries = [_level(rows)]
    smooth = len(rows) == 1 and rows[0].is_smooth()
    if smooth:
        tries.append(lower + rows[0].total(_Stack.sideways))
    elif _is_one_section(scene):
        (section,) = sections(scene)
        tries.append(section.depth_mm * straight(section, scene.size_mm[2], permittivity))
    upper = min(tries)
    if upper < lower * (1 - _ROUNDING):
        raise ArithmeticError(f"bounds in the wrong order, {lower} above {upper}: this is a fault of the model")
    return Interval(lower, max(lower, upper)).times(EPS0_F_PER_M * M_PER_MM)


def _is_one_section(scene: Scene) -> bool:
    sections_of = overlay_parts(scene)
    return len(sections_of) == 1 and not sections_of[0].in_plan


def _level(rows: Sequence["_Row"]) -> float:
    r"""Energy of the best potential that depends on the height alone, over eps0 [mm]; infinite where there is none.

    .. math:: C = \varepsilon_0 \left(\sum_k \frac{t_k^2}{\int_k \varepsilon_r dV}\right)^{-1}

    over slabs k of thickness t between the heights at which an interface begins or ends: in each, u rises evenly.
    """
    stacks = [stack for row in rows for stack in row.stacks.values()]
    floor, roof = max(s.heights_mm[0].max() for s in stacks), min(s.heights_mm[-1].min() for s in stacks)
    if floor >= roof:
        return inf
    heights = np.unique(np.concatenate([s.heights_mm.ravel() for s in stacks]).clip(floor, roof))
    levels = heights[np.append(np.diff(heights) > ROUNDING_MM, True)]
    masses = sum(row.total(lambda stack: stack.between(levels)) for row in rows)
    return float(1 / (np.diff(levels) ** 2 / masses).sum())


def _gap(cell: SectionColumn) -> tuple[Layer, ...]:
    """Layers from the uppermost bottom electrode to the lowest top electrode above it; none where one is missing."""
    floors = [k for k, layer in enumerate(cell.layers) if layer.body.terminal == "bottom"]
    roofs = [k for k, layer in enumerate(cell.layers) if layer.body.terminal == "top"]
    return tuple(cell.layers[floors[-1] : roofs[0] + 1]) if floors and roofs and roofs[0] > floors[-1] else ()


@dataclass(frozen=True)
class _Stack:
    """One column's dielectric layers, air included, from bottom to top.

    ``heights_mm`` (n + 1, 2) are the interfaces at the left and right side, ``eps`` (n,) what lies between.
    """

    width_mm: float
    heights_mm: NDArray[np.float64]
    eps: NDArray[np.float64]

    def reduced_mm(self) -> NDArray[np.float64]:
        """Thickness over permittivity up to each interface, (n + 1, 2) [mm]."""
        steps = np.diff(self.heights_mm, axis=0) / self.eps[:, None]
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def upright(self) -> float:
        """Capacitance of vertical flux per depth, over eps0 [-]: the integral of dx / s, s linear in x."""
        left, right = self.reduced_mm()[-1]
        ratio = (right - left) / left
        return float(self.width_mm / left * (np.log1p(ratio) / ratio if abs(ratio) > 1e-12 else 1.0))

    def sideways(self) -> float:
        """Term that the column potential's horizontal field adds to its energy, per depth and over eps0 [-].

        Quadrature in log s, which resolves an apex of any sharpness; exact to rounding for thin films too.
        """
        reduced = self.reduced_mm()
        slopes = np.diff(np.stack([self.heights_mm, reduced]), axis=2)[..., 0] / self.width_mm
        if not slopes.any():
            return 0.0
        share, weight = _graded(reduced[-1, 0], reduced[-1, 1])
        z, q = (m[:, :1] + np.diff(m, axis=1) * share for m in (self.heights_mm, reduced))
        dz, dq = (slope[:, None] for slope in slopes)
        s, ds, eps, t = q[-1], dq[-1], self.eps[:, None], np.diff(z, axis=0)
        steady = (dq[:-1] - dz[:-1] / eps) / s - q[:-1] * ds / s**2
        rising = ds / (eps * s**2)
        energy = eps * (steady**2 * t - steady * rising * t**2 + rising**2 * t**3 / 3)
        return float(self.width_mm * (energy.sum(0) @ weight))

    def between(self, levels_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Area times permittivity between every two neighbouring levels, from the first to the last [mm2]."""
        areas = np.array([np.diff(_mean_min(line, levels_mm)) for line in self.heights_mm])
        return self.width_mm * (self.eps @ np.diff(areas, axis=0))

    def potential(self, side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Heights of the interfaces at one side [mm], and the column potential there [V]."""
        q = self.reduced_mm()[:, side]
        return self.heights_mm[:, side], q / q[-1]


@dataclass(frozen=True)
class _Row:
    """The stacks of a part, equal ones once: ``names`` has the number of each in its order."""

    depth_mm: float
    names: tuple[int, ...]
    stacks: dict[int, _Stack]

    @classmethod
    def of(cls, part: OverlayPart, permittivity: Mapping[str, float]) -> "_Row":
        stacks = {name: _stack(c, permittivity) for name, c in _distinct(part).items()}
        return cls(part.depth_mm, part.looks, stacks)

    def total(self, energy: Callable[[_Stack], Any]) -> Any:
        """Sum of an energy per depth over all stacks, times the depth."""
        return self.depth_mm * sum(times * energy(self.stacks[name]) for name, times in Counter(self.names).items())

    def is_smooth(self) -> bool:
        """Test whether the columns' own potentials agree along all lines between them."""
        for a, b in set(pairwise(self.names)):
            (za, ua), (zb, ub) = self.stacks[a].potential(1), self.stacks[b].potential(0)
            z = np.concatenate([za, zb])
            if np.abs(np.interp(z, za, ua) - np.interp(z, zb, ub)).max() >= _JUMP:
                return False
        return True


def _distinct(part: OverlayPart) -> dict[int, SectionColumn]:
    """The columns of a part, the first of each look, by their number."""
    return {k: part.columns[k] for k in dict.fromkeys(part.looks)}


def _mean_min(ends: NDArray[np.float64], limits: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of min(h, limit) for h running straight between two values, for each limit."""
    low, high = ends.min(), ends.max()
    within = np.clip(limits, low, high)
    return np.minimum(limits, within) - ((within - low) ** 2 / (2 * (high - low)) if high > low else 0.0)


def _graded(left: float, right: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points and weights on 0..1, evenly spread in the logarithm of a value running from left to right."""
    part, weight = (_NODES + 1) / 2, _WEIGHTS / 2
    span = np.log(right / left)
    if abs(span) < 1e-6:
        return part, weight
    value = left * np.exp(span * part)
    return (value - left) / (right - left), weight * value * span / (right - left)


def _stack(cell: SectionColumn, permittivity: Mapping[str, float]) -> _Stack:
    gap = _gap(cell)
    if not gap:
        raise ValueError("an electrode does not cover the whole sensor: ask why_not_applicable() first")
    floor, *between, roof = gap
    lines, eps = [floor.top_mm], []
    layers = [(layer.bottom_mm, layer.top_mm, layer.body.material) for layer in between]
    for bottom, top, material in [*layers, (roof.bottom_mm, roof.bottom_mm, "air")]:
        for line, below in ((bottom, "air"), (top, material)):
            if max(line[0] - lines[-1][0], line[1] - lines[-1][1]) > 0:
                lines.append(line)
                eps.append(permittivity[below])
    return _Stack(cell.right_mm - cell.left_mm, np.array(lines), np.array(eps))
