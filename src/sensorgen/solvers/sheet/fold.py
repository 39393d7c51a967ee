"""A sheet whose contacts face each other is one sheet over a perfect conductor: half of the unknowns."""

from collections.abc import Sequence
from dataclasses import replace

from sensorgen.solvers.sheet.parts import Patch, Port, Sheet


def folds(ports: Sequence[Port], patch: Patch | None) -> bool:
    """Whether the currents in both sheets are opposite everywhere, so that only u_t - u_b counts.

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
