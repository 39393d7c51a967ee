"""What the thesis's own formulas, and its geometry of a pressed cell, give for designs, as plain data.

A formula gives a value without bounds: it has no error estimate. Measured errors: docs/cells.md.
"""

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from math import ceil
from typing import Any

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue, permittivities
from sensorgen.models import thesis_cells, thesis_swept
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction import losses
from sensorgen.prediction.capacitance import PLANE, Unpredictable
from sensorgen.prediction.capacitance_answer import Asked

NAMES = (*thesis_cells.NAMED, thesis_swept.NAME)
SHAPES = {name: law.shapes for name, law in thesis_cells.NAMED.items()} | {thesis_swept.NAME: thesis_swept.SHAPES}
PRESSED = (*(name for name, law in thesis_cells.NAMED.items() if law.pressed), thesis_swept.NAME)

Data = dict[str, Any]


def answer(design: Design, asked: Asked, press_mm: float | None = None) -> Data:
    """The capacitance per area of the sensor at rest that a formula gives.

    Parameters
    ----------
    design : Design
        Of a shape that the formula applies to.
    asked : Asked
        The formula as its model; the accuracy of the field on the pressed geometry of 3.1.2.
    press_mm : float, optional
        Displacement of the top [mm]; only for those in ``PRESSED``.

    Raises
    ------
    Unpredictable
        The formula applies to other shapes, or has no losses.
    BadInput
        The formula knows no press.
    OutOfRange
        As the formula itself.
    """
    _refuse(design, asked.model, press_mm)
    start = time.perf_counter()
    work = _field if asked.model == thesis_swept.NAME else _formula
    value, said, taken = work(design, asked, press_mm or 0.0)
    return {
        "design": design.name, "model": asked.model, "press_mm": press_mm, "value_f_per_m2": value,
        "lower_f_per_m2": None, "upper_f_per_m2": None, "seconds": time.perf_counter() - start,
        "values": [vars(t) for t in taken], "reason": said,
    }  # fmt: skip


def answers(designs: Sequence[Design], asked: Asked, press_mm: Sequence[float | None]) -> list[Data]:
    """The same for many designs and presses, one of each pair; a reason stands in place of what has no number.

    Raises
    ------
    Unpredictable, BadInput
        As :func:`answer`.
    """
    return [_answer_or_why(design, asked, press) for design, press in zip(designs, press_mm, strict=True)]


def _answer_or_why(design: Design, asked: Asked, press_mm: float | None) -> Data:
    try:
        return answer(design, asked, press_mm)
    except OutOfRange as error:
        return {"design": design.name, "model": None, "value_f_per_m2": None, "reason": str(error)}


def _refuse(design: Design, name: str, press_mm: float | None) -> None:
    if design.shape not in SHAPES[name]:
        raise Unpredictable(f"{name} applies to {' and '.join(SHAPES[name])}, not to {design.shape}")
    if losses.set_losses(design):
        raise Unpredictable(f"{name} knows no losses; leave out --model, or the loss")
    if press_mm is not None and name not in PRESSED:
        able = ", ".join(other for other in PRESSED if design.shape in SHAPES[other])
        raise BadInput(f"{name} knows no press; expected {able}, or the command compress")


Found = tuple[float, str, list[MaterialValue]]


def _formula(design: Design, asked: Asked, press_mm: float) -> Found:
    """Of one permittivity, the film's."""
    taken = [t for t in permittivities(design) if t.material == design.slot("film")[0].name]
    value = thesis_cells.NAMED[asked.model].value_f_per_m2(design.params, taken[0].value, press_mm)
    return value, f"{thesis_cells.SOURCE}: a formula alone, without bounds; air is taken for 1", taken


def _field(design: Design, asked: Asked, press_mm: float) -> Found:
    """The field on the sizes that 3.1.2 makes of some whole periods, by the least expensive model within tolerance."""
    rest: Any = design.params
    now = thesis_swept.swept(rest, press_mm)
    side_mm = ceil(1 / now.period_mm) * now.period_mm
    sizes = asdict(replace(now, length_mm=side_mm, width_mm=side_mm))
    pressed = designs.make(design.model_dump(exclude={"parameters"}) | {"parameters": sizes})
    taken = permittivities(pressed)
    found = planner.capacitance(
        pressed.in_use, {t.material: t.value for t in taken}, asked.width or PLANE, keep=asked.keep
    )
    value = found.capacitance_f.middle() / (side_mm * M_PER_MM) ** 2 * thesis_swept.stretch(rest, now)
    said = f"{thesis_swept.SOURCE}: sizes changed by hand, their field by {found.model} within {found.width():.2g}"
    return value, f"{said}; solved compression: compress", taken
