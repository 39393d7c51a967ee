"""``sensorgen thesis``: every numbered item of the thesis, its value, ours, and a verdict."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import command as of_function
from sensorgen.core.errors import NotInstalled
from sensorgen.core.options import Option

FORMATS = ("html", "md", "json")


@of_function("thesis")
def command(
    *, output: Path = Path("out/thesis"), formats: Annotated[tuple[str, ...], Option(kind=FORMATS)] = ("html", "md")
) -> int:
    """Compute every numbered equation, table and figure of the thesis, and say how far it agrees.

    Ends with 1 where a value differs for an unknown reason. What takes long is solved once and kept.

    Parameters
    ----------
    output, --output, -o : DIR
        Folder of thesis.html and the like.
    formats, --format
        What to write; may be given several times.
    """
    from sensorgen.verification import thesis
    from sensorgen.verification.thesis.items import CHAPTERS, UNEXPLAINED, WORDS

    if find_spec("ngsolve") is None:  # other models would answer, and differ
        raise NotInstalled("thesis needs the solver NGSolve: pip install 'sensorgen[fem]'")
    with render.progress(CHAPTERS) as step:
        rows = thesis.rows(step)
    documents: dict[str, Callable[[Sequence[thesis.ReproducedItem]], str]] = {
        "html": thesis.html, "md": thesis.markdown,
        "json": lambda rows: json.dumps(thesis.plain(rows), indent=2, ensure_ascii=False) + "\n",
    }  # fmt: skip
    for name in dict.fromkeys(formats):
        file = output / f"thesis.{name}"
        render.file(file, documents[name](rows))
    counts = Counter(row.verdict.word for row in rows)
    render.say(", ".join(f"{counts[word]} {word}" for word in WORDS if counts[word]))
    for row in rows:
        if row.verdict.word == UNEXPLAINED:
            render.say(f"sensorgen: {row.name()}: {row.verdict.text()}", err=True)
    return FOUND_ERRORS if counts[UNEXPLAINED] else 0
