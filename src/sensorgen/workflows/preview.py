"""The page of a design: findings, print, prediction and decision put together."""

from pathlib import Path

from sensorgen.analysis import preview
from sensorgen.asprinted.printed import Printed, body
from sensorgen.checks.review import STEPS as CHECKS
from sensorgen.checks.review import Review, Step, review
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Prediction
from sensorgen.workflows.decision import Decision, decision

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
    held = review(design, step)
    decided = decision(design, held, 0.0, folder=folder, step=step)
    predicted = evaluate(bodies.default_body(design, folder))
    step("page")
    return page(body(design), held, predicted, decided)


def page(printed: Printed, held: Review, predicted: Prediction, decided: Decision) -> str:
    """The page of what is known of a design."""
    advice = decided.advice.document() if decided.advice else ()
    return preview.page(printed, held, predicted, decided.verdict, decided.numbers(), advice)
