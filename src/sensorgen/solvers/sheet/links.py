"""A sheet as a network: which nodes its links join, how well they conduct, and how that follows a moving patch."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.sheet.grid import Axis
from sensorgen.solvers.sheet.parts import SIDES, Patch, Sheet

Real = NDArray[np.float64]
Index = NDArray[np.intp]

BY = ("x_m", "y_m", "capacitance_factor", "top_resistance_factor", "bottom_resistance_factor")


@dataclass(frozen=True)
class Links:
    """Links in a fixed order: those of the top sheet, of the bottom sheet, and through the film.

    Attributes
    ----------
    ends : (2, n) array
        Nodes that each link joins: twice the place on the grid, plus one on the bottom sheet.
    conductance_s : (n,) array
        Of the sheets, and of the film's leak [S].
    capacitance_f : (n,) array
        Of the film [F].
    slopes : dict of str to (2, n) array
        Derivatives of conductance and capacitance by what ``BY`` names, per its unit.
    """

    ends: Index
    conductance_s: Real
    capacitance_f: Real
    slopes: dict[str, Real]


def links(sheet: Sheet, axes: tuple[Axis, Axis], patch: Patch | None) -> Links:
    """The network of a sheet on a grid, pressed or not."""
    places = np.arange(len(axes[0].lines_m) * len(axes[1].lines_m)).reshape(len(axes[0].lines_m), -1)
    pairs = (places[:-1], places[1:]), (places[:, :-1], places[:, 1:])
    ends = [[2 * pair[k].ravel() + side for side in range(2) for pair in pairs] for k in range(2)]
    film = 2 * places.ravel()
    joined = np.array([np.concatenate([*ends[0], film]), np.concatenate([*ends[1], film + 1])])

    leak, capacitance, by_film = _film(sheet, axes, patch)
    conductance, by_sheet = _sheets(sheet, axes, patch)
    none, dead = np.zeros(len(film)), np.zeros(len(conductance))
    slopes = {
        name: np.array([np.append(by_sheet.get(name, dead), none), np.append(dead, by_film.get(name, none))])
        for name in (BY if patch else ())
    }
    return Links(joined, np.append(conductance, leak), np.append(dead, capacitance), slopes)


def _film(sheet: Sheet, axes: tuple[Axis, Axis], patch: Patch | None) -> tuple[Real, Real, dict[str, Real]]:
    """Leak [S] and capacitance [F] at each node, weighed by its hat function, and the derivatives of the latter."""
    c = sheet.capacitances()
    x, y = (Span(axis, n, 0.0, axis.lines_m[-1]) for axis, n in zip(axes, c.shape, strict=True))
    leak = np.outer(x.whole.sum(0), y.whole.sum(0)).ravel() * sheet.leak_s_per_m2
    loose = (x.whole.T @ c @ y.whole).ravel()
    if patch is None:
        return leak, loose, {}
    px = Span(axes[0], c.shape[0], patch.x_m, patch.x_m + patch.length_m)
    py = Span(axes[1], c.shape[1], patch.y_m, patch.y_m + patch.width_m)
    under = (px.whole.T @ c @ py.whole).ravel()
    more = patch.capacitance_factor - 1
    slopes = {
        "x_m": more * (px.slope.T @ c @ py.whole).ravel(),
        "y_m": more * (px.whole.T @ c @ py.slope).ravel(),
        "capacitance_factor": under,
    }
    return leak, loose + more * under, slopes


class Span:
    """Integrals of the hat functions over the part of each of ``count`` equal steps between two places.

    Attributes
    ----------
    whole : (count, nodes) array
        The integrals [m].
    slope : (count, nodes) array
        Their derivatives when both places move on [-]. Hats are continuous, so these are too: the derivative of
        an impedance by position is then as accurate as the impedance, wherever the patch lies between the lines.
    """

    def __init__(self, axis: Axis, count: int, start_m: float, stop_m: float) -> None:
        """Cut the axis's length into ``count`` steps and clip them to ``start_m .. stop_m``."""
        edges = np.linspace(0.0, axis.lines_m[-1], count + 1)
        clipped = np.clip(edges, start_m, stop_m)
        moving = ((edges < start_m) | (edges > stop_m))[:, None]
        moving[0], moving[-1] = True, True  # the patch ends there, though rounding may say that it reaches the edge
        self.whole = np.diff(axis.below(clipped), axis=0)
        self.slope = np.diff(axis.hats(clipped) * moving, axis=0)


def _along(axis: Axis, start_m: float, stop_m: float) -> tuple[Real, Real]:
    """Share of each step that lies between two places [-], and its derivative when both move on [1/m].

    Weighed by hats over the middles of the steps, where the current is known, for the same reason as :class:`Span`.
    """
    lines = axis.lines_m
    middles = Axis(np.concatenate([lines[:1], (lines[1:] + lines[:-1]) / 2, lines[-1:]]))
    span = Span(middles, 1, start_m, stop_m)
    whole = _folded(middles.below(lines[[0, -1]])[1])
    return _folded(span.whole[0]) / whole, _folded(span.slope[0]) / whole


def _folded(values: Real) -> Real:
    """What the two ends of the axis hold, given to the steps next to them."""
    found = values[1:-1].copy()
    found[0] += values[0]
    found[-1] += values[-1]
    return found


def _sheets(sheet: Sheet, axes: tuple[Axis, Axis], patch: Patch | None) -> tuple[Real, dict[str, Real]]:
    """Conductance of the links in both sheets [S], and its derivatives; a perfect conductor's do not matter."""
    found: list[Real] = []
    slopes: dict[str, list[Real]] = {name: [] for name in BY}
    for side, ohm in enumerate(sheet.sheet_resistance_ohm):
        for along in range(2):
            value, by = _one_way(axes, along, patch, side)
            per_ohm = 1 / ohm if ohm else 0.0
            found.append(value * per_ohm)
            for name, parts in slopes.items():
                parts.append(by[name] * per_ohm if name in by else np.zeros(len(value)))
    return np.concatenate(found), {name: np.concatenate(parts) for name, parts in slopes.items()}


def _one_way(axes: tuple[Axis, Axis], along: int, patch: Patch | None, side: int) -> tuple[Real, dict[str, Real]]:
    """Squares in parallel over squares in series, of the links along one axis, and its derivatives.

    Under a patch the link is cut lengthwise: beside the patch it is as it was, and under it two parts are in series.
    """
    ahead, across = axes[along], axes[1 - along]
    widths = across.below(across.lines_m[[0, -1]])[1]
    squares = widths[None, :] / ahead.steps_m[:, None]

    def turn(values: Real) -> Real:
        return np.asarray(values if along == 0 else values.T).ravel()

    if patch is None:
        return turn(squares), {}
    starts, sizes = (patch.x_m, patch.y_m), (patch.length_m, patch.width_m)
    ahead_span = (starts[along], starts[along] + sizes[along])
    beside = Span(across, 1, starts[1 - along], starts[1 - along] + sizes[1 - along])
    length, length_slope = (value[:, None] for value in _along(ahead, *ahead_span))
    width = (beside.whole[0] / widths)[None, :]
    rise = patch.resistance_factor[side] - 1
    series = 1 / (1 + rise * length)
    by_length = -width * rise * series**2 * length_slope
    by_width = (series - 1) * (beside.slope[0] / widths)[None, :]
    names = ("x_m", "y_m")
    by = {
        names[along]: by_length * squares,
        names[1 - along]: by_width * squares,
        f"{SIDES[side]}_resistance_factor": -width * length * series**2 * squares,
    }
    return turn((1 - width + width * series) * squares), {name: turn(value) for name, value in by.items()}
