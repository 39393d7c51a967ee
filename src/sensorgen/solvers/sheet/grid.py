"""Grid lines for a sheet, and exact integrals of what lies between them however it lies."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Real
from sensorgen.solvers.sheet.parts import ROUNDING, Contact, Port, Sheet, SheetPatch

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
        found = np.zeros((len(at_m), len(self.lines_m)))
        found[:, 1:] += self.steps_m * t**2 / 2
        found[:, :-1] += self.steps_m * t * (1 - t / 2)
        return found

    def hats(self, at_m: Real) -> Real:
        """Each node's hat function at a place, one row per place [-]."""
        k = np.clip(np.searchsorted(self.lines_m, at_m, side="right") - 1, 0, len(self.steps_m) - 1)
        t = (at_m - self.lines_m[k]) / self.steps_m[k]
        found = np.zeros((len(at_m), len(self.lines_m)))
        rows = np.arange(len(at_m))
        found[rows, k], found[rows, k + 1] = 1 - t, t
        return found


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
    x = [at for at in contact.x_m if _inside(at, sheet.length_m)]
    y = [at for at in contact.y_m if _inside(at, sheet.width_m)]
    if x and y:
        return x, y
    if contact.y_m[0] == contact.y_m[1] and x:
        return x, [contact.y_m[0]]
    if contact.x_m[0] == contact.x_m[1] and y:
        return [contact.x_m[0]], y
    return [], []


def _inside(at: float, size: float) -> bool:
    return ROUNDING * size < at < (1 - ROUNDING) * size


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
    found = at / size
    for corner in sorted(corners):
        away = (at - corner) / size
        found = found + np.sign(away) * np.abs(away) ** (1 / GRADING)
    return np.asarray(found)


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
