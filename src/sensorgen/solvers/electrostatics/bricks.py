"""A scene of boxes as a grid of bricks: its repeating cell, and layers that shrink towards every edge."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.scene.repetition import raster
from sensorgen.scene.scene import Body, Scene
from sensorgen.solvers.electrostatics.mesh import exponent

RATIO = 0.15  # of a layer's distance from an edge to the next layer's
_INFINITE = 1 - 1e-6  # exponents of the potential below this: the field is infinite


@dataclass(frozen=True)
class Grid:
    """Boxes between planes square to the axes.

    Attributes
    ----------
    planes_mm : three arrays
        Where the planes lie on x, y and z [mm].
    fill : (i, j, k) array
        What is in each box: an index into ``names``.
    names : list of str
        Materials; "@bottom" and "@top" first.
    shares : (i, j) array
        How often each place of the cell, or a mirror image, occurs in the sensor [-].
    """

    planes_mm: tuple[Real, ...]
    fill: Whole
    names: list[str]
    shares: Real


def grid(scene: Scene) -> Grid:
    """The repeating cell of a scene of boxes, between its mirrors.

    Raises
    ------
    ValueError
        A prism is no box, bodies overlap, the electrodes touch, or one does not cover the sensor.
    """
    cut = _cell(scene)
    # Refuse electrodes that share a face, an edge or a corner
    corners = []
    for terminal in (0, 1):
        full = np.pad(cut.fill == terminal, 1)
        for axis in range(3):
            full = full | np.roll(full, 1, axis)
        corners.append(full)
    if (corners[0] & corners[1]).any():
        raise ValueError("the electrodes touch: the capacitance grows without bound")
    # The grid with every dielectric outside the field turned to conductor; refuses an open field
    inside = reached(cut.fill, 0) & reached(cut.fill, 1)
    if not inside.any():
        raise ValueError("no dielectric lies between a top and a bottom electrode")
    if inside[:, :, [0, -1]].any():
        raise ValueError("an electrode does not cover the whole sensor")
    used = np.unique(cut.fill[inside])
    number = np.full(len(cut.names), -1)
    number[[0, 1, *used]] = np.arange(len(used) + 2)
    fill = np.where(inside, number[cut.fill], np.where(cut.fill > 1, -1, cut.fill))
    return Grid(cut.planes_mm, fill, ["@bottom", "@top", *(cut.names[k] for k in used)], cut.shares)


def insulated(scene: Scene, axis: int) -> Grid:
    """The repeating cell of boxes in air that insulates, with planes at 0 V and 1 V square to x (0) or y (1).

    Raises
    ------
    ValueError
        A prism is no box, bodies overlap, or none reaches from one plane to the other.
    """
    cut = _cell(scene, evenly=False)
    planes, sides = list(cut.planes_mm), [(int(k == axis),) * 2 for k in range(3)]
    planes[axis] = np.pad(planes[axis], 1, mode="reflect", reflect_type="odd")
    fill = np.pad(np.where(cut.fill == cut.names.index("air"), -1, cut.fill), sides)
    np.moveaxis(fill, axis, 0)[-1] = 1
    inside = reached(fill, 0) & reached(fill, 1)
    if not inside.any():
        raise ValueError("no body reaches from one end to the other")
    x, y, z = planes
    shares = np.pad(cut.shares, sides[:2], mode="edge")
    return Grid((x, y, z), np.where(inside | (fill < 2), fill, -1), cut.names, shares)


def _cell(scene: Scene, evenly: bool = True) -> Grid:
    names = ["@bottom", "@top", *sorted({b.material for b in scene.bodies if not b.terminal} | {"air"})]

    def number(body: Body) -> int:
        return names.index(f"@{body.terminal}" if body.terminal else body.material)

    boxes = raster(scene, number, names.index("air"), [(0.0, size) for size in scene.size_mm], evenly)
    return Grid(boxes.planes_mm, boxes.fill, names, boxes.shares)


def reached(fill: Whole, terminal: int) -> Mask:
    """Dielectric boxes, 2 or more, that a walk through dielectric reaches from one electrode, 0 or 1."""
    reach = fill == terminal
    allowed = reach | (fill > 1)
    while True:
        grown = reach.copy()
        for axis in range(3):
            ahead, back = (np.moveaxis(m, axis, 0) for m in (grown, reach))
            ahead[1:] |= back[:-1]
            ahead[:-1] |= back[1:]
        grown &= allowed
        if (grown == reach).all():
            return np.asarray(reach & (fill > 1))
        reach = grown


def layered(coarse: Grid, values: Sequence[float], layers: int) -> Grid:
    """Cut a grid into layers that shrink towards planes in which the field is infinite at some edge.

    Parameters
    ----------
    coarse : Grid
        A cell.
    values : list of float
        Relative permittivity of each name; its modulus where it is complex [-].
    layers : int
        How many times the distance from a plane shrinks where it holds an edge of an electrode; half as often where
        dielectrics meet [-].
    """
    counts = [np.zeros(len(p), dtype=int) for p in coarse.planes_mm]
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        boxes = np.moveaxis(coarse.fill, axis, 2)
        around = np.stack([boxes[i : i - 1 or None, j : j - 1 or None] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])
        patterns, which = np.unique(around.reshape(4, -1), axis=1, return_inverse=True)
        wanted = np.array([_wanted(p, values, layers) for p in patterns.T.tolist()])[which].reshape(around.shape[1:])
        counts[first][1:-1] = np.maximum(counts[first][1:-1], wanted.max((1, 2), initial=0))
        counts[second][1:-1] = np.maximum(counts[second][1:-1], wanted.max((0, 2), initial=0))
    parts = [_graded(planes, count.tolist()) for planes, count in zip(coarse.planes_mm, counts, strict=True)]
    owners = [owner for _, owner in parts]
    x, y, z = (planes for planes, _ in parts)
    return Grid((x, y, z), coarse.fill[np.ix_(*owners)], coarse.names, coarse.shares[np.ix_(*owners[:2])])


def _wanted(around: list[int], values: Sequence[float], layers: int) -> int:
    """Layers that an edge asks for, by what fills the four boxes around it in turn."""
    free = [code > 1 for code in around]
    if not any(free):
        return 0
    if all(free):
        fan = tuple((np.pi / 2, values[code]) for code in around)
        return layers // 2 if exponent(fan, None) < _INFINITE else 0
    starts = [k for k in range(4) if free[k] and not free[k - 1]]
    for start in starts:
        run = [around[(start + k) % 4] for k in range(next(k for k in range(1, 4) if not free[(start + k) % 4]))]
        if exponent(tuple((np.pi / 2, values[code]) for code in run), (True, True)) < _INFINITE:
            return layers
    return 0


def _graded(planes: Real, layers: list[int]) -> tuple[Real, Whole]:
    """Planes with layers between them, and from which interval each layer comes."""
    finer, owners = [planes[0]], []
    for k, (a, b) in enumerate(pairwise(planes.tolist())):
        half = (b - a) / 2
        left = a + half * RATIO ** np.arange(layers[k], 0, -1)
        right = b - half * RATIO ** np.arange(1, layers[k + 1] + 1)
        inner = [*left.tolist(), *right.tolist(), b]
        finer += inner
        owners += [k] * len(inner)
    return np.array(finer), np.array(owners)
