"""Cura: machine, tools, materials and qualities in its own file formats, under the folders it keeps them in.

The printer's tools are numbered by Cura from 0, in the order of ``Printer.tool_numbers``.
"""

import json
import re
import uuid
from collections.abc import Mapping
from html import escape
from string import Template

from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.design.printer import Printer, Quality, folder
from sensorgen.design.tower import PRIME_MM3, tower
from sensorgen.export.slicers.loads import Load, Recipe, by_hand, number, recipes

FLAVOURS = {"reprapfirmware": "RepRap (RepRap)", "marlin": "RepRap (Marlin/Sprinter)"}
PATTERNS = {"rectilinear": "lines", "grid": "grid", "concentric": "concentric", "triangles": "triangles"}
DIRECTIONS = {"lines": 1, "grid": 2, "concentric": 1, "triangles": 3}  # of lines in one layer
ALL_LAYERS = 999999


def profiles(printer: Printer, quality: Quality, loads: Mapping[int, Load]) -> dict[str, str]:
    """Texts of Cura's files under their path in its resources folder.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    loads : mapping
        Load under the printer's own tool number [-].

    Returns
    -------
    dict
        ``definitions/``, ``extruders/`` (every tool), ``materials/`` and ``quality/<printer>/`` (one
        for all tools, one per material).

    Raises
    ------
    BadInput, MissingValue, OutOfRange, UnknownName
        See :func:`sensorgen.export.slicers.loads.recipes`; also an infill pattern that Cura does not have.
    """
    used = recipes(printer, quality, loads)
    own = f"quality/{printer.name}/{printer.name}_{quality.name}"
    files = {
        f"definitions/{printer.name}.def.json": _machine(printer, quality, used),
        f"{own}_global.inst.cfg": _fill("quality_global.inst.cfg", of_all(printer, quality, used)),
    }
    for index in range(len(printer.tool_numbers)):
        files[f"extruders/{extruder_id(printer, index)}.def.json"] = _extruder(printer, index)
    for r in used.values():
        files[f"materials/{material_id(r)}.xml.fdm_material"] = _material(printer, r)
        files[f"{own}_{material_id(r)}.inst.cfg"] = _fill("quality_tool.inst.cfg", of_tool(printer, quality, r))
    return files


def extruder_id(printer: Printer, index: int) -> str:
    """Cura's name of a tool, by its number from 0 [-]."""
    return f"{printer.name}_extruder_{index}"


def material_id(r: Recipe) -> str:
    """Cura's name of a material; another source or infill [%] is another material, since Cura keys quality by it."""
    parts = ["sensorgen", r.material.name, r.source]
    if r.infill_percent < 100:
        parts += [f"infill{number(r.infill_percent)}", r.infill_pattern]
    return "_".join(re.sub(r"[^A-Za-z0-9]+", "_", part) for part in parts if part)


def of_all(printer: Printer, quality: Quality, used: Mapping[int, Recipe]) -> dict[str, str]:
    """What the templates call the numbers that all tools share (see ``quality_global.inst.cfg``)."""
    place = tower(printer, quality, len(used))
    return {
        "title": quality.title,
        "printer": printer.name,
        "quality": quality.name,
        "layer_height": number(quality.layer_mm),
        "first_layer_height": number(quality.first_layer_mm),
        "first_tool": str(min(used)),
        "tower": str(len(used) > 1),
        "tower_size": number(place.side_mm),
        # Cura names the tower by its right and front edge.
        "tower_x": number(place.x_mm + place.side_mm),
        "tower_y": number(place.y_mm),
        "tools": str(len(printer.tool_numbers)),
        "height": number(printer.height_mm),
        "bed_c": number(next(iter(used.values())).bed_c),
    }


