"""Predictions along values of one setting."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from sensorgen.core.bounds import Bounds
from sensorgen.core.document import Cell, Column, Table
from sensorgen.core.errors import SensorgenError
from sensorgen.design.body import Body
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.query import Query
from sensorgen.prediction.results import Prediction, timeless
from sensorgen.prediction.sweep import Sweep, Value
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

    def table(self) -> Table:
        """One row: each number with its range."""
        columns = [
            Column(f"{name.replace('_', ' ')}{end}", unit, hidden=bool(end))
            for name, unit, _ in _SHOWN for end in ("", ", least", ", most")
        ]  # fmt: skip
        return Table("predictions", "", (*columns, Column("status")), (tuple(self._cells()),))

    def _cells(self) -> Iterator[Cell]:
        for name, _, size in _SHOWN:
            found: Bounds | None = getattr(self.prediction, name, None)
            yield from (v / size for v in (found.value, found.lower, found.upper)) if found else (None, None, None)
        yield self.prediction.status if self.prediction else "not predicted"

    def remarks(self) -> Sequence[str]:
        """What is doubtful."""
        return [f"doubtful: {doubt}" for doubt in self.prediction.doubts] if self.prediction else []

    def problems(self) -> Sequence[str]:
        """Why it is not predicted, or not within the accuracy."""
        return [self.reason] if self.reason else self.prediction.problems(self.accuracy) if self.prediction else ()


def sweep(
    key: str, points: Sequence[tuple[Value, Body]], query: Query, jobs: int, done: Callable[[], None], cluster: str = ""
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
