"""Kinds of words on the command line: lengths with their units, and names from a list."""

from collections.abc import Callable, Iterable
from math import inf, isnan
from pathlib import Path
from typing import Any

import click

from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName, within


class Word(click.ParamType):  # type: ignore[type-arg]
    """A word as typed, read by :meth:`read`; errors name the option."""

    def read(self, text: str) -> Any:
        """Read what was typed."""
        raise NotImplementedError

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Read a text; a value that is none was read before."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except BadInput as error:
            raise error.within(_said(param)) from None


class Length(Word):
    """A length, in millimetres unless it names another unit."""

    name = "mm"

    def read(self, text: str) -> float:
        """Read a length [mm]."""
        return units.length_mm(text)


class TipWords(Word):
    """A tip: lengths, and what it is made of, with commas."""

    name = "WIDTH,BLOCK,HEIGHT"

    def read(self, text: str) -> dict[str, Any]:
        """Read ``5mm,stiff`` or ``10,ninjaflex,10`` as keys of a design file's tip."""
        tip: dict[str, Any] = {}
        for word in text.replace(" ", ",").split(","):
            key = "block" if word[:1].isalpha() else "height_mm" if "block" in tip else "width_mm"
            if not word or key in tip:
                raise BadInput(f"{text!r:.60}: expected as 10mm, 5mm,stiff, even or 10mm,ninjaflex,10mm")
            tip[key] = word if key == "block" else units.length_mm(word)
        return tip


class NumberRange(click.FloatRange):
    """A number within limits; ``nan``, which is below no limit, is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read a number as typed."""
        number = float(super().convert(value, param, ctx))
        return self.fail("nan is not a number", param, ctx) if isnan(number) else number


class Values(Word):
    """Several numbers of one quantity, none negative: ``0:6:0.1``, ``3``, ``1,2,5``, with or without units."""

    def __init__(self, quantity: units.Quantity, *, zero: bool) -> None:
        """Numbers of ``quantity``, 0 with ``zero``."""
        self.quantity, self.zero, self.name = quantity, zero, f"START:STOP:STEP|{quantity.name.upper()},..."

    def read(self, text: str) -> Any:
        """Read the numbers, in the quantity's first unit, rising."""
        numbers = units.values(text, self.quantity)
        if numbers[0] < 0 or (numbers[0] == 0 and not self.zero):
            raise BadInput(f"{numbers[0]:g}; expected {'0 or more' if self.zero else 'above 0'}")
        return numbers


class ShownValue(Values):
    """One number of a quantity."""

    def __init__(self, quantity: units.Quantity, *, zero: bool, unit: str) -> None:
        """Number of ``quantity`` in a unit, 0 with ``zero``."""
        super().__init__(quantity, zero=zero)
        self.name = unit.upper()

    def read(self, text: str) -> float:
        """Read the number, in the quantity's first unit."""
        numbers = super().read(text)
        if len(numbers) != 1:
            raise BadInput(f"{len(numbers)} values; expected one")
        return float(numbers[0])


class ShownShare(Word):
    """A share of one, also in percent."""

    name = "share"

    def read(self, text: str) -> float:
        """Read ``0.2`` or ``20%`` [-]."""
        try:
            return float(text[:-1]) / 100 if text.endswith("%") else float(text)
        except ValueError:
            raise BadInput(f"{text!r} is not a share; expected 0.2 or 20%") from None


class ProperShare(ShownShare):
    """A share that is neither nothing nor all."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read a share between 0 and 1 [-]."""
        share = float(super().convert(value, param, ctx))
        if not 0 < share < 1:
            raise OutOfRange(f"{_said(param)} {share:g}; expected a share above 0 and below 1, as in 0.1%")
        return share


class Ratio(Word):
    """A number above 0, as a relative width or error."""

    name = "number"

    def __init__(self, expected: str = "a number above 0, as 1e-4") -> None:
        """Number that is ``expected``."""
        self.expected = expected

    def read(self, text: str) -> float:
        """Read ``1e-4`` [-]."""
        try:
            number = float(text)
        except ValueError:
            raise BadInput(f"{text!r} is not a number; expected {self.expected}") from None
        if not 0 < number < inf:
            raise BadInput(f"{number:g}; expected {self.expected}")
        return number


class Pad(Word):
    """A rectangle on the sheet, or a stretch of an edge where it has no width."""

    name = "X0-X1,Y0-Y1"

    def read(self, text: str) -> Any:
        """Read ``90-100,0-10``, or ``0,20-60`` for a stretch of an edge [mm]."""
        spans = [span.split("-") for span in text.split(",")]
        if len(spans) != 2 or any(len(span) > 2 for span in spans):
            raise BadInput(f"{text!r}; expected {self.name} in mm, as in 90-100,0-10, or 0,20-60 on an edge")
        with within(repr(text)):
            return tuple((units.length_mm(span[0]), units.length_mm(span[-1])) for span in spans)


class Png(Word):
    """A picture to draw; refused before the work where it cannot be made."""

    name = "FILE.png"

    def read(self, text: str) -> Path:
        """Take a file that ends in .png; raise MissingValue where Matplotlib is not installed."""
        if not text.lower().endswith(".png"):
            raise BadInput(f"{text}: expected a file that ends in .png")
        from sensorgen.analysis.plots.figure import needed

        needed("matplotlib")
        return Path(text)


KINDS: dict[str, Word] = {  # by the names that annotations have for them
    "length": Length(), "share": ShownShare(), "proper share": ProperShare(), "ratio": Ratio(),
    "seconds": Ratio("seconds above 0"), "tip": TipWords(), "pad": Pad(), "png": Png(),
}  # fmt: skip


def pairs(words: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    """Words of the form KEY=VALUE, taken apart."""
    for word in words:
        if "=" not in word.strip("="):
            raise BadInput(f"{option} {word!r}: expected KEY=VALUE")
    return [(k.strip(), v.strip()) for k, _, v in (word.partition("=") for word in words)]


def completed(names: Callable[[], Iterable[str]]) -> Callable[[click.Context, click.Parameter, str], list[Any]]:
    """Completion of an option by the shell: the names that begin as typed, looked up only then."""
    return lambda ctx, param, begun: [name for name in names() if name.startswith(begun)]  # noqa: ARG005


class OneOf(click.Choice):  # type: ignore[type-arg]
    """One name of a list; the nearest is offered where another is given."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:  # noqa: ARG002
        """Take a name that is in the list."""
        if value not in self.choices:
            raise UnknownName(_said(param), str(value), self.choices)
        return str(value)

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None = None) -> str:  # noqa: ARG002
        """Nothing: the message names the argument by its choices."""
        return ""


def _said(param: click.Parameter | None) -> str:
    """A parameter as the user types it."""
    if isinstance(param, click.Option):
        return max(param.opts, key=len)
    return param.name or "" if param else ""
