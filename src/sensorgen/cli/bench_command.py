"""``sensorgen bench``: what a rig is to do, and what it did."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import bench_hysteresis, bench_live, bench_run, bench_sets, bench_show, render
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Png, Values, one
from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design.design import Design

PLAN: list[click.Parameter] = [
    click.Option(
        ["--presses"], type=click.IntRange(1), default=100, show_default=True, help="How many points are pressed."
    ),
    click.Option(
        ["--repeats"], type=click.IntRange(0), default=0, show_default=True, help="How often each point comes back."
    ),
    click.Option(
        ["--force", "force_n"], type=Values(units.FORCE_N, zero=True), default="0,6N", show_default=True,
        metavar="LOW,HIGH", help="Least and largest force.",
    ),
    click.Option(
        ["--tip", "tip_mm"], type=Values(units.LENGTH_MM, zero=False), default="10mm", show_default=True, metavar="MM",
        help="Length of the tip, which stays on the sensor whole.",
    ),
    click.Option(
        ["--dwell", "dwell_s"], type=float, default=4.0, show_default=True, metavar="S",
        help="How long each press lasts.",
    ),
    click.Option(
        ["--rest", "rest_s"], type=float, default=6.0, show_default=True, metavar="S", help="How long each rest lasts."
    ),
    click.Option(
        ["--seed"], type=int, default=0, show_default=True, help="Of the random numbers: the same, the same plan."
    ),
    click.Option(["--output", "-o"], metavar="FILE", help="CSV file to write; the terminal if not given."),
    click.Option(["--picture"], type=Png(), metavar="FILE.png", help="Draw the plan."),
    *render.options("json", "markdown", file=False),
]  # fmt: skip


@click.group("bench")
def command() -> None:
    """Plans and runs of the rig that presses sensors, and its recordings."""


def _work(
    design: "Design", *, presses: int, repeats: int, force_n: Sequence[float], tip_mm: Sequence[float], dwell_s: float,
    rest_s: float, seed: int, output: str | None, picture: str | None,
) -> int:  # fmt: skip
    from sensorgen.core import files as store
    from sensorgen.measure.signal.schedule import Plan, schedule

    if len(force_n) != 2:
        raise BadInput(f"--force: {len(force_n)} values; expected the least and the largest, as in 0,6N")
    if seed < 0:
        raise OutOfRange(f"--seed {seed}; expected a whole number from 0 on")
    length, tip = design.params.length_mm, one("--tip", tip_mm)
    if tip > length:
        raise OutOfRange(f"--tip {tip:g} mm is longer than the sensor, {length:g} mm; expected a shorter one")
    where = (tip / 2, length - tip / 2)
    made = schedule(Plan(seed, presses, (force_n[0], force_n[1]), where, dwell_s, rest_s, repeats), design.name)
    if picture:
        from sensorgen.analysis.plots import recordings

        store.replace(Path(picture), recordings.schedule(list(made.steps), made.seconds))
    table = "".join(render.pieces(made, "csv"))
    if output:
        store.replace(Path(output), table.encode())
    if render.form():
        render.deliver(made)
    else:
        render.say(f"{output}: {list(made.document())[-1]}" if output else table, nl=bool(output))
    return 0


command.add_command(
    DesignGroup(
        _work, PLAN, name="plan",
        help="Write random presses for a rig: seeded, so that the same seed is the same plan, forces and positions "
        "independent of each other, the tip whole on the sensor. CSV, a row per press, from the begin of the run.",
        short_help="Write random presses, seeded, inside the sensor.",
    )
)  # fmt: skip
for _each in (bench_run, bench_show, bench_hysteresis, bench_sets, bench_live):
    command.add_command(_each.command)
