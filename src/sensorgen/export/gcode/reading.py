"""A file of G-code opened as text, its lines sorted: moves into a table, everything else into lists with places.

Nine lines in ten of a print are plain moves as ``G1 X12.3 Y4.5 E.067``. They need no reading word by word: which
byte may follow which tells whether a line is one of them, and the numbers of all of them are then read in one go.

A place is the line's number and, where a line says more than one thing, how many came before: one integer, so that
places sort as the file runs.
"""

import re
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading
from sensorgen.export.gcode import words
from sensorgen.export.gcode.moves import NO_TOOL, FileFault
from sensorgen.export.gcode.words import Command, Effect

_MAGIC = {
    b"GCDE": "binary G-code of Prusa's; export it as plain text (in PrusaSlicer: Preferences, Supports binary G-code)",
    b"PK\x03\x04": "a zip archive, perhaps a 3MF; take the .gcode file out of it",
    b"\x1f\x8b": "packed by gzip; unpack it",
    b"\xff\xfe": "text as UTF-16; save it as UTF-8",
    b"\xfe\xff": "text as UTF-16; save it as UTF-8",
}
_MARK = b"\xef\xbb\xbf"  # of UTF-8, which some editors write first
_PEEK = 1 << 16
_COMMAND = re.compile(rb"^[ \t]*(?:N[0-9]+[ \t]*)?[GMT]-?[0-9]", re.MULTILINE | re.IGNORECASE)


Source = Path | bytes | Iterable[str]


def text_of(source: Source) -> bytes:
    r"""Text of a file of G-code, or of lines; every line ends with a line feed, whatever ended it before.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines with or without their ends; lone surrogates stand for bytes that are no
        UTF-8.

    Raises
    ------
    BadInput
        It cannot be read, is empty, or holds something else than text.

    Examples
    --------
    >>> text_of(["G28", "G1 X1\n"])
    b'G28\nG1 X1\n'
    """
    if isinstance(source, bytes):
        return _one_end(source)
    if not isinstance(source, Path):
        return b"".join(_one_end(line.encode("utf-8", "surrogateescape") or b"\n") for line in source)
    with reading(source):
        text = source.read_bytes()
    _refuse(source, text[:_PEEK])
    text = _one_end(text.removeprefix(_MARK))
    if not _COMMAND.search(text):
        first = text.strip().partition(b"\n")[0].decode("utf-8", "replace")
        raise BadInput(f"{str(source)!r} is no G-code: no line has a command; the first says {first[:60]!r}")
    return text


def _one_end(text: bytes) -> bytes:
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return text if text.endswith(b"\n") or not text else text + b"\n"


def _refuse(path: Path, head: bytes) -> None:
    for magic, what in _MAGIC.items():
        if head.startswith(magic):
            raise BadInput(f"{str(path)!r} is {what}")
    if not head.strip():
        raise BadInput(f"{str(path)!r} is empty; expected G-code")
    if b"\0" in head:
        raise BadInput(f"{str(path)!r} is no text: byte {head.index(0) + 1} is 0; expected G-code as plain text")


Bytes = NDArray[np.uint8]

