"""Printers and print qualities, read from data: tools, nozzle, layers, bed; and the place of the prime tower."""

import math
import os
import re
from dataclasses import dataclass
from functools import cache, lru_cache
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar, cast

from pydantic import Field, model_validator

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.records import Finite, Line, Positive, Strict, checked
from sensorgen.design import packs

Pattern = Literal["rectilinear", "grid", "concentric", "honeycomb", "triangles", "gyroid"]  # of infill
MacroName = Literal["tfree", "tpre", "tpost", "homeall", "bed"]


class MaxSpeed(Strict):
    """Fastest the axes may move [mm/s]."""

    xy: Positive
    z: Positive
    extruder: Positive


class Reach(Strict):
    """Reach of the axes, in the printer's own coordinates [mm]."""

    x: Annotated[tuple[Finite, Finite], Field(strict=False)]
    y: Annotated[tuple[Finite, Finite], Field(strict=False)]
    z: Annotated[tuple[Finite, Finite], Field(strict=False)]


class Macro(Strict):
    """Effect of a macro of the firmware, where its own lines are too many to state."""

    lift_mm: Finite = 0.0  # from where the nozzle was
    return_mm: Annotated[tuple[Finite | None, Finite | None, Finite | None] | None, Field(strict=False)] = None
    leaves: Literal["G90", "G91", "G90 M83", "G91 M83"] | None = None  # modes after it
    homes: Annotated[str, Field(pattern="^X?Y?Z?$", examples=["XYZ"])] = ""
    waits: bool = False  # for the tool's temperature

    def gcode(self) -> str:
        """G-code of the same effect; R2 is where the tool was taken, an axis without a return stays."""
        back = zip("XYZ", self.return_mm or (), strict=False)
        returns = " ".join(f"{axis}{offset:g}" for axis, offset in back if offset is not None)
        lines = [f"G91\nG1 Z{self.lift_mm:g}\nG90"] if self.lift_mm else []
        lines += [f"G1 R2 {returns}"] if returns else []
        lines += [f"G28 {' '.join(self.homes)}"] if self.homes else []
        return "\n".join([*lines, *(["M116"] if self.waits else []), *(self.leaves or "").split()])


class Control(Strict):
    """Effect of the printer's firmware and macros on G-code, where printers differ."""

    reach_mm: Reach | None = None  # the bed and the height, where nobody says
    spindles: Annotated[tuple[int, ...], Field(strict=False)] = ()  # tools that cut and do not print
    layer_fan: int | None = None  # number of the fan on the part; None where it needs none
    relative_e: bool = False  # absolute E is refused
    names_tools: bool = False  # temperatures without a tool are refused, and set by G10 P S R
    prime_macro: Line = ""  # changes tools, as tprime{tool}.g
    macros: Annotated[tuple[Line, ...], Field(strict=False)] = ()  # others that stand on the printer
    homes: Annotated[tuple[Line, ...], Field(strict=False)] = ("G28",)
    levels: Annotated[tuple[Line, ...], Field(strict=False)] = ()
    ends: Annotated[tuple[Line, ...], Field(strict=False)] = ()  # commands whose macro switches the heaters off
    coldest_c: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 150.0
    longest_purge_mm: Positive = 100.0  # of filament, at one place
    longest_retraction_mm: Positive = 100.0  # in all; beyond it filament leaves the hot end
    standby_c: Positive | None = None  # of a tool that waits; None: as hot as when it prints
    preheat_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    tool_offsets_mm: dict[Annotated[int, Field(strict=False)], Finite] = Field(default={})  # baby steps per tool, M290
    firmware_retraction: bool = False  # G10 and G11 instead of moves of E
    commands: dict[str, Line | None] = Field(default={})  # that a print may send, beside its firmware's; null: not

    def added(self) -> set[str]:
        """Commands beside the firmware's that a print may send."""
        return {command for command, words in self.commands.items() if words is not None}


