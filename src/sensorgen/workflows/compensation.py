"""Compensation: parameters changed until the print has the electrode gap and the capacitance that were asked for.

Asked for, its stiffness too: the pressure per displacement of its top.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from math import exp, inf, log, prod

from sensorgen.checks.widths import GAP_CLOSES
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make, name_of
from sensorgen.design.printer import load_quality, quality_names
from sensorgen.scene.scene import SLIVER_MM
from sensorgen.workflows import moves
from sensorgen.workflows.moves import Key, Value

BAKE = 0.2  # what the bake takes off in the plane (thesis 6.2)
MOST_SLICES = 6  # with that of the design as it was
FILM_LAYERS = 2  # of a film at least: through one layer leads every slit between two lines
GAP_WITHIN = 0.03  # relative error of the gap
WITHIN = 0.02  # of the capacitance, that ends the search
STIFFNESS_WITHIN = 0.1  # the same of the stiffness, which whole layers leave few values
PRESSURE_PA = 80e3  # 8 N on 10 x 10 mm: under which a stiffness is meant
FARTHEST = 1.2  # distance of changed heights, as of moves.distance [-]
_MARGIN = 1.04  # by which strips may be narrower without a layer less: at the limit itself a slicer may drop it
_STEP = log(1.12)  # from one width or period to the next, in logarithms
_SHARES = (log(0.5), log(5.0))  # of its own value, that a width or a period may take, in logarithms
_STIFFNESS = "stiffness_kpa_per_mm"
_ACCURACY = 1e-2  # of a capacitance, relative
_STEEPEST = 5.0  # power of a width or period that a capacitance may follow; steeper, lines come or go [-]
_MOST_TRIED, _MOST_SOLVED = 250, 30  # designs whose gap, and whose capacitance is found, before it gives up
_PERIODS = 4  # of a sensor by which prints are estimated
_MOST_PRESSED = 12  # designs whose stiffness is found

BodyOf = Callable[[Design], Body]
_Changes = dict[Key, Value]
_End = tuple[float, float]  # share, and ln of the capacitance over that asked


@dataclass(frozen=True)
class Adjustment:
    """One thing that was changed, or that comes out changed.

    Attributes
    ----------
    what : str
        Parameter, or what it does.
    before, after : float
        Values, in the unit that its name ends in.
    why : str
        In a few words.
    """

    what: str
    before: float
    after: float
    why: str


def document(changes: Sequence[Adjustment]) -> Iterator[Part]:
    """Changes, if any."""
    if changes:
        yield "compensated for the print:"
        yield Facts(tuple((f"  {c.what}", f"{c.before:.4g} -> {c.after:.4g}: {c.why}") for c in changes))
        yield ""


@dataclass(frozen=True)
class CompensatedDesign:
    """A design with its electrode gap [mm], capacitance [pF] and stiffness [kPa/mm]; None where it has none."""

    design: Design
    gap_mm: float
    capacitance_pf: float | None
    stiffness_kpa_per_mm: float | None = None

    def off(self, asked: "CompensatedDesign") -> float:
        """Ln of the capacitance over the one asked for; 0 where none is asked for, infinite where there is none."""
        return _off(self.capacitance_pf, asked.capacitance_pf)

    def stiffer(self, asked: "CompensatedDesign") -> float:
        """Ln of the stiffness over the one asked for, as of the capacitance."""
        return _off(self.stiffness_kpa_per_mm, asked.stiffness_kpa_per_mm)

    def words(self) -> str:
        """All in words."""
        parts = [f"a gap of {self.gap_mm:g} mm", *([f"{self.capacitance_pf:.3g} pF"] if self.capacitance_pf else [])]
        parts += [f"{self.stiffness_kpa_per_mm:.3g} kPa/mm"] if self.stiffness_kpa_per_mm else []
        return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]


def _off(value: float | None, asked: float | None) -> float:
    return 0.0 if asked is None else log(value / asked) if value else inf


def compensated(
    design: Design,
    walls: str = "arachne",
    *,
    bake: bool = False,
    stiffness: bool = False,
    sliced: BodyOf | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> tuple[Design, list[Adjustment]]:
    """The design to print so that the requested one results, and what differs.

    Heights become whole layers, strips narrower than a line a line, gaps that would close gaps that stay open. Then
    film, heights, and one width or the period change, by as little as can be, until the print has the gap (in whole
    layers) and the capacitance of the drawing.

    Parameters
    ----------
    design : Design
        As requested.
    walls : str
        One of :data:`sensorgen.checks.estimate.RULES`, by which prints are estimated.
    bake : bool
        Also enlarge by what the bake shrinks, where the design gives no shrinkage.
    stiffness : bool
        Also keep the stiffness of the drawing.
    sliced : callable, optional
        The print of a design by a real slicer, by which estimates are corrected, at most ``MOST_SLICES`` times; the
        estimate decides if not given.
    step : callable
        Called with what is tried next, for a progress display.

    Raises
    ------
    UnknownName
        No such walls.
    OutOfRange
        No design was found that is printed so; the message has the nearest. A stiffness that only 3D would give.
    """
    from sensorgen.prediction.bodies import drawn

    asked = _print(design, drawn, stiffness=stiffness)
    now, changes = printable(design, walls, bake=bake, gap_mm=asked.gap_mm)
    is_near = abs(_attainable_mm(now, asked.gap_mm) - asked.gap_mm) <= GAP_WITHIN * asked.gap_mm
    by_slice = sliced if is_near else None  # of what cannot be, the nearest alone is sliced
    before = _print(now, by_slice, stiffness=stiffness) if by_slice else _estimate(now, walls, stiffness=stiffness)
    if not 0 < asked.gap_mm < inf:
        return now, changes
    wanted = replace(asked, design=now, gap_mm=_attainable_mm(now, asked.gap_mm))
    after = before if _reached(before, wanted) else _searched(before, wanted, walls, by_slice, step)
    if sliced and not is_near:
        after = _print(after.design, sliced, stiffness=stiffness)
    if not (_reached(after, wanted) and is_near):
        layers = f"{FILM_LAYERS} layers at least, {wanted.gap_mm:g} mm at layers of {now.layers.layer_mm:g} mm"
        why = f" of {design.name} by {walls} walls" if is_near else f": a film has {layers}"
        raise OutOfRange(f"{asked.words()} cannot be printed{why}; nearest: {_nearest(design, after, asked)}")
    if after is before:
        return now, changes
    old, new = asdict(now.params), asdict(after.design.params)
    why = "gap, capacitance and stiffness" if stiffness else "gap and capacitance"
    changes += [Adjustment(name, old[name], new[name], why) for name in old if old[name] != new[name]]
    return _named(after.design, design), [*changes, *_comes_out(before, after, asked)]


def _comes_out(before: CompensatedDesign, after: CompensatedDesign, asked: CompensatedDesign) -> Iterator[Adjustment]:
    """Quantities of the print before and after all changes."""
    yield Adjustment("electrode gap as printed [mm]", before.gap_mm, after.gap_mm, f"{asked.gap_mm:g} mm asked")
    for name, unit in (("capacitance", "pF"), ("stiffness", "kPa/mm")):
        was, now, meant = (
            getattr(one, f"{name}_{unit.replace('/', '_per_').lower()}") for one in (before, after, asked)
        )
        if now and meant:
            yield Adjustment(f"{name} as printed [{unit}]", was or 0.0, now, f"{meant:.4g} {unit} asked")


def _named(changed: Design, design: Design) -> Design:
    """The changed design with a name of its own: that of the first and what was done, or made of its values."""
    if changed == design:
        return design
    own = design.name != name_of(design)
    data = changed.model_dump(mode="json", exclude_unset=True, exclude={"name"})
    return make(data | ({"name": design.name.removesuffix("-compensated")[:88] + "-compensated"} if own else {}))


def found(body: Body, *, stiffness: bool = False) -> CompensatedDesign:
    """Gap, capacitance and, asked for, stiffness of a body, by its most likely cell.

    Raises
    ------
    OutOfRange
        A stiffness is asked for that is not known: of a cell that is no cross-section, or that the solver gives up.
    """
    from sensorgen.design.values import permittivities
    from sensorgen.prediction.capacitance import Unpredictable, capacitance
    from sensorgen.prediction.compression_law import at_a_few_pressures, gap_m
    from sensorgen.prediction.mesh_ladder import PressedPiece

    cells, eps = body.cells, {v.material: v.value for v in permittivities(body.design)}
    gap = next(iter(cells.gap_mm.values()))
    try:
        answer = capacitance(cells.first(), eps, _ACCURACY)
    except Unpredictable:
        return CompensatedDesign(body.design, gap, None)
    c = answer.times(cells.count).capacitance_f.middle() * 1e12
    if not stiffness:
        return CompensatedDesign(body.design, gap, c)
    law = at_a_few_pressures(body.design, PressedPiece(cells.first(), cells.period_mm), answer, PRESSURE_PA)
    if law is None:
        raise OutOfRange(
            f"{body.design.name}: its stiffness is not known without solving it in 3D, or not at all; "
            "--compensate print keeps gap and capacitance"
        )
    pa_per_m = law.compression.foundation_stiffness_pa_per_m(gap_m(cells.first()))
    return CompensatedDesign(body.design, gap, c, pa_per_m * 1e-6)


def _reached(now: CompensatedDesign, wanted: CompensatedDesign) -> bool:
    near = abs(now.gap_mm - wanted.gap_mm) <= GAP_WITHIN * wanted.gap_mm
    return near and abs(now.off(wanted)) <= WITHIN and abs(now.stiffer(wanted)) <= STIFFNESS_WITHIN


def _searched(
    before: CompensatedDesign, wanted: CompensatedDesign, walls: str, sliced: BodyOf | None, step: Callable[[str], None]
) -> CompensatedDesign:  # fmt: skip
    """The print that is wanted, or the nearest: by the estimate, or by slices that correct it in turn."""
    search, nearest = _CompensationSearch(wanted, walls), before
    for count in range(1, MOST_SLICES):
        step(f"design {count}" if sliced else "designs")
        best = search.run()
        if best is None:
            break
        real = best if sliced is None else _print(best.design, sliced, stiffness=bool(wanted.stiffness_kpa_per_mm))
        nearest = min(nearest, real, key=lambda one: _distance(one, wanted))
        if nearest is not real or sliced is None or _reached(real, wanted):
            break
        pairs = {key: [getattr(one, key) for one in (wanted, best, real)] for key in ("capacitance_pf", _STIFFNESS)}
        search.wanted = replace(wanted, **{key: w * b / r for key, (w, b, r) in pairs.items() if w and b and r})
        if abs(real.gap_mm - best.gap_mm) > SLIVER_MM:
            search.margin *= _MARGIN**2
            search.tried.clear()
    return nearest


def _distance(one: CompensatedDesign, wanted: CompensatedDesign) -> tuple[float, float]:
    return round(abs(one.gap_mm - wanted.gap_mm), 6), abs(one.off(wanted)) + abs(one.stiffer(wanted))


def _nearest(design: Design, nearest: CompensatedDesign, asked: CompensatedDesign) -> str:
    """The nearest print, what makes it and what it costs."""
    old, new = (asdict(each.params) | {"quality": each.quality} for each in (design, nearest.design))
    values = ", ".join(f"{k} {v if isinstance(v, str) else f'{v:.4g}'}" for k, v in new.items() if v != old[k])
    off = f"; its gap is off by {nearest.gap_mm / asked.gap_mm - 1:+.0%}"
    off += f", its capacitance by {exp(nearest.off(asked)) - 1:+.0%}" if nearest.off(asked) < inf else ""
    layers = [len(one.layers.boundaries_mm(one.printed.size_mm[2])) - 1 for one in (design, nearest.design)]
    return f"{nearest.words()} by {values or 'the design as it is'}{off}; {layers[1]} layers for {layers[0]}"


@dataclass(eq=False)
class _CompensationSearch:
    """Designs whose estimated print is the wanted one: heights in whole layers, and one width or the period.

    The margin is the factor by which the width or period may shrink without another gap.
    """

    wanted: CompensatedDesign
    walls: str
    margin: float = _MARGIN
    best: CompensatedDesign | None = field(default=None, init=False)
    least: float = field(default=inf, init=False)
    tried: dict[frozenset[tuple[Key, Value]], CompensatedDesign | None] = field(default_factory=dict, init=False)
    pressed: list[CompensatedDesign] = field(default_factory=list, init=False)
    before: tuple[int, int] = field(default=(0, 0), init=False)

    def run(self) -> CompensatedDesign | None:
        """The wanted print with the least changes, else the nearest; estimates of a search before stay."""
        self.best, self.least, self.before = None, inf, self._count()
        self.pressed.clear()
        moves.walk(self.wanted.design, self.visit, FARTHEST)
        known = self.pressed or [one for one in self.tried.values() if one]
        return self.best or min(known, key=lambda one: _distance(one, self.wanted), default=None)

    @cached_property
    def widths(self) -> list[Key]:
        """Lengths in the plane that may change."""
        return _widths(self.wanted.design, self.walls)

    def visit(self, heights: moves.Changes, far: float) -> Iterable[tuple[Key, Value]] | None:
        """Try every width with these heights, and give the next heights; None where no further one can be better."""
        if far >= self.least or self._exhausted():
            return None
        try:
            now = moves.changed(self.wanted.design, heights)
        except SensorgenError:
            return ()
        for key in self.widths:
            for way in (_STEP, -_STEP):
                hit, further = self._along(dict(heights), key, way, self.least - far)
                if hit and (one := self._stiff_enough(hit)):
                    self.best, self.least = one, far + further
        layer, film = self.wanted.design.layers.layer_mm, ("parameters", "dielectric_mm")
        thick = (FILM_LAYERS * layer - SLIVER_MM, self.wanted.gap_mm + SLIVER_MM)
        return [
            (key, to)
            for key, to in moves.steps(now, ("film", "height"))
            if key != film or thick[0] <= float(to) <= thick[1]
        ]

    def _stiff_enough(self, hit: CompensatedDesign) -> CompensatedDesign | None:
        """A print with its stiffness, if it is the wanted one, where one is wanted."""
        if self.wanted.stiffness_kpa_per_mm is None:
            return hit
        try:
            one = replace(_estimate(hit.design, self.walls, stiffness=True), gap_mm=hit.gap_mm)
        except SensorgenError:  # the solver gives up
            return None
        self.pressed.append(one)
        return one if abs(one.stiffer(self.wanted)) <= STIFFNESS_WITHIN else None

    def _count(self) -> tuple[int, int]:
        """Designs whose gap, and whose capacitance is known [-]."""
        return len(self.tried), sum(bool(one and one.capacitance_pf) for one in self.tried.values())

    def _exhausted(self) -> bool:
        tried, solved = (now - then for now, then in zip(self._count(), self.before, strict=True))
        return tried > _MOST_TRIED or solved > _MOST_SOLVED or len(self.pressed) > _MOST_PRESSED

    def _along(self, heights: _Changes, key: Key, way: float, most: float) -> tuple[CompensatedDesign | None, float]:
        """The first print with the wanted capacitance on the way up or down from a width, and how far it is."""
        start, share = float(moves.own(self.wanted.design, key) or 0.0), 0.0
        before: tuple[float, CompensatedDesign] | None = None
        while _SHARES[0] <= share <= _SHARES[1] and abs(share) < most and not self._exhausted():
            here = self._at(heights | {key: start * exp(share)})
            if here and abs(here.off(self.wanted)) <= WITHIN / 2:
                return here, abs(share)
            if here and before:
                one, other = before[1].off(self.wanted), here.off(self.wanted)
                if (one > 0) != (other > 0):
                    return self._between(heights, key, start, (before[0], one), (share, other)), abs(share)
                if abs(other) > abs(one):  # the other way
                    break
            before = (share, here) if here else None
            share += way * (2 if here and abs(here.off(self.wanted)) > abs(3 * way) else 1)
        return None, inf

    def _between(self, heights: _Changes, key: Key, start: float, low: _End, high: _End) -> CompensatedDesign | None:
        """Regula falsi and halvings in turn, between values above and below the wanted one; None at a jump."""
        for half in (False, True) * 6:
            if abs(high[1] - low[1]) > _STEEPEST * abs(high[0] - low[0]):
                return None
            share = low[0] + (high[0] - low[0]) * (0.5 if half else low[1] / (low[1] - high[1]))
            here = self._at(heights | {key: start * exp(share)})
            if here is None or abs(here.off(self.wanted)) <= WITHIN / 4:
                return here
            middle = share, here.off(self.wanted)
            low, high = (middle, high) if (middle[1] > 0) == (low[1] > 0) else (low, middle)
        return None

    def _at(self, changes: _Changes) -> CompensatedDesign | None:
        """The estimate of a changed design, if it has the wanted gap, with the margin."""
        changes = {key: round(float(value), 3) for key, value in changes.items()}
        mark = frozenset(changes.items())
        if mark not in self.tried:
            try:
                self.tried[mark] = self._estimated(changes)
            except SensorgenError:  # such a design cannot be made
                self.tried[mark] = None
        one = self.tried[mark]
        return one if one and one.gap_mm == self.wanted.gap_mm and one.off(self.wanted) < inf else None

    def _estimated(self, changes: _Changes) -> CompensatedDesign:
        """Gap with the margin; where that is the wanted one, the capacitance too."""
        now = self.wanted.design
        narrower = {k: float(v) / self.margin for k, v in changes.items() if k in self.widths}
        for each in (changes, changes | narrower):
            gap = _gap_mm(moves.short(now, each, _PERIODS), self.walls)
            if abs(gap - self.wanted.gap_mm) > SLIVER_MM:
                return CompensatedDesign(moves.changed(now, changes), gap, None)
        return replace(_estimate(moves.changed(now, changes), self.walls), gap_mm=self.wanted.gap_mm)


def _widths(design: Design, walls: str) -> list[Key]:
    """Lengths in the plane that may change: no period of an array, nor, by Cura, strips whose lines would overlap."""
    names = [name for name, _, vertical in moves.lengths(design) if not vertical]
    is_array, is_cura = hasattr(design.params, "fitting"), walls.startswith("cura")
    return [
        ("parameters", name) for name in names
        if not (is_array and name == "period_mm")
        and not (is_cura and name.endswith("_width_mm") and _is_material(design, name))
    ]  # fmt: skip


def _attainable_mm(design: Design, gap_mm: float) -> float:
    """A gap in whole layers, of at least ``FILM_LAYERS`` where there is a film [mm]."""
    layer = design.layers.layer_mm
    least = FILM_LAYERS if getattr(design.params, "dielectric_mm", 0.0) else 1
    return round(max(round(gap_mm / layer), least) * layer, 9) if gap_mm < inf else gap_mm


def _print(design: Design, body: BodyOf, *, stiffness: bool = False) -> CompensatedDesign:
    """Quantities of a body; of an array, of a few cells without rims, counted to all of its cells."""
    is_array = hasattr(design.params, "fitting")
    few = moves.short(design, periods=_PERIODS) if is_array or isinstance(body, partial) else design
    one = found(body(few), stiffness=stiffness)
    params = design.params, few.params
    sizes = [p.fitting() if hasattr(p, "fitting") else (p.length_mm, p.width_mm) for p in params]
    larger = prod(sizes[0]) / prod(sizes[1])
    return replace(one, design=design, capacitance_pf=one.capacitance_pf and one.capacitance_pf * larger)


def _estimate(design: Design, walls: str, *, stiffness: bool = False) -> CompensatedDesign:
    """Quantities of the print of a few periods by the rules of slicers, counted to the whole sensor."""
    from sensorgen.prediction.bodies import estimated

    return _print(design, partial(estimated, walls=walls), stiffness=stiffness)


def _gap_mm(design: Design, walls: str) -> float:
    """Electrode gap as estimated, of a few periods [mm]: by far sooner than their unit cell is found."""
    from sensorgen.asprinted import printed

    return printed.gap_mm(printed.body(design, walls=walls).scene.stretched(1.0 - design.shrinkage))


def printable(
    design: Design, walls: str = "arachne", *, bake: bool = False, gap_mm: float = inf
) -> tuple[Design, list[Adjustment]]:
    """The design in layers that make up its gap, with widths that print, larger by the bake; and what was changed."""
    changes: list[Adjustment] = []
    now = design
    if bake and not design.shrinkage:
        now = moves.changed(now, {("shrinkage",): BAKE})
        changes.append(Adjustment("shrinkage", 0.0, BAKE, "the bake takes it off in the plane"))
    layer = _layer_mm(now, gap_mm)
    if layer != now.layers.layer_mm:
        changes.append(Adjustment("layers [mm]", now.layers.layer_mm, layer, "the gap in whole layers"))
        now = _in_layers(now, layer)
    for name, value, why in _steps(now, walls):
        changes.append(Adjustment(name, getattr(now.params, name), value, why))
        now = moves.changed(now, {("parameters", name): value})
    return _named(now, design), changes


def _layer_mm(design: Design, gap_mm: float) -> float:
    """Layer height nearest to the design's own with the gap in whole layers; the least where there is none [mm]."""
    own, machine = design.layers.layer_mm, design.machine
    if not 0 < gap_mm < inf or abs(_attainable_mm(design, gap_mm) - gap_mm) <= GAP_WITHIN * gap_mm:
        return own
    counts = range(FILM_LAYERS, int(gap_mm / machine.min_layer_mm + SLIVER_MM) + 1)
    fit = [one for n in counts if (one := round(gap_mm / n, 3)) <= 0.75 * machine.nozzle_mm]  # microns: Cura's grid
    return min(fit, key=lambda one: abs(log(one / own)), default=min(own, machine.min_layer_mm))


