"""A slicer's own G-code to what one printer takes: its tool numbers, its temperatures, its fan, its tool changes.

The file is parsed, never searched for text: only commands that the printer wants in other words change, and
comments, moves and everything else stay as they are. What changes is the printer's ``control`` section:

- tools get the printer's own numbers, also where temperatures name them;
- temperatures name their tool and say what it has while it waits (``G10 P S R``);
- ``M82`` goes, where the printer prints with relative E;
- the fan on the part gets its number;
- after a tool is taken, the file waits for its temperature, and ``M290`` sets its height where tools differ;
- the tool that comes next is heated some seconds before;
- Z is stated after a tool is taken, before it pushes filament: macros may leave the nozzle at another height;
- the first tool is taken once the axes are homed, and all are switched off after the last line;
- commands after the printer's last one are never reached and go.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, pairwise
from math import inf, isfinite
from sys import maxsize

import numpy as np

from sensorgen.core.arrays import Mask
from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import words
from sensorgen.export.gcode.moves import NO_TOOL, Motion, seconds
from sensorgen.export.gcode.words import Command


def ready(text: bytes, motion: Motion, machine: Printer) -> Iterator[bytes]:
    r"""The file for the printer, in pieces of whole lines.

    Parameters
    ----------
    text : bytes
        A slicer's own file, each line with its line feed; it counts tools from 0.
    motion : Motion
        The same file, followed.
    machine : Printer
        Whose words to use.

    Raises
    ------
    BadInput
        The file takes a tool that the printer lacks, or pushes filament with absolute E though the
        printer's is relative.

    Examples
    --------
    >>> from sensorgen.export.gcode.motion import follow
    >>> from sensorgen.design.printer import load_printer
    >>> raw = b"G28\nM83\nT2 ; go\nM104 S210 ; warm\nM106 S255\nG1 X1 E1 F60 ; T2\n"
    >>> print(b"".join(ready(raw, follow(raw), load_printer("diabase-h5"))).decode(), end="")
    G28
    M83
    T3 ; go
    M116 P3
    G10 P3 S210 R180 ; warm
    M106 P3 S255
    G1 X1 E1 F60 ; T2
    G10 P3 S0 R0
    """
    moved = motion.filament_mm != 0
    _refuse_absolute(motion, moved, machine)
    writer, moves = _Writer(machine), np.append(np.unique(motion.number), maxsize)
    starts = np.flatnonzero(np.frombuffer(b"\n" + text, np.uint8) == ord("\n")).tolist()  # of each line, and the end
    commands = {event.number for event in motion.events}
    before = _before(text, motion, machine)
    end = int(motion.number[moved].max(initial=0))  # the last to move filament
    done = 0  # lines
    for number in sorted({*commands, *before, end, len(starts)} - {0}):
        move = int(moves[np.searchsorted(moves, done, side="right")])
        if move <= number and (waiting := writer.take()):
            yield text[starts[done] : starts[move - 1]] + _coded(waiting)
            done = move - 1
        yield text[starts[done] : starts[number - 1]] + _coded(before.get(number, ()))
        done = min(number, len(starts) - 1)
        line = text[starts[number - 1] : starts[done]]
        yield _coded(writer.line(line.decode("utf-8", "surrogateescape"))) if number in commands else line
        yield _coded(writer.cold() if number == end else ())
        if writer.ended:
            break
    numbered = commands.union(moves.tolist())
    yield from (text[starts[n] : starts[n + 1]] for n in range(done, len(starts) - 1) if n + 1 not in numbered)


def _refuse_absolute(motion: Motion, moved: Mask, machine: Printer) -> None:
    """Refuse filament that is moved with absolute E, where the printer's is relative."""
    absolute = np.flatnonzero(moved & (motion.absolute_e.column(len(motion.rows), 1.0) > 0))
    if machine.control.relative_e and len(absolute):
        raise BadInput(
            f"line {motion.number[absolute[0]]} of the slicer's file moves filament with absolute E (M82); "
            f"{machine.name} prints with relative E: let the slicer write that"
        )


def _coded(lines: Iterable[str]) -> bytes:
    return "".join(lines).encode("utf-8", "surrogateescape")


