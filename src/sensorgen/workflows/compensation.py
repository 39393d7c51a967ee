"""Compensation: parameters changed until the print has the electrode gap and the capacitance that were asked for.

Asked for, its stiffness too: the pressure per displacement of its top.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from math import inf, log

from sensorgen.checks.widths import GAP_CLOSES
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make, name_of
from sensorgen.scene.scene import SLIVER_MM, Envelope
from sensorgen.workflows.moves import levels

BAKE = 0.2  # what the bake takes off in the plane (thesis 6.2)
MOST_SLICES = 10  # with that of the design as it was, and the last one, which is written
FILM_LAYERS = 2  # of a film at least: through one layer leads every slit between two lines
WITHIN = 0.02  # relative error of the capacitance that ends the search
STIFFNESS_WITHIN = 0.1  # the same of the stiffness, which whole layers leave few values
PRESSURE_PA = 80e3  # 8 N on 10 x 10 mm: under which a stiffness is meant
_ENOUGH = 6.0  # periods to estimate a print with
_MARGIN = 1.04  # by which strips may be narrower without a layer less: at the limit itself a slicer may drop it
_LAYERS = 3  # by which a height may change
_STEP = 1.12  # from one width or period to the next
_SHARES = (0.5, 5.0)  # of its own value, that a width or a period may take
_ACCURACY = 1e-2  # of a capacitance, relative
_HALVINGS = 12  # of a step between two widths
_MOST_TRIED, _MOST_SOLVED = 300, 60  # designs whose gap, and whose capacitance is found, before it gives up
_MOST_PRESSED = 12  # designs whose stiffness is found

Slice = Callable[[Design], Body]
_Values = tuple[tuple[str, float], ...]  # of parameters, by their names


@dataclass(frozen=True)
class Change:
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


def document(changes: Sequence[Change]) -> Iterator[Part]:
    """What was changed, if anything."""
    if changes:
        yield "compensated for the print:"
        yield Facts(tuple((f"  {c.what}", f"{c.before:.4g} -> {c.after:.4g}: {c.why}") for c in changes))
        yield ""


@dataclass(frozen=True)
class Found:
    """A design with its electrode gap [mm], capacitance [pF] and stiffness [kPa/mm]; None where it has none."""

    design: Design
    gap_mm: float
    capacitance_pf: float | None
    stiffness_kpa_per_mm: float | None = None

    def off(self, asked: "Found") -> float:
        """Ln of the capacitance over the one asked for; 0 where none is asked for, infinite where there is none."""
        return _off(self.capacitance_pf, asked.capacitance_pf)

    def stiffer(self, asked: "Found") -> float:
        """The same of the stiffness."""
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
    sliced: Slice | None = None,
    step: Callable[[str], None] = lambda _: None,
) -> tuple[Design, list[Change]]:
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
    now, changes = printable(design, bake=bake)
    from sensorgen.prediction.bodies import drawn

    asked = found(drawn(design), stiffness=stiffness)
    before = _estimate(now, walls, stiffness=stiffness) if sliced is None else found(sliced(now), stiffness=stiffness)
    wanted = replace(asked, design=now, gap_mm=_attainable_mm(now, asked.gap_mm))
    if not 0 < asked.gap_mm < inf:
        return now, changes
    after = before if _reached(before, wanted) else _searched(now, wanted, walls, sliced, step)
    if abs(wanted.gap_mm - asked.gap_mm) > now.layers.layer_mm / 2:
        layer = now.layers.layer_mm
        raise OutOfRange(
            f"{asked.words()} cannot be printed: a film has {FILM_LAYERS} layers at least, {FILM_LAYERS * layer:g} mm "
            f"at layers of {layer:g} mm; nearest: {_told(design, after)}"
        )
    if after is before:
        return now, changes
    old, new = asdict(now.params), asdict(after.design.params)
    why = "gap, capacitance and stiffness" if stiffness else "gap and capacitance"
    changes += [Change(name, old[name], new[name], why) for name in old if old[name] != new[name]]
    changes.append(Change("electrode gap as printed [mm]", before.gap_mm, after.gap_mm, f"{asked.gap_mm:g} mm asked"))
    if after.capacitance_pf and asked.capacitance_pf:
        was = before.capacitance_pf or 0.0
        changes.append(
            Change("capacitance as printed [pF]", was, after.capacitance_pf, f"{asked.capacitance_pf:.4g} pF asked")
        )
    if after.stiffness_kpa_per_mm and asked.stiffness_kpa_per_mm:
        was, why = before.stiffness_kpa_per_mm or 0.0, f"{asked.stiffness_kpa_per_mm:.4g} kPa/mm asked"
        changes.append(Change("stiffness as printed [kPa/mm]", was, after.stiffness_kpa_per_mm, why))
    return after.design, changes


def found(body: Body, *, stiffness: bool = False) -> Found:
    """Gap, capacitance and, asked for, stiffness of a body, by its most likely cell.

    Raises
    ------
    OutOfRange
        A stiffness is asked for that is not known: of a cell that is no cross-section, or that the solver gives up.
    """
    from sensorgen.design.values import permittivities
    from sensorgen.prediction.capacitance import Unpredictable, capacitance
    from sensorgen.prediction.compression_law import at_a_few_pressures, gap_m
    from sensorgen.prediction.mesh_ladder import Piece

    cells, eps = body.cells, {v.material: v.value for v in permittivities(body.design)}
    gap = next(iter(cells.gap_mm.values()))
    try:
        answer = capacitance(cells.first(), eps, _ACCURACY)
    except Unpredictable:
        return Found(body.design, gap, None)
    c = answer.times(cells.count).capacitance_f.middle() * 1e12
    if not stiffness:
        return Found(body.design, gap, c)
    law = at_a_few_pressures(body.design, Piece(cells.first(), cells.period_mm), answer, PRESSURE_PA)
    if law is None:
        raise OutOfRange(
            f"{body.design.name}: its stiffness is not known without solving it in 3D, or not at all; "
            "--compensate print keeps gap and capacitance"
        )
    pa_per_m = law.compression.foundation_stiffness_pa_per_m(gap_m(cells.first()))
    return Found(body.design, gap, c, pa_per_m * 1e-6)


def _reached(now: Found, wanted: Found) -> bool:
    near = abs(now.gap_mm - wanted.gap_mm) < wanted.design.layers.layer_mm / 4
    return near and abs(now.off(wanted)) <= WITHIN and abs(now.stiffer(wanted)) <= STIFFNESS_WITHIN


def _searched(
    design: Design, wanted: Found, walls: str, sliced: Slice | None, step: Callable[[str], None]
) -> Found:  # fmt: skip
    """The print that is wanted, by the estimate, or by slices that correct it in turn."""
    corrected, margin, nearest = wanted, _MARGIN, None
    for count in range(1, MOST_SLICES - 1):
        step(f"design {count}" if sliced else "designs")
        search = _Search(design, corrected, walls, margin)
        best = search.best
        if best is None:
            raise OutOfRange(
                f"{wanted.words()} cannot be printed of {design.name}, by the estimate for {walls} walls; nearest: "
                f"{_told(design, search.nearest)}"
            )
        stiff = wanted.stiffness_kpa_per_mm is not None
        real = best if sliced is None else found(sliced(best.design), stiffness=stiff)
        if nearest is None or _distance(real, wanted) < _distance(nearest, wanted):
            nearest = real
        if sliced is None or _reached(real, wanted):
            return real
        corrected = replace(
            wanted,
            capacitance_pf=_corrected(wanted.capacitance_pf, best.capacitance_pf, real.capacitance_pf),
            stiffness_kpa_per_mm=_corrected(
                wanted.stiffness_kpa_per_mm, best.stiffness_kpa_per_mm, real.stiffness_kpa_per_mm
            ),
        )
        if abs(real.gap_mm - best.gap_mm) > SLIVER_MM:
            margin *= _MARGIN**2
    raise OutOfRange(
        f"{wanted.words()} was not reached by {MOST_SLICES} slices of {design.name}; nearest: {_told(design, nearest)}"
    )


def _corrected(wanted: float | None, estimate: float | None, real: float | None) -> float | None:
    """What an estimate has to give so that the print gives what is wanted."""
    return wanted * estimate / real if wanted and estimate and real else wanted


def _distance(one: Found, wanted: Found) -> tuple[float, float]:
    return round(abs(one.gap_mm - wanted.gap_mm), 6), abs(one.off(wanted)) + abs(one.stiffer(wanted))


def _told(design: Design, nearest: Found | None) -> str:
    """The nearest print and what makes it."""
    if nearest is None:
        return "none"
    old, new = asdict(design.params), asdict(nearest.design.params)
    values = ", ".join(f"{name} {value:.4g}" for name, value in new.items() if value != old[name])
    return f"{nearest.words()} by {values or 'the design as it is'}"


@dataclass(eq=False)
class _Search:
    """Designs whose estimated print is the wanted one: heights in whole layers, and one width or the period.

    The margin is the factor by which the width or period may shrink without another gap.
    """

    design: Design
    wanted: Found
    walls: str
    margin: float
    tried: dict[_Values, Found | None] = field(default_factory=dict, init=False)
    pressed: list[Found] = field(default_factory=list, init=False)

    @cached_property
    def best(self) -> Found | None:
        """The one with the least changes."""
        best, least = None, inf
        for heights, moved in _heights(self.design, self.wanted.gap_mm):
            if moved >= least or self._exhausted():
                break
            for name in _widths(self.design):
                for way in (_STEP, 1 / _STEP):
                    hit, further = self._along(heights, name, way, least - moved)
                    if hit and self._stiff_enough(hit):
                        best, least = hit, moved + further
        if best is None and self.nearest and _reached(self.nearest, self.wanted):
            best = self.nearest
        return next((one for one in self.pressed if best and one.design == best.design), best)

    def _stiff_enough(self, hit: Found) -> bool:
        """Whether a print has the wanted stiffness too, where one is wanted."""
        if self.wanted.stiffness_kpa_per_mm is None:
            return True
        try:
            self.pressed.append(replace(_estimate(hit.design, self.walls, stiffness=True), gap_mm=hit.gap_mm))
        except SensorgenError:  # the solver gives up
            return False
        return abs(self.pressed[-1].stiffer(self.wanted)) <= STIFFNESS_WITHIN

    def _exhausted(self) -> bool:
        """Whether as many designs were tried as may be."""
        solved = sum(bool(one and one.capacitance_pf) for one in self.tried.values())
        return len(self.tried) > _MOST_TRIED or solved > _MOST_SOLVED or len(self.pressed) > _MOST_PRESSED

    @property
    def nearest(self) -> Found | None:
        """Of all that were tried, the one nearest to what is wanted."""
        found = self.pressed or [one for one in self.tried.values() if one]
        return min(found, key=lambda one: _distance(one, self.wanted), default=None)

    def _along(self, heights: dict[str, float], name: str, way: float, most: float) -> tuple[Found | None, float]:
        """The first print with the wanted capacitance on the way up or down from a width, and how far it is."""
        start, before = getattr(self.design.params, name), None
        share = 1.0
        while _SHARES[0] <= share <= _SHARES[1] and abs(log(share)) < most and not self._exhausted():
            here = self._at(heights | {name: start * share})
            if here and abs(here.off(self.wanted)) <= WITHIN / 2:
                return here, abs(log(share))
            if here and before and (here.off(self.wanted) > 0) != (before[1].off(self.wanted) > 0):
                hit = self._between(heights, name, before[0], start * share, before[1].off(self.wanted) > 0)
                if hit:
                    return hit, abs(log(share))
            before = (start * share, here) if here else None
            share *= way
        return None, inf

    def _between(self, heights: dict[str, float], name: str, low: float, high: float, above: bool) -> Found | None:
        for _ in range(_HALVINGS):
            middle = (low * high) ** 0.5
            here = self._at(heights | {name: middle})
            if here is None:
                return None
            if abs(here.off(self.wanted)) <= WITHIN / 4:
                return here
            low, high = (middle, high) if (here.off(self.wanted) > 0) == above else (low, middle)
        return None

    def _at(self, values: dict[str, float]) -> Found | None:
        """The estimate of a design with other values, if it has the wanted gap, with the margin."""
        key = tuple(sorted((name, round(value, 3)) for name, value in values.items()))
        if key not in self.tried:
            try:
                self.tried[key] = self._estimated(dict(key))
            except SensorgenError:  # such a design cannot be made
                self.tried[key] = None
        one = self.tried[key]
        return one if one and one.gap_mm == self.wanted.gap_mm and one.off(self.wanted) < inf else None

    def _estimated(self, values: dict[str, float]) -> Found:
        """Its gap with the margin; where that is the wanted one, the capacitance too."""
        narrower = {name: value / self.margin for name, value in values.items() if name in _widths(self.design)}
        design = _with(self.design, **values)
        gaps = {_gap_mm(each, self.walls) for each in (_with(self.design, **(values | narrower)), design)}
        if any(abs(gap - self.wanted.gap_mm) > SLIVER_MM for gap in gaps):
            return Found(design, max(gaps), None)
        return replace(_estimate(design, self.walls), gap_mm=self.wanted.gap_mm)


def _heights(design: Design, gap_mm: float) -> list[tuple[dict[str, float], float]]:
    """Films and one other height in whole layers, the least changes first, with their sum of ln(after / before)."""
    layer, params = design.layers.layer_mm, asdict(design.params)
    film = params.get("dielectric_mm", 0.0)
    films = [k * layer for k in range(FILM_LAYERS, round(gap_mm / layer) + 1)] if film else []
    others: list[dict[str, float]] = [{}]
    for name, value in _of_shape(design, "_height_mm"):
        others += [
            {name: value + k * layer} for k in range(-_LAYERS, _LAYERS + 1) if k and value + k * layer > layer / 2
        ]
    made = [other | ({"dielectric_mm": one} if film else {}) for other in others for one in films or [0.0]]
    return sorted(
        ((each, sum(abs(log(value / params[name])) for name, value in each.items())) for each in made),
        key=lambda pair: pair[1],
    )


def _widths(design: Design) -> list[str]:
    """Parameters in the plane that may change: the period, else the widths."""
    if hasattr(design.params, "period_mm"):
        return ["period_mm"]
    return [name for name, _ in _of_shape(design, "_width_mm")]


def _of_shape(design: Design, ending: str) -> list[tuple[str, float]]:
    """The shape's own parameters by the end of their names, those of 0 left out."""
    own = {name: value for name, value in asdict(design.params).items() if name not in asdict(Envelope())}
    return [(name, value) for name, value in own.items() if name.endswith(ending) and value]


