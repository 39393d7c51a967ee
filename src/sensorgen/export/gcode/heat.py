"""Temperatures set for the heaters of a printer, and their limits."""

from dataclasses import dataclass
from math import isnan, nan

from sensorgen.design.printer import Printer
from sensorgen.export.gcode.found import Findings
from sensorgen.export.gcode.moves import Event

_NAMED = {"G10": "is set", "M116": "is waited for", "M568": "gets a state"}  # what happens to a tool that P names


@dataclass
class Heat:
    """Settings of a tool: temperatures while printing and waiting [C], and whether it is on."""

    active_c: float = 0.0
    standby_c: float = 0.0
    on: bool = True


class Heaters:
    """All heaters of a printer, cold at first, while its file is followed."""

    def __init__(self, machine: Printer, found: Findings) -> None:
        """Take the list that findings go to."""
        self.machine, self.found = machine, found
        self.tools = {tool: Heat() for tool in machine.tool_numbers}

    def take(self, tool: int) -> None:
        """A tool is taken: its heater goes on, also where it was switched off before."""
        if tool in self.tools:
            self.tools[tool].on = True

    def hot(self) -> list[int]:
        """Tools that are heated."""
        return [tool for tool, heat in self.tools.items() if heat.on and max(heat.active_c, heat.standby_c) > 0]

    def check_cold(self, tool: int, number: int) -> None:
        """Whether a tool that moves filament is too cold for it."""
        heat, coldest_c = self.tools.get(tool), self.machine.control.coldest_c
        given_c = heat.active_c if heat and heat.on else 0.0
        if heat and given_c < coldest_c:
            message = f"tool {tool} moves filament at {given_c:g} C; below {coldest_c:g} C it is cold"
            self.found.error("cold", number, message, f"heat it before (G10 P{tool} S..)")

    def obey(self, event: Event, in_hand: int) -> None:
        """Follow a command that sets a temperature or names a tool by P; G10 with L does neither."""
        command, code = event.command, event.command.code
        if code in ("M140", "M190"):
            self._check_hot(event, "the bed", self.machine.max_bed_c)
        elif code in ("M104", "M109"):
            self._set(event, "T", in_hand)
        elif code in _NAMED and not (code == "G10" and command.has("L")):
            if code != "M116" and command.has("SR"):
                self._set(event, "P", in_hand)
            elif command.has("P"):
                self.check_tool(event.number, _tool(event, "P", 0), _NAMED[code])
            heat = self.tools.get(_tool(event, "P", in_hand))  # type: ignore[call-overload]
            if heat and code == "M568" and command.has("A"):  # off, standby or on
                heat.on = command.number("A") != 0

    def _set(self, event: Event, letter: str, in_hand: int) -> None:
        """Set a tool's temperatures: of the one that ``letter`` names, or else the one in hand."""
        command, tool = event.command, _tool(event, letter, in_hand)
        if command.has(letter):
            self.check_tool(event.number, tool, "gets a temperature")
        elif self.machine.control.names_tools:
            message, advice = f"{command.code} sets a temperature and names no tool", f"G10 P{max(in_hand, 1)} S.. R.."
            self.found.error("temperature", event.number, message, f"name it: {advice}")
        self._check_hot(event, "a tool", self.machine.max_nozzle_c)
        if tool in self.tools:
            heat, active_c, standby_c = self.tools[int(tool)], command.number("S"), command.number("R")
            heat.active_c = heat.active_c if active_c is None or isnan(active_c) else active_c
            heat.standby_c = heat.standby_c if standby_c is None or isnan(standby_c) else standby_c
            heat.on |= command.code in ("M104", "M109")  # G10 and M568 S leave on or off what is

    def check_tool(self, number: int, tool: float, what: str) -> None:
        """Whether the printer has a tool; ``what`` happens to it in line ``number``."""
        if tool not in self.machine.tool_numbers:
            known = ", ".join(map(str, self.machine.tool_numbers))
            message = f"tool {tool:g} {what}; {self.machine.name} has {known}"
            self.found.error("tool", number, message, "give the printer's own number; slicers count from 0")

    def _check_hot(self, event: Event, what: str, most_c: float) -> None:
        for value_c in (event.command.number("S"), event.command.number("R")):
            if value_c is not None and not value_c <= most_c:
                message = f"{what} is set to {value_c:g} C; the limit is {most_c:g} C"
                self.found.error("temperature", event.number, message, "print cooler")


def _tool(event: Event, letter: str, in_hand: int) -> float:
    """Tool that a command names, nan where that is no number; without the word the one in hand."""
    if not event.command.has(letter):
        return in_hand
    value = event.command.number(letter)
    return nan if value is None else value
