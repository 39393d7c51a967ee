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
        found = [(result.design, problem) for result in self.results for problem in result.problems()[:1]]
        more = f" ({len(found)} of {len(self.results)} like this)" if len(found) > 1 else ""
        return [f"{design}: {problem}{more}" for design, problem in found[:1]]

    def to_json(self) -> str:
        """A list of the results, each with the value of the setting before it."""
        results = json.loads(to_json(self.results))
        rows = [chosen | result for chosen, result in zip(self.settings(), results, strict=True)]
        return json.dumps(rows, indent=2, ensure_ascii=False) + "\n"


def sweep(
    key: str | tuple[str, ...], points: Sequence[tuple[Any, Body]], work: Callable[[Body], Result],
    failed: Callable[[Body, str], Result], *, refused: tuple[type[SensorgenError], ...], keep: bool = True,
    jobs: int = 1, cluster: str = "", done: Callable[[], None] = lambda: None,
) -> Sweep[Result]:  # fmt: skip
    """Work on each body, those whose answer is not cached in several processes.

    Parameters
    ----------
    key : str, or tuple of str
        The setting that is varied, or the settings.
    points : sequence of (value, Body)
        Its values, and the body of each.
    work : callable
        Gives the result of a body; a function of a module, or a partial of one, so that another process can find it.
    failed : callable
        Makes a result of a body and the reason why it has none.
    refused : tuple of type
        Errors that are about one point alone; any other SensorgenError, or a library that is not installed, stops all.
    keep : bool
        Read the cache and store new answers.
    jobs : int
        How many processes at once, 1 or more.
    cluster : str
        Of Dask, in place of processes, as of :func:`sensorgen.core.parallel.in_parallel`.
    done : callable
        Called after each point.

    Raises
    ------
    SensorgenError
        Not in ``refused``; a cluster that cannot be reached. A point that ends its process, as when the memory is full,
        has that as its reason.
    """
    attempt = partial(said, work, refused=refused)
    found: dict[int, Result | str] = {}
    given = [(body,) for _, body in points]
    for k, one in remembered(attempt, given, jobs, cluster=cluster, keep=keep, lost=lambda _, reason: reason):
        found[k] = one
        done()
    results = []
    for k, (_, body) in enumerate(points):
        known = found[k]
        results.append(failed(body, known) if isinstance(known, str) else known)
    return Sweep(key, tuple(value for value, _ in points), tuple(results))
