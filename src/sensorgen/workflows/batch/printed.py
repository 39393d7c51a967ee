"""The prints of the designs of a plate: one copy of each is read from the slicer's G-code."""

import json
from collections.abc import Sequence
from functools import partial
from typing import Any

from sensorgen.asprinted import printed as asprinted
from sensorgen.core.errors import SensorgenError
from sensorgen.export.slicing import Placed, Sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import to_json


def of_designs(found: Sequence[Placed], made: Sliced, content: bytes) -> dict[str, Any]:
    """Prediction, printed volumes and findings of each design's print, by its identity; or why there are none.

    Parameters
    ----------
    found : sequence of Placed
        The specimens; the first of each design stands for its copies, which the same slicer cuts alike.
    made : Sliced
        Their plate.
    content : bytes
        Of its printer-ready G-code.
    """
    firsts: dict[str, Placed] = {}
    for piece in found:
        firsts.setdefault(piece.design.id(), piece)
    return {key: _of(piece, made, content) for key, piece in firsts.items()}


def _of(piece: Placed, made: Sliced, content: bytes) -> dict[str, Any]:
    design, source = piece.design, f"{made.slicer} {made.version}"
    try:
        printed = asprinted.body(design, made.lines, slicer=source, centre_mm=piece.sensor_mm())
        body = bodies.sliced(design, partial(lambda: printed), source, content + piece.name.encode())
        return {
            "specimen": piece.name,
            "design": design.name,
            "prediction": json.loads(to_json(evaluate(body))),
            "layers": [row.as_dict() for row in printed.rows()],
            "findings": [finding.as_dict() for finding in printed.findings()],
        }
    except SensorgenError as error:
        return {"specimen": piece.name, "design": design.name, "findings": [], "reason": str(error)}
