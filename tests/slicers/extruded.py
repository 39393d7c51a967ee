"""How much each tool of a file extrudes, and for what."""

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from sensorgen.export.gcode.motion import NOT_MODEL, follow
from sensorgen.export.gcode.moves import NO_TOOL, Motion
from sensorgen.export.gcode.reading import Source


@dataclass(frozen=True)
class Extruded:
    """What a file prints: tools in the order of their selection, and volumes [mm3] by tool and line type."""

    tools: tuple[int, ...]
    volume_mm3: dict[tuple[int, str], float]

    def model_mm3(self) -> dict[int, float]:
        """Volume that each tool extrudes for the bodies alone [mm3]."""
        sums: defaultdict[int, float] = defaultdict(float)
        for (tool, kind), volume in sorted(self.volume_mm3.items()):
            if kind not in NOT_MODEL:
                sums[tool] += volume
        return dict(sums)


def read(source: Source, filament_mm: float) -> Extruded:
    """Follow tools and extruder through a file.

    Filament drawn back is owed by its tool: pushing it forward again counts for nothing, and only what
    goes beyond is extruded. So retractions, also those over a tool change, cancel.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The G-code, with the slicer's tool numbers (from 0) and its ``;TYPE:`` comments.
    filament_mm : float
        Diameter of the filament [mm].

    Returns
    -------
    Extruded
        Tools in order of selection, a repeated one once; volumes [mm3].

    Examples
    --------
    >>> found = read(["M83", "T1", "G1 X9 E2", "G1 E-1", "T0", "T1", "G1 E1", "G1 X0 E0.5"], filament_mm=2.0)
    >>> found.tools, round(found.model_mm3()[1] / math.pi, 6)
    ((1, 0, 1), 2.5)
    """
    motion = follow(source)
    area_mm2 = math.pi / 4 * filament_mm**2
    return Extruded(_selected(motion), {key: length * area_mm2 for key, length in lengths_mm(motion).items()})


def lengths_mm(motion: Motion) -> dict[tuple[int, str], float]:
    """Filament that each tool extrudes for each kind of line [mm]; without a tool it is tool 0."""
    rows = np.flatnonzero(motion.extruded_mm > 0)
    count = len(motion.rows)
    tools = motion.tools.column(count, NO_TOOL)[rows].astype(np.int64)
    kinds = motion.kind.column(count, 0)[rows].astype(np.int64)
    keys, places = np.unique(np.column_stack([np.maximum(tools, 0), kinds]), axis=0, return_inverse=True)
    sums = np.bincount(places.ravel(), motion.extruded_mm[rows], minlength=len(keys))
    return {(int(t), motion.kinds[int(k)]): float(s) for (t, k), s in zip(keys, sums, strict=True)}


def _selected(motion: Motion) -> tuple[int, ...]:
    tools: list[int] = []
    for change in motion.changes:
        if change.tool != NO_TOOL and tools[-1:] != [change.tool]:
            tools.append(change.tool)
    return tuple(tools)