def _in_layers(design: Design, layer_mm: float) -> Design:
    """The design in other layers: by a quality that ships, or by its own with that height."""
    for name in quality_names():
        if load_quality(name).layer_mm == layer_mm:
            return moves.changed(design, {("quality",): name})
    name = f"{design.quality}-{layer_mm:g}"
    text = json.dumps(
        design.layers.model_dump(exclude={"name"}) | dict.fromkeys(("layer_mm", "first_layer_mm"), layer_mm)
    )
    return moves.changed(design, {("quality",): name, ("own", "qualities", name): text})


def _steps(design: Design, walls: str) -> Iterator[tuple[str, float, str]]:
    """Heights off the layer grid and widths below what prints, with what they should be."""
    layer, larger = design.layers.layer_mm, 1.0 / (1.0 - design.shrinkage)
    line = design.machine.line_mm() / larger
    for name, value, vertical in moves.lengths(design):
        to, why = value, ""
        if vertical:
            to, why = max(round(value / layer), 1) * layer, f"whole layers of {layer:g} mm"
        elif name.endswith("_width_mm") and not _is_material(design, name):
            to, why = max(value, GAP_CLOSES * design.machine.nozzle_mm / larger), "a gap that stays open"
        elif name.endswith("_width_mm"):
            to, why = max(value, line), "one line"
            if walls.startswith("cura"):  # it lays two lines one over the other
                to, why = max(round(value / line), 1) * line, "whole lines"
        if abs(to - value) > SLIVER_MM:
            yield name, round(to, 9), why


def _is_material(design: Design, name: str) -> bool:
    """True for a width of strips, with which the filled share of whole periods grows."""
    sides = ("parameters", "length_mm"), ("parameters", "width_mm")

    def share(one: Design) -> float:
        whole = moves.changed(one, dict.fromkeys(sides, moves.PERIODS * float(getattr(one.params, "period_mm", 1.0))))
        x, y, z = whole.drawn.size_mm
        return sum(b.volume_mm3() for b in whole.in_use.bodies) / (x * y * z)

    return share(moves.changed(design, {("parameters", name): 1.01 * getattr(design.params, name)})) > share(design)
