"""``sensorgen log``: what was measured of printed specimens, kept for good."""

import sys
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import NumberRange, pairs
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import ColumnNames, LogFile
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.options import Argument, Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.design.design import Design
    from sensorgen.measure.log import Entry, Log


DEFECTS = ("misprint", "zits", "hole", "clog", "under-extrusion", "adhesion", "torn")
KINDS = ("reading", "recording", "prediction", "calibration", "print", "batch", "design", "raw-file")
FORMS = render.options("json", "markdown")


class _Group(click.Group):
    """The commands in the order in which they are used; the nearest is offered where another is typed."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(self.commands)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        args = ["add", *args[1:]] if args[0] == "multimeter" else args  # its name in version 0.1.0
        if not ctx.resilient_parsing and not args[0].startswith("-") and args[0] not in self.commands:
            raise UnknownName("command of log", args[0], self.commands)
        return super().resolve_command(ctx, args)


command = _Group(
    "log",
    help="""Log of readings, recordings, prints and predictions.

    Readings of a multimeter, recordings of the bench and what was predicted, in one file that only grows: nothing is
    taken out, and a correction is a new row.
    """,
)
_AC = {"cp": "Cp", "cs": "Cs", "d": "D", "r": "R", "x": "X", "z": "Z", "phase": "phase"}
Words = tuple[str, ...]


@dataclass(frozen=True)
class AlternatingCurrent:
    """AC quantities between the electrodes, as typed.

    Attributes
    ----------
    cp, --C : WORDS
        Capacitance in parallel (Cp), as 12.3pF@1kHz.
    cs, --Cs : WORDS
        Capacitance in series.
    d, --D : WORDS
        Loss factor, as 0.02@1kHz.
    r, --R : WORDS
        Real part of Z (Rs), as 1.2kohm@10kHz.
    x, --X : WORDS
        Imaginary part of Z, negative of a capacitor.
    z, --Z : WORDS
        Magnitude of Z.
    phase : WORDS
        Angle of Z, as -88deg@1kHz.
    """

    cp: Words = ()
    cs: Words = ()
    d: Words = ()
    r: Words = ()
    x: Words = ()
    z: Words = ()
    phase: Words = ()

    def typed(self) -> dict[str, Words]:
        """Texts by quantity; raises BadInput for one that cannot be read."""
        from sensorgen.measure.immittance import parse

        texts = {name: getattr(self, key) for key, name in _AC.items() if getattr(self, key)}
        for name, each in texts.items():
            for text in each:
                parse(name, text)
        return texts


@dataclass(frozen=True)
class VisaMeter:
    """Meter that is read over VISA.

    Attributes
    ----------
    visa : ADDRESS
        Read the meter there, as GPIB0::22::INSTR: first Y, then Z.
    meter : KIND
        That meter's kind, of 'list devices'; 34401A or Keithley 2000 if not given.
    axis
        Let the meter read this one only.
    wires
        Leads of the meter; 2 with --visa if not given.
    """

    visa: str = ""
    meter: str = ""
    axis: Annotated[str, Option(kind=("y", "z"))] = ""
    wires: Annotated[str, Option(kind=("2", "4"))] = ""

    def __post_init__(self) -> None:
        """Refuse a kind without an address."""
        if self.meter and not self.visa:
            raise BadInput(f"--meter {self.meter} without --visa; expected the meter's address too")

    def words(self) -> tuple[str, str, str]:
        """Words of the meter for Y and Z, and what it calls itself; leads are moved between the two."""
        from contextlib import closing

        from sensorgen.measure.lab import rigs

        if not self.axis and not (sys.stdin and sys.stdin.isatty()):
            raise BadInput("--visa without --axis needs somebody to move the leads; expected --axis y or --axis z")
        words = {"y": "", "z": ""}
        with closing(rigs.meter(self.meter or None, self.visa)) as meter:
            meter.identify()
            for axis in self.axis or "yz":
                if not self.axis:
                    click.pause(f"Leads to {axis.upper()}, then any key ...", err=True)
                words[axis] = meter.resistance(wires=int(self.wires or "2"))
            return words["y"], words["z"], meter.name


@dataclass(frozen=True)
class Circumstances:
    """State of the specimen, and the air, at a reading.

    Attributes
    ----------
    baked, --baked/--unbaked
        Whether the specimen was baked before.
    measured_at : WHEN
        When it was measured, in your own words.
    instrument : NAME
        The meter, as 'HP 4284A': its accuracy is used.
    temperature : C
        Of the air [C].
    humidity : PERCENT
        Of the air, relative.
    photo : FILE
        A photo of the specimen, kept with the log.
    defects, --defect
        A defect that can be seen.
    """

    baked: bool | None = None
    measured_at: str = ""
    instrument: str = ""
    temperature: Annotated[float | None, Option(kind=NumberRange(-50, 200))] = None
    humidity: Annotated[float | None, Option(kind=NumberRange(0, 100))] = None
    photo: Path | None = None
    defects: Annotated[Words, Option(kind=DEFECTS)] = ()


@dataclass(frozen=True)
class OfRow:
    """Remark and corrected row, which every row may have, and the log.

    Attributes
    ----------
    remark : TEXT
        Anything worth knowing, in your own words.
    predict
        Log first what the specimen's design is expected to measure, if the log does not have it.
    corrects : NUMBER
        Number of the row that this one corrects.
    """

    remark: str = ""
    predict: bool = False
    corrects: int | None = None
    log: LogFile = field(default_factory=LogFile)


@of_function("specimen", *FORMS, group=command, short="Bind specimens of any name to their design.")
def _specimen(
    names: Words, *, design: str = "", printed: str = "",
    iteration: Annotated[int | None, Option(kind=click.IntRange(0))] = None, file: LogFile,
) -> None:  # fmt: skip
    """Bind specimens to the design that they were printed of; readings and recordings then get it by the name.

    Parameters
    ----------
    names : NAME...
    design : DESIGN
        A design file, or identity or name of a design in the log.
    printed : NAME
        The specimen's name on a print bed of the log, with its design.
    iteration
        Of the design, to report specimens together.
    """
    from sensorgen.measure.log import prints

    with file.opened(create=True) as log:
        new = prints.bind(log, names, design, printed=printed, iteration=iteration)
        _deliver(new, log, "the log has these specimens with this very design")


@of_function("add", *FORMS, group=command, short="Log what meters show of one specimen.")
def _add(
    specimen: str, *, y_words: str = "", z_words: str = "", ac: AlternatingCurrent, design: str = "",
    about: Circumstances, meter: VisaMeter, row: OfRow,
) -> None:  # fmt: skip
    """Log what meters show of one specimen: DC resistances, and AC quantities between its electrodes.

    SPECIMEN is any name that is bound to a design, by --design here or by 'log specimen', or one as '23 triY .2mm 3'.
    An AC quantity stands with its frequency, as --C 12.3pF@1kHz --D 0.02@1kHz; repeats have / between them, and a
    standard uncertainty may follow, as 12.3/12.4±0.1pF@1kHz. A small m of --y and --z is taken for mega, and asked for
    on a terminal.

    Parameters
    ----------
    specimen
    y_words, --y : WORDS
        DC resistance along an electrode, as 0.65k.
    z_words, --z : WORDS
        DC resistance between the electrodes.
    design : DESIGN
        Bind the name to it first: a design file, or one in the log.
    """
    typed = ac.typed()
    if meter.visa and (y_words or z_words):
        raise BadInput("--visa beside --y or --z; expected the meter's readings or words, not both")
    if not any((y_words.strip(), z_words.strip(), row.remark, meter.visa, typed, about.defects, about.photo)):
        raise BadInput("nothing to log; expected --y, --z, --C or another quantity, --visa, --defect or --remark")
    _bind(row.log, specimen, design)
    if row.predict:
        with row.log.opened(create=True) as log:
            _predict_ahead(log, specimen)
    if meter.visa:
        y_words, z_words, name = meter.words()
        about = replace(about, instrument=name)
    mega = _asked_mega(y=y_words, z=z_words)
    with row.log.opened(create=True) as log:
        _log_reading(log, specimen, (y_words, z_words), typed, about, meter, row, mega=mega)


def _bind(file: LogFile, specimen: str, design: str) -> None:
    """Bind a name to a design, if one is given; refuse a wrong name before anybody measures, or a log is made."""
    from sensorgen.measure.log import notes, prints

    if design:
        with file.opened(create=True) as log:
            for bound in prints.bind(log, [specimen], design):
                render.say(f"{specimen}: design {getattr(bound, 'design', '')}", err=bool(render.form()))
    with nullcontext() if file.file and not file.file.exists() else file.existing() as known:
        notes.named(specimen, known)


def _log_reading(
    log: "Log", specimen: str, dc: tuple[str, str], typed: dict[str, Words], about: Circumstances, meter: VisaMeter,
    row: OfRow, *, mega: bool,
) -> None:  # fmt: skip
    """Log a reading with its photo."""
    from sensorgen.measure.log import Reading, files, notes

    reading = notes.reading(
        specimen, *dc, mega=mega, supersedes=_uid(log, Reading, row.corrects), baked=about.baked, remark=row.remark,
        measured_at=about.measured_at, instrument=about.instrument, source=meter.visa or "typed", log=log,
    )  # fmt: skip
    photos = [files.keep_photo(log.files, about.photo)] if about.photo else []
    reading = replace(
        notes.with_ac(reading, typed), wires=int(meter.wires) if meter.wires else None,
        temperature_c=about.temperature, humidity_percent=about.humidity, photo=photos[0].uid if photos else "",
        defects=tuple(dict.fromkeys(about.defects)),
    )  # fmt: skip
    _deliver([new for new in log.add([*photos, reading]) if isinstance(new, Reading)], log)


def _predict_ahead(log: "Log", specimen: str) -> None:
    """Log what is expected before the specimen is measured; beside JSON, which has the measurement alone."""
    from sensorgen.measure.log import prints

    for row in prints.predict(log, specimen):
        render.say(f"logged prediction {row.number} of {specimen}", err=bool(render.form()))


def _asked_mega(**typed: str) -> bool:
    """Test whether a person says that a small m means mega; no question where there is no m, or no person."""
    from sensorgen.measure.log.notes import resistance

    words = [word for axis, text in typed.items() for word in resistance(axis, text).mega]
    if not words or not (sys.stdin and sys.stdin.isatty()):
        return False
    if not click.confirm(f"{', '.join(words)}: is m mega (a million)?", default=True, err=True):
        raise BadInput(f"{words[0]!r} is not logged; write M for mega, or 0.0011 for 1.1 milliohm")
    return True


def _uid(log: "Log", kind: "type[Entry]", number: int | None) -> str:
    """The name for life of a row that is to be corrected, "" if none is."""
    if number is None:
        return ""
    old = next(log.entries(kind, superseded=True, number=number), None)
    if old is None:
        raise BadInput(f"--corrects {number}: no such row; sensorgen log list shows their numbers")
    return old.uid


def _deliver(new: "Sequence[Entry]", log: "Log", known: str = "") -> None:
    """Show what was logged, or that it was ``known``."""
    from sensorgen.measure.log import listing

    render.deliver(listing.logged(log, new, known), before=[f"{'logged' if new else 'not logged'} in {log.path}"])


@dataclass(frozen=True)
class LcrExport:
    """Specimen of a meter's export, its state, and the meter.

    Attributes
    ----------
    specimen : NAME
        The file is an LCR meter's export of this specimen.
    instrument : NAME
        That meter, as 'HP 4284A'.
    baked, --baked/--unbaked
        Whether that specimen was baked before.
    remark : TEXT
        Anything worth knowing of that specimen.
    """

    specimen: str = ""
    instrument: str = ""
    baked: bool | None = None
    remark: str = ""

    def __post_init__(self) -> None:
        """Refuse the state of no specimen."""
        if not self.specimen and (self.instrument or self.remark or self.baked is not None):
            raise BadInput(
                "--instrument, --baked and --remark are for the export of an LCR meter; expected --specimen too"
            )


@of_function("import", *FORMS, group=command, short="Log a table, a print bed, or an export of a log.")
def _import(
    path: Path | None = None, *, thesis: bool = False, columns: Words = (), lcr: LcrExport, file: LogFile,
) -> None:  # fmt: skip
    """Log all rows of a file, or none of them.

    A table of readings as CSV, the batch.json of a print bed, what 'log export' wrote, or with --specimen the export of
    an LCR meter: Frequency, Cp, D and the like, with any separator. Rows that the log has are passed over.

    Parameters
    ----------
    path : [FILE]
    thesis
        Table D.1 of the thesis, 69 rows; sensorgen brings it along.
    columns, --column : OURS=THEIRS
        Which column is which, as y='Resistance in Y': specimen, y, z, remark, baked, measured_at.
    """
    from sensorgen.measure.log import exchange

    if thesis == bool(path):
        raise BadInput(f"{'both' if path else 'neither'} of FILE and --thesis given; expected one of them")
    if thesis and lcr.specimen:
        raise BadInput("--thesis and --specimen at once; expected one of them")
    named = dict(pairs(columns, "--column"))
    with file.opened(create=True) as log:
        if path is None:
            rows = exchange.thesis(log)
        elif lcr.specimen:
            rows = exchange.lcr_export(
                log, path, lcr.specimen, baked=lcr.baked, instrument=lcr.instrument, remark=lcr.remark
            )
        else:
            rows = exchange.import_file(log, path, named)
        render.deliver(rows, before=[f"import into {log.path}"])


@of_function("bench", *FORMS, group=command, short="Log a recording of one specimen.")
def _bench(specimen: str, lcr_file: Path, rig_file: Path | None = None, *, columns: ColumnNames, row: OfRow) -> None:
    """Log a recording of one specimen, its files kept whole.

    LCR_FILE is the impedance analyser's, RIG_FILE the rig's with force and position.

    Parameters
    ----------
    specimen
    lcr_file
    rig_file
    """
    from sensorgen.measure.log import BenchRun, bench

    ours, rig = columns.of_readings(), columns.of_rig()
    with row.log.opened(create=True) as log:
        if row.predict:
            _predict_ahead(log, specimen)
        new = bench.log_recording(
            log, specimen, lcr_file, rig_file, columns=ours, rig_columns=rig, remark=row.remark,
            supersedes=_uid(log, BenchRun, row.corrects),
        )  # fmt: skip
        _deliver(new, log, f"{specimen}: the log has this very recording; --corrects NUMBER changes remark or columns")


@of_design("predict", *FORMS, group=command, short_help="Log what a design is expected to measure.")
def _predict(design: "Design", file: LogFile) -> None:
    """Keep what a design is expected to measure, so that no later comparison can be tuned."""
    from sensorgen.measure.log import Prediction
    from sensorgen.measure.log.prints import predicted_rows

    with file.opened(create=True) as log:
        new = [row for row in log.add(predicted_rows(design)) if isinstance(row, Prediction)]
        _deliver(new, log, f"{design.name}: the log has this very prediction")


@of_function("withdraw", *FORMS, group=command, short="Take a row out of use, with a reason.")
def _withdraw(
    kind: Annotated[str, Argument(kind=KINDS)], number: int, *, reason: Annotated[str, Option(more={"required": True})],
    file: LogFile,
) -> None:  # fmt: skip
    """Take a row out of use: it stays in the log with the reason, and no report uses it.

    For a reading or a recording that is to be replaced, --corrects of 'log add' and 'log bench' is better.

    Parameters
    ----------
    kind
    number
    reason : TEXT
        Why, in your own words.
    """
    from sensorgen.measure.log.logbook import withdraw

    with file.opened() as log:
        _deliver([withdraw(log, kind, number, reason)], log)


@of_function("list", *FORMS, group=command, short="List the latest readings.")
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


@of_function("show", *FORMS, group=command, short="Show all about a specimen, or one reading.")
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
        name = notes.named(what, log).specimen.specimen
        rows: list[Print | Reading | BenchRun] = [*log.entries(Print, specimen=name)]
        rows += log.entries(Reading, superseded=True, specimen=name)
        rows += log.entries(BenchRun, superseded=True, specimen=name)
        designs = dict.fromkeys(row.design_id for row in rows if row.design_id)
        entries += [*rows, *(row for design in designs for row in log.entries(Prediction, design_id=design))]
    if not entries:
        raise BadInput(f"nothing in {str(log.path)!r} of {what!r}; sensorgen log list shows what is")
    return entries


@of_function("export", group=command, short="Write the log as CSV or Parquet.")
def _export(place: Path, file: LogFile) -> None:
    """Write readings to a file, .csv or .parquet, or the whole log to a new folder; 'log import' takes both back.

    Parameters
    ----------
    place : FILE|FOLDER
    """
    from sensorgen.measure.log import exchange

    render.say(f"{exchange.export(file.of_command(), place)} rows in {place}")


@of_function("verify", *FORMS, group=command, short="Check that the log is what was logged.")
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


@of_function("head", *FORMS, group=command, short="Show the last record.")
def _head(file: LogFile) -> "Documented":
    """Show the identity of the last record: who keeps it can tell any later change of what is in the log now."""
    from sensorgen.measure.log import verify

    return verify.head(file.of_command())


@of_function("anchor", *FORMS, group=command, short="Write the last record's identity to a file.")
def _anchor(place: Path, file: LogFile) -> None:
    """Append the identity of the last record to a text file, for git or mail; 'log verify --anchor' compares.

    Parameters
    ----------
    place : FILE
    """
    from sensorgen.measure.log import verify

    render.deliver(verify.anchor(file.of_command(), place), before=[f"written to {place}"])


@of_function("sync", *FORMS, group=command, short="Exchange records with a shared folder.")
def _sync(place: Path, file: LogFile) -> "Documented":
    """Exchange records and raw files with a folder or a .zip that other machines sync with too.

    A shared drive, a stick or a cloud folder will do; every machine keeps a log of its own.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.sync(file.of_command(create=True), place)


@of_function("backup", *FORMS, group=command, short="Write the log to a new place.")
def _backup(place: Path, file: LogFile) -> "Documented":
    """Write the whole log with its raw files to a new folder or .zip; 'log restore' takes it back.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.backup(file.of_command(), place)


@of_function("restore", *FORMS, group=command, short="Fill a new log from a backup.")
def _restore(place: Path, file: LogFile) -> "Documented":
    """Fill a new log from a backup, or from the folder that logs are synced with.

    Parameters
    ----------
    place : FOLDER|FILE.zip
    """
    from sensorgen.measure.log import sync

    return sync.restore(file.of_command(create=True), place)


__all__ = ["command"]
