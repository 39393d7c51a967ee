"""What the commands of a file ask of the machine, one after the other: tools, heat, homing, modes, fans, macros."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.printer import Printer
from sensorgen.export.gcode.effects import STOPS, Effects, judge
from sensorgen.export.gcode.found import Found, error
from sensorgen.export.gcode.heat import Heaters, known_tool, tool_there
from sensorgen.export.gcode.moves import NO_TOOL, Change, Event, Motion
from sensorgen.export.gcode.reading import macro_name
from sensorgen.export.gcode.remarks import PRUSA

AXES = "XYZ"


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
        self.pushes = np.flatnonzero(motion.filament_mm != 0)
        self.prints = np.flatnonzero(motion.extruded_mm > 0)
        self.travels = np.flatnonzero(motion.length_mm > 0)
        self.changes = {change.number: change for change in motion.changes}
        start = machine.tool_at_start()
        self.tool = NO_TOOL if start is None else start
        self.last: Change | None = None
        self.heaters, self.effects = Heaters(machine), Effects()
        self.homed: set[str] = set()
        self.levelled = not self.control.levels
        self.relative = False
        self.absolute_e = True
        self.row = 0
        self.ended = self.stopped = ""
        self.seen: set[str] = set()
        self.warned: set[str] = set()
        self.does: dict[str, Callable[[Event], Iterator[Found]]] = {
            "G10": self._tool_settings, "M104": self._temperature, "M109": self._temperature, "M568": self._state,
            "M140": self._bed, "M190": self._bed, "M106": self._fan, "M107": self._fan, "M98": self._macro,
            "M82": self._absolute, "M83": self._relative_e, "G90": self._mode, "G91": self._mode, "G92": self._place,
            "M116": self._waits, "M18": self._motors_off, "M84": self._motors_off, "M561": self._unlevelled,
            "M290": self._height,
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
            yield from self._too_late(number)
        if (number := self._first(self.travels, first, row)) is not None:
            yield from self._moving(number)

    def _first(self, rows: NDArray[np.int64], start: int, end: int) -> int | None:
        """Line of the first of some moves in a stretch."""
        place = int(np.searchsorted(rows, start))
        return int(self.motion.rows[rows[place], 9]) if place < len(rows) and rows[place] < end else None

    def _pushing(self, number: int) -> Iterator[Found]:
        if self.tool == NO_TOOL:
            yield error("tool", number, "filament is moved before a tool is taken", "take a tool first (T)")
        elif self.tool in self.control.spindles:
            yield error("tool", number, f"tool {self.tool} is a spindle and cannot extrude", "use another tool")
        else:
            yield from self.heaters.cold(self.tool, number)
        if self.absolute_e and self.control.relative_e:
            yield error(
                "absolute-e", number, "filament is moved with absolute E", "write M83 at the start, and relative E"
            )

    def _printing(self, number: int) -> Iterator[Found]:
        if self.homed != set(AXES):
            yield error(
                "home",
                number,
                "the file prints before all axes are homed",
                f"home first ({' or '.join(self.control.homes)})",
            )
        if not self.levelled:
            yield error(
                "level", number, "the file prints before the bed is levelled",
                f"level first ({' or '.join(self.control.levels)})",
            )  # fmt: skip
        yield from self.effects.printing()
        if self.relative:
            yield error("relative", number, "the file prints in relative coordinates (G91)", "write G90 before it")

    def _moving(self, number: int) -> Iterator[Found]:
        if self.homed != set(AXES):
            yield Found("home", "warning", number, "a move comes before all axes are homed", "home first")
        if self.ended:
            yield Found("end", "warning", number, f"moves after {self.ended} are never reached", "remove them")

    def _too_late(self, number: int) -> Iterator[Found]:
        if ended := self.ended or self.stopped:
            message = f"lines after {ended} are never printed: it ends the print"
            yield error("end", number, message, "end the print after its last line")

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
        self.stopped = code if code in STOPS else self.stopped
        self.effects.obey(event)
        yield from judge(event.command, event.number)
        if code in self.does:
            yield from self.does[code](event)

    def _take(self, change: Change) -> Iterator[Found]:
        yield from tool_there(self.machine, change.number, change.tool, "is taken") if change.tool != NO_TOOL else ()
        last, self.last, self.tool = self.last, change, change.tool
        self.heaters.take(change.tool)
        twice = last and (last.tool, last.macro) == (change.tool, not change.macro) and last.number != change.number
        if last and twice and self._first(self.prints, last.row, change.row) is None:
            yield error(
                "tool-change", change.number,
                f"tool {change.tool} is taken twice, by T and by its macro: the macro takes it itself",
                "leave one of them out",
            )  # fmt: skip

    def _tool_settings(self, event: Event) -> Iterator[Found]:
        if event.command.has("SR") and not event.command.has("L"):
            yield from self.heaters.told(event, "P", self.tool)
        elif event.command.has("P") and not event.command.has("L"):
            yield from known_tool(self.machine, event, "P", "is set")

    def _temperature(self, event: Event) -> Iterator[Found]:
        yield from self.heaters.told(event, "T", self.tool)

    def _state(self, event: Event) -> Iterator[Found]:
        yield from self.heaters.state(event, self.tool)

    def _waits(self, event: Event) -> Iterator[Found]:
        yield from known_tool(self.machine, event, "P", "is waited for")

    def _bed(self, event: Event) -> Iterator[Found]:
        yield from self.heaters.bed(event)

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
            yield error(
                "macro", event.number, f"unknown macro {name[:60]!r}; {self.machine.name} has {known}",
                "leave it out, or add it to the printer's file (control: macros)",
            )  # fmt: skip

    def _absolute(self, event: Event) -> Iterator[Found]:
        self.absolute_e = True
        if self.control.relative_e:
            yield error("absolute-e", event.number, "M82 makes E absolute", "leave it out, and write relative E")

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

    def _motors_off(self, event: Event) -> Iterator[Found]:
        """The axes may drift, and count as not homed; a number of seconds only sets when that happens."""
        if not event.command.has("S"):
            self.homed -= {axis for axis in AXES if event.command.has(axis) or not event.command.has(f"{AXES}E")}
        yield from ()

    def _unlevelled(self, _: Event) -> Iterator[Found]:
        self.levelled = not self.control.levels
        yield from ()

    def _height(self, event: Event) -> Iterator[Found]:
        """All heights are shifted, as for a tool whose nozzle stands higher than the printer's others."""
        meant_mm = self.control.tool_offsets_mm.get(self.tool, 0.0)
        given_mm = next((event.command.number(letter) for letter in "SZ" if event.command.has(letter)), None)
        if given_mm is not None and (given_mm != meant_mm or event.command.number("R") != 0):
            yield Found(
                "height", "warning", event.number,
                f"M290 shifts all heights; the printer's file says {meant_mm:g} mm for tool {self.tool}",
                f"write M290 S{meant_mm:g} R0, or leave it out",
            )  # fmt: skip

    # What must have come by the end.

    def end(self) -> Iterator[Found]:
        """Judge the file as a whole."""
        last = max(1, self.motion.lines)
        if self.relative:
            yield error("relative", last, "the file ends in relative coordinates (G91)", "write G90 after the last G91")
        if not len(self.prints):
            yield Found("read", "warning", last, "the file prints nothing", "check that it is the right file")
        if "G90" not in self.seen:
            yield Found(
                "start", "warning", 1, "no G90: places count as the printer happens to take them", "write G90 first"
            )
        if not {"M140", "M190"} & self.seen:
            yield Found("start", "warning", 1, "no command for the bed: it stays as it is", "heat it (M140 or M190)")
        if self.control.ends and not self.ended:
            ends = " or ".join(self.control.ends)
            yield Found("end", "warning", last, f"no {ends}: the file may be cut short", f"end with {ends}")
        yield from self._left_on(last)
        yield from self._raw()

    def _raw(self) -> Iterator[Found]:
        """A slicer's own file counts tools from 0: those that the printer has too would be the wrong ones."""
        settings = [e.command for e in self.motion.events if e.command.code == "G10" and e.command.has("S")]
        untouched = settings and not any(command.has("R") for command in settings)
        if self.control.names_tools and self.motion.maker == PRUSA and untouched and "fan" in self.warned:
            yield error(
                "raw", 1, "this is PrusaSlicer's own file: it counts tools from 0, and the printer from 1",
                "let sensorgen slice write it",
            )  # fmt: skip

    def _left_on(self, last: int) -> Iterator[Found]:
        hot = self.heaters.hot()
        if not hot:
            return
        names = ", ".join(map(str, hot))
        if self.ended:
            yield Found(
                "heat-left", "info", last, f"tools {names} are left on to the macro of {self.ended}",
                "switch them off in the file (G10 P.. S0 R0) if that macro does not",
            )  # fmt: skip
        else:
            yield error(
                "heat-left", last, f"tools {names} are still heated at the end of the file",
                "switch them off (G10 P.. S0 R0), or end as the printer's other files do"
                f" ({' or '.join(self.control.ends) or 'see its manual'}); the file may be cut short",
            )  # fmt: skip
