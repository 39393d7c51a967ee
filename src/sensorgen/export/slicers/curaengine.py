"""CuraEngine's command line: slice bodies with the settings that Cura would have worked out.

Cura's window evaluates formulas, the engine does not: here the settings of :mod:`sensorgen.export.slicers.cura`
are spelt out down to those that the engine reads. It takes one STL per body, standing round the middle of
the bed.
"""

import configparser
import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from sensorgen.core.errors import SlicerFailed
from sensorgen.design.printer import Printer, Quality
from sensorgen.export.slicers import PROGRAMS, cura
from sensorgen.export.slicers.loads import ToolLoad, recipes
from sensorgen.export.slicers.run import USUAL, Runner, find, run
from sensorgen.export.slicers.versions import Version

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
        See :func:`sensorgen.export.slicers.cura.profiles`.
    """
    used = recipes(printer, quality, loads)
    files = cura.profiles(printer, quality, loads, version)
    own = f"quality/{printer.name}/{printer.name}_{quality.name}"
    shared, tools = cura.context(printer, quality, used), {}
    of_all: dict[str, str] = {}
    own_settings = next(iter(loads.values())).profile.texts("cura")
    for index, r in used.items():
        profile = _sections(files[f"{own}_{cura.material_id(r)}.inst.cfg"])["values"]
        engine = _sections(cura.filled(version, "engine.ini", shared, r=r))
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
    stls: Sequence[tuple[Path, int]], settings: EngineSettings, gcode: Path, runner: Runner = USUAL
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
