"""``sensorgen fit``: material values out of the log, as a new source."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import BenchTip, DryRun, LogFile
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.analysis.fit import Fit
    from sensorgen.measure.log import Log

Iteration = Annotated[int | None, Option(kind=click.IntRange(0))]
SERIES = 23  # of --thesis


@of_function("fit", *render.options(file=False))
def command(
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

    from sensorgen.analysis.fit import STEPS, fit, text
    from sensorgen.analysis.fit.fitting import HELD_BACK
    from sensorgen.core import files
    from sensorgen.design.materials import own

    if bool(specimens) + (iteration is not None) + thesis != 1:
        raise BadInput("expected either specimens, as in 'sensorgen fit S1 S2', --iteration or --thesis")
    which, share = (SERIES, 0.0) if thesis else (iteration, HELD_BACK)
    pressed = bench.bench()
    with _thesis() if thesis else log.opened() as rows, render.progress(STEPS) as step:
        values = fit(rows, which, seed, body, step, pressed, specimens=specimens, held_share=share)
    if values.values and not dry_run:
        path = output or own.path(values.source)
        files.replace(path, text(values).encode())
        values = replace(values, file=str(path))
    render.deliver(values)
    if values.file and not output and not render.form():
        render.say(f"take them with {_options(values)}")


@contextmanager
def _thesis() -> "Iterator[Log]":
    """A log of Table D.1 alone that is not kept."""
    from sensorgen.measure.log import Log, importing

    with TemporaryDirectory() as folder, Log(Path(folder) / "log.db", create=True) as log:
        importing.thesis(log)
        yield log


def _options(values: "Fit") -> str:
    """Options by which the next design takes the values."""
    from sensorgen.design.design import material

    named = dict.fromkeys(value.material for value in values.values)
    parts = {name: "electrode" if material(name).conductor else "dielectric" for name in named}
    return " ".join(f"--material {part}={name}@{values.source}" for name, part in parts.items())
