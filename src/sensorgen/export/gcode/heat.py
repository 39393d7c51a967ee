"""Temperatures set for the heaters of a printer, and their limits."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import isnan, nan

from sensorgen.design.printer import Printer
from sensorgen.export.gcode.found import Found, error
from sensorgen.export.gcode.moves import Event

SWITCHES_ON = frozenset({"M104", "M109"})  # G10 and M568 S say how hot, and leave on or off what is


@dataclass
class Heat:
    """Settings of a tool: temperatures while printing and waiting [C], and whether it is on."""

    active_c: float = 0.0
    standby_c: float = 0.0
    on: bool = True

    @property
    def hot(self) -> bool:
        """Whether its heater is on."""
        return self.on and max(self.active_c, self.standby_c) > 0

    def tell(self, active_c: float | None, standby_c: float | None) -> None:
        """Take new temperatures; what is missing, or no number, stays as it was."""
        self.active_c = self.active_c if active_c is None or isnan(active_c) else active_c
        self.standby_c = self.standby_c if standby_c is None or isnan(standby_c) else standby_c


class Heaters:
    """All heaters of a printer, while its file is followed."""

    def __init__(self, machine: Printer) -> None:
        """Start cold."""
        self.machine = machine
        self.tools = {tool: Heat() for tool in machine.tool_numbers}

    def take(self, tool: int) -> None:
        """A tool is taken: its heater goes on, also where it was switched off before."""
        if tool in self.tools:
            self.tools[tool].on = True

    def hot(self) -> list[int]:
        """Tools that are heated."""
        return [tool for tool, heat in self.tools.items() if heat.hot]

    def cold(self, tool: int, number: int) -> Iterator[Found]:
        """Whether a tool that moves filament is too cold for it."""
        if tool not in self.tools:
            return
        given_c = self.tools[tool].active_c if self.tools[tool].on else 0.0
        coldest_c = self.machine.control.coldest_c
        if given_c < coldest_c:
            yield error(
                "cold", number, f"tool {tool} moves filament at {given_c:g} C; below {coldest_c:g} C it is cold",
                f"heat it before (G10 P{tool} S..)",
            )  # fmt: skip

    def told(self, event: Event, letter: str, in_hand: int) -> Iterator[Found]:
        """Set a tool's temperatures: of the one that ``letter`` names, or else the one in hand."""
        command, tool = event.command, _tool(event, letter, in_hand)
        if command.has(letter):
            yield from known_tool(self.machine, event, letter, "gets a temperature")
        elif self.machine.control.names_tools:
            yield error(
                "temperature", event.number, f"{command.code} sets a temperature and names no tool",
                f"name it: G10 P{max(in_hand, 1)} S.. R..",
            )  # fmt: skip
        active_c, standby_c = command.number("S"), command.number("R")
        yield from _too_hot(event.number, "a tool", (active_c, standby_c), self.machine.max_nozzle_c)
        if tool in self.tools:
            self.tools[int(tool)].tell(active_c, standby_c)
            self.tools[int(tool)].on |= command.code in SWITCHES_ON

    def state(self, event: Event, in_hand: int) -> Iterator[Found]:
        """Switch a tool off, to standby or on, and perhaps set its temperatures (M568)."""
        if event.command.has("SR"):
            yield from self.told(event, "P", in_hand)
        else:
            yield from known_tool(self.machine, event, "P", "gets a state")
        tool = _tool(event, "P", in_hand)
        if tool in self.tools and event.command.has("A"):
            self.tools[int(tool)].on = event.command.number("A") != 0

    def bed(self, event: Event) -> Iterator[Found]:
        """Set the bed's temperature."""
        values_c = event.command.number("S"), event.command.number("R")
        yield from _too_hot(event.number, "the bed", values_c, self.machine.max_bed_c)


def known_tool(machine: Printer, event: Event, letter: str, what: str) -> Iterator[Found]:
    """Whether a printer has the tool that a command names, if it names one."""
    if event.command.has(letter):
        yield from tool_there(machine, event.number, _tool(event, letter, 0), what)


def tool_there(machine: Printer, number: int, tool: float, what: str) -> Iterator[Found]:
    """Whether a printer has a tool; ``what`` happens to it in line ``number``."""
    if tool not in machine.tool_numbers:
        known = ", ".join(map(str, machine.tool_numbers))
        yield error(
            "tool", number, f"tool {tool:g} {what}; {machine.name} has {known}",
            "give the printer's own number; slicers count from 0",
        )  # fmt: skip


def _tool(event: Event, letter: str, in_hand: int) -> float:
    """Tool that a command names, nan where that is no number; without the word the one in hand."""
    if not event.command.has(letter):
        return in_hand
    value = event.command.number(letter)
    return nan if value is None else value


def _too_hot(number: int, what: str, values_c: Iterable[float | None], most_c: float) -> Iterator[Found]:
    for value_c in values_c:
        if value_c is not None and not value_c <= most_c:
            message = f"{what} is set to {value_c:g} C; the limit is {most_c:g} C"
            yield error("temperature", number, message, "print cooler")
