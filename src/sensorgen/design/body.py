"""A body: what there is of a sensor, as drawn or as printed, in one type."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from sensorgen.design.design import Design
from sensorgen.scene.scene import Scene

DRAWN: Literal["drawn"] = "drawn"


@dataclass(frozen=True)
class Cells:
    """Unit cells of a body.

    Attributes
    ----------
    scenes : mapping of str to Scene
        The cell with its support removed and the bottom electrode down; by the rule that says how wide lines are
        printed, the most likely first. One cell of a drawing.
    count : float
        Cells in the sensor, as its capacitance counts them [-].
    period_mm : float or None
        Period of the pattern along the sensor, of which the scene holds one or more [mm]; None without a pattern.
    gaps : callable
        Finds ``gap_mm``, when it is first needed.
    tracks : object or None
        Extruded lines, where a tool path is known.
    """

    scenes: Mapping[str, Scene]
    count: float
    period_mm: float | None
    gaps: Callable[[], Mapping[str, float]]
    tracks: Any = None

    @cached_property
    def gap_mm(self) -> Mapping[str, float]:
        """Smallest distance of two electrodes, by the same rules; infinite where there are no two [mm]."""
        return self.gaps()

    def first(self) -> Scene:
        """The cell by the most likely rule."""
        return next(iter(self.scenes.values()))


@dataclass(frozen=True, eq=False)
class Body:
    """What there is of a design.

    Attributes
    ----------
    design : Design
        That was asked for.
    kind : str
        "drawn", "estimated" (printed by rules of slicers) or "sliced" (printed by a tool path).
    provenance : str
        The same in words, as "printed, PrusaSlicer 2.5.0".
    identity : str
        Of all that decides the content: equal for equal bodies.
    make : callable
        Makes the cells, when they are first needed.
    """

    design: Design
    kind: Literal["drawn", "estimated", "sliced"]
    provenance: str
    identity: str
    make: Callable[[], Cells]

    @cached_property
    def cells(self) -> Cells:
        """Unit cells; raises what making them raises."""
        return self.make()

    @property
    def is_drawn(self) -> bool:
        """Whether it is the drawing."""
        return self.kind == DRAWN
