"""``sensorgen log specimen|add|import|bench|predict``: what goes into the log."""

import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import render
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.log_words import columns_of, existing, made, opened, recorded_columns, where
from sensorgen.cli.settings import pairs
from sensorgen.cli.words import NumberRange, OneOf
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.log import Entry, Log


DEFECTS = ("misprint", "zits", "hole", "clog", "under-extrusion", "adhesion", "torn")
KINDS = ("reading", "recording", "prediction", "calibration", "print", "batch", "design", "raw-file")


def _add(
    specimen: str, y_words: str, z_words: str, file: str | None, corrects: int | None, *, design: str | None,
    predict: bool, visa: str | None, meter: str | None, axis: str | None, wires: str | None, baked: bool | None,
    remark: str, measured_at: str, instrument: str, temperature: float | None, humidity: float | None,
    photo: str | None, defects: tuple[str, ...], **ac: tuple[str, ...],
) -> None:  # fmt: skip
    """Log what meters show of one specimen: DC resistances, and AC quantities between its electrodes.

    SPECIMEN is any name that is bound to a design, by --design here or by 'log specimen', or one as '23 triY .2mm 3'.
    An AC quantity stands with its frequency, as --C 12.3pF@1kHz --D 0.02@1kHz; repeats have / between them, and a
    standard uncertainty may follow, as 12.3/12.4±0.1pF@1kHz. A small m of --y and --z is taken for mega, and asked for
    on a terminal.
    """
    from dataclasses import replace

    from sensorgen.measure.immittance import parse
    from sensorgen.measure.log import Reading, binding, files, notes

    if meter and not visa:
        raise BadInput(f"--meter {meter} without --visa; expected the meter's address too")
    if visa and (y_words or z_words):
        raise BadInput("--visa beside --y or --z; expected the meter's readings or words, not both")
    typed = {name: texts for name, texts in ac.items() if texts and [parse(name, text) for text in texts]}
    if not (y_words.strip() or z_words.strip() or remark or visa or typed or defects or photo):
        raise BadInput("nothing to log; expected --y, --z, --C or another quantity, --visa, --defect or --remark")
    if design:
        with opened(file, create=True) as log:
            for bound in binding.bind(log, [specimen], design):
                render.say(f"{specimen}: design {getattr(bound, 'design', '')}", err=bool(render.form()))
    with nullcontext() if file and not Path(file).exists() else existing(file) as known:
        notes.specimen(specimen, known)  # a wrong name is refused before anybody measures, and before a log is made
    if predict:
        with opened(file, create=True) as log:
            _predict_ahead(log, specimen)
    if visa:
        y_words, z_words, instrument = _measured(visa, meter, axis, wires or "2")
    mega = _asked_mega(y=y_words, z=z_words)
    with opened(file, create=True) as log:
        row = notes.reading(
            specimen, y_words, z_words, mega=mega, supersedes=_uid(log, Reading, corrects), baked=baked, remark=remark,
            measured_at=measured_at, instrument=instrument, source=visa or "typed", log=log,
        )  # fmt: skip
        kept = [files.keep_photo(log.files, Path(photo))] if photo else []
        row = replace(
            notes.with_ac(row, typed), wires=int(wires) if wires else None, temperature_c=temperature,
            humidity_percent=humidity, photo=kept[0].uid if kept else "", defects=tuple(dict.fromkeys(defects)),
        )  # fmt: skip
        _deliver([new for new in log.add([*kept, row]) if isinstance(new, Reading)], log)


def _specimen(
    names: tuple[str, ...], design: str | None, printed: str | None, iteration: int | None, file: str | None
) -> None:
    """Bind specimens to the design that they were printed of; readings and recordings then get it by the name."""
    from sensorgen.measure.log import binding

    with opened(file, create=True) as log:
        new = binding.bind(log, names, design or "", printed=printed or "", iteration=iteration)
        _deliver(new, log, "the log has these specimens with this very design")


def _predict_ahead(log: "Log", specimen: str) -> None:
    """Log what is expected before the specimen is measured; beside JSON, which has the measurement alone."""
    from sensorgen.workflows import stored_prediction

    for row in stored_prediction.predict(log, specimen):
        render.say(f"logged prediction {row.number} of {specimen}", err=bool(render.form()))


def _asked_mega(**typed: str) -> bool:
    """Test whether a person says that a small m means mega; no question where there is no m, or no person."""
    from sensorgen.measure.log.notes import resistance

    found = [word for axis, words in typed.items() for word in resistance(axis, words).mega]
    if not found or not (sys.stdin and sys.stdin.isatty()):
        return False
    if not click.confirm(f"{', '.join(found)}: is m mega (a million)?", default=True, err=True):
        raise BadInput(f"{found[0]!r} is not logged; write M for mega, or 0.0011 for 1.1 milliohm")
    return True


