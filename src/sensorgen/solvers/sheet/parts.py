"""Parts of a sheet: the film between two resistive sheets, contacts, a pressed patch; each checked at birth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.core.units import M_PER_MM

SIDES = ("top", "bottom")
EDGES = ("left", "right", "front", "back")
ROUNDING = 1e-9  # of a side: lines closer than this are one


@dataclass(frozen=True)
class Sheet:
    """Two resistive sheets with a film between them; x runs along the length, y along the width.

    Attributes
    ----------
    length_m, width_m : float
        Outline [m].
    sheet_resistance_ohm : tuple of float
        Resistivity over thickness of the top and of the bottom sheet [ohm], per square; 0 is a perfect conductor.
    capacitance_f_per_m2 : float or (m, k) array
        Of the film, not pressed [F/m2]; an array holds its value on m by k equal rectangles along x and y.
    leak_s_per_m2 : float
        Conductance of the film at any frequency, the same under a press [S/m2].
    tan_delta : float
        Loss tangent of the film [-].
    """

    length_m: float
    width_m: float
    sheet_resistance_ohm: tuple[float, float]
    capacitance_f_per_m2: float | Real
    leak_s_per_m2: float = 0.0
    tan_delta: float = 0.0

    def __post_init__(self) -> None:
        for name in ("length_m", "width_m"):
            check(name, getattr(self, name), above=True)
        if len(self.sheet_resistance_ohm) != len(SIDES):
            raise BadInput("sheet_resistance_ohm takes two numbers, of the top and of the bottom sheet")
        for end, value in zip(SIDES, self.sheet_resistance_ohm, strict=True):
            check(f"sheet_resistance_ohm of the {end} sheet", value)
        for name in ("leak_s_per_m2", "tan_delta"):
            check(name, getattr(self, name))
        for value in self.capacitances().flat:
            check("capacitance_f_per_m2", float(value))

    def capacitances(self) -> Real:
        """Capacitance per area on a grid of equal rectangles, one where it is uniform [F/m2]."""
        grid = np.asarray(self.capacitance_f_per_m2)
        if grid.dtype.kind not in "iuf" or grid.ndim not in (0, 2) or not grid.size:
            raise BadInput("capacitance_f_per_m2 takes a number, or an array with one row per step along x")
        return np.atleast_2d(grid).astype(float)

    def edge(self, side: str, name: str, start_m: float = 0.0, stop_m: float | None = None) -> "Contact":
        """Contact along an edge, or along a stretch of it.

        Parameters
        ----------
        side : str
            "top" or "bottom" sheet.
        name : str
            "left" (x = 0), "right", "front" (y = 0) or "back".
        start_m, stop_m : float
            Where along the edge it starts and stops [m]; all of it unless given.

        Examples
        --------
        >>> Sheet(0.1, 0.05, (900.0, 900.0), 7e-8).edge("top", "right")
        Contact(side='top', x_m=(0.1, 0.1), y_m=(0.0, 0.05))
        """
        if name not in EDGES:
            raise UnknownName("edge", name, EDGES)
        along_y = name in ("left", "right")
        stretch = (start_m, (self.width_m if along_y else self.length_m) if stop_m is None else stop_m)
        at = {"left": 0.0, "front": 0.0, "right": self.length_m, "back": self.width_m}[name]
        return Contact(side, (at, at), stretch) if along_y else Contact(side, stretch, (at, at))


@dataclass(frozen=True)
class Contact:
    """A perfect conductor on one sheet: a rectangle, or the line that remains where one of its sides is 0.

    Attributes
    ----------
    side : str
        "top" or "bottom".
    x_m, y_m : tuple of float
        Where it starts and stops along length and width [m].
    """

    side: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]

    def __post_init__(self) -> None:
        if self.side not in SIDES:
            raise UnknownName("side of a contact", self.side, SIDES)
        for start, stop in (self.x_m, self.y_m):
            if not start <= stop:  # also NaN
                ends = f"{start / M_PER_MM:g} mm and stops at {stop / M_PER_MM:g} mm"
                raise OutOfRange(f"a contact starts at {ends}: give the lower first")
        if self.x_m[0] == self.x_m[1] and self.y_m[0] == self.y_m[1]:
            raise OutOfRange("a contact without length: the resistance to a point is infinite, give it a size")

    def __str__(self) -> str:
        ends = (f"{at / M_PER_MM:g}" for at in (*self.x_m, *self.y_m))
        return "{} contact at x {}..{}, y {}..{} mm".format(self.side, *ends)

    def touches(self, other: "Contact") -> bool:
        """Test whether the two are connected through a common place of one sheet."""
        return self.side == other.side and all(
            a[0] <= b[1] and b[0] <= a[1] for a, b in ((self.x_m, other.x_m), (self.y_m, other.y_m))
        )


Port = tuple[Contact, Contact]


@dataclass(frozen=True)
class SheetPatch:
    """A pressed rectangle.

    Attributes
    ----------
    x_m, y_m : float
        Its left and its front edge [m].
    length_m, width_m : float
        Along x and y [m].
    capacitance_factor : float
        Capacitance per area under it, relative to not pressed [-].
    resistance_factor : tuple of float
        Sheet resistance under it, top and bottom, relative to not pressed [-].
    """

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    capacitance_factor: float = 1.0
    resistance_factor: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        for name in ("x_m", "y_m", "capacitance_factor"):
            check(f"{name} of the patch", getattr(self, name))
        for name in ("length_m", "width_m"):
            check(f"{name} of the patch", getattr(self, name), above=True)
        for value in self.resistance_factor:
            check("resistance_factor of the patch", value, above=True)


def check(name: str, value: Any, *, above: bool = False) -> None:
    """Raise unless a number is finite and 0 or more, or ``above`` 0."""
    if not isinstance(value, (int, float)):  # numpy's float64 is a float
        raise BadInput(f"{name} takes a number in SI units, not {str(value)[:60]!r}")
    if not (math.isfinite(value) and (value > 0 if above else value >= 0)):
        raise OutOfRange(f"{name} has to be {'above 0' if above else '0 or more'} and finite, not {value:g}")


def contacts_of(sheet: Sheet, ports: Sequence[Port]) -> tuple[Contact, ...]:
    """Every contact of the ports once; raises where one lies beyond the sheet, or two are shorted."""
    if not ports:
        raise BadInput("no contact: give one port or more, each a pair of contacts")
    for plus, minus in ports:
        if plus == minus:
            raise OutOfRange(f"a port between the {plus} and itself reads nothing: give two contacts")
    contacts = tuple(dict.fromkeys(contact for port in ports for contact in port))
    for contact in contacts:
        check_inside(f"the {contact}", sheet, contact.x_m, contact.y_m)
    for one, other in combinations(contacts, 2):
        if one.touches(other):
            raise OutOfRange(f"the {one} and the {other} are shorted: keep them apart, or use one for both")
    return contacts


def check_inside(what: str, sheet: Sheet, x_m: tuple[float, float], y_m: tuple[float, float]) -> None:
    """Raise where a contact or a patch reaches beyond the sheet."""
    for axis, (start, stop), size in (("x", x_m, sheet.length_m), ("y", y_m, sheet.width_m)):
        if start < -ROUNDING * size or stop > size * (1 + ROUNDING):
            raise OutOfRange(
                f"{what} reaches from {axis} = {start / M_PER_MM:g} to {stop / M_PER_MM:g} mm, beyond the sheet's 0 to "
                f"{size / M_PER_MM:g} mm"
            )


GRADING = 3.0  # cells at a corner of a contact shrink with this power: above 2, potentials as sqrt(r) cost no order
_TABLE = 4000  # points between which the grading is inverted; any monotone choice of lines will do


@dataclass(frozen=True)
class GridLines:
    """Grid lines along one side [m], from 0 to its length; unknowns sit on the lines."""

    lines_m: Real

    @property
    def steps_m(self) -> Real:
        """Lengths between lines [m]."""
        return np.diff(self.lines_m)

    def nodes(self, start_m: float, stop_m: float) -> NDArray[np.intp]:
        """Lines from ``start_m`` to ``stop_m``, both included."""
        near = ROUNDING * self.lines_m[-1]
        return np.flatnonzero((self.lines_m >= start_m - near) & (self.lines_m <= stop_m + near))

    def below(self, at_m: Real) -> Real:
        """Integral of each node's hat function up to a place, one row per place [m]."""
        t = np.clip((at_m[:, None] - self.lines_m[:-1]) / self.steps_m, 0.0, 1.0)
        integrals = np.zeros((len(at_m), len(self.lines_m)))
        integrals[:, 1:] += self.steps_m * t**2 / 2
        integrals[:, :-1] += self.steps_m * t * (1 - t / 2)
        return integrals

    def hats(self, at_m: Real) -> Real:
        """Each node's hat function at a place, one row per place [-]."""
        k = np.clip(np.searchsorted(self.lines_m, at_m, side="right") - 1, 0, len(self.steps_m) - 1)
        t = (at_m - self.lines_m[k]) / self.steps_m[k]
        values = np.zeros((len(at_m), len(self.lines_m)))
        rows = np.arange(len(at_m))
        values[rows, k], values[rows, k + 1] = 1 - t, t
        return values


