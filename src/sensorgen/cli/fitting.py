"""``sensorgen calibrate|fit|characterise|report``: specimens, and values of materials, by what was measured."""

import re
import webbrowser
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import FOUND_ERRORS, inversion, options, render
from sensorgen.cli.commands import FirstWord
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import BodyChoice
from sensorgen.cli.inversion import ArrayOptions
from sensorgen.cli.options import BenchTip, DryRun, LogFile, Out
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.analysis.fit.estimates import Fit
    from sensorgen.analysis.report import Report
    from sensorgen.core.document import Documented
    from sensorgen.measure.log import Log

_OF_SPECIMENS = ("recordings", "again", "page", "source", "dry_run", "tip", "force_offset", "file")
_OF_ARRAYS = ("array", "calibration", "by_first", "frequency_hz", "readout", "input_ohm")
Recordings = Annotated[tuple[int, ...], Option(kind=click.IntRange(1))]


@of_function("calibrate", *render.options("json", "markdown"))
def calibrate_command(
    specimens: tuple[str, ...], bench: BenchTip, *, recordings: Recordings = (), again: bool = False,
    page: Path | None = None, source: Path | None = None, of_array: ArrayOptions, log: LogFile, body: BodyChoice,
    dry_run: bool = False,
) -> int:  # fmt: skip
    """Calibrate specimens by recordings with known presses, and by readings of meters, that the log has of them.

    Files in place of specimens are sessions of an array, each with time_s, its elements and a reference: pressure_kpa
    of a bladder, force_n of a press on an 'element', or force_n of a person on a plate.

    Several specimens share the bench. Some 30 presses, half of them after a higher one and held for 0.3 to 30 s, are
    enough; with none, R, C and leak are calibrated by what was read at rest. 'sensorgen invert SPECIMEN' then uses the
    result, which the log keeps.

    Parameters
    ----------
    specimens : SPECIMEN...|FILE...
    recordings, --recording : NUMBER
        Only this recording of the log.
    again, --recheck
        Hold 3 to 5 new known presses against the calibration, as after a change of tip, and mend it.
    page : FILE.html
        Write pictures of the presses and of what was learnt.
    source : FILE.yaml
        Write the material values of the specimen as a source that designs can name.
    dry_run
        Log nothing.
    """
    if inversion.are_files(specimens):
        options.refuse_typed(_OF_SPECIMENS, "is for specimens, not for what is given")
        return inversion.calibrate(specimens, of_array)
    options.refuse_typed(_OF_ARRAYS, "is for files of an array, not for what is given")
    from sensorgen.analysis import calibration

    pressed = bench.bench()
    _refuse(len(specimens), again=again, source=bool(source))
    with log.opened() as rows, render.progress(["calibrating"]) as step:
        results = calibration.Together(
            (calibration.recheck(rows, specimens[0], recordings),) if again
            else tuple(calibration.calibrate(rows, specimens, pressed, recordings, body_of=body, step=step))
        )  # fmt: skip
        if not dry_run:
            rows.add(calibration.rows(rows, [one.calibration for one in results.results]))
    render.deliver(results)
    if source:
        render.file(source, results.results[0].calibration.source())
    if page:
        from sensorgen.analysis.calibration.page import html

        render.file(page, html(results.results))
    return FOUND_ERRORS if any(getattr(one, "alarm", False) for one in results.results) else 0


def _refuse(count: int, *, again: bool, source: bool) -> None:
    """Refuse what needs one specimen of several, and another bench for a calibration that goes on."""
    for option, given in (("--recheck", again), ("--source", source)):
        if given and count > 1:
            raise BadInput(f"{option} of {count} specimens; expected one; 'sensorgen fit' takes several")
    if again and any(options.typed(name) for name in ("tip", "force_offset")):
        raise BadInput("--recheck goes on with tip and offset of the calibration; expected no --tip, no --force-offset")


Iteration = Annotated[int | None, Option(kind=click.IntRange(0))]
SERIES = 23  # of --thesis


