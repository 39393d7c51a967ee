r"""Fringe of crossing tracks: the field from the edges of a row or column to the tracks that it crosses.

Of two cross-sections, square to the columns and square to the rows, each from the middle of a track to the middle of
the space beside it, with both as mirrors; the cell is the homogeneous layer that has the crossing's capacitance:

.. math:: C = C_0 (1 + f_x)(1 + f_y)

The product leaves the corners out: 0.3 % of C by finite volumes in three dimensions. Of what closing a crossing does,
closing its neighbour does 0.5 %.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sensorgen.models.fem2d import narrowed
from sensorgen.scene.unit_cell import Band, SectionCell, Slice
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.triangles import insulated

_WIDTH = 3e-3  # of the bounds
_PRESSED = 1.05  # capacitance over that at rest, at which the rise of the whole is compared
_Rows = list[tuple[str, str, float]]


@dataclass(frozen=True)
class Fringe:
    """Fringe of a crossing.

    Attributes
    ----------
    share : Interval and float
        Capacitance of the edges over that of the crossing's own area: best value, and range [-].
    gain : float
        Relative rise of the whole capacitance over that of the crossing's own area [-].
    """

    share: float
    least: float
    most: float
    gain: float


@dataclass(frozen=True)
class CrossingSection:
    """Heights and widths of a crossing [mm] and relative permittivities [-].

    Attributes
    ----------
    column, row : (float, float)
        Width of the track and of the space beside it.
    film, cell, electrode, cover, base : float
        Thicknesses.
    eps : mapping of str to float
        Of "film", "cell", what is "beside" the columns above the film, "solid" between tracks, "cover" and "air".
    """

    column: tuple[float, float]
    row: tuple[float, float]
    film: float
    cell: float
    electrode: float
    cover: float
    base: float
    eps: Mapping[str, float]

    def at(self, ratio: float) -> "CrossingSection":
        """The crossing with its cell pressed to a capacitance over that at rest."""
        film, cell = self.film / self.eps["film"], self.cell / self.eps["cell"]
        return replace(self, cell=self.cell * ((film + cell) / ratio - film) / cell)

    def share(self, lid: str = "") -> float:
        """Capacitance of the edges over that of the crossing's own area [-]."""
        film, cell = ("film", "", self.film), ("cell", "", self.cell)
        columns = self._edges(self.column, [film, cell], [film, ("beside", "", self.cell)], self.cover, lid)
        rows = self._edges(self.row, [cell, film], [cell, film], self.base, lid)
        return (1 + columns) * (1 + rows) - 1

    def _edges(self, widths: tuple[float, float], under: _Rows, beside: _Rows, beyond: float, lid: str) -> float:
        """Share of the edges of one track over a plate: ``beyond`` is the thickness of what lies on it."""
        track, space = (width / 2 for width in widths)
        outside: _Rows = [("", lid, self.electrode)] if lid else [("air", "", track + space)]
        top: _Rows = [("cover", "", beyond), *outside]
        slices = (
            _slice(0.0, track, [("", "bottom", self.electrode), *under, ("", "top", self.electrode), *top]),
            _slice(
                track, track + space, [("", "bottom", self.electrode), *beside, ("solid", "", self.electrode), *top]
            ),
        )
        mesh = insulated(SectionCell(slices, (1.0, 1.0)))
        shares = [share for _, share in mesh.regions]
        c = fem.narrowest(narrowed(mesh, self.eps, lambda found: fem.whole(found, shares), _WIDTH))
        return c.middle() * sum(height / self.eps[name] for name, _, height in under) / track - 1


def _slice(left: float, right: float, rows: _Rows) -> Slice:
    bands, z = [], 0.0
    for material, terminal, height in rows:
        if height > 0:
            bands.append(Band(material, terminal, (z, z), (z + height, z + height)))
            z += height
    return Slice(left, right, tuple(bands))


def fringe(of: CrossingSection) -> Fringe:
    """Fringe of a crossing at rest, and its part in the rise.

    Least: no solid but the film lies beside the tracks; most: a conductor at the tracks' potential lies on the cover.
    """
    rest, pressed = of.share(), of.at(_PRESSED).share()
    bare = replace(of, eps={**of.eps, "beside": of.eps["air"], "solid": of.eps["air"], "cover": of.eps["air"]})
    gain = (_PRESSED * (1 + pressed) / (1 + rest) - 1) / (_PRESSED - 1)
    return Fringe(rest, min(bare.share(), rest), max(of.share("top"), rest), gain)
