"""A body: what there is of a sensor, as drawn or as printed, in one type."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from typing import Any, Literal

from sensorgen.design.design import Design, make
from sensorgen.scene.scene import Scene

DRAWN: Literal["drawn"] = "drawn"


@dataclass(frozen=True)
class FilmThickness:
    """Thickness of the film between the electrodes of a print.

    Attributes
    ----------
    error_mm : float
        By which it may be thinner or thicker [mm].
    thinner, thicker : Scene or None
        The most likely cell with such a film; None where none is left.
    layer_thinner : Scene or None
        The same, one layer of the film missing.
    """

    error_mm: float
    thinner: Scene | None
    thicker: Scene
    layer_thinner: Scene | None = None


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
    remarks : mapping of str to tuple of str
        Where electrodes touch, and which conductors float, by the same rules.
    film : FilmThickness or None
        Of a print; None of a drawing, and where no film lies between the electrodes.
    count_error : float
        Of ``count``, relative, where a border cuts cells [-].
    beside : tuple of (Scene, float)
        Of a drawing, cells with the rim that whole cells leave at the sensor's ends, and how many of each [-].
    """

    scenes: Mapping[str, Scene]
    count: float
    period_mm: float | None
    gaps: Callable[[], Mapping[str, float]]
    tracks: Any = None
    remarks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    film: FilmThickness | None = None
    count_error: float = 0.0
    beside: tuple[tuple[Scene, float], ...] = ()

    @cached_property
    def gap_mm(self) -> Mapping[str, float]:
        """Smallest distance of two electrodes, by the same rules; infinite where there are no two [mm]."""
        return self.gaps()

    def first(self) -> Scene:
        """The cell by the most likely rule."""
        return next(iter(self.scenes.values()))


@dataclass(frozen=True, eq=False)
class Body:
    """Body of a design: drawn, or as printed.

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

    def with_values(self, material_values: Mapping[str, Mapping[str, float]]) -> "Body":
        """Geometry of materials with other values, by material and quantity."""
        data = self.design.model_dump(exclude_defaults=True, mode="json")
        known = data.get("material_values", {})
        changed = {name: known.get(name, {}) | dict(values) for name, values in material_values.items()}
        design = make(data | {"material_values": known | changed})
        identity = sha256(f"{self.identity} {design.id()}".encode()).hexdigest()
        return replace(self, design=design, identity=identity, make=lambda: self.cells)

    def printed_otherwise(self, rule: str) -> "Body":
        """The body by one of the rules of its cells alone."""
        cells = self.cells
        one = replace(cells, scenes={rule: cells.scenes[rule]}, gaps=lambda: {rule: cells.gap_mm[rule]}, film=None)
        return replace(self, identity=sha256(f"{self.identity} {rule}".encode()).hexdigest(), make=lambda: one)

    @property
    def is_drawn(self) -> bool:
        """True if it is the drawing."""
        return self.kind == DRAWN


BodyOf = Callable[[Design], Body]  # how a command makes the body of a design
