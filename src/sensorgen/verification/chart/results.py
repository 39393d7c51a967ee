"""Questions of a chart, with models and programs from coarse to fine, and their measured answers.

Each answer is compared with a known value, or with the best answer of another program.
"""

import cmath
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Facts, Part, Table, comma_separated
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.core.lazy import by_key
from sensorgen.verification import line_models, peers
from sensorgen.verification.apart import ModelAnswer, Runner, TimedAnswer, Work

OWN = "sensorgen"
DIGITS = 2.0**-52  # no error is less than this
_DEARER, _DEARER_KNOWN = 5.0, 10.0  # how many times longer the next level should take than the last one

Values = tuple[complex, ...]
Level = tuple[str, Work, float]
Step = tuple[str, Callable[[], Any]]  # words, and work that gives numbers, or None where it has no answer
Ladder = tuple[str, Iterable[Step]]


@dataclass(frozen=True)
class Series:
    """A model, or another program, with its levels from coarse to fine; or why it does not apply.

    Attributes
    ----------
    model, program : str
        Name, and the program that it is of.
    levels : iterable of (str, callable, float)
        Words; work that gives an answer, of a module; expected time, 0 where unknown [s].
    why_not : str
        Why it has no levels, or gives nothing.
    """

    model: str
    program: str
    levels: Iterable[Level]
    why_not: str = ""


@dataclass(frozen=True)
class Reference:
    """Value that answers are compared with.

    Attributes
    ----------
    name, program : str
        In words, and the program that it is of.
    value : tuple of complex
        The answer.
    doubt : float
        Relative error of it [-].
    """

    name: str
    program: str
    value: Values
    doubt: float


def largest(answer: Values, known: Values) -> float:
    """Largest relative distance [-]."""
    return max(abs(a / b - 1) for a, b in zip(answer, known, strict=True))


def of_line(answer: Values, known: Values) -> float:
    """The larger one of abs(Z) and of Re Z by itself, at the worst frequency [-]."""
    return max(line_models.differences(answer, known))


def of_modulus(answer: Values, known: Values) -> float:
    """Of abs(Z), at the worst frequency [-]."""
    return max(abs(abs(a) / abs(b) - 1) for a, b in zip(answer, known, strict=True))


@dataclass(frozen=True)
class Question:
    """A quantity of a design, or of a standard scene.

    Attributes
    ----------
    key, title, asked : str
        Name, title of its panel, and the quantity in words.
    series : tuple of Series
        Models and programs.
    references : tuple of Reference
        Those that are known before anything runs; where there are none, answers serve as references.
    measure : callable
        From an answer and a reference to their relative distance.
    composed : callable, optional
        Its references by those of the questions before it, in place of answers.
    """

    key: str
    title: str
    asked: str
    series: tuple[Series, ...]
    references: tuple[Reference, ...] = ()
    measure: Callable[[Values, Values], float] = largest
    composed: Callable[[Mapping[str, Sequence[Reference]]], Iterator[Reference]] | None = None


def of_scene(
    name: str, asked: str, series: Iterable[Series], known: ArrayLike, known_to: float,
    measure: Callable[[Values, Values], float] = largest,
) -> Question:  # fmt: skip
    """A question on a standard scene, whose answer is known from elsewhere to a relative error."""
    reference = Reference("the known value", "elsewhere", _numbers(known), known_to)
    return Question(name, name, asked, tuple(series), (reference,), measure)


def own(ladders: Iterable[Ladder], reasons: Mapping[str, str]) -> Iterator[Series]:
    """Our models by their levels, with the reasons of those that have none, or give nothing."""
    asked = set()
    for model, levels in ladders:
        asked.add(name := model.partition(":")[0])
        works = tuple((words, partial(_answer, work), 0.0) for words, work in levels)
        yield Series(model, OWN, works, reasons.get(name, ""))
    yield from (Series(model, OWN, (), why) for model, why in reasons.items() if model not in asked)


def _answer(work: Callable[[], Any]) -> ModelAnswer:
    value = work()
    return ModelAnswer(() if value is None else _numbers(value))


