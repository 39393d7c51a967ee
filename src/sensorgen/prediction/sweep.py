"""Results along values of one setting: cached points first, the others in parallel processes."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import Any, Generic, Protocol, TypeVar

from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table, shown, to_json
from sensorgen.core.errors import SensorgenError
from sensorgen.core.parallel import remembered, said
from sensorgen.design.body import Body

Value = float | str


class SweepPoint(Protocol):
    """A result that a sweep may have at each of its values."""

    @property
    def design(self) -> str:
        """Name of the design."""
        ...

    def table(self) -> Table:
        """Rows of the result; of all results of a sweep with one set of columns."""
        ...

    def remarks(self) -> Sequence[str]:
        """Remarks besides the rows."""
        ...

    def problems(self) -> Sequence[str]:
        """Why it is not what was asked for."""
        ...


Result = TypeVar("Result", bound=SweepPoint)


@dataclass(frozen=True)
class Sweep(Displayed, Generic[Result]):
    """Results along values of a setting, or of several.

    Attributes
    ----------
    key : str, or tuple of str
        The setting, or settings.
    values : tuple of float or str, or of tuples of these
        That it takes, or that each takes.
    results : tuple
        One for each value, of one type.
    """

    key: str | tuple[str, ...]
    values: tuple[Any, ...]
    results: tuple[Result, ...]

    def document(self) -> Iterator[Part]:
        """All rows in one table, and each remark once, with the values it is about unless it is about all."""
        points = list(zip(self.settings(), self.results, strict=True))
        yield self.table()
        for remark in dict.fromkeys(chain(*(result.remarks() for result in self.results))):
            of = [" and ".join(shown(v, 6) for v in chosen.values()) for chosen, r in points if remark in r.remarks()]
            yield f"{remark} ({', '.join(points[0][0])} {', '.join(of)})" if len(of) < len(self.values) else remark

    def table(self) -> Table:
        """Rows of all results, each with its settings before it."""
        settings = self.settings()
        keys = tuple(Column(key, digits=6, key=key) for key in settings[0])
        points = zip(settings, (result.table() for result in self.results), strict=True)
        cells = tuple((*chosen.values(), *row) for chosen, table in points for row in table.cells)
        return Table("sweep", "", (*keys, *self.results[0].table().columns), cells)

    def settings(self) -> list[dict[str, Value]]:
        """Settings of each result by key."""
        if isinstance(self.key, str):
            return [{self.key: value} for value in self.values]
        return [dict(zip(self.key, values, strict=True)) for values in self.values]

    def problems(self) -> Sequence[str]:
        """Problem of the first that has one, and the number of those that have."""
        problems = [(result.design, problem) for result in self.results for problem in result.problems()[:1]]
        more = f" ({len(problems)} of {len(self.results)} like this)" if len(problems) > 1 else ""
        return [f"{design}: {problem}{more}" for design, problem in problems[:1]]

    def to_json(self) -> str:
        """A list of the results, each with the value of the setting before it."""
        results = json.loads(to_json(self.results))
        rows = [chosen | result for chosen, result in zip(self.settings(), results, strict=True)]
        return json.dumps(rows, indent=2, ensure_ascii=False) + "\n"


@dataclass(frozen=True)
class Sweeper(Generic[Result]):
    """One kind of question along a setting; where a point has no answer, the reason stands in its place.

    Attributes
    ----------
    answer : callable
        From a body and ``asked`` to a result; a function of a module, so that another process can find it.
    failed : callable
        From a body and the reason why it has no answer to a result.
    refused : tuple of type
        Errors that are about one point alone; any other SensorgenError, or a library that is not installed, stops all.
    """

    answer: Callable[..., Result]
    failed: Callable[[Body, str], Result]
    refused: tuple[type[SensorgenError], ...]

    def __call__(
        self, key: str | tuple[str, ...], points: Sequence[tuple[Any, Body]], asked: Any, jobs: int = 1,
        done: Callable[[], None] = lambda: None, cluster: str = "",
    ) -> Sweep[Result]:  # fmt: skip
        """Answer for each body, those that are not cached in several processes.

        Parameters
        ----------
        key : str, or tuple of str
            The setting that is varied, or the settings.
        points : sequence of (value, Body)
            Its values, and the body of each.
        asked
            The question; its ``keep``, if it has one, is false where answers are neither read nor stored.
        jobs : int
            How many processes at once, 1 or more.
        done : callable
            Called after each point.
        cluster : str
            Of Dask, in place of processes, as of :func:`sensorgen.core.parallel.in_parallel`.

        Raises
        ------
        SensorgenError
            Not in ``refused``; a cluster that cannot be reached. A point that ends its process, as when the memory is
            full, has that as its reason.
        """
        attempt = partial(said, partial(self.answer, asked=asked), refused=self.refused)
        bodies, keep = [(body,) for _, body in points], getattr(asked, "keep", True)
        answers: dict[int, Result | str] = {}
        for k, one in remembered(attempt, bodies, jobs, cluster=cluster, keep=keep, lost=lambda _, reason: reason):
            answers[k] = one
            done()
        results = (
            self.failed(body, answer) if isinstance(answer := answers[k], str) else answer
            for k, (_, body) in enumerate(points)
        )
        return Sweep(key, tuple(value for value, _ in points), tuple(results))
