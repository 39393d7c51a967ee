"""``sensorgen log list|show|export|verify ...``: what comes out of the log."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import command
from sensorgen.cli.log_words import LogFile
from sensorgen.cli.log_write import FORMS
from sensorgen.cli.log_write import log as log
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.measure.log import Entry, Log


@command("list", *FORMS, group=log, short="List the latest readings.")
def _list(
    *, iteration: int | None = None, last: Annotated[int, Option(kind=click.IntRange(1))] = 40,
    everything: bool = False, file: LogFile,
) -> "Documented":  # fmt: skip
    """List readings, the latest last; those that a later one corrects are left out.

    Parameters
    ----------
    iteration
        Of this iteration only.
    last
        How many.
    everything, --all
        List all of them.
    """
    from sensorgen.measure.log import listing

    return listing.listing(file.of_command(), iteration, None if everything else last)


@command("show", *FORMS, group=log, short="Show all about a specimen, or one reading.")
def _show(what: str, file: LogFile) -> "Documented":
    """Show everything about a specimen, or about one reading by its number; corrected ones too.

    Parameters
    ----------
    what : SPECIMEN|NUMBER
    """
    from sensorgen.measure.log import listing

    rows = file.of_command()
    return listing.details(rows, _entries(rows, what))


def _entries(log: "Log", what: str) -> "list[Entry]":
    """A reading by its number, or all rows of a specimen."""
    from sensorgen.measure.log import BenchRun, Prediction, Print, Reading, notes

    entries: list[Entry] = []
    if what.isascii() and what.isdigit():
        entries += log.entries(Reading, superseded=True, number=int(what))
    else:
        name = notes.specimen(what, log).specimen
        rows: list[Print | Reading | BenchRun] = [*log.entries(Print, specimen=name)]
        rows += log.entries(Reading, superseded=True, specimen=name)
        rows += log.entries(BenchRun, superseded=True, specimen=name)
        designs = dict.fromkeys(row.design_id for row in rows if row.design_id)
        entries += [*rows, *(row for design in designs for row in log.entries(Prediction, design_id=design))]
    if not entries:
        raise BadInput(f"nothing in {str(log.path)!r} of {what!r}; sensorgen log list shows what is")
    return entries


@command("export", group=log, short="Write the log as CSV or Parquet.")
def _export(place: Path, file: LogFile) -> None:
    """Write readings to a file, .csv or .parquet, or the whole log to a new folder; 'log import' takes both back.

    Parameters
    ----------
    place : FILE|FOLDER
    """
    from sensorgen.measure.log import exchange

    render.say(f"{exchange.export(file.of_command(), place)} rows in {place}")


@command("verify", *FORMS, group=log, short="Check that the log is what was logged.")
def _verify(*, anchors: Path | None = None, file: LogFile) -> int:
    """Check every record, its order, references and the SHA-256 of every raw file; exit code 1 where one is wrong.

    Somebody who rewrites the whole log is found only by a head that was kept elsewhere: --anchor FILE.

    Parameters
    ----------
    anchors, --anchor : FILE
        A text with heads, as 'log anchor' writes it.
    """
    from sensorgen.measure.log.verify import verified

    result = verified(file.of_command(), anchors)
    render.deliver(result)
    return FOUND_ERRORS if result.faults else 0


@command("head", *FORMS, group=log, short="Show the last record.")
def _head(file: LogFile) -> "Documented":
    """Show the identity of the last record: who keeps it can tell any later change of what is in the log now."""
    from sensorgen.measure.log import anchors

    return anchors.head(file.of_command())


@command("anchor", *FORMS, group=log, short="Write the last record's identity to a file.")
def _anchor(place: Path, file: LogFile) -> None:
    """Append the identity of the last record to a text file, for git or mail; 'log verify --anchor' compares.

    Parameters
    ----------
    place : FILE
    """
    from sensorgen.measure.log import anchors

    render.deliver(anchors.anchor(file.of_command(), place), before=[f"written to {place}"])


@command("sync", *FORMS, group=log, short="Exchange records with a shared folder.")
def _sync(place: Path, file: LogFile) -> "Documented":
    """Exchange records and raw files with a folder or a .zip that other machines sync with too.

    A shared drive, a stick or a cloud folder will do; every machine keeps a log of its own.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.sync(file.of_command(create=True), place)


@command("backup", *FORMS, group=log, short="Write the log to a new place.")
def _backup(place: Path, file: LogFile) -> "Documented":
    """Write the whole log with its raw files to a new folder or .zip; 'log restore' takes it back.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.backup(file.of_command(), place)


@command("restore", *FORMS, group=log, short="Fill a new log from a backup.")
def _restore(place: Path, file: LogFile) -> "Documented":
    """Fill a new log from a backup, or from the folder that logs are synced with.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.restore(file.of_command(create=True), place)
