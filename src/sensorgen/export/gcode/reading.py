"""The lines of a file sorted: moves into a table, everything else into lists, each with its place in the file.

A place is the line's number and, where a line says more than one thing, how many came before: one integer, so that
places sort as the file runs.
"""

import re
from array import array
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.export.gcode import columns, remarks, words
from sensorgen.export.gcode.macros import Effect
from sensorgen.export.gcode.moves import NO_TOOL, FileFault
from sensorgen.export.gcode.words import Command

INCH_MM = 25.4
SHIFT = 12  # bits of a place below the line's number: no line has so many commands
PLACE = 92.0  # code of a row that says where the nozzle is, as G92 does
OFFSET = 93.0  # code of a row that says how far macros have taken it
MOST_FAULTS = 10_000  # enough to know that a file is none
_PIECE = 1 << 20  # bytes that are read at once
_TOOL = re.compile("-?[0-9]{1,6}")
_MOVES = ("G0", "G1", "G2", "G3")
_note = lru_cache(maxsize=4096)(remarks.read)


class Holding:
    """Something that holds from one place of a file to the next."""

    def __init__(self) -> None:
        """Nothing holds yet."""
        self.places, self.values = array("q"), array("d")

    def put(self, place: int, value: float) -> None:
        """Let a value hold from a place on."""
        self.places.append(place)
        self.values.append(value)


