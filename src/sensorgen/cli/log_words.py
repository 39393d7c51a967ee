"""Words that the commands of ``sensorgen log`` share, and what opens the log that they name."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.settings import pairs

if TYPE_CHECKING:
    from sensorgen.measure.log import Log


def where() -> click.Option:
    """Which log."""
    about = "The log; what SENSORGEN_LOG says, or the one of this user, if not given."
    return click.Option(["--log", "file"], metavar="FILE", help=about)


def as_json() -> click.Option:
    """For programs."""
    return click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON.")


def remark() -> click.Option:
    """Of whoever measures."""
    return click.Option(["--remark"], metavar="TEXT", default="", help="Anything worth knowing, in your own words.")


def ahead() -> click.Option:
    """A prediction before the measurement."""
    about = "Log first what the specimen's design is expected to measure, if the log does not have it."
    return click.Option(["--predict"], is_flag=True, help=about)


def corrects() -> click.Option:
    """A row that is to be corrected."""
    return click.Option(["--corrects"], metavar="NUMBER", type=int, help="Number of the row that this one corrects.")


def lcr_columns() -> click.Option:
    """Names of columns in an instrument's CSV."""
    about = "Column of the readings' file, if it is CSV and calls it otherwise: time_s, stamp_s, re_ohm_1.1kHz ..."
    return click.Option(["--column", "columns"], metavar="OURS=THEIRS", multiple=True, help=about)


def rig_columns() -> click.Option:
    """Names of columns in a rig's log."""
    about = "Column of the rig's log: time_s, set_force_n, set_position_mm, force_n, error."
    return click.Option(["--rig-column", "rig_columns"], metavar="OURS=THEIRS", multiple=True, help=about)


def made(work: Callable[..., Any], name: str, about: str, *params: click.Parameter) -> click.Command:
    """A command that does some work, its help being what the work's docstring says."""
    return click.Command(name, params=list(params), callback=work, help=work.__doc__, short_help=about)


def opened(file: str | None, *, create: bool = False) -> "Log":
    """The log that ``--log`` names, or the usual one."""
    from sensorgen.measure.log import Log, place

    return Log(Path(file) if file else place(), create=create)


def columns_of(words: tuple[str, ...], option: str) -> dict[str, str]:
    """Columns given by OURS=THEIRS: names in the file, to ours."""
    return {theirs: ours for ours, theirs in pairs(words, option)}
