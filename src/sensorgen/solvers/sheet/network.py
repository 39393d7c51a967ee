"""A sheet as a network: which nodes its links join, how well they conduct, and how that follows a moving patch."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.solvers.sheet.parts import SIDES, Contact, GridLines, Port, Sheet, SheetPatch

Index = NDArray[np.intp]

BY = ("x_m", "y_m", "capacitance_factor", "top_resistance_factor", "bottom_resistance_factor")


@dataclass(frozen=True)
class SheetLinks:
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


def links(sheet: Sheet, axes: tuple[GridLines, GridLines], patch: SheetPatch | None) -> SheetLinks:
    """The network of a sheet on a grid, pressed or not."""
    places = np.arange(len(axes[0].lines_m) * len(axes[1].lines_m)).reshape(len(axes[0].lines_m), -1)
    pairs = (places[:-1], places[1:]), (places[:, :-1], places[:, 1:])
    ends = [[2 * pair[k].ravel() + side for side in range(2) for pair in pairs] for k in range(2)]
    film = 2 * places.ravel()
    joined = np.array([np.concatenate([*ends[0], film]), np.concatenate([*ends[1], film + 1])])

    leak, capacitance, by_film = _film(sheet, axes, patch)
    ways = [_one_way(sheet, axes, along, patch, side) for side in range(2) for along in range(2)]
    conductance = np.concatenate([value for value, _ in ways])
    none, dead = np.zeros(len(film)), np.zeros(len(conductance))
    slopes = {}
    for name in BY if patch else ():
        by_sheet = np.concatenate([by.get(name, 0 * value) for value, by in ways])
        slopes[name] = np.array([np.append(by_sheet, none), np.append(dead, by_film.get(name, none))])
    return SheetLinks(joined, np.append(conductance, leak), np.append(dead, capacitance), slopes)


def _film(
    sheet: Sheet, axes: tuple[GridLines, GridLines], patch: SheetPatch | None
) -> tuple[Real, Real, dict[str, Real]]:
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

    def __init__(self, axis: GridLines, count: int, start_m: float, stop_m: float) -> None:
        """Cut the axis's length into ``count`` steps and clip them to ``start_m .. stop_m``."""
        edges = np.linspace(0.0, axis.lines_m[-1], count + 1)
        clipped = np.clip(edges, start_m, stop_m)
        moving = ((edges < start_m) | (edges > stop_m))[:, None]
        moving[0], moving[-1] = True, True  # the patch ends there, though rounding may say that it reaches the edge
        self.whole = np.diff(axis.below(clipped), axis=0)
        self.slope = np.diff(axis.hats(clipped) * moving, axis=0)


def _along(axis: GridLines, start_m: float, stop_m: float) -> tuple[Real, Real]:
    """Share of each step that lies between two places [-], and its derivative when both move on [1/m].

    Weighed by hats over the middles of the steps, where the current is known, for the same reason as :class:`Span`.
    """
    lines = axis.lines_m
    middles = GridLines(np.concatenate([lines[:1], (lines[1:] + lines[:-1]) / 2, lines[-1:]]))
    span = Span(middles, 1, start_m, stop_m)
    whole = _folded(middles.below(lines[[0, -1]])[1])
    return _folded(span.whole[0]) / whole, _folded(span.slope[0]) / whole


def _folded(values: Real) -> Real:
    """Give the values of the axis's two ends to the steps next to them."""
    found = values[1:-1].copy()
    found[0] += values[0]
    found[-1] += values[-1]
    return found


def _one_way(
    sheet: Sheet, axes: tuple[GridLines, GridLines], along: int, patch: SheetPatch | None, side: int
) -> tuple[Real, dict[str, Real]]:
    """Conductance of the links along one axis [S], squares in parallel over squares in series, and its derivatives.

    Under a patch the link is cut lengthwise: beside the patch it is as it was, and under it two parts are in series.
    """
    ahead, across = axes[along], axes[1 - along]
    widths = across.below(across.lines_m[[0, -1]])[1]
    squares = widths[None, :] / ahead.steps_m[:, None]

    ohm = sheet.sheet_resistance_ohm[side]

    def turn(values: Real) -> Real:
        turned = np.asarray(values if along == 0 else values.T).ravel()
        return turned / ohm if ohm else 0 * turned  # a perfect conductor's links do not matter

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


