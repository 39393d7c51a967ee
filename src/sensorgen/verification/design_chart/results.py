"""Measured points of a chart of one design, each compared with the best answer of another program."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Annotated

from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.errors import SensorgenError
from sensorgen.core.lazy import by_key
from sensorgen.design.body import Body
from sensorgen.models.compression import Plate
from sensorgen.prediction.query import Query
from sensorgen.prediction.sensor_model import rough_sensor
from sensorgen.verification import peers
from sensorgen.verification.apart import ModelAnswer, Runner, TimedAnswer, apart
from sensorgen.verification.design_chart.questions import (
    DIGITS,
    OWN,
    Question,
    Reference,
    Series,
    exact,
    of_modulus,
    pressed_line,
    questions,
)

KEYS = ("capacitance", "compression", "line", "prediction")
_LEAST = 2  # levels of another program, whose difference is its doubt: without it there is no reference
_DEARER = 5.0  # how many times longer the next level should take than the last one


@dataclass(frozen=True)
class Run:
    """A model or another program at a level, in words, and its answer."""

    series: Series
    level: str
    timed: TimedAnswer


@dataclass(frozen=True)
class Point:
    """Answer of one model, and its cost.

    Attributes
    ----------
    question, model, level : str
        Of ``KEYS``; a model or another program; how fine it was.
    program : str
        "sensorgen", or another one.
    error : float
        Relative distance from the reference; no less than the reference's own doubt [-].
    doubt : float
        Relative error of the reference [-].
    against : str
        The reference in words.
    independent : bool
        Whether the reference is of another program, or a closed form.
    stated : float or None
        Relative error that the model states itself [-].
    certified : bool
        Whether that is a bound; the error is then of the end that is further off.
    contradicted : bool
        Whether it is further off than it states, by more than the reference is in doubt.
    cold_cpu_s, cold_wall_s, warm_cpu_s, warm_wall_s : float
        Time of the processor and by the clock: in a new process with nothing stored, from its start; and solved once
        more in the same process [s].
    memory_mb : float or None
        Peak of the process [MB].
    """

    question: str
    model: Annotated[str, Column("model")]
    level: Annotated[str, Column("level")]
    program: str
    error: Annotated[float, Column("error", digits=2)]
    doubt: Annotated[float, Column("known to", digits=2)]
    stated: Annotated[float | None, Column("stated", digits=2)]
    cold_cpu_s: Annotated[float, Column("cold", "s", digits=2)]
    warm_cpu_s: Annotated[float, Column("warm", "s", digits=2)]
    cold_wall_s: Annotated[float, Column("cold, clock", "s", digits=2, hidden=True)]
    warm_wall_s: Annotated[float, Column("warm, clock", "s", digits=2, hidden=True)]
    memory_mb: Annotated[float | None, Column("peak", "MB", digits=3)]
    against: Annotated[str, Column("against", hidden=True)]
    independent: Annotated[bool, Column("independent", hidden=True)]
    certified: bool
    contradicted: bool

    def words(self) -> str:
        """Model and level."""
        return f"{self.model} {self.level}".rstrip()


@dataclass(frozen=True)
class Silent:
    """Model or program without an answer to a question, and the reason."""

    question: str
    model: str
    why: str


@dataclass(frozen=True)
class DesignChart(Displayed):
    """Speed against accuracy for one design.

    Attributes
    ----------
    design, body : str
        Name, and what of it.
    force_n, position_m : float
        The load [N], [m].
    titles : dict of str to str
        Of the questions.
    points : tuple of Point
        In the order in which they were measured.
    silent : tuple of Silent
        Who gave nothing.
    """

    design: str
    body: str
    force_n: float
    position_m: float
    titles: dict[str, str]
    points: tuple[Point, ...]
    silent: tuple[Silent, ...]

    def document(self) -> Iterator[Part]:
        """A table for each question, with its references and who gave nothing."""
        yield f"{self.design}, {self.body}: {self.force_n:g} N at {self.position_m * 1e3:g} mm"
        for key in self.titles:
            yield ""
            yield from self.parts(key)

    def parts(self, key: str) -> Iterator[Part]:
        """The table of one question."""
        here = [p for p in self.points if p.question == key]
        if here:
            yield Table.of(key, f"{self.titles[key]}: relative error; time of the processor", here)
        yield from _against(here)
        yield from (f"error larger than stated: {p.words()}" for p in here if p.contradicted)
        if silent := [(s.model, s.why) for s in self.silent if s.question == key]:
            yield Facts(tuple(silent))

    def problems(self) -> Sequence[str]:
        """Models whose error is larger than they state."""
        wrong = [p for p in self.points if p.contradicted]
        return [f"{p.words()}: error {p.error:.2g}, {p.stated:.2g} stated" for p in wrong]

    def csv(self) -> Iterator[str]:
        """All points in one table; nothing without any."""
        from sensorgen.core.document import comma_separated

        if self.points:
            yield comma_separated(Table.of("chart", "", self.points))


def _against(points: Sequence[Point]) -> Iterator[str]:
    """References of a question in words, each with the models that are compared with it."""
    for words in dict.fromkeys(p.against for p in points):
        of = [p for p in points if p.against == words]
        own = "" if of[0].independent else ", which is not independent"
        yield f"against {words}{own}, known to {of[0].doubt:.2g}: {', '.join(dict.fromkeys(p.model for p in of))}"


def chart(
    body: Body, query: Query, keys: Sequence[str] = KEYS, *, budget_s: float = 10.0,
    step: Callable[[str], None] = lambda _: None, runner: Runner = apart,
) -> DesignChart:  # fmt: skip
    """Measure every model that applies to a body.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    query : Query
        Frequencies and reference load.
    keys : sequence of str
        Of ``KEYS``; a prediction is compared with the best of capacitance and compression, which run for it too.
    budget_s : float
        A level is not run that should take longer [s].
    step : callable
        Called with the name of each model before it runs.
    runner : callable
        Runs a piece of work and times it.

    Raises
    ------
    SensorgenError
        Nothing can be predicted of the body.
    """
    needed = {*keys, *(KEYS[:2] if "prediction" in keys else ())}
    titles: dict[str, str] = {}
    points: list[Point] = []
    silent: list[Silent] = []
    best: dict[str, list[Reference]] = {}
    for question in questions(body, query):
        if question.key not in needed:
            continue
        runs, without = _runs(question, budget_s, step, runner)
        more = composed(body, query, best) if question.key == "prediction" else _from(runs)
        known = best[question.key] = [*question.references, *more]
        if question.key in keys:
            titles[question.key] = question.title
            if known:
                points += [_point(question, run, known) for run in runs]
            else:
                why = f"no reference within --budget {budget_s:g}"
                without += dict.fromkeys((run.series.model for run in runs), why).items()
            silent += [Silent(question.key, *each) for each in without]
    load = query.load(body.design)
    return DesignChart(
        body.design.name, body.provenance, load.force_n, load.position_m, titles, tuple(points), tuple(silent)
    )


def _runs(
    question: Question, budget_s: float, step: Callable[[str], None], runner: Runner
) -> tuple[list[Run], list[tuple[str, str]]]:  # fmt: skip
    """Runs of all models for a question; and why a model has none, or no more."""
    runs, silent = list[Run](), [(series.model, series.why_not) for series in question.series if series.why_not]
    for series in question.series:
        more, why = _climbed(series, budget_s, partial(step, f"{question.key}: {series.model}"), runner)
        runs += more
        silent += [(series.model, why)] if why else []
    return runs, silent


def _climbed(series: Series, budget_s: float, step: Callable[[], None], runner: Runner) -> tuple[list[Run], str]:
    """Runs of a model from coarse to fine until the next one would take too long; and why there are no more."""
    done: list[Run] = []
    for level, work, expected_s in series.levels:
        last_s = max((run.timed.cold.cpu_s - _started_s(done) for run in done[-1:]), default=0.0)
        likely_s = max(expected_s, _DEARER * last_s if not expected_s else 0.0)
        if likely_s > budget_s and (
            series.program == OWN or len(done) >= _LEAST or series.model in peers.SLOW_TO_CONVERGE
        ):
            return done, f"{level}: some {likely_s:.2g} s, more than --budget {budget_s:g}".removeprefix(": ")
        step()
        try:
            done.append(Run(series, level, runner(work)))
        except SensorgenError as error:
            return done, f"{level}: {error}".removeprefix(": ")
    return done, ""


def _started_s(done: Sequence[Run]) -> float:
    """Start of a process and loading of libraries, at most: the least difference of cold and warm [s]."""
    return min((run.timed.cold.cpu_s - run.timed.warm.cpu_s for run in done), default=0.0)


def _from(runs: Sequence[Run]) -> Iterator[Reference]:
    """References: the narrowest bounds and the finest answer of each program, with its last change as its doubt."""
    certified = [run for run in runs if run.timed.answer.certified]
    for program, bounds in by_key((run.series.program, run) for run in certified).items():
        run = min(bounds, key=lambda run: run.timed.answer.stated or 0.0)
        doubt = max(run.timed.answer.stated or 0.0, DIGITS)
        yield Reference(f"the bounds of {run.series.model}", program, run.timed.answer.value, doubt)
    for series, levels in groupby(runs, key=lambda run: run.series):
        yield from _finest(series, [run.timed.answer for run in levels])


def _finest(series: Series, levels: Sequence[ModelAnswer]) -> Iterator[Reference]:
    """The finest answer; none from bounds, and none from a single level that states no error."""
    finest, changes = levels[-1], [abs(levels[-1].value[0] / before.value[0] - 1) for before in levels[-2:-1]]
    doubts = changes if finest.stated is None else [*changes, finest.stated]
    if doubts and not finest.certified and series.model not in peers.SLOW_TO_CONVERGE:
        yield Reference(f"the finest {series.model}", series.program, finest.value, max(*doubts, DIGITS))


def composed(body: Body, query: Query, best: dict[str, list[Reference]]) -> Iterator[Reference]:
    """Impedance of a line in many digits, with the best capacitance and the best rise of the others."""
    model = rough_sensor(body, "", query.tip_of(body.design))
    load = query.load(body.design)
    query = replace(query, position_m=load.position_m)
    if not all(best[key] for key in KEYS[:2]):
        return
    c, rise = (_best(best[key], OWN) for key in KEYS[:2])
    farad, rises = c.value[0].real, rise.value[0].real

    def z(farad: float, rises: float) -> tuple[complex, ...]:
        law = Plate("given", "", float(model.sensor.stress_pa(load.force_n, load.position_m)) * (1 + rises) / rises)
        sensor = replace(model.sensor, capacitance_f_per_m=farad / model.sensor.length_m, compression=law)
        return exact(pressed_line(sensor, query, load.position_m))

    value = z(farad, rises)
    doubt = of_modulus(z(farad * (1 + c.doubt), rises), value) + of_modulus(z(farad, rises * (1 + rise.doubt)), value)
    program = OWN if OWN in (c.program, rise.program) else "others"
    yield Reference(f"C by {c.name}, rise by {rise.name}, line in 220 digits", program, value, doubt)


def _best(references: Sequence[Reference], program: str) -> Reference:
    """The least doubtful one that is not of a program; where there is none, the least doubtful one of all."""
    others = [r for r in references if r.program != program]
    return min(others or references, key=lambda r: r.doubt)


def _point(question: Question, run: Run, references: Sequence[Reference]) -> Point:
    """A run beside the best answer of another program; beside one of its own program where there is no other."""
    series, timed, answer = run.series, run.timed, run.timed.answer
    reference = _best(references, series.program)
    off = question.measure(answer.value, reference.value)
    within = question.measure(reference.value, answer.value)  # of what was stated of the answer
    contradicted = answer.stated is not None and within > answer.stated + reference.doubt
    if answer.certified and answer.stated is not None:  # the bound that is further off
        off = max(
            question.measure((answer.value[0] * end,), reference.value)
            for end in (1 - answer.stated, 1 + answer.stated)
        )
    return Point(
        question.key, series.model, run.level, series.program, max(off, reference.doubt), reference.doubt,
        answer.stated, timed.cold.cpu_s, timed.warm.cpu_s, timed.cold.wall_s, timed.warm.wall_s, timed.memory_mb,
        reference.name, reference.program != series.program, answer.certified, contradicted,
    )  # fmt: skip
