"""Cura: machine, tools, materials and qualities in its own file formats, and the command line of its engine.

The printer's tools are numbered by Cura from 0, in the order of ``Printer.tool_numbers``.

Cura's window evaluates formulas, the engine does not: :func:`engine_settings` spells profiles out down to the settings
that the engine reads. It takes one STL per body, standing round the middle of the bed.
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

    from sensorgen.export.slicers.run import Runner
import configparser
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from sensorgen.core.errors import SlicerFailed
from sensorgen.design.walls import PROGRAMS

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


OF_SKIRT = ("adhesion_extruder_nr", "skirt_brim_extruder_nr")  # its tool: until 4.13, and from 5.0 on
RESOURCES = (Path("/usr/share/cura/resources"), Path("/usr/local/share/cura/resources"))


@dataclass(frozen=True)
class EngineSettings:
    """Input of the engine: files, settings for all, and settings by tool (from 0).

    ``tools`` are those with a material; ``unused`` are the others, which the engine knows, too.
    """

    printer: str
    files: dict[str, str]
    common: dict[str, str]
    tools: dict[int, dict[str, str]]
    unused: dict[int, dict[str, str]]


def engine_settings(
    printer: Printer, quality: Quality, loads: Mapping[int, ToolLoad], version: Version = ()
) -> EngineSettings:
    """Settings for a run of the engine.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    loads : mapping
        Load under the printer's own tool number [-].
    version : tuple of int
        The engine's version; the oldest that is supported when not given.

    Raises
    ------
    BadInput, MissingValue, OutOfRange, UnknownName
        See :func:`profiles`.
    """
    used = recipes(printer, quality, loads)
    files = profiles(printer, quality, loads, version)
    own = f"quality/{printer.name}/{printer.name}_{quality.name}"
    shared, tools = context(printer, quality, used), {}
    of_all: dict[str, str] = {}
    own_settings = next(iter(loads.values())).profile.texts("cura")
    for index, r in used.items():
        profile = _sections(files[f"{own}_{material_id(r)}.inst.cfg"])["values"]
        engine = _sections(filled(version, "engine.ini", shared, r=r))
        of_all = of_all or engine["all"]
        tools[index] = profile | engine["tool"] | {"extruder_nr": str(index)} | own_settings
    return EngineSettings(
        printer=printer.name,
        files={path: text for path, text in files.items() if path.startswith(("definitions/", "extruders/"))},
        common=_sections(files[f"{own}_global.inst.cfg"])["values"] | of_all | own_settings,
        tools=tools,
        unused={i: {"prime_tower_min_volume": "0"} for i in range(len(printer.tool_numbers)) if i not in used},
    )


def slice_bodies(
    stls: Sequence[tuple[Path, int]], settings: EngineSettings, gcode: Path, runner: "Runner | None" = None
) -> None:
    """Slice one STL per body with CuraEngine.

    Parameters
    ----------
    stls : sequence of (Path, int)
        A body's mesh [mm] with the origin in the middle of the bed, and its tool as Cura counts, from 0
        (``Printer.slicer_index``).
    settings : EngineSettings
        From :func:`engine_settings`.
    gcode : Path
        What to write.
    runner : Runner
        Which program, and for how long [s].

    Raises
    ------
    SlicerFailed
        CuraEngine or its definitions are not installed, a mesh is missing, or its tool has no load; or
        the engine refuses.
    """
    from sensorgen.export.slicers.run import USUAL, find, run

    runner = runner or USUAL
    program = find(*PROGRAMS["cura"], runner.program)
    for path, index in stls:
        if not path.is_file():
            raise SlicerFailed(f"nothing to slice: there is no file {path}")
        if index not in settings.tools:
            raise SlicerFailed(f"{path} wants tool {index}, which has no material; loaded are {sorted(settings.tools)}")
    with tempfile.TemporaryDirectory() as here:
        for name, text in settings.files.items():
            place = Path(here) / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text, "utf-8")
        # General settings, then each tool's, then each body under its tool: the engine reads in this order.
        command = [program, "slice", "-j", str(Path(here) / "definitions" / f"{settings.printer}.def.json")]
        command += _given(settings.common)
        for index, values in sorted((settings.unused | settings.tools).items()):
            command += [f"-e{index}", *_given(values)]
        for path, index in stls:
            command += [f"-e{index}", "-l", str(path), "-s", f"extruder_nr={index}"]
        command += ["-o", str(gcode)]
        search = [
            str(base / kind) for base in (Path(here), resources(program)) for kind in ("definitions", "extruders")
        ]
        run(command, gcode, {"CURA_ENGINE_SEARCH_PATH": os.pathsep.join(search)}, runner)


def resources(program: str = "") -> Path:
    """Folder of Cura's own definitions, on which ours build; beside the engine, or else the system's.

    Parameters
    ----------
    program : str
        Path of the engine, as in ``PREFIX/bin``, which looks into ``PREFIX/share`` first.

    Raises
    ------
    SlicerFailed
        It is not where Cura's packages put it.
    """
    beside = [Path(program).parent.parent / "share/cura/resources"] if program else []
    for path in [*beside, *RESOURCES]:
        if (path / "definitions" / "fdmprinter.def.json").is_file():
            return path
    raise SlicerFailed(f"Cura's definitions are not in {RESOURCES[0]}; on Debian: apt install cura")


def unknown(settings: EngineSettings, program: str = "") -> set[str]:
    """Settings that the definitions of the engine's version do not have.

    Raises
    ------
    SlicerFailed
        See :func:`resources`.
    """
    known: set[str] = set()
    for name in ("fdmprinter", "fdmextruder"):
        path = resources(program) / "definitions" / f"{name}.def.json"
        nodes = [json.loads(path.read_text("utf-8"))["settings"]]
        while nodes:
            group = nodes.pop()
            known |= group.keys()
            nodes += [node["children"] for node in group.values() if "children" in node]
    told = (settings.common, *settings.tools.values(), *settings.unused.values())
    return {key for values in told for key in values} - known


def _given(values: Mapping[str, str]) -> list[str]:
    return [word for key, value in values.items() for word in ("-s", f"{key}={value}")]


@lru_cache(maxsize=16)
def _sections(text: str) -> dict[str, dict[str, str]]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    return {name: dict(section) for name, section in parser.items()}
