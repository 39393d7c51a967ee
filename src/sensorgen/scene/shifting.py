"""Pieces moved to another place, or with x and y exchanged."""

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


def transposed(piece: Piece) -> Piece:
    """Piece with x and y exchanged: its mirror image about the line x = y.

    >>> transposed(Prism("y", ((0, 5), (1, 5), (1, 6)), 2, 3))
    Prism(axis='x', outline=((0, 5), (1, 5), (1, 6)), start_mm=2, end_mm=3)
    """
    if isinstance(piece, Prism):
        if piece.axis == "z":
            return replace(piece, outline=tuple((y, x) for x, y in piece.outline))
        return replace(piece, axis={"x": "y", "y": "x"}[piece.axis])
    if isinstance(piece, Revolved):
        return replace(piece, x_mm=piece.y_mm, y_mm=piece.x_mm)
    if isinstance(piece, Loft):
        lower, upper = (tuple((y, x) for x, y in outline) for outline in (piece.lower, piece.upper))
        return Loft(lower, upper, piece.bottom_mm, piece.top_mm)
    whole = surface(piece)
    return Polyhedron(tuple((y, x, z) for x, y, z in whole.vertices), tuple((a, c, b) for a, b, c in whole.triangles))


def _moved(outline: Outline, u_mm: float, v_mm: float) -> Outline:
    return tuple((rounded(u + u_mm), rounded(v + v_mm)) for u, v in outline)