@of_function("fit", *render.options(file=False))
def fit_command(
    specimens: tuple[str, ...] = (), *, iteration: Iteration = None, thesis: bool = False, log: LogFile,
    output: Path | None = None, seed: int = 23, bench: BenchTip, body: BodyChoice, dry_run: DryRun = False,
) -> None:  # fmt: skip
    """Fit material values to what was measured of specimens or of an iteration, and keep them as a source.

    Specimens that the bench or an LCR meter measured are calibrated, as by 'sensorgen calibrate'; the values hold for
    all prints, their intervals the scatter between them. A design takes them by the source's name, as etpu@fit-23. A
    quarter of the specimens is held back to test the values, and each shape and direction is left out in turn.

    Parameters
    ----------
    specimens : [SPECIMEN...]
    iteration
        Of the design, in place of specimens.
    thesis
        Series 23 of the thesis's Table D.1, none held back, no log.
    output, --output, -o : FILE
        File to write instead of the source's own.
    seed
        Of the split.
    """
    from dataclasses import replace

    from sensorgen.analysis.fit import HELD_BACK, STEPS, fit
    from sensorgen.analysis.fit.estimates import text
    from sensorgen.core import files
    from sensorgen.design.materials import source_path

    if bool(specimens) + (iteration is not None) + thesis != 1:
        raise BadInput("expected either specimens, as in 'sensorgen fit S1 S2', --iteration or --thesis")
    which, share = (SERIES, 0.0) if thesis else (iteration, HELD_BACK)
    pressed = bench.bench()
    with _thesis() if thesis else log.opened() as rows, render.progress(STEPS) as step:
        values = fit(rows, which, seed, body, step, pressed, specimens=specimens, held_share=share)
    if values.values and not dry_run:
        path = output or source_path(values.source)
        files.replace(path, text(values).encode())
        values = replace(values, file=str(path))
    render.deliver(values)
    if values.file and not output and not render.form():
        render.say(f"take them with {_options(values)}")


@contextmanager
def _thesis() -> "Iterator[Log]":
    """A log of Table D.1 alone that is not kept."""
    from sensorgen.measure.log import Log, exchange

    with TemporaryDirectory() as folder, Log(Path(folder) / "log.db", create=True) as log:
        exchange.thesis(log)
        yield log


def _options(values: "Fit") -> str:
    """Options by which the next design takes the values."""
    from sensorgen.design.design import material

    named = dict.fromkeys(value.material for value in values.values)
    parts = {name: "electrode" if material(name).conductor else "dielectric" for name in named}
    return " ".join(f"--material {part}={name}@{values.source}" for name, part in parts.items())


def _printer(
    name: str, materials: tuple[str, ...], *, quality: str = "fine", tools: tuple[str, ...] = (), plate: str = "",
    count: int = 12, hours: float = 4.0, out: Out = Path("out"),
) -> "Documented":  # fmt: skip
    """Choose coupons and write their plate's files.

    Parameters
    ----------
    materials : MATERIALS
    quality : NAME
        Print quality.
    tools, --tool : MATERIAL=NUMBER
        Tool of a material.
    plate, --name : NAME
        Of the plate, and of its folder.
    count
        Most coupons.
    hours
        Longest print [h].
    out
        Folder of plates.
    """
    from sensorgen.workflows.characterise import STEPS, Study, plan

    pairs = {word: word.partition("=") for word in tools}
    if wrong := next((word for word, (_, _, number) in pairs.items() if not number.isdigit()), None):
        raise BadInput(f"--tool {wrong!r}; expected MATERIAL=NUMBER, as in etpu=3")
    names = [material for word in materials for material in word.split(",")]
    numbers = {key: int(number) for key, _, number in pairs.values()}
    with render.progress(STEPS) as step:
        study = Study.of(name, names, quality=quality, tools=numbers)
        return plan(study, out, name=plate, count=count, hours=hours, step=step)