def axes(sheet: Sheet, contacts: Sequence[Contact], cells: int) -> tuple[GridLines, GridLines]:
    """Lines along x and y: on every border of a contact, and ever closer towards its corners.

    Parameters
    ----------
    sheet : Sheet
        Its outline decides how many cells the shorter side gets: with the square root of the ratio of the sides.
    contacts : sequence of Contact
        Whose borders become lines.
    cells : int
        Along the longer side, about: each stretch between borders takes one or more [-].

    Returns
    -------
    tuple of Axis
        Along x and along y.
    """
    sizes = (sheet.length_m, sheet.width_m)
    borders = ([b for c in contacts for b in c.x_m], [b for c in contacts for b in c.y_m])
    corners = [_corners(sheet, c) for c in contacts]
    x, y = (
        _lines(size, ends, {at for pair in corners for at in pair[k]}, round(cells * (size / max(sizes)) ** 0.5))
        for k, (size, ends) in enumerate(zip(sizes, borders, strict=True))
    )
    return GridLines(x), GridLines(y)


def _corners(sheet: Sheet, contact: Contact) -> tuple[list[float], list[float]]:
    """Along x and y, the corners of a contact where current crowds without bound.

    Inside the sheet every corner is one. On an edge of the sheet the potential is smooth where the contact stands
    upright on it, and not where it lies along it.
    """
    x, y = _ends(contact.x_m, sheet.length_m), _ends(contact.y_m, sheet.width_m)
    return (x, y) if x and y else ([], [])


