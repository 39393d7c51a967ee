"""Verdicts on numbers of the thesis, by our own."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import floor, log10
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.verification.thesis.items import EXACT, ThesisItem

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
    mended, copied = [part.mended() for part in wrong], any(part.copied for part in wrong)
    if all(off <= item.tolerance for off in mended) and item.erratum and not copied:
        return ItemVerdict(MISPRINT, f"(corrected: to {digits(max(mended))})")
    if item.because and not copied and all(_as_announced(part, item) for part in wrong):
        worst = max(wrong, key=lambda part: abs(part.off()))
        return ItemVerdict(DIFFERS, f"({_how_far(worst)}), because {item.because}")
    named = ", ".join(f"{part.name} {share(part.off())}" for part in wrong)
    return ItemVerdict(UNEXPLAINED, f"(off: {named})")


def _how_far(part: ItemPart) -> str:
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
