"""Cura: machine, tools, materials and qualities in its own file formats, under the folders it keeps them in.

The printer's tools are numbered by Cura from 0, in the order of ``Printer.tool_numbers``.
"""

import json
import re
import uuid
from collections.abc import Mapping
from functools import cache, partial
from html import escape
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.design.printer import PRIME_MM3, Printer, Quality, tower
from sensorgen.export.slicers.loads import Recipe, ToolLoad, by_hand, number, overlaid, recipes, templates
from sensorgen.export.slicers.versions import Version

if TYPE_CHECKING:
    from jinja2 import Environment

FLAVOURS = {"reprapfirmware": "RepRap (RepRap)", "marlin": "RepRap (Marlin/Sprinter)"}
PATTERNS = {
    "rectilinear": "lines", "grid": "grid", "concentric": "concentric", "triangles": "triangles", "gyroid": "gyroid",
}  # fmt: skip
DIRECTIONS = {"lines": 1, "grid": 2, "concentric": 1, "triangles": 3, "gyroid": 1}  # of lines in one layer


def profiles(
    printer: Printer, quality: Quality, loads: Mapping[int, ToolLoad], version: Version = ()
) -> dict[str, str]:
    """Texts of Cura's files under their path in its resources folder.

    Parameters
    ----------
    printer, quality, loads : Printer, Quality, mapping
        As of :func:`sensorgen.export.slicers.loads.recipes`, whose errors it raises.
    version : tuple of int
        Cura's version; the oldest that is supported when not given.

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
    own, trains = f"quality/{printer.name}/{printer.name}_{quality.name}", range(len(printer.tool_numbers))
    options = next(iter(loads.values())).profile
    shared, fill = context(printer, quality, used), partial(filled, version)
    files = {
        f"definitions/{printer.name}.def.json": fill(
            "machine.def.json", shared, flavour=FLAVOURS[printer.gcode_flavour], first=next(iter(used.values())),
            trains={str(index): extruder_id(printer, index) for index in trains},
        ),
        f"{own}_global.inst.cfg": fill("quality_global.inst.cfg", shared),
    }  # fmt: skip
    for index in trains:
        files[f"extruders/{extruder_id(printer, index)}.def.json"] = fill("extruder.def.json", shared, index=index)
    for r in used.values():
        files[f"materials/{material_id(r)}.xml.fdm_material"] = fill("material.xml.fdm_material", shared, r=r)
        text = fill("quality_tool.inst.cfg", shared, r=r, walls=options.walls or "arachne")
        files[f"{own}_{material_id(r)}.inst.cfg"] = overlaid(text, options.texts("cura"))
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


def context(printer: Printer, quality: Quality, used: Mapping[int, Recipe]) -> dict[str, Any]:
    """Values of all templates."""
    return {
        "printer": printer, "quality": quality, "used": used, "tower": tower(printer, quality, len(used)),
        "line_mm": printer.line_mm(), "directions": DIRECTIONS, "prime_mm3": PRIME_MM3,
    }  # fmt: skip


def filled(version: Version, template: str, shared: Mapping[str, Any], **own: Any) -> str:
    """Text of a template in ``slicer_profiles/cura``, with what all templates show and with its own."""
    return _templates(version).get_template(template).render(dict(shared), **own)


@cache
def _templates(version: Version) -> "Environment":
    def guid(r: Recipe) -> str:
        return str(uuid.uuid5(uuid.NAMESPACE_URL, f"sensorgen/material/{material_id(r)}"))

    def density(r: Recipe) -> str:
        """In g/cm3; nothing where no source gives one: Cura then shows no weight."""
        try:
            return number(r.material.value("density_kg_m3", r.source).value / 1000)
        except MissingValue:
            return ""

    return templates(
        "cura", version, material_id=material_id, guid=guid, density=density, pattern=_pattern, e=escape,
        tojson=json.dumps, drying=lambda material: ". ".join(by_hand(material)) or "no source says how to dry it",
    )  # fmt: skip


def _pattern(r: Recipe) -> str:
    if r.infill_percent >= 100:
        return "lines"  # no gaps, no pattern; crossing lines would be laid twice
    if r.infill_pattern not in PATTERNS:
        raise OutOfRange(
            f"{r.material.name}: Cura has no {r.infill_pattern} infill; use {', '.join(PATTERNS)}, or PrusaSlicer"
        )
    return PATTERNS[r.infill_pattern]
