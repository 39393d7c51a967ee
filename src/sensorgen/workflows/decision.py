"""Decision to print a design: verdict, the numbers that decide, each finding once, and changes that were tried."""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar

from sensorgen.checks.review import CheckReport, Review, report, review
from sensorgen.core import cache as answers
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Finding, Refused, Verdict, grouped, headline, listed, verdict
from sensorgen.design.design import Design
from sensorgen.prediction.identifiability.results import GUESS
from sensorgen.prediction.results import UNPREDICTED
from sensorgen.prediction.slices import PrintReview
from sensorgen.workflows.moves import changed
from sensorgen.workflows.trial import Trial, table, trial, words_of

if TYPE_CHECKING:
    from pydantic import TypeAdapter

    from sensorgen.asprinted.printed import Printed
    from sensorgen.prediction.results import Prediction

_VERSION = 6  # of the search for changes: stored advice of another one is not read
SAME = 0.02  # relative difference of resolutions that is none [-]
STEPS = ("prediction", "changes", "done")
Step = Callable[[str], None]


@dataclass(frozen=True)
class Change:
    """One value that changes.

    Attributes
    ----------
    key : str
        In the design file, as ``parameters.period_mm``.
    before, after : float or str
        In the unit that the key ends in.
    """

    key: str
    before: float | str | None
    after: float | str

    def words(self) -> str:
        """Key, before and after."""
        name = self.key.rpartition(".")[2]
        before, after = (f"{v:g}" if isinstance(v, float) else v or "none" for v in (self.before, self.after))
        return f"{name} {before} -> {after}"


@dataclass(frozen=True)
class TriedChange:
    """A change of the design that was checked and predicted.

    Attributes
    ----------
    changes : tuple of Change
        What differs from the design.
    distance : float
        How far: sum of abs(ln(after / before)), with a constant for each choice [-].
    trial : Trial
        The changed design.
    about : str
        What it is, of a design that is known to be good; "" for a change that removes findings.
    better : bool
        Something that the sensor is for is better, and nothing is worse.
    effects : str
        How resolutions and sensitivity change.
    """

    changes: tuple[Change, ...]
    distance: float
    trial: Trial
    about: str = ""
    better: bool = False
    effects: str = ""

    def counts(self) -> tuple[int, int]:
        """Errors and warnings that are left, each sentence once."""
        return finding_counts(self.trial.findings)

    def words(self) -> str:
        """Changes, findings and numbers in one line."""
        errors, warnings = self.counts()
        numbers = words_of(self.trial)
        changes = ", ".join(change.words() for change in self.changes)
        left = f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"
        parts = "; ".join(filter(None, (left, numbers, self.effects)))
        return ": ".join(filter(None, (self.about, changes, parts)))