def _ends(span: tuple[float, float], size: float) -> list[float]:
    """Ends of a span that are inside a size; of a span that is a single place, this place."""
    inside = [at for at in span if ROUNDING * size < at < (1 - ROUNDING) * size]
    return inside or ([span[0]] if span[0] == span[1] else [])


def _lines(size: float, borders: list[float], corners: set[float], cells: int) -> Real:
    fixed = np.unique(np.clip([0.0, size, *borders], 0.0, size))
    fixed = fixed[np.append(True, np.diff(fixed) > ROUNDING * size)]
    fixed[-1] = size
    spread = _crowding(fixed, size, corners)
    total = spread[-1] - spread[0]
    parts = []
    for start, stop, low, high in zip(fixed[:-1], fixed[1:], spread[:-1], spread[1:], strict=True):
        # Places from start to stop, dense at both, so that the crowding can be inverted by interpolation
        t = np.linspace(0.0, 1.0, _TABLE)
        places = np.asarray(start + (stop - start) * t**4 * (35 - 84 * t + 70 * t**2 - 20 * t**3))
        count = max(1, round(cells * (high - low) / total))
        parts.append(np.interp(np.linspace(low, high, count + 1), _crowding(places, size, corners), places)[:-1])
    return np.append(np.concatenate(parts), size)


def _crowding(at: Real, size: float, corners: set[float]) -> Real:
    """Number of lines before a place, up to a factor."""
    lines = at / size
    for corner in sorted(corners):
        away = (at - corner) / size
        lines = lines + np.sign(away) * np.abs(away) ** (1 / GRADING)
    return np.asarray(lines)


def folds(ports: Sequence[Port], patch: SheetPatch | None) -> bool:
    """Test whether the currents in both sheets are opposite everywhere, so that only u_t - u_b counts.

    They are where every port joins two contacts that face each other, and the resistances have one ratio everywhere.
    """
    facing = all((plus.x_m, plus.y_m) == (minus.x_m, minus.y_m) for plus, minus in ports)
    return facing and (patch is None or patch.resistance_factor[0] == patch.resistance_factor[1])


def fold(sheet: Sheet) -> tuple[Sheet, dict[str, tuple[str, float]]]:
    """The folded sheet; and, by each factor of resistance, what derivative of it is which share of the folded one's."""
    top, bottom = sheet.sheet_resistance_ohm
    both = top + bottom
    shares = {
        f"{side}_resistance_factor": ("top_resistance_factor", ohm / both if both else 0.0)
        for side, ohm in (("top", top), ("bottom", bottom))
    }
    return replace(sheet, sheet_resistance_ohm=(both, 0.0)), shares