def _measured(visa: str, kind: str | None, axis: str | None, wires: str) -> tuple[str, str, str]:
    """Words of a meter for Y and Z, and what it calls itself; leads are moved between the two."""
    from contextlib import closing

    from sensorgen.measure.lab import rigs

    if axis is None and not (sys.stdin and sys.stdin.isatty()):
        raise BadInput("--visa without --axis needs somebody to move the leads; expected --axis y or --axis z")
    found = {"y": "", "z": ""}
    with closing(rigs.meter(kind, visa)) as meter:
        meter.identify()
        for which in [axis] if axis else ["y", "z"]:
            if axis is None:
                click.pause(f"Leads to {which.upper()}, then any key ...", err=True)
            found[which] = meter.resistance(wires=int(wires))
        return found["y"], found["z"], meter.name


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


def _import(
    path: str | None, columns: tuple[str, ...], file: str | None, *, thesis: bool, specimen: str | None,
    instrument: str, baked: bool | None, remark: str,
) -> None:  # fmt: skip
    """Log all rows of a file, or none of them.

    A table of readings as CSV, the batch.json of a print bed, what 'log export' wrote, or with --specimen the export of
    an LCR meter: Frequency, Cp, D and the like, with any separator. Rows that the log has are passed over.
    """
    from sensorgen.measure.log import importing

    if thesis == bool(path):
        raise BadInput(f"{'both' if path else 'neither'} of FILE and --thesis given; expected one of them")
    named = dict(pairs(columns, "--column"))
    if specimen is None and (instrument or remark or baked is not None):
        raise BadInput("--instrument, --baked and --remark are for the export of an LCR meter; expected --specimen too")
    with opened(file, create=True) as log:
        if specimen is not None:
            how = {"instrument": instrument, "remark": remark}
            done = importing.lcr_export(log, Path(str(path)), specimen, baked=baked, **how)
        else:
            done = importing.thesis(log) if thesis else importing.import_file(log, Path(str(path)), named)
        render.deliver(done, before=[f"import into {log.path}"])


def _bench(
    specimen: str, lcr_file: str, rig_file: str | None, remark: str, file: str | None, corrects: int | None, *,
    columns: tuple[str, ...], rig_columns: tuple[str, ...], predict: bool,
) -> None:  # fmt: skip
    """Log a recording of one specimen, its files kept whole.

    LCR_FILE is the impedance analyser's, RIG_FILE the rig's with force and position.
    """
    from sensorgen.measure.log import BenchRun, bench

    ours, rig = columns_of(columns, "--column"), columns_of(rig_columns, "--rig-column")
    with opened(file, create=True) as log:
        if predict:
            _predict_ahead(log, specimen)
        new = bench.log_recording(
            log, specimen, Path(lcr_file), Path(rig_file) if rig_file else None, columns=ours, rig_columns=rig,
            remark=remark, supersedes=_uid(log, BenchRun, corrects),
        )  # fmt: skip
        _deliver(new, log, f"{specimen}: the log has this very recording; --corrects NUMBER changes remark or columns")


def _predict(design: "Design", *, file: str | None) -> int:
    from sensorgen.measure.log import Prediction
    from sensorgen.workflows.stored_prediction import predicted_rows

    with opened(file, create=True) as log:
        new = [row for row in log.add(predicted_rows(design)) if isinstance(row, Prediction)]
        _deliver(new, log, f"{design.name}: the log has this very prediction")
    return 0


def _withdraw(kind: str, number: int, reason: str, file: str | None) -> None:
    """Take a row out of use: it stays in the log with the reason, and no report uses it.

    For a reading or a recording that is to be replaced, --corrects of 'log add' and 'log bench' is better.
    """
    from sensorgen.measure.log.withdrawing import withdraw

    with opened(file) as log:
        _deliver([withdraw(log, kind, number, reason)], log)


