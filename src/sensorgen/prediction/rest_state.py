"""A body at rest: capacitance with what its range holds, losses of its dielectrics, resistance of its electrodes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, pi, prod
from typing import NamedTuple

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM, si
from sensorgen.design import values as stated
from sensorgen.design.body import Body, Cells
from sensorgen.design.design import Design
from sensorgen.design.materials import FILM_LEAK, INTERFACE_GAP, SET
from sensorgen.design.values import MaterialValue
from sensorgen.prediction.capacitance import PLANE, Answer, Unpredictable, capacitance, default_width, of_sensor
from sensorgen.scene.scene import Scene
from sensorgen.scene.slabs import is_open


def electrode_resistance(body: Body, ends: Sequence[str] = stated.ENDS) -> dict[str, Bounds]:
    """Resistance of the top and the bottom electrode from end to end [ohm].

    Parameters
    ----------
    body : Body
        Drawn or printed; a print is solid where it is printed, as contacts between lines cost nothing.
    ends : sequence of str
        Which electrodes.

    Raises
    ------
    MissingValue
        No source gives a resistivity.
    OutOfRange
        An electrode that does not reach from end to end.
    """
    design, resistance = body.design, {}
    for end, rho in ((end, rho) for end, rho in stated.resistivities(design).items() if end in ends):
        scene, *others = dict.fromkeys(body.cells.scenes.values())
        solid = _of_cell(body, scene, end, rho.value)
        printed = [solid.middle()]
        for other in others:
            try:
                printed.append(_of_cell(body, other, end, rho.value).middle())
            except OutOfRange:  # by this rule the electrode is interrupted
                printed.append(float("inf"))
        value, (low, high) = solid.middle(), stated.spread(design, rho)
        relative = Interval(low / rho.value, high / rho.value) if rho.value else Interval(1.0, 1.0)
        resistance[end] = Bounds.of(
            value, "ohm", model=solid, print=Interval(min(printed), max(printed)), certified=True,
            material=relative.times(value),
        )  # fmt: skip
    return resistance


def _of_cell(body: Body, scene: Scene, end: str, resistivity_ohm_m: float) -> Interval:
    """Of the whole sensor, from one unit cell: cells in series along it, in parallel across it [ohm]."""
    from sensorgen.models import conduction

    p = body.design.params
    in_series, in_parallel = p.length_mm / scene.size_mm[0], p.width_mm / scene.size_mm[1]
    return conduction.electrode_resistance(scene, end, resistivity_ohm_m).times(in_series / in_parallel)


LOSSES = ("loss_tangent", "resistivity_ohm_m")
LARGEST_TANGENT = 0.05  # assumed of an elastomer of which nothing is stated, its conduction included
LOWEST_HZ = 1.1e3  # of the bench's tones: a leak is strongest there

_ACCURACY = 1e-5
_WEAK = 0.1  # of what is stored: up to here a leak is a conductance within 1 %


def set_losses(design: Design) -> list[MaterialValue]:
    """Loss tangents and resistivities that a design sets for its dielectrics itself.

    No source gives a loss tangent, and the one resistivity that a source prints is a slip: what the user does not set
    is taken for lossless; only the range of an impedance holds up to ``LARGEST_TANGENT``.
    """
    names = stated.dielectrics(design) | {"air"}
    return [
        MaterialValue(name, quantity, values[quantity], SET)
        for name, values in sorted(design.material_values.items())
        if name in names
        for quantity in LOSSES
        if quantity in values
    ]


def permittivity(design: Design, frequency_hz: float | None = None) -> tuple[dict[str, complex], list[MaterialValue]]:
    r"""Relative permittivity of every dielectric and of air, complex where one loses or leaks; and what it rests on.

    .. math:: \varepsilon = \varepsilon' (1 - j \tan\delta) - j / (\omega \varepsilon_0 \varrho)

    Parameters
    ----------
    design : Design
        Its support is taken to be gone.
    frequency_hz : float or None
        Of the field, above 0 [Hz]; needed where a dielectric leaks.

    Raises
    ------
    BadInput
        A resistivity without a frequency.
    MissingValue
        A dielectric without a permittivity.
    """
    taken = stated.permittivities(design)
    eps = _with(taken, set_losses(design), frequency_hz)
    return eps, [*taken, *set_losses(design)]


def _with(
    taken: Sequence[MaterialValue], lost: Sequence[MaterialValue], frequency_hz: float | None
) -> dict[str, complex]:
    eps: dict[str, complex] = {t.material: t.value for t in taken}
    for loss in lost:
        if loss.quantity == "loss_tangent":
            eps[loss.material] -= 1j * eps[loss.material].real * loss.value
        elif frequency_hz is None:
            raise BadInput(
                f"{loss.material} leaks ({loss.value:g} ohm m), and its share depends on the frequency; "
                "expected one: --frequency 1.1kHz"
            )
        else:
            eps[loss.material] -= 1j * _conduction(loss.value, frequency_hz)
    return eps


def _conduction(resistivity_ohm_m: float, frequency_hz: float) -> float:
    """Addition of a leak to the permittivity, minus its imaginary part [-]."""
    return 1 / (2 * pi * frequency_hz * EPS0_F_PER_M * resistivity_ohm_m)


@dataclass(frozen=True)
class Lost:
    """Losses of the dielectrics of a whole sensor.

    Attributes
    ----------
    tan_delta : float
        Of the whole, the same at every frequency [-].
    largest_tangent : float
        Up to which it may be, where the design states none for its dielectrics [-].
    leak_s : float
        Conductance between the electrodes, the same at every frequency [S].
    taken : tuple of MaterialValue
        What both rest on; empty where nothing is lost.
    doubts : tuple of str
        Why they are to be taken with care.
    """

    tan_delta: float = 0.0
    largest_tangent: float = LARGEST_TANGENT
    leak_s: float = 0.0
    taken: tuple[MaterialValue, ...] = ()
    doubts: tuple[str, ...] = ()


NOTHING_LOST = Lost()


def lost(design: Design) -> Lost:
    r"""Losses of the dielectrics of a design, as far as the design or a source that it names says.

    A weak leak is a conductance :math:`G = \omega C''`: to first order in :math:`1 / (\omega \varepsilon \varrho)` it
    does not depend on the frequency, whatever lies in series with what leaks. It is taken at the lowest tone. What a
    film leaks per area, as a fit finds it, is a conductance of its own beside that.

    Raises
    ------
    Unpredictable
        No model knows the losses of this scene.
    """
    taken, sets = stated.permittivities(design), set_losses(design)
    parts = {quantity: [t for t in sets if t.quantity == quantity] for quantity in LOSSES}
    tangents, leaks = (_tangent(design, taken, parts[quantity]) for quantity in LOSSES)
    film = _of_film(design, FILM_LEAK)
    through_film_s = sum(t.value for t in film) * design.area_mm2 * M_PER_MM**2
    largest = _largest(design, taken, parts[LOSSES[0]])
    leak_s, doubts = 2 * pi * LOWEST_HZ * leaks[1] + through_film_s, tuple(_strong(taken, parts[LOSSES[1]]))
    return Lost(tangents[0], largest, leak_s, (*sets, *film), doubts)


def _largest(design: Design, taken: Sequence[MaterialValue], given: Sequence[MaterialValue]) -> float:
    """Largest C''/C' [-]: as given, and ``LARGEST_TANGENT`` for each dielectric but air of which none is."""
    known = {value.material for value in given} | {"air"}
    assumed = [
        MaterialValue(name, LOSSES[0], LARGEST_TANGENT, stated.ASSUMED)
        for name in dict.fromkeys(value.material for value in taken) if name not in known
    ]  # fmt: skip
    if not given or known == {"air"}:
        return LARGEST_TANGENT
    return _tangent(design, taken, [*given, *assumed])[0]


