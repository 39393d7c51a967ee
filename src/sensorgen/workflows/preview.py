"""The page of a design: findings, print, prediction and decision put together."""

from pathlib import Path

from sensorgen.asprinted.printed import body
from sensorgen.checks.review import STEPS as CHECKS
from sensorgen.checks.review import Step
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.workflows.decision import decision
from sensorgen.workflows.reviewed import reviewed

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
    held = reviewed(design, step)
    decided = decision(design, held, 0.0, folder=folder, step=step)
    predicted = evaluate(bodies.default_body(design, folder))
    step("page")
    return decided.page(body(design), held, predicted)