def _numbers(value: ArrayLike) -> Values:
    return tuple(np.ravel(value).tolist())


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
        Quantity or standard scene; a model or another program, after a colon one of its ways; how fine it was.
    program : str
        "sensorgen", or another one.
    value : str
        The answer, number by number; of bounds the middle.
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
    cold_cpu_s, cold_wall_s : float or None
        Time of the processor and by the clock in a new process with nothing stored, from its start [s].
    warm_cpu_s, warm_wall_s : float
        Solved once more in the same process [s].
    memory_mb : float or None
        Peak of the process [MB].
    front : bool
        Whether nothing is quicker when warm and at least as near.
    """

    question: str
    model: Annotated[str, Column("model")]
    level: Annotated[str, Column("level")]
    program: str
    value: Annotated[str, Column("value", hidden=True)]
    error: Annotated[float, Column("error", digits=2)]
    doubt: Annotated[float, Column("known to", digits=2)]
    stated: Annotated[float | None, Column("stated", digits=2)]
    cold_cpu_s: Annotated[float | None, Column("cold", "s", digits=2)]
    warm_cpu_s: Annotated[float, Column("warm", "s", digits=2)]
    cold_wall_s: Annotated[float | None, Column("cold, clock", "s", digits=2, hidden=True)]
    warm_wall_s: Annotated[float, Column("warm, clock", "s", digits=2, hidden=True)]
    memory_mb: Annotated[float | None, Column("peak", "MB", digits=3)]
    against: Annotated[str, Column("against", hidden=True)]
    independent: Annotated[bool, Column("independent", hidden=True)]
    certified: bool
    contradicted: bool
    front: bool = False

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
class Chart(Displayed):
    """Speed against accuracy.

    Attributes
    ----------
    titles, asked : dict of str to str
        Titles of the questions, and what they ask for.
    points : tuple of Point
        In the order in which they were measured.
    silent : tuple of Silent
        Who gave nothing, or no more.
    unasked : tuple of Silent
        Models that answer other questions, for files alone.
    """

    titles: dict[str, str]
    asked: dict[str, str]
    points: tuple[Point, ...]
    silent: tuple[Silent, ...]
    unasked: tuple[Silent, ...] = ()

    ALT: ClassVar = (
        "Filled marks: the truth lies between bounds; hollow: no bounds. Dashed: Pareto front. Dotted: what the "
        "references are known to; no error is drawn below."
    )

    @property
    def title(self) -> str:
        """Title of its pictures."""
        return "Speed and accuracy of the models"

    def head(self) -> tuple[str, ...]:
        """Conditions of all questions."""
        return ()

    def document(self) -> Iterator[Part]:
        """Conditions, and a table for each question, with its references and who gave nothing."""
        yield from self.head()
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

    def only(self, keys: Collection[str]) -> Self:
        """The chart of some questions."""
        titles = {key: title for key, title in self.titles.items() if key in keys}
        points = tuple(p for p in self.points if p.question in keys)
        silent = tuple(s for s in self.silent if s.question in keys)
        return replace(self, titles=titles, points=points, silent=silent)

    def problems(self) -> Sequence[str]:
        """Models whose error is larger than they state."""
        wrong = [p for p in self.points if p.contradicted]
        return [f"{p.words()}: error {p.error:.2g}, {p.stated:.2g} stated" for p in wrong]

    def csv(self) -> str:
        """All points in one table, and who gave nothing."""
        rows = [vars(one) for one in (*self.points, *self.silent, *self.unasked)]
        names = list(dict.fromkeys(name for row in rows for name in row))
        cells = [tuple(row.get(name) for name in names) for row in rows]
        return comma_separated(Table("chart", "", tuple(map(Column, names)), cells))


def _against(points: Sequence[Point]) -> Iterator[str]:
    """References of a question in words, each with the models that are compared with it."""
    for words, of in by_key((p.against, p) for p in points).items():
        named = "" if of[0].independent else ", which is not independent"
        yield f"against {words}{named}, known to {of[0].doubt:.2g}: {', '.join(dict.fromkeys(p.model for p in of))}"


def measured(
    questions: Iterable[Question], budget_s: float, step: Callable[[str], None], runner: Runner
) -> Chart:  # fmt: skip
    """Ask every model every question.

    Parameters
    ----------
    questions : iterable of Question
        In the order in which they are asked.
    budget_s : float
        A level is not run that should take longer [s].
    step : callable
        Called with the key of each question, and with it and the name of each model before it runs.
    runner : callable
        Runs a piece of work and times it.
    """
    titles, asked = dict[str, str](), dict[str, str]()
    points, silent, best = list[Point](), list[Silent](), dict[str, list[Reference]]()
    for question in questions:
        key, runs = question.key, list[Run]()
        step(key)
        for series in question.series:
            more, why = _climbed(
                series, budget_s, partial(step, f"{key}: {series.model}"), runner, known=bool(question.references)
            )
            runs += more
            silent += [Silent(key, series.model, why)] if why else []
        others = question.composed(best) if question.composed else _from(runs)
        known = best[key] = list(question.references or others)
        titles[key], asked[key] = question.title, question.asked
        if known:
            points += _with_front([_point(question, run, known) for run in runs])
        else:
            why = f"no reference within --budget {budget_s:g}"
            silent += [Silent(key, model, why) for model in dict.fromkeys(run.series.model for run in runs)]
    return Chart(titles, asked, tuple(points), tuple(silent))


def _climbed(
    series: Series, budget_s: float, step: Callable[[], None], runner: Runner, *, known: bool
) -> tuple[list[Run], str]:  # fmt: skip
    """Runs of a model from coarse to fine until the next one would take too long; and why there are no more."""
    done, timed = list[Run](), list[TimedAnswer]()
    least, dearer = (0, _DEARER_KNOWN) if known else (_least(series), _DEARER)
    for level, work, expected_s in series.levels:
        likely_s = expected_s or dearer * _last_s(timed)
        if likely_s > budget_s and len(done) >= least:
            return done, f"{level}: some {likely_s:.2g} s, more than --budget {budget_s:g}".removeprefix(": ")
        step()
        try:
            timed.append(_finite(runner(work)))
        except (SensorgenError, MemoryError) as error:
            return done, f"{level}: {error}".removeprefix(": ")
        if timed[-1].answer.value:
            done.append(Run(series, level, timed[-1]))
    return done, "" if done else series.why_not


def _finite(timed: TimedAnswer) -> TimedAnswer:
    """An answer; OutOfRange where it is no number."""
    if not all(map(cmath.isfinite, timed.answer.value)):
        raise OutOfRange(f"its answer is {timed.answer.value[0]:g}")
    return timed


def _least(series: Series) -> int:
    """Levels of another program, whose difference is its doubt: without it there is no reference."""
    return 0 if series.program == OWN or series.model in peers.SLOW_TO_CONVERGE else 2


def _last_s(timed: Sequence[TimedAnswer]) -> float:
    """Time of the last run, without the start of a process and loading of libraries as far as all runs have it [s]."""
    return timed[-1].warm.cpu_s + timed[-1].started_s() - min(one.started_s() for one in timed) if timed else 0.0


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
    finest, before = levels[-1], [level for level in levels[-2:-1] if level.value[0]]
    changes = [abs(finest.value[0] / level.value[0] - 1) for level in before]
    doubts = changes if finest.stated is None else [*changes, finest.stated]
    if doubts and finest.value[0] and not finest.certified and series.model not in peers.SLOW_TO_CONVERGE:
        yield Reference(f"the finest {series.model}", series.program, finest.value, max(*doubts, DIGITS))


def best_of(references: Sequence[Reference], program: str) -> Reference:
    """The least doubtful one that is not of a program; where there is none, the least doubtful one of all."""
    others = [r for r in references if r.program != program]
    return min(others or references, key=lambda r: r.doubt)


def _point(question: Question, run: Run, references: Sequence[Reference]) -> Point:
    """A run beside the best answer of another program; beside one of its own program where there is no other."""
    series, timed, answer = run.series, run.timed, run.timed.answer
    reference = best_of(references, series.program)
    off = question.measure(answer.value, reference.value)
    contradicted = False
    if answer.stated is not None:  # a share of the answer
        contradicted = question.measure(reference.value, answer.value) > answer.stated + reference.doubt
        if answer.certified:  # the bound that is further off
            ends = ((answer.value[0] * end,) for end in (1 - answer.stated, 1 + answer.stated))
            off = max(question.measure(end, reference.value) for end in ends)
    value = " ".join(f"{v.real if v.imag == 0 else v:.15g}" for v in answer.value)
    cold_cpu_s, cold_wall_s = (timed.cold.cpu_s, timed.cold.wall_s) if timed.cold else (None, None)
    return Point(
        question.key, series.model, run.level, series.program, value, max(off, reference.doubt), reference.doubt,
        answer.stated, cold_cpu_s, timed.warm.cpu_s, cold_wall_s, timed.warm.wall_s, timed.memory_mb,
        reference.name, reference.program != series.program, answer.certified, contradicted,
    )  # fmt: skip


def _with_front(points: Sequence[Point]) -> Iterator[Point]:
    """Points, marked where none is quicker and at least as near."""
    best = unbeaten((p.warm_cpu_s, p.error) for p in points)
    return (replace(p, front=(p.warm_cpu_s, p.error) in best) for p in points)


def unbeaten(pairs: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Pairs of cost and error of which no other has less of both, by their cost.

    >>> unbeaten([(2.0, 0.1), (1.0, 0.3), (3.0, 0.2)])
    [(1.0, 0.3), (2.0, 0.1)]
    """
    front: list[tuple[float, float]] = []
    for cost, error in sorted(pairs):
        if error < (front[-1][1] if front else math.inf):
            front.append((cost, error))
    return front
