"""Numbered items of the thesis, and claims of its text, by chapter: the files in ``chapters/``, in our own words."""

from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import within
from sensorgen.core.records import Strict, checked

EXACT = 1e-6
CHAPTERS = ("1", "2", "3", "4", "5", "6", "7", "B", "C", "D")
Kind = Literal["equation", "figure", "table", "claim"]
KINDS: tuple[Kind, ...] = ("equation", "figure", "table", "claim")

Text = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]*$", examples=["one line without control characters"])]


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
