"""The prints of the designs of a plate: one copy of each is read from the slicer's G-code."""

from collections.abc import Sequence

from sensorgen.asprinted import printed as asprinted
from sensorgen.core.errors import SensorgenError
from sensorgen.export.slicing import Placed, Sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import timeless
from sensorgen.workflows.batch.record import PrintedDesign, UnreadDesign


def of_designs(found: Sequence[Placed], made: Sliced, content: bytes) -> dict[str, PrintedDesign | UnreadDesign]:
    """The print of each design, by its identity.

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


def _of(piece: Placed, made: Sliced, content: bytes) -> PrintedDesign | UnreadDesign:
    design, source = piece.design, f"{made.slicer} {made.version}"
    try:
        printed = asprinted.body(design, made.lines, slicer=source, centre_mm=piece.sensor_mm())
        body = bodies.sliced(design, lambda: printed, source, content + piece.name.encode())
        predicted = timeless(evaluate(body))
        return PrintedDesign(piece.name, design.name, predicted, tuple(printed.rows()), tuple(printed.findings()))
    except SensorgenError as error:
        return UnreadDesign(piece.name, design.name, str(error))
