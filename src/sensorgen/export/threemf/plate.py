"""Several sensors on one plate: each body where it stands, so that all families of slicers take them as one object."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.export.threemf.part import Part


def placed(parts: Sequence[Part], centre_mm: tuple[float, float], name: str = "") -> list[Part]:
    """Bodies of one sensor with the middle of their box over a place of the plate, the lowest point at 0.

    Parameters
    ----------
    parts : sequence of Part
        The bodies, in the coordinates of the sensor [mm].
    centre_mm : (float, float)
        Where the middle goes [mm].
    name : str
        Stands before the names of the bodies, which must differ on the plate.

    Raises
    ------
    BadInput
        No bodies.
    """
    if not parts:
        raise BadInput("no bodies to place: a sensor has at least one")
    low, high = box_mm(parts)
    shift_mm = np.array([*centre_mm, 0.0]) - [*((low + high)[:2] / 2), low[2]]
    lead = f"{name} " if name else ""
    return [
        replace(part, name=f"{lead}{part.name}", mesh=replace(part.mesh, vertices_mm=part.mesh.vertices_mm + shift_mm))
        for part in parts
    ]


def box_mm(parts: Iterable[Part]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner of the box around bodies, two (3,) arrays [mm]."""
    ends = [(p.mesh.vertices_mm.min(axis=0), p.mesh.vertices_mm.max(axis=0)) for p in parts]
    return np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)
