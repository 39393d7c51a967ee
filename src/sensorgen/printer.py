"""Printers and print qualities, read from data: tools, nozzle, layers, bed."""

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from sensorgen import yamlfile
from sensorgen.errors import BadInput, UnknownName

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MaxSpeed(_Strict):
    """Fastest the axes may move [mm/s]."""

    xy: Positive
    z: Positive
    extruder: Positive


class Printer(_Strict):
    """A multi-tool printer; ``tool_numbers`` are those of its own G-code."""

    name: str
    title: str
    source: str
    bed_mm: tuple[Positive, Positive]
    height_mm: Positive
    bed_origin: Literal["centre", "corner"]
    gcode_flavour: Literal["reprapfirmware", "marlin"]
    first_tool: Annotated[int, Field(ge=0)]
    tool_numbers: Annotated[tuple[int, ...], Field(min_length=1)]
    default_tools: dict[str, int]
    nozzle_mm: Positive
    line_width_ratio: Positive
    filament_mm: Positive
    min_layer_mm: Positive
    max_nozzle_c: Positive
    max_bed_c: Positive
    max_speed_mm_s: MaxSpeed
    start_gcode: str
    end_gcode: str

    @model_validator(mode="after")
    def _tools_exist(self) -> Self:
        for material, tool in self.default_tools.items():
            if tool not in self.tool_numbers:
                raise ValueError(f"default tool {tool} for {material} is not among {list(self.tool_numbers)}")
        return self

    def slicer_index(self, tool: int) -> int:
        """Place of a tool in a slicer's list, which counts from 0 [-]."""
        return self.tool_numbers.index(tool)

    def bed_centre_mm(self) -> tuple[float, float]:
        """Where the middle of the bed is in the printer's own coordinates [mm]."""
        return (0.0, 0.0) if self.bed_origin == "centre" else (self.bed_mm[0] / 2, self.bed_mm[1] / 2)


class Quality(_Strict):
    """How a print is cut into layers."""

    name: str
    title: str
    source: str
    layer_mm: Positive
    first_layer_mm: Positive
    infill_pattern: Literal["rectilinear", "grid", "concentric", "honeycomb", "triangles"]
    travel_speed_mm_s: Positive
    bridge_warning_mm: Positive
    bridge_error_mm: Positive

    def boundaries_mm(self, height_mm: float) -> list[float]:
        """Heights of the layer boundaries from the bed to the first at or above ``height_mm`` [mm]."""
        grid = [0.0]
        while grid[-1] < height_mm - 1e-9:
            grid.append(round(self.first_layer_mm + (len(grid) - 1) * self.layer_mm, 9))
        return grid


_Profile = TypeVar("_Profile", Printer, Quality)


def folder() -> Path:
    """Where printers, qualities and profile templates stand: inside the wheel, or beside ``src``."""
    packed = Path(str(resources.files("sensorgen"))) / "slicer_profiles"
    return packed if packed.is_dir() else Path(__file__).parents[2] / "slicer_profiles"


def printer_names() -> list[str]:
    """Names of the printers that ship with sensorgen."""
    return sorted(p.stem for p in (folder() / "printers").glob("*.yaml"))


def quality_names() -> list[str]:
    """Names of the print qualities that ship with sensorgen."""
    return sorted(p.stem for p in (folder() / "qualities").glob("*.yaml"))


@cache
def load_printer(name: str) -> Printer:
    """Read a printer by its name, or from a YAML file of the user's."""
    return _load(Printer, "printer", name, printer_names())


@cache
def load_quality(name: str) -> Quality:
    """Read a print quality by its name, or from a YAML file of the user's."""
    return _load(Quality, "quality", name, quality_names())


def _load(kind: type[_Profile], word: str, name: str, known: list[str]) -> _Profile:
    own = name.endswith((".yaml", ".yml"))
    if not own and name not in known:
        raise UnknownName(word, name, known)
    plural = {"printer": "printers", "quality": "qualities"}[word]
    path = Path(name) if own else folder() / plural / f"{name}.yaml"
    try:
        return kind(name=path.stem, **yamlfile.read(path))
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from None
    except TypeError as error:
        raise BadInput(f"{path}: {error}") from None
