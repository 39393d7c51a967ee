"""All numbered items of the thesis, computed anew and judged."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sensorgen.core import lazy as registry
from sensorgen.core.errors import MissingValue, SensorgenError
from sensorgen.verification.thesis import checks
from sensorgen.verification.thesis.items import CHAPTERS, Kind, ThesisItem, chapter
from sensorgen.verification.thesis.verdicts import LOST, NOT_COVERED, UNEXPLAINED, ItemPart, ItemVerdict, judged


@dataclass(frozen=True)
class ReproducedItem:
    """An item with what came of it."""

    chapter: str
    kind: Kind
    item: ThesisItem
    parts: tuple[ItemPart, ...]
    verdict: ItemVerdict

    def name(self) -> str:
        """As one would cite it: ``Table 3.1``."""
        return f"{'Eq.' if self.kind == 'equation' else self.kind.capitalize()} {self.item.number}"


def rows(started: Callable[[str], None] = lambda _: None) -> list[ReproducedItem]:
    """Every item of every chapter, in order.

    Parameters
    ----------
    started : callable
        Called with each chapter's name before it is computed.
    """
    reproduced = []
    for name in CHAPTERS:
        started(name)
        reproduced += [row(name, kind, item) for kind, item in chapter(name).items()]
    return reproduced


def row(of_chapter: str, kind: Kind, item: ThesisItem) -> ReproducedItem:
    """One item, computed.

    Notes
    -----
    A value or a solver that is missing here leaves it uncovered; any other refusal of a model is unexplained.
    """
    try:
        parts = tuple(_computed(item.check, item.given)) if item.check else ()
    except MissingValue as error:
        return ReproducedItem(of_chapter, kind, item, (), ItemVerdict(NOT_COVERED, f"({error})"))
    except SensorgenError as error:
        return ReproducedItem(of_chapter, kind, item, (), ItemVerdict(UNEXPLAINED, f"({error})"))
    if item.lost:
        verdict = ItemVerdict(LOST, f"({item.lost})")
    elif item.uncovered:
        verdict = ItemVerdict(NOT_COVERED, f"({item.uncovered})")
    else:
        verdict = judged(item, parts)
    return ReproducedItem(of_chapter, kind, item, parts, verdict)


def _computed(check: str, given: Mapping[str, Any]) -> Iterable[ItemPart]:
    name, _, check = check.partition(".")
    parts: Iterable[ItemPart] = getattr(registry.load(checks, name), check)(**given)
    return parts
