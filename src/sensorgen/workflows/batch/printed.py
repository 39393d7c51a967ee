"""What is printed of the designs of a plate: one copy of each is read back from the slicer's G-code."""

from collections.abc import Sequence
from typing import Any

from sensorgen.asprinted.printed import body
from sensorgen.core.errors import SensorgenError
from sensorgen.export.slicing import Placed, Sliced
from sensorgen.prediction.as_printed import comparison

CONTACTS_OHM_M2 = (0.0,)  # no source gives another; predict --as-printed shows what others would do


def of_designs(found: Sequence[Placed], made: Sliced) -> dict[str, Any]:
    """Drawn against printed, under each design's hash; why not where a print cannot be read back.

    Parameters
    ----------
    found : sequence of Placed
        The specimens; the first of each design stands for its copies, which the same slicer cuts alike.
    made : Sliced
        Their plate.
    """
    firsts: dict[str, Placed] = {}
    for piece in found:
        firsts.setdefault(piece.design.id(), piece)
    return {key: _of(piece, made) for key, piece in firsts.items()}


def _of(piece: Placed, made: Sliced) -> dict[str, Any]:
    try:
        printed = body(piece.design, made.lines, slicer=f"{made.slicer} {made.version}", centre_mm=piece.sensor_mm())
        return {"specimen": piece.name, **comparison(printed, contacts_ohm_m2=CONTACTS_OHM_M2).as_dict()}
    except SensorgenError as error:
        return {"specimen": piece.name, "design": piece.design.name, "findings": [], "reason": str(error)}