@dataclass(frozen=True)
class Network:
    """Nodes merged where a conductor joins them; both sheets have a node of reference, which is no unknown.

    Attributes
    ----------
    ends : (2, n) array
        Unknown at both ends of each link, -1 at a reference.
    film : slice
        The links through the film, from top to bottom.
    drive : (unknowns, ports) array
        Current into each unknown for 1 A through each port [-].
    crossing : (ports,) array
        What of that 1 A goes from the top to the bottom sheet: 1, -1, or 0 between contacts of one sheet.
    """

    ends: Index
    film: slice
    drive: Real
    crossing: Real

    def solve(self, admittance_s: Complex) -> tuple[Complex, Complex]:
        r"""Impedance matrix [ohm], and the voltage along each link for 1 A through each port.

        The voltage alpha between the references and the voltages w to them, h = S^-1 g per volt of alpha, obey

        .. math:: S w + \alpha g = b, \quad g^T w + \alpha Y = c, \quad
                  Z_{pq} = \alpha_p \alpha_q (Y - g^T h) + b_p^T S^{-1} b_q

        S has no small eigenvalue however little the film conducts, so that Re Z keeps all its digits, and no current
        through the film is a case like any other: alpha is then infinite, or nothing for ports within one sheet.
        """
        y = admittance_s[self.film]
        a, b = self.ends[:, self.film]
        border = np.zeros(len(self.drive) + 1, complex)  # the last takes what belongs to a reference
        np.add.at(border, a, y)
        np.add.at(border, b, -y)
        border = border[:-1]
        solved = self._inverse(admittance_s, np.column_stack([self.drive, border]))
        w, h = solved[:, :-1], solved[:, -1]
        through = self.crossing - border @ w
        total = y.sum() - border @ h
        if total == 0:
            alpha, z = np.zeros(len(self.crossing)), self.drive.T @ w
            z[np.outer(self.crossing, self.crossing) != 0] = complex(np.inf, 0.0)
        else:
            alpha = through / total
            z = np.outer(alpha, through) + self.drive.T @ w
        potentials = w - np.outer(h, alpha)
        padded = np.vstack([potentials, np.zeros((1, potentials.shape[1]))])
        along = np.asarray(padded[self.ends[0]] - padded[self.ends[1]])
        along[self.film] += alpha
        return z, along

    def _inverse(self, admittance_s: Complex, right: Complex) -> Complex:
        if not len(right):
            return right
        from scipy.sparse import csc_matrix
        from scipy.sparse.linalg import splu

        a, b = self.ends
        inner = (a >= 0) & (b >= 0) & (a != b)
        at_a, at_b = (a >= 0) & (a != b), (b >= 0) & (a != b)
        y = admittance_s
        rows = np.concatenate([a[at_a], b[at_b], a[inner], b[inner]])
        columns = np.concatenate([a[at_a], b[at_b], b[inner], a[inner]])
        values = np.concatenate([y[at_a], y[at_b], -y[inner], -y[inner]])
        matrix = csc_matrix((values, (rows, columns)), shape=(len(right), len(right)))
        factors: Any = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
        )
        return np.asarray(factors.solve(right))


def network(
    sheet: Sheet, axes: tuple[GridLines, GridLines], contacts: Sequence[Contact], ports: Sequence[Port], of: SheetLinks
) -> Network:
    """Merge nodes under contacts and on perfectly conducting sheets, and number what is left."""
    count = 2 * len(axes[0].lines_m) * len(axes[1].lines_m)
    joined = np.arange(count)
    places = {}
    for contact in contacts:
        x, y = axes[0].nodes(*contact.x_m), axes[1].nodes(*contact.y_m)
        places[contact] = 2 * (x[:, None] * len(axes[1].lines_m) + y).ravel() + SIDES.index(contact.side)
    for nodes in places.values():
        joined[nodes] = nodes[0]
    for side, ohm in enumerate(sheet.sheet_resistance_ohm):
        if ohm == 0:
            joined[side::2] = side
    # a node under a contact of each sheet, or its first node where it has none
    first = [next((int(places[c][0]) for c in contacts if c.side == SIDES[k]), k) for k in range(2)]
    kept, label = np.unique(joined, return_inverse=True)
    references = label[first]
    number = np.full(len(kept), -1)
    free = np.setdiff1d(np.arange(len(kept)), references)
    number[free] = np.arange(len(free))
    unknown = number[label]

    drive, crossing = np.zeros((len(free) + 1, len(ports))), np.zeros(len(ports))
    for p, port in enumerate(ports):
        for contact, sign in zip(port, (1.0, -1.0), strict=True):
            drive[unknown[places[contact][0]], p] += sign
            crossing[p] += sign * (contact.side == SIDES[0])
    return Network(unknown[of.ends], slice(of.ends.shape[1] - count // 2, None), drive[:-1], crossing)
