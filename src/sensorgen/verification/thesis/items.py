"""Numbered items of the thesis, and claims of its text, computed anew and judged.

Items are kept by chapter, in our own words: the files in ``chapters/``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from math import floor, log10
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from sensorgen.core import lazy as registry
from sensorgen.core import yamlfile
from sensorgen.core.errors import MissingValue, SensorgenError, within
from sensorgen.core.records import Strict, checked
from sensorgen.verification.thesis import checks

EXACT = 1e-6
CHAPTERS = ("1", "2", "3", "4", "5", "6", "7", "B", "C", "D")
Kind = Literal["equation", "figure", "table", "claim"]
KINDS: tuple[Kind, ...] = ("equation", "figure", "table", "claim")

Text = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]*$", examples=["one line without control characters"])]

AGREES = "agrees"
MISPRINT = "misprint confirmed"
DIFFERS = "differs"
TRANSCRIBED = "transcribed"
NOT_COVERED = "not covered"
LOST = "cannot be reproduced"
UNEXPLAINED = "unexplained"  # an error of ours until somebody knows better
WORDS = (AGREES, MISPRINT, DIFFERS, TRANSCRIBED, NOT_COVERED, LOST, UNEXPLAINED)
JUDGED = (AGREES, MISPRINT, DIFFERS)  # compared with something that does not come from the number itself

MOST_DIGITS = 9  # what is left is rounding, which machines do differently

Numbers = NDArray[Any]


class ThesisItem(Strict):
    """One numbered thing, or a claim of a section's text.

    Attributes
    ----------
    number, says : str
        As numbered; what it says.
    check : str
        Module and function in ``checks/`` that computes it, or "".
    given : dict
        Arguments of that function: mostly the thesis's own values.
    tolerance, why_tolerance : float, str
        Relative distance up to which the thesis and we agree [-]; why a larger one than rounding is right.
    erratum, because : str
        What is misprinted; why a difference is no misprint. Or "".
    off, within : dict of str to float, float
        By part, how far the thesis then is from ours, and the tolerance of that, relative where it is above 1 [-].
    lost, uncovered : str
        Why it cannot be reproduced; why nothing here covers it. What a check then gives is shown, not judged.
    """

    number: Text
    says: Text
    check: Annotated[str, Field(pattern=r"^([a-z]+\.[a-z_]+)?$", examples=["line.current"])] = ""
    given: dict[str, Any] = Field(default={})
    tolerance: float = EXACT
    why_tolerance: Text = ""
    off: dict[str, float] = Field(default={})
    within: float = 0.0
    erratum: Text = ""
    because: Text = ""
    lost: Text = ""
    uncovered: Text = ""


class Chapter(Strict):
    """A chapter or appendix with all its items."""

    title: Text
    equations: list[ThesisItem] = Field(default=[])
    figures: list[ThesisItem] = Field(default=[])
    tables: list[ThesisItem] = Field(default=[])
    claims: list[ThesisItem] = Field(default=[])

    def items(self) -> Iterator[tuple[Kind, ThesisItem]]:
        """All of them, with what they are."""
        for kind, listed in zip(KINDS, (self.equations, self.figures, self.tables, self.claims), strict=True):
            yield from ((kind, item) for item in listed)


@cache
def chapter(name: str) -> Chapter:
    """Read a chapter of ``CHAPTERS``."""
    file = f"chapters/{name}.yaml"
    data = yamlfile.parse((resources.files("sensorgen.verification.thesis") / file).read_text("utf-8"), file)
    with within(file):
        return checked(Chapter, data)


def table(number: str) -> dict[str, Any]:
    """Values of a table of the thesis, as the chapters keep it."""
    return next(item.given for item in chapter(number.partition(".")[0]).tables if item.number == number)


@dataclass(frozen=True)
class ItemPart:
    """One quantity of an item.

    Attributes
    ----------
    name, unit : str
        What it is, and the unit of all three.
    printed : number or array, optional
        The thesis's value, or its equation evaluated as printed; None where nothing was printed.
    ours : number or array
        From a model of this package.
    corrected : number or array, optional
        The equation, or the value, with its misprint put right.
    scale : float
        What counts as large, where the quantity itself is 0.
    shown : int
        Digits to show: fewer where a solver's own last ones differ from machine to machine.
    copied : bool
        Whether ours was typed from the same place of the thesis: both copies have to agree, which confirms nothing.
    limit : bool
        Whether the thesis gives a limit, with which anything below agrees.
    """

    name: str
    unit: str
    ours: ArrayLike
    printed: ArrayLike | None = None
    corrected: ArrayLike | None = None
    scale: float = 0.0
    shown: int = 5
    copied: bool = False
    limit: bool = False

    def off(self) -> float:
        """Difference of the thesis from ours, as a share of ours; by its sign more or less, where both are real [-]."""
        if self.printed is None:
            return 0.0
        if self.limit and self.ours <= self.printed:  # type: ignore[operator]
            return 0.0
        printed, ours = np.broadcast_arrays(np.asarray(self.printed), np.asarray(self.ours))
        if printed.size == 1 and np.isrealobj(printed) and np.isrealobj(ours) and ours.item():
            return float((printed.item() - ours.item()) / max(abs(ours.item()), self.scale))
        return self._distance(printed)

    def mended(self) -> float:
        """Distance of the corrected value from ours, as a share of it [-]."""
        return np.inf if self.corrected is None else self._distance(np.asarray(self.corrected))

    def _distance(self, other: Numbers) -> float:
        """By the largest of all numbers, so that a 0 among them is none of its own."""
        ours = np.asarray(self.ours)
        size = max(float(np.max(abs(ours))), self.scale)
        far = float(np.max(abs(other - ours)))
        return far / size if size else (0.0 if far == 0 else np.inf)


Parts = Iterator[ItemPart]


@dataclass(frozen=True)
class ItemVerdict:
    """One of ``WORDS``, and what it rests on."""

    word: str
    why: str = ""

    def text(self) -> str:
        """Both in one line."""
        return f"{self.word}{self.why and ' '}{self.why}"


def judged(item: ThesisItem, parts: Sequence[ItemPart]) -> ItemVerdict:
    """The verdict over all parts of an item: the worst of them decides.

    Parameters
    ----------
    item : ThesisItem
        A misprint or a difference that is announced has to be found, and one that is found has to be announced.
    parts : sequence of ItemPart
        What was computed.
    """
    wrong = [part for part in parts if not abs(part.off()) <= item.tolerance]
    copies = sum(part.copied for part in parts)
    worst = _explained(item, wrong) if wrong else _agreeing(item, parts, copies)
    return replace(worst, why=f"{worst.why}; transcribed: {copies}") if copies and worst.word in JUDGED else worst


def _agreeing(item: ThesisItem, parts: Sequence[ItemPart], copies: int) -> ItemVerdict:
    if item.off or any(part.corrected is not None for part in parts):
        return ItemVerdict(UNEXPLAINED, "(what is announced as wrong agrees with ours)")
    if copies and not compared(parts):
        return ItemVerdict(TRANSCRIBED, f"({copies} value{'s' * (copies > 1)}, which nothing else gives)")
    off = [abs(part.off()) for part in compared(parts) if not part.limit]
    return ItemVerdict(AGREES, f"to {digits(max(off))}" if off else "with the limit")


def _explained(item: ThesisItem, wrong: Sequence[ItemPart]) -> ItemVerdict:
    if not any(part.copied for part in wrong):
        mended = float(np.max([part.mended() for part in wrong]))  # nan where one of them is
        if item.erratum and mended <= item.tolerance:
            return ItemVerdict(MISPRINT, f"(corrected: to {digits(mended)})")
        if item.because and all(_as_announced(part, item) for part in wrong):
            return ItemVerdict(DIFFERS, f"({_how_far(wrong)}), because {item.because}")
    named = ", ".join(f"{part.name} {share(part.off())}" for part in wrong)
    return ItemVerdict(UNEXPLAINED, f"(off: {named})")


def _how_far(wrong: Sequence[ItemPart]) -> str:
    part = max(wrong, key=lambda part: abs(part.off()))
    if part.printed is not None and np.size(part.printed) > 1:
        return f"off by {100 * part.off():.3g} % of the largest"
    return f"the thesis has {share(part.off())}"


def _as_announced(part: ItemPart, item: ThesisItem) -> bool:
    known = item.off.get(part.name, np.nan)
    return bool(abs(part.off() - known) <= item.within * max(1.0, abs(known)))


def compared(parts: Sequence[ItemPart]) -> list[ItemPart]:
    """Those that compare the thesis with something that does not come from the number itself."""
    return [part for part in parts if part.printed is not None and not part.copied]


def digits(off: float) -> str:
    """Number of leading digits that two numbers have in common, in words.

    >>> digits(0.04), digits(2e-7), digits(1e-14)
    ('1 digit', '6 digits', '9 digits or more')
    """
    count = MOST_DIGITS if off <= 10.0**-MOST_DIGITS else max(floor(-log10(off)), 0)
    return f"{count} digit{'' if count == 1 else 's'}{' or more' if count == MOST_DIGITS else ''}"


def share(off: float) -> str:
    """A relative difference as a person would say it, the thesis's from ours.

    >>> share(-0.252), share(1.2), share(8.5), share(float("nan"))
    ('25.2 % less', '120 % more', '9.5 times as much', 'no number')
    """
    if off != off:
        return "no number"
    return (
        f"{off + 1:.3g} times as much" if off > 2 - EXACT else f"{abs(100 * off):.3g} % {'less' if off < 0 else 'more'}"
    )


@dataclass(frozen=True)
class ReproducedItem:
    """An item with what came of it."""

    chapter: str
    kind: Kind
    item: ThesisItem
    parts: tuple[ItemPart, ...]
    verdict: ItemVerdict

    def name(self) -> str:
        """As one would cite it: ``Table 3.1``."""
        return f"{'Eq.' if self.kind == 'equation' else self.kind.capitalize()} {self.item.number}"


def rows(started: Callable[[str], None] = lambda _: None) -> list[ReproducedItem]:
    """Every item of every chapter, in order.

    Parameters
    ----------
    started : callable
        Called with each chapter's name before it is computed.
    """
    reproduced = []
    for name in CHAPTERS:
        started(name)
        reproduced += [row(name, kind, item) for kind, item in chapter(name).items()]
    return reproduced


def row(of_chapter: str, kind: Kind, item: ThesisItem) -> ReproducedItem:
    """One item, computed.

    Notes
    -----
    A value or a solver that is missing here leaves it uncovered; any other refusal of a model is unexplained.
    """
    try:
        parts = tuple(_computed(item.check, item.given)) if item.check else ()
    except MissingValue as error:
        return ReproducedItem(of_chapter, kind, item, (), ItemVerdict(NOT_COVERED, f"({error})"))
    except SensorgenError as error:
        return ReproducedItem(of_chapter, kind, item, (), ItemVerdict(UNEXPLAINED, f"({error})"))
    if item.lost:
        verdict = ItemVerdict(LOST, f"({item.lost})")
    elif item.uncovered:
        verdict = ItemVerdict(NOT_COVERED, f"({item.uncovered})")
    else:
        verdict = judged(item, parts)
    return ReproducedItem(of_chapter, kind, item, parts, verdict)


def _computed(check: str, given: Mapping[str, Any]) -> Iterable[ItemPart]:
    name, _, check = check.partition(".")
    parts: Iterable[ItemPart] = getattr(registry.load(checks, name), check)(**given)
    return parts