_OF_READINGS: list[click.Parameter] = [
    click.Option(["--remark"], metavar="TEXT", default="", help="Anything worth knowing, in your own words."),
    click.Option(
        ["--predict"], is_flag=True,
        help="Log first what the specimen's design is expected to measure, if the log does not have it.",
    ),
    click.Option(["--corrects"], metavar="NUMBER", type=int, help="Number of the row that this one corrects."),
    where(),
    *render.options("json", "markdown"),
]  # fmt: skip
add = made(
    _add, "add", "Log what meters show of one specimen.",
    click.Argument(["specimen"]),
    click.Option(["--y", "y_words"], metavar="WORDS", default="", help="DC resistance along an electrode, as 0.65k."),
    click.Option(["--z", "z_words"], metavar="WORDS", default="", help="DC resistance between the electrodes."),
    *(
        click.Option([flag, name], metavar="WORDS", multiple=True, help=about)
        for flag, name, about in (
            ("--C", "Cp", "Capacitance in parallel (Cp), as 12.3pF@1kHz."), ("--Cs", "Cs", "Capacitance in series."),
            ("--D", "D", "Loss factor, as 0.02@1kHz."), ("--R", "R", "Real part of Z (Rs), as 1.2kohm@10kHz."),
            ("--X", "X", "Imaginary part of Z, negative of a capacitor."), ("--Z", "Z", "Magnitude of Z."),
            ("--phase", "phase", "Angle of Z, as -88deg@1kHz."),
        )
    ),
    click.Option(["--design"], metavar="DESIGN", help="Bind the name to it first: a design file, or one in the log."),
    click.Option(["--baked/--unbaked"], default=None, help="Whether the specimen was baked before."),
    click.Option(["--measured-at"], metavar="WHEN", default="", help="When it was measured, in your own words."),
    click.Option(["--instrument"], metavar="NAME", default="", help="The meter, as 'HP 4284A': its accuracy is used."),
    click.Option(["--temperature"], metavar="C", type=NumberRange(-50, 200), help="Of the air [C]."),
    click.Option(["--humidity"], metavar="PERCENT", type=NumberRange(0, 100), help="Of the air, relative."),
    click.Option(["--photo"], metavar="FILE", help="A photo of the specimen, kept with the log."),
    click.Option(["--defect", "defects"], type=OneOf(DEFECTS), multiple=True, help="A defect that can be seen."),
    click.Option(["--visa"], metavar="ADDRESS", help="Read the meter there, as GPIB0::22::INSTR: first Y, then Z."),
    click.Option(
        ["--meter"], metavar="KIND", help="That meter's kind, of 'list devices'; 34401A or Keithley 2000 if not given.",
    ),
    click.Option(["--axis"], type=OneOf(("y", "z")), help="Let the meter read this one only."),
    click.Option(["--wires"], type=OneOf(("2", "4")), help="Leads of the meter; 2 with --visa if not given."),
    *_OF_READINGS,
)  # fmt: skip
specimen = made(
    _specimen, "specimen", "Bind specimens of any name to their design.",
    click.Argument(["names"], metavar="NAME...", nargs=-1, required=True),
    click.Option(["--design"], metavar="DESIGN", help="A design file, or identity or name of a design in the log."),
    click.Option(["--printed"], metavar="NAME", help="The specimen's name on a print bed of the log, with its design."),
    click.Option(["--iteration"], type=click.IntRange(0), help="Of the design, to report specimens together."),
    where(),
    *render.options("json", "markdown"),
)  # fmt: skip
table = made(
    _import, "import", "Log a table, a print bed, or an export of a log.",
    click.Argument(["path"], metavar="[FILE]", required=False),
    click.Option(["--thesis"], is_flag=True, help="Table D.1 of the thesis, 69 rows; sensorgen brings it along."),
    click.Option(
        ["--column", "columns"], metavar="OURS=THEIRS", multiple=True,
        help="Which column is which, as y='Resistance in Y': specimen, y, z, remark, baked, measured_at.",
    ),
    click.Option(["--specimen"], metavar="NAME", help="The file is an LCR meter's export of this specimen."),
    click.Option(["--instrument"], metavar="NAME", default="", help="That meter, as 'HP 4284A'."),
    click.Option(["--baked/--unbaked"], default=None, help="Whether that specimen was baked before."),
    click.Option(["--remark"], metavar="TEXT", default="", help="Anything worth knowing of that specimen."),
    where(),
    *render.options("json", "markdown"),
)  # fmt: skip
bench = made(
    _bench, "bench", "Log a recording of one specimen.",
    click.Argument(["specimen"]),
    click.Argument(["lcr_file"]),
    click.Argument(["rig_file"], required=False),
    *recorded_columns(),
    *_OF_READINGS,
)  # fmt: skip
predict = DesignGroup(
    _predict, [where(), *render.options("json", "markdown")], name="predict",
    help="Keep what a design is expected to measure, so that no later comparison can be tuned.",
    short_help="Log what a design is expected to measure.",
)  # fmt: skip
withdrawing = made(
    _withdraw, "withdraw", "Take a row out of use, with a reason.",
    click.Argument(["kind"], type=OneOf(KINDS)),
    click.Argument(["number"], type=int),
    click.Option(["--reason"], metavar="TEXT", required=True, help="Why, in your own words."),
    where(),
    *render.options("json", "markdown"),
)  # fmt: skip
