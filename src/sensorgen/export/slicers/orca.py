"""OrcaSlicer 2: machine, process and filaments as JSON presets, in the folders where it keeps a user's own.

Written from the names in its sources; it could not be run here, so these are **untried**. The place of the prime
tower is in no preset: it belongs to the project, and is to be set by hand.
"""

import json
from collections.abc import Iterable, Mapping
from functools import cache, partial
from typing import TYPE_CHECKING

from sensorgen.design.printer import PRIME_MM3, Printer, Quality, tower
from sensorgen.export.slicers.loads import Recipe, ToolLoad, line_area_mm2, number, recipes, templates

if TYPE_CHECKING:
    from jinja2 import Environment

FLAVOURS = {"reprapfirmware": "reprapfirmware", "marlin": "marlin2"}
PATTERNS = {"rectilinear": "zig-zag"}  # others have the same name as in PrusaSlicer
VERSION = "2.0.0.0"  # of the presets


def profiles(printer: Printer, quality: Quality, loads: Mapping[int, ToolLoad]) -> dict[str, str]:
    """Texts of Orca's presets under their path in its folder of a user's presets.

    Parameters
    ----------
    printer, quality, loads : Printer, Quality, mapping
        As of :func:`sensorgen.export.slicers.loads.recipes`, whose errors it raises.
    """
    used, machine = recipes(printer, quality, loads), f"sensorgen {printer.name}"
    tools, options = [used.get(i) for i in range(len(printer.tool_numbers))], next(iter(loads.values())).profile
    own = options.texts("orca")

    def preset(template: str, name: str, r: Recipe | None = None) -> dict[str, str | list[str]]:
        text = _templates().get_template(template).render(
            printer=printer, quality=quality, used=used, tools=tools, machine=machine, name=name, r=r, version=VERSION,
            flavour=FLAVOURS[printer.gcode_flavour], densest=max(used.values(), key=lambda each: each.infill_percent),
            tower=tower(printer, quality, len(used)), prime_mm3=PRIME_MM3, options=options,
            line_area_mm2=partial(line_area_mm2, quality), per_tool=lambda entry: _texts([entry] * len(tools)),
        )  # fmt: skip
        settings: dict[str, str | list[str]] = json.loads(text)
        for key in settings.keys() & own.keys():
            old = settings[key]
            settings[key] = [own[key]] * len(old) if isinstance(old, list) else own[key]
        return settings

    process = f"{machine} {quality.name}"
    presets = {
        f"machine/{machine}.json": preset("machine.json", machine),
        f"process/{process}.json": preset("process.json", process),
    }
    for index, r in used.items():
        name = f"{machine} T{printer.tool_numbers[index]} {r.label}"
        presets[f"filament/{name}.json"] = preset("filament.json", name, r)
    # What stands in none of them is taken for a setting of the process.
    known = {key for each in presets.values() for key in each}
    presets[f"process/{process}.json"] |= {key: own[key] for key in sorted(own.keys() - known)}
    return {path: json.dumps(each, indent=4, ensure_ascii=False) + "\n" for path, each in presets.items()}


@cache
def _templates() -> "Environment":
    return templates(
        "orca", (), row=_texts, tojson=lambda value: json.dumps(value, ensure_ascii=False), pattern=_pattern
    )


def _texts(entries: Iterable[float | str]) -> str:
    """A list of texts, as Orca keeps every value of a tool."""
    return json.dumps([entry if isinstance(entry, str) else number(entry) for entry in entries])


def _pattern(r: Recipe) -> str:
    return PATTERNS["rectilinear"] if r.infill_percent >= 100 else PATTERNS.get(r.infill_pattern, r.infill_pattern)
