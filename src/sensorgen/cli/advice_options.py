"""``--budget`` and ``--apply``: changes of a design that are tried, and written into its file."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import render
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.workflows.advice import Advice


def options() -> list[click.Parameter]:
    """Both options."""
    return [
        click.Option(
            ["--budget"], type=click.FloatRange(0, 3600), default=30.0, show_default=True, metavar="SECONDS",
            envvar="SENSORGEN_BUDGET",
            help="Processor time for trying changes that remove findings; 0 tries none.",
        ),
        click.Option(
            ["--apply", "apply_change"], is_flag=False, flag_value=1, type=click.IntRange(1, 9), metavar="[K]",
            help="Write the first, or the K-th, of these changes into the design's file.",
        ),
    ]  # fmt: skip


def applied(design: "Design", advice: "Advice | None", number: int | None) -> None:
    """Write the change that ``--apply`` asks for, and say so.

    Raises
    ------
    BadInput
        There is no such change, or no file to write it into.
    """
    if number is None:
        return
    tried = advice.tried if advice else ()
    if number > len(tried):
        raise BadInput(f"--apply {number}: {len(tried)} changes that were tried are good; expected one of them")
    change = tried[number - 1]
    word = click.get_current_context().info_name or ""
    if not (word.endswith((".yaml", ".yml")) or "/" in word):
        raise BadInput(f"--apply: {word} is no design file; use these options: {' '.join(_options(change.changes))}")
    from sensorgen.workflows.apply import apply

    apply(Path(word), design, change)
    render.say(f"{word}: {', '.join(one.words() for one in change.changes)}", err=True)


def _options(changes: "tuple[object, ...]") -> list[str]:
    """The changes as options of the command line."""
    return [f"--set {one.key}={one.after:g}" if isinstance(one.after, float) else f"--set {one.key}={one.after}"
            for one in changes]  # type: ignore[attr-defined]  # fmt: skip
