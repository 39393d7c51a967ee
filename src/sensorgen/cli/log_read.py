"""``sensorgen log list|show|export|verify``: what comes out of the log."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.log_words import made, opened, where
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.log import Entry, Log

LAST = 40  # readings in a list, unless told otherwise


def _list(iteration: int | None, last: int, file: str | None, *, everything: bool) -> None:
    """List readings, the latest last; those that a later one corrects are left out."""
    from sensorgen.measure.log import listing

    with opened(file) as log:
        render.deliver(listing.listing(log, iteration, None if everything else last))


def _show(what: str, file: str | None) -> None:
    """Show everything about a specimen, or about one reading by its number; corrected ones too."""
    from sensorgen.measure.log import listing

    with opened(file) as log:
        render.deliver(listing.details(log, _found(log, what)))


def _found(log: "Log", what: str) -> "list[Entry]":
    from sensorgen.measure.log import BenchRun, Prediction, Print, Reading, notes

    found: list[Entry] = []
    if what.isascii() and what.isdigit():
        found += log.entries(Reading, superseded=True, number=int(what))
    else:
        name = notes.specimen(what, log).specimen
        rows: list[Print | Reading | BenchRun] = [*log.entries(Print, specimen=name)]
        rows += log.entries(Reading, superseded=True, specimen=name)
        rows += log.entries(BenchRun, superseded=True, specimen=name)
        designs = dict.fromkeys(row.design_id for row in rows if row.design_id)
        found += [*rows, *(row for design in designs for row in log.entries(Prediction, design_id=design))]
    if not found:
        raise BadInput(f"nothing in {str(log.path)!r} of {what!r}; sensorgen log list shows what is")
    return found


def _export(place: str, file: str | None) -> None:
    """Write readings to a file, .csv or .parquet, or the whole log to a new folder; 'log import' takes both back."""
    from sensorgen.measure.log import exchange

    with opened(file) as log:
        rows = exchange.export(log, Path(place))
    render.say(f"{rows} rows in {place}")


def _verify(file: str | None, anchors: str | None) -> int:
    """Check every record, its order, references and the SHA-256 of every raw file; exit code 1 where one is wrong.

    Somebody who rewrites the whole log is found only by a head that was kept elsewhere: --anchor FILE.
    """
    from sensorgen.measure.log.verify import verified

    with opened(file) as log:
        found = verified(log, Path(anchors) if anchors else None)
    render.deliver(found)
    return FOUND_ERRORS if found.faults else 0


def _head(file: str | None) -> None:
    """Show the identity of the last record: who keeps it can tell any later change of what is in the log now."""
    from sensorgen.measure.log import anchors

    with opened(file) as log:
        render.deliver(anchors.head(log))


def _anchor(place: str, file: str | None) -> None:
    """Append the identity of the last record to a text file, for git or mail; 'log verify --anchor' compares."""
    from sensorgen.measure.log import anchors

    with opened(file) as log:
        render.deliver(anchors.anchor(log, Path(place)), before=[f"written to {place}"])


def _sync(place: str, file: str | None) -> None:
    """Exchange records and raw files with a folder or a .zip that other machines sync with too.

    A shared drive, a stick or a cloud folder will do; every machine keeps a log of its own.
    """
    from sensorgen.measure.log import sync

    with opened(file, create=True) as log:
        render.deliver(sync.sync(log, Path(place)))


def _backup(place: str, file: str | None) -> None:
    """Write the whole log with its raw files to a new folder or .zip; 'log restore' takes it back."""
    from sensorgen.measure.log import sync

    with opened(file) as log:
        render.deliver(sync.backup(log, Path(place)))


def _restore(place: str, file: str | None) -> None:
    """Fill a new log from a backup, or from the folder that logs are synced with."""
    from sensorgen.measure.log import sync

    with opened(file, create=True) as log:
        render.deliver(sync.restore(log, Path(place)))


listing = made(
    _list, "list", "List the latest readings.",
    click.Option(["--iteration"], type=int, help="Of this iteration only."),
    click.Option(["--last"], type=click.IntRange(1), default=LAST, show_default=True, help="How many."),
    click.Option(["--all", "everything"], is_flag=True, help="List all of them."),
    where(),
    *render.options("json", "markdown"),
)  # fmt: skip
showing = made(
    _show, "show", "Show all about a specimen, or one reading.",
    click.Argument(["what"], metavar="SPECIMEN|NUMBER"),
    where(),
    *render.options("json", "markdown"),
)  # fmt: skip
exporting = made(
    _export, "export", "Write the log as CSV or Parquet.",
    click.Argument(["place"], metavar="FILE|FOLDER"),
    where(),
)  # fmt: skip
verifying = made(
    _verify, "verify", "Check that the log is what was logged.",
    click.Option(["--anchor", "anchors"], metavar="FILE", help="A text with heads, as 'log anchor' writes it."),
    where(), *render.options("json", "markdown"),
)  # fmt: skip
heading = made(_head, "head", "Show the last record.", where(), *render.options("json", "markdown"))
anchoring, syncing, backing_up, restoring = (
    made(work, name, about, click.Argument(["place"], metavar=what), where(), *render.options("json", "markdown"))
    for work, name, about, what in (
        (_anchor, "anchor", "Write the last record's identity to a file.", "FILE"),
        (_sync, "sync", "Exchange records with a shared folder.", "FOLDER|FILE.zip"),
        (_backup, "backup", "Write the log to a new place.", "FOLDER|FILE.zip"),
        (_restore, "restore", "Fill a new log from a backup.", "FOLDER|FILE.zip"),
    )
)
