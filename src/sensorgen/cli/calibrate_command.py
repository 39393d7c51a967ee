"""``sensorgen calibrate``: how one specimen differs from its prediction, by known presses."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from sensorgen.cli import FOUND_ERRORS, array_calibrate, body_options, log_words, options, render, show
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.calibration import Made, Recheck


def _work(
    specimens: tuple[str, ...], tip: dict[str, object] | None, force_offset: str, recordings: tuple[int, ...],
    page: str | None, source: str | None, file: str | None, *, again: bool, dry_run: bool, **of_array: Any,
) -> int:  # fmt: skip
    """Calibrate specimens by recordings with known presses, and by readings of meters, that the log has of them.

    Files in place of specimens are sessions of an array, each with time_s, its elements and a reference: pressure_kpa
    of a bladder, force_n of a press on an 'element', or force_n of a person on a plate.

    Several specimens share the bench. Some 30 presses, half of them after a higher one and held for 0.3 to 30 s, are
    enough; with none, R, C and leak are calibrated by what was read at rest. 'sensorgen invert SPECIMEN' then uses the
    result, which the log keeps.
    """
    if array_calibrate.are_files(specimens):
        array, target = of_array["array"], of_array["calibration"]
        return array_calibrate.calibrate(specimens, array, target, by_first=of_array["by_first"])
    from sensorgen.analysis import calibration

    bench = options.bench_of(tip, force_offset)
    for option, is_given in (("--recheck", again), ("--source", source)):
        if is_given and len(specimens) > 1:
            raise BadInput(f"{option} of {len(specimens)} specimens; expected one; 'sensorgen fit' takes several")
    given = click.get_current_context().get_parameter_source
    if again and any(given(name) is ParameterSource.COMMANDLINE for name in ("tip", "force_offset")):
        raise BadInput("--recheck goes on with tip and offset of the calibration; expected no --tip, no --force-offset")
    with log_words.opened(file) as log, show.progress(["calibrating"]) as step:
        made: list[Made | Recheck]
        if again:
            made = [calibration.recheck(log, specimens[0], recordings)]
        else:
            made = [
                *calibration.calibrate(log, specimens, bench, recordings, body_of=body_options.body_of(), step=step)
            ]
        if not dry_run:
            log.add(calibration.rows(log, [one.calibration for one in made]))
    render.deliver(calibration.Together(tuple(made)))
    if source:
        from sensorgen.core import files as store

        store.replace(Path(source), made[0].calibration.source().encode())
        render.say(source)
    if page:
        from sensorgen.analysis.calibration.page import html
        from sensorgen.core import files as store

        store.replace(Path(page), html(made).encode())
        render.say(page)
    return FOUND_ERRORS if any(isinstance(one, calibration.Recheck) and one.alarm for one in made) else 0


command = click.Command(
    "calibrate", callback=_work, help=_work.__doc__,
    params=[
        click.Argument(["specimens"], nargs=-1, required=True, metavar="SPECIMEN...|FILE..."),
        *options.bench(),
        click.Option(
            ["--recording", "recordings"], type=click.IntRange(1), multiple=True, metavar="NUMBER",
            help="Only this recording of the log.",
        ),
        click.Option(
            ["--recheck", "again"], is_flag=True,
            help="Hold 3 to 5 new known presses against the calibration, as after a change of tip, and mend it.",
        ),
        click.Option(["--page"], metavar="FILE.html", help="Write pictures of the presses and of what was learnt."),
        click.Option(
            ["--source"], metavar="FILE.yaml",
            help="Write the material values of the specimen as a source that designs can name.",
        ),
        *array_calibrate.options(), log_words.where(),
        *body_options.body_options(),
        click.Option(["--dry-run"], is_flag=True, help="Log nothing."),
        *render.options("json", "markdown"),
    ],
)  # fmt: skip
