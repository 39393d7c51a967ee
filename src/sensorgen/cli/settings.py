"""``--set``, ``--sweep`` and ``--apply``: parameters, keys of the design file, and values of materials."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.words import NumberRange
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.workflows.changes import Advice, Change


def pairs(words: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    """Words of the form KEY=VALUE, taken apart."""
    for word in words:
        if "=" not in word.strip("="):
            raise BadInput(f"{option} {word!r}: expected KEY=VALUE")
    return [(k.strip(), v.strip()) for k, _, v in (word.partition("=") for word in words)]


def sweep(text: str, design: "Design") -> tuple[str, list[tuple[float | str, "Design"]]]:
    """A sweep as typed: its key, and the design for each value.

    Parameters
    ----------
    text : str
        KEY=START:STOP:STEP or KEY=VALUE,VALUE,...; keys as of :func:`sensorgen.design.settings.setting`.
    design : Design
        That is varied.

    Raises
    ------
    SensorgenError
        A key or values that mean nothing, or a value that this design cannot have: before any work.
    """
    from sensorgen.design.settings import varied

    ((key, typed),) = pairs((text,), "--sweep")
    fields = {field.name: field for field in dataclasses.fields(design.form.Params)}
    return key, [(value, made) for (value,), made in varied(design, {key: _values(typed, fields.get(key))})]


def _values(typed: str, field: Any) -> list[Any]:
    """Numbers, or the words that a parameter may be."""
    if field is not None and "choices" in field.metadata:
        return typed.split(",")
    return list(units.values(typed, units.NUMBER if field is None else units.LENGTH_MM))


def advice_options() -> list[click.Parameter]:
    """``--budget`` and ``--apply``: changes of a design that are tried, and written into its file."""
    return [
        click.Option(
            ["--budget"], type=NumberRange(0, 3600), default=60.0, show_default=True, metavar="SECONDS",
            envvar="SENSORGEN_BUDGET",
            help="Processor time for prediction and for changes to try; 0 tries none.",
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
        above = f"expected the number of a change above, at most {len(tried)}"
        raise BadInput(f"--apply {number}: {above if tried else 'no change that was tried helps'}")
    change = tried[number - 1]
    word = click.get_current_context().info_name or ""
    if not (word.endswith((".yaml", ".yml")) or "/" in word):
        raise BadInput(f"--apply: {word} is no design file; use these options: {' '.join(_options(change.changes))}")
    from sensorgen.workflows.apply import apply

    apply(Path(word), design, change)
    from sensorgen.cli import render

    changes = ", ".join(one.words() for one in change.changes)
    render.say(f"{word} is changed: {changes}; all above is of the design before: run the command again", err=True)


def _options(changes: "tuple[Change, ...]") -> list[str]:
    """The changes as options of the command line."""
    return [f"--set {one.key}={one.after:g}" if isinstance(one.after, float) else f"--set {one.key}={one.after}"
            for one in changes]  # fmt: skip