class Printer(Strict):
    """A multi-tool printer; ``tool_numbers`` are those of its own G-code."""

    name: str
    title: Line
    source: Line
    bed_mm: Annotated[tuple[Positive, Positive], Field(strict=False)]  # YAML has lists only
    height_mm: Positive
    bed_origin: Literal["centre", "corner"]
    gcode_flavour: Literal["reprapfirmware", "marlin"]
    tool_numbers: Annotated[tuple[int, ...], Field(min_length=1, strict=False)]
    default_tools: dict[str, int]
    nozzle_mm: Positive
    line_width_ratio: Positive
    filament_mm: Positive
    min_layer_mm: Positive
    tool_height_error_mm: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.02  # of one tool beside another
    max_nozzle_c: Positive
    max_bed_c: Positive
    max_speed_mm_s: MaxSpeed
    start_gcode: str
    end_gcode: str
    control: Control = Control()
    macros: dict[MacroName, str | Macro] = Field(default={})  # that the firmware runs, as G-code or as effect

    def macro(self, *names: MacroName) -> str | None:
        """G-code of some of the firmware's macros, one after the other; None where the printer states none of them."""
        known = [self.macros[name] for name in names if name in self.macros]
        return "\n".join(each if isinstance(each, str) else each.gcode() for each in known) if known else None

    @model_validator(mode="after")
    def _homes(self) -> Self:
        text = self.macro("bed")
        if "G32" in self.control.homes and text is not None and "G28" not in text:
            raise ValueError("control.homes has G32, whose macro bed homes no axis: leave it out, and home with G28")
        return self

    @model_validator(mode="after")
    def _prints_layers(self) -> Self:
        if self.min_layer_mm > self.nozzle_mm:
            raise ValueError(f"min_layer_mm {self.min_layer_mm:g} is above nozzle_mm {self.nozzle_mm:g}; no layer fits")
        return self

    def check_tools(self, folder: Path) -> None:
        """Raise BadInput where ``default_tools`` names a material that no pack has, as seen from a folder."""
        for name, tool in self.default_tools.items():
            try:
                packs.find("materials", name, folder)
            except SensorgenError as error:
                raise BadInput(
                    f"printer {self.name}: default_tools: tool {tool} has {error}; or leave it out"
                ) from None

    @model_validator(mode="after")
    def _tools_exist(self) -> Self:
        if len(set(self.tool_numbers)) < len(self.tool_numbers):
            raise ValueError(f"tool_numbers {list(self.tool_numbers)} has a number twice")
        for material, tool in self.default_tools.items():
            if tool not in self.tool_numbers:
                raise ValueError(f"default tool {tool} for {material} is not among {list(self.tool_numbers)}")
        for tool in (*self.control.spindles, *self.control.tool_offsets_mm):
            if tool not in self.tool_numbers:
                raise ValueError(f"tool {tool} under control is not among {list(self.tool_numbers)}")
        return self

    def line_mm(self) -> float:
        """Width of one printed line [mm]."""
        return round(self.nozzle_mm * self.line_width_ratio, 6)

    def slicer_index(self, tool: int) -> int:
        """Place of a tool in a slicer's list, which counts from 0 [-]."""
        return self.tool_numbers.index(tool)

    def tool_at_start(self) -> int | None:
        """Tool in hand before a file takes one: RepRapFirmware has none, others have their first [-]."""
        return None if self.gcode_flavour == "reprapfirmware" else self.tool_numbers[0]

    def reach_mm(self) -> Reach:
        """Reach of the axes [mm]."""
        if self.control.reach_mm is not None:
            return self.control.reach_mm
        (x, y), (wide, deep) = self.bed_centre_mm(), self.bed_mm
        return Reach(x=(x - wide / 2, x + wide / 2), y=(y - deep / 2, y + deep / 2), z=(0.0, self.height_mm))

    def bed_centre_mm(self) -> tuple[float, float]:
        """Where the middle of the bed is in the printer's own coordinates [mm]."""
        return (0.0, 0.0) if self.bed_origin == "centre" else (self.bed_mm[0] / 2, self.bed_mm[1] / 2)


class Quality(Strict):
    """Heights of the layers of a print."""

    name: str
    title: Line
    source: Line
    layer_mm: Positive
    first_layer_mm: Positive
    infill_pattern: Pattern
    travel_speed_mm_s: Positive
    bridge_warning_mm: Positive
    bridge_error_mm: Positive

    def boundaries_mm(self, height_mm: float) -> tuple[float, ...]:
        """Heights of the layer boundaries from the bed to the first at or above ``height_mm`` [mm]."""
        grid = [0.0]
        while grid[-1] < height_mm - 1e-9:
            grid.append(round(self.first_layer_mm + (len(grid) - 1) * self.layer_mm, 9))
        return tuple(grid)


TRUST = "SENSORGEN_TRUST_PRINTER"  # environment variable: printer files may widen limits, also in processes of ours
_COLDEST = "control.coldest_c"  # wider where it is lower, as no other limit is
_LIMITS = (
    "max_nozzle_c", "max_bed_c", "max_speed_mm_s.xy", "max_speed_mm_s.z", "max_speed_mm_s.extruder", _COLDEST,
    "control.longest_purge_mm", "control.longest_retraction_mm",
)  # fmt: skip
_Profile = TypeVar("_Profile", Printer, Quality)


