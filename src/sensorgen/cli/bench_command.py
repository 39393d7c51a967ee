"""``sensorgen bench``: what a rig is to do, and what it did."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import bench_array, bench_hysteresis, bench_live, bench_run, bench_sets, bench_show, render
from sensorgen.cli.bench_opened import bench as command
from sensorgen.cli.designs import of_design
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.design.design import Design

__all__ = ["bench_array", "bench_hysteresis", "bench_live", "bench_run", "bench_sets", "bench_show", "command"]
Presses = Annotated[int, Option(kind=click.IntRange(1))]
Repeats = Annotated[int, Option(kind=click.IntRange(0))]
Forces = Annotated[tuple[float, ...], Option(typed="0,6N", zero=True)]


@of_design(
    "plan", *render.options("json", "markdown", file=False), group=command,
    short_help="Write random presses, seeded, inside the sensor.",
    about="Write random presses for a rig: seeded, so that the same seed is the same plan, forces and positions "
    "independent of each other, the tip whole on the sensor. CSV, a row per press, from the begin of the run.",
)  # fmt: skip
def _plan(
    design: "Design", *, presses: Presses = 100, repeats: Repeats = 0, force_n: Forces,
    tip_mm: Annotated[float, Option(typed="10mm")], dwell_s: float = 4.0, rest_s: float = 6.0, seed: int = 0,
    output: Path | None = None, picture: Annotated[Path | None, Option(kind="png")] = None,
) -> None:  # fmt: skip
    """Write a plan of random presses.

    Parameters
    ----------
    presses
        How many points are pressed.
    repeats
        How often each point comes back.
    force_n : LOW,HIGH
        Least and largest force.
    tip_mm : MM
        Length of the tip, which stays on the sensor whole.
    dwell_s : S
        How long each press lasts.
    rest_s : S
        How long each rest lasts.
    seed
        Of the random numbers: the same, the same plan.
    output, --output, -o : FILE
        CSV file to write; the terminal if not given.
    picture : FILE.png
        Draw the plan.
    """
    from sensorgen.core import files
    from sensorgen.measure.signal.schedule import RunPlan, schedule

    if len(force_n) != 2:
        raise BadInput(f"--force: {len(force_n)} values; expected the least and the largest, as in 0,6N")
    if seed < 0:
        raise OutOfRange(f"--seed {seed}; expected a whole number from 0 on")
    length = design.params.length_mm
    if tip_mm > length:
        raise OutOfRange(f"--tip {tip_mm:g} mm is longer than the sensor, {length:g} mm; expected a shorter one")
    where = (tip_mm / 2, length - tip_mm / 2)
    plan = schedule(RunPlan(seed, presses, (force_n[0], force_n[1]), where, dwell_s, rest_s, repeats), design.name)
    if picture:
        from sensorgen.analysis.plots import recordings

        files.replace(picture, recordings.schedule(list(plan.steps), plan.seconds))
    table = "".join(render.pieces(plan, "csv"))
    if output:
        files.replace(output, table.encode())
    if render.form():
        render.deliver(plan)
    else:
        render.say(f"{output}: {list(plan.document())[-1]}" if output else table, nl=bool(output))
