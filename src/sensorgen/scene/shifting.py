"""Pieces moved to another place."""

from dataclasses import replace

from sensorgen.scene.polyhedra import Loft, Polyhedron, surface
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import AXES, PLANE, Outline, Piece, Place, Prism, rounded


def shifted(piece: Piece, by_mm: Place) -> Piece:
    """Piece moved along x, y and z [mm].

    >>> shifted(Prism("z", ((0, 0), (1, 0), (1, 1)), 0, 1), (2, 0, 3))
    Prism(axis='z', outline=((2, 0), (3, 0), (3, 1)), start_mm=3, end_mm=4)
    """
    x, y, z = by_mm
    if isinstance(piece, Prism):
        first, second = (by_mm[AXES.index(axis)] for axis in PLANE[piece.axis])
        along = by_mm[AXES.index(piece.axis)]
        outline = _moved(piece.outline, first, second)
        return replace(
            piece, outline=outline, start_mm=rounded(piece.start_mm + along), end_mm=rounded(piece.end_mm + along)
        )
    if isinstance(piece, Revolved):
        return replace(
            piece, x_mm=rounded(piece.x_mm + x), y_mm=rounded(piece.y_mm + y), outline=_moved(piece.outline, 0.0, z)
        )
    if isinstance(piece, Loft):
        lower, upper = _moved(piece.lower, x, y), _moved(piece.upper, x, y)
        return Loft(lower, upper, rounded(piece.bottom_mm + z), rounded(piece.top_mm + z))
    whole = surface(piece)
    corners = tuple((rounded(a + x), rounded(b + y), rounded(c + z)) for a, b, c in whole.vertices)
    return Polyhedron(corners, whole.triangles)


def _moved(outline: Outline, u_mm: float, v_mm: float) -> Outline:
    return tuple((rounded(u + u_mm), rounded(v + v_mm)) for u, v in outline)
