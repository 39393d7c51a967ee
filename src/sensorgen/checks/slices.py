"""The scene as a slicer sees it: cut once per layer, at mid-height."""

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import shapely

from sensorgen.design.printer import Quality
from sensorgen.scene.layers import Region, drawn, narrow_mm, region_at
from sensorgen.scene.scene import Body, Scene

TOUCH_MM = 1e-9  # below this a distance is rounding


@dataclass(frozen=True)
class Layers:
    """Boundaries of the printed layers, from the bed up [mm]."""

    boundaries_mm: tuple[float, ...]

    def __len__(self) -> int:
        """Number of layers [-]."""
        return len(self.boundaries_mm) - 1

    @cached_property
    def mids_mm(self) -> tuple[float, ...]:
        """Heights at which a slicer samples [mm]."""
        return tuple(round((a + b) / 2, 12) for a, b in pairwise(self.boundaries_mm))

    def printed_mm(self, z_mm: float) -> float:
        """Height at which a face drawn at ``z_mm`` comes out: the boundary after the last sample up to it [mm]."""
        return self.boundaries_mm[min(bisect_left(self.mids_mm, z_mm + TOUCH_MM), len(self))]

    def off_grid_mm(self, z_mm: float) -> float:
        """Distance of a height from the nearest boundary [mm]."""
        return min(abs(z_mm - b) for b in self.boundaries_mm)


class Slices:
    """Every body in every layer: cut once, asked by all rules. Layers are counted from 0."""

    def __init__(self, scene: Scene, quality: Quality) -> None:
        """Cut ``scene``, as it lies on the bed, into the layers of ``quality``."""
        self.scene = scene
        self.layers = Layers(tuple(quality.boundaries_mm(scene.size_mm[2])))
        self._drawn = drawn(scene, self.layers.boundaries_mm)
        self._wider: dict[tuple[int, float], Region] = {}

    def body(self, body: Body, layer: int) -> Region:
        """Region of a body in a layer."""
        return self._drawn[layer].region(body.name)

    def near(self, body: Body, layer: int, above_mm: float) -> Region:
        """Region of a body a little above a layer's mid-height, or below it [mm]."""
        return region_at(body, self.layers.mids_mm[layer] + above_mm)

    def printed(self, body: Body, layer: int, least_mm: float) -> Region:
        """Part of a body wider than ``least_mm`` in a layer: one object for equal layers, which share a region."""
        region = self.body(body, layer)
        key = id(region), least_mm
        if key not in self._wider:
            pieces = shapely.get_parts(region)
            self._wider[key] = shapely.multipolygons(pieces[narrow_mm(pieces) > least_mm + TOUCH_MM])
        return self._wider[key]

    def printed_layers(self, body: Body, least_mm: float) -> list[int]:
        """Layers in which some part of a body is wider than ``least_mm``."""
        return [k for k in range(len(self.layers)) if not self.printed(body, k, least_mm).is_empty]
