r"""Resistance of an electrode with its cogs, from end to end.

Current obeys the same equation as flux in a dielectric, with the conductivity for the permittivity:
:math:`\nabla \cdot (\nabla u / \varrho) = 0`, u held at both ends of the sensor, no current through the surface. So the
solvers of the capacitance give both bounds.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from json import dumps

import numpy as np

from sensorgen.core import cache as cached
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.scene.repetition import Band, SectionCell, Slice, cell
from sensorgen.scene.scene import Scene, area_mm2, content
from sensorgen.scene.sections import ROUNDING_MM, Section, square_to

SOURCE = "Dirichlet's and Thomson's principles for conduction; Rayleigh's cuts where no field is solved"
COST = 2

WIDTH = 1e-3  # of the interval, where the caller does not say

_METAL = "electrode"  # the material that conducts, among the solvers' names
_MOST_BRICKS = 100  # of a cell of boxes: 0.3 s; more is left to the simple bounds


def electrode_resistance(
    scene: Scene, terminal: str, resistivity_ohm_m: float, axis: str = "x", width: float = WIDTH
) -> Interval:
    r"""Bounds of an electrode's resistance between two contacts that cover its whole end faces.

    .. math:: \left(\int \frac{|\nabla u|^2}{\varrho}\right)^{-1} \le R \le \int \varrho |j|^2

    for any continuous u of 0 and 1 V at the ends, and any j without sources that carries 1 A and does not cross the
    surface. One cross-section square to the axis: exactly :math:`\varrho L / A`. One cross-section along it, or boxes:
    the best u and j of finite elements. Else, with all prisms of area a that run unchanged from end to end,

    .. math:: \varrho \int \frac{dx}{A(x)} \le R \le \frac{\varrho L}{\sum a}.

    Parameters
    ----------
    scene : Scene
        As drawn or as printed.
    terminal : str
        Of the electrode: "top", "bottom" or "middle".
    resistivity_ohm_m : float
        Of its material, 0 or more [ohm m].
    axis : str
        Along which the current flows, "x" or "y".
    width : float
        How wide the interval may be, relative to its middle; it is wider where boxes are many or prisms slanted [-].

    Returns
    -------
    Interval
        Resistance [ohm].

    Raises
    ------
    OutOfRange
        The scene has no such electrode, it does not reach from end to end, or a number makes no sense.

    Notes
    -----
    The current of the endless pattern: a contact that cuts a period changes it over one period at the ends. A line
    model that takes R / L neglects the resistance of a cog between plate and film (6e-6 of its impedance at 100 kHz,
    default tri) and the period against the length that current reaches (1.4e-4); see docs/conduction.md.

    Examples
    --------
    >>> from sensorgen.design.design import make
    >>> tri = {along: make({"shape": "tri", "parameters": {"along": along}}).drawn for along in "xy"}
    >>> plate = 0.07 * 0.1 / (0.3e-3 * 0.01)  # of the plate alone [ohm]
    >>> [round(electrode_resistance(tri[along], "top", 0.07).middle() / plate, 3) for along in "xy"]
    [0.846, 0.706]
    """
    if not 0 <= resistivity_ohm_m < np.inf:
        raise OutOfRange(f"resistivity of the {terminal} electrode is {resistivity_ohm_m:g}; expected 0 ohm m or more")
    if not width > 0:
        raise OutOfRange(f"accuracy is {width:g}; expected a number above 0, as 1e-4")
    bodies = tuple(replace(b, material=_METAL, terminal="") for b in scene.bodies if b.terminal == terminal)
    alone = Scene(bodies, scene.size_mm)
    if not alone.bodies:
        raise OutOfRange(f"no {terminal} electrode in this scene: its resistance is not defined")
    spans = np.array([p.span(axis) for _, p in alone.pieces])
    low, high, end = spans[:, 0].min(), spans[:, 1].max(), alone.size_mm["xyz".index(axis)]
    if low > ROUNDING_MM or high < end - ROUNDING_MM:
        raise OutOfRange(
            f"the {terminal} electrode runs from {low:g} to {high:g} mm along {axis}; expected 0 to {end:g} mm, from "
            "end to end of the sensor"
        )
    return _per_resistivity(alone, axis, width).times(resistivity_ohm_m / M_PER_MM)


@lru_cache(maxsize=256)
def _per_resistivity(alone: Scene, axis: str, width: float) -> Interval:
    """Resistance of all bodies over their resistivity [1/mm]."""
    square = square_to(alone, axis)
    for section in square:
        if not section.regions:
            raise _interrupted(alone, axis, f"nothing of it lies at {axis} = {section.at_mm:g} mm")
    if len(square) == 1:
        exact = square[0].depth_mm / _area_mm2(square[0])
        return Interval(exact, exact)
    simple = _simple(alone, axis, square)
    along = square_to(alone, "y" if axis == "x" else "x")
    if len(along) == 1:
        return _best(_in_plane(alone, along[0], width), simple)
    if all(p.is_box() for _, p in alone.pieces):
        simple = _best((Interval(*ends) for ends in _known_in_space(alone, axis, width)), simple)
    if simple.upper == np.inf:
        raise _interrupted(
            alone, axis, "no piece of it runs unchanged from end to end; expected a plate under the cogs"
        )
    return simple


def _known_in_space(alone: Scene, axis: str, width: float) -> list[tuple[float, float]]:
    """Bounds of :func:`_in_space`, kept on disk: a cell of boxes takes a third of a second."""
    look = [content(p) for _, p in alone.pieces]
    key = sha256(dumps([look, alone.size_mm]).encode()).hexdigest()
    question = {"what": "conduction", "scene": key, "axis": axis, "width": width}
    bounds: list[tuple[float, float]] | None = cached.known(question)
    if bounds is None:
        bounds = [(step.lower, step.upper) for step in _in_space(alone, axis, width)]
        cached.keep(question, bounds)
    return bounds


def _interrupted(alone: Scene, axis: str, why: str) -> OutOfRange:
    return OutOfRange(f"{' and '.join(b.name for b in alone.bodies)} does not conduct along {axis}: {why}")


def _best(steps: Iterator[Interval], simple: Interval) -> Interval:
    """Interval that all bounds of one number leave."""
    for step in steps:
        simple = Interval(max(simple.lower, step.lower), min(simple.upper, step.upper))
    return simple


def _area_mm2(section: Section) -> float:
    return sum(abs(area_mm2(outline)) for _, outline in section.regions)


def _simple(alone: Scene, axis: str, square: list[Section]) -> Interval:
    """Rayleigh's bounds: perfect conductors in planes square to the axis, insulators around what runs through."""
    length = alone.size_mm["xyz".index(axis)]
    pieces = [p for _, p in alone.pieces]
    through = [
        p.volume_mm3() for p in pieces if p.is_constant(axis) and np.ptp(p.span(axis)) > length - 2 * ROUNDING_MM
    ]
    volume = sum(p.volume_mm3() for p in pieces)
    lower = sum(s.depth_mm / _area_mm2(s) for s in square) if square else length**2 / volume
    return Interval(lower, length**2 / sum(through) if through else np.inf)


