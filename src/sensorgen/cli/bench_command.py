"""``sensorgen bench``: what a rig is to do, and what it did."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import bench_hysteresis, bench_live, bench_sets, bench_show, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Values, one
from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.signal.schedule import Plan

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
    click.Option(["--picture"], metavar="FILE.png", help="Draw the plan."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
]  # fmt: skip


@click.group("bench", short_help="Plan a run of loads, and evaluate its recording.")
def command() -> None:
    """Plans for the rig that presses sensors, and its recordings."""


def _work(
    design: "Design", *, presses: int, repeats: int, force_n: Sequence[float], tip_mm: Sequence[float], dwell_s: float,
    rest_s: float, seed: int, output: str | None, picture: str | None, as_json: bool,
) -> int:  # fmt: skip
    plan = _plan(design, presses, repeats, force_n, one("--tip", tip_mm), dwell_s, rest_s, seed)
    if picture:
        _draw(plan, picture)
    if output:
        from sensorgen.core import files as store

        store.replace(Path(output), plan.csv().encode())
    if as_json:
        steps = [asdict(step) for step in plan.steps()]
        show.as_json(asdict(plan) | {"seconds": plan.seconds(), "steps": steps, "design": design.name})
    elif output:
        click.echo(f"{output}: {presses * (1 + repeats)} presses, {_lasting(plan.seconds())}")
    else:
        click.echo(plan.csv(), nl=False)
    return 0


def _plan(
    design: "Design", presses: int, repeats: int, force_n: Sequence[float], tip_mm: float, dwell_s: float,
    rest_s: float, seed: int,
) -> "Plan":  # fmt: skip
    from sensorgen.measure.signal.schedule import Plan

    if len(force_n) != 2:
        raise BadInput(f"--force: {len(force_n)} values; expected the least and the largest, as in 0,6N")
    if seed < 0:
        raise OutOfRange(f"--seed {seed}; expected a whole number from 0 on")
    length = design.params.length_mm
    if tip_mm > length:
        raise OutOfRange(f"--tip {tip_mm:g} mm is longer than the sensor, {length:g} mm; expected a shorter one")
    where = (tip_mm / 2, length - tip_mm / 2)
    return Plan(seed, presses, (force_n[0], force_n[1]), where, dwell_s, rest_s, repeats)


def _draw(plan: "Plan", picture: str) -> None:
    from sensorgen.analysis.plots import recordings
    from sensorgen.core import files as store

    if not picture.lower().endswith(".png"):
        raise BadInput(f"--picture {picture}: expected a file that ends in .png")
    store.replace(Path(picture), recordings.schedule(plan.steps(), plan.seconds()))


def _lasting(seconds: float) -> str:
    """A duration in words.

    >>> _lasting(95), _lasting(7384)
    ('1 min 35 s', '2 h 3 min')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


command.add_command(
    DesignGroup(
        _work, PLAN, name="plan",
        help="Write random presses for a rig: seeded, so that the same seed is the same plan, forces and positions "
        "independent of each other, the tip whole on the sensor. CSV, a row per press, from the begin of the run.",
        short_help="Write random presses, seeded, inside the sensor.",
    )
)  # fmt: skip
for _each in (bench_show, bench_hysteresis, bench_sets, bench_live):
    command.add_command(_each.command)