@dataclass(frozen=True)
class Advice:
    """Attempts to remove the findings of a design.

    Attributes
    ----------
    tried : tuple of TriedChange
        Those that improve the sensor first, then the nearest.
    now : str
        Numbers of the design itself, in words.
    checked, predicted : int
        How many designs were checked, and how many of them predicted too.
    seconds, budget_s : float
        Processor time that it took, and what it may take [s].
    complete : bool
        Whether all changes up to the distance ``farthest`` were checked.
    farthest : float
        Up to which distance changes were tried [-].
    not_tried : str
        What was left out.
    known : tuple of str
        Good designs of the shape that the budget left no time to predict.
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

    tried: tuple[TriedChange, ...]
    now: str
    checked: int
    predicted: int
    seconds: float
    budget_s: float
    complete: bool
    farthest: float
    not_tried: str
    known: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """The changes, those that improve the sensor first, then the nearest, and what was tried."""
        effort = f"{self.checked} designs checked, {self.predicted} predicted"
        if self.tried:
            rows = ((f"{k}.", one.words()) for k, one in enumerate(self.tried, 1))
            yield f"changes that were tried, those that improve the sensor first (now {self.now}):"
            yield Facts(tuple(rows))
        elif not self.checked and not self.complete:
            yield "no change was tried: the design's own prediction took the budget; a second run reads it from disk"
        else:
            yield "no change was found that removes findings and keeps what the sensor senses"
        yield from (f"not predicted for lack of time (--budget): {one}" for one in self.known)
        spent = self.seconds >= round(self.budget_s, 2)  # which is how it is rounded
        ended = f"; ended by the budget of {self.budget_s:g} s (--budget)" if spent else "; that many are tried at most"
        limit = "" if self.complete else ended
        yield f"({effort}{limit}; not tried: {self.not_tried})"


@dataclass(frozen=True)
class Decision(CheckReport):
    """The findings about a print, and what follows from them.

    Attributes
    ----------
    trial : Trial or None
        Numbers of the drawing and the print; None for checks alone, or where nothing is predicted.
    reason : str
        Why nothing is predicted, or "".
    advice : Advice or None
        Changes that were tried; None where none was looked for.
    turned_by : str
        Fault of the print that alone turns the verdict into CHANGE, and its finding; "" where none of those tried does.
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}

    trial: Trial | None = None
    reason: str = ""
    advice: Advice | None = None
    turned_by: str = ""

    def document(self) -> Iterator[Part]:
        """Verdict, numbers, findings and changes."""
        yield headline(self.name, self.findings, self.source)
        if self.trial or self.reason:
            yield from ("", *self.numbers())
        if self.findings:
            yield ""
            yield from listed(self.findings)
        if self.advice:
            yield ""
            yield from self.advice.document()

    def page(self, printed: "Printed", held: Review, predicted: "Prediction") -> str:
        """All that is known of the design as one page, HTML."""
        from sensorgen.analysis import preview

        advice = self.advice.document() if self.advice else ()
        return preview.page(printed, held, predicted, self.numbers(), advice)

    def numbers(self) -> Iterator[Part]:
        """The numbers that decide; why there are none."""
        if self.turned_by:
            yield f"it would be CHANGE with {self.turned_by}"
        if self.trial:
            yield from table(self.trial)
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
    held: PrintReview,
    budget_s: float | None,
    *,
    predict: bool = True,
    step: Step = lambda _: None,
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
    """
    made, advice, start_s = None, None, time.process_time()
    reason = "" if predict else "checks alone (--budget 0)"
    if predict and held.meshes:
        step("prediction")
        try:
            made = trial(design, held=held)
        except SensorgenError as error:
            reason = str(error)
    if made:
        reason = made.reason if made.status == "not predicted" else ""
        if budget_s is not None:
            step("changes")
            advice = advised(design, made, budget_s, step, time.process_time() - start_s)
    return Decision(
        **vars(report(design, held)), trial=made, reason=reason, advice=advice,
        turned_by=_turned_by(design, held.verdict),
    )  # fmt: skip


def _turned_by(design: Design, said: Verdict) -> str:
    """A film one layer thinner than drawn, where the checks then have an error, and that error; else ""."""
    film_mm = getattr(design.params, "dielectric_mm", 0.0)
    thinner = round(film_mm - design.layers.layer_mm, 9)
    if not film_mm or said == "CHANGE":
        return ""
    fault = "a film one layer thinner"
    if thinner <= 0:
        return f"{fault}: none is left"
    try:
        found = review(changed(design, {("parameters", "dielectric_mm"): thinner})).findings
    except SensorgenError as error:
        return f"{fault}: {error}"
    return next((f"{fault}: {f.message}" for f in found if f.severity == "error" and not f.waiver), "")


def advised(
    design: Design, made: Trial, budget_s: float, step: Step = lambda _: None, spent_s: float = 0.0
) -> Advice | None:
    """Changes of a design with findings, tried now or before; None where nothing is to be changed, or nothing known.

    What its own prediction has ``spent_s`` counts as spent.
    """
    if verdict([f for f in made.findings if f.rule != UNPREDICTED]) == "PRINT":
        return None
    digest = sha256(_adapter(Trial).dump_json(made)).hexdigest()
    question = {"advice": _VERSION, "design": design.id(), "trial": digest}
    stored = answers.known(question)
    known: Advice | None = _adapter(Advice).validate_json(json.dumps(stored)) if stored else None
    if known and (known.complete or known.budget_s >= budget_s):
        return known
    if budget_s <= 0:
        return None
    from sensorgen.workflows.advice import advise

    advice = advise(design, made, budget_s, step, spent_s)
    if not advice.checked:
        return advice
    answers.keep(question, json.loads(_adapter(Advice).dump_json(advice)))
    return advice


@cache
def _adapter(kind: type) -> "TypeAdapter[Any]":
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def effects(now: Trial, then: Trial) -> tuple[bool, str]:
    """Effects of a change on what the sensor is for: only good ones, and resolutions and sensitivity in words."""
    words, factors = [], list[float]()
    ends = zip(now.printed.bench(), then.printed.bench(), (now.force_n, 2 * now.position_m), strict=True)
    for name, (old, new, whole) in zip(("force resolution", "position resolution"), ends, strict=True):
        known = [bool(one and one.value < GUESS * whole) for one in (old, new)]
        if all(known) and old and new:
            factors.append(old.value / new.value)
        elif any(known):
            factors.append(inf if known[1] else 0.0)
        else:
            continue
        words.append(f"{name} {_factor(factors[-1])}")
    if (old := now.printed.sensitivity) and (new := then.printed.sensitivity):
        factors.append(new.value / old.value)
        words.append(f"sensitivity {_factor(factors[-1])}")
    better = max(factors, default=1.0) > 1 + SAME and min(factors, default=1.0) >= 1 - SAME
    return better, ", ".join(word for word in words if not word.endswith("as now"))


def _factor(gain: float) -> str:
    """A gain in words."""
    if 1 - SAME <= gain <= 1 + SAME:
        return "as now"
    if gain in (0.0, inf):
        return "gained" if gain else "lost"
    return f"{gain:.2g} x better" if gain > 1 else f"{1 / gain:.2g} x worse"


def finding_counts(findings: Sequence[Finding]) -> tuple[int, int]:
    """Errors and warnings, each sentence once [-]."""
    heads = [f.severity for f in grouped(findings)]
    return heads.count("error"), heads.count("warning")
