"""The scene: which material fills which outline, in millimetres, along which axis.

Plain data without a CAD kernel. Drawing, checks, meshes, solids and models all read it, so they cannot
disagree about the sensor. x runs along the sensor, y across it, z up; the corner is at 0, 0, 0.
"""

from dataclasses import dataclass, field, replace

from sensorgen.scene.outlines import SLIVER_MM, Outline, Point, area_mm2, clipped, rectangle, rounded
from sensorgen.scene.pieces import AXES, PLANE, Piece, Prism, box
from sensorgen.scene.polyhedra import Loft, Polyhedron
from sensorgen.scene.revolved import Revolved

__all__ = [
    "AXES", "FLOATING", "PLANE", "SLIVER_MM", "Body", "Envelope", "Fill", "Loft", "Outline", "Piece", "Point",
    "Polyhedron", "Prism", "Revolved", "Scene", "area_mm2", "box", "clipped", "rectangle", "rounded",
]  # fmt: skip

FLOATING = "floating"  # terminal of a conductor that no contact reaches


@dataclass(frozen=True)
class Body:
    """What one tool prints as one piece of the sensor.

    Attributes
    ----------
    name : str
        Its role, as in ``bottom_electrode``.
    material : str
        Name of its material.
    pieces : tuple of Piece
        They do not overlap. Boxes that share a face are one solid; other pieces touch at most along edges.
    terminal : str
        "top", "middle" or "bottom" where it is connected to an electrode's contact, ``FLOATING`` for a conductor that
        is connected to none, else "".
    """

    name: str
    material: str
    pieces: tuple[Piece, ...] = field(repr=False)
    terminal: str = ""

    def is_support(self) -> bool:
        """Whether it is dissolved after printing, and no part of the sensor in use."""
        return self.name == "support"

    def volume_mm3(self) -> float:
        """Exact volume [mm3]."""
        return sum(p.volume_mm3() for p in self.pieces)


@dataclass(frozen=True)
class Scene:
    """All bodies of a sensor; what no body fills is air.

    Attributes
    ----------
    bodies : tuple of Body
        From bottom to top; those that no piece fills, as in a sensor shorter than its pattern, are left out.
    size_mm : (float, float, float)
        Edges of the enclosing box, whose corner is the origin [mm].
    repeats : (bool, bool)
        Whether it is one period of a pattern that goes on by shifts along x and y; else its sides are mirrors, or ends.
    """

    bodies: tuple[Body, ...]
    size_mm: tuple[float, float, float]
    repeats: tuple[bool, bool] = (False, False)

    def __post_init__(self) -> None:
        """Leave out empty bodies."""
        object.__setattr__(self, "bodies", tuple(b for b in self.bodies if b.pieces))

    def body(self, name: str) -> Body:
        """The body of that name; raises KeyError where there is none."""
        return next(b for b in self.bodies if b.name == name)

    def turned_over(self) -> "Scene":
        """The scene turned by half a turn about x, to be printed upside down."""
        bodies = (replace(b, pieces=tuple(p.turned_over(self.size_mm) for p in b.pieces)) for b in self.bodies)
        return replace(self, bodies=tuple(bodies))

    def stretched(self, factor: float) -> "Scene":
        """The scene scaled by ``factor`` [-] in x and y."""
        length, width, height = self.size_mm
        bodies = (replace(b, pieces=tuple(p.stretched(factor) for p in b.pieces)) for b in self.bodies)
        return replace(self, bodies=tuple(bodies), size_mm=(length * factor, width * factor, height))


@dataclass(frozen=True)
class Fill:
    """Which material fills which part of a shape; "" leaves it empty."""

    bottom_electrode: str = "etpu"
    top_electrode: str = "etpu"
    film: str = "x60"
    dielectric: str = "x60"
    isolation: str = "x60"
    support: str = ""


@dataclass(frozen=True)
class Envelope:
    """Parameters that every shape has.

    The ranges in the metadata are those of sense for a printed sensor, far wider than any printer's.
    """

    length_mm: float = field(default=100.0, metadata={"help": "Length of the sensor, along x.", "range": (1.0, 1000.0)})
    width_mm: float = field(default=10.0, metadata={"help": "Width of the sensor, along y.", "range": (1.0, 1000.0)})
    electrode_mm: float = field(default=0.3, metadata={"help": "Thickness of each electrode.", "range": (0.01, 10.0)})
    isolation_mm: float = field(
        default=0.0, metadata={"help": "Isolation layer over the top electrode; 0 leaves it out.", "range": (0.0, 10.0)}
    )

    def cells(self) -> float:
        """How many cells of a repeating pattern the sensor holds; 1 without a pattern [-]."""
        return 1.0
