"""The elements of press2d on Cook's membrane: does nearly incompressible rubber lock?

A panel 48 mm long, 44 mm high where it is clamped and 16 mm where it is sheared, E 240.565, nu 0.4999, plane strain,
small strain. Compared with the mean displacement of the sheared edge, by mixed elements of order 6 in another program.
"""

from functools import partial

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.verification.chart.measured import ChartPoint, climbed, relative

ASKED = "how far the sheared edge of a membrane moves"
STANDARD: dict[str, float] = {"Cook's membrane": 0.077181}
_KNOWN_TO = 4e-5
_CELLS = (4, 8, 16, 32)
_MODULUS, _RATIO = 240.565, 0.4999


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure the elements on meshes from coarse to fine.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A finer mesh is not tried where that would take longer, estimated as ten times the last one [s].
    """
    levels = [(f"{n} x {n} cells of two triangles, ", partial(edge, n)) for n in _CELLS]
    judge = relative(STANDARD[name], _KNOWN_TO, "off by {:+.3g}")
    return list(climbed(name, [("press2d: its elements", levels)], judge, budget_s))


def why_not_applicable(_: str) -> dict[str, str]:
    """Why models of compression do not apply to it."""
    return {"press3d": "its bricks have upright walls", "springs": "nothing presses it", "compression": "it is no film"}


def edge(cells: int) -> float:
    """Mean way of the sheared edge under a force of 1, with that many cells along each side."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    from sensorgen.solvers.contact import element
    from sensorgen.solvers.contact.mesh import of_triangles

    mesh = of_triangles(*_grid(cells))
    full = np.full(len(mesh.outer), 1.0)
    elements = element.Elements(mesh, element.law(_MODULUS * full, _RATIO * full))
    x = mesh.points_m[:, 0]
    force = np.zeros(2 * len(x))
    sheared = (x[mesh.rim] == x.max()).all(axis=1)
    length = mesh.lengths_m()[sheared]
    for node, share in zip(mesh.rim[sheared].T, (1 / 6, 1 / 6, 2 / 3), strict=True):
        np.add.at(force, 2 * node + 1, share * length / length.sum())
    tangent = elements.tangent(np.zeros(2 * len(x)), elements.start()).stiffness
    places = np.broadcast_to(elements.freedoms[:, :, None], tangent.shape)
    matrix = coo_matrix((tangent.ravel(), (places.ravel(), places.swapaxes(1, 2).ravel()))).tocsr()
    free = np.flatnonzero(np.repeat(x > 0, 2))
    return float(force[free] @ spsolve(matrix[free][:, free].tocsc(), force[free]))


def _grid(cells: int) -> tuple[Real, Whole, Whole]:
    """Corners, triangles and their region, narrow towards the clamped edge and its ends."""
    s = np.linspace(0, 1, cells + 1)
    x, y = (v.ravel() for v in np.meshgrid(s**2, (1 - np.cos(np.pi * s)) / 2))
    k = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (v.ravel() for v in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    corners = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([48 * x, 44 * x + y * (44 - 28 * x)]), corners, np.ones(len(corners), np.int64)
