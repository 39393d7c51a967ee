"""Designs that are equal within what the models leave open, and the rule by which one of them is recommended."""

from collections.abc import Sequence
from functools import partial

from sensorgen.workflows.optimise.front import Front, value_of
from sensorgen.workflows.optimise.target import Target
from sensorgen.workflows.search import Candidate

RULE = "fewest warnings, then most layers between the electrodes, then best value"


def tied(one: Candidate, other: Candidate, keys: Sequence[str]) -> bool:
    """Test whether the best value of each lies within what the models leave open of the other, in every objective."""
    for key in keys:
        first, second = value_of(key, one), value_of(key, other)
        if first is None or second is None:
            return False
        alike = first.model.lower <= second.value <= first.model.upper
        if not (alike and second.model.lower <= first.value <= second.model.upper):
            return False
    return True


def settled(found: Front, best: Candidate, key: str = "") -> tuple[Candidate, tuple[Candidate, ...]]:
    """The design to print among those of the front that equal the best within what the models leave open.

    Parameters
    ----------
    found : Searched
        The search.
    best : Candidate
        With the best value of an objective, or the best compromise.
    key : str
        The objective: of designs that are equal in it those count that are best in the other objectives, one by one;
        "" for the compromise, from which the others must not differ in any objective.

    Returns
    -------
    tuple
        The design that :data:`RULE` chooses, and the others.
    """
    target = found.target
    keys = [key, *(k for k in target.objectives if k != key)] if key else list(target.objectives)
    group = [row for row in found.front if row is best or tied(best, row, keys[:1] if key else keys)]
    for each in keys[1:] if key else ():
        ahead = min(group, key=partial(worth, target, each))
        group = [row for row in group if row is ahead or tied(ahead, row, [each])]
    chosen = min(group, key=lambda row: (*_rule(row), worth(target, keys[0], row), row.number))
    return chosen, tuple(row for row in group if row is not chosen)


def worth(target: Target, key: str, row: Candidate) -> float:
    """An objective's best value of an evaluated design, the lower the better."""
    value = value_of(key, row)
    return target.worth(key, value.value) if value else float("inf")


def _rule(row: Candidate) -> tuple[int, int]:
    """Warnings, and layers between the electrodes as printed, negative [-]."""
    gap = value_of("gap_mm", row)
    return row.counts()[1], -round(gap.value / row.design.layers.layer_mm) if gap else 0
