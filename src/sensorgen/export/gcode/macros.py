"""Net effect of the macros that a firmware runs at a change of tool: where the nozzle is then, and in which modes."""

from dataclasses import dataclass
from functools import lru_cache
from math import nan

from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import words
from sensorgen.export.gcode.words import Command

_RESTORE = 2.0  # point at which RepRapFirmware stores where a tool was taken


@dataclass(frozen=True)
class Effect:
    """State of the machine after macros.

    Attributes
    ----------
    offset_mm : tuple of float
        From where the nozzle was, along X, Y and Z [mm].
    place_mm : tuple of float
        Absolute position instead; nan for none [mm].
    relative : bool or None
        Mode of places left behind; None if unchanged.
    waits : bool
        Wait for the temperature of the tool (M116).
    """

    offset_mm: tuple[float, ...]
    place_mm: tuple[float, ...]
    relative: bool | None
    waits: bool


def of_change(machine: Printer) -> Effect | None:
    """Effect of a change of tool; None where the printer's file states no macro of it."""
    text = machine.macro("tfree", "tpre", "tpost")  # run in this order
    return None if text is None else effect(text)


@lru_cache(maxsize=64)
def effect(text: str) -> Effect:
    r"""Execute lines of macros.

    Raises
    ------
    BadInput
        A line that cannot be followed, as a condition.

    Examples
    --------
    >>> effect("G91\nG1 Z40\nG90\nG1 R2 X0 Y0\nG1 R2 Z2")
    Effect(offset_mm=(0.0, 0.0, 2.0), place_mm=(nan, nan, nan), relative=False, waits=False)
    """
    offset, place, relative, waits = [0.0] * 3, [nan] * 3, None, False
    for line in text.splitlines():
        parsed = words.parse(line)
        if parsed.faults:
            raise BadInput(f"macros: {line.strip()[:60]!r} cannot be followed; state its effect: lift_mm, return_mm")
        for command in parsed.commands:
            waits |= command.code == "M116"
            relative = {"G90": False, "G91": True}.get(command.code, relative)
            if command.code in ("G0", "G1"):
                _move(command, offset, place, relative=bool(relative))
    return Effect(tuple(offset), tuple(place), relative, waits)


def _move(command: Command, offset: list[float], place: list[float], *, relative: bool) -> None:
    for k, axis in enumerate("XYZ"):
        value = command.number(axis)
        if value is None:
            continue
        if command.number("R") == _RESTORE:
            offset[k], place[k] = value, nan
        elif relative:
            offset[k], place[k] = offset[k] + value, place[k] + value
        else:
            place[k] = value