def _before(text: bytes, motion: Motion, machine: Printer) -> dict[int, list[str]]:
    """Lines to write before lines of the file, by their numbers."""
    before: dict[int, list[str]] = defaultdict(list)
    for number, lines in chain(_preheats(motion, machine), _heights(text, motion, machine)):
        before[number] += lines
    return before


def _preheats(motion: Motion, machine: Printer) -> Iterator[tuple[int, list[str]]]:
    """Lines to write before a line: the next tool is heated while the one before it still prints."""
    if machine.control.standby_c is None or not machine.control.names_tools or not len(motion.rows):
        return
    clock = np.concatenate([[0.0], np.cumsum(seconds(motion, machine.max_speed_mm_s))])
    numbers = motion.number
    for last, change in pairwise(motion.changes):
        if NO_TOOL in (last.tool, change.tool) or change.tool == last.tool or change.row == last.row:
            continue
        row = int(np.searchsorted(clock, clock[change.row] - machine.control.preheat_s))
        row = min(max(row, last.row), change.row - 1)
        yield int(numbers[row]), [f"M568 P{_own(machine, change.tool)} A2\n"]


def _heights(text: bytes, motion: Motion, machine: Printer) -> Iterator[tuple[int, list[str]]]:
    """Lines to write before a line: Z after a change of tool, where the file pushes filament without stating it."""
    known = motion.start_mm[:, 2] > 0  # a height that was never stated stays as the printer has it
    wrong = np.flatnonzero((motion.filament_mm > 0) & ~motion.z_stated & known)
    taken = np.searchsorted([change.row for change in motion.changes], wrong, side="right")
    lines = text.split(b"\n") if len(wrong) else []
    for row in wrong[np.flatnonzero(np.diff(taken, prepend=-1))].tolist():
        number, feed = int(motion.number[row]), f"{motion.feed_mm_min[row]:g}"
        keeps = b"F" in lines[number - 1].partition(b";")[0].upper()
        feeds = [] if keeps else [f"G1 F{feed}\n"]
        height = words.word("Z", motion.start_mm[row, 2])
        yield number, [f"G1 {height} F{60 * machine.max_speed_mm_s.z:g}\n", *feeds]


def _own(machine: Printer, index: float) -> int:
    """The printer's number of a tool that a slicer counts from 0."""
    count = len(machine.tool_numbers)
    if index not in range(count):
        raise BadInput(f"the slicer's file takes tool {index:g}, counted from 0; {machine.name} has {count} tools")
    return machine.tool_numbers[int(index)]


def _with_remark(texts: Iterable[str], line: str) -> Iterator[str]:
    """Lines in place of one, the first with its comment."""
    code, semicolon, remark = line.rstrip("\r\n").partition(";")
    behind = f"{code[len(code.rstrip()) :]};{remark}" if semicolon else ""
    for text in texts:
        yield f"{text}{behind}\n"
        behind = ""


