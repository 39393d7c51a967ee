"""``sensorgen fit``: material values out of the log, as a new source."""

from collections.abc import Iterator
from math import exp
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, log_words, show

if TYPE_CHECKING:
    from sensorgen.analysis.fit import Fit


def _work(
    iteration: int, file: str | None, output: str | None, seed: int, drawn: bool, slicer: str | None, walls: str | None,
    *, dry_run: bool, as_json: bool,
) -> int:  # fmt: skip
    """Fit material values to what was measured, and keep them as a source.

    A design takes them where it names the source, as in etpu@fit-23. A quarter of the specimens is held back, to
    see whether the values predict what they were not fitted to.
    """
    from dataclasses import asdict

    from sensorgen.analysis.fit import fit, text
    from sensorgen.core import files as store
    from sensorgen.design.materials import own

    with log_words.opened(file) as log:
        made = fit(log, iteration, seed, body_options.body_of(drawn, slicer, walls))
    path = Path(output) if output else own.path(made.source)
    keep = bool(made.values) and not dry_run
    if keep:
        store.replace(path, text(made).encode())
    if as_json:
        show.as_json(asdict(made) | {"file": str(path) if keep else None})
        return 0
    click.echo("\n".join(_lines(made)))
    if keep:
        how = f"; take them with {_taken(made)}" if not output else ""
        click.echo(f"in {path}{how}")
    return 0


def _taken(made: "Fit") -> str:
    """How the next design takes the values."""
    from sensorgen.design import materials

    named = dict.fromkeys(value.material for value in made.values)
    parts = {name: "electrode" if materials.load(name).conductor else "dielectric" for name in named}
    return " ".join(f"--material {part}={name}@{made.source}" for name, part in parts.items())


def _lines(made: "Fit") -> Iterator[str]:
    yield f"iteration {made.iteration}: {made.specimens} specimens fitted to, {len(made.held_back)} held back"
    for value in made.values:
        yield f"  {value.material} {value.quantity} = {value.value:.4g} ({value.low:.4g} to {value.high:.4g})"
        yield f"    {value.note}"
    for untold in made.untold:
        yield f"  not determined: {untold.parameter}: {untold.why}"
    for error in made.errors:
        before, after = (f"a factor of {exp(e):.3g}" for e in (error.before, error.after))
        yield f"  {error.observable} of {error.count} held back: off by {before} before, {after} after (rms)"
    if made.left_out:
        yield f"  left out: {len(made.left_out)}; sensorgen report --iteration {made.iteration} says why"


command = click.Command(
    "fit", callback=_work, help=_work.__doc__, short_help="Fit material values to what was measured.",
    params=[
        click.Option(["--iteration"], type=click.IntRange(0), required=True, help="Of the design."),
        log_words.where(),
        click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the source's own."),
        click.Option(["--seed"], type=int, default=23, show_default=True, help="Of the split."),
        *body_options.body_options(),
        click.Option(["--dry-run"], is_flag=True, help="Write no file."),
        log_words.as_json(),
    ],
)  # fmt: skip
