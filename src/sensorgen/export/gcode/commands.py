"""Commands of a file, executed one after the other: tools, heat, homing, modes, fans, macros."""

from collections.abc import Mapping

import numpy as np

from sensorgen.core.arrays import Whole
from sensorgen.design.materials import Material
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import limits, words
from sensorgen.export.gcode.found import PRUSA, Findings
from sensorgen.export.gcode.heat import Heaters
from sensorgen.export.gcode.moves import NO_TOOL, Event, Motion, ToolChange
from sensorgen.export.gcode.reading import macro_name

AXES = "XYZ"
PAUSES = ("M25", "M226", "M600", "M601")


def check(motion: Motion, machine: Printer, loaded: Mapping[int, Material]) -> Findings:
    """Findings of all rules on commands, and on what is printed between them.

    Parameters
    ----------
    motion : Motion
        The file.
    machine : Printer
        Who is to print it.
    loaded : mapping of int to Material
        Of each tool, as far as it is known.
    """
    simulation = _Simulation(motion, machine, loaded)
    for event in motion.events:
        simulation.until(event.row)
        simulation.obey(event)
    simulation.until(len(motion.rows))
    simulation.end()
    return simulation.findings


class _Simulation:
    """The machine between two moves."""

    def __init__(self, motion: Motion, machine: Printer, loaded: Mapping[int, Material]) -> None:
        self.motion, self.machine, self.control, self.findings = motion, machine, machine.control, Findings()
        self.pushes = np.flatnonzero(motion.filament_mm != 0)
        self.prints = np.flatnonzero(motion.extruded_mm > 0)
        self.lines = np.flatnonzero((motion.extruded_mm > 0) & (motion.across_mm > 0))
        self.travels = np.flatnonzero(motion.length_mm > 0)
        self.changes = {change.number: change for change in motion.changes}
        start = machine.tool_at_start()
        self.tool = NO_TOOL if start is None else start
        self.last: ToolChange | None = None
        self.heaters, self.turning = Heaters(machine, loaded, self.findings), words.of_change(machine)
        self.homed: set[str] = set()
        self.levelled = not self.control.levels
        self.relative, self.absolute_e, self.fan_missed = False, True, False
        self.row = 0
        self.ended, self.end_line = "", 0
        self.seen: set[str] = set()

    def until(self, row: int) -> None:
        """Judge the moves from the last event to this one."""
        first, self.row = self.row, row
        pushed, printed, moved = (self._first(rows, first, row) for rows in (self.pushes, self.prints, self.travels))
        if pushed:
            self._pushing(pushed)
        if printed:
            self._printing(printed)
        if line := self._first(self.lines, first, row):
            self.heaters.check_printing(self.tool, line)
        if moved and self.homed != set(AXES):
            self._not_homed("a move comes", moved)
        if moved and self.ended:
            self.findings.warning("end", moved, f"moves after {self.ended} are never reached", "remove them")

    def _first(self, rows: Whole, start: int, end: int) -> int:
        """Line of the first of some moves in a stretch; 0 if there is none."""
        place = int(np.searchsorted(rows, start))
        return int(self.motion.rows[rows[place], 9]) if place < len(rows) and rows[place] < end else 0

    def _pushing(self, number: int) -> None:
        error = self.findings.error
        if self.tool == NO_TOOL:
            error("tool", number, "filament is moved before a tool is taken", "take a tool first (T)")
        elif self.tool in self.control.spindles:
            error("tool", number, f"tool {self.tool} is a spindle and cannot extrude", "use another tool")
        else:
            self.heaters.check_cold(self.tool, number)
        if self.absolute_e and self.control.relative_e:
            error("absolute-e", number, "filament is moved with absolute E", "write M83 at the start, and relative E")

    def _printing(self, number: int) -> None:
        error = self.findings.error
        if not self.levelled:
            advice = f"level first ({' or '.join(self.control.levels)})"
            error("level", number, "the file prints before the bed is levelled", advice)
        if self.relative:
            error("relative", number, "the file prints in relative coordinates (G91)", "write G90 before it")
        if self.ended:
            what = f"lines after {self.ended} are never printed: it ends the print"
            error("end", number, what, "end the print after its last line")

    def _not_homed(self, what: str, number: int) -> None:
        homes = " or ".join(self.control.homes)
        self.findings.error("home", number, f"{what} before all axes are homed", f"home first ({homes})")

    def obey(self, event: Event) -> None:
        """Follow one command."""
        code = event.command.code
        self.seen.add(code)
        if change := self.changes.get(event.number):
            self._take(change)
        if code in self.control.homes:
            self.homed |= {axis for axis in AXES if event.command.has(axis) or not event.command.has(AXES)}
        if code in self.control.levels:
            self.levelled = True
            if self.homed != set(AXES):
                self._not_homed(f"{code} probes the bed", event.number)
        if code in self.control.ends and not self.ended:
            self.ended, self.end_line = str(event.command), event.number
        if code in PAUSES:
            self._pause(event)
        self.heaters.obey(event, self.tool)
        self._modes(event)
        self._fan(event)
        self._macro(event)
        self._height(event)

    def _take(self, change: ToolChange) -> None:
        if change.tool != NO_TOOL:
            self.heaters.check_tool(change.number, change.tool, "is taken")
        last, self.last = self.last, change
        if change.tool != self.tool:
            self.heaters.put_down(self.tool)
        self.tool = change.tool
        self.heaters.take(change.tool, change.number, waits=change.macro or bool(self.turning and self.turning.waits))
        twice = last and (last.tool, last.macro) == (change.tool, not change.macro) and last.number != change.number
        if last and twice and not self._first(self.prints, last.row, change.row):
            message = f"tool {change.tool} is taken twice, by T and by its macro: the macro takes it itself"
            self.findings.error("tool-change", change.number, message, "leave one of them out")

    def _modes(self, event: Event) -> None:
        """Modes of later lines, and what the axes still know."""
        code, command = event.command.code, event.command
        if code in ("M82", "M83"):
            self.absolute_e = code == "M82"
            if self.absolute_e and self.control.relative_e:
                advice = "leave it out, and write relative E"
                self.findings.error("absolute-e", event.number, "M82 makes E absolute", advice)
        elif code in ("G90", "G91"):
            self.relative = code == "G91"
        elif code in ("M18", "M84") and not command.has("S"):  # the axes may drift; S only sets when that happens
            self.homed -= {axis for axis in AXES if command.has(axis) or not command.has(f"{AXES}E")}

    def _pause(self, event: Event) -> None:
        amid = len(self.lines) and self.lines[0] < event.row <= self.lines[-1]
        message = f"{event.command.code} waits for a person to continue"
        message, severity = (f"{message}, with the nozzle at the part", "error") if amid else (message, "info")
        self.findings.add(severity, "pause", event.number, message, "be there, or leave it out")

    def _fan(self, event: Event) -> None:
        code, fan = event.command.code, self.control.layer_fan
        if code in ("M106", "M107") and fan is not None and not event.command.has("P"):
            message = f"{code} names no fan, and may miss the one on the part"
            self.fan_missed = True
            self.findings.warning("fan", event.number, message, f"name it: M106 P{fan} S..")

    def _macro(self, event: Event) -> None:
        called = event.command.code == "M98" and event.number not in self.changes
        if called and (name := macro_name(event.command)) not in self.control.macros:
            known = ", ".join(filter(None, (self.control.prime_macro, *self.control.macros))) or "none"
            message = f"unknown macro {name[:60]!r}; {self.machine.name} has {known}"
            advice = "leave it out, or add it to the printer's file (control: macros)"
            self.findings.error("macro", event.number, message, advice)

    def _height(self, event: Event) -> None:
        """Check M290, which shifts all heights as for a tool whose nozzle stands higher than others."""
        command, meant_mm = event.command, self.control.tool_offsets_mm.get(self.tool, 0.0)
        given_mm = command.number("S" if command.has("S") else "Z") if command.code == "M290" else None
        if given_mm is not None and (given_mm != meant_mm or command.number("R") != 0):
            message = f"M290 shifts all heights; the printer's file says {meant_mm:g} mm for tool {self.tool}"
            self.findings.warning("height", event.number, message, f"write M290 S{meant_mm:g} R0, or leave it out")

    def end(self) -> None:
        """Judge the file as a whole."""
        lines = (int(self.lines[0]), int(self.lines[-1])) if len(self.lines) else (len(self.motion.rows), 0)
        reached = (e for e in (*self.motion.events, *self.motion.odd) if e.number <= (self.end_line or e.number))
        limits.check_commands(reached, self.machine, lines, self.findings)
        last = max(1, self.motion.lines)
        self._ends(last)
        self._left_on(last)
        self._raw()

    def _raw(self) -> None:
        """Report PrusaSlicer's own file: those of its tools that the printer has too would be the wrong ones."""
        if not self.control.names_tools or self.motion.maker != PRUSA or not self.fan_missed:
            return
        settings = [e.command for e in self.motion.events if e.command.code == "G10" and e.command.has("S")]
        if settings and not any(command.has("R") for command in settings):
            message = "this is PrusaSlicer's own file: it counts tools from 0, and the printer from 1"
            self.findings.error("raw", 1, message, "let sensorgen slice write it")

    def _ends(self, last: int) -> None:
        """Commands that a whole file has at its start and at its end."""
        error, warning = self.findings.error, self.findings.warning
        if self.relative:
            error("relative", last, "the file ends in relative coordinates (G91)", "write G90 after the last G91")
        if not len(self.prints):
            warning("read", last, "the file prints nothing", "check that it is the right file")
        if "G90" not in self.seen:
            warning("start", 1, "no G90: places count as the printer happens to take them", "write G90 first")
        if not {"M140", "M190"} & self.seen:
            warning("start", 1, "no command for the bed: it stays as it is", "heat it (M140 or M190)")
        if self.control.ends and not self.ended:
            ends = " or ".join(self.control.ends)
            warning("end", last, f"no {ends}: the file may be cut short", f"end with {ends}")

    def _left_on(self, last: int) -> None:
        names = ", ".join(map(str, self.heaters.hot()))
        if names and self.ended:
            message = f"tools {names} are left on to the macro of {self.ended}"
            advice = "switch them off in the file (G10 P.. S0 R0) if that macro does not"
            self.findings.info("heat-left", last, message, advice)
        elif names:
            self.findings.error(
                "heat-left", last, f"tools {names} are still heated at the end of the file",
                "switch them off (G10 P.. S0 R0), or end as the printer's other files do"
                f" ({' or '.join(self.control.ends) or 'see its manual'}); the file may be cut short",
            )  # fmt: skip