def of_tool(printer: Printer, quality: Quality, r: Recipe) -> dict[str, str]:
    """What the templates call the numbers of one tool (see ``quality_tool.inst.cfg`` and ``engine.ini``)."""
    width_mm = printer.line_mm()
    pattern = _pattern(r)
    overlap = 10 if r.infill_percent < 95 and pattern != "concentric" else 0  # as Cura's own formula has it
    return {
        "title": quality.title,
        "printer": printer.name,
        "quality": quality.name,
        "material": material_id(r),
        "layer_height": number(quality.layer_mm),
        "nozzle": number(printer.nozzle_mm),
        "half_nozzle": number(printer.nozzle_mm / 2),
        "filament": number(printer.filament_mm),
        "line_width": number(width_mm),
        "quarter_line": number(width_mm / 4),
        "two_lines": number(width_mm * 2),
        "walls": str(r.wall_lines),
        "wall_width": number(width_mm * r.wall_lines),
        "infill": number(r.infill_percent),
        "infill_distance": number(width_mm * 100 / r.infill_percent * DIRECTIONS[pattern]),
        "infill_overlap": number(overlap),
        "infill_overlap_mm": number(width_mm * overlap / 100),
        "skin_overlap_mm": number(width_mm * 5 / 100),
        "bottom_layers": str(ALL_LAYERS if r.infill_percent >= 100 else 0),
        "pattern": pattern,
        "nozzle_c": number(r.nozzle_c),
        "bed_c": number(r.bed_c),
        "flow": number(r.flow_percent),
        "fan": number(r.fan_percent),
        "speed": number(r.speed_mm_s),
        "slow_speed": number(min(10.0, r.speed_mm_s)),
        "travel_speed": number(quality.travel_speed_mm_s),
        "retraction": number(r.retraction_mm),
        "retraction_speed": number(r.retraction_speed_mm_s),
        "prime": number(PRIME_MM3),
    }


def _machine(printer: Printer, quality: Quality, used: Mapping[int, Recipe]) -> str:
    speeds = printer.max_speed_mm_s
    names = {
        "title": printer.title,
        "first_material": material_id(next(iter(used.values()))),
        "quality": quality.name,
        "trains": {str(i): extruder_id(printer, i) for i in range(len(printer.tool_numbers))},
        "width": printer.bed_mm[0],
        "depth": printer.bed_mm[1],
        "height": printer.height_mm,
        "centre_is_zero": printer.bed_origin == "centre",
        "tools": len(printer.tool_numbers),
        "flavour": FLAVOURS[printer.gcode_flavour],
        "start_gcode": printer.start_gcode.strip(),
        "end_gcode": printer.end_gcode.strip(),
        "max_xy": speeds.xy,
        "max_z": speeds.z,
        "max_e": speeds.extruder,
        "firmware_retraction": printer.control.firmware_retraction,
    }
    return _fill("machine.def.json", {key: json.dumps(value) for key, value in names.items()})


def _extruder(printer: Printer, index: int) -> str:
    names = {
        "title": f"T{printer.tool_numbers[index]}",
        "printer": printer.name,
        "number": index,
        "last": len(printer.tool_numbers) - 1,
        "nozzle": printer.nozzle_mm,
        "filament": printer.filament_mm,
    }
    return _fill("extruder.def.json", {key: json.dumps(value) for key, value in names.items()})


def _material(printer: Printer, r: Recipe) -> str:
    name = material_id(r)
    return _fill(
        "material.xml.fdm_material",
        {
            "type": escape(r.material.name.upper()),
            "label": escape(name.removeprefix("sensorgen_")),
            "guid": str(uuid.uuid5(uuid.NAMESPACE_URL, f"sensorgen/material/{name}")),
            "colour": r.material.colour,
            "about": escape(f"{r.material.title}: {r.material.about}"),
            "drying": escape(". ".join(by_hand(r.material)) or "no source says how to dry it"),
            "density": _density(r),
            "filament": number(printer.filament_mm),
            "nozzle_c": number(r.nozzle_c),
            "bed_c": number(r.bed_c),
            "fan": number(r.fan_percent),
            "flow": number(r.flow_percent),
            "retraction": number(r.retraction_mm),
            "retraction_speed": number(r.retraction_speed_mm_s),
        },
    )


def _density(r: Recipe) -> str:
    """The density's element [g/cm3], or nothing where no source gives one: Cura then shows no weight."""
    try:
        density_kg_m3 = r.material.value("density_kg_m3", r.source).value
    except MissingValue:
        return ""
    return f"\n        <density>{number(density_kg_m3 / 1000)}</density>"


def _pattern(r: Recipe) -> str:
    if r.infill_percent >= 100:
        return "lines"  # no gaps, no pattern; crossing lines would be laid twice
    if r.infill_pattern not in PATTERNS:
        raise OutOfRange(
            f"{r.material.name}: Cura has no {r.infill_pattern} infill; use {', '.join(PATTERNS)}, or PrusaSlicer"
        )
    return PATTERNS[r.infill_pattern]


def _fill(template: str, names: Mapping[str, str]) -> str:
    return Template((folder() / "cura" / template).read_text("utf-8")).substitute(names)