def _in_plane(alone: Scene, section: Section, width: float) -> Iterator[Interval]:
    """Of one cross-section along the current: bounds that get narrower [1/mm]."""
    from sensorgen.models.fem2d import narrowed
    from sensorgen.solvers.electrostatics import bounds as fem
    from sensorgen.solvers.electrostatics.triangles import insulated

    length, height = alone.size_mm["xyz".index(section.across)], alone.size_mm[2]
    piece = cell(section, height, evenly=False)
    low, high = piece.slices[0].left_mm, piece.slices[-1].right_mm
    ends = [Slice(a, b, (Band("", name, (0.0, 0.0), (height, height)),))
            for a, b, name in ((2 * low - high, low, "bottom"), (high, 2 * high - low, "top"))]  # fmt: skip
    inner = [Slice(s.left_mm, s.right_mm, tuple(map(_conducting, s.bands))) for s in piece.slices]
    try:
        mesh = insulated(SectionCell((ends[0], *inner, ends[1]), (1.0,) * (len(inner) + 2)))
    except ValueError:
        raise _interrupted(alone, section.across, "no piece of it reaches from end to end") from None
    cells = length / (high - low)

    def resistance(energies: fem.Energies) -> Interval:
        one = fem.whole(energies, [1.0]).times(section.depth_mm)
        return Interval(cells / one.upper, cells / one.lower)

    return (step.interval for step in narrowed(mesh, {_METAL: 1.0}, resistance, width))


def _conducting(band: Band) -> Band:
    return replace(band, material=_METAL if band.material == _METAL else "")


def _in_space(alone: Scene, axis: str, width: float) -> Iterator[Interval]:
    """Of boxes: bounds that get narrower [1/mm]; none where their cell has too many."""
    from sensorgen.models.fem3d import narrowed, total
    from sensorgen.solvers.electrostatics.boxes import insulated

    at = "xyz".index(axis)
    try:
        coarse = insulated(alone, at)
    except ValueError as error:
        raise _interrupted(alone, axis, str(error)) from None
    if (coarse.fill > 1).sum() > _MOST_BRICKS:
        return
    planes, sides = coarse.planes_mm, alone.size_mm
    beside = np.moveaxis(coarse.shares, at, 0)[:1] / coarse.shares.flat[0]  # how often across the current
    beside *= sides[1 - at] / (beside @ np.diff(planes[1 - at]))
    coarse = replace(coarse, shares=np.moveaxis(np.repeat(beside, len(planes[at]) - 1, axis=0), 0, at))
    cells = sides[at] / (planes[at][-2] - planes[at][1])
    values = [0.0, 0.0, *(float(name == _METAL) for name in coarse.names[2:])]
    for *_, row in narrowed(total, coarse, values, width):
        yield Interval(float(cells / row.upper), float(cells / row.lower))