class _Writer:
    """Writer that knows of its lines what later ones depend on."""

    def __init__(self, machine: Printer) -> None:
        self.machine, self.control = machine, machine.control
        self.tool: int | None = None  # the printer's number
        self.waiting: list[str] = []  # taking the first tool, until the axes are homed
        self.homed = machine.tool_at_start() is not None  # such a printer may take tools at any time
        self.ended = False
        self.standby_c = inf if self.control.standby_c is None else self.control.standby_c
        self.hot: dict[int, None] = {}  # tools in the order in which they were heated
        self.offset_mm = None if self.control.tool_offsets_mm else 0.0  # an earlier print may have left another

    def line(self, line: str) -> Iterator[str]:
        """A line that may have to change; its comment stays behind the first command, or goes with what it spoke of."""
        parsed = words.parse(line)
        changed = [self._command(command) for command in parsed.commands]
        if all(new is None for new in changed):
            yield line
        else:
            pairs = zip(parsed.commands, changed, strict=True)
            texts = chain.from_iterable([str(c)] if new is None else new for c, new in pairs)
            yield from _with_remark(texts, line)
        for command in parsed.commands:
            self.homed |= command.code in self.control.homes
            self.ended |= command.code in self.control.ends

    def take(self) -> list[str]:
        """Lines that waited for the first move."""
        lines, self.waiting = self.waiting, []
        return lines

    def cold(self) -> Iterator[str]:
        """Switch the tools off that the file has heated."""
        if self.control.names_tools:
            yield from (f"G10 P{tool} S0 R0\n" for tool in self.hot)
        self.hot = {}

    def _command(self, command: Command) -> Sequence[str] | None:
        """Other words for a command; None where it stays."""
        code, fan = command.code, self.control.layer_fan
        if code[0] == "T" and code != "T-1":
            return self._change(command)
        if code in ("M104", "M109"):
            return self._temperature(command)
        if code in ("G10", "M568"):
            return self._tool_settings(command)
        if code in ("M106", "M107") and fan is not None:
            return self._fan(command, fan)
        if code == "M82" and self.control.relative_e:
            return []
        return self._of_tool(command) if code == "M116" else None

    def _fan(self, command: Command, fan: int) -> Sequence[str] | None:
        if command.code == "M107":
            return [f"M106 P{fan} S0"]
        return None if command.has("P") else [str(Command("M106", (("P", str(fan)), *command.words)))]

    def _change(self, command: Command) -> Sequence[str]:
        self.tool = _own(self.machine, float(command.code[1:]))
        texts = [str(Command(f"T{self.tool}", command.words))]
        if self.control.names_tools:
            texts.append(f"M116 P{self.tool}")
        offset_mm = self.control.tool_offsets_mm.get(self.tool, 0.0)
        if offset_mm != self.offset_mm:
            texts.append(f"M290 S{offset_mm:g} R0")
            self.offset_mm = offset_mm
        if self.homed:
            return texts
        self.waiting = [f"{text}\n" for text in texts]
        return []

    def _tool_settings(self, command: Command) -> Sequence[str] | None:
        """``G10`` and ``M568`` with temperatures; the state that the latter may also set, by itself."""
        if command.code == "G10" and not command.has("SR"):
            return None  # retraction by the firmware, or offsets of a place of work
        if not (command.has("SR") and self.control.names_tools):
            return self._of_tool(command)
        tool = self._named(command, "P")
        if tool is None:
            return None
        settings = self._settings(tool, command.number("S"), command.number("R"))
        if command.code == "G10" or not command.has("A"):
            return [settings]
        state = command.without("SR")
        return [settings, *(self._of_tool(state) or [str(state)])]

    def _temperature(self, command: Command) -> Sequence[str] | None:
        active = command.number("S")
        if not self.control.names_tools or active is None:
            return self._of_tool(command, "T")
        if command.number("T") is None and active <= 0:
            return [text.strip() for text in self.cold()]
        tool = self._named(command, "T")
        if tool is None:
            raise BadInput(f"{command.code} of the slicer's file names no tool, and none is taken yet")
        waits = [f"M116 P{tool}"] if command.code == "M109" else []
        return [self._settings(tool, active, None), *waits]

    def _settings(self, tool: int, active: float | None, standby: float | None) -> str:
        if active is not None and standby is None:
            standby = min(active, self.standby_c)
        if active:
            self.hot[tool] = None
        elif active == 0:
            self.hot.pop(tool, None)
        given = [(letter, value) for letter, value in (("S", active), ("R", standby)) if value is not None]
        if not all(isfinite(value) for _, value in given):
            raise BadInput(f"the slicer's file sets tool {tool} to a temperature that is no number")
        return " ".join([f"G10 P{tool}", *(f"{letter}{value:g}" for letter, value in given)])

    def _named(self, command: Command, letter: str) -> int | None:
        """The printer's number of the tool that a command names, else of the one in hand."""
        index = command.number(letter)
        return self.tool if index is None else _own(self.machine, index)

    def _of_tool(self, command: Command, letter: str = "P") -> Sequence[str] | None:
        """A command that names a tool, with the printer's number of it."""
        index = command.number(letter)
        if index is None or _own(self.machine, index) == index:
            return None
        own = str(_own(self.machine, index))
        return [str(Command(command.code, tuple((n, own if n == letter else t) for n, t in command.words)))]
