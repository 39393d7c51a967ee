"""Strips across a sensor that follow each other along one of its axes: what the shapes of them share."""

from dataclasses import dataclass
from math import ceil

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import SLIVER_MM, Envelope, Prism, box, choice, parameter


@dataclass(frozen=True)
class StripParams(Envelope):
    """Parameters of every such pattern."""

    period_mm: float = parameter(2.0, "Period of the pattern.", 0.1, 100.0)
    along: str = choice("x", "Axis along which the strips follow each other.", "x", "y")

    def refuse_whole(self, name: str) -> None:
        """Refuse a width that leaves nothing of the period."""
        if (width_mm := getattr(self, name)) >= self.period_mm:
            raise OutOfRange(f"{name} {width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less")

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm

    def strips(self, start_mm: float, stop_mm: float, low_mm: float, high_mm: float) -> tuple[Prism, ...]:
        """A box in each period from one place in it to another, cut at the sensor's ends, between two heights [mm]."""
        sizes = (self.length_mm, self.width_mm)
        end, depth = sizes if self.along == "x" else sizes[::-1]
        count = ceil(end / self.period_mm - 1e-9) + 1
        spans = (
            (max(k * self.period_mm + start_mm, 0.0), min(k * self.period_mm + stop_mm, end)) for k in range(count)
        )
        within = [(a, b) for a, b in spans if b - a > SLIVER_MM]
        if self.along == "x":
            return tuple(box(a, b, 0.0, depth, low_mm, high_mm) for a, b in within)
        return tuple(box(0.0, depth, a, b, low_mm, high_mm) for a, b in within)
