"""Another program for prints: its own reader of G-code, voxels of the deposit's volume, and finite volumes on them.

It shares no code with the package. Lines are painted by layer and tool on a square raster: the pixels nearest to them,
as many as the deposit needs. The potential is solved at the middles of the voxels between two conductors.
"""

import re
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, pi

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import cg

EPS0 = 8.8541878128e-12  # F/m
FILAMENT_MM2 = pi / 4 * 1.75**2
NOT_THE_PART = ("skirt", "brim", "tower", "pillar", "support", "custom")
WORD = re.compile(r"([A-Z])\s*(-?\d*\.?\d+)")


@dataclass
class Print:
    """Lines of the part: start and end in plan, top, tool, volume [mm, mm3]."""

    start: np.ndarray
    end: np.ndarray
    top: np.ndarray
    tool: np.ndarray
    volume: np.ndarray

    def layers(self):
        """Faces of the layers, also of those that nothing is printed in."""
        tops = np.unique(self.top.round(3))
        thin = np.diff(tops).min()
        count = np.round(np.diff(tops) / thin).astype(int)
        more = [z + thin * np.arange(n) for z, n in zip(tops[:-1], count, strict=True)]
        return [0.0, *np.concatenate([*more, tops[-1:]]).round(3).tolist()]

    def middle(self):
        both = np.concatenate([self.start, self.end])
        return (both.min(0) + both.max(0)) / 2


def read(text):
    """Lines that the part takes, by the comments of PrusaSlicer and Cura."""
    at, extruded, relative, tool, kind, rows = [0.0, 0.0, 0.0], 0.0, False, 0, "", []
    for line in text.splitlines():
        if line.startswith(";TYPE:"):
            kind = line[6:].lower()
        words = WORD.findall(line.partition(";")[0])
        if not words:
            continue
        (letter, number), rest = words[0], {k: float(v) for k, v in words[1:]}
        code = letter + number
        if letter == "T":
            tool = int(number)
        elif code in ("M82", "M83"):
            relative = code == "M83"
        elif code == "G92" and "E" in rest:
            extruded = rest["E"]
        elif code in ("G0", "G1"):
            before, at = at, [rest.get(axis, was) for axis, was in zip("XYZ", at, strict=True)]
            more = rest.get("E", 0.0) if relative else rest.get("E", extruded) - extruded
            extruded += more
            moved = hypot(at[0] - before[0], at[1] - before[1])
            if more > 0 and moved > 0 and not any(word in kind for word in NOT_THE_PART):
                rows.append((*before[:2], *at[:2], at[2], tool, more * FILAMENT_MM2))
    table = np.array(rows)
    return Print(table[:, :2], table[:, 2:4], table[:, 4], table[:, 5].astype(int), table[:, 6])


def painted(print_, low, size, count, full=0.85):
    """Tool of every pixel, (layers, count, count), -1 for air, and the layers' faces; slits of plates are no holes."""
    heights = print_.layers()
    pixel = size / count
    x = low[0] + (np.arange(count) + 0.5) * pixel
    y = low[1] + (np.arange(count) + 0.5) * pixel
    tools = np.full((len(heights) - 1, count, count), -1)
    for k, (bottom, top) in enumerate(pairwise(heights)):
        for tool in np.unique(print_.tool):
            rows = (abs(print_.top - top) < 1e-3) & (print_.tool == tool)
            if not rows.any():
                continue
            start, end = print_.start[rows], print_.end[rows]
            area = print_.volume[rows] / (top - bottom)
            wide = area / np.hypot(*(end - start).T)
            with np.errstate(divide="ignore"):
                at = np.sort([(np.add(low, side) - start) / (end - start) for side in (0.0, size)], axis=0)
            inside = (at[1].min(1).clip(max=1.0) - at[0].max(1).clip(min=0.0)).clip(min=0.0)  # share of a line's length
            deposit = (inside * area).sum()
            nearest = np.full((count, count), np.inf)
            for a, b, w in zip(start, end, wide, strict=True):
                reach = w + 0.3
                i = slice(*np.searchsorted(x, (min(a[0], b[0]) - reach, max(a[0], b[0]) + reach)))
                j = slice(*np.searchsorted(y, (min(a[1], b[1]) - reach, max(a[1], b[1]) + reach)))
                px, py = x[i, None] - a[0], y[None, j] - a[1]
                way = b - a
                share = ((px * way[0] + py * way[1]) / (way @ way)).clip(0, 1)
                away = np.hypot(px - share * way[0], py - share * way[1]) - w / 2
                nearest[i, j] = np.minimum(nearest[i, j], away)
            filled = round(deposit / pixel**2)
            if filled > full * count**2:
                mine = np.ones((count, count), bool)
            else:
                level = np.sort(nearest.ravel())[filled - 1] if filled else -np.inf
                mine = nearest <= level
            tools[k][mine & (tools[k] < 0)] = tool
    return tools, heights


def capacitance(tools, heights, size, thin, eps, conductor):
    """Capacitance of the window between its lowest conductor and all others [F].

    Parameters
    ----------
    tools : (layers, n, n) array
        By :func:`painted`.
    heights : list
        Of the layers' faces [mm].
    size : float
        Side of the window [mm].
    thin : int
        Voxels in the height of a layer.
    eps : dict
        Relative permittivity by tool; -1 is air.
    conductor : int
        Tool of the electrodes.
    """
    open_ = np.flatnonzero((tools != conductor).any((1, 2)))
    kept = slice(open_[0] - 1, open_[-1] + 2)  # layers that are not metal all over, and one plate on either side
    solid = np.repeat(tools[kept], thin, axis=0)
    height = np.repeat(np.diff(heights)[kept] / thin, thin)
    metal = solid == conductor
    label, _ = ndimage.label(metal)
    bottom = label == label[0][metal[0]][0]
    potential = np.where(metal & ~bottom, 1.0, 0.0)
    value = np.vectorize(lambda tool: eps.get(tool, 0.0))(solid)
    side = size / tools.shape[1]
    index, faces = np.arange(metal.size).reshape(metal.shape), []
    deep, e, m = np.broadcast_to(height[:, None, None], metal.shape), value.ravel(), metal.ravel()
    for axis in range(3):
        a, b = (np.take(index, np.arange(start, metal.shape[axis] - 1 + start), axis).ravel() for start in (0, 1))
        half = (deep if axis == 0 else np.full(metal.shape, side)).ravel() / 2
        area = side**2 if axis == 0 else side * deep.ravel()[a]
        with np.errstate(divide="ignore"):
            against = np.where(m[a], 0.0, half[a] / e[a]) + np.where(m[b], 0.0, half[b] / e[b])
            faces.append((a, b, np.where(m[a] & m[b], 0.0, area / against)))
    a, b, g = map(np.concatenate, zip(*faces, strict=True))
    off = sparse.coo_array((g, (a, b)), shape=(metal.size,) * 2).tocsr()
    off = off + off.T
    matrix = (sparse.diags_array(off.sum(1)) - off).tocsr()
    u, inner = potential.ravel().copy(), matrix[~m][:, ~m]
    u[~m], info = cg(inner, -(matrix @ u)[~m], rtol=1e-7, M=sparse.diags_array(1 / inner.diagonal()))
    assert info == 0
    return EPS0 * float(u @ (matrix @ u)) * 1e-3
