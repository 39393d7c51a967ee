"""Questions: models and programs with their levels from coarse to fine, and what their answers are compared with."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.verification import line_models
from sensorgen.verification.apart import ModelAnswer, Work

OWN = "sensorgen"
DIGITS = 2.0**-52  # no error is less than this

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
