"""PrusaSlicer: one profile for all tools of a printer, and its command line."""

from collections.abc import Iterable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.core.errors import SlicerFailed
from sensorgen.design.printer import PRIME_MM3, Printer, Quality, tower
from sensorgen.design.walls import PROGRAMS
from sensorgen.export.slicers.loads import (
    Recipe,
    ToolLoad,
    by_hand,
    line_area_mm2,
    number,
    overlaid,
    recipe,
    recipes,
    templates,
)
from sensorgen.export.slicers.versions import Version

if TYPE_CHECKING:
    from jinja2 import Environment

    from sensorgen.export.slicers.run import Runner

FLAVOURS = {"reprapfirmware": "reprapfirmware", "marlin": "marlin2"}
_SPEEDS = (
    "perimeter_speed", "external_perimeter_speed", "small_perimeter_speed", "infill_speed", "solid_infill_speed",
    "top_solid_infill_speed", "gap_fill_speed", "bridge_speed",
)  # fmt: skip

_WIDTHS = (
    "perimeter_extrusion_width", "external_perimeter_extrusion_width", "infill_extrusion_width",
    "solid_infill_extrusion_width", "top_infill_extrusion_width",
)  # fmt: skip


def profile(printer: Printer, quality: Quality, loads: Mapping[int, ToolLoad], version: Version = ()) -> str:
    """Text of the ``.ini`` file that ``prusa-slicer --load`` takes.

    PrusaSlicer keeps speeds, walls and infill per body, not per tool. Where the loads disagree, this file
    has what is safe for all of them (slowest, densest, most walls), and each body's own numbers belong
    into its 3MF: see :func:`volume_settings`. A tool without a load is called ``unused`` and stays cold.

    Parameters
    ----------
    printer, quality, loads : Printer, Quality, mapping
        As of :func:`sensorgen.export.slicers.loads.recipes`, whose errors it raises.
    version : tuple of int
        PrusaSlicer's version; the oldest that is supported when not given.
    """
    used = recipes(printer, quality, loads)
    tools = [used.get(i) for i in range(len(printer.tool_numbers))]
    options = next(iter(loads.values())).profile
    text = _templates(version).get_template("profile.ini").render(
        printer=printer, quality=quality, used=used, tools=tools, tower=tower(printer, quality, len(used)),
        flavour=FLAVOURS[printer.gcode_flavour], densest=max(used.values(), key=lambda r: r.infill_percent),
        line_area_mm2=partial(line_area_mm2, quality), prime_mm3=PRIME_MM3, options=options,
        per_tool=lambda entry, times=1: ",".join([str(entry)] * times * len(tools)),
    )  # fmt: skip
    return overlaid(text, options.texts("prusa"))


@cache
def _templates(version: Version) -> "Environment":
    def row(values: Iterable[float], per: float = 1) -> str:
        return ",".join(number(value / per) for value in values)

    def escaped(text: str) -> str:
        return text.strip().replace("\\", "\\\\").replace("\r", "").replace("\n", "\\n")

    def texts(entries: Iterable[str]) -> str:
        return ";".join('"{}"'.format(escaped(entry).replace('"', '\\"')) for entry in entries)

    def note(r: Recipe | None) -> str:
        if r is None:
            return "no material on this tool in the design: it stays cold"
        return ". ".join([f"{r.material.title}: {r.material.about}", *by_hand(r.material)])

    return templates("prusa", version, row=row, escaped=escaped, texts=texts, note=note, pattern=_pattern)


def volume_settings(printer: Printer, quality: Quality, tool: int, load: ToolLoad) -> dict[str, str]:
    """Settings that a body of this load carries in its 3MF, as PrusaSlicer names them.

    They go into ``Metadata/Slic3r_PE_model.config`` as ``<metadata type="volume" key=.. value=../>`` of
    the body's ``<volume>`` and win over the profile.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    tool : int
        The printer's own number of the tool [-].
    load : ToolLoad
        What that tool prints.
    """
    r = recipe(printer, quality, tool, load)
    own = {"fill_density": f"{number(r.infill_percent)}%", "fill_pattern": _pattern(r), "perimeters": str(r.wall_lines)}
    own |= dict.fromkeys(_SPEEDS, number(r.speed_mm_s))
    if load.material.name in load.profile.line_mm:
        own |= dict.fromkeys(_WIDTHS, number(r.line_mm))
    if r.infill_angle_deg is not None:
        own["fill_angle"] = number(r.infill_angle_deg)
    return {key: value for key, value in own.items() if key not in load.profile.texts("prusa")}


def slice_3mf(threemf: Path, profile: Path, gcode: Path, runner: "Runner | None" = None) -> None:
    """Slice a 3MF with PrusaSlicer, where it stands on the bed.

    Parameters
    ----------
    threemf : Path
        A 3MF for PrusaSlicer, in the printer's own coordinates [mm].
    profile : Path
        An ``.ini`` written from :func:`profile`.
    gcode : Path
        What to write.
    runner : Runner
        Which program, and for how long [s].

    Raises
    ------
    SlicerFailed
        PrusaSlicer is not installed, refuses, or cannot read one of the files.
    """
    from sensorgen.export.slicers.run import USUAL, find, run

    runner = runner or USUAL
    program = find(*PROGRAMS["prusa"], runner.program)
    for path in (threemf, profile):
        if not path.is_file():  # PrusaSlicer would take a missing profile for an empty one
            raise SlicerFailed(f"nothing to slice: there is no file {path}")
    # By default PrusaSlicer puts another value for one that it does not know, and goes on.
    strict = ["--config-compatibility", "disable"]
    command = [program, "--export-gcode", "--dont-arrange", *strict, "--load", str(profile)]
    run([*command, "--output", str(gcode), str(threemf)], gcode, runner=runner)


def settings(text: str) -> dict[str, str]:
    """Settings of a profile, or of what PrusaSlicer writes of them at the end of its G-code."""
    lines = (line.removeprefix("; ").partition(" =") for line in text.splitlines() if not line.startswith("#"))
    return {key: value.strip() for key, equal, value in lines if equal and " " not in key}


def _pattern(r: Recipe) -> str:
    """At 100 % there is no pattern, and PrusaSlicer refuses those that would cross themselves."""
    return "rectilinear" if r.infill_percent >= 100 else r.infill_pattern
