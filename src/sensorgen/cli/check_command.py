"""``sensorgen check``: whether it will print."""

from typing import TYPE_CHECKING, Any

from sensorgen.cli import render
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Advising, Strict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sensorgen.design.design import Design


def _tiles(design: "Design", _: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, one of each kind; else the design."""
    if not design.layout:
        return (design,)
    from sensorgen.workflows.tiles import tiles

    kinds = {(t.rows, t.columns, str(each.parameters["seams"])): each for t, each in reversed(tiles(design))}
    return sorted(kinds.values(), key=lambda each: each.parameters["tile"]) or (design,)


@of_design("check", *render.options(), tip=True, parts=_tiles)
def command(design: "Design", advising: Advising, *, strict: Strict = False) -> int:
    """Decide whether to print a design: check it against nozzle, layers and bed, predict it, and try changes."""
    from sensorgen.checks.review import STEPS
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows import decision

    with render.progress((*STEPS, *decision.STEPS)) as step:
        review = reviewed(design, step)
        decided = decision.decision(design, review, advising.budget, predict=advising.budget > 0, step=step)
    render.deliver(decided)
    if decided.findings and render.early():
        render.say("each finding in its place, in 3D, drawing and layers: sensorgen show")
    advising.write(design, decided.advice)
    return 1 if review.errors(strict) or review.verdict == "CHANGE" else 0