characterise_command = FirstWord(
    "characterise",
    _printer,
    *render.options(folder=True),
    thing="printer",
    form="PRINTER MATERIALS {option}",
    subcommand_metavar="{PRINTER MATERIALS|read FORM} [OPTIONS]",
    help="""Print test structures (coupons), and turn their readings into material values.

    \b
    sensorgen characterise diabase-h5 etpu x60      plate, form, intervals
    sensorgen characterise read out/NAME/form.yaml  values: etpu@lab-NAME

    docs/characterise.md explains the coupons.
    """,
    epilog="PRINTER MATERIALS --help lists the options.",
)


@of_function("read", *render.options(file=False), group=characterise_command, short="Values from a filled-in form.")
def _read(
    form: Path, *, name: str = "", picture: Path | None = None, force: bool = False, dry_run: DryRun = False,
) -> "Documented":  # fmt: skip
    """Evaluate a form that was filled in: values with 95 % intervals, kept as a source that designs can name.

    Gaps are allowed. A coupon that contradicts the others is left out, with the probability that it is broken.

    Parameters
    ----------
    form
    name : SOURCE
        As in etpu@SOURCE; else from the plate.
    picture : FILE
        Draw the intervals before and after, as SVG.
    force
        Replace a source of that name.
    """
    from sensorgen.core import files
    from sensorgen.workflows.characterise import read, svg

    values = read(form, name, keep=not dry_run, force=force)
    if picture:
        files.replace(picture, svg(values.source, values.rows).encode())
    return values


Format = Annotated[str, Option(kind=("html", "md", "csv", "json"))]


@of_function("report")
def report_command(
    specimens: tuple[str, ...] = (), *, iteration: Iteration = None,
    log: LogFile, output: str = "", how: Format = "", pictures: Path | None = None, show_it: bool = False,
) -> None:  # fmt: skip
    """Compare predictions and measurements of specimens, of an iteration, or of everything in the log.

    One HTML file that needs no network, or Markdown, CSV or JSON with the same numbers. Prints the headline and the
    name of the file.

    Parameters
    ----------
    specimens : [SPECIMEN]...
    output, --output, -o : FILE
        File to write; report-WHICH.FORMAT here if not given, - to print.
    how, --format
        Of the file; by its name's end, else html, if not given.
    iteration
        Of the design.
    pictures, --figures : FOLDER
        Write every figure there too, as PNG and SVG.
    show_it, --open
        Show the page in the browser.
    """
    from sensorgen.analysis.report import STEPS, pieces, report

    how = how or _form(output)
    if show_it and (how != "html" or output == "-"):
        raise BadInput("--open shows an HTML file; expected --format html and a file")
    with log.opened() as rows, render.progress(STEPS) as step:
        compared = report(rows, iteration, step, specimens=specimens)
    if pictures:
        _draw(compared, pictures)
    if output == "-":
        render.write(pieces(compared, how))
        return
    path = Path(output or f"report-{_which(compared, iteration)}.{how}")
    _write(path, pieces(compared, how), compared.headline)
    if show_it:
        webbrowser.open(path.resolve().as_uri())


def _form(output: str) -> str:
    """Format of a report by its file's name; HTML of any other."""
    from sensorgen.analysis.report import FORMATS

    return next((form for form in FORMATS if output.endswith(f".{form}")), "html")


def _which(compared: "Report", iteration: int | None) -> str:
    """Iteration, first specimen, or all, as a part of a file's name."""
    which = str(iteration) if iteration is not None else next(iter(compared.specimens), "all")
    return re.sub(r"\W+", "-", which)


def _write(path: Path, content: Iterator[str], headline: Sequence[str]) -> None:
    """Write the file, and print the headline and its name."""
    from sensorgen.core import document, files

    with files.replacing(path) as target:
        target.writelines(piece.encode() for piece in content)
    render.write(f"{line}\n" for line in document.text([*headline, str(path)]))


def _draw(compared: "Report", folder: Path) -> None:
    from sensorgen.analysis.plots.static import files

    with render.progress([figure.key for figure in compared.figures]) as step:
        for figure in compared.figures:
            step(figure.key)
            render.written(folder, files(figure))
