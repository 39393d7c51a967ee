"""A number known to lie between two others, or near one."""

from dataclasses import dataclass


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
        """Whether a value lies in it."""
        return abs(value - self.centre) <= self.radius
