"""Settings of each tool, as numbers that the printer can do: the one source of every profile."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, get_args

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.design.design import Design, Infill
from sensorgen.design.materials import Material
from sensorgen.design.printer import Pattern, Printer, Quality
from sensorgen.design.profile import Profile
from sensorgen.export.slicers.versions import Version, template

if TYPE_CHECKING:
    from jinja2 import Environment

PATTERNS = get_args(Pattern)
MELTED = 0.95  # of the melt rate, that lines may take: slicers write five decimals, and lay some a little wider
TOWER_LINE = 1.25  # nozzles; PrusaSlicer 2.5 lays the first line of its tower at the speed of the prime before it
RETRACTION_SPEED_MM_S = 40.0  # PrusaSlicer's default; slower where the printer's extruder is


@dataclass(frozen=True)
class ToolLoad:
    """Material of a tool: the source of its numbers, and what the design overrides.

    ``profile`` is the design's, for all its tools.
    """

    material: Material
    source: str = ""
    infill_percent: float | None = None
    infill_pattern: str | None = None
    profile: Profile = field(default_factory=Profile)


def load(design: Design, name: str) -> ToolLoad:
    """Load of a material's tool for a design."""
    infill = design.infill.get(name, Infill())
    return ToolLoad(design.material(name), design.used()[name], infill.percent, infill.pattern, design.profile)


def loads(design: Design) -> dict[int, ToolLoad]:
    """Loads of a design, by the printer's own tool number."""
    return {design.tool(name): load(design, name) for name in design.used()}


@dataclass(frozen=True)
class Recipe:
    """Settings by which one tool prints its material: lengths [mm], temperatures [C], speeds [mm/s], shares [%]."""

    material: Material
    source: str
    nozzle_c: float
    bed_c: float
    speed_mm_s: float
    fan_percent: float
    infill_percent: float
    infill_pattern: str
    wall_lines: int
    flow_percent: float
    retraction_mm: float
    retraction_speed_mm_s: float
    line_mm: float
    infill_angle_deg: float | None

    @property
    def label(self) -> str:
        """Material and source."""
        return f"{self.material.name}@{self.source}" if self.source else self.material.name

    @property
    def slow_speed_mm_s(self) -> float:
        """Slowest speed of layers that must cool [mm/s]."""
        return min(10.0, self.speed_mm_s)


def recipe(printer: Printer, quality: Quality, tool: int, load: ToolLoad) -> Recipe:
    """Look up a load's numbers and hold them against the printer's limits.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    tool : int
        The printer's own number of the tool [-]; errors name it.
    load : ToolLoad
        What that tool prints.

    Raises
    ------
    MissingValue
        The material's file has no such value.
    OutOfRange
        The printer cannot do it, or the number means nothing.
    UnknownName
        No infill pattern goes by that name.
    """
    where, limits = f"{load.material.name} on tool {tool}", printer.max_speed_mm_s
    pattern = load.infill_pattern or quality.infill_pattern
    if pattern not in PATTERNS:
        raise UnknownName("infill pattern", pattern, PATTERNS)

    def value(quantity: str, what: str, low: float, high: float, own: float | None = None) -> float:
        try:
            number = load.material.value(quantity, load.source).value if own is None else own
        except MissingValue as error:
            advice = "add it under 'print' in the material's file, or load another material"
            raise MissingValue(f"tool {tool}: {error}; {advice}") from None
        return _between(where, what, number, low, high)

    walls = value("wall_lines", "walls [lines]", 1, 100, load.profile.wall_lines.get(load.material.name))
    if walls != round(walls):
        raise OutOfRange(f"{where}: walls [lines] is {walls:g}; expected a whole number")
    line_mm = load.profile.line_mm.get(load.material.name, printer.line_mm())
    flow_percent = value("flow_percent", "flow [%]", 10, 200)
    melted_mm3_s = MELTED * load.material.print_range("max_flow_mm3_s", 0.0)[1]
    most_mm2_s = melted_mm3_s / (max(quality.layer_mm, quality.first_layer_mm) * flow_percent / 100)
    return Recipe(
        material=load.material,
        source=load.source,
        nozzle_c=value("nozzle_temperature_c", "nozzle temperature [C]", 0, printer.max_nozzle_c),
        bed_c=value("bed_temperature_c", "bed temperature [C]", 0, printer.max_bed_c),
        speed_mm_s=min(value("speed_mm_s", "speed [mm/s]", 0.1, limits.xy), most_mm2_s / line_mm),
        fan_percent=value("fan_percent", "fan [%]", 0, 100),
        infill_percent=value("infill_percent", "infill [%]", 1, 100, load.infill_percent),
        infill_pattern=pattern,
        wall_lines=int(walls),
        flow_percent=flow_percent,
        retraction_mm=value("retraction_mm", "retraction [mm]", 0, 20),
        retraction_speed_mm_s=min(
            RETRACTION_SPEED_MM_S, limits.extruder, most_mm2_s / (TOWER_LINE * printer.nozzle_mm)
        ),
        line_mm=_between(where, "line width [mm]", line_mm, 0.5 * printer.nozzle_mm, 2 * printer.nozzle_mm),
        infill_angle_deg=load.profile.infill_angle_deg.get(load.material.name),
    )


