"""``sensorgen thesis``: every numbered item of the thesis, its value, ours, and a verdict."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import FOUND_ERRORS, show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import Unwritable

if TYPE_CHECKING:
    from sensorgen.verification.thesis import Row

FORMATS = ("html", "md", "json")


@click.command("thesis", short_help="Hold every number of the thesis against ours.")
@click.option(
    "--output", "-o", default="out/thesis", show_default=True, metavar="DIR", help="Folder of thesis.html and the like."
)
@click.option(
    "--format", "formats", type=OneOf(FORMATS), multiple=True, default=("html", "md"), show_default=True,
    help="What to write; may be given several times.",
)  # fmt: skip
def command(output: str, formats: tuple[str, ...]) -> int:
    """Compute every numbered equation, table and figure of the thesis, and say how far it agrees.

    Ends with 1 where a value differs for an unknown reason. What takes long is solved once and kept.
    """
    from sensorgen.verification import thesis
    from sensorgen.verification.thesis.items import CHAPTERS

    with show.progress(CHAPTERS) as step:
        rows = thesis.rows(step)
    _write(Path(output), rows, formats)
    return _verdict(rows)


def _write(folder: Path, rows: Sequence["Row"], formats: Sequence[str]) -> None:
    from sensorgen.core import files as store
    from sensorgen.verification import thesis

    made = {
        "html": lambda: thesis.html(rows),
        "md": lambda: thesis.markdown(rows),
        "json": lambda: json.dumps(thesis.plain(rows), indent=2, ensure_ascii=False) + "\n",
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Unwritable(f"cannot write to {str(folder)!r}: {error.strerror or error}") from None
    for name in dict.fromkeys(formats):
        store.replace(folder / f"thesis.{name}", made[name]().encode())
        click.echo(str(folder / f"thesis.{name}"))


def _verdict(rows: Sequence["Row"]) -> int:
    """How many of each, and 1 where something is unexplained."""
    from sensorgen.verification.thesis.verdicts import UNEXPLAINED, WORDS

    counts = Counter(row.verdict.word for row in rows)
    click.echo(", ".join(f"{counts[word]} {word}" for word in WORDS if counts[word]))
    for row in rows:
        if row.verdict.word == UNEXPLAINED:
            click.echo(f"sensorgen: {row.name()}: {row.verdict.text()}", err=True)
    return FOUND_ERRORS if counts[UNEXPLAINED] else 0
