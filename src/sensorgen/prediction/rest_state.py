"""A body at rest: capacitance with what its range holds, and resistivities."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, prod
from typing import NamedTuple

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body, Cells
from sensorgen.design.design import Design
from sensorgen.design.values import ENDS, MaterialValue, lead_ranges, permittivities, resistivities, spread
from sensorgen.models.overlap import edge_fringe_f
from sensorgen.prediction.capacitance import PLANE, Answer, Unpredictable, capacitance, default_width, of_sensor
from sensorgen.prediction.electrodes import electrode_resistance
from sensorgen.scene.scene import Scene
from sensorgen.scene.slabs import is_open

_TOLD_APART = 1.001  # ratio of permittivities from which on a range counts: that of air does not


@dataclass(frozen=True)
class RestState:
    """A body before anything presses on it.

    Attributes
    ----------
    answer : Answer
        Capacitance of the most likely cell, counted to the whole sensor.
    capacitance : Bounds
        Of the sensor, with models, print and materials [F].
    resistance : dict of str to Bounds
        Of the top and the bottom electrode, end to end, cogs included [ohm]; without those that do not cover the sensor
        and do not reach from end to end.
    resistivity_ohm_m : (float, float)
        Of the top and the bottom electrode [ohm m].
    values : tuple of MaterialValue
        Material values that both rest on.
    by_width, by_film : Interval
        What ``capacitance.print`` is the product of: line widths, and the thickness of the film alone [F].
    layer_thinner_f : float
        With a film one layer thinner; 0 where none is left, or without ranges [F].
    doubts : tuple of str
        Which other ways to print it have no capacitance, and why.
    """

    answer: Answer
    capacitance: Bounds
    resistance: dict[str, Bounds]
    resistivity_ohm_m: tuple[float, float]
    values: tuple[MaterialValue, ...]
    by_width: Interval
    by_film: Interval
    layer_thinner_f: float = 0.0
    doubts: tuple[str, ...] = ()


def rest_state(body: Body, width: float | None = None, *, ranges: bool = True) -> RestState:
    """Capacitance and resistivities of a body at rest.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    width : float, optional
        Relative width that the bounds of the capacitance may have [-]; as of :func:`default_width` if not given, which
        a larger one does not coarsen. Infinite: closed-form bounds, without ranges.
    ranges : bool
        Solve for what other ways to print it and other values of the materials lead to as well.

    Raises
    ------
    Unpredictable
        No model applies to the most likely cell, as to a short.
    MissingValue
        No source gives a material value that is needed.
    """
    values, rho = permittivities(body.design), resistivities(body.design)
    eps = {v.material: v.value for v in values}
    cells = body.cells
    scene, *others = dict.fromkeys(cells.scenes.values())
    ranges = ranges and width != inf
    wanted = inf if width == inf else min(width or inf, default_width(scene))
    said = cells.remarks.get(next(iter(cells.scenes)), ())
    try:
        answer = of_sensor(cells, eps, wanted)
    except Unpredictable as error:
        raise Unpredictable("; ".join((*said, str(error)))) from None
    c = answer.capacitance_f
    found, doubts, unbounded = [c.middle()], list(said), False
    coarse = 2 * wanted if is_open(scene) else wanted  # whole sensors take long
    for other in others if ranges else ():
        try:
            found.append(capacitance(other, eps, coarse).capacitance_f.middle() * cells.count)
        except Unpredictable as error:
            unbounded = unbounded or cells.gap_mm.get(_rule(cells, other)) == 0
            rule = _rule(cells, other)
            doubts.append(f"printed by the rule {rule!r} it has no capacitance: {error}")
    by_width = Interval(min(found), max(found))
    thick, thin, layer = _film_ratios(cells, eps) if ranges else (1.0, 1.0, 0.0)
    by_film = Interval(c.middle() * thick, c.middle() * (thin or 1.0))
    by_print = Interval(by_width.lower * thick, by_width.upper * (thin or 1.0))
    bounds = Bounds.of(
        c.middle(), "F", model=c, print=by_print, certified=True,
        open="upper" if unbounded or thin is None else "",
        material=_permittivity_range(body.design, scene, c.middle()) if ranges else Interval(c.middle(), c.middle()),
    )  # fmt: skip
    ends = (rho["top"].value, rho["bottom"].value)
    resistance, unknown = _resistance(body)
    doubts += unknown
    return RestState(
        answer, bounds, resistance, ends, (*values, *rho.values()), by_width, by_film, layer * c.middle(),
        tuple(doubts),
    )  # fmt: skip


def _resistance(body: Body) -> tuple[dict[str, Bounds], list[str]]:
    """Of the electrodes that reach from end to end, and why another has none."""
    found, said = dict[str, Bounds](), list[str]()
    for end in ENDS:
        try:
            found |= electrode_resistance(body, (end,))
        except OutOfRange as error:
            said.append(f"no resistance: {error}")
    return found, said


def _rule(cells: Cells, scene: Scene) -> str:
    return next(name for name, cell in cells.scenes.items() if cell == scene)


def _film_ratios(cells: Cells, eps: Mapping[str, float]) -> tuple[float, float | None, float]:
    """Capacitance over that of the most likely cell, with the thickest, the thinnest film, and one a layer thinner [-].

    A cross-section is solved. Other cells, which take seconds, by the closed-form bounds: rect with a film of 0.1 mm
    and 0.02 mm less or more +23 and -16 %, solved +19 and -13 %. None, or 0, where no film is left.
    """
    if not cells.film:
        return 1.0, 1.0, 0.0
    width = default_width(cells.first())

    def of(scene: Scene) -> float:
        return capacitance(scene, eps, width if width == PLANE else inf).capacitance_f.middle()

    usual, films = of(cells.first()), (cells.film.thinner, cells.film.layer_thinner)
    thinner, layer = (of(scene) / usual if scene else None for scene in films)
    return of(cells.film.thicker) / usual, thinner, layer or 0.0


def _permittivity_range(design: Design, scene: Scene, middle: float) -> Interval:
    """The capacitance with every permittivity at the lowest and at the highest of its sources [F].

    Ratios by the closed-form bounds of the cell, whose error mostly cancels.
    """
    ratios = permittivity_ratios(design, scene)
    return Interval(
        middle * prod(low for low, _ in ratios.values()), middle * prod(high for _, high in ratios.values())
    )


def permittivity_ratios(design: Design, scene: Scene) -> dict[str, tuple[float, float]]:
    """Capacitance over that with the permittivity taken, at the lowest and the highest value of each material [-]."""
    values = permittivities(design)
    eps = {v.material: v.value for v in values}
    usual = capacitance(scene, eps).capacitance_f.middle()
    found = {}
    for value in values:
        low, high = spread(design, value)
        if high > _TOLD_APART * low:
            ends = (
                capacitance(scene, eps | {value.material: end}).capacitance_f.middle() / usual for end in (low, high)
            )
            found[value.material] = (next(ends), next(ends))
    return found


class Added(NamedTuple):
    """Value, least and most of what is added to a sensor."""

    value: float
    least: float
    most: float


def added(body: Body) -> tuple[Added, Added]:
    """Capacitance in parallel [F], with the fringe of equal plates at most, and resistance in series [ohm].

    Raises
    ------
    MissingValue
        No source gives a permittivity or resistivity.
    """
    farad, ohm = (Added(*of) for of in lead_ranges(body.design))
    p, gap_mm = body.design.params, next(iter(body.cells.gap_mm.values()), 0.0)
    if is_open(body.cells.first()) or not 0 < gap_mm < p.width_mm:
        return farad, ohm  # electrodes whose fringe is in the capacitance already
    eps = max(value.value for value in permittivities(body.design))
    around, gap, across, high = (
        s * M_PER_MM for s in (2 * (p.length_mm + p.width_mm), gap_mm, p.width_mm, p.electrode_mm)
    )
    return farad._replace(most=farad.most + edge_fringe_f(around, gap, across, high, eps)), ohm