def _attainable_mm(design: Design, gap_mm: float) -> float:
    """A gap in whole layers, of at least ``FILM_LAYERS`` where there is a film [mm]."""
    layer = design.layers.layer_mm
    least = FILM_LAYERS if getattr(design.params, "dielectric_mm", 0.0) else 1
    return round(max(round(gap_mm / layer), least) * layer, 9) if gap_mm < inf else gap_mm


def _estimate(design: Design, walls: str, *, stiffness: bool = False) -> Found:
    """Gap, capacitance and stiffness as estimated, from a few periods, counted to the whole sensor."""
    from sensorgen.prediction.bodies import estimated

    few = _few(design)
    one = found(estimated(few, walls), stiffness=stiffness)
    larger = design.params.length_mm * design.params.width_mm / (few.params.length_mm * few.params.width_mm)
    return replace(one, design=design, capacitance_pf=one.capacitance_pf and one.capacitance_pf * larger)


def _gap_mm(design: Design, walls: str) -> float:
    """Electrode gap as estimated, of a few periods [mm]: by far sooner than their unit cell is found."""
    from sensorgen.asprinted import printed

    return printed.gap_mm(printed.body(_few(design), walls=walls).scene.stretched(1.0 - design.shrinkage))


def _few(design: Design) -> Design:
    enough = _ENOUGH * float(getattr(design.params, "period_mm", 1.0))
    return _with(
        design, **{name: min(getattr(design.params, name), max(enough, 1.0)) for name in ("length_mm", "width_mm")}
    )


