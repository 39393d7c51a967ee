"""The raster of a section: every interface, level or sloping, is a line of edges of elements."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.virtual.cell import SectionRaster
from sensorgen.scene.scene import FLOATING, Body, Scene
from sensorgen.scene.sections import Section, SectionColumn, columns, sections

FINE_MM = 0.025
_MOST_COLUMNS = 120  # of elements; the width of a cell with a larger one is cut evenly
_GRADED = 0.7  # share of the cosine in the grading of elements
_NONE_MM = 1e-9
TERMINALS = {"bottom": 1, "top": 2, FLOATING: 3}


def section_of(scene: Scene) -> Section | None:
    """The one cross-section of a scene; None where it has none, or several."""
    try:
        found = sections(scene)
    except ValueError:
        return None
    return found[0] if len(found) == 1 else None


def raster(scene: Scene, materials: Mapping[str, int], fine_mm: float = FINE_MM) -> SectionRaster:
    """A scene's section as elements.

    Parameters
    ----------
    scene : Scene
        With one cross-section.
    materials : mapping of str to int
        Number of each material, from 1 on.
    fine_mm : float
        Largest edge of an element; in wide cells, of those along a height [mm].

    Raises
    ------
    OutOfRange
        The scene has several cross-sections, or one whose interfaces are not the same lines from side to side.
    """
    section = section_of(scene)
    if section is None:
        raise OutOfRange("a raster of a body with several cross-sections; expected one along the sensor or across it")
    across = "xy".index(section.across)
    found = columns(section)
    sides = [found[0].left_mm, *(c.right_mm for c in found)]
    widest = max(fine_mm, (sides[-1] - sides[0]) / _MOST_COLUMNS)
    lines = _interfaces(found)
    rows = [max(round(np.max([of[k + 1] - of[k] for of in lines]) / fine_mm), 1) for k in range(len(lines[0]) - 1)]
    pieces = [1] if len(found) == 1 else [max(int(np.ceil((b - a) / widest - 1e-6)), 1) for a, b in pairwise(sides)]
    shares = np.concatenate([[0.0], *(k + graded(n) for k, n in enumerate(rows))])
    x, material, electrode = [sides[0]], [], []
    z = list[Real]()
    for column, of, n in zip(found, lines, pieces, strict=True):
        x += (column.left_mm + (column.right_mm - column.left_mm) * graded(n)).tolist()
        ends = [np.interp(shares, np.arange(len(of)), of[:, side]) for side in (0, 1)]
        at = [0.0, *graded(n).tolist()]
        z += [ends[0] + (ends[1] - ends[0]) * share for share in at[bool(z) :]]
        for share in np.add(at[1:], at[:-1]) / 2:
            kinds = _kinds(column, ends, share, materials)
            material.append(kinds[0])
            electrode.append(kinds[1])
    return SectionRaster(
        np.array(x) * M_PER_MM, np.array(z).T * M_PER_MM, np.array(material).T, np.array(electrode).T,
        scene.repeats[across],
    )  # fmt: skip


def graded(count: int) -> Real:
    """Ends of parts of 1 that are smaller towards both its ends, where corners are."""
    even = np.arange(1, count + 1) / count
    return np.asarray(_GRADED * (1 - np.cos(np.pi * even)) / 2 + (1 - _GRADED) * even)


def _interfaces(found: Sequence[SectionColumn]) -> list[Real]:
    """Heights of the interfaces of all columns at their sides, the same ones from side to side [mm]."""
    levels = _levels(found)
    lines = [_lines(c, levels) for c in found]
    if len({len(of) for of in lines}) > 1 or not _joined(lines):
        raise OutOfRange(
            "a virtual specimen of a section whose sloping interfaces end inside it; print it: what is printed in "
            "layers has level ones"
        )
    return lines


def _levels(found: Sequence[SectionColumn]) -> list[float]:
    """Heights at which some interface is level."""
    ends = (end for column in found for layer in column.layers for end in (layer.bottom_mm, layer.top_mm))
    level = sorted({round(a, 9) for a, b in ends if abs(a - b) < _NONE_MM})
    return [0.0, *(z for z in level if z > _NONE_MM)]


def _lines(column: SectionColumn, levels: Sequence[float]) -> Real:
    """Heights of all interfaces of a column at its sides, upwards (k, 2) [mm]: its sloping ones and all levels."""
    ends = {end for layer in column.layers for end in (layer.bottom_mm, layer.top_mm)}
    sloping = [end for end in ends if abs(end[0] - end[1]) >= _NONE_MM]
    return np.array(sorted([*((z, z) for z in levels), *sloping], key=lambda e: (round(sum(e), 9), e)))


def _joined(lines: Sequence[Real]) -> bool:
    """Test whether interfaces of neighbours meet, and none crosses another."""
    meet = all(np.allclose(a[:, 1], b[:, 0], atol=10 * _NONE_MM) for a, b in pairwise(lines))
    return meet and all((np.diff(of, axis=0) >= -10 * _NONE_MM).all() for of in lines)


def _kinds(
    column: SectionColumn, ends: Sequence[Real], share: float, materials: Mapping[str, int]
) -> tuple[list[int], list[int]]:
    """Materials and terminals of a column's elements, upwards, at a share of its width."""
    z = ends[0] + (ends[1] - ends[0]) * share
    spans = [tuple(e[0] + (e[1] - e[0]) * share for e in (layer.bottom_mm, layer.top_mm)) for layer in column.layers]
    bottoms = [low for low, _ in spans]
    bodies: list[Body | None] = []
    for middle in ((z[1:] + z[:-1]) / 2).tolist():
        k = bisect_right(bottoms, middle) - 1
        bodies.append(column.layers[k].body if k >= 0 and middle < spans[k][1] else None)
    return (
        [materials[b.material] if b else 0 for b in bodies],
        [TERMINALS.get(b.terminal, 0) if b else 0 for b in bodies],
    )
