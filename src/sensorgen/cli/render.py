"""Results as text, JSON, CSV or Markdown, to the terminal or a file, and progress: the one way out of every command."""

import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import FOUND_ERRORS
from sensorgen.core.display import escaped, harmless
from sensorgen.core.errors import BadInput
from sensorgen.core.units import si

if TYPE_CHECKING:
    from sensorgen.core.document import Cell, Documented, Part


@contextmanager
def progress(steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """A bar that moves with the named steps and is gone afterwards; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda _: None
        return
    started, done = time.monotonic(), 0

    def step(name: str) -> None:
        nonlocal done
        done = steps.index(name) if name in steps else done  # a part of a step moves the clock alone
        bar = "#" * (20 * done // max(1, len(steps) - 1))
        seconds = time.monotonic() - started
        click.echo(f"\r[{bar:20}] {seconds:4.1f} s  {harmless(name):24.24}", nl=False, err=True)

    try:
        yield step
    finally:
        clear()


def clear() -> None:
    """Clear the bar, for what is printed in its place."""
    if sys.stderr is not None and sys.stderr.isatty():
        click.echo("\r" + " " * 60 + "\r", nl=False, err=True)


def at_once(jobs: int | None) -> int:
    """Default number of processes."""
    return jobs or os.cpu_count() or 1


@contextmanager
def bar(length: int, label: str = "solving") -> Iterator[Callable[..., None]]:
    """A progress bar on the terminal, only for a person; each call moves it by one, or up to the number given."""
    with click.progressbar(length=length, file=sys.stderr, hidden=not sys.stderr.isatty(), label=label) as shown:
        shown.render_progress()
        yield lambda upto=None: shown.update(1 if upto is None else max(upto - shown.pos, 0))


@contextmanager
def pressing(stress_kpa: Sequence[float]) -> Iterator[Callable[[float], None]]:
    """A progress bar that stands at the highest stress reached so far, only for a person."""
    with bar(len(stress_kpa), "pressing") as step:
        yield lambda reached_pa: step(sum(1e3 * kpa <= reached_pa for kpa in stress_kpa))


@contextmanager
def counted() -> Iterator[Callable[[str, int, int], None]]:
    """A line with the step, how far it is, and the time left; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda *_: None
        return
    begun: dict[str, tuple[float, int]] = {}

    def step(name: str, done: int, count: int) -> None:
        now = time.monotonic()
        if done <= 1:  # of each round anew
            begun[name] = now, done
        start, first = begun.get(name, (now, done))
        left = (now - start) / (done - first) * (count - done) if done > first else 0.0
        words = f"{name} {done} of {count}" + (f", {si(left, 's', 2)} left" if left else "")
        click.echo(f"\r{words:50.50}", nl=False, err=True)

    try:
        yield step
    finally:
        clear()


_ABOUT = {"json": "Print as JSON.", "csv": "Print the table as CSV, all digits.", "markdown": "Print as Markdown."}
_COLOURS = {"error": "red", "warning": "yellow", "info": "blue", "CHANGE": "red", "PRINT": "green"}
_FORM, _FILE = "sensorgen.form", "sensorgen.output"  # in the context's meta


def options(
    *forms: str, file: bool = True, csv: str = _ABOUT["csv"], folder: bool = False,
) -> list[click.Parameter]:  # fmt: skip
    """``--json``, ``--csv``, ``--markdown``, or those named, and ``--output``; :func:`deliver` obeys them.

    ``-o`` is short for ``--output``, except of a command that writes a folder: there it is short for ``--out``.
    """
    flags = [
        click.Option([f"--{form}", f"as_{form}"], is_flag=True, expose_value=False, callback=_choose, help=about)
        for form, about in (_ABOUT | {"csv": csv}).items() if form in (forms or _ABOUT)
    ]  # fmt: skip
    output = click.Option(
        ["--output", *(() if folder else ("-o",))], metavar="FILE", expose_value=False, callback=_to,
        help="Write the answer there.",
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


def deliver(result: "Documented", *, before: "Iterable[Part]" = (), shown: "Iterable[Part] | None" = None) -> None:
    """Print a result in the form that was asked for, or write it to the file; an existing one is replaced whole.

    Parameters
    ----------
    result : Documented
        What CSV and JSON have.
    before : iterable of Part
        What people read before it.
    shown : iterable of Part, optional
        What people read of it; its document if not given.
    """
    write(pieces(result, form(), before, shown))


@contextmanager
def refused(name: str) -> Iterator[None]:
    """Deliver the findings for which a design, or a plan, is not made."""
    from sensorgen.core.errors import Unprintable

    try:
        yield
    except Unprintable as error:
        from sensorgen.core.findings import Refused

        deliver(Refused(name, tuple(error.findings), len(error.stopping), error.source))
        raise


def pieces(
    result: "Documented", wanted: str, before: "Iterable[Part]" = (), shown: "Iterable[Part] | None" = None
) -> Iterable[str]:
    """A result as pieces of text; parameters as of :func:`deliver`.

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
    if wanted == "csv":
        return _comma_separated(result)
    words = document.markdown if wanted else document.text
    lines = words([*before, *(result.document() if shown is None else shown)])
    return (f"{line}\n" for line in lines)


def _comma_separated(result: "Documented") -> Iterable[str]:
    """A result's own CSV, or its first table."""
    from sensorgen.core import document

    if hasattr(result, "csv"):
        blocks: Iterable[str] = result.csv()
        return blocks
    tables = [part for part in result.document() if isinstance(part, document.Table)]
    if not tables:
        raise BadInput("--csv: this result has no table; expected --json")
    return [document.comma_separated(tables[0])]


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


def written(folder: Path, contents: "Iterable[tuple[str, bytes]]") -> list[str]:
    """Write files into a folder; where each is."""
    from sensorgen.core import files

    names = []
    for name, content in contents:
        files.replace(folder / name, content)
        names.append(str(folder / name))
    return names


def columns(names: Sequence[str], rows: "Iterable[Sequence[Cell]]") -> str:
    """CSV of rows below the names of their columns, all digits; empty where nothing is known."""
    from sensorgen.core.document import Column, Table, comma_separated

    cells = tuple(tuple(None if cell != cell else cell for cell in row) for row in rows)
    return comma_separated(Table("", "", tuple(map(Column, names)), cells))


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

    with progress(()) as step, files.replacing(Path(output)) as file:
        for k, piece in enumerate(text):
            step(f"{k} pieces")
            file.write(piece.encode())
    say(output)
