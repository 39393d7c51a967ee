"""``sensorgen check``: whether it will print."""

from typing import TYPE_CHECKING

from sensorgen.cli import render, show
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Advising, Strict

if TYPE_CHECKING:
    from sensorgen.design.design import Design


@of_design("check", *render.options(), tip=True)
def command(design: "Design", advising: Advising, *, strict: Strict = False) -> int:
    """Decide whether to print a design: check it against nozzle, layers and bed, predict it, and try changes."""
    from sensorgen.checks.review import STEPS
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows import decision

    with show.progress((*STEPS, *decision.STEPS)) as step:
        review = reviewed(design, step)
        decided = decision.decision(design, review, advising.budget, predict=advising.budget > 0, step=step)
    render.deliver(decided)
    advising.write(design, decided.advice)
    return 1 if review.errors(strict) or review.verdict == "CHANGE" else 0