def perfect_interfaces(design: Design) -> Iterator[str]:
    """Doubt about a cell alone, where a source says the gap of the film's interfaces."""
    for gap in _of_film(design, INTERFACE_GAP):
        at = f"{si(gap.value, 'm')} ({gap.source})"
        yield f"the film's interfaces are taken as perfect; predict takes their gap, {at}"


def _of_film(design: Design, quantity: str) -> list[MaterialValue]:
    """A film's leak per area [S/m2], or the air gap equal to its interfaces [m], where one is known."""
    material, source = design.slot("film")
    if material.name not in {body.material for body in design.drawn.bodies}:
        return []
    try:
        value = material.value(quantity, source or design.used().get(material.name, ""))
    except MissingValue:
        return []
    return [MaterialValue(material.name, quantity, value.value, value.source)]


def _tangent(design: Design, taken: Sequence[MaterialValue], some: Sequence[MaterialValue]) -> tuple[float, float]:
    """C''/C' [-] and C'' [F] of the sensor with some of its losses."""
    if not some:
        return 0.0, 0.0
    answer = capacitance(design.in_use, _with(taken, some, LOWEST_HZ), _ACCURACY)
    if answer.loss_f is None:
        return 0.0, 0.0
    loss = (answer.loss_f.lower + answer.loss_f.upper) / 2
    return loss / answer.capacitance_f.middle(), loss


