"""A number known to lie between two others, or near one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, floor, isinf, log10, prod
from typing import Literal

from sensorgen.core.units import prefix


@dataclass(frozen=True)
class Interval:
    """Lower and upper bound of one quantity, in its own unit; equal where it is exact."""

    lower: float
    upper: float

    def width(self) -> float:
        """Relative width: how far the bounds are apart, as a share of their mean [-]."""
        return (self.upper - self.lower) / (0.5 * (self.upper + self.lower))

    def middle(self) -> float:
        """Geometric mean of the bounds: the same factor away from both."""
        return float((self.lower * self.upper) ** 0.5)

    def times(self, factor: float) -> "Interval":
        """Both bounds scaled by a positive factor."""
        return Interval(self.lower * factor, self.upper * factor)


@dataclass(frozen=True)
class Disc:
    """A complex quantity known to lie within ``radius`` of ``centre``, both in its own unit."""

    centre: complex
    radius: float

    def width(self) -> float:
        """Relative width: the diameter, as a share of the centre's modulus [-]."""
        return 2 * self.radius / abs(self.centre)

    def times(self, factor: float) -> "Disc":
        """The disc scaled by a positive factor."""
        return Disc(self.centre * factor, self.radius * factor)

    def holds(self, value: complex) -> bool:
        """Test whether a value lies in it."""
        return abs(value - self.centre) <= self.radius


@dataclass(frozen=True)
class Bounds:
    """A predicted quantity with the range it lies in, and what that range holds.

    Attributes
    ----------
    value, lower, upper : float
        Best value, and the range with all of the errors below, each at its worst [unit].
    unit : str
        Unit of all values, as "F"; "" for a ratio.
    model : Interval
        With the error of the models alone [unit].
    print : Interval
        With what slicers, walls and bead widths differ by alone [unit].
    material : Interval
        With what the sources of material values differ by alone [unit].
    certified : bool
        Whether the model's interval is a proven bound; else an estimate.
    open : str
        "lower" or "upper" where a value beyond that end is possible, by how much is unknown; "" if none is.
    leads : Interval or None
        With what leads, contacts and the fringe at the edge may add alone [unit]; None where they add nothing.
    """

    value: float
    lower: float
    upper: float
    unit: str
    model: Interval
    print: Interval
    material: Interval
    certified: bool = False
    open: Literal["", "lower", "upper"] = ""
    leads: Interval | None = None

    @classmethod
    def of(
        cls,
        value: float,
        unit: str,
        *,
        model: Interval | None = None,
        print: Interval | None = None,  # noqa: A002 - the field's own word
        material: Interval | None = None,
        certified: bool = False,
        open: Literal["", "lower", "upper"] = "",  # noqa: A002 - the field's own word
        leads: Interval | None = None,
    ) -> "Bounds":
        """A positive quantity whose relative errors multiply; what is not given adds none."""
        exact = Interval(value, value)
        parts = (model or exact, print or exact, material or exact, leads or exact)
        lower = value * prod(min(part.lower / value, 1.0) for part in parts) if value else 0.0
        upper = value * prod(max(part.upper / value, 1.0) for part in parts) if value else 0.0
        return cls(value, lower, upper, unit, *parts[:3], certified, open, leads)

    def plus(self, value: float, least: float, most: float) -> "Bounds":
        """The quantity with leads in series or in parallel that add a value between two others [unit]."""

        def with_leads(part: Interval) -> Interval:
            return Interval(part.lower + value, part.upper + value)

        return Bounds(
            self.value + value, self.lower + least, self.upper + most, self.unit, with_leads(self.model),
            with_leads(self.print), with_leads(self.material), self.certified, self.open,
            Interval(self.value + least, self.value + most),
        )  # fmt: skip

    def alone(self) -> "Bounds":
        """The quantity without what leads may add or take, as with four wires."""
        if self.leads is None:
            return self
        lower, upper = self.lower - (self.leads.lower - self.value), self.upper - (self.leads.upper - self.value)
        return replace(self, lower=lower, upper=upper, leads=None)

    def times(self, factor: float, unit: str) -> "Bounds":
        """The quantity scaled by a positive factor, in another unit."""
        parts = (self.model.times(factor), self.print.times(factor), self.material.times(factor))
        ends = (factor * self.value, factor * self.lower, factor * self.upper)
        return Bounds(*ends, unit, *parts, self.certified, self.open, self.leads and self.leads.times(factor))

    def words(self) -> str:
        """Best value, and the range in the same unit; lengths in mm.

        The ends are rounded outwards. A quantity without an upper bound has two digits and no range.

        >>> Bounds.of(6.15e-11, "F", print=Interval(3.6e-11, 9.5e-11)).words(), Bounds.of(2e-4, "m").words()
        ('61.5 pF (36 to 95)', '0.2 mm')
        """
        name, size = {"m": ("m", 1e-3), "1/kPa": ("", 1.0)}.get(self.unit) or prefix(self.value)
        low, value, high = (end / size for end in (self.lower, self.value, self.upper))
        if isinf(high):
            return f"{float(f'{value:.2g}'):g} {name}{self.unit} (error unknown)"
        if f"{low:.2g}" == f"{high:.2g}":
            return f"{value:.4g} {name}{self.unit}"
        least = "<" * (self.open == "lower") + _outwards(low, floor)
        most = ">" * (self.open == "upper") + _outwards(high, ceil)
        return f"{value:.3g} {name}{self.unit} ({least} to {most})"


def _outwards(value: float, whole: Callable[[float], int]) -> str:
    """Two digits of a positive number, rounded down or up.

    >>> _outwards(1.97, floor), _outwards(80.1, ceil), _outwards(12000.0, ceil)
    ('1.9', '81', '12000')
    """
    if not value > 0:
        return f"{value:g}"
    step = 10.0 ** (floor(log10(value)) - 1)
    return f"{float(f'{whole(round(value / step, 6)) * step:.3g}'):g}"
