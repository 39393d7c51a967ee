"""Options that the commands of ``sensorgen log`` and ``bench`` share, and the log that they name."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.settings import pairs

if TYPE_CHECKING:
    from sensorgen.measure.log import Log


def where() -> click.Option:
    """Option of the log's place."""
    about = "The log; what SENSORGEN_LOG says, or the one of this user, if not given."
    return click.Option(["--log", "file"], metavar="FILE", help=about)


def recorded_columns() -> list[click.Parameter]:
    """Names of columns in an instrument's CSV, and in a rig's log."""
    about = "Column of the readings' file, if it is CSV and calls it otherwise: time_s, stamp_s, re_ohm_1.1kHz ..."
    return [
        click.Option(["--column", "columns"], metavar="OURS=THEIRS", multiple=True, help=about),
        click.Option(
            ["--rig-column", "rig_columns"], metavar="OURS=THEIRS", multiple=True,
            help="Column of the rig's log: time_s, set_force_n, set_position_mm, force_n, error.",
        ),
    ]  # fmt: skip


def made(work: Callable[..., Any], name: str, about: str, *params: click.Parameter) -> click.Command:
    """A command that does some work, its help being what the work's docstring says."""
    return click.Command(name, params=list(params), callback=work, help=work.__doc__, short_help=about)


def opened(file: str | None, *, create: bool = False) -> "Log":
    """The log that ``--log`` names, or the usual one."""
    from sensorgen.measure.log import Log, place

    return Log(Path(file) if file else place(), create=create)


@contextmanager
def existing(file: str | None) -> Iterator["Log | None"]:
    """The log, or None where ``--log`` names none and there is none yet."""
    from sensorgen.measure.log import place

    if file is None and not place().exists():
        yield None
        return
    with opened(file) as log:
        yield log


def columns_of(words: tuple[str, ...], option: str) -> dict[str, str]:
    """Columns given by OURS=THEIRS: names in the file, to ours."""
    return {theirs: ours for ours, theirs in pairs(words, option)}
