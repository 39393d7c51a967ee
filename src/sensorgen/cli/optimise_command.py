"""``sensorgen optimise``: the best printable designs for a target."""

from pathlib import Path
from typing import Annotated

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import Cluster, DesignTip, Jobs, NoCache, Out
from sensorgen.core.options import Option

Sample = Annotated[int | None, Option(kind=click.IntRange(1, 20_000))]  # fmt: skip


@of_function("optimise", *render.options(csv="Print every design as CSV, all digits.", folder=True))
def command(
    target: str, *, out: Out = Path("out"), sample: Sample = None, tip: DesignTip = None, jobs: Jobs = None,
    cluster: Cluster = "", no_cache: NoCache = False, no_build: bool = False, no_gcode: bool = False,
) -> int:  # fmt: skip
    """Find the designs of a space that no other is better than, as printed, and write the files of up to three.

    Every combination of the target's values is checked, bounded or evaluated; each one that is out has its reason. Of a
    shape or a design, designs like it are tried for the best resolutions; docs/optimise.md has a target. A search that
    was stopped goes on where it was. Exit code 1 where no design meets the target.

    Parameters
    ----------
    target : {SHAPE|DESIGN.yaml|TARGET.yaml}
    out
        Folder of all files.
    sample : N
        Try N designs that NSGA-II chooses, of a space too large to try all; nothing is then proven.
    no_build
        Do not build the recommended designs.
    no_gcode
        Do not slice them.
    """
    from sensorgen.workflows.optimise.front import Workers
    from sensorgen.workflows.optimise.run import optimise

    with render.counted() as step:
        designs = optimise(
            target, out, Workers(render.at_once(jobs), cluster), count=sample or 0,
            keep=not no_cache, built=not no_build, sliced=not no_gcode, tip=tip, progress=step,
        )  # fmt: skip
    render.deliver(designs)
    return render.verdict(*(() if designs.front else ("no design meets the target",)))
