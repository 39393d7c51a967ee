"""Compensation: parameters changed until the print has the electrode gap and the capacitance that were asked for.

Asked for, its stiffness too: the pressure per displacement of its top.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict
from functools import partial
from math import ceil, copysign, exp, floor, inf, log, prod
from typing import Any

from sensorgen.checks.review import review
from sensorgen.checks.widths import GAP_CLOSES
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make, name_of
from sensorgen.design.printer import load_quality, quality_names
from sensorgen.prediction import bodies
from sensorgen.scene.scene import SLIVER_MM
from sensorgen.workflows import moves
from sensorgen.workflows.moves import Candidate, Key, Nearest
from sensorgen.workflows.trial import Adjustment

BAKE = 0.2  # what the bake takes off in the plane (thesis 6.2)
FILM_LAYERS = 2  # of a film at least: through one layer leads every slit between two lines
GAP, CAPACITANCE, STIFFNESS = "gap_mm", "capacitance_pf", "stiffness_kpa_per_mm"
UNITS = {GAP: "mm", CAPACITANCE: "pF", STIFFNESS: "kPa/mm"}
WITHIN = {GAP: 0.03, CAPACITANCE: 0.02, STIFFNESS: 0.1}  # relative errors; whole layers leave few stiffnesses
ESTIMATE_WITHIN = WITHIN | {CAPACITANCE: 0.01}  # of a changed design before it is sliced
PERIOD = ("parameters", "period_mm")
PRESSURE_PA = 80e3  # 8 N on 10 x 10 mm: under which a stiffness is meant
FARTHEST = 2.0  # distance of a change, as of moves.distance [-]
MOST_SLICES = 6  # besides that of the design that was asked for
_MARGIN = 1.04  # by which strips may differ without another gap: at the limit a slicer may print or drop a layer
_STEP = log(1.12)  # from one width or period to the next, in logarithms
_SHARES = (log(0.5), log(5.0))  # of its own value, that a width or a period may take, in logarithms
_LEAST_STEP, _LONGEST_STEP = 0.05, 0.3  # to a width that a capacitance leads to, in logarithms
_STEEPEST = 5.0  # power of a width or period that a capacitance may follow; steeper, lines come or go [-]
_ACCURACY = 1e-2  # of a capacitance, relative
_MOST_TRIED, _MOST_SOLVED = 800, 60  # designs whose gap, and whose capacitance is found, before it gives up
_MOST_PRESSED = 12  # designs whose stiffness is found
_PERIODS = 4  # of a sensor by which prints are estimated

BodyOf = Callable[[Design], Body]
Quantities = Mapping[str, float]  # those of UNITS that are known


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
    asked = quantities(design, bodies.drawn, stiffness=stiffness)
    now, changes = printable(design, walls, bake=bake, gap_mm=asked[GAP])
    if not 0 < asked[GAP] < inf:
        return now, changes
    wanted = dict(asked) | {GAP: _attainable_mm(now, asked[GAP])}
    is_near = abs(_off(wanted, asked, GAP)) <= WITHIN[GAP]
    search = CompensationSearch(now, wanted, walls, sliced if is_near else None, step)
    search.run(search.changed({}))
    after = search.best or search.nearest()
    made, printed = moves.changed(now, after.values), search.quantities(after)
    if not is_near:  # the nearest alone is sliced
        printed = quantities(made, sliced, stiffness=stiffness) if sliced else printed
        layers = f"{FILM_LAYERS} layers at least, {wanted[GAP]:g} mm at layers of {now.layers.layer_mm:g} mm"
        raise _refused(f": a film has {layers}", design, made, printed, asked)
    if search.best is None:
        raise _refused(f" of {design.name} by {walls} walls{search.fault()}", design, made, printed, asked)
    why = "gap, capacitance and stiffness" if stiffness else "gap and capacitance"
    changes += [Adjustment(key[-1], _own(now, key), float(value), why) for key, value in after.values.items()]
    if not changes:
        return now, []
    before = _before(design, sliced, walls, stiffness=stiffness)
    return _named(made, design), [*changes, *_comes_out(before, printed, asked)]


def _before(design: Design, sliced: BodyOf | None, walls: str, *, stiffness: bool) -> Quantities:
    """Quantities of the print of what was asked for; none where they are not known."""
    by_rules = partial(bodies.estimated, walls=walls)
    try:
        return quantities(design, sliced or by_rules, stiffness=stiffness, few_periods=not sliced)
    except SensorgenError:
        return {}


def _comes_out(before: Quantities, after: Quantities, asked: Quantities) -> Iterator[Adjustment]:
    """Quantities of the print before and after all changes."""
    for key, name in ((GAP, "electrode gap"), (CAPACITANCE, "capacitance"), (STIFFNESS, "stiffness")):
        if key in before and key in after and key in asked:
            what, why = f"{name} as printed [{UNITS[key]}]", f"{asked[key]:.4g} {UNITS[key]} asked"
            yield Adjustment(what, before[key], after[key], why)


def _named(changed: Design, design: Design) -> Design:
    """The changed design with a name of its own: that of the first and what was done, or made of its values."""
    if changed == design:
        return design
    own = design.name != name_of(design)
    data = changed.model_dump(mode="json", exclude_unset=True, exclude={"name"})
    return make(data | ({"name": design.name.removesuffix("-compensated")[:88] + "-compensated"} if own else {}))


def words(quantities: Quantities) -> str:
    """Quantities in words."""
    *most, last = [f"{'a gap of ' * (key == GAP)}{value:.3g} {UNITS[key]}" for key, value in quantities.items()]
    return " and ".join([", ".join(most), last]) if most else last


def _refused(why: str, design: Design, nearest: Design, printed: Quantities, asked: Quantities) -> OutOfRange:
    """The refusal, with the nearest print, what makes it and what it costs."""
    old, new = (asdict(each.params) | {"quality": each.quality} for each in (design, nearest))
    values = ", ".join(f"{k} {v if isinstance(v, str) else f'{v:.4g}'}" for k, v in new.items() if v != old[k])
    errors = [
        f"; its {name} is off by {exp(_off(printed, asked, key)) - 1:+.0%}"
        for key, name in ((GAP, "gap"), (CAPACITANCE, "capacitance")) if key in printed
    ]  # fmt: skip
    layers = [len(one.layers.boundaries_mm(one.printed.size_mm[2])) - 1 for one in (design, nearest)]
    by = values or "the design as it is"
    best = f"{words(printed)} by {by}{''.join(errors)}; {layers[1]} layers for {layers[0]}"
    return OutOfRange(f"{words(asked)} cannot be printed{why}; nearest: {best}")


def _off(quantities: Quantities, asked: Quantities, key: str) -> float:
    """Ln of a quantity over the one asked for; 0 where none is asked for, infinite where there is none."""
    if key not in asked:
        return 0.0
    return log(quantities[key] / asked[key]) if key in quantities else inf


def _own(design: Design, key: Key) -> float:
    return float(moves.own(design, key) or 0.0)


def quantities(
    design: Design, body: BodyOf, *, stiffness: bool = False, few_periods: bool = False
) -> Quantities:  # fmt: skip
    """Quantities of a design's body; of an array, of a few cells without rims, counted to all of its cells.

    Raises
    ------
    OutOfRange
        A stiffness is asked for that is not known: of a cell that is no cross-section, or that the solver gives up.
    """
    is_array = hasattr(design.params, "fitting")
    few = moves.short(design, periods=_PERIODS) if is_array or few_periods else design
    one = of_body(body(few), stiffness=stiffness)
    sizes = [p.fitting() if hasattr(p, "fitting") else (p.length_mm, p.width_mm) for p in (design.params, few.params)]
    larger = prod(sizes[0]) / prod(sizes[1])
    return {key: value * larger if key == CAPACITANCE else value for key, value in one.items()}


def of_body(body: Body, *, stiffness: bool = False) -> Quantities:
    """Gap, capacitance and, asked for, stiffness of a body, by its most likely cell; raises as :func:`quantities`."""
    from sensorgen.design.values import permittivities
    from sensorgen.prediction.capacitance import Unpredictable, capacitance
    from sensorgen.prediction.compression_law import at_a_few_pressures, gap_m
    from sensorgen.prediction.mesh_ladder import PressedPiece

    cells, eps = body.cells, {v.material: v.value for v in permittivities(body.design)}
    one = {GAP: next(iter(cells.gap_mm.values()))}
    try:
        answer = capacitance(cells.first(), eps, _ACCURACY)
    except Unpredictable:
        return one
    one[CAPACITANCE] = answer.times(cells.count).capacitance_f.middle() * 1e12
    if not stiffness:
        return one
    law = at_a_few_pressures(body.design, PressedPiece(cells.first(), cells.period_mm), answer, PRESSURE_PA)
    if law is None:
        raise OutOfRange(
            f"{body.design.name}: its stiffness is not known without solving it in 3D, or not at all; "
            "--compensate print keeps gap and capacitance"
        )
    return one | {STIFFNESS: law.compression.foundation_stiffness_pa_per_m(gap_m(cells.first())) * 1e-6}


def _has_whole_periods(one: Candidate) -> bool:
    """Test whether a design was cut to whole periods, of which there are few: no finer steps."""
    return one.before is not None and bool(one.before.discarded)


class CompensationSearch(Nearest):
    """The nearest change whose print is the wanted one: heights in whole layers, and one width or the period.

    Prints are estimated, and where estimates are as wanted, sliced; slices correct what is wanted of estimates.
    """

    def __init__(
        self, design: Design, wanted: Quantities, walls: str, sliced: BodyOf | None, step: Callable[[str], None]
    ) -> None:  # fmt: skip
        super().__init__(design, FARTHEST)
        self.wanted, self.walls, self.body_of, self.step = wanted, walls, sliced or bodies.drawn, step
        self.aim = dict(wanted)  # of estimates
        self.margin = _MARGIN  # factor by which the width or period may shrink or grow without another gap
        self.widths = _widths(design, walls)
        self.estimates: dict[Candidate, Quantities] = {}
        self.prints: dict[Candidate, Quantities] = {}
        self.best: Candidate | None = None
        self.pressed = 0
        self.works = [self._at_rest, self._checked, *[self._sliced] * bool(sliced)]
        self.works[1:1] = [self._pressed] * (STIFFNESS in wanted)

    def quantities(self, one: Candidate) -> Quantities:
        """Those of its print, where it was sliced, or of its estimate."""
        return self.prints.get(one) or self.estimates[one]

    def nearest(self) -> Candidate:
        """The design whose print is nearest to the wanted one, of those that no rule refuses."""

        def distance(one: Candidate) -> tuple[float, float]:
            gap, *others = (abs(_off(self.quantities(one), self.wanted, key)) for key in UNITS)
            return round(gap, 6), sum(others)

        return min(self.prints or (one for one in self.estimates if not one.discarded), key=distance)

    def fault(self) -> str:
        """Reason of the first design that a rule refuses, in words."""
        return next((f" without an error ({one.discarded})" for one in self.estimates if one.discarded), "")

    def order(self, one: Candidate) -> tuple[float, ...]:
        """Distance and half of what the capacitance was off before; half way of a width that it leads to."""
        far, done = super().order(one)
        off = self._capacitance_off(one.before) if one.before else None
        if one.before and off is not None and self._width(one):
            far = (far + one.before.distance) / 2
        return far + abs(off or 0.0) / 2, done

    def is_over(self) -> bool:
        """Test whether the wanted print, or nothing after many tries, was found."""
        solved = sum(CAPACITANCE in one for one in self.estimates.values())
        most = len(self.estimates) > _MOST_TRIED or solved > _MOST_SOLVED or self.pressed > _MOST_PRESSED
        return self.best is not None or most or len(self.prints) >= MOST_SLICES

    def work(self, one: Candidate) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Gap and capacitance of an estimate, its stiffness, the print."""
        self.step(f"design {len(self.estimates)}")
        return self.works[one.stage], (one,)

    def take(self, one: Candidate, answer: Quantities) -> Iterable[Candidate]:
        """Go up with what is as wanted, and with the design as it was; from others on to their neighbours."""
        is_print = self.works[one.stage - 1] == self._sliced
        if one.discarded:
            return self._in_whole_periods(one)
        if is_print:
            self.prints[one] = answer
            self._correct(one)
        else:
            self.estimates[one] = answer
        is_reached = self._is_reached(one, answer)
        if one.stage < len(self.works) and (is_reached or not one.values):
            return [one]
        if is_reached:
            self.best = one
            return ()
        return self._neighbours(one) if is_print or not _has_whole_periods(one) else ()

    def _is_reached(self, one: Candidate, answer: Quantities) -> bool:
        """Test whether a print, or the first estimate, is as wanted, others as estimates of wanted prints are."""
        is_exact = one in self.prints or not one.values
        aim = self.wanted if is_exact else self.aim
        within = WITHIN if is_exact or _has_whole_periods(one) else ESTIMATE_WITHIN
        keys = list(aim) if one.stage > 1 else [GAP, CAPACITANCE]
        return all(abs(_off(answer, aim, key)) <= within[key] for key in keys)

    def _at_rest(self, one: Candidate) -> Quantities:
        """Gap with the margin, and the capacitance where that is the wanted one; nothing of what cannot be made."""
        widths = {key: float(value) for key, value in one.values.items() if key in self.widths}
        try:
            for factor in (1.0, 1.0 / self.margin, self.margin) if widths else (1.0,):
                near = {key: value * factor for key, value in widths.items()}
                gap = _gap_mm(moves.short(self.base, {**one.values, **near}, _PERIODS), self.walls)
                if abs(gap - self.wanted[GAP]) > SLIVER_MM:
                    return {GAP: gap}
            return self._estimate(one)
        except SensorgenError:
            return {}

    def _pressed(self, one: Candidate) -> Quantities:
        """Stiffness too, unless the solver gives up."""
        self.pressed += 1
        try:
            return self._estimate(one, stiffness=True)
        except SensorgenError:
            return self.estimates[one]

    def _estimate(self, one: Candidate, *, stiffness: bool = False) -> Quantities:
        """Quantities of the print of a few periods by the rules of slicers, counted to the whole sensor."""
        by_rules = partial(bodies.estimated, walls=self.walls)
        return quantities(moves.changed(self.base, one.values), by_rules, stiffness=stiffness, few_periods=True)

    def _checked(self, one: Candidate) -> Quantities:
        """Those of its estimate, where no rule refuses it that lets whole periods of the first design pass.

        Of an array, whose cells are whole, a few are looked at.
        """
        cut = moves.short if hasattr(self.base.params, "fitting") else moves.changed
        errors = review(cut(self.base, one.values), walls=self.walls).errors() if one.values else []
        passed = {f.rule for f in review(moves.short(self.base), walls=self.walls).errors()} if errors else set()
        one.discard(next((f"{f.rule}, {f.message}" for f in errors if f.rule not in passed), ""))
        return self.estimates[one]

    def _in_whole_periods(self, one: Candidate) -> Iterator[Candidate]:
        """A candidate with whole numbers of periods along a side: the rest of one at the end may be a sliver in air."""
        for side_mm in (self.base.params.length_mm, self.base.params.width_mm) if PERIOD in self.widths else ():
            count = side_mm / float(one.values.get(PERIOD, _own(self.base, PERIOD)))
            for whole in {floor(count), ceil(count)} - {0}:
                if abs(log(count / whole)) < _LEAST_STEP:
                    yield from self.changed({**one.values, PERIOD: side_mm / whole}, one)

    def _sliced(self, one: Candidate) -> Quantities:
        """Those of a real print."""
        return quantities(moves.changed(self.base, one.values), self.body_of, stiffness=STIFFNESS in self.wanted)

    def _correct(self, one: Candidate) -> None:
        """Correct what is wanted of estimates by a print; where its gap is another one, the margin."""
        estimate, real = self.estimates[one], self.prints[one]
        if abs(real[GAP] - estimate.get(GAP, inf)) > SLIVER_MM:
            self.margin *= _MARGIN**2 if one.values else 1.0
            return
        for key in (CAPACITANCE, STIFFNESS):
            if key in self.wanted and key in estimate and key in real:
                self.aim[key] = self.wanted[key] * estimate[key] / real[key]

    def _neighbours(self, one: Candidate) -> Iterator[Candidate]:
        """Heights by a layer and the first steps of each width; of a changed width the next steps."""
        width = self._width(one)
        if width is None and GAP in self.estimates[one]:
            yield from self._heights(one)
        for key in [width] if width else self.widths * (GAP in self.estimates[one]):
            for share in self._shares(one, key):
                if _SHARES[0] <= share <= _SHARES[1]:
                    value = round(_own(self.base, key) * exp(share), 3)
                    yield from self.changed({**one.values, key: value}, one)

    def _width(self, one: Candidate) -> Key | None:
        """The width or period that is changed, if any."""
        return next((key for key in one.values if key in self.widths), None)

    def _heights(self, one: Candidate) -> Iterator[Candidate]:
        """One layer more or less; of the film at least two, and not above the wanted gap."""
        layer, film = self.base.layers.layer_mm, ("parameters", "dielectric_mm")
        least, most = FILM_LAYERS * layer - SLIVER_MM, self.wanted[GAP] + SLIVER_MM
        for key, to in moves.steps(moves.short(self.base, one.values, _PERIODS), ("film", "height")):
            if key != film or least <= float(to) <= most:
                yield from self.changed({**one.values, key: to}, one)

    def _capacitance_off(self, one: Candidate) -> float | None:
        """Ln of an estimated capacitance over that aimed at; None where the gap is not the wanted one."""
        known, gap = self.estimates[one], self.quantities(one).get(GAP, inf)
        if CAPACITANCE not in known or abs(gap - self.wanted[GAP]) > SLIVER_MM:
            return None
        return _off(known, self.aim, CAPACITANCE)

    def _share(self, one: Candidate, key: Key) -> float:
        """Ln of a width over that of the design as it was."""
        return log(float(one.values[key]) / _own(self.base, key)) if key in one.values else 0.0

    def _shares(self, one: Candidate, key: Key) -> Iterator[float]:
        """Shares to try next: wider where the gap is too large, and onwards; where it is right, by the secant."""
        share, off = self._share(one, key), self._capacitance_off(one)
        before = one.before if one.before and self._width(one) else one
        start, was = self._share(before, key), self._capacitance_off(before)
        if off is None:
            yield share + copysign(_STEP, share - start or self.quantities(one)[GAP] - self.wanted[GAP])
            yield from () if was is None or self._width(before) else (2 * start - share,)  # led away by the first step
        elif before is one:
            yield share + max(abs(off), _LEAST_STEP)
        elif was is None:
            yield from (share + off, share - off)
        elif 0 < abs(power := (off - was) / (share - start)) <= _STEEPEST:
            yield share + max(-_LONGEST_STEP, min(-off / power, _LONGEST_STEP))


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
    if not 0 < gap_mm < inf or abs(_attainable_mm(design, gap_mm) - gap_mm) <= WITHIN[GAP] * gap_mm:
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
