"""PrusaSlicer: one profile for all tools of a printer, and its command line."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from string import Template

from sensorgen.core.errors import SlicerFailed
from sensorgen.design.printer import Printer, Quality, folder
from sensorgen.design.tower import PRIME_MM3, Tower, tower
from sensorgen.export.slicers.loads import Load, Recipe, by_hand, number, recipe, recipes
from sensorgen.export.slicers.run import USUAL, Runner, find, run

FLAVOURS = {"reprapfirmware": "reprapfirmware", "marlin": "marlin2"}
UNUSED = "unused"


def profile(printer: Printer, quality: Quality, loads: Mapping[int, Load]) -> str:
    """Text of the ``.ini`` file that ``prusa-slicer --load`` takes.

    PrusaSlicer keeps speeds, walls and infill per body, not per tool. Where the loads disagree, this file
    has what is safe for all of them (slowest, densest, most walls), and each body's own numbers belong
    into its 3MF: see :func:`volume_settings`. A tool without a load is called ``unused`` and stays cold.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    loads : mapping
        Load under the printer's own tool number [-].

    Raises
    ------
    BadInput, MissingValue, OutOfRange, UnknownName
        See :func:`sensorgen.export.slicers.loads.recipes`.
    """
    used = recipes(printer, quality, loads)
    template = Template((folder() / "prusa" / "profile.ini").read_text("utf-8"))
    return template.substitute(
        _of_printer(printer)
        | _of_tools(printer, quality, used)
        | _of_print(printer, quality, used)
        | _of_tower(printer, tower(printer, quality, len(used)), len(used))
    )


def volume_settings(printer: Printer, quality: Quality, tool: int, load: Load) -> dict[str, str]:
    """Settings that a body of this load carries in its 3MF, as PrusaSlicer names them.

    They go into ``Metadata/Slic3r_PE_model.config`` as ``<metadata type="volume" key=.. value=../>`` of
    the body's ``<volume>`` and win over the profile.

    Parameters
    ----------
    printer, quality : Printer, Quality
        What prints, and in which layers.
    tool : int
        The printer's own number of the tool [-].
    load : Load
        What that tool prints.
    """
    r = recipe(printer, quality, tool, load)
    speed = number(r.speed_mm_s)
    return {
        "fill_density": f"{number(r.infill_percent)}%",
        "fill_pattern": _pattern(r),
        "perimeters": str(r.wall_lines),
        **dict.fromkeys(
            (
                "perimeter_speed", "external_perimeter_speed", "small_perimeter_speed", "infill_speed",
                "solid_infill_speed", "top_solid_infill_speed", "gap_fill_speed", "bridge_speed",
            ),
            speed,
        ),
    }  # fmt: skip


def slice_3mf(threemf: Path, profile: Path, gcode: Path, runner: Runner = USUAL) -> None:
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
    program = find("prusa-slicer", "prusa-slicer", runner.program)
    for path in (threemf, profile):
        if not path.is_file():  # PrusaSlicer would take a missing profile for an empty one
            raise SlicerFailed(f"nothing to slice: there is no file {path}")
    # By default PrusaSlicer puts another value for one that it does not know, and goes on.
    strict = ["--config-compatibility", "disable"]
    command = [program, "--export-gcode", "--dont-arrange", *strict, "--load", str(profile)]
    run([*command, "--output", str(gcode), str(threemf)], gcode, runner=runner)


def _of_printer(printer: Printer) -> dict[str, str]:
    speeds = printer.max_speed_mm_s
    return {
        "title": printer.title,
        "printer_id": printer.name,
        "printer_notes": _escaped(f"{printer.title}; {printer.source}"),
        "gcode_flavor": FLAVOURS[printer.gcode_flavour],
        "bed_shape": _bed_shape(printer),
        "height": number(printer.height_mm),
        "start_gcode": _escaped(printer.start_gcode),
        "end_gcode": _escaped(printer.end_gcode),
        "max_xy": number(speeds.xy),
        "max_z": number(speeds.z),
        "max_e": number(speeds.extruder),
        "travel_speed_z": number(speeds.z),
        "firmware_retraction": str(int(printer.control.firmware_retraction)),
    }


def _of_tools(printer: Printer, quality: Quality, used: Mapping[int, Recipe]) -> dict[str, str]:
    """One entry per tool, used or not, as PrusaSlicer counts them."""
    count = len(printer.tool_numbers)
    area_mm2 = _line_area_mm2(printer, quality)

    def each(of: Callable[[Recipe], str], unused: str) -> list[str]:
        return [of(used[i]) if i in used else unused for i in range(count)]

    return {
        "nozzle_diameter": _row([number(printer.nozzle_mm)] * count),
        "min_layer_height": _row([number(printer.min_layer_mm)] * count),
        "max_layer_height": _row([number(0.75 * printer.nozzle_mm)] * count),
        "extruder_offset": _row(["0x0"] * count),
        "filament_diameter": _row([number(printer.filament_mm)] * count),
        "retract_before_travel": _row(["2"] * count),
        "slow_layer_s": _row(["5"] * count),
        "slow_speed": _row(each(lambda r: number(min(10.0, r.speed_mm_s)), "10")),
        "zeros": _row(["0"] * count),
        "zeros_percent": _row(["0%"] * count),
        "ones": _row(["1"] * count),
        "empty_texts": _texts([""] * count),
        "prime": _row([number(PRIME_MM3)] * count),
        "colour": ";".join(each(lambda r: r.material.colour.upper(), "#FFFFFF")),
        "filament_id": _texts(each(_name, UNUSED)),
        "filament_type": _texts(each(lambda r: r.material.name.upper(), UNUSED.upper())),
        "filament_notes": _texts(each(_note, "no material on this tool in the design: it stays cold")),
        "nozzle_c": _row(each(lambda r: number(round(r.nozzle_c)), "0")),
        "bed_c": _row(each(lambda r: number(round(r.bed_c)), "0")),
        "fan": _row(each(lambda r: number(round(r.fan_percent)), "0")),
        "fan_on": _row(each(lambda r: "1" if r.fan_percent > 0 else "0", "0")),
        "flow": _row(each(lambda r: number(r.flow_percent / 100), "1")),
        "retraction": _row(each(lambda r: number(r.retraction_mm), "0")),
        "retraction_speed": _row(each(lambda r: number(r.retraction_speed_mm_s), "40")),
        "volumetric_speed": _row(each(lambda r: number(r.speed_mm_s * area_mm2), "0")),
    }


def _of_print(printer: Printer, quality: Quality, used: Mapping[int, Recipe]) -> dict[str, str]:
    densest = max(used.values(), key=lambda r: r.infill_percent)
    tools = "; ".join(f"T{printer.tool_numbers[i]}: {_name(r)}" for i, r in used.items())
    return {
        "quality_title": quality.title,
        "print_id": f"{printer.name} {quality.name}",
        "notes": _escaped(tools),
        "layer_height": number(quality.layer_mm),
        "first_layer_height": number(quality.first_layer_mm),
        "line_width": number(printer.line_mm()),
        "perimeters": str(max(r.wall_lines for r in used.values())),
        "fill_density": f"{number(densest.infill_percent)}%",
        "fill_pattern": _pattern(densest),
        "speed": number(min(r.speed_mm_s for r in used.values())),
        "travel_speed": number(quality.travel_speed_mm_s),
    }


def _of_tower(printer: Printer, place: Tower, used: int) -> dict[str, str]:
    tools = range(len(printer.tool_numbers))
    return {
        "wipe_tower": "1" if used > 1 else "0",
        "tower_x": number(place.x_mm),
        "tower_y": number(place.y_mm),
        "tower_side": number(place.side_mm),
        "prime_in_out": _row([number(PRIME_MM3 / 2)] * 2 * len(tools)),
        "prime_matrix": _row("0" if a == b else number(PRIME_MM3) for a in tools for b in tools),
    }


def _line_area_mm2(printer: Printer, quality: Quality) -> float:
    """Cross-section of a line at its highest [mm2]: a rectangle with round sides.

    Times the speed it is the flow that keeps the tower, whose speed PrusaSlicer sets itself, as slow as
    the material asks.
    """
    height_mm = max(quality.layer_mm, quality.first_layer_mm)
    return height_mm * (printer.line_mm() - height_mm * (1 - math.pi / 4))


def _pattern(r: Recipe) -> str:
    """At 100 % there is no pattern, and PrusaSlicer refuses those that would cross themselves."""
    return "rectilinear" if r.infill_percent >= 100 else r.infill_pattern


def _name(r: Recipe) -> str:
    return r.material.name + (f"@{r.source}" if r.source else "")


def _note(r: Recipe) -> str:
    return ". ".join([f"{r.material.title}: {r.material.about}", *by_hand(r.material)])


def _bed_shape(printer: Printer) -> str:
    x, y = printer.bed_centre_mm()
    half_x, half_y = printer.bed_mm[0] / 2, printer.bed_mm[1] / 2
    corners = [(x - half_x, y - half_y), (x + half_x, y - half_y), (x + half_x, y + half_y), (x - half_x, y + half_y)]
    return ",".join(f"{number(cx)}x{number(cy)}" for cx, cy in corners)


def _row(entries: Iterable[str]) -> str:
    return ",".join(entries)


def _texts(entries: Iterable[str]) -> str:
    return ";".join(f'"{_escaped(e).replace(chr(34), chr(92) + chr(34))}"' for e in entries)


def _escaped(text: str) -> str:
    return text.strip().replace("\\", "\\\\").replace("\r", "").replace("\n", "\\n")
