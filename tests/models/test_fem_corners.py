"""Exponents at corners against closed forms, and flipped edges against Delaunay's triangles; both need NumPy only."""

import numpy as np
import pytest
from cell_scenes import close
from scipy.spatial import Delaunay

from sensorgen.solvers.electrostatics.mesh import exponent, exponents
from sensorgen.solvers.electrostatics.triangles import Triangles, apart, flipped


def around(*fans: list[tuple[float, float]]) -> tuple[Triangles, dict[str, float]]:
    """Triangles around one corner: electrodes between fans, each fan of angles [rad] and permittivities."""
    points, corners, regions, terminals, at = [(0.0, 0.0)], [], [], {}, 0.0
    for fan in fans:
        first = len(points)
        turns = np.cumsum([at, *(w for w, _ in fan)])
        points += [(np.cos(a), np.sin(a)) for a in turns]
        corners += [(0, first + k, first + k + 1) for k in range(len(fan))]
        regions += [(f"{eps:g}", 1.0) for _, eps in fan]
        terminals |= {(0, first): "top", (0, len(points) - 1): "top"}
        at = turns[-1] + 0.2
    return Triangles(np.array(points), corners, regions, terminals), {name: float(name) for name, _ in regions}


def test_exponents_of_corners_that_textbooks_know():
    """pi/w between electrodes w apart, pi/(2 w) from electrode to mirror; quadrants of eps, 1, eps, 1 in turn
    (Kellogg): tan(lambda pi / 4) = eps^-1/2.
    """
    assert exponent(((1.5 * np.pi, 4.68),), (True, True)) == close(2 / 3, 1e-9)
    assert exponent(((0.75 * np.pi, 4.68),), (True, False)) == close(2 / 3, 1e-9)
    assert exponent(((0.75 * np.pi, 4.68),), (False, True)) == close(2 / 3, 1e-9)
    for eps in (3.0, 161.4476):
        quadrants = ((np.pi / 2, eps), (np.pi / 2, 1.0)) * 2
        assert exponent(quadrants, None) == close(4 / np.pi * np.arctan(eps**-0.5), 1e-8)
    assert exponent(((np.pi / 2, 2.0),) * 4, None) > 7  # smooth, as far as its polynomials go


def test_pieces_that_meet_at_a_point_have_an_exponent_each():
    """Two pieces of dielectric, 3.3 and 2.2 rad wide, meet at a point of the electrode, in either turn."""
    wide, narrow = [(1.1, 2.0)] * 3, [(1.1, 3.0)] * 2
    for fans in ((wide, narrow), (narrow, wide)):
        mesh, eps = around(*fans)
        parted = apart(mesh)
        found = exponents(parted, eps)
        values = [found[k] for k in sorted(found) if np.hypot(*parted.points[k]) == 0]
        assert sorted(values) == close([np.pi / 3.3, np.pi / 2.2], 1e-8)
        assert sorted(parted.terminals.values()) == sorted(mesh.terminals.values())


@pytest.mark.parametrize("mirror", [0, -1])
def test_a_corner_from_electrode_to_mirror(mirror):
    """pi / (2 w) in a mesh too, whichever side the mirror is at."""
    mesh, eps = around([(1.1, 2.0)] * 2)
    edges = list(mesh.terminals)
    half = Triangles(mesh.points, mesh.triangles, mesh.regions, {e: "top" for e in edges if e != edges[mirror]})
    assert exponents(half, eps)[0] == close(np.pi / 4.4, 1e-8)


def test_flips_end_at_delaunays_triangles():
    """From those of the same points drawn out eight times; SciPy has both."""
    points = np.random.default_rng(2).random((60, 2))
    start, best = (Delaunay(points * scale).simplices for scale in ((8.0, 1.0), (1.0, 1.0)))
    corners = points[start]
    across = np.linalg.det(np.diff(corners, axis=1))
    turned = [tuple(t if turn > 0 else t[::-1]) for t, turn in zip(start.tolist(), across, strict=True)]
    inner = {frozenset(t) for t in flipped(points, turned, [0] * len(turned))}
    assert len(inner) == len(start)
    assert len(inner ^ {frozenset(t) for t in best.tolist()}) <= 0.1 * len(start)  # slender ones at the hull