def printer_names() -> list[str]:
    """Names of the printers that ship with sensorgen."""
    return sorted(packs.shipped_names("printers"))


def quality_names() -> list[str]:
    """Names of the print qualities that ship with sensorgen."""
    return sorted(packs.shipped_names("qualities"))


def load_printer(name: str, text: str | None = None) -> Printer:
    """Read a printer by its name, from a YAML file, or from its text where a design has taken that over.

    Raises
    ------
    BadInput
        A file that is no printer's, or that allows more than any printer that ships with sensorgen: such a file may
        have come with a design, and :data:`TRUST` is not set.
    """
    printer = _loaded(Printer, "printers", name, text)
    if name not in printer_names() and not os.environ.get(TRUST) and (wider := _wider(printer)):
        raise BadInput(
            f"{name}: {wider}, more than any printer that ships with sensorgen; if the file is yours, and the printer "
            "can do that: sensorgen --trust-printer ..."
        )
    return printer


def _wider(own: Printer) -> str:
    """The first limit of hardware or G-code that is wider than all that ship; "" for none."""
    shipped = [_loaded(Printer, "printers", name, None) for name in printer_names()]
    for limit in _LIMITS:
        value, *others = map(attrgetter(limit), (own, *shipped))
        if value < min(others) if limit == _COLDEST else value > max(others):
            return f"{limit} {value:g}"
    more = sorted(own.control.added().difference(*(printer.control.added() for printer in shipped)))
    return f"commands {', '.join(more)}" if more else ""


def load_quality(name: str, text: str | None = None) -> Quality:
    """Read a print quality by its name, from a YAML file of the user's, or from its text."""
    return _loaded(Quality, "qualities", name, text)


def _loaded(kind: type[_Profile], which: Literal["printers", "qualities"], name: str, text: str | None) -> _Profile:
    if text is None:
        if name in packs.shipped_names(which):
            return cast(_Profile, _shipped(kind, which, name))
        text = yamlfile.text(Path(name)) if packs.is_path(which, name) else packs.find(which, name).text()
    return cast(_Profile, _parsed(kind, name if packs.is_path(which, name) else f"{name}.yaml", text))


@cache
def _shipped(kind: type[_Profile], which: Literal["printers", "qualities"], name: str) -> _Profile:
    file = packs.File(which, name, packs.shipped_names(which)[name])
    return cast(_Profile, _parsed(kind, str(file.path), file.text()))


@lru_cache(maxsize=64)
def _parsed(kind: type[_Profile], file: str, text: str) -> _Profile:
    # as part of the names of other files, and in a slicer's profile
    safe = re.sub("[^A-Za-z0-9._-]+", "-", Path(file).stem)[:60].strip("._-") or "own"
    try:
        return checked(kind, {**yamlfile.parse(text, file), "name": safe})
    except BadInput as error:
        raise error.within(file) from None


PRIME_MM3 = 15.0  # what PrusaSlicer takes a nozzle to need before its pressure is steady
MARGIN_MM = 10.0  # of the tower to the edges of the bed: the skirt goes round it too


@dataclass(frozen=True)
class Tower:
    """Prime tower, which no sensor may touch: a square on the bed, its front left corner and its side [mm].

    The Diabase lifts by 40 mm for a tool change and the nozzle oozes meanwhile; without priming the first lines of each
    layer would be missing. Coordinates are the printer's own.
    """

    x_mm: float
    y_mm: float
    side_mm: float


def tower(printer: Printer, quality: Quality, tools: int) -> Tower:
    """Place of the prime tower, in the far right corner of the bed.

    Parameters
    ----------
    printer, quality : Printer, Quality
        Their bed and their thinnest layer: priming a volume takes area over height.
    tools : int
        How many tools print [-].

    Returns
    -------
    Tower
        Its square; wide enough for a round tower (Cura's), hence for a rectangular one.
    """
    area_mm2 = tools * PRIME_MM3 / min(quality.layer_mm, quality.first_layer_mm)
    side_mm = float(math.ceil(2 * math.sqrt(area_mm2 / math.pi)))
    centre_x, centre_y = printer.bed_centre_mm()
    return Tower(
        x_mm=centre_x + printer.bed_mm[0] / 2 - MARGIN_MM - side_mm,
        y_mm=centre_y + printer.bed_mm[1] / 2 - MARGIN_MM - side_mm,
        side_mm=side_mm,
    )
