"""``sensorgen fit``: material values out of the log, as a new source."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, log_words, options, render, show
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.fit import Fit


def _work(
    specimens: tuple[str, ...], iteration: int | None, file: str | None, output: str | None, seed: int,
    tip: dict[str, object] | None, force_offset: str, *, dry_run: bool,
) -> None:  # fmt: skip
    """Fit material values to what was measured of specimens or of an iteration, and keep them as a source.

    Each specimen that the bench or an LCR meter has measured is calibrated, as by 'sensorgen calibrate'; the values
    hold for all prints, and their intervals the scatter between them. A design takes them where it names the source,
    as in etpu@fit-23. A quarter of the specimens is held back, to see whether the values predict them.
    """
    from dataclasses import replace

    from sensorgen.analysis.fit import STEPS, fit, text
    from sensorgen.core import files as store
    from sensorgen.design.materials import own

    if bool(specimens) == (iteration is not None):
        raise BadInput("expected either specimens, as in 'sensorgen fit S1 S2', or --iteration")
    bench = options.bench_of(tip, force_offset)
    with log_words.opened(file) as log, show.progress(STEPS) as step:
        made = fit(log, iteration, seed, body_options.body_of(), step, bench, specimens=specimens)
    if made.values and not dry_run:
        path = Path(output) if output else own.path(made.source)
        store.replace(path, text(made).encode())
        made = replace(made, file=str(path))
    render.deliver(made)
    if made.file and not output and not render.form():
        render.say(f"take them with {_taken(made)}")


def _taken(made: "Fit") -> str:
    """How the next design takes the values."""
    from sensorgen.design.design import material

    named = dict.fromkeys(value.material for value in made.values)
    parts = {name: "electrode" if material(name).conductor else "dielectric" for name in named}
    return " ".join(f"--material {part}={name}@{made.source}" for name, part in parts.items())


command = click.Command(
    "fit", callback=_work, help=_work.__doc__,
    params=[
        click.Argument(["specimens"], nargs=-1, metavar="[SPECIMEN...]"),
        click.Option(["--iteration"], type=click.IntRange(0), help="Of the design, in place of specimens."),
        log_words.where(),
        click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the source's own."),
        click.Option(["--seed"], type=int, default=23, show_default=True, help="Of the split."),
        *options.bench(),
        *body_options.body_options(),
        click.Option(["--dry-run"], is_flag=True, help="Write no file."),
        *render.options(file=False),
    ],
)  # fmt: skip
