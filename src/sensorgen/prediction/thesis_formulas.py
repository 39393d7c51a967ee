"""Capacitance per area by the thesis's own formulas, and by its geometry of a pressed cell.

A formula gives a value without bounds: it has no error estimate. Measured errors: docs/cells.md.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil
from typing import Annotated, Any

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue, permittivities
from sensorgen.models import thesis_cells
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction.capacitance import PLANE, Unpredictable
from sensorgen.prediction.capacitance_answer import CapacitanceQuestion
from sensorgen.prediction.rest_state import set_losses
from sensorgen.prediction.sweep import Sweep

NAMES = (*thesis_cells.NAMED, thesis_cells.GEOMETRY)
SHAPES = {name: law.shapes for name, law in thesis_cells.NAMED.items()} | {thesis_cells.GEOMETRY: ("tri", "rect")}
PRESSED = (*(name for name, law in thesis_cells.NAMED.items() if law.pressed), thesis_cells.GEOMETRY)


@dataclass(frozen=True, kw_only=True)
class FormulaResult:
    """Capacitance per area that a formula gives; None where it gives none.

    Attributes
    ----------
    design : str
        Name of the design.
    value_f_per_m2 : float or None
        Capacitance per area [F/m2].
    model : str or None
        The formula.
    reason : str
        Its source; or why there is no value.
    press_mm : float or None
        Displacement of the top [mm].
    lower_f_per_m2, upper_f_per_m2 : None
        A formula has no bounds.
    seconds : float or None
        Time it took [s].
    values : tuple of MaterialValue
        Material values used.
    """

    design: str
    value_f_per_m2: Annotated[float | None, Column("capacitance", "F/m2", digits=10)] = None
    model: Annotated[str | None, Column("formula")] = None
    reason: Annotated[str, Column("source", hidden=True)] = ""
    press_mm: float | None = None
    lower_f_per_m2: None = None
    upper_f_per_m2: None = None
    seconds: float | None = None
    values: tuple[MaterialValue, ...] = ()

    def table(self) -> Table:
        """One row."""
        return Table.of("formula", "", (self,))

    def document(self) -> Iterator[Part]:
        """The value and its source."""
        pressed = f", pressed by {self.press_mm:g} mm" if self.press_mm is not None else ""
        yield f"{self.design}{pressed}; without bounds"
        yield self.table()
        yield self.reason

    def remarks(self) -> Sequence[str]:
        """Source of the formula, or why there is no value."""
        return (self.reason,)

    def problems(self) -> Sequence[str]:
        """Why there is no value."""
        return () if self.model else (f"no answer: {self.reason}",)


def answer(design: Design, asked: CapacitanceQuestion, press_mm: float | None = None) -> FormulaResult:
    """The capacitance per area of the sensor at rest that a formula gives.

    Parameters
    ----------
    design : Design
        Of a shape that the formula applies to.
    asked : CapacitanceQuestion
        The formula as its model; the accuracy of the field on the pressed geometry of 3.1.2.
    press_mm : float, optional
        Displacement of the top [mm]; only for those in ``PRESSED``.

    Raises
    ------
    UnknownName
        No such formula.
    Unpredictable
        The formula applies to other shapes, or has no losses.
    BadInput
        The formula knows no press.
    OutOfRange
        As the formula itself.
    """
    _refuse(design, asked.model, press_mm)
    start = time.perf_counter()
    work = _field if asked.model == thesis_cells.GEOMETRY else _formula
    value, source, values = work(design, asked, press_mm or 0.0)
    return FormulaResult(
        design=design.name, value_f_per_m2=value, model=asked.model, reason=source, press_mm=press_mm,
        seconds=time.perf_counter() - start, values=tuple(values),
    )  # fmt: skip


def sweep(
    key: str, points: Sequence[tuple[float | str, Design]], asked: CapacitanceQuestion, press_mm: Sequence[float]
) -> Sweep[FormulaResult]:
    """Answers along a sweep, or along presses of one design; with a reason where there is no number.

    Parameters
    ----------
    key : str
        The setting that is varied, or "" for presses.
    points : sequence of (value, Design)
        Its values and their designs; one of them for presses.
    asked : CapacitanceQuestion
        As of :func:`answer`.
    press_mm : sequence of float
        Displacements of the top [mm]; may be empty.

    Raises
    ------
    UnknownName, Unpredictable, BadInput
        As :func:`answer`; a sweep of both.
    """
    if key and len(press_mm) > 1:
        raise BadInput("--sweep and several values of --press at once; expected one of them")
    if key:
        pressed = press_mm[0] if press_mm else None
        cases = [(value, design, pressed) for value, design in points]
    else:
        cases = [(press, points[0][1], press) for press in press_mm]
    results = tuple(_answer_or_reason(design, asked, press) for _, design, press in cases)
    return Sweep(key or "press_mm", tuple(value for value, *_ in cases), results)


def _answer_or_reason(design: Design, asked: CapacitanceQuestion, press_mm: float | None) -> FormulaResult:
    try:
        return answer(design, asked, press_mm)
    except OutOfRange as error:
        return FormulaResult(design=design.name, reason=str(error), press_mm=press_mm)


def _refuse(design: Design, name: str, press_mm: float | None) -> None:
    if name not in NAMES:
        raise UnknownName("formula", name, NAMES)
    if design.shape not in SHAPES[name]:
        raise Unpredictable(f"{name} applies to {' and '.join(SHAPES[name])}, not to {design.shape}")
    if set_losses(design):
        raise Unpredictable(f"{name} knows no losses; leave out --model, or the loss")
    if press_mm is not None and name not in PRESSED:
        able = ", ".join(other for other in PRESSED if design.shape in SHAPES[other])
        raise BadInput(f"{name} knows no press; expected {able}, or the command compress")


Found = tuple[float, str, list[MaterialValue]]


def _formula(design: Design, asked: CapacitanceQuestion, press_mm: float) -> Found:
    """Of one permittivity, the film's."""
    taken = [t for t in permittivities(design) if t.material == design.slot("film")[0].name]
    value = thesis_cells.NAMED[asked.model].value_f_per_m2(design.params, taken[0].value, press_mm)
    return value, f"{thesis_cells.SOURCE}: a formula alone, without bounds; air is taken for 1", taken


def _field(design: Design, asked: CapacitanceQuestion, press_mm: float) -> Found:
    """The field on the sizes that 3.1.2 makes of some whole periods, by the least expensive model within tolerance."""
    rest: Any = design.params
    now = thesis_cells.swept(rest, press_mm)
    side_mm = ceil(1 / now.period_mm) * now.period_mm
    sizes = asdict(replace(now, length_mm=side_mm, width_mm=side_mm))
    pressed = designs.make(design.model_dump(exclude={"parameters"}) | {"parameters": sizes})
    taken = permittivities(pressed)
    solved = planner.capacitance(
        pressed.in_use, {t.material: t.value for t in taken}, asked.width or PLANE, keep=asked.keep
    )
    value = solved.capacitance_f.middle() / (side_mm * M_PER_MM) ** 2 * thesis_cells.stretch(rest, now)
    by = f"their field by {solved.model} within {solved.width():.2g}; solved compression: compress"
    return value, f"{thesis_cells.GEOMETRY_SOURCE}: sizes changed by hand, {by}", taken
