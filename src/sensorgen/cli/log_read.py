"""``sensorgen log list|show|export|verify``: what comes out of the log."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, show
from sensorgen.cli.log_words import as_json as json_option
from sensorgen.cli.log_words import made, opened, where
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.log import Log

LAST = 40  # readings in a list, unless told otherwise


def _list(iteration: int | None, last: int, file: str | None, *, everything: bool, as_json: bool) -> None:
    """List readings, the latest last; those that a later one corrects are left out."""
    from sensorgen.cli import log_text

    wanted: dict[str, Any] = {} if iteration is None else {"iteration": iteration}
    with opened(file) as log:
        found = log.readings(last=None if everything else last, **wanted)
        runs = log.recordings(last=None if everything else last, **wanted)
        if as_json:
            show.as_json({k: [log_text.plain(e) for e in v] for k, v in (("readings", found), ("recordings", runs))})
            return
        click.echo("\n".join((*log_text.readings(found), *log_text.runs(runs))))
        click.echo(
            _total(log) + ("" if everything or len(found) < last else f"; the latest {last} are shown, --all shows all")
        )


def _total(log: "Log") -> str:
    from sensorgen.measure.log import BenchRun, Prediction, Reading

    names = {Reading: "readings", BenchRun: "recordings", Prediction: "predictions"}
    counts = {name: log.count(kind) for kind, name in names.items()}
    said = ", ".join(f"{count} {name}" for name, count in counts.items())
    return f"{said} in {log.path}"


def _show(what: str, file: str | None, *, as_json: bool) -> None:
    """Show everything about a specimen, or about one reading by its number; corrected ones too."""
    from sensorgen.cli import log_text

    with opened(file) as log:
        found = _found(log, what)
        if as_json:
            show.as_json([log_text.plain(entry) for entry in found])
            return
        lines = [line for entry in found for line in (*log_text.of(entry), *log_text.corrections(entry, log))]
    click.echo("\n".join(lines))


def _found(log: "Log", what: str) -> list[Any]:
    from sensorgen.measure.log import BenchRun, Prediction, Print, Reading

    if what.isascii() and what.isdigit():
        found: list[Any] = list(log.entries(Reading, superseded=True, number=int(what)))
    else:
        from sensorgen.measure.log import notes

        name = notes.specimen(what).specimen
        found = [row for kind in (Reading, BenchRun) for row in log.entries(kind, superseded=True, specimen=name)]
        found = [*log.entries(Print, specimen=name), *found]
        designs = dict.fromkeys(row.design_id for row in found if row.design_id)
        found += [row for design in designs for row in log.entries(Prediction, design_id=design)]
    if not found:
        raise BadInput(f"nothing in {str(log.path)!r} of {what!r}; sensorgen log list shows what is")
    return found


def _export(place: str, file: str | None) -> None:
    """Write readings to a file, .csv or .parquet, or the whole log to a new folder; 'log import' takes both back."""
    from sensorgen.measure.log import exchange

    with opened(file) as log:
        rows = exchange.export(log, Path(place))
    click.echo(f"{rows} rows in {place}")


def _verify(file: str | None) -> int:
    """Check database, references and the SHA-256 of every raw file; exit code 1 where something is wrong."""
    from sensorgen.cli import log_text
    from sensorgen.measure.log import TABLES
    from sensorgen.measure.log.verify import faults

    with opened(file) as log:
        found = list(faults(log))
        for fault in found:
            click.echo(log_text.visible(fault))
        if not found:
            rows = sum(log.count(kind, superseded=True) for kind in TABLES)
            click.echo(f"{log.path} is sound: {rows} rows")
    return FOUND_ERRORS if found else 0


listing = made(
    _list, "list", "List the latest readings.",
    click.Option(["--iteration"], type=int, help="Of this iteration only."),
    click.Option(["--last"], type=click.IntRange(1), default=LAST, show_default=True, help="How many."),
    click.Option(["--all", "everything"], is_flag=True, help="List all of them."),
    where(),
    json_option(),
)  # fmt: skip
showing = made(
    _show, "show", "Show all about a specimen, or one reading.",
    click.Argument(["what"], metavar="SPECIMEN|NUMBER"),
    where(),
    json_option(),
)  # fmt: skip
exporting = made(
    _export, "export", "Write the log as CSV or Parquet.",
    click.Argument(["place"], metavar="FILE|FOLDER"),
    where(),
)  # fmt: skip
verifying = made(_verify, "verify", "Check that the log is what was logged.", where())
