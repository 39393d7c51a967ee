"""Finite elements on curved tetrahedra: bounds for bumps, cones, pyramids and other bodies that no other model solves.

The part of a scene between its mirrors is solved by :mod:`sensorgen.solvers.electrostatics.round_bodies` on finer and
finer meshes. Needs NGSolve. See docs/curved.md.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sensorgen.core.bounds import Interval
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.models import refusal
from sensorgen.scene.layers import Region
from sensorgen.scene.repetition import halved, repeat
from sensorgen.scene.scene import SLIVER_MM, Body, Piece, Scene, dielectrics
from sensorgen.solvers.electrostatics import bounds as fem

if TYPE_CHECKING:
    from sensorgen.solvers.electrostatics.round_cell import RoundCell

SOURCE = "Dirichlet's and Thomson's principles; curved tetrahedra, H1 and hybrid H(div) by NGSolve"
COST = 3

WIDTH = 2e-3  # of the interval unless given

_ENDS = ("bottom", "top")
_CUTS = (0.07, 0.5, 0.93)  # of each layer: heights at which repetition is looked for
_MOST = 60  # bodies of a cell: more would take hours


def why_not_applicable(scene: Scene) -> str | None:
    """Why the model does not apply to a scene, or None."""
    if reason := fem.unmirrored(scene):
        return reason
    pieces = [piece for _, piece in scene.pieces]
    if any(all(piece.is_constant(axis) for piece in pieces) for axis in "xyz"):
        return "its bodies are prisms along one axis: solved by the models of those"
    if find_spec("ngsolve") is None:
        return "NGSolve is not installed: pip install 'sensorgen[fem]'"
    return refusal(ValueError, cell, scene)


def capacitance(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Interval:
    """Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

    Parameters, result and errors as of :class:`sensorgen.models.CapacitanceModel`.

    Raises
    ------
    Unsolved
        The electrodes touch, one does not cover the sensor, or bodies are too near each other for a mesh.
    """
    fem.check(permittivity, width)
    return fem.narrowest(steps(scene, permittivity, width))


def steps(scene: Scene, permittivity: Mapping[str, float], width: float = WIDTH) -> Iterator[fem.FieldStep]:
    """The meshes that :func:`capacitance` goes through, until the interval is narrow enough."""
    from sensorgen.solvers.electrostatics.round_bodies import bounds

    own, materials = cell(scene)
    plan = replace(own, permittivity=[float(permittivity[name]) for name in materials])
    reached = False
    try:
        for level, elements, energies in bounds(plan, width):
            interval = fem.whole(energies, plan.shares.ravel().tolist())
            reached = True
            yield fem.FieldStep(level.order, elements, energies.unknowns, interval.times(EPS0_F_PER_M * M_PER_MM))
            if interval.width() <= width:
                return
    except fem.Unsolved:
        if not reached:  # else the mesh before it answers as well as it can
            raise


def _looks(scene: Scene) -> Iterator[Region]:
    """Regions of each material and terminal, at some heights between any two levels."""
    levels = sorted({z for _, piece in scene.pieces for z in (*piece.levels_mm(), *piece.span("z"))})
    spans = [(bottom, top) for bottom, top in pairwise(levels) if top - bottom > SLIVER_MM]
    for bottom, top in spans:
        for share in _CUTS:
            yield from _at(scene, bottom + share * (top - bottom))


def _at(scene: Scene, z_mm: float) -> Iterator[Region]:
    """Regions of each material and terminal at a height."""
    outlines: dict[tuple[str, str], list[shapely.Polygon]] = {}
    for body in scene.bodies:
        cut = [shapely.Polygon(outline) for piece in body.pieces for outline in piece.cut("z", z_mm)]
        outlines.setdefault((body.material, body.terminal), []).extend(cut)
    return (shapely.union_all(own) for own in outlines.values() if own)


@lru_cache(maxsize=8)
def cell(scene: Scene) -> tuple["RoundCell", tuple[str, ...]]:
    """The cell of a scene without permittivities, and the materials of its dielectrics.

    Raises
    ------
    ValueError
        An electrode is missing, the pattern has no mirrors, or the cell has too many bodies.
    """
    from sensorgen.solvers.electrostatics.round_cell import RoundCell

    bottom, top = _heights(scene, "bottom"), _heights(scene, "top")
    looks = list(_looks(scene))
    x, y = repeat(looks, scene.size_mm[:2], 0), repeat(looks, scene.size_mm[:2], 1)
    if x.shifts or y.shifts:
        raise ValueError("the pattern repeats by shifts, not by mirrors")
    x, y = halved((x, y), [shapely.clip_by_rect(r, x.low_mm, y.low_mm, x.high_mm, y.high_mm) for r in looks])
    low = (x.low_mm, y.low_mm, min(bottom)[0])
    high = (x.high_mm, y.high_mm, max(z for _, z in top))
    near = [(body, piece) for body, piece in scene.pieces if _lies_in(piece, low, high)]
    if len(near) > _MOST:
        raise ValueError(f"its cell has {len(near)} bodies; at most {_MOST} are solved")
    materials = dielectrics(body for body, _ in near)
    pieces = tuple((piece, _kind(body, materials)) for body, piece in near)
    cuts = x.places_mm[1:-1].tolist(), y.places_mm[1:-1].tolist()
    return RoundCell(low, high, pieces, len(_ENDS), (), cuts, np.outer(x.shares, y.shares)), materials


def _kind(body: Body, materials: Sequence[str]) -> int:
    """Number of a body's conductor, or after all of those, of its dielectric."""
    return _ENDS.index(body.terminal) if body.terminal else len(_ENDS) + materials.index(body.material)


def _heights(scene: Scene, end: str) -> list[tuple[float, float]]:
    """Bottom and top of each piece of an electrode [mm]; raises ValueError where it has none."""
    spans = [piece.span("z") for body, piece in scene.pieces if body.terminal == end]
    if not spans:
        raise ValueError(f"the scene has no {end} electrode")
    return spans


def _lies_in(piece: Piece, low_mm: Sequence[float], high_mm: Sequence[float]) -> bool:
    """True where a piece has a part within a box."""
    return all(
        piece.span(axis)[0] < end - SLIVER_MM and piece.span(axis)[1] > start + SLIVER_MM
        for axis, start, end in zip("xyz", low_mm, high_mm, strict=True)
    )
