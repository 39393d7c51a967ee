"""Results as text, JSON, CSV or Markdown, to the terminal or a file: the one way out of every command."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import FOUND_ERRORS, show
from sensorgen.core.errors import BadInput
from sensorgen.core.terminal import escaped, harmless

if TYPE_CHECKING:
    from sensorgen.core.document import Documented, Part

_ABOUT = {"json": "Print as JSON.", "csv": "Print the table as CSV, all digits.", "markdown": "Print as Markdown."}
_COLOURS = {"error": "red", "warning": "yellow", "info": "blue", "CHANGE": "red", "PRINT": "green"}
_FORM, _FILE = "sensorgen.form", "sensorgen.output"  # in the context's meta


def options(
    *forms: str, file: bool = True, csv: str = _ABOUT["csv"], outputs: tuple[str, ...] = ("--output", "-o"),
) -> list[click.Parameter]:  # fmt: skip
    """``--json``, ``--csv``, ``--markdown``, or those named, and ``--output``; :func:`deliver` obeys them."""
    flags = [
        click.Option([f"--{form}", f"as_{form}"], is_flag=True, expose_value=False, callback=_choose, help=about)
        for form, about in (_ABOUT | {"csv": csv}).items() if form in (forms or _ABOUT)
    ]  # fmt: skip
    output = click.Option(
        [*outputs], metavar="FILE", expose_value=False, callback=_to, help="Write this file."
    )  # fmt: skip
    return [*flags, output] if file else [*flags]


def _choose(ctx: click.Context, param: click.Parameter, given: bool) -> None:
    if given:
        option = param.opts[0]
        if other := ctx.meta.get(_FORM):
            raise BadInput(f"--{other} and {option} at once; expected one of them")
        ctx.meta[_FORM] = option.removeprefix("--")


def _to(ctx: click.Context, param: click.Parameter, given: str | None) -> None:  # noqa: ARG001
    ctx.meta[_FILE] = given


def form() -> str:
    """Form that was asked for, or that the file's name ends in: "json", "csv", "markdown"; "" for text."""
    meta = click.get_current_context().meta
    suffix = Path(meta.get(_FILE) or "").suffix
    return str(meta.get(_FORM, {".json": "json", ".csv": "csv", ".md": "markdown"}.get(suffix, "")))


def early() -> bool:
    """True where text goes to the terminal at once: no form and no file was asked for."""
    return not form() and click.get_current_context().meta.get(_FILE) in (None, "-")


def refuse_beside(option: str) -> None:
    """Raise BadInput where a form or a file was asked for too."""
    asked = (*([form()] if form() else ()), *(["output"] if click.get_current_context().meta.get(_FILE) else ()))
    if asked:
        raise BadInput(f"--{asked[0]} and {option} at once; expected one of them")


def deliver(result: "Documented", *, before: "Iterable[Part]" = ()) -> None:
    """Print a result in the form that was asked for, or write it to the file; an existing one is replaced whole.

    Parameters
    ----------
    result : Documented
        What is shown.
    before : iterable of Part
        What people read before it; CSV and JSON leave it out.
    """
    write(pieces(result, form(), before))


@contextmanager
def refused(name: str) -> Iterator[None]:
    """Deliver the findings for which a design, or a plan, is not made."""
    from sensorgen.core.errors import Unprintable

    try:
        yield
    except Unprintable as error:
        from sensorgen.core.findings import Refused

        deliver(Refused(name, tuple(error.findings), len(error.stopping)))
        raise


def pieces(result: "Documented", wanted: str, before: "Iterable[Part]" = ()) -> Iterable[str]:
    """A result as pieces of text.

    Raises
    ------
    BadInput
        CSV of a result without a table.

    Notes
    -----
    CSV is the result's first table, unless it writes its own, as ``csv()``, piece by piece.
    """
    from sensorgen.core import document

    if wanted == "json":
        return [document.to_json(result)]
    if wanted == "csv" and hasattr(result, "csv"):
        blocks: Iterable[str] = result.csv()
        return blocks
    if wanted == "csv":
        tables = [part for part in result.document() if isinstance(part, document.Table)]
        if not tables:
            raise BadInput("--csv: this result has no table; expected --json")
        return [document.comma_separated(tables[0])]
    shown = document.markdown if wanted else document.text
    lines = shown([*before, *result.document()])
    return (f"{line}\n" for line in lines)


def _coloured(line: str) -> str:
    """A line whose first word says how severe it is, for a terminal."""
    word = line.partition(" ")[0]
    return click.style(word, fg=_COLOURS[word], bold=True) + line[len(word) :] if word in _COLOURS else line


def say(text: object, *, err: bool = False, nl: bool = True) -> None:
    """Print a message; what strangers have written in it is harmless to the terminal."""
    click.echo(harmless(str(text)), err=err, nl=nl)


def verdict(*problems: str) -> int:
    """Say what is wrong with a result, a line each; the exit code."""
    for problem in problems:
        say(f"sensorgen: {problem}", err=True)
    return FOUND_ERRORS if problems else 0


def file(path: Path, content: bytes | str, note: str = "") -> None:
    """Write a file and print its name, behind ``note``; beside the result where that is for programs."""
    from sensorgen.core import files

    files.replace(path, content.encode() if isinstance(content, str) else content)
    say(f"{note}{path}", err=bool(form()))


def write(text: Iterable[str]) -> None:
    """Print pieces of text as they come, or write them to the file, which is there when all of them are."""
    output = click.get_current_context().meta.get(_FILE)
    text = map(escaped if form() == "json" else harmless, text)
    if output in (None, "-"):
        terminal = sys.stdout.isatty() and not form()
        for piece in text:
            sys.stdout.write(_coloured(piece) if terminal else piece)
        return
    from sensorgen.core import files

    with show.progress(()) as step, files.replacing(Path(output)) as file:
        for k, piece in enumerate(text):
            step(f"{k} pieces")
            file.write(piece.encode())
    say(output)
