"""Check of a G-code file on a simulated printer: faults, and its needs of time, filament and purging.

Commands are executed one after the other: tools, heat and its limits, homing, modes, fans, macros.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Whole
from sensorgen.core.errors import MissingValue, UnknownName
from sensorgen.design import materials
from sensorgen.design.materials import Material
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import limits, words
from sensorgen.export.gcode.motion import NOT_MODEL, executed
from sensorgen.export.gcode.moves import NO_TOOL, Event, Motion, ToolChange, seconds
from sensorgen.export.gcode.reading import Source, macro_name
from sensorgen.export.gcode.results import Checked, FileNeeds, Findings, ToolMaterial, merged
from sensorgen.export.gcode.words import PRUSA, Command


def report(
    motion: Motion, machine: Printer, loaded: dict[int, str] | None = None,
    texts: materials.Texts = materials.NO_TEXTS,
) -> FileNeeds:  # fmt: skip
    """Sum a file up.

    Parameters
    ----------
    motion : Motion
        The file.
    machine : Printer
        Who is to print it.
    loaded : dict of int to str, optional
        Material of each tool; the printer's usual ones where a tool has one only.
    texts : mapping
        As of :func:`sensorgen.design.materials.load`.
    """
    taken = [change.tool for change in motion.changes if change.tool != NO_TOOL]
    moving_s = float(seconds(motion, machine.max_speed_mm_s).sum())
    return FileNeeds(
        lines=motion.lines,
        moves=len(motion.rows),
        layers=int(max(motion.layer.values, default=0)),
        time_s=moving_s + _dwells_s(motion),
        tools=tuple(_tools(motion, machine, usual(machine) | (loaded or {}), texts)),
        tool_changes=sum(a != b for a, b in pairwise(taken)),
        box_mm=_box_mm(motion),
    )


def _dwells_s(motion: Motion) -> float:
    """Time that a file waits [s]; 0 where it is no time."""
    waits = (e.command for e in motion.events if e.command.code == "G4")
    time_s = sum((w.number("S") or 0.0) + (w.number("P") or 0.0) / 1000 for w in waits)
    return time_s if 0 <= time_s < math.inf else 0.0


def _box_mm(motion: Motion) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Lowest and highest corner of what is printed [mm]; None of nothing."""
    printed, (low, high) = (motion.extruded_mm > 0) & (motion.length_mm > 0), motion.box_mm()
    if not printed.any():
        return None
    axes = range(3)  # one by one: a copy of all places would take much room
    return tuple(float(low[printed, k].min()) for k in axes), tuple(float(high[printed, k].max()) for k in axes)


def usual(machine: Printer) -> dict[int, str]:
    """Material of each tool, where the printer has one usual material for it."""
    named = list(machine.default_tools.items())
    tools = [tool for _, tool in named]
    return {tool: material for material, tool in named if tools.count(tool) == 1}


def _tools(motion: Motion, machine: Printer, loaded: dict[int, str], texts: materials.Texts) -> Iterator[ToolMaterial]:
    count, start, extruded = len(motion.rows), machine.tool_at_start(), motion.extruded_mm
    tools = motion.tools.column(count, NO_TOOL if start is None else start).astype(np.int64)
    kinds = motion.kind.column(count, 0).astype(np.int64)
    waste = np.array([kind in NOT_MODEL for kind in motion.kinds])[kinds] | (motion.length_mm == 0)
    for tool in np.unique(tools[extruded > 0]).tolist():
        material = loaded.get(tool, "")
        length_mm, purge_mm = (float(extruded[rows].sum()) for rows in (tools == tool, (tools == tool) & waste))
        volume_mm3 = length_mm * math.pi / 4 * machine.filament_mm**2
        try:
            density = materials.load(material, texts=texts).value("density_kg_m3").value if material else None
        except (MissingValue, UnknownName):
            density = None
        mass_g = None if density is None else volume_mm3 * density * 1e-6
        is_counted = purge_mm > 0 or any(motion.kinds)  # else no comment says what lines are
        yield ToolMaterial(tool, material, length_mm, purge_mm if is_counted else None, volume_mm3, mass_g)


def check(
    source: Source, machine: Printer, loaded: Mapping[int, str] | None = None, *, others_empty: bool = False
) -> Checked:
    """Check a file, whoever has sliced it.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines.
    machine : Printer
        Who is to print it.
    loaded : mapping of int to str, optional
        Material of each tool, for masses.
    others_empty : bool
        Whether nothing is on the other tools, so that they must not print.

    Raises
    ------
    BadInput
        The file cannot be read, or is no G-code.

    Examples
    --------
    >>> from sensorgen.design.printer import load_printer
    >>> found = check(["G90", "M83", "M140 S60", "G10 P9 S210"], load_printer("diabase-h5")).findings
    >>> found[0].rule, found[0].line, found[0].message
    ('tool', 4, 'tool 9 gets a temperature; diabase-h5 has 1, 2, 3, 4, 5')
    """
    return check_motion(executed(source, machine), machine, loaded, others_empty=others_empty)


def check_motion(
    motion: Motion, machine: Printer, loaded: Mapping[int, str] | None = None, *, others_empty: bool = False,
    texts: materials.Texts = materials.NO_TEXTS,
) -> Checked:  # fmt: skip
    """Check a file that was followed; see :func:`check`, and for ``texts`` :func:`sensorgen.design.materials.load`."""
    known = {*materials.names(), *texts.get("materials", ())}
    loads = {tool: materials.load(name, texts=texts) for tool, name in (loaded or {}).items() if name in known}
    findings = [*limits.check(motion, machine), *simulated(motion, machine, loads)]
    findings += limits.check_loaded(motion, machine, loads, others_empty=others_empty)
    return Checked(**vars(report(motion, machine, dict(loaded or {}), texts)), findings=merged(findings))


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
    return before_c if value_c is None or math.isnan(value_c) else value_c


def _tool(event: Event, letter: str, in_hand: int) -> float:
    """Tool that a command names, nan where that is no number; without the word the one in hand."""
    if not event.command.has(letter):
        return in_hand
    value = event.command.number(letter)
    return math.nan if value is None else value


AXES = "XYZ"
PAUSES = ("M25", "M226", "M600", "M601")


def simulated(motion: Motion, machine: Printer, loaded: Mapping[int, Material]) -> Findings:
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
        self.lines = np.flatnonzero(motion.prints)
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
        if event.command.code not in PAUSES:
            return
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
