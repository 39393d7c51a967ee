"""Capacitance per area of a body between bounds, unloaded: the result of ``sensorgen cell``."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import inf
from typing import Annotated

from sensorgen.core import cache
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.units import M_PER_MM, si
from sensorgen.design.body import Body
from sensorgen.design.values import MaterialValue
from sensorgen.prediction import rest_state
from sensorgen.prediction.capacitance import Unpredictable, default_width, of_sensor
from sensorgen.prediction.plan import PlanCandidate, candidates_table
from sensorgen.prediction.sweep import Sweeper

QUANTITIES = {
    "relative_permittivity": "relative permittivity",
    "loss_tangent": "loss tangent",
    "resistivity_ohm_m": "resistivity [ohm m]",
}


@dataclass(frozen=True)
class CapacitanceQuestion:
    """Question about every design.

    Attributes
    ----------
    width : float or None
        Relative width of the bounds [-]; the default of :mod:`sensorgen.prediction.rest_state` if None.
    model : str
        The only model to ask, or "".
    keep : bool
        Take answers that are known from before, and keep new ones.
    frequency_hz : float or None
        Of the field, where dielectrics leak [Hz].
    """

    width: float | None = None
    model: str = ""
    keep: bool = True
    frequency_hz: float | None = None


@dataclass(frozen=True, kw_only=True)
class CellCapacitance(Displayed):
    """Capacitance per area of a body's most likely cell; values are None where there is no answer.

    Attributes
    ----------
    design, body : str
        Name of the design, and what of it.
    lower_f_per_m2, upper_f_per_m2 : float or None
        Bounds of the capacitance per area, or of its real part [F/m2].
    loss_lower_f_per_m2, loss_upper_f_per_m2 : float or None
        Bounds of minus the imaginary part, where dielectrics lose [F/m2].
    relative_width : float or None
        How far the bounds are apart, relative to their mean [-].
    model : str or None
        That gave them.
    seconds : float or None
        Time that all models took together, imports left out [s].
    reached : bool
        Whether the bounds are as narrow as asked.
    reason : str
        Why there is no answer, or "".
    accuracy : float or None
        Relative width that was asked for [-].
    known : bool
        Whether the answer was stored.
    area_m2 : float or None
        Of the sensor [m2].
    tan_delta : (float, float) or None
        Bounds of the loss tangent of the whole [-].
    frequency_hz : float or None
        Of the field, where dielectrics lose [Hz].
    refused : tuple of str
        Why other models do not apply.
    plan : tuple of PlanCandidate
        All models, with what they reached.
    values : tuple of MaterialValue
        Material values used.
    doubts : tuple of str
        Of how its cells stand for the sensor, as a border that cuts them.
    """

    design: str
    body: str
    lower_f_per_m2: Annotated[float | None, Column("lower", "F/m2", digits=7)] = None
    upper_f_per_m2: Annotated[float | None, Column("upper", "F/m2", digits=7)] = None
    loss_lower_f_per_m2: Annotated[float | None, Column("loss, lower", digits=7)] = None
    loss_upper_f_per_m2: Annotated[float | None, Column("loss, upper", digits=7)] = None
    relative_width: Annotated[float | None, Column("width", digits=2)] = None
    model: Annotated[str | None, Column("model")] = None
    seconds: Annotated[float | None, Column("time", "s", digits=2, si=True)] = None
    reached: Annotated[bool, Column("reached", hidden=True)] = False
    reason: Annotated[str, Column("no answer")] = ""
    accuracy: float | None = None
    known: bool = False
    area_m2: float | None = None
    tan_delta: tuple[float, float] | None = None
    frequency_hz: float | None = None
    refused: tuple[str, ...] = ()
    plan: tuple[PlanCandidate, ...] = ()
    values: tuple[MaterialValue, ...] = ()
    doubts: tuple[str, ...] = ()

    def table(self) -> Table:
        """One row."""
        return Table.of("cell", "", (self,))

    def document(self) -> Iterator[Part]:
        """Capacitance of the sensor, bounds per area, and what they rest on."""
        ends = [end * (self.area_m2 or 0.0) for end in (self.lower_f_per_m2, self.upper_f_per_m2) if end is not None]
        yield f"{self.design}, {self.body}: {' to '.join(si(end, 'F') for end in ends)}{', stored' * self.known}"
        yield self.table()
        yield Facts(tuple(self._facts()))

    def _facts(self) -> Iterator[tuple[str, str]]:
        yield "target", f"relative width {self.accuracy:g}"
        if self.tan_delta:
            at = f" at {si(self.frequency_hz, 'Hz')}" if self.frequency_hz else ""
            yield "tan delta", f"{self.tan_delta[0]:.6g} to {self.tan_delta[1]:.6g}{at}"
        if self.loss_lower_f_per_m2 is not None:
            yield "loss", "minus the imaginary part of the capacitance per area [F/m2]"
        yield from (("with", remark) for remark in self.remarks())
        yield from (("doubtful", doubt) for doubt in self.doubts)

    def remarks(self) -> Sequence[str]:
        """Material values and their sources."""
        by_quantity = [
            (QUANTITIES[quantity], [v for v in self.values if v.quantity == quantity])
            for quantity in dict.fromkeys(v.quantity for v in self.values)
        ]
        return [
            f"{name} of {', '.join(f'{v.material} {v.value:g} ({v.source})' for v in of)}" for name, of in by_quantity
        ]

    def explained(self) -> Iterator[Part]:
        """The plan, with what came of it."""
        yield candidates_table(self.plan, f"plan for a relative width of {self.accuracy:g}", self.model or "")
        yield ""

    def problems(self) -> Sequence[str]:
        """Why there is no answer, or none as narrow as asked."""
        if self.reached:
            return ()
        if self.model is None:
            return (f"no answer: {self.reason}",)
        best = f"accuracy {self.accuracy:g} not reached: {self.relative_width:.2g}, by {self.model}"
        return ("; ".join((best, *(self.doubts or self.refused))),)


def answer(body: Body, asked: CapacitanceQuestion) -> CellCapacitance:
    """Bounds of the capacitance per area of one body's most likely cell, unloaded.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    asked : CapacitanceQuestion
        Accuracy and model.

    Raises
    ------
    Unpredictable, UnknownName, OutOfRange
        As :func:`sensorgen.prediction.capacitance.capacitance`.
    MissingValue
        A dielectric without a permittivity.
    """
    if not asked.keep or asked.width == inf:
        return _computed(body, asked)
    question = {"what": "cell", "body": body.identity, **asdict(asked)}
    known = cache.known(question) is not None
    cell = cache.record(question, CellCapacitance, partial(_computed, body, asked))
    return replace(cell, design=body.design.name, body=body.provenance, known=known or cell.known)


def _computed(body: Body, asked: CapacitanceQuestion) -> CellCapacitance:
    design, cells = body.design, body.cells
    scene = cells.first()
    permittivity, values = rest_state.permittivity(design, asked.frequency_hz)
    width = default_width(scene) if asked.width is None else asked.width
    total = of_sensor(cells, permittivity, width, asked.model, asked.keep)
    area_m2 = design.area_mm2 * M_PER_MM**2
    real, loss, per_area = total.capacitance_f, total.loss_f, total.capacitance_f.times(1 / area_m2)
    tan_delta = None
    if loss and real.lower > 0:
        ends = (real.lower, real.upper)
        tan_delta = loss.lower / ends[loss.lower > 0], loss.upper / ends[loss.upper < 0]
    return CellCapacitance(
        design=design.name, body=body.provenance, model=total.model,
        lower_f_per_m2=per_area.lower, upper_f_per_m2=per_area.upper,
        loss_lower_f_per_m2=loss.lower / area_m2 if loss else None,
        loss_upper_f_per_m2=loss.upper / area_m2 if loss else None,
        relative_width=total.width(), seconds=total.seconds(),
        reached=total.reached(), accuracy=total.wanted if total.wanted < inf else None,
        known=total.known, area_m2=area_m2, tan_delta=tan_delta,
        frequency_hz=asked.frequency_hz if loss else None, refused=total.refused, plan=total.plan, values=tuple(values),
        doubts=(*cells.remarks.get(next(iter(cells.scenes)), ()), *rest_state.perfect_interfaces(design)),
    )  # fmt: skip


def _failed(body: Body, reason: str) -> CellCapacitance:
    return CellCapacitance(design=body.design.name, body=body.provenance, reason=reason)


sweep = Sweeper(answer, _failed, refused=(Unpredictable,))
