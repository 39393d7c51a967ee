"""Check of a printer and a quality of the user's own: slicers' profiles, and the printer's start and end code.

What ships is tested before it ships; the file of a user by ``pack test`` and with each design that it prints.
"""

from collections.abc import Iterator, Mapping

from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.design.design import Design
from sensorgen.design.printer import Printer, Quality
from sensorgen.export.slicers.loads import ToolLoad, loads

RULE = "0-printer"
_EMPTY = ("the file prints nothing", "no command for the bed: it stays as it is")  # of start and end code alone


def of_design(design: Design) -> list[Finding]:
    """Faults of a design's printer and quality, for the materials that it prints."""
    try:
        loaded = loads(design)
    except SensorgenError:  # a material without a tool or a value for printing: reported by what needs it
        loaded = {}
    wrong = faults(design.machine, design.layers, loaded)
    return [Finding(RULE, "error", design.machine.name, message, advice) for _, message, advice in wrong]


def faults(machine: Printer, layers: Quality, loaded: Mapping[int, ToolLoad]) -> Iterator[tuple[str, str, str]]:
    """Rule, message and advice for everything that is wrong.

    Parameters
    ----------
    machine, layers : Printer, Quality
        Whose files were read.
    loaded : mapping of int to ToolLoad
        What each tool prints.
    """
    from sensorgen.export.gcode.check import check
    from sensorgen.export.slicers import cura, orca, prusa

    names = " and ".join(load.material.name for load in loaded.values())
    try:
        if loaded:
            prusa.profile(machine, layers, loaded)
            cura.profiles(machine, layers, loaded)
            orca.profiles(machine, layers, loaded)
    except SensorgenError as error:
        what = f"no profile for {names} in {layers.layer_mm:g} mm layers: {error}"
        yield "profile", what, "correct the limits of the printer, or the quality"
    code = f"{machine.start_gcode}\n{machine.end_gcode}".splitlines()
    for fault in check(code, machine).findings:
        if fault.message not in _EMPTY:
            yield f"gcode-{fault.rule}", f"start and end code, line {fault.line}: {fault.message}", fault.advice