WORDS = "XYZEFIJR"  # of a move or an arc, in the order of the columns
SPACE, DIGIT, SIGN, DOT, WORD, END, OTHER = range(7)  # sorts of bytes
_SORTS = 7
_BYTES = {SPACE: b" ", DIGIT: b"0123456789", SIGN: b"+-", DOT: b".", WORD: WORDS.encode(), END: b";\n"}
_BEHIND = {  # which sort may stand behind which in a plain move
    SPACE: (SPACE, WORD, END), WORD: (DIGIT, SIGN, DOT), SIGN: (DIGIT, DOT), DOT: (DIGIT,),
    DIGIT: (DIGIT, DOT, SPACE, END),
}  # fmt: skip
_SORT = bytes(next((sort for sort, those in _BYTES.items() if byte in those), OTHER) for byte in range(256))
_WRONG = bytes(pair % _SORTS not in _BEHIND.get(pair // _SORTS, ()) for pair in range(256))
_BLANK = bytes(32 if byte in _BYTES[WORD] else byte for byte in range(256))
_COLUMN = np.array([max(_BYTES[WORD].find(byte), 0) for byte in range(256)])


@dataclass(frozen=True, eq=False)
class Columns:
    """Content of a piece of G-code in columns.

    Attributes
    ----------
    start, end : (n,) int64 array
        Where each line starts, and where it ends, without its line feed [-].
    plain : (m,) int64 array
        Lines that are plain moves, from 0 [-].
    code : (m,) float64 array
        0 to 3, for G0 to G3 [-].
    words : (m, 8) float64 array
        Numbers of ``WORDS``; nan where a line has no such word.
    rest : (k,) int64 array
        All other lines that are not empty [-].
    """

    start: Whole
    end: Whole
    plain: Whole
    code: Real
    words: Real
    rest: Whole


def read(text: bytes) -> Columns:
    r"""Read the plain moves of some lines.

    Parameters
    ----------
    text : bytes
        Whole lines, the last one too with its line feed.

    Examples
    --------
    >>> found = read(b"G1 X1.5 E-.2 ; wall\nM83\n\nG0 Z2\n")
    >>> found.plain.tolist(), found.rest.tolist(), found.words[:, :4].tolist()
    ([0, 3], [1], [[1.5, nan, nan, -0.2], [nan, nan, 2.0, nan]])
    """
    data = np.frombuffer(text, np.uint8)
    sorts = np.frombuffer(text.translate(_SORT), np.uint8)
    end = np.flatnonzero(data == ord("\n"))
    start = np.concatenate([[0], end[:-1] + 1])
    stops = np.flatnonzero(sorts == END)
    stop = stops[np.searchsorted(stops, start)]  # of the code, before a comment
    # lines that start with G0 to G3 and a space, and are ASCII
    plain: Mask = stop - start >= len("G1 ")
    letter, digit, space = (np.where(plain, start + k, 0) for k in range(3))
    plain &= (data[letter] == ord("G")) & (sorts[digit] == DIGIT) & (data[digit] < ord("4")) & (sorts[space] == SPACE)
    plain[np.searchsorted(end, np.flatnonzero(data > 127))] = False
    # lines in whose words no byte stands behind one that it may not follow
    pairs = sorts[:-1] * np.uint8(_SORTS) + sorts[1:]
    wrong = np.frombuffer(pairs.tobytes().translate(_WRONG), np.uint8)
    before = np.concatenate([[0], np.cumsum(wrong, dtype=np.int32)])
    plain &= before[stop] == before[np.minimum(start + 2, stop)]
    line, words = _numbers(data, start, stop, np.flatnonzero(plain))
    rest = end > start
    rest[line] = False
    return Columns(start, end, line, data[start[line] + 1] - float(ord("0")), words, np.flatnonzero(rest))


def _numbers(data: Bytes, start: Whole, stop: Whole, line: Whole) -> tuple[Whole, Real]:
    """Those of some lines whose words are numbers, each letter once, and these numbers."""

    def words_of(line: Whole) -> tuple[Bytes, Whole, Whole]:
        """Bytes behind G0 to G3 of some lines; of each word the number of its line, and its place in the bytes."""
        edges = np.zeros(len(data) + 1, np.int8)
        edges[start[line] + 2] = 1
        edges[stop[line]] = -1
        put = data[np.cumsum(edges[:-1], dtype=np.int8).view(np.bool_)]
        word = np.flatnonzero(put >= ord("E"))
        return put, np.searchsorted(np.cumsum(stop[line] - start[line] - 2), word, side="right"), word

    put, row, word = words_of(line)
    of = np.searchsorted(word, np.flatnonzero(put == ord("."))) - 1
    twice = of[1:][of[1:] == of[:-1]]  # words whose number has two dots
    if len(twice):
        line = np.delete(line, row[twice])
        put, row, word = words_of(line)
    words = np.full((len(line), len(WORDS)), np.nan)
    words[row, _COLUMN[put[word]]] = np.fromstring(put.tobytes().translate(_BLANK), dtype=np.float64, sep=" ")
    once = np.bincount(row, minlength=len(line)) == len(WORDS) - np.isnan(words).sum(axis=1)
    return line[once], words[once]


INCH_MM = 25.4
SHIFT = 12  # bits of a place below the line's number: no line has so many commands
PLACE = 92.0  # code of a row that says where the nozzle is, as G92 does
OFFSET = 93.0  # code of a row that says how far macros have taken it
MOST_FAULTS = 10_000  # enough to know that a file is none
_PIECE = 1 << 20  # bytes that are read at once
_TOOL = re.compile("-?[0-9]{1,6}")
_MOVES = ("G0", "G1", "G2", "G3")
_note = lru_cache(maxsize=4096)(words.notes)


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
        Places of moves with other words than ``WORDS``, as those of further axes, and the moves.
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
        """Places and rows of all moves, in order: the code, and the numbers of ``WORDS``; once."""
        own = np.array(self._own_rows).reshape(-1, 1 + len(WORDS))
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
        table = read(piece)
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
            if quantity == words.MAKER:
                self.maker = str(value)
            elif isinstance(value, str):
                self.kind.put(place, self.kinds.setdefault(value, len(self.kinds)))
            elif quantity == words.WIDTH:
                self.width_mm.put(place, value)
            elif quantity == words.HEIGHT:
                self.height_mm.put(place, value)
            else:
                last = self.layer.values[-1] if self.layer.values else 0.0
                self.layer.put(place, last + 1 if quantity == words.NEXT_LAYER else value)

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
            if command.code in _MOVES:
                self._move(command, here)
            else:
                self._no_move(command, here)
                self.events.append((here, command))

    def _no_move(self, command: Command, place: int) -> None:
        """Follow a command that selects a tool, sets a mode or names the place anew."""
        if command.code[0] == "T":
            self._select(command.code[1:], place)
        elif command.code in self._sets:
            holding, value = self._sets[command.code]
            holding.put(place, value)
        elif command.code == "M98":
            if self._macro and (called := self._macro.fullmatch(macro_name(command))):
                self._select(called[1], place, macro=True)
        elif command.code == "G92":
            named = command.has("XYZE")
            self._row(place, PLACE, [self._number(command, name, place) if named else 0.0 for name in "XYZE"])
        elif command.code == "G28":
            self._row(place, PLACE, _homed(command))

    def _fault(self, place: int, what: str, *, severe: bool = True) -> None:
        if len(self.faults) < MOST_FAULTS:
            self.faults.append(FileFault(place >> SHIFT, what, severe))

    def _move(self, command: Command, place: int) -> None:
        """Add a row for a move."""
        self._row(place, float(command.code[1:]), [self._number(command, name, place) for name in WORDS])
        if any(letter not in WORDS for letter, _ in command.words):
            self.odd.append((place, command))
        if command.has("H") and command.number("H") != 0:
            self._fault(place, f"H{command.text('H')} of {command.code}: an axis goes until it meets something")

    def _row(self, place: int, code: float, numbers: Sequence[float]) -> None:
        self._own_places.append(place)
        self._own_rows.append(code)
        self._own_rows.extend([*numbers, *[np.nan] * (len(WORDS) - len(numbers))])

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


def _homed(command: Command) -> list[float]:
    """Place of the axes that ``G28`` homes, all of them where it names none; nan of the others."""
    homed = [name for name in "XYZ" if command.has(name)] or "XYZ"
    return [0.0 if name in homed else np.nan for name in "XYZ"]


def macro_name(command: Command) -> str:
    """File that ``M98`` calls, without drive and folders."""
    return (command.text("P") or "").rpartition(":")[2].rpartition("/")[2]
