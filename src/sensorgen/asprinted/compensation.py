"""Compensation: parameters changed so that the print has the requested dimensions."""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

from sensorgen.checks.widths import GAP_CLOSES
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import Design, fields, make, name_of
from sensorgen.scene.scene import SLIVER_MM

BAKE = 0.2  # what the bake takes off in the plane (thesis 6.2)
_STEP_MM = 0.05  # by which a period grows
_ENOUGH = 6.0  # periods to estimate a gap with
_MARGIN = 1.04  # by which a tip is wider than what just prints: at the limit itself a slicer may round it away
_MOST = 5.0  # times the period


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
        yield Facts(tuple((f"  {c.what}", f"{c.before:g} -> {c.after:g}: {c.why}") for c in changes))
        yield ""


def compensated(design: Design, walls: str = "arachne", *, bake: bool = False) -> tuple[Design, list[Change]]:
    """The design to print so that the requested one results, and what differs.

    Heights become whole layers, strips narrower than a line a line, gaps that would close gaps that stay open. The
    electrode gap as printed becomes the requested one by a thinner film, where cogs lose their tips and the film is
    thick enough, else by a longer period with wider tips.

    Parameters
    ----------
    design : Design
        As requested.
    walls : str
        One of :data:`sensorgen.checks.estimate.RULES`.
    bake : bool
        Also enlarge by what the bake shrinks, where the design gives no shrinkage.

    Raises
    ------
    UnknownName
        No such walls.
    """
    changes: list[Change] = []
    now = design
    if bake and not design.shrinkage:
        now = _with(now, shrinkage=BAKE)
        changes.append(Change("shrinkage", 0.0, BAKE, "the bake takes it off in the plane"))
    for name, value, why in _steps(now):
        changes.append(Change(name, getattr(now.params, name), value, why))
        now = _with(now, **{name: value})
    from sensorgen.asprinted.printed import drawn_gap_mm  # a design without changes loads no print

    asked, before = drawn_gap_mm(now), _printed_gap_mm(now, walls)
    now, moved = _gap_kept(now, asked, before, walls)
    after = _printed_gap_mm(now, walls)
    if moved or abs(after - asked) > SLIVER_MM:
        why = f"{asked:g} mm asked" + ("" if abs(after - asked) < SLIVER_MM else ": NOT KEPT")
        moved.append(Change("electrode gap as printed [mm]", before, after, why))
    return now, changes + moved


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
        if not _levels(design) <= _levels(nudged):  # a face has moved up or down: a cut at the end only adds levels
            whole = max(round(value / layer), 1) * layer
            if abs(whole - value) > SLIVER_MM:
                yield name, round(whole, 9), f"whole layers of {layer:g} mm"
        elif name.endswith("_width_mm"):
            is_material = _share(nudged) > _share(design)
            least = design.machine.line_mm() if is_material else GAP_CLOSES * design.machine.nozzle_mm
            if value * larger < least - SLIVER_MM:
                yield name, round(least / larger, 9), "one line" if is_material else "a gap that stays open"


def _levels(design: Design) -> set[float]:
    """Heights of all faces and corners [mm]."""
    prisms = (p for b in design.drawn.bodies for p in b.prisms)
    return {round(z, 6) for p in prisms for z in (p.span("z") if p.axis == "z" else (z for _, z in p.outline))}


def _share(design: Design) -> float:
    """Share of whole periods that is filled [-]."""
    period = float(getattr(design.params, "period_mm", 1.0))
    whole = _with(design, length_mm=_ENOUGH * period, width_mm=_ENOUGH * period)
    x, y, z = whole.drawn.size_mm
    return sum(b.volume_mm3() for b in whole.in_use.bodies) / (x * y * z)


def _printed_gap_mm(design: Design, walls: str) -> float:
    """Electrode gap as estimated, of a few periods [mm]."""
    enough = _ENOUGH * float(getattr(design.params, "period_mm", 1.0))
    sides = {name: min(getattr(design.params, name), max(enough, 1.0)) for name in ("length_mm", "width_mm")}
    few = _with(design, **sides)
    from sensorgen.asprinted.printed import body

    return body(few, walls=walls).gap_mm[0]


def _gap_kept(design: Design, asked: float, printed: float, walls: str) -> tuple[Design, list[Change]]:
    """The design whose printed gap is the asked one, by the film or by the period; itself where neither does it."""
    lost = printed - asked
    if lost <= SLIVER_MM or lost == float("inf"):
        return design, []
    film = getattr(design.params, "dielectric_mm", 0.0)
    if film - lost > design.layers.layer_mm - SLIVER_MM:
        thinner = _with(design, dielectric_mm=film - lost)
        if abs(_printed_gap_mm(thinner, walls) - asked) < SLIVER_MM:
            why = f"the cogs' lowest {lost:g} mm are not printed"
            return thinner, [Change("dielectric_mm", film, round(film - lost, 9), why)]
    if "period_mm" not in fields(design.shape):
        return design, []
    # The shortest period whose tips are wide enough to print, and would be with less.
    period = design.params.period_mm  # type: ignore[attr-defined]

    def keeps(steps: int) -> bool:
        try:
            with_less = _with(design, period_mm=(period + steps * _STEP_MM) / _MARGIN)
            return abs(_printed_gap_mm(with_less, walls) - asked) < SLIVER_MM
        except SensorgenError:
            return False  # so long that the shape refuses it

    most = int(period * (_MOST - 1) / _STEP_MM)
    if not keeps(most):
        return design, []
    steps = bisect_left(range(most), True, key=keeps)  # the longer the period, the wider the tips
    longer = round(period + steps * _STEP_MM, 9)
    return _with(design, period_mm=longer), [Change("period_mm", period, longer, "tips wide enough to print")]
