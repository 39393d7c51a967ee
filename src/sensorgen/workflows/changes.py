"""Changes of a design that were tried: their findings, and their effects on what the sensor is for."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import ClassVar

from sensorgen.core import files, yamlfile
from sensorgen.core.bounds import Bounds
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding, grouped
from sensorgen.design.design import Design, load, make
from sensorgen.prediction.identifiability.results import GUESS
from sensorgen.workflows.trial import Trial, words_of

SAME = 0.02  # relative difference of resolutions that is none [-]


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


def apply(path: Path, design: Design, change: TriedChange) -> None:
    """Write a change into a design file, as a whole or not at all; comments and order stay.

    Parameters
    ----------
    path : Path
        The file.
    design : Design
        What the change was tried on.
    change : TriedChange
        What to write.

    Raises
    ------
    BadInput
        The file holds another design, as with options beside it, or cannot be changed in place.
    """
    if load(path).id() != design.id():
        raise BadInput(f"--apply: options change {path} too; expected the file alone: write them into it first")
    text = yamlfile.text(path)
    values = {tuple(one.key.split(".")): one.after for one in change.changes}
    edited = yamlfile.changed(text, values, str(path))
    if make({"name": path.stem} | yamlfile.parse(edited, str(path)), str(path)).id() != change.trial.design:
        raise BadInput(f"--apply: {path} would not become the design that was tried: edit it by hand")
    start = b"\xef\xbb\xbf" if path.read_bytes().startswith(b"\xef\xbb\xbf") else b""
    files.replace(path, start + edited.encode())


def effects(now: Trial, then: Trial) -> tuple[bool, str]:
    """Effects of a change on what the sensor is for: only good ones, and resolutions and sensitivity in words."""
    words, factors = [], list[float]()
    ends = zip(now.printed.bench(), then.printed.bench(), (now.force_n, 2 * now.position_m), strict=True)
    for name, (old, new, whole) in zip(("force resolution", "position resolution"), ends, strict=True):
        if (gain := _gain(old, new, GUESS * whole)) is not None:
            factors.append(gain)
            words.append(f"{name} {_factor(gain)}")
    if (old := now.printed.sensitivity) and (new := then.printed.sensitivity):
        factors.append(new.value / old.value)
        words.append(f"sensitivity {_factor(factors[-1])}")
    better = max(factors, default=1.0) > 1 + SAME and min(factors, default=1.0) >= 1 - SAME
    return better, ", ".join(word for word in words if not word.endswith("as now"))


def _gain(old: Bounds | None, new: Bounds | None, useless: float) -> float | None:
    """Gain of a resolution, 0 where it is lost, infinite where there was none; None without one before and after."""
    before, after = (one.value if one and one.value < useless else None for one in (old, new))
    if before is None or after is None:
        return None if before is after else inf if before is None else 0.0
    return before / after


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