class GcodeFile:
    """A file, read; nothing is followed yet.

    Attributes
    ----------
    events : list of (int, Command)
        Places and commands that are no moves.
    odd : list of (int, Command)
        Places of moves with other words than ``columns.WORDS``, as those of further axes, and the moves.
    changes : list of (int, int, bool)
        Place, tool and whether a macro takes it.
    turns : list of int
        Places at which the firmware runs its macros of a change.
    faults : list of FileFault
        What could not be read.
    scale, relative, absolute_e, level : Holding
        Millimetres of a unit, whether places are relative, whether E is absolute, whether arcs lie in the bed's plane.
    tools, kind, width_mm, height_mm, layer : Holding
        As of :class:`sensorgen.export.gcode.moves.Motion`.
    kinds : dict of str to int
        Kinds of line and their numbers.
    maker : str
        Slicer that names itself.
    lines : int
        How many lines there are.
    """

    def __init__(self, text: bytes, prime_macro: str = "", change: Effect | None = None) -> None:
        """Read a text, each line of which ends with a line feed; the rest as for ``follow``."""
        self.events: list[tuple[int, Command]] = []
        self.odd: list[tuple[int, Command]] = []
        self.changes: list[tuple[int, int, bool]] = []
        self.turns: list[int] = []
        self.faults: list[FileFault] = []
        self.scale, self.relative, self.absolute_e, self.level = Holding(), Holding(), Holding(), Holding()
        self.tools, self.kind, self.width_mm, self.height_mm, self.layer = (Holding() for _ in range(5))
        self.kinds = {"": 0}
        self.maker = ""
        self.lines = 0
        head, _, tail = prime_macro.partition("{tool}")
        self._macro = re.compile(f"{re.escape(head)}([0-9]+){re.escape(tail)}") if prime_macro else None
        self._change = change
        self._places: list[Whole] = []
        self._rows: list[Real] = []
        self._own_places, self._own_rows = array("q"), array("d")
        self._sets = {
            "G17": (self.level, 1.0), "G18": (self.level, 0.0), "G19": (self.level, 0.0),
            "G20": (self.scale, INCH_MM), "G21": (self.scale, 1.0), "G90": (self.relative, 0.0),
            "G91": (self.relative, 1.0), "M82": (self.absolute_e, 1.0), "M83": (self.absolute_e, 0.0),
        }  # fmt: skip
        start = 0
        while start < len(text):  # whole lines, many at once
            end = text.find(b"\n", min(start + _PIECE, len(text)) - 1) + 1 or len(text)
            self._read(text[start:end])
            start = end

    def table(self) -> tuple[Whole, Real]:
        """Places and rows of all moves, in order: the code, and the numbers of ``columns.WORDS``; once."""
        own = np.array(self._own_rows).reshape(-1, 1 + len(columns.WORDS))
        places, rows = (
            np.concatenate([*self._places, np.array(self._own_places, np.int64)]),
            np.concatenate([*self._rows, own]),
        )
        self._places, self._rows = [], []  # a million moves take room
        if not self._own_places:
            return places, rows
        order = np.argsort(places, kind="stable")
        return places[order], rows[order]

    def _read(self, piece: bytes) -> None:
        table = columns.read(piece)
        first = self.lines + 1
        self._places.append((table.plain + first) << SHIFT)
        self._rows.append(np.column_stack([table.code, table.words]))
        for row in table.rest.tolist():
            line = piece[table.start[row] : table.end[row]]
            text = line.decode("utf-8", "surrogateescape")
            if text[0] == ";" and line.isascii():
                self._remark(text[1:], (first + row) << SHIFT)
            elif not text.isspace():
                self._other(text, first + row)
        self.lines += len(table.start)

    def _remark(self, text: str, place: int) -> None:
        for quantity, value in _note(text):
            if quantity == remarks.MAKER:
                self.maker = str(value)
            elif isinstance(value, str):
                self.kind.put(place, self.kinds.setdefault(value, len(self.kinds)))
            elif quantity == remarks.WIDTH:
                self.width_mm.put(place, value)
            elif quantity == remarks.HEIGHT:
                self.height_mm.put(place, value)
            else:
                last = self.layer.values[-1] if self.layer.values else 0.0
                self.layer.put(place, last + 1 if quantity == remarks.NEXT_LAYER else value)

    def _other(self, text: str, number: int) -> None:
        parsed = words.parse(text)
        place = number << SHIFT
        if parsed.remark:
            self._remark(parsed.remark, place)
        if not text.isascii():
            foreign = not text.partition(";")[0].isascii()
            self._fault(place, "characters that are not ASCII" + ("" if foreign else " in a comment"), severe=foreign)
        for what in parsed.faults:
            self._fault(place, what, severe=not words.is_meta(text))
        for here, command in enumerate(parsed.commands, place):
            if command.code[0] == "T":
                self._select(command.code[1:], here)
            elif command.code in self._sets:
                holding, value = self._sets[command.code]
                holding.put(here, value)
            elif command.code == "M98":
                if self._macro and (called := self._macro.fullmatch(macro_name(command))):
                    self._select(called[1], here, macro=True)
            else:
                self._position(command, here)
            if command.code not in _MOVES:
                self.events.append((here, command))

    def _fault(self, place: int, what: str, *, severe: bool = True) -> None:
        if len(self.faults) < MOST_FAULTS:
            self.faults.append(FileFault(place >> SHIFT, what, severe))

    def _position(self, command: Command, place: int) -> None:
        """Add a row for a move, or for a command that names the place anew."""
        if command.code in _MOVES:
            self._row(place, float(command.code[1:]), [self._number(command, name, place) for name in columns.WORDS])
            if any(letter not in columns.WORDS for letter, _ in command.words):
                self.odd.append((place, command))
            if command.has("H") and command.number("H") != 0:
                self._fault(place, f"H{command.text('H')} of {command.code}: an axis goes until it meets something")
        elif command.code == "G92":
            named = command.has("XYZE")
            self._row(place, PLACE, [self._number(command, name, place) if named else 0.0 for name in "XYZE"])
        elif command.code == "G28":
            homed = [name for name in "XYZ" if command.has(name)] or "XYZ"
            self._row(place, PLACE, [0.0 if name in homed else np.nan for name in "XYZ"])

    def _row(self, place: int, code: float, numbers: Sequence[float]) -> None:
        self._own_places.append(place)
        self._own_rows.append(code)
        self._own_rows.extend([*numbers, *[np.nan] * (len(columns.WORDS) - len(numbers))])

    def _number(self, command: Command, letter: str, place: int) -> float:
        """Number of a word; nan without the word, or where it has none."""
        text = command.text(letter)
        if text is None:
            return np.nan
        value = command.number(letter)
        if value is None or np.isnan(value):
            self._fault(place, f"{letter}{text} of {command.code} is no number")
            return np.nan
        return value

    def _select(self, digits: str, place: int, *, macro: bool = False) -> None:
        if not _TOOL.fullmatch(digits):
            self._fault(place, f"T{digits[:20]} is no tool")
            return
        tool, before = max(int(digits), NO_TOOL), self.tools.values[-1] if self.tools.values else NO_TOOL
        if macro or tool != before:  # the firmware ignores a tool that is in hand
            self.turns.append(place)
            if self._change:
                self._row(place, OFFSET, self._change.offset_mm)
                self._row(place, PLACE, self._change.place_mm)
                if self._change.relative is not None:
                    self.relative.put(place, float(self._change.relative))
        self.tools.put(place, tool)
        self.changes.append((place, tool, macro))


def macro_name(command: Command) -> str:
    """File that ``M98`` calls, without drive and folders."""
    return (command.text("P") or "").rpartition(":")[2].rpartition("/")[2]
