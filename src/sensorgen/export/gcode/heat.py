"""Temperatures set for the heaters of a printer, and their limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan, nan

from sensorgen.design.materials import Material
from sensorgen.design.printer import Printer
from sensorgen.export.gcode.found import Findings
from sensorgen.export.gcode.moves import Event
from sensorgen.export.gcode.words import Command

WITHIN_C = 15.0  # slicers raise a temperature by less after the first layer without waiting
BED_WITHIN_C = 15.0  # sources that give the bed one temperature differ by as much: 60 to 75 C for the same TPU
STANDBY_BELOW_C = 10.0  # of a tool that waits, below the temperature at which it prints
_NAMED = {"G10": "is set", "M568": "gets a state"}  # what happens to a tool that P names


@dataclass
class Heat:
    """Settings of a tool: temperatures while printing and waiting [C], whether it is on, and what was waited for."""

    active_c: float = 0.0
    standby_c: float = 0.0
    on: bool = True
    stated: bool = False  # a standby temperature was given
    rests_c: float | None = None  # standby temperature with which it was put down
    awaited_c: float = 0.0  # no hotter than this it is known to be
    rested: bool = False  # in the turret at its standby temperature, and not waited for since

    def wait(self) -> None:
        """Wait for the temperature."""
        self.awaited_c, self.rested = self.active_c, False


class Heaters:
    """All heaters of a printer, cold at first, while its file is followed."""

    def __init__(self, machine: Printer, loaded: Mapping[int, Material], findings: Findings) -> None:
        """Take the material of each tool, as far as it is known, and the list that findings go to."""
        self.machine, self.findings = machine, findings
        self.materials = dict(loaded)
        self.tools = {tool: Heat() for tool in machine.tool_numbers}
        self.bed = Heat()

    def put_down(self, tool: int) -> None:
        """A tool goes to the turret."""
        if tool in self.tools:
            self.tools[tool].rests_c = self.tools[tool].standby_c if self.tools[tool].stated else None

    def _check_rest(self, tool: int, number: int) -> None:
        """A tool that prints again has waited neither cold nor oozing."""
        heat, control = self.tools[tool], self.machine.control
        low_c, high_c = control.coldest_c, heat.active_c - STANDBY_BELOW_C
        if tool not in self.materials:
            return  # the maker's own files have waited as hot as they print
        if control.standby_c is not None and heat.rests_c is not None and not low_c <= heat.rests_c <= high_c:
            message = f"tool {tool} has waited at {heat.rests_c:g} C between its lines"
            advice = f"keep it at {low_c:g} to {high_c:g} C (G10 P{tool} R..)"
            self.findings.error("standby", number, message, advice)

    def take(self, tool: int, number: int, *, waits: bool) -> None:
        """A tool is taken, by a macro that ``waits`` for its heat or not; it goes on, also where it was off before."""
        if tool in self.tools:
            self._check_rest(tool, number)
            heat = self.tools[tool]
            heat.on, heat.rested = True, self.machine.control.names_tools and heat.standby_c < heat.active_c
            if waits:
                heat.wait()

    def hot(self) -> list[int]:
        """Tools that are heated."""
        return [tool for tool, heat in self.tools.items() if heat.on and max(heat.active_c, heat.standby_c) > 0]

    def check_cold(self, tool: int, number: int) -> None:
        """Check that a tool that moves filament is not too cold for it."""
        heat, coldest_c = self.tools.get(tool), self.machine.control.coldest_c
        given_c = heat.active_c if heat and heat.on else 0.0
        if heat and given_c < coldest_c:
            message = f"tool {tool} moves filament at {given_c:g} C; below {coldest_c:g} C it is cold"
            self.findings.error("cold", number, message, f"heat it before (G10 P{tool} S..)")

    def check_printing(self, tool: int, number: int) -> None:
        """Check that the tool that prints a line, and the bed, suit its material and have been waited for."""
        self._check_material(tool, number)
        heat, advice = self.tools.get(tool), f"wait for it before (M116 P{tool})"
        if heat and heat.active_c > heat.awaited_c + WITHIN_C:
            message = f"tool {tool} prints without waiting for its {heat.active_c:g} C"
            self.findings.error("wait", number, message, advice)
        elif heat and heat.rested:
            message = f"tool {tool} prints at {heat.active_c:g} C straight from standby ({heat.standby_c:g} C)"
            known = tool in self.materials and self.machine.macro("tpost") is not None  # which has no wait
            low_c = self.materials[tool].print_range("nozzle_temperature_c", WITHIN_C)[0] if known else 0.0
            severity = "error" if heat.standby_c < low_c else "warning"
            self.findings.add(severity, "wait", number, message, advice)
        if self.bed.active_c > self.bed.awaited_c + WITHIN_C:
            message = f"lines are printed without waiting for the bed's {self.bed.active_c:g} C"
            self.findings.error("wait", number, message, "wait for it before (M190)")

    def _check_material(self, tool: int, number: int) -> None:
        material, heat = self.materials.get(tool), self.tools.get(tool)
        if material is None or heat is None:
            return
        for what, given_c, quantity, command in (
            (f"tool {tool}", heat.active_c if heat.on else 0.0, "nozzle_temperature_c", f"G10 P{tool} S"),
            ("the bed", self.bed.active_c, "bed_temperature_c", "M190 S"),
        ):
            low_c, high_c = material.print_range(quantity, BED_WITHIN_C if what == "the bed" else WITHIN_C)
            if not low_c <= given_c <= high_c:
                message = f"{what} is at {given_c:g} C for {material.name}; its sources give {low_c:g} to {high_c:g} C"
                self.findings.error("material", number, message, f"set it in this range ({command}..)")

    def obey(self, event: Event, in_hand: int) -> None:
        """Follow a command that sets a temperature or names a tool by P; G10 with L does neither."""
        command, code = event.command, event.command.code
        if code in ("M140", "M190"):
            self._set_bed(event)
        elif code in ("M104", "M109"):
            self._set(event, "T", in_hand)
        elif code == "M116":
            self._await(event)
        elif code in _NAMED and not (code == "G10" and command.has("L")):
            self._name(event, in_hand)

    def _await(self, event: Event) -> None:
        """Wait for the tool that P names, or for all."""
        if event.command.has("P"):
            tool = _tool(event, "P", 0)
            self.check_tool(event.number, tool, "is waited for")
            heats = [self.tools[int(tool)]] if tool in self.tools else []
        else:
            heats = [*self.tools.values(), self.bed]
        for heat in heats:
            heat.wait()

    def _set_bed(self, event: Event) -> None:
        command = event.command
        self._check_hot(event, "the bed", self.machine.max_bed_c)
        self.bed.active_c = _given(command, "S" if command.has("S") else "R", self.bed.active_c)
        self.bed.awaited_c = min(self.bed.awaited_c, self.bed.active_c)
        if command.code == "M190":
            self.bed.wait()

    def _name(self, event: Event, in_hand: int) -> None:
        """Set the tool that P names, or its state."""
        command, code = event.command, event.command.code
        if command.has("SR"):
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
            self.findings.error("temperature", event.number, message, f"name it: {advice}")
        self._check_hot(event, "a tool", self.machine.max_nozzle_c)
        if tool in self.tools:
            heat = self.tools[int(tool)]
            heat.active_c, heat.standby_c = _given(command, "S", heat.active_c), _given(command, "R", heat.standby_c)
            heat.stated |= command.has("R")
            heat.awaited_c = min(heat.awaited_c, heat.active_c)
            if command.code == "M109":
                heat.wait()
            heat.on |= command.code in ("M104", "M109")  # G10 and M568 S leave on or off what is

    def check_tool(self, number: int, tool: float, what: str) -> None:
        """Check that the printer has a tool; ``what`` happens to it in line ``number``."""
        if tool not in self.machine.tool_numbers:
            known = ", ".join(map(str, self.machine.tool_numbers))
            message = f"tool {tool:g} {what}; {self.machine.name} has {known}"
            self.findings.error("tool", number, message, "give the printer's own number; slicers count from 0")

    def _check_hot(self, event: Event, what: str, most_c: float) -> None:
        for value_c in (event.command.number("S"), event.command.number("R")):
            if value_c is not None and not value_c <= most_c:
                message = f"{what} is set to {value_c:g} C; the limit is {most_c:g} C"
                self.findings.error("temperature", event.number, message, "print cooler")


def _given(command: Command, letter: str, before_c: float) -> float:
    """Temperature that a command sets; the one before where it gives none [C]."""
    value_c = command.number(letter)
    return before_c if value_c is None or isnan(value_c) else value_c


def _tool(event: Event, letter: str, in_hand: int) -> float:
    """Tool that a command names, nan where that is no number; without the word the one in hand."""
    if not event.command.has(letter):
        return in_hand
    value = event.command.number(letter)
    return nan if value is None else value
