"""The page of a design: findings, print, prediction and decision put together."""

from pathlib import Path

from sensorgen.checks.review import STEPS as CHECKS
from sensorgen.checks.review import Step
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows.decision import decision

STEPS = (*CHECKS, "prediction", "page", "done")


def page_of(design: Design, *, folder: Path | None = None, step: Step = lambda _: None) -> str:
    """The page of a design, as HTML, with advice where it is stored.

    Parameters
    ----------
    design : Design
        What is shown.
    folder : Path, optional
        With the design's files, as of :func:`sensorgen.workflows.trial.trial`.
    step : callable
        Called with the next step, for a progress display.

    Raises
    ------
    SensorgenError
        A name or value of the design is missing.
    """
    held = reviewed(design, step, folder=folder)
    decided = decision(design, held, 0.0, step=step)
    predicted = evaluate(bodies.of_file(design, held.file))
    step("page")
    return decided.page(held.printed(design), held, predicted)
