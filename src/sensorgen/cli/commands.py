"""Commands made from functions: parameters are options of a kind, docstrings the help, and results are shown."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import is_dataclass, replace
from functools import partial
from inspect import Parameter, getdoc, signature
from math import inf, isnan
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_args, get_origin

import click
from click.shell_completion import CompletionItem

from sensorgen.cli import render
from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName, within
from sensorgen.core.options import Argument, Option, Without

if TYPE_CHECKING:
    from sensorgen.core.document import Part


class Word(click.ParamType):  # type: ignore[type-arg]
    """A word as typed, read by a function; errors name the option."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        """Word with a placeholder, and what reads it."""
        self.name, self.read = name, read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Read a text; a value that is none was read before."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except BadInput as error:
            raise error.within(_said(param)) from None


def _tip(text: str) -> dict[str, Any]:
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
        super().__init__(f"START:STOP:STEP|{quantity.name.upper()},...", self.numbers)
        self.quantity, self.zero = quantity, zero

    def numbers(self, text: str) -> Any:
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
        self.name, self.read = unit.upper(), self.number

    def number(self, text: str) -> float:
        """Read the number, in the quantity's first unit."""
        numbers = self.numbers(text)
        if len(numbers) != 1:
            raise BadInput(f"{len(numbers)} values; expected one")
        return float(numbers[0])


def _share(text: str) -> float:
    """Read ``0.2`` or ``20%`` [-]."""
    try:
        return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        raise BadInput(f"{text!r} is not a share; expected 0.2 or 20%") from None


class ProperShare(Word):
    """A share that is neither nothing nor all."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read a share between 0 and 1 [-]."""
        share = float(super().convert(value, param, ctx))
        if not 0 < share < 1:
            raise OutOfRange(f"{_said(param)} {share:g}; expected a share above 0 and below 1, as in 0.1%")
        return share


def _above_0(text: str, expected: str = "a number above 0, as 1e-4") -> float:
    """Read ``1e-4`` [-]."""
    try:
        number = float(text)
    except ValueError:
        raise BadInput(f"{text!r} is not a number; expected {expected}") from None
    if not 0 < number < inf:
        raise BadInput(f"{number:g}; expected {expected}")
    return number


_PAD = "X0-X1,Y0-Y1"


def _pad(text: str) -> Any:
    """Read a rectangle on the sheet, ``90-100,0-10``, or ``0,20-60`` for a stretch of an edge [mm]."""
    spans = [span.split("-") for span in text.split(",")]
    if len(spans) != 2 or any(len(span) > 2 for span in spans):
        raise BadInput(f"{text!r}; expected {_PAD} in mm, as in 90-100,0-10, or 0,20-60 on an edge")
    with within(repr(text)):
        return tuple((units.length_mm(span[0]), units.length_mm(span[-1])) for span in spans)


def _png(text: str) -> Path:
    """Take a file that ends in .png; raise MissingValue before the work where Matplotlib is not installed."""
    if not text.lower().endswith(".png"):
        raise BadInput(f"{text}: expected a file that ends in .png")
    from sensorgen.analysis.plots.figure import needed

    needed("matplotlib")
    return Path(text)


_ENDINGS = {".3mf", ".csv", ".gcode", ".html", ".json", ".md", ".step", ".stl", ".svg", ".txt", ".yaml", ".zip"}


def _folder(text: str) -> Path:
    """Take any name of a folder to write into but that of a file that sensorgen writes."""
    folder = Path(text)
    if folder.suffix.lower() in _ENDINGS and not folder.is_dir():
        raise BadInput(f"{text!r} is the name of a file; expected a folder, in which files are named by the design")
    return folder


