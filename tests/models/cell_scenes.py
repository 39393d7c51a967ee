"""Scenes of cells that several tests speak of."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.shapes import rect, tri
from sensorgen.models import fem2d
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box
from sensorgen.solvers.electrostatics.mesh import Cones

EPS = {"x60": 4.68, "air": 1.00059}
MM = 1e-3
CELLS = json.loads((Path(__file__).parents[1] / "reference" / "cells.json").read_text("utf-8"))


def close(expected, rel: float):
    """Relative only: pytest's absolute tolerance of 1e-12 is more than many a capacitance."""
    return pytest.approx(expected, rel=rel, abs=0)


def tri_cell(film_mm: float, **options) -> Scene:
    """One period, 1 mm deep."""
    return tri.scene(tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=film_mm, **options), Fill())


def rect_cell(film_mm: float, **options) -> Scene:
    return rect.scene(rect.Params(length_mm=2.0, width_mm=2.0, dielectric_mm=film_mm, **options), Fill())


def prism(*points: tuple[float, float], depth: float = 1.0) -> Prism:
    """Along y."""
    return Prism("y", tuple((float(u), float(v)) for u, v in points), 0.0, depth)


def plates(*bodies: Body, gap_mm: float = 1.0, length_mm: float = 2.0) -> Scene:
    """Bodies between two flat electrodes of 0.2 mm, 1 mm deep."""
    top = 0.2 + gap_mm
    ends = (
        Body("low", "etpu", (box(0, length_mm, 0, 1, 0, 0.2),), "bottom"),
        Body("high", "etpu", (box(0, length_mm, 0, 1, top, top + 0.2),), "top"),
    )
    return Scene((ends[0], *bodies, ends[1]), (length_mm, 1.0, top + 0.2))


def bars(name: str, terminal: str, *boxes: tuple[float, float, float, float]) -> Body:
    """Conductors from x to x and from z to z."""
    return Body(name, "etpu", tuple(box(x0, x1, 0, 1, z0, z1) for x0, x1, z0, z1 in boxes), terminal)


def slab() -> Body:
    """A layer of dielectric on the lower plate."""
    return Body("slab", "x60", (box(0, 2, 0, 1, 0.2, 0.45),))


def few_rings(scene: Scene, doublings: int = 1) -> Cones:
    """A mesh with rings so few that they can be written out."""
    mesh = fem2d._graded(fem2d._triangles(scene)[1], EPS, 1e-3)
    return Cones(mesh.triangles, dict.fromkeys(mesh.doublings, doublings))


def cut_slabs() -> tuple[Scene, float]:
    """Slabs from plate to plate, 2.25 periods of them, and their exact capacitance: sum of w eps / h [F]."""
    slabs = [Body(f"s{k}", "x60", (box(max(k - 0.2, 0), k + 0.2, 0, 1, 0.2, 1.2),)) for k in range(3)]
    solid_mm = 0.2 + 2 * 0.4
    exact = EPS0_F_PER_M * (solid_mm * EPS["x60"] + (2.25 - solid_mm) * EPS["air"]) * MM
    return plates(*slabs, length_mm=2.25), exact


def stairs(steps: int = 3, end_mm: float = 2.0) -> Scene:
    """A cog printed in layers, over a film."""
    width, rise = 0.5 / steps, 0.4 / steps
    cog = tuple(box(0, width * (k + 1), 0, 1, 0.5 + rise * k, 0.5 + rise * (k + 1)) for k in range(steps))
    return Scene(
        (
            Body("low", "etpu", (box(0, end_mm, 0, 1, 0, 0.3),), "bottom"),
            Body("film", "x60", (box(0, end_mm, 0, 1, 0.3, 0.4),)),
            Body("top", "etpu", (*cog, box(0, end_mm, 0, 1, 0.9, 1.2)), "top"),
        ),
        (end_mm, 1.0, 1.2),
    )


def bumps(corners: int = 24, eps: str = "x60") -> Scene:
    """Half discs of dielectric that stand on the lower electrode and almost touch the upper one."""
    angle = np.linspace(0, np.pi, corners + 1)
    outline = [(1 + 0.5 * np.cos(a), 0.2 + 0.5 * np.sin(a)) for a in angle]
    outline[-1], outline[0] = (0.5, 0.2), (1.5, 0.2)
    return plates(Body("bump", eps, (prism(*outline),)), gap_mm=0.55)


def between_curves(lower: Callable, upper: Callable, x: np.ndarray, height: float) -> Scene:
    """Two electrodes that meet the air between them along curves, drawn with straight lines between given places."""
    low, high = [(u, lower(u)) for u in x], [(u, upper(u)) for u in x]
    bottom = [(x[0], 0.0), (x[-1], 0.0), *low[::-1]]
    top = [*high, (x[-1], height), (x[0], height)]
    return Scene(
        (Body("low", "etpu", (prism(*bottom),), "bottom"), Body("high", "etpu", (prism(*top),), "top")),
        (float(x[-1] - x[0]), 1.0, height),
    )
