"""``sensorgen optimise``: the best printable designs for a target."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from sensorgen.cli import options, render, sweeps
from sensorgen.core.units import si


def _optimise(
    target: str,
    *,
    out: str,
    sample: int,
    jobs: int | None,
    cluster: str,
    no_cache: bool,
    no_build: bool,
    no_gcode: bool,
    tip: dict[str, object] | None,
) -> int:
    """Find the designs of a space that no other is better than, as printed, and write the files of up to three.

    Every combination of the target's values is checked, bounded or evaluated; each one that is out has its reason. Of a
    shape or a design, designs like it are tried for the best resolutions; docs/optimise.md has a target. A search that
    was stopped goes on where it was. Exit code 1 where no design meets the target.
    """
    from sensorgen.workflows.optimise.run import optimise
    from sensorgen.workflows.optimise.search import Workers

    with _progress() as step:
        found = optimise(
            target, Path(out), Workers(sweeps.at_once(jobs), cluster), count=sample or 0, keep=not no_cache,
            built=not no_build, sliced=not no_gcode, tip=tip, progress=step,
        )  # fmt: skip
    render.deliver(found)
    return render.verdict(*(() if found.front else ("no design meets the target",)))


@contextmanager
def _progress() -> Iterator[Callable[[str, int, int], None]]:
    """A line with the step, how far it is, and the time left; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda *_: None
        return
    begun: dict[str, tuple[float, int]] = {}

    def step(name: str, done: int, count: int) -> None:
        now = time.monotonic()
        if done <= 1:  # of each round anew
            begun[name] = now, done
        start, first = begun.get(name, (now, done))
        left = (now - start) / (done - first) * (count - done) if done > first else 0.0
        words = f"{name} {done} of {count}" + (f", {si(left, 's', 2)} left" if left else "")
        click.echo(f"\r{words:50.50}", nl=False, err=True)

    try:
        yield step
    finally:
        click.echo("\r" + " " * 50 + "\r", nl=False, err=True)


command = click.Command(
    "optimise", callback=_optimise, help=_optimise.__doc__,
    params=[
        click.Argument(["target"], metavar="{SHAPE|DESIGN.yaml|TARGET.yaml}"),
        click.Option(["--out"], default="out", show_default=True, metavar="DIR", help="Folder of all files."),
        click.Option(
            ["--sample"], type=click.IntRange(1, 20_000), default=None, metavar="N",
            help="Try N designs that NSGA-II chooses, of a space too large to try all; nothing is then proven.",
        ),
        options.of_design_tip(), *sweeps.workers(), options.no_cache(),
        click.Option(["--no-build"], is_flag=True, help="Do not build the recommended designs."),
        click.Option(["--no-gcode"], is_flag=True, help="Do not slice them."),
        *render.options(csv="Print every design as CSV, all digits."),
    ],
)  # fmt: skip
