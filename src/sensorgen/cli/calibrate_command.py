"""``sensorgen calibrate``: how one specimen differs from its prediction, by known presses."""

from pathlib import Path
from typing import Annotated

import click

from sensorgen.cli import FOUND_ERRORS, inversion, options, render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.inversion import ArrayOptions
from sensorgen.cli.options import BenchTip, LogFile
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

_OF_SPECIMENS = ("recordings", "again", "page", "source", "dry_run")
_OF_ARRAYS = ("array", "calibration", "by_first", "frequency_hz")
Recordings = Annotated[tuple[int, ...], Option(kind=click.IntRange(1))]


@of_function("calibrate", *render.options("json", "markdown"))
def command(
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
