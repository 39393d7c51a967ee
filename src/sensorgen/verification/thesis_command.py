"""``sensorgen thesis``: every numbered item of the thesis, its value, ours, and a verdict."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

import click

from sensorgen.cli import FOUND_ERRORS, render, show
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import NotInstalled

FORMATS = ("html", "md", "json")


@click.command("thesis")
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
    from sensorgen.core import files as store
    from sensorgen.verification import thesis
    from sensorgen.verification.thesis.items import CHAPTERS
    from sensorgen.verification.thesis.verdicts import UNEXPLAINED, WORDS

    if find_spec("ngsolve") is None:  # other models would answer, and differ
        raise NotInstalled("thesis needs the solver NGSolve: pip install 'sensorgen[fem]'")
    with show.progress(CHAPTERS) as step:
        rows = thesis.rows(step)
    made: dict[str, Callable[[Sequence[thesis.Row]], str]] = {
        "html": thesis.html, "md": thesis.markdown,
        "json": lambda rows: json.dumps(thesis.plain(rows), indent=2, ensure_ascii=False) + "\n",
    }  # fmt: skip
    for name in dict.fromkeys(formats):
        file = Path(output) / f"thesis.{name}"
        store.replace(file, made[name](rows).encode())
        render.say(file)
    counts = Counter(row.verdict.word for row in rows)
    render.say(", ".join(f"{counts[word]} {word}" for word in WORDS if counts[word]))
    for row in rows:
        if row.verdict.word == UNEXPLAINED:
            render.say(f"sensorgen: {row.name()}: {row.verdict.text()}", err=True)
    return FOUND_ERRORS if counts[UNEXPLAINED] else 0
