"""Parts of a sheet: the film between two resistive sheets, contacts, a pressed patch; each checked at birth."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName

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
        found = np.asarray(self.capacitance_f_per_m2)
        if found.dtype.kind not in "iuf" or found.ndim not in (0, 2) or not found.size:
            raise BadInput("capacitance_f_per_m2 takes a number, or an array with one row per step along x")
        return np.atleast_2d(found).astype(float)

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
                raise OutOfRange(f"a contact starts at {start:g} m and stops at {stop:g} m: give the lower first")
        if self.x_m[0] == self.x_m[1] and self.y_m[0] == self.y_m[1]:
            raise OutOfRange("a contact without length: the resistance to a point is infinite, give it a size")

    def __str__(self) -> str:
        return "{} contact at x {:g}..{:g}, y {:g}..{:g} m".format(self.side, *self.x_m, *self.y_m)

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
    found = tuple(dict.fromkeys(contact for port in ports for contact in port))
    for contact in found:
        _check_inside(f"the {contact}", sheet, contact.x_m, contact.y_m)
    for one, other in combinations(found, 2):
        if one.touches(other):
            raise OutOfRange(f"the {one} and the {other} are shorted: keep them apart, or use one for both")
    return found


def check_patch(sheet: Sheet, patch: SheetPatch) -> None:
    """Raise where a patch reaches beyond the sheet."""
    x, y = (patch.x_m, patch.x_m + patch.length_m), (patch.y_m, patch.y_m + patch.width_m)
    _check_inside("the pressed patch", sheet, x, y)


def _check_inside(what: str, sheet: Sheet, x_m: tuple[float, float], y_m: tuple[float, float]) -> None:
    for axis, (start, stop), size in (("x", x_m, sheet.length_m), ("y", y_m, sheet.width_m)):
        if start < -ROUNDING * size or stop > size * (1 + ROUNDING):
            raise OutOfRange(
                f"{what} reaches from {axis} = {start:g} to {stop:g} m, beyond the sheet's 0 to {size:g} m"
            )