def _strong(taken: Sequence[MaterialValue], leaks: Sequence[MaterialValue]) -> Iterator[str]:
    eps = {t.material: t.value for t in taken}
    for leak in leaks:
        share = _conduction(leak.value, LOWEST_HZ) / eps[leak.material]
        if share > _WEAK:
            yield (
                f"{leak.material} leaks {share:.2g} of what it stores at {LOWEST_HZ / 1e3:g} kHz: beyond {_WEAK:g} its "
                "leak depends on the frequency, and is taken as of that tone"
            )


_LEAST_FILM = 0.1  # share of the film that interfaces leave at the least [-]
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
    by_interface : Interval
        What the gap of the film's interfaces leads to alone [F].
    """

    answer: Answer
    capacitance: Bounds
    resistance: dict[str, Bounds]
    resistivity_ohm_m: tuple[float, float]
    values: tuple[MaterialValue, ...]
    by_width: Interval
    by_film: Interval
    layer_thinner_f: float
    doubts: tuple[str, ...]
    by_interface: Interval


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
    values, rho = stated.permittivities(body.design), stated.resistivities(body.design)
    eps = {v.material: v.value for v in values}
    cells = body.cells
    scene = cells.first()
    ranges = ranges and width != inf
    wanted = inf if width == inf else min(width or inf, default_width(scene))
    remarks = cells.remarks.get(next(iter(cells.scenes)), ())
    try:
        answer = of_sensor(cells, eps, wanted)
    except Unpredictable as error:
        raise Unpredictable("; ".join((*remarks, str(error)))) from None
    gap = _of_film(body.design, INTERFACE_GAP)
    interface = _interface_ratios(body, gap, eps, answer.capacitance_f.middle())
    c = answer.capacitance_f.times(interface.value)
    ways = cells if ranges else replace(cells, scenes={"most likely": scene}, film=None)
    others, unknown, unbounded = _other_prints(ways, eps, wanted, interface.value)
    by_width = Interval(min([c.middle(), *others]), max([c.middle(), *others]))
    thick, thin, layer = _film_ratios(ways, eps)
    thinnest = thin or 1.0
    by_film = Interval(c.middle() * thick, c.middle() * thinnest)
    by_print = Interval(by_width.lower * thick, by_width.upper * thinnest)
    bounds = Bounds.of(
        c.middle(), "F", model=c, print=by_print, certified=True,
        open="upper" if unbounded or thin is None else "",
        material=_material_range(body.design, scene, c.middle(), interface) if ranges else None,
    )  # fmt: skip
    ends = (rho["top"].value, rho["bottom"].value)
    resistance, missing = _resistance(body)
    doubts = (*remarks, *unknown, *missing, *_unchanged_rise(interface))
    return RestState(
        answer, bounds, resistance, ends, (*values, *gap, *rho.values()), by_width, by_film, layer * c.middle(), doubts,
        Interval(*interface[1:]).times(answer.capacitance_f.middle()),
    )  # fmt: skip


def _other_prints(
    cells: Cells, eps: Mapping[str, float], width: float, factor: float
) -> tuple[list[float], list[str], bool]:
    """Capacitances of other ways to print it [F], why some have none, and True where one of these is a short."""
    first, *others = dict.fromkeys(cells.scenes.values())
    coarse = 2 * width if is_open(first) else width  # whole sensors take long
    values, doubts, unbounded = [], [], False
    for scene in others:
        rule = next(name for name, cell in cells.scenes.items() if cell == scene)
        try:
            values.append(capacitance(scene, eps, coarse).capacitance_f.middle() * cells.count * factor)
        except Unpredictable as error:
            unbounded |= cells.gap_mm.get(rule) == 0
            doubts.append(f"printed by the rule {rule!r} it has no capacitance: {error}")
    return values, doubts, unbounded


def _resistance(body: Body) -> tuple[dict[str, Bounds], list[str]]:
    """Of the electrodes that reach from end to end, and why another has none."""
    resistance, reasons = dict[str, Bounds](), list[str]()
    for end in stated.ENDS:
        try:
            resistance |= electrode_resistance(body, (end,))
        except OutOfRange as error:
            reasons.append(f"no resistance: {error}")
    return resistance, reasons


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


def _material_range(design: Design, scene: Scene, middle: float, interface: "Added") -> Interval:
    """The capacitance with every permittivity, and the interfaces, at both ends of their ranges [F].

    Ratios by the closed-form bounds of the cell, whose error mostly cancels.
    """
    ratios = [*permittivity_ratios(design, scene).values(), [end / interface.value for end in interface[1:]]]
    return Interval(middle * prod(low for low, _ in ratios), middle * prod(high for _, high in ratios))


def _interface_ratios(body: Body, gap: Sequence[MaterialValue], eps: Mapping[str, float], farad: float) -> "Added":
    r"""Capacitance with the interfaces of the film, over that of perfect ones: value, least and most [-].

    .. math:: 1 + \frac{g C}{\varepsilon_0 A} \le \frac{C}{C_g} \le 1 + \frac{\varepsilon g}{t}

    A thin gap g takes least where the field is even (Cauchy-Schwarz), and most where all of it is in the thinnest film
    t; of plates both are exact. The value is the middle of both.
    """
    if not gap:
        return Added(1.0, 1.0, 1.0)
    even = farad / (EPS0_F_PER_M * body.design.area_mm2 * M_PER_MM**2)
    film_mm = next(iter(body.cells.gap_mm.values()), inf)
    thinnest = eps[gap[0].material] / (film_mm * M_PER_MM) if film_mm else even
    usual, *ends = (
        [1 / max(1 + g * by, _LEAST_FILM) for by in (even, thinnest)]
        for g in (gap[0].value, *stated.spread(body.design, gap[0]))
    )
    return Added(sum(usual) / 2, min(map(min, ends)), max(map(max, ends)))


def _unchanged_rise(interface: "Added") -> Iterator[str]:
    """Doubt about the rise of C under a load: a gap in series changes it by the ratio by which it changes C."""
    if interface.value != 1:
        by = 100 * (interface.value - 1)
        yield f"sensitivity and resolutions are of perfect interfaces; the gap changes the rise of C by {by:+.2g} %"


def permittivity_ratios(design: Design, scene: Scene) -> dict[str, tuple[float, float]]:
    """Capacitance over that with the permittivity taken, at the lowest and the highest value of each material [-]."""
    values = stated.permittivities(design)
    eps = {v.material: v.value for v in values}
    usual = capacitance(scene, eps).capacitance_f.middle()
    ratios = {}
    for value in values:
        low, high = stated.spread(design, value)
        if high > _TOLD_APART * low:
            ends = (
                capacitance(scene, eps | {value.material: end}).capacitance_f.middle() / usual for end in (low, high)
            )
            ratios[value.material] = (next(ends), next(ends))
    return ratios


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
    from sensorgen.models.overlap import edge_fringe_f

    farad, ohm = (Added(*of) for of in stated.lead_ranges(body.design))
    p, gap_mm = body.design.params, next(iter(body.cells.gap_mm.values()), 0.0)
    if is_open(body.cells.first()) or not 0 < gap_mm < p.width_mm:
        return farad, ohm  # electrodes whose fringe is in the capacitance already
    eps = max(value.value for value in stated.permittivities(body.design))
    around, gap, across, high = (
        s * M_PER_MM for s in (2 * (p.length_mm + p.width_mm), gap_mm, p.width_mm, p.electrode_mm)
    )
    return farad._replace(most=farad.most + edge_fringe_f(around, gap, across, high, eps)), ohm