def recipes(printer: Printer, quality: Quality, loads: Mapping[int, ToolLoad]) -> dict[int, Recipe]:
    """Recipe of each loaded tool under the slicer's number of it, which counts from 0.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    loads : mapping
        Load under the printer's own tool number [-].

    Raises
    ------
    BadInput
        No load, a tool that the printer does not have, or two bed temperatures: there is one bed.
    OutOfRange, MissingValue, UnknownName
        See :func:`recipe`; also where layers or travel are beyond the printer.
    """
    if not loads:
        raise BadInput("no tool is loaded: a profile needs at least one tool with a material")
    absent = sorted(set(loads) - set(printer.tool_numbers))
    if absent:
        raise BadInput(f"{printer.name} has no tool {absent[0]}; its tools are {list(printer.tool_numbers)}")
    _between(printer.name, "layer height [mm]", quality.layer_mm, printer.min_layer_mm, printer.nozzle_mm)
    _between(printer.name, "first layer height [mm]", quality.first_layer_mm, printer.min_layer_mm, printer.nozzle_mm)
    _between(quality.name, "travel speed [mm/s]", quality.travel_speed_mm_s, 1, printer.max_speed_mm_s.xy)
    by_tool = {tool: recipe(printer, quality, tool, loads[tool]) for tool in sorted(loads)}
    if any(load.profile != next(iter(loads.values())).profile for load in loads.values()):
        raise BadInput("one plate, two slicer profiles: give all its designs the same 'profile'")
    if len({r.bed_c for r in by_tool.values()}) > 1:
        each = ", ".join(f"{r.material.name} on tool {tool} {r.bed_c:g} C" for tool, r in by_tool.items())
        raise BadInput(f"one bed, two temperatures: {each}; name sources that agree, or print without one of them")
    return {printer.slicer_index(tool): by_tool[tool] for tool in sorted(by_tool, key=printer.slicer_index)}


def overlaid(text: str, settings: Mapping[str, str]) -> str:
    """A profile's lines ``key = value`` with other values, in place or at the end."""
    left = dict(settings)
    lines = []
    for line in text.splitlines():
        key = line.partition(" =")[0]
        lines.append(f"{key} = {left.pop(key)}" if key in left else line)
    return "\n".join([*lines, *(f"{key} = {value}" for key, value in left.items())]) + "\n"


def by_hand(material: Material) -> list[str]:
    """Settings by hand, in words: the extruder's cam dial, and drying."""
    notes = [f"Drying: {material.drying}"] if material.drying else []
    if "cam_dial" in material.print:
        notes.insert(0, f"Cam dial of the extruder: {number(material.value('cam_dial').value)}")
    return notes


def templates(slicer: str, version: Version, **filters: Callable[..., str]) -> "Environment":
    """The profile templates of a slicer, adapted to its version; ``n`` writes numbers."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(  # noqa: S701 - plain text; XML and JSON are escaped by filters
        loader=FunctionLoader(partial(template, slicer, version)), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters |= {"n": number, **filters}
    return environment


def line_area_mm2(quality: Quality, line_mm: float) -> float:
    """Cross-section of a line at its highest [mm2]: a rectangle with round sides.

    Times the speed it is the flow that keeps the tower, whose speed PrusaSlicer sets itself, as slow as
    the material asks.
    """
    height_mm = max(quality.layer_mm, quality.first_layer_mm)
    return height_mm * (line_mm - height_mm * (1 - math.pi / 4))


def number(value: float) -> str:
    """A number as profiles write it: as short as it is exact to a millionth [-]."""
    return f"{value:.6f}".rstrip("0").rstrip(".")


def _between(where: str, what: str, value: float, low: float, high: float) -> float:
    if not (math.isfinite(value) and low <= value <= high):
        raise OutOfRange(
            f"{where}: {what} is {value:g}; expected {low:g} to {high:g}: change it, or the printer's limit"
        )
    return value
