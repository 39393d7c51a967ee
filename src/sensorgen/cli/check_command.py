"""``sensorgen check``: whether it will print."""

from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import options, render, settings, show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    options.of_design_tip(),
    *settings.advice_options(),
    *render.options(),
]


def _work(design: "Design", *, strict: bool, budget: float, apply_change: int | None) -> int:
    from sensorgen.checks.review import STEPS
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows import decision

    with show.progress((*STEPS, *decision.STEPS)) as step:
        held = reviewed(design, step)
        decided = decision.decision(design, held, budget, predict=budget > 0, step=step)
    render.deliver(decided)
    if decided.findings and render.early():
        render.say("each finding in its place, in 3D, drawing and layers: sensorgen show", err=True)
    settings.applied(design, decided.advice, apply_change)
    return 1 if held.errors(strict) or held.verdict == "CHANGE" else 0


def _tiles(design: "Design", _: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, one of each kind; else the design."""
    if not design.layout:
        return (design,)
    from sensorgen.workflows.tiles import tiles

    kinds = {(t.rows, t.columns, str(each.parameters["seams"])): each for t, each in reversed(tiles(design))}
    return sorted(kinds.values(), key=lambda each: each.parameters["tile"]) or (design,)


command = DesignGroup(
    _work, OWN, _tiles, name="check",
    help="Decide whether to print a design: check it against nozzle, layers and bed, predict it, and try changes.",
)  # fmt: skip
