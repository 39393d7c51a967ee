"""The repeating cell of a scene of boxes as a raster: planes square to the axes, and what fills each box between."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.scene import Body, Scene
from sensorgen.scene.sections import ROUNDING_MM
from sensorgen.scene.unit_cell import Band, Slice, affordable


@dataclass(frozen=True)
class Raster:
    """Boxes between planes.

    Attributes
    ----------
    planes_mm : three arrays
        Where the planes lie on x, y and z [mm].
    fill : (i, j, k) array
        Number of what is in each box.
    shares : (i, j) array
        How often each place of the cell, or a mirror image, occurs in the scene [-].
    """

    planes_mm: tuple[Real, Real, Real]
    fill: Whole
    shares: Real


def raster(
    scene: Scene, number: Callable[[Body], int], air: int, outer_mm: Sequence[Sequence[float]], evenly: bool = True
) -> Raster:
    """The cell of a scene of boxes, between mirrors at its four sides.

    Parameters
    ----------
    scene : Scene
        Of boxes.
    number : callable
        From a body to what ``fill`` says of it, 0 or more; the same for bodies that are alike.
    air : int
        What it says of air.
    outer_mm : three sequences of float
        Planes on x, y and z beside those of the boxes [mm].
    evenly : bool
        Whether a piece that occurs a whole number of times is preferred, where it is affordable.

    Raises
    ------
    ValueError
        A piece is no box, or bodies overlap.
    """
    pieces = [(body, p) for body in scene.bodies for p in body.pieces]
    if not all(p.is_box() for _, p in pieces):
        raise ValueError("not all of it is boxes")
    planes: list[Real] = []
    for axis, outer in zip("xyz", outer_mm, strict=True):
        edges = np.unique(np.array([*outer, *(x for _, p in pieces for x in p.span(axis))]))
        planes.append(edges[np.diff(edges, prepend=-np.inf) > ROUNDING_MM])
    fill = np.full([len(p) - 1 for p in planes], -1)
    for body, piece in pieces:
        ends = [np.searchsorted(p, np.array(piece.span(a)) - ROUNDING_MM) for a, p in zip("xyz", planes, strict=True)]
        here = tuple(slice(*end) for end in ends)
        if (fill[here] >= 0).any():
            raise ValueError(f"{body.name} overlaps its neighbour")
        fill[here] = number(body)
    fill[fill < 0] = air
    shares = []
    for k in (0, 1):
        # What a walk along the axis meets: one level band, named by all that stands on this place.
        looks: dict[bytes, str] = {}
        names = [looks.setdefault(layer.tobytes(), str(len(looks))) for layer in np.moveaxis(fill, k, 0)]
        bands = [(Band(name, "", (0.0, 0.0), (1.0, 1.0)),) for name in names]
        walk = [Slice(a, b, band) for (a, b), band in zip(pairwise(planes[k].tolist()), bands, strict=True)]
        cell = affordable(tuple(walk), evenly)
        middles = [(s.left_mm + s.right_mm) / 2 for s in cell.slices]
        fill = fill.take(np.searchsorted(planes[k], middles) - 1, k)
        planes[k] = np.array([cell.slices[0].left_mm, *(s.right_mm for s in cell.slices)])
        shares.append(np.array(cell.shares))
    x, y, z = planes
    return Raster((x, y, z), fill, np.outer(shares[0], shares[1]))
