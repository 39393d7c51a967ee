"""The page of a design: findings, print and prediction put together."""

from sensorgen.analysis import preview
from sensorgen.asprinted.printed import body
from sensorgen.checks.review import STEPS as CHECKS
from sensorgen.checks.review import Step, review
from sensorgen.core.findings import counts
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate

STEPS = (*CHECKS, "prediction", "page", "done")


def page_of(design: Design, *, step: Step = lambda _: None) -> str:
    """The page of a design, as HTML.

    Parameters
    ----------
    design : Design
        What is shown.
    step : callable
        Called with the next step, for a progress display.

    Raises
    ------
    SensorgenError
        A name or value of the design is missing.
    """
    held = review(design, step)
    step("prediction")
    predicted = evaluate(bodies.default_body(design))
    step("page")
    number = counts(held.findings)
    verdict = "CHANGE" if number["error"] else "PRINT WITH WARNINGS" if number["warning"] else "PRINT"
    return preview.page(body(design), held, predicted, verdict, predicted.summary())