KINDS: dict[str, Word] = {  # by the names that annotations have for them
    "length": Word("mm", units.length_mm), "share": Word("share", _share), "png": Word("FILE.png", _png),
    "proper share": ProperShare("share", _share), "ratio": Word("number", _above_0), "pad": Word(_PAD, _pad),
    "seconds": Word("number", partial(_above_0, expected="seconds above 0")), "folder": Word("DIR", _folder),
    "tip": Word("WIDTH,BLOCK,HEIGHT", _tip),
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


Work = Callable[..., Any]
HELP: dict[str, Any] = {"help_option_names": ["-h", "--help"]}  # click keeps the option that a first call made
_SECTION = re.compile(r"(?:^|\n\n)(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n[A-Z][a-z]+\n-+\n|\Z)", re.DOTALL)
_ENTRY = re.compile(r"^(\S[^\n]*)\n?((?:    [^\n]*\n?)*)", re.MULTILINE)
_UNIT = re.compile(r"_(mm|n|hz|kpa|s|ohm|deg)$")
_QUANTITIES = {"mm": units.LENGTH_MM, "n": units.FORCE_N, "hz": units.FREQUENCY_HZ}


class _Entry(NamedTuple):
    """Entry of a docstring: flags, placeholder and help of a parameter."""

    flags: tuple[str, ...] = ()
    metavar: str = ""
    about: str = ""

    def option(self, name: str, stated: Option) -> Option:
        """An option with what the docstring has and its annotation does not state."""
        flags = stated.flags or self.flags or (flag_of(name),)
        return replace(
            stated, flags=flags, about=stated.about or self.about, metavar=stated.metavar or self.metavar or None
        )


def described(work: Work) -> tuple[str, dict[str, _Entry]]:
    """Help and entries of a docstring."""
    text = getdoc(work) or ""
    section = _SECTION.search(text)
    if section is None:
        return text, {}
    entries = {}
    for head, about in _ENTRY.findall(section[1]):
        names, _, metavar = head.partition(" : ")
        name, *flags = names.split(", ")
        typed = not metavar[:1].islower() and " or " not in metavar  # no type of Python
        entries[name] = _Entry(tuple(flags), metavar * typed, " ".join(about.split()))
    return text[: section.start()], entries


def options_of(work: Work, without: Collection[str] = ()) -> list[click.Parameter]:
    """Options and arguments of the parameters of a function, or of the fields of a dataclass, in their order.

    A parameter whose type is a dataclass stands for the options of its fields. One whose annotation is a text has none.
    """
    entries = described(work)[1]
    parameters = (one for name, one in signature(work).parameters.items() if name not in without)
    record = _is_record(work)
    return [option for one in parameters for option in _options(one, entries.get(one.name, _Entry()), of_record=record)]


def _options(parameter: Parameter, entry: "_Entry", *, of_record: bool) -> Sequence[click.Parameter]:
    kind, stated = _stated(parameter)
    if isinstance(kind, str):
        return ()
    if _is_record(kind):
        return options_of(kind, stated.names if isinstance(stated, Without) else ())
    if isinstance(stated, Argument) or (parameter.kind is not Parameter.KEYWORD_ONLY and not of_record):
        return [_argument(parameter, kind, stated or Argument(), entry)]
    return [_option(parameter, kind, entry.option(parameter.name, stated or Option()))]


def arguments(work: Work, given: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of a function for what was typed; what was not typed keeps the function's own default."""
    values: dict[str, Any] = {}
    for parameter in signature(work).parameters.values():
        kind, _ = _stated(parameter)
        if _is_record(kind):
            values[parameter.name] = kind(**arguments(kind, given))
        elif given.get(parameter.name) not in (None, ()):
            values[parameter.name] = given[parameter.name]
    return values


def _stated(parameter: Parameter) -> tuple[Any, Any]:
    """Type of a parameter, and what its annotation states about the command line."""
    kind = parameter.annotation
    return get_args(kind) if get_origin(kind) is Annotated else (kind, None)


def _is_record(kind: Any) -> bool:
    return isinstance(kind, type) and is_dataclass(kind)


def _plain(kind: Any) -> tuple[Any, bool]:
    """Type of one value, and whether there may be several."""
    if get_origin(kind) is UnionType:
        kind = next(one for one in get_args(kind) if one is not NoneType)
    return (get_args(kind)[0], True) if get_origin(kind) is tuple else (kind, False)


def _argument(parameter: Parameter, kind: Any, stated: Argument, entry: _Entry) -> click.Argument:
    plain, many = _plain(kind)
    return click.Argument(
        [parameter.name], type=_type(plain, stated.kind) or plain, metavar=entry.metavar or None,
        nargs=-1 if many else 1, required=parameter.default is Parameter.empty,
        **{} if parameter.default in (Parameter.empty, None, ()) else {"default": parameter.default},
    )  # fmt: skip


def _option(parameter: Parameter, kind: Any, stated: Option) -> click.Option:
    plain, many = _plain(kind)
    words = _type(plain, stated.kind) or _quantity(parameter.name, plain, stated, many=many)
    of_quantity, either = isinstance(words, Values), "/" in stated.flags[-1]
    more = _default(stated.typed if of_quantity else parameter.default, stated.typed, either=either)
    if plain is bool and not either:
        more["is_flag"] = True
    else:
        more |= {"type": words or plain, "multiple": many and not of_quantity}
    names = [*stated.flags, parameter.name]
    return click.Option(names, help=stated.about, metavar=stated.metavar, **more, **stated.more)


def flag_of(name: str) -> str:
    """Flag of a parameter, without its unit: ``hang_height_mm`` is ``--hang-height``."""
    return "--" + _UNIT.sub("", name).replace("_", "-")


def _default(default: Any, typed: str | None, *, either: bool) -> dict[str, Any]:
    """Default of an option for click; nothing where it says nothing to a user, so that Python's own applies."""
    default = default if typed is None else typed
    shown = default is not False and default not in (Parameter.empty, None, "", ())
    return {"default": default, "show_default": shown} if shown or either else {}


def _quantity(name: str, plain: Any, stated: Option, *, many: bool) -> Values | None:
    """Type of click for a quantity: the one that is stated, or that of the unit in a name."""
    unit = _UNIT.search(name)
    quantity = stated.kind or (_QUANTITIES.get(unit[1]) if unit and plain is float else None)
    if quantity is None:
        return None
    if many:
        return Values(quantity, zero=stated.zero)
    return ShownValue(quantity, zero=stated.zero, unit=unit[1] if unit else quantity.name)


def _type(plain: Any, stated: Any) -> Any:
    """Type of click that is stated; None of a quantity, and where the annotation decides."""
    if isinstance(stated, tuple):
        return OneOf(stated)
    if isinstance(stated, str):
        return KINDS[stated]
    if isinstance(stated, units.Quantity):
        return None
    return _File(path_type=Path) if stated is None and plain is Path else stated


class _File(click.Path):
    """A path; an empty text is none, and not the working folder, where none is usual."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of a word."""
        folder = param is not None and isinstance(param.default, str | Path)  # the working folder in place of another
        return None if value == "" and not folder else super().convert(value, param, ctx)


def ended(result: Any, *, before: "Iterable[Part]" = ()) -> int:
    """Exit code of a command; a result that is no code is delivered, with its problems."""
    if result is None or isinstance(result, int):
        return result or 0
    render.deliver(result, before=before)
    return render.verdict(*(result.problems() if hasattr(result, "problems") else ()))


def command(
    name: str, *more: click.Parameter, group: click.Group | None = None, about: str = "", short: str | None = None,
) -> Callable[[Work], click.Command]:  # fmt: skip
    """Make a command of a function, with ``more`` options after its own, and add it to a group of commands."""

    def made(work: Work) -> click.Command:
        one = click.Command(
            name, params=[*options_of(work), *more], help=about or described(work)[0], short_help=short,
            context_settings=HELP, callback=lambda **given: ended(work(**arguments(work, given))),
        )  # fmt: skip
        if group is not None:
            group.add_command(one)
        return one

    return made


def of_word(word: str, work: Work, *more: click.Parameter, about: str = "") -> click.Command:
    """Command of a function whose first parameter is the word that calls it."""
    bound = partial(work, word)
    bound.__doc__ = work.__doc__
    return command(word, *more, about=about)(bound)


class FirstWord(click.Group):
    """A command whose first word is a thing, as a plan's file, or one of its commands; options follow it."""

    def __init__(
        self, name: str, work: Work, *more: click.Parameter, thing: str, form: str, **attributes: Any
    ) -> None:  # fmt: skip
        """Command of a function, which gets the first word and the values of its own options; ``more`` after them.

        Messages call the first word ``thing``, and the words of the command ``form``.
        """
        settings = {"ignore_unknown_options": True, **HELP}
        super().__init__(name, options_metavar="", context_settings=settings, **attributes)
        self.work, self.more, self.thing, self.form = work, more, thing, form

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """One of the commands, or the one for a thing."""
        return super().get_command(ctx, name) or of_word(name, self.work, *self.more)

    def resolve_command(
        self, ctx: click.Context, args: list[str],
    ) -> tuple[str | None, click.Command | None, list[str]]:  # fmt: skip
        """Take the first word; an option in its place is the user's slip, but while the shell completes words."""
        try:
            if args[0].startswith("-"):
                words = self.form.format(option=args[0])
                raise BadInput(f"{args[0]} stands before the {self.thing}; write {ctx.command_path} {words}")
            return args[0], self.get_command(ctx, args[0]), args[1:]
        except SensorgenError:
            if ctx.resilient_parsing:
                return None, None, []
            raise

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Files, and the commands."""
        return [CompletionItem(incomplete, type="file"), *super().shell_complete(ctx, incomplete)]
