"""What the commands of a file ask of the machine, one after the other: tools, heat, homing, modes, fans, macros."""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import isnan

import numpy as np

from sensorgen.gcode.found import Found
from sensorgen.gcode.motion import NO_TOOL, Change, Event, Motion, macro_name
from sensorgen.gcode.remarks import PRUSA
from sensorgen.gcode.words import Command
from sensorgen.printer import Printer

AXES = "XYZ"


@dataclass
class Heat:
    """What a tool is told: temperatures while it prints and while it waits [C], and whether it is on."""

    active_c: float = 0.0
    standby_c: float = 0.0
    on: bool = True

    @property
    def hot(self) -> bool:
        """Whether its heater is on."""
        return self.on and max(self.active_c, self.standby_c) > 0


def check(motion: Motion, machine: Printer) -> Iterator[Found]:
    """Findings of all rules on commands, and on what is printed between them.

    Parameters
    ----------
    motion : Motion
        The file.
    machine : Printer
        Who is to print it.
    """
    simulation = _Simulation(motion, machine)
    for event in motion.events:
        yield from simulation.until(event.row)
        yield from simulation.obey(event)
    yield from simulation.until(len(motion.rows))
    yield from simulation.end()


class _Simulation:
    """The machine between two moves."""

    def __init__(self, motion: Motion, machine: Printer) -> None:
        self.motion, self.machine, self.control = motion, machine, machine.control
        self.pushes = np.flatnonzero(motion.filament_mm != 0).tolist()
        self.prints = np.flatnonzero(motion.extruded_mm > 0).tolist()
        self.travels = np.flatnonzero(motion.length_mm() > 0).tolist()
        self.changes = {change.number: change for change in motion.changes}
        self.tool = NO_TOOL
        self.last: Change | None = None
        self.heat = {tool: Heat() for tool in machine.tool_numbers}
        self.homed: set[str] = set()
        self.levelled = not self.control.levels
        self.relative = False
        self.absolute_e = True
        self.row = 0
        self.ended = ""
        self.seen: set[str] = set()
        self.warned: set[str] = set()
        self.does: dict[str, Callable[[Event], Iterator[Found]]] = {
            "G10": self._tool_settings, "M104": self._temperature, "M109": self._temperature, "M568": self._state,
            "M140": self._bed, "M190": self._bed, "M106": self._fan, "M107": self._fan, "M98": self._macro,
            "M82": self._absolute, "M83": self._relative_e, "G90": self._mode, "G91": self._mode, "G92": self._place,
            "M116": self._waits,
        }  # fmt: skip

    # What holds for a stretch of moves.

    def until(self, row: int) -> Iterator[Found]:
        """Judge the moves from the last event to this one."""
        first, self.row = self.row, row
        if first == row:
            return
        if (number := self._first(self.pushes, first, row)) is not None:
            yield from self._pushing(number)
        if (number := self._first(self.prints, first, row)) is not None:
            yield from self._printing(number)
        if (number := self._first(self.travels, first, row)) is not None:
            yield from self._moving(number)

    def _first(self, rows: list[int], start: int, end: int) -> int | None:
        """Line of the first of some moves in a stretch."""
        place = bisect_left(rows, start)
        return int(self.motion.rows[rows[place], 9]) if place < len(rows) and rows[place] < end else None

    def _pushing(self, number: int) -> Iterator[Found]:
        if self.tool == NO_TOOL:
            yield _error("tool", number, "filament is moved before a tool is taken", "take a tool first (T)")
        elif self.tool in self.control.spindles:
            yield _error("tool", number, f"tool {self.tool} is a spindle and cannot extrude", "use another tool")
        elif self.tool in self.heat:
            yield from self._cold(number, self.heat[self.tool])
        if self.absolute_e and self.control.relative_e:
            yield _error(
                "absolute-e", number, "filament is moved with absolute E", "write M83 at the start, and relative E"
            )

    def _cold(self, number: int, heat: Heat) -> Iterator[Found]:
        given_c = heat.active_c if heat.on else 0.0
        if given_c < self.control.coldest_c:
            yield _error(
                "cold", number,
                f"tool {self.tool} moves filament at {given_c:g} C; below {self.control.coldest_c:g} C it is cold",
                f"heat it before (G10 P{self.tool} S..)",
            )  # fmt: skip

    def _printing(self, number: int) -> Iterator[Found]:
        if self.homed != set(AXES):
            yield _error(
                "home",
                number,
                "the file prints before all axes are homed",
                f"home first ({' or '.join(self.control.homes)})",
            )
        if not self.levelled:
            yield _error(
                "level", number, "the file prints before the bed is levelled",
                f"level first ({' or '.join(self.control.levels)})",
            )  # fmt: skip
        if self.relative:
            yield _error("relative", number, "the file prints in relative coordinates (G91)", "write G90 before it")

    def _moving(self, number: int) -> Iterator[Found]:
        if self.homed != set(AXES):
            yield Found("home", "warning", number, "a move comes before all axes are homed", "home first")
        if self.ended:
            yield Found("end", "warning", number, f"moves after {self.ended} are never reached", "remove them")

    # What each command does.

    def obey(self, event: Event) -> Iterator[Found]:
        """Follow one command."""
        code = event.command.code
        self.seen.add(code)
        if change := self.changes.get(event.number):
            yield from self._take(change)
        if code in self.control.homes:
            self.homed |= {axis for axis in AXES if event.command.has(axis) or not event.command.has(AXES)}
        self.levelled |= code in self.control.levels
        if code in self.control.ends:
            self.ended = " ".join([code, *(f"{a}{b}" for a, b in event.command.words)])
        if code in self.does:
            yield from self.does[code](event)

    def _take(self, change: Change) -> Iterator[Found]:
        yield from self._known(change.number, change.tool, "is taken") if change.tool != NO_TOOL else ()
        last, self.last, self.tool = self.last, change, change.tool
        if last and (last.tool, last.macro) == (change.tool, not change.macro) and last.number != change.number:
            start = bisect_left(self.prints, last.row)
            if start >= len(self.prints) or self.prints[start] >= change.row:
                yield _error(
                    "tool-change", change.number,
                    f"tool {change.tool} is taken twice, by T and by its macro: the macro takes it itself",
                    "leave one of them out",
                )  # fmt: skip

    def _known(self, number: int, tool: float, what: str) -> Iterator[Found]:
        if tool not in self.heat:
            known = ", ".join(map(str, self.machine.tool_numbers))
            yield _error(
                "tool", number, f"tool {tool:g} {what}; {self.machine.name} has {known}",
                "give the printer's own number; slicers count from 0",
            )  # fmt: skip

    def _tool_settings(self, event: Event) -> Iterator[Found]:
        if event.command.has("SR") and not event.command.has("L"):
            yield from self._set(event, "P", event.command.number("S"), event.command.number("R"))
        elif event.command.has("P") and not event.command.has("L"):
            yield from self._known(event.number, _whole(event.command, "P"), "is set")

    def _temperature(self, event: Event) -> Iterator[Found]:
        yield from self._set(event, "T", event.command.number("S"), event.command.number("R"))

    def _set(self, event: Event, letter: str, active_c: float | None, standby_c: float | None) -> Iterator[Found]:
        """Tell a tool its temperatures; the tool in hand where the command names none."""
        tool: float = self.tool
        if event.command.has(letter):
            tool = _whole(event.command, letter)
            yield from self._known(event.number, tool, "gets a temperature")
        elif self.control.names_tools:
            yield _error(
                "temperature", event.number, f"{event.command.code} sets a temperature and names no tool",
                f"name it: G10 P{max(self.tool, 1)} S.. R..",
            )  # fmt: skip
        most_c = self.machine.max_nozzle_c
        for value_c in (active_c, standby_c):
            if value_c is not None and not value_c <= most_c:
                yield _error(
                    "temperature",
                    event.number,
                    f"a tool is set to {value_c:g} C; the limit is {most_c:g} C",
                    "print cooler",
                )
        if tool in self.heat:
            self._tell(self.heat[int(tool)], active_c, standby_c)

    @staticmethod
    def _tell(heat: Heat, active_c: float | None, standby_c: float | None) -> None:
        heat.on = True
        heat.active_c = heat.active_c if active_c is None or isnan(active_c) else active_c
        heat.standby_c = heat.standby_c if standby_c is None or isnan(standby_c) else standby_c

    def _state(self, event: Event) -> Iterator[Found]:
        if event.command.has("SR"):
            yield from self._set(event, "P", event.command.number("S"), event.command.number("R"))
        elif event.command.has("P"):
            yield from self._known(event.number, _whole(event.command, "P"), "gets a state")
        tool = _whole(event.command, "P") if event.command.has("P") else self.tool
        if tool in self.heat and event.command.has("A"):
            self.heat[int(tool)].on = event.command.number("A") != 0

    def _waits(self, event: Event) -> Iterator[Found]:
        if event.command.has("P"):
            yield from self._known(event.number, _whole(event.command, "P"), "is waited for")

    def _bed(self, event: Event) -> Iterator[Found]:
        values_c = event.command.number("S"), event.command.number("R")
        yield from _too_hot(event.number, "the bed", values_c, self.machine.max_bed_c)

    def _fan(self, event: Event) -> Iterator[Found]:
        fan = self.control.layer_fan
        if fan is not None and not event.command.has("P"):
            self.warned.add("fan")
            yield Found(
                "fan", "warning", event.number, f"{event.command.code} names no fan, and may miss the one on the part",
                f"name it: M106 P{fan} S..",
            )  # fmt: skip

    def _macro(self, event: Event) -> Iterator[Found]:
        name = macro_name(event.command)
        if event.number not in self.changes and name not in self.control.macros:
            known = ", ".join(filter(None, (self.control.prime_macro, *self.control.macros))) or "none"
            yield _error(
                "macro", event.number, f"nobody knows the macro {name[:60]!r}; {self.machine.name} has {known}",
                "leave it out, or add it to the printer's file (control: macros)",
            )  # fmt: skip

    def _absolute(self, event: Event) -> Iterator[Found]:
        self.absolute_e = True
        if self.control.relative_e:
            yield _error("absolute-e", event.number, "M82 makes E absolute", "leave it out, and write relative E")

    def _relative_e(self, _: Event) -> Iterator[Found]:
        self.absolute_e = False
        yield from ()

    def _mode(self, event: Event) -> Iterator[Found]:
        self.relative = event.command.code == "G91"
        yield from ()

    def _place(self, event: Event) -> Iterator[Found]:
        if event.command.has(AXES) or not event.command.has("E"):
            yield Found(
                "place", "warning", event.number, "G92 names the place anew; limits are checked in the new coordinates",
                "leave it out",
            )  # fmt: skip

    # What must have come by the end.

    def end(self) -> Iterator[Found]:
        """Judge the file as a whole."""
        last = max(1, self.motion.lines)
        if self.relative:
            yield _error(
                "relative", last, "the file ends in relative coordinates (G91)", "write G90 after the last G91"
            )
        if not self.prints:
            yield Found("read", "warning", last, "the file prints nothing", "check that it is the right file")
        if "G90" not in self.seen:
            yield Found(
                "start", "warning", 1, "no G90: places count as the printer happens to take them", "write G90 first"
            )
        if not {"M140", "M190"} & self.seen:
            yield Found("start", "warning", 1, "no command for the bed: it stays as it is", "heat it (M140 or M190)")
        yield from self._left_on(last)
        yield from self._raw()

    def _raw(self) -> Iterator[Found]:
        """A slicer's own file counts tools from 0: those that the printer has too would be the wrong ones."""
        settings = [e.command for e in self.motion.events if e.command.code == "G10" and e.command.has("S")]
        untouched = settings and not any(command.has("R") for command in settings)
        if self.control.names_tools and self.motion.maker == PRUSA and untouched and "fan" in self.warned:
            yield _error(
                "raw", 1, "this is PrusaSlicer's own file: it counts tools from 0, and the printer from 1",
                "let sensorgen slice write it",
            )  # fmt: skip

    def _left_on(self, last: int) -> Iterator[Found]:
        hot = [tool for tool, heat in self.heat.items() if heat.hot]
        if not hot:
            return
        names = ", ".join(map(str, hot))
        if self.ended:
            yield Found(
                "heat-left", "info", last, f"tools {names} are left on to the macro of {self.ended}",
                "switch them off in the file (G10 P.. S0 R0) if that macro does not",
            )  # fmt: skip
        else:
            yield _error(
                "heat-left", last, f"tools {names} are still heated at the end of the file",
                "switch them off (G10 P.. S0 R0), or end as the printer's other files do"
                f" ({' or '.join(self.control.ends) or 'see its manual'}); the file may be cut short",
            )  # fmt: skip


def _too_hot(number: int, what: str, values_c: Iterable[float | None], most_c: float) -> Iterator[Found]:
    for value_c in values_c:
        if value_c is not None and not value_c <= most_c:
            yield _error(
                "temperature", number, f"{what} is set to {value_c:g} C; the limit is {most_c:g} C", "print cooler"
            )


def _whole(command: Command, letter: str) -> float:
    """Tool number of a word; nan, which no tool has, where it is none."""
    value = command.number(letter)
    return float("nan") if value is None else value


def _error(rule: str, number: int, message: str, advice: str) -> Found:
    return Found(rule, "error", number, message, advice)
