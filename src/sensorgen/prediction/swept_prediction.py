"""Predictions along values of one setting."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from sensorgen.core.document import Cell, Column, Table
from sensorgen.core.errors import SensorgenError
from sensorgen.design.body import Body
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE
from sensorgen.prediction.query import Query
from sensorgen.prediction.results import Prediction, timeless
from sensorgen.prediction.sweep import Sweep
from sensorgen.prediction.sweep import sweep as swept

_SHOWN = (
    ("capacitance", "pF", 1e-12), ("sensitivity", "1/kPa", 1.0), ("force_resolution", "N", 1.0),
    ("position_resolution", "mm", 1e-3),
)  # fmt: skip


@dataclass(frozen=True)
class PredictedPoint:
    """A prediction at one value of a sweep.

    Attributes
    ----------
    design : str
        Name of the design.
    reason : str
        Why nothing is predicted, or "".
    prediction : Prediction or None
        Of the body; None where it cannot be predicted at all.
    accuracy : float or None
        Of abs(Z), that was asked for [-].
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

    design: str
    reason: str = ""
    prediction: Prediction | None = None
    accuracy: float | None = None

    @property
    def source(self) -> str:
        """Slicer and version, "estimated", or "drawn"."""
        body = self.prediction.body if self.prediction else ""
        return body.removeprefix("printed, ").partition(" (")[0].partition(", ")[0]

    def table(self) -> Table:
        """One row: each number with its range."""
        columns = [
            Column(f"{name.replace('_', ' ')}{end}", unit, hidden=bool(end))
            for name, unit, _ in _SHOWN for end in ("", ", least", ", most")
        ]  # fmt: skip
        return Table("predictions", "", (*columns, Column("status"), Column("source")), (tuple(self._cells()),))

    def _cells(self) -> Iterator[Cell]:
        found = self.prediction
        if found is None:
            yield from (*[None] * 3 * len(_SHOWN), "not predicted", "")
            return
        values = (found.capacitance, found.sensitivity, *found.bench())
        for (_, _, size), bounds, words in zip(_SHOWN, values, ("", "", *found.resolved()), strict=True):
            if bounds is None:
                yield from (None, None, None)
                continue
            yield words if words in (CANNOT_SENSE, CANNOT_LOCATE) else bounds.value / size
            yield from (bounds.lower / size, bounds.upper / size)
        yield from (found.status, self.source)

    def remarks(self) -> Sequence[str]:
        """Source, and what is doubtful."""
        return (
            [f"source: {self.source}", *(f"doubtful: {d}" for d in self.prediction.doubts)] if self.prediction else []
        )

    def problems(self) -> Sequence[str]:
        """Why it is not predicted, or not within the accuracy."""
        return [self.reason] if self.reason else self.prediction.problems(self.accuracy) if self.prediction else ()


def sweep(
    key: str | tuple[str, ...],
    points: Sequence[tuple[Any, Body]],
    query: Query,
    jobs: int,
    done: Callable[[], None],
    cluster: str = "",
) -> Sweep[PredictedPoint]:
    """A prediction for each body; parameters and errors as of :func:`sensorgen.prediction.sweep.sweep`."""
    work = partial(_point, query=query)
    return swept(
        key, points, work, lambda body, reason: PredictedPoint(body.design.name, reason), refused=(SensorgenError,),
        jobs=jobs, cluster=cluster, done=done,
    )  # fmt: skip


def _point(body: Body, query: Query) -> PredictedPoint:
    found = timeless(evaluate(body, query))
    return PredictedPoint(found.design, found.reason if found.capacitance is None else "", found, query.accuracy)
