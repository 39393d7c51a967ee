"""Decision to print a design: verdict, the numbers that decide, findings, changes that were tried; and its page."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from sensorgen.checks.review import STEPS as CHECKS
from sensorgen.checks.review import CheckReport, Review, Step, report
from sensorgen.core.display import Boundless
from sensorgen.core.document import Part, apart
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Refused, headline, listed
from sensorgen.core.parallel import used_s
from sensorgen.design.design import Design
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import ahead, evaluate, is_stored
from sensorgen.prediction.slices import PrintReview, reviewed
from sensorgen.workflows.trial import Advice, Trial, table, trial

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.prediction.results import Prediction


STEPS = ("prediction", "changes", "done")


@dataclass(frozen=True)
class Decision(Boundless, CheckReport):
    """The findings about a print, and what follows from them.

    Attributes
    ----------
    trial : Trial or None
        Numbers of the drawing and the print; None for checks alone, or where nothing is predicted.
    reason : str
        Why nothing is predicted, or "".
    advice : Advice or None
        Changes that were tried; None where none was looked for.
    """

    trial: Trial | None = None
    reason: str = ""
    advice: Advice | None = None

    def document(self) -> Iterator[Part]:
        """Verdict, numbers, findings and changes."""
        yield headline(self.name, self.findings, self.source, predicted=not self.reason)
        yield from apart(self.numbers(), listed(self.findings), self.advice.document() if self.advice else ())

    def page(self, printed: "Printed", held: Review, predicted: "Prediction") -> str:
        """All that is known of the design as one page, HTML."""
        from sensorgen.analysis import preview

        advice = self.advice.document() if self.advice else ()
        return preview.page(printed, held, predicted, self.numbers(), advice)

    def numbers(self) -> Iterator[Part]:
        """The numbers that decide; why there are none."""
        if self.trial:
            yield from table(self.trial)
        elif self.reason:
            yield f"not predicted: {self.reason}"


@dataclass(frozen=True)
class RefusedBuild(Boundless, Refused):
    """A design that is not built because of findings, with changes that were tried."""

    advice: Advice | None = None

    def document(self) -> Iterator[Part]:
        """Verdict, the findings that matter most, and changes."""
        yield from super().document()
        yield from apart(self.advice.document() if self.advice else ())


@contextmanager
def beside(design: Design, *, predict: bool = True) -> Iterator[Callable[[], object]]:
    """Another process that predicts beside slicing and checks: a drawing, or an array's crossing (a call waits)."""
    of = partial(bodies.default_body, design.crossing) if design.layout else partial(bodies.drawn, design)
    with ahead(of, wanted=predict) as ready:
        yield ready if design.layout else _nothing


def _nothing() -> None:
    """Wait for nothing: :func:`evaluate` waits for the drawing when it needs it."""


def is_known(design: Design) -> bool:
    """Test whether the prediction of a design's print is stored."""
    return is_stored(partial(bodies.default_body, design))


def decision(
    design: Design,
    held: PrintReview,
    budget_s: float | None,
    *,
    predict: bool = True,
    step: Step = lambda _: None,
    decided: Callable[["Decision"], None] = lambda _: None,
) -> Decision:
    """Decide on a print by its findings: prediction, and changes that remove them.

    Parameters
    ----------
    design : Design
        What was checked.
    held : PrintReview
        All findings.
    budget_s : float
        Processor time for the prediction and for trying changes; at 0, advice that is stored is given [s]. None: none.
    predict : bool
        Also predict drawing and print, without which no change is tried.
    step : callable
        Called with the next step, for a progress display.
    decided : callable
        Called with verdict and numbers before any change is tried.
    """
    tried, start_s = None, used_s()
    reason = "" if predict else "checks alone (--budget 0)"
    if predict and held.fits:
        step("prediction")
        try:
            tried = trial(design, held=held)
        except SensorgenError as error:
            reason = str(error)
    if tried:
        reason = tried.reason if tried.status == "not predicted" else ""
    result = Decision(**vars(report(design, held)), trial=tried, reason=reason)
    decided(result)
    if not tried or budget_s is None:
        return result
    from sensorgen.workflows.advice import advised

    step("changes")
    return replace(result, advice=advised(design, tried, budget_s, step, used_s() - start_s))


PAGE_STEPS = (*CHECKS, "prediction", "page", "done")


def page_of(design: Design, *, step: Step = lambda _: None) -> str:
    """The page of a design, as HTML, with advice where it is stored.

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
    printing = reviewed(design, step)
    decided = decision(design, printing, 0.0, step=step)
    predicted = evaluate(bodies.of_file(design, printing.file))
    step("page")
    return decided.page(printing.printed(design), printing, predicted)