def printable(design: Design, *, bake: bool = False) -> tuple[Design, list[Change]]:
    """The design with heights in whole layers, widths that print, and larger by the bake; and what was changed."""
    changes: list[Change] = []
    now = design
    if bake and not design.shrinkage:
        now = _with(now, shrinkage=BAKE)
        changes.append(Change("shrinkage", 0.0, BAKE, "the bake takes it off in the plane"))
    for name, value, why in _steps(now):
        changes.append(Change(name, getattr(now.params, name), value, why))
        now = _with(now, **{name: value})
    return now, changes


def _with(design: Design, **changed: float) -> Design:
    """The design with other parameters or shrinkage."""
    data = design.model_dump(mode="json", exclude_unset=True)
    for name, value in changed.items():
        if name == "shrinkage":
            data["shrinkage"] = value
        else:
            data["parameters"] = data.get("parameters", {}) | {name: round(value, 9)}
    own = design.name != name_of(design)
    data["name"] = design.name.removesuffix("-compensated")[:88] + "-compensated" if own else ""
    return make({k: v for k, v in data.items() if k != "name" or v})


def _steps(design: Design) -> Iterator[tuple[str, float, str]]:
    """Heights off the layer grid and widths below what prints, with what they should be."""
    layer, larger = design.layers.layer_mm, 1.0 / (1.0 - design.shrinkage)
    for name, value in asdict(design.params).items():
        if not isinstance(value, float) or not value:
            continue
        try:
            nudged = _with(design, **{name: value * 1.01})
        except SensorgenError:
            continue
        if not levels(design) <= levels(nudged):  # a face has moved up or down: a cut at the end only adds levels
            whole = max(round(value / layer), 1) * layer
            if abs(whole - value) > SLIVER_MM:
                yield name, round(whole, 9), f"whole layers of {layer:g} mm"
        elif name.endswith("_width_mm"):
            is_material = _share(nudged) > _share(design)
            least = design.machine.line_mm() if is_material else GAP_CLOSES * design.machine.nozzle_mm
            if value * larger < least - SLIVER_MM:
                yield name, round(least / larger, 9), "one line" if is_material else "a gap that stays open"


def _share(design: Design) -> float:
    """Share of whole periods that is filled [-]."""
    period = float(getattr(design.params, "period_mm", 1.0))
    whole = _with(design, length_mm=_ENOUGH * period, width_mm=_ENOUGH * period)
    x, y, z = whole.drawn.size_mm
    return sum(b.volume_mm3() for b in whole.in_use.bodies) / (x * y * z)
