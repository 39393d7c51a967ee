"""Kinds of words on the command line: lengths with their units, and names from a list."""

from collections.abc import Callable, Iterable, Sequence
from math import isnan
from typing import Any

import click

from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName


class Length(click.ParamType):  # type: ignore[type-arg]
    """A length, in millimetres unless it names another unit."""

    name = "mm"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ARG002
        """Read a length as typed [mm]."""
        if isinstance(value, float):
            return value
        try:
            return units.length_mm(value)
        except BadInput as error:
            raise error.within(_said(param)) from None


class TipWords(click.ParamType):  # type: ignore[type-arg]
    """A tip: lengths, and what it is made of, with commas."""

    name = "WIDTH,BLOCK,HEIGHT"

    def convert(
        self,
        value: Any,
        param: click.Parameter | None,
        ctx: click.Context | None,  # noqa: ARG002
    ) -> dict[str, Any]:
        """Read ``5mm,stiff`` or ``10,ninjaflex,10`` as keys of a design file's tip."""
        if isinstance(value, dict):
            return value
        found: dict[str, Any] = {}
        for word in value.replace(" ", ",").split(","):
            key = "block" if word[:1].isalpha() else "height_mm" if "block" in found else "width_mm"
            if not word or key in found:
                raise BadInput(
                    f"{_said(param)} {value!r:.60}: expected as 10mm, 5mm,stiff, even or 10mm,ninjaflex,10mm"
                )
            try:
                found[key] = word if key == "block" else units.length_mm(word)
            except BadInput as error:
                raise error.within(_said(param)) from None
        return found


class NumberRange(click.FloatRange):
    """A number within limits; ``nan``, which is below no limit, is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read a number as typed."""
        number = float(super().convert(value, param, ctx))
        return self.fail("nan is not a number", param, ctx) if isnan(number) else number


class Values(click.ParamType):  # type: ignore[type-arg]
    """Several numbers of one quantity, none negative: ``0:6:0.1``, ``3``, ``1,2,5``, with or without units."""

    def __init__(self, quantity: units.Quantity, *, zero: bool) -> None:
        """Numbers of ``quantity``; ``zero`` says whether 0 is one of them."""
        self.quantity, self.zero, self.name = quantity, zero, f"START:STOP:STEP|{quantity.name.upper()},..."

    def convert(
        self,
        value: Any,
        param: click.Parameter | None,
        ctx: click.Context | None,  # noqa: ARG002
    ) -> tuple[float, ...]:
        """Read the numbers, in the quantity's first unit, rising."""
        if isinstance(value, tuple):
            return value
        try:
            found = units.values(value, self.quantity)
        except BadInput as error:
            raise error.within(_said(param)) from None
        if found[0] < 0 or (found[0] == 0 and not self.zero):
            raise BadInput(f"{_said(param)}: {found[0]:g}; expected {'0 or more' if self.zero else 'above 0'}")
        return found


class Share(click.ParamType):  # type: ignore[type-arg]
    """A share of one, also in percent."""

    name = "share"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ARG002
        """Read ``0.2`` or ``20%`` [-]."""
        if isinstance(value, float):
            return value
        try:
            return float(value[:-1]) / 100 if value.endswith("%") else float(value)
        except ValueError:
            raise BadInput(f"{_said(param)}: {value!r} is not a share; expected 0.2 or 20%") from None


class Ratio(click.ParamType):  # type: ignore[type-arg]
    """A relative width or error: a number above 0."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:  # noqa: ARG002
        """Read ``1e-4`` [-]."""
        try:
            found = float(value)
        except ValueError:
            raise BadInput(f"{_said(param)}: {value!r} is not a number; expected one above 0, as 1e-4") from None
        if not 0 < found < float("inf"):
            raise BadInput(f"{_said(param)}: {found:g}; expected a number above 0, as 1e-4")
        return found


class Pad(click.ParamType):  # type: ignore[type-arg]
    """A rectangle on the sheet, or a stretch of an edge where it has no width."""

    name = "X0-X1,Y0-Y1"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Read ``90-100,0-10``, or ``0,20-60`` for a stretch of an edge [mm]."""
        spans = [span.split("-") for span in value.split(",")]
        if len(spans) != 2 or any(len(span) > 2 for span in spans):
            raise BadInput(f"--pad {value!r}; expected {self.name} in mm, as in 90-100,0-10, or 0,20-60 on an edge")
        try:
            return tuple((units.length_mm(span[0]), units.length_mm(span[-1])) for span in spans)
        except BadInput as error:
            raise error.within(f"--pad {value!r}") from None


class Png(click.ParamType):  # type: ignore[type-arg]
    """A picture to draw; where it could not be made, that is said before the work."""

    name = "FILE.png"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:  # noqa: ARG002
        """Take a file that ends in .png; raise MissingValue where Matplotlib is not installed."""
        if not value.lower().endswith(".png"):
            raise BadInput(f"{_said(param)} {value}: expected a file that ends in .png")
        from sensorgen.analysis.plots.libraries import needed

        needed("matplotlib")
        return str(value)


def one(option: str, values: Sequence[float]) -> float:
    """The only one of the numbers that an option was given."""
    if len(values) != 1:
        raise BadInput(f"{option}: {len(values)} values; expected one")
    return values[0]


def proper(option: str, share: float) -> float:
    """A share that is neither nothing nor all [-]."""
    if not 0 < share < 1:
        raise OutOfRange(f"{option} {share:g}; expected a share above 0 and below 1, as in 0.1%")
    return share


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
