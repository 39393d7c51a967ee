"""Results of a fit: values with their uncertainty, what the data do not determine, and errors before and after."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from math import exp
from typing import Annotated

from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.version import __version__
from sensorgen.design.materials import own

LEVEL = 0.95  # of the intervals


@dataclass(frozen=True)
class Fitted:
    """A value.

    Attributes
    ----------
    material, quantity : str
        As material files call them.
    value, low, high : float
        In the unit of the quantity's name; the interval holds scatter and what the model leaves open.
    note : str
        What it rests on.
    """

    material: Annotated[str, Column("material")]
    quantity: Annotated[str, Column("quantity")]
    value: Annotated[float, Column("value")]
    low: Annotated[float, Column("low")]
    high: Annotated[float, Column("high")]
    note: Annotated[str, Column("note", hidden=True)]


@dataclass(frozen=True)
class Untold:
    """A parameter that the data do not determine, and why."""

    parameter: str
    why: str


@dataclass(frozen=True)
class Error:
    """Root mean square of ln(measured / predicted) on specimens that the fit did not see.

    Attributes
    ----------
    observable : str
        What was predicted.
    count : int
        Readings.
    before, after : float
        With the values of the sources, and with the fitted ones [-].
    """

    observable: str
    count: int
    before: float
    after: float


@dataclass(frozen=True)
class GroupError:
    """Electrodes of a shape and direction, predicted by the resistivity of all others."""

    group: Annotated[str, Column("group left out")]
    readings: Annotated[int, Column("readings")]
    inside: Annotated[int, Column("within", "", "readings that a resistivity within the range explains")]
    ratio: Annotated[float, Column("ratio", "", "median resistivity of the group over that of the others")]
    value: Annotated[float, Column("resistivity of the others", "ohm m")]
    low: Annotated[float, Column("from", "ohm m")]
    high: Annotated[float, Column("to", "ohm m")]


@dataclass(frozen=True)
class Fit:
    """A fit.

    Attributes
    ----------
    iteration : int or None
        Of the design; None of specimens that were named.
    names : tuple of str
        Those specimens.
    seed : int
        How the specimens were split.
    values : tuple of Fitted
        From all specimens but those held back.
    untold : tuple of Untold
        What stays open.
    errors : tuple of Error
        On those held back.
    specimens : int
        Fitted to.
    held_back : tuple of str
        Names.
    left_out : tuple of (str, str)
        What could not be used, and why.
    log : str
        SHA-256 of what was fitted to: names, readings and raw files.
    file : str or None
        Where the source is kept; None if it is not.
    groups : tuple of GroupError
        Each shape and direction, predicted by the others.
    """

    iteration: int | None
    names: tuple[str, ...]
    seed: int
    values: tuple[Fitted, ...]
    untold: tuple[Untold, ...]
    errors: tuple[Error, ...]
    specimens: int
    held_back: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]
    log: str
    file: str | None = None
    groups: tuple[GroupError, ...] = ()

    @property
    def source(self) -> str:
        """Name of the source that it makes."""
        if self.iteration is not None:
            return f"fit-{self.iteration}"
        first = re.sub(r"[^a-z0-9.]+", "-", self.names[0].lower()).strip("-.")
        which = sha256("\0".join(sorted(self.names)).encode()).hexdigest()[:6]
        return "-".join(filter(None, ("fit", first, which)))

    @property
    def of(self) -> str:
        """Name of the fitted quantity, in words."""
        return f"iteration {self.iteration}" if self.iteration is not None else ", ".join(self.names)

    def document(self) -> Iterator[Part]:
        """Values, what stays open, errors, and where the source is."""
        yield f"{self.of}: fitted to {self.specimens}, {len(self.held_back)} held back"
        if self.values:
            yield Table.of("values", "", self.values)
            yield Facts(tuple((f"{v.quantity}:", v.note) for v in self.values))
        yield from (f"not determined: {untold.parameter}: {untold.why}" for untold in self.untold)
        for error in self.errors:
            before, after = (f"a factor of {exp(e):.3g}" for e in (error.before, error.after))
            yield f"{error.observable} of {error.count} held back: off by {before} before, {after} after (rms)"
        yield from self._groups()
        if self.left_out:
            of = f"--iteration {self.iteration}" if self.iteration is not None else " ".join(map(repr, self.names))
            yield f"left out: {len(self.left_out)}; sensorgen report {of} says why"
        if self.file:
            yield f"in {self.file}"

    def _groups(self) -> Iterator[Table]:
        if self.groups:
            inside, total = sum(g.inside for g in self.groups), sum(g.readings for g in self.groups)
            yield Table.of("groups", f"Leaving out a group: {inside} of {total} readings within the range", self.groups)


def text(fit: Fit) -> str:
    """The file of the source.

    Parameters
    ----------
    fit : Fit
        As :func:`sensorgen.analysis.fit.fit` makes it.
    """
    about = (
        f"fit of {fit.of}: {fit.specimens} specimens, {len(fit.held_back)} held back (seed "
        f"{fit.seed}); sensorgen {__version__}; data {fit.log[:16]}"
    )
    materials: dict[str, list[own.SourceValue]] = {}
    for one in fit.values:
        value = own.SourceValue(one.quantity, one.value, one.low, one.high, one.note)
        materials.setdefault(one.material, []).append(value)
    open_ = (f"not determined: {' '.join(f'{untold.parameter}: {untold.why}'.split())}" for untold in fit.untold)
    return own.written(about, materials, open_)
