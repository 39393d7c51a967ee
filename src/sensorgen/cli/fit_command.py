"""``sensorgen fit``: material values out of the log, as a new source."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, log_words, options, render, show
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.fit import Fit
    from sensorgen.measure.log import Log


def _work(
    specimens: tuple[str, ...], iteration: int | None, file: str | None, output: str | None, seed: int,
    tip: dict[str, object] | None, force_offset: str, *, thesis: bool, dry_run: bool,
) -> None:  # fmt: skip
    """Fit material values to what was measured of specimens or of an iteration, and keep them as a source.

    Specimens that the bench or an LCR meter measured are calibrated, as by 'sensorgen calibrate'; the values hold for
    all prints, their intervals the scatter between them. A design takes them by the source's name, as etpu@fit-23. A
    quarter of the specimens is held back to test the values, and each shape and direction is left out in turn.
    """
    from dataclasses import replace

    from sensorgen.analysis.fit import STEPS, fit, text
    from sensorgen.analysis.fit.fitting import HELD_BACK
    from sensorgen.core import files as store
    from sensorgen.design.materials import own

    if bool(specimens) + (iteration is not None) + thesis != 1:
        raise BadInput("expected either specimens, as in 'sensorgen fit S1 S2', --iteration or --thesis")
    bench = options.bench_of(tip, force_offset)
    which, share = _WHICH.get(thesis, (iteration, HELD_BACK))
    with _opened(file, thesis=thesis) as log, show.progress(STEPS) as step:
        made = fit(log, which, seed, body_options.body_of(), step, bench, specimens=specimens, held_share=share)
    if made.values and not dry_run:
        path = Path(output) if output else own.path(made.source)
        store.replace(path, text(made).encode())
        made = replace(made, file=str(path))
    render.deliver(made)
    if made.file and not output and not render.form():
        render.say(f"take them with {_taken(made)}")


_WHICH = {True: (23, 0.0)}  # iteration of --thesis, and the share that is held back


@contextmanager
def _opened(file: str | None, *, thesis: bool) -> "Iterator[Log]":
    """The log, or one of Table D.1 alone that is not kept."""
    from sensorgen.measure.log import Log, importing

    if not thesis:
        with log_words.opened(file) as log:
            yield log
        return
    with TemporaryDirectory() as folder, Log(Path(folder) / "log.db", create=True) as log:
        importing.thesis(log)
        yield log


def _taken(made: "Fit") -> str:
    """Command by which the next design takes the values."""
    from sensorgen.design.design import material

    named = dict.fromkeys(value.material for value in made.values)
    parts = {name: "electrode" if material(name).conductor else "dielectric" for name in named}
    return " ".join(f"--material {part}={name}@{made.source}" for name, part in parts.items())


command = click.Command(
    "fit", callback=_work, help=_work.__doc__,
    params=[
        click.Argument(["specimens"], nargs=-1, metavar="[SPECIMEN...]"),
        click.Option(["--iteration"], type=click.IntRange(0), help="Of the design, in place of specimens."),
        click.Option(["--thesis"], is_flag=True, help="Series 23 of the thesis's Table D.1, none held back, no log."),
        log_words.where(),
        click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the source's own."),
        click.Option(["--seed"], type=int, default=23, show_default=True, help="Of the split."),
        *options.bench(),
        *body_options.body_options(),
        click.Option(["--dry-run"], is_flag=True, help="Write no file."),
        *render.options(file=False),
    ],
)  # fmt: skip
