"""Whether to print a design: verdict, the numbers that decide, each finding once, and changes that were tried."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from sensorgen.checks.review import CheckReport, Review
from sensorgen.core import cache as answers
from sensorgen.core.document import Part
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Refused, Verdict, counted, counts, grouped, listed, verdict
from sensorgen.design.design import Design
from sensorgen.workflows import decisive
from sensorgen.workflows.advice import Advice, advise
from sensorgen.workflows.trial import Trial, trial

if TYPE_CHECKING:
    from pydantic import TypeAdapter

_VERSION = 1  # of the search for changes: stored advice of another one is not read
STEPS = ("prediction", "changes", "done")
Step = Callable[[str], None]


@dataclass(frozen=True)
class Decision(CheckReport):
    """The findings about a design, and what follows from them.

    Attributes
    ----------
    verdict : str
        CHANGE where a finding is an error, PRINT WITH WARNINGS, or PRINT.
    trial : Trial or None
        Numbers of the drawing and the print; None for checks alone, or where nothing is predicted.
    reason : str
        Why nothing is predicted, or "".
    advice : Advice or None
        Changes that were tried; None where none was looked for.
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

    verdict: Verdict = "PRINT"
    trial: Trial | None = None
    reason: str = ""
    advice: Advice | None = None

    def document(self) -> Iterator[Part]:
        """Verdict, numbers, findings and changes."""
        yield f"{self.verdict}  {self.name}: {counted(counts(grouped(self.findings)))}"
        yield from ("", *self.numbers())
        if self.findings:
            yield ""
            yield from listed(grouped(self.findings))
        if self.advice:
            yield ""
            yield from self.advice.document()

    def numbers(self) -> Iterator[Part]:
        """The numbers that decide; why there are none."""
        if self.trial:
            yield from decisive.table(self.trial)
        elif self.reason:
            yield f"not predicted: {self.reason}"


@dataclass(frozen=True)
class RefusedBuild(Refused):
    """A design that is not built because of findings, with changes that were tried."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

    advice: Advice | None = None

    def document(self) -> Iterator[Part]:
        """Verdict, the findings that matter most, and changes."""
        yield from super().document()
        if self.advice:
            yield ""
            yield from self.advice.document()


def decision(
    design: Design,
    held: Review,
    budget_s: float,
    *,
    predict: bool = True,
    folder: Path | None = None,
    step: Step = lambda _: None,
) -> Decision:
    """What follows from the findings about a design.

    Parameters
    ----------
    design : Design
        What was checked.
    held : Review
        Its findings.
    budget_s : float
        Processor time for trying changes; at 0, advice that is stored is given [s].
    predict : bool
        Also predict drawing and print, without which no change is tried.
    folder : Path, optional
        With the design's files, as of :func:`sensorgen.workflows.trial.trial`.
    step : callable
        Called with the next step, for a progress display.
    """
    findings, made, reason, advice = tuple(held.findings), None, "", None
    if predict and held.meshes:
        step("prediction")
        try:
            made = trial(design, folder=folder)
        except SensorgenError as error:
            reason = str(error)
    if made:
        findings = (*(f for f in made.findings if f.rule == "1-short" and f not in findings), *findings)
        step("changes")
        advice = advised(design, made, budget_s, step)
    return Decision(
        design.name, design.id(), design.machine.name, design.layers.name, counts(findings), findings,
        verdict(findings), made, reason, advice,
    )  # fmt: skip


def advised(design: Design, made: Trial, budget_s: float, step: Step = lambda _: None) -> Advice | None:
    """Changes of a design with findings, tried now or before; None where nothing is to be changed, or nothing known."""
    if made.verdict == "PRINT":
        return None
    digest = sha256(json.dumps(_adapter(Trial).dump_python(made, mode="json"), sort_keys=True).encode()).hexdigest()
    question = {"advice": _VERSION, "design": design.id(), "trial": digest}
    stored = answers.known(question)
    known: Advice | None = _adapter(Advice).validate_json(json.dumps(stored)) if stored else None
    if known and (known.complete or known.budget_s >= budget_s):
        return known
    if budget_s <= 0:
        return None
    advice = advise(design, made, budget_s, step)
    answers.keep(question, _adapter(Advice).dump_python(advice, mode="json"))
    return advice


@cache
def _adapter(kind: type) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter

    return TypeAdapter(kind)
