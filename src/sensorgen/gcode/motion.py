"""Where the nozzle goes and what it extrudes: a file followed once, line by line, into columns.

Plain moves are nine lines in ten, so they are read by one regular expression and go straight into columns; all
other lines are parsed in full and kept as events between the moves. Checks and reports work on the columns.
"""

import math
import re
from array import array
from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from sensorgen.gcode import arcs, remarks, words
from sensorgen.gcode.moves import COLUMNS, NO_TOOL, Change, Event, Fault, Floats, Motion, Track
from sensorgen.gcode.words import Command

DEFAULT_FEED_MM_MIN = 3000.0  # RepRapFirmware's, until a line says another
INCH_MM = 25.4
MOST_FAULTS = 10_000  # enough to know that a file is none
MOST_MM = 1e9  # beyond this a number is a slip, and differences of it are noise

_N = f"({words.NUMBER})"
_PLAIN = re.compile(
    rf"G[01](?: +F{_N})?(?: +X{_N})?(?: +Y{_N})?(?: +Z{_N})?(?: +E{_N})?(?: +F{_N})? *(?:;[ -~\t]*)?[\r\n]*$"
)
_TOOL = re.compile("-?[0-9]{1,6}")


def follow(lines: Iterable[str], prime_macro: str = "") -> Motion:
    """Follow a file; places and filament count as absolute until it says otherwise, as firmwares start.

    Parameters
    ----------
    lines : iterable of str
        The G-code.
    prime_macro : str
        Macro that changes tools, as ``tprime{tool}.g``; "" if the printer has none.

    Examples
    --------
    >>> motion = follow(["M83", "T3", "G1 X4 Y3 F600", ";TYPE:Perimeter", "G1 E-1", "G1 E1", "G1 X0 E0.5"])
    >>> motion.extruded_mm.tolist(), motion.length_mm().tolist(), motion.kinds
    ([0.0, 0.0, 0.0, 0.5], [5.0, 0.0, 0.0, 4.0], ('', 'perimeter'))
    """
    follower = _Follower(prime_macro)
    count = follower.run(lines)
    return follower.motion(count)


class _Follower:
    """The machine's state while a file is read."""

    def __init__(self, prime_macro: str) -> None:
        self.x = self.y = self.z = self.e = self.owed = 0.0
        self.feed = DEFAULT_FEED_MM_MIN
        self.scale = 1.0
        self.is_relative = False
        self.is_absolute_e = True
        self.flat = True  # arcs in the plane of the bed, G17
        self.rows = array("d")
        self.events: list[Event] = []
        self.changes: list[Change] = []
        self.faults: list[Fault] = []
        self.tools, self.kind, self.width = Track(), Track(), Track()
        self.height, self.layer, self.relative, self.absolute = Track(), Track(), Track(), Track()
        self.kinds: dict[str, int] = {"": 0}
        self.maker = ""
        self.tool = NO_TOOL
        self.owed_by: defaultdict[int, float] = defaultdict(float)
        head, _, tail = prime_macro.partition("{tool}")
        self.macro = re.compile(f"{re.escape(head)}([0-9]+){re.escape(tail)}") if prime_macro else None
        self.does = {
            "G0": self._move, "G1": self._move, "G2": self._arc, "G3": self._arc, "G17": self._plane,
            "G18": self._plane, "G19": self._plane, "G20": self._units, "G21": self._units, "G28": self._home,
            "G90": self._mode, "G91": self._mode, "G92": self._place, "M82": self._mode_e, "M83": self._mode_e,
            "M98": self._call,
        }  # fmt: skip

    def run(self, lines: Iterable[str]) -> int:
        """Follow all lines; state is local while plain moves last, which is what makes it fast."""
        plain, put = _PLAIN.match, self.rows.extend
        x, y, z, e, owed, feed = self.x, self.y, self.z, self.e, self.owed, self.feed
        usual, absolute = self._usual(), self.is_absolute_e
        number = 0
        for number, line in enumerate(lines, 1):
            if usual and (found := plain(line)):
                first_f, to_x, to_y, to_z, to_e, last_f = found.groups()
                from_x, from_y, from_z = x, y, z
                x = float(to_x) if to_x else x
                y = float(to_y) if to_y else y
                z = float(to_z) if to_z else z
                feed = float(last_f or first_f) if last_f or first_f else feed
                moved = extruded = 0.0
                if to_e:
                    given = float(to_e)
                    moved = given - e if absolute else given
                    e = given if absolute else e + given
                    extruded = moved - owed
                    if extruded > 0:
                        owed = 0.0
                    else:
                        owed, extruded = -extruded, 0.0
                put((from_x, from_y, from_z, x, y, z, extruded, moved, feed, number))
            elif line[:1] == ";" and line.isascii():
                self._note(line[1:])
            elif not line.isspace():
                self.x, self.y, self.z, self.e, self.owed, self.feed = x, y, z, e, owed, feed
                self._other(line, number)
                x, y, z, e, owed, feed = self.x, self.y, self.z, self.e, self.owed, self.feed
                usual, absolute = self._usual(), self.is_absolute_e
        return number

    def _usual(self) -> bool:
        return not self.is_relative and self.scale == 1.0

    def motion(self, count: int) -> Motion:
        rows = np.frombuffer(self.rows).reshape(-1, COLUMNS) if self.rows else np.zeros((0, COLUMNS))
        self._judge(rows)
        return Motion(
            rows, self.events, self.changes, self.tools, tuple(self.kinds), self.kind, self.width, self.height,
            self.layer, self.relative, self.absolute, sorted(self.faults, key=lambda f: f.number), count, self.maker,
        )  # fmt: skip

    def _judge(self, rows: Floats) -> None:
        """Cut numbers that no machine could mean, so that nothing after overflows."""
        far = ~(np.abs(rows[:, :9]) < MOST_MM).all(axis=1)
        self.faults += [Fault(int(number), "a number beyond all measure") for number in rows[far, 9][:1]]
        rows[far, :9] = np.clip(np.nan_to_num(rows[far, :9], posinf=MOST_MM), -MOST_MM, MOST_MM)

    @property
    def row(self) -> int:
        """How many moves there are so far."""
        return len(self.rows) // COLUMNS

    def _fault(self, number: int, what: str, *, severe: bool = True) -> None:
        if len(self.faults) < MOST_FAULTS:
            self.faults.append(Fault(number, what, severe))

    def _note(self, remark: str) -> None:
        for quantity, value in remarks.read(remark):
            if quantity == remarks.MAKER:
                self.maker = str(value)
            elif isinstance(value, str):
                self.kind.put(self.row, self.kinds.setdefault(value, len(self.kinds)))
            elif quantity == remarks.WIDTH:
                self.width.put(self.row, value)
            elif quantity == remarks.HEIGHT:
                self.height.put(self.row, value)
            else:
                last = self.layer.values[-1] if self.layer.values else 0.0
                self.layer.put(self.row, last + 1 if quantity == remarks.NEXT_LAYER else value)

    def _other(self, line: str, number: int) -> None:
        said = words.parse(line)
        if said.remark:
            self._note(said.remark)
        if not line.isascii():
            foreign = not line.partition(";")[0].isascii()
            self._fault(number, "characters that are not ASCII" + ("" if foreign else " in a comment"), severe=foreign)
        for what in said.faults:
            self._fault(number, what, severe=not words.is_meta(line))
        for command in said.commands:
            if command.code[0] == "T":
                self._select(command.code[1:], number)
            else:
                self.does.get(command.code, _nothing)(command, number)
            if command.code not in ("G0", "G1", "G2", "G3"):
                self.events.append(Event(self.row, number, command))

    # What each command does, by its code.

    def _move(self, command: Command, number: int) -> None:
        self._put(self._target(command, number), self._push(command, number), number)

    def _arc(self, command: Command, number: int) -> None:
        start, end = (self.x, self.y, self.z), self._target(command, number)
        moved = self._push(command, number)
        clockwise = command.code == "G2"
        centre = self._centre(command, start, end, clockwise) if self.flat else None
        if centre is None:
            self._fault(number, f"{command.code} without a centre that fits; taken as a straight line")
            self._put(end, moved, number)
            return
        ends = list(arcs.chords(start, end, centre, clockwise=clockwise))
        for point in ends:
            self._put(point, moved / len(ends), number)

    def _centre(
        self, command: Command, start: tuple[float, float, float], end: tuple[float, float, float], clockwise: bool
    ) -> tuple[float, float] | None:
        i, j, r = (command.number(letter) for letter in "IJR")
        if r is not None:
            return arcs.centre_of_radius(start[:2], end[:2], r * self.scale, clockwise=clockwise)
        if i is None and j is None:
            return None
        centre = start[0] + (i or 0.0) * self.scale, start[1] + (j or 0.0) * self.scale
        radii = [math.dist(centre, place[:2]) for place in (start, end)]
        alike = 0 < min(radii) < MOST_MM and abs(radii[0] - radii[1]) <= 0.1 + 0.02 * min(radii)
        return centre if alike else None

    def _target(self, command: Command, number: int) -> tuple[float, float, float]:
        feed = self._number(command, "F", number)
        if feed is not None:
            self.feed = feed * self.scale
        here = (self.x, self.y, self.z)
        to = [self._number(command, letter, number) for letter in "XYZ"]
        x, y, z = (
            old if new is None else new * self.scale + (old if self.is_relative else 0.0)
            for old, new in zip(here, to, strict=True)
        )
        return x, y, z

    def _push(self, command: Command, number: int) -> float:
        """Filament that a move is to push [mm]."""
        given = self._number(command, "E", number)
        if given is None:
            return 0.0
        moved = given * self.scale - (self.e if self.is_absolute_e else 0.0)
        self.e += moved
        return moved

    def _put(self, end: tuple[float, float, float], moved: float, number: int) -> None:
        extruded = max(0.0, moved - self.owed)
        self.owed = max(0.0, self.owed - moved)
        self.rows.extend((self.x, self.y, self.z, *end, extruded, moved, self.feed, number))
        self.x, self.y, self.z = end

    def _number(self, command: Command, letter: str, number: int) -> float | None:
        value = command.number(letter)
        if value is not None and math.isnan(value):
            self._fault(number, f"{letter}{command.text(letter)} of {command.code} is no number")
            return None
        return value

    def _select(self, digits: str, number: int, *, macro: bool = False) -> None:
        if not _TOOL.fullmatch(digits):
            self._fault(number, f"T{digits[:20]} is no tool")
            return
        tool = int(digits)
        self.owed_by[self.tool] = self.owed
        self.tool = tool if tool >= 0 else NO_TOOL
        self.owed = self.owed_by[self.tool]
        self.tools.put(self.row, self.tool)
        self.changes.append(Change(self.row, number, self.tool, macro))

    def _call(self, command: Command, number: int) -> None:
        if self.macro and (found := self.macro.fullmatch(macro_name(command))):
            self._select(found[1], number, macro=True)

    def _mode(self, command: Command, _: int) -> None:
        self.is_relative = command.code == "G91"
        self.relative.put(self.row, self.is_relative)

    def _mode_e(self, command: Command, _: int) -> None:
        self.is_absolute_e = command.code == "M82"
        self.absolute.put(self.row, self.is_absolute_e)

    def _units(self, command: Command, _: int) -> None:
        self.scale = INCH_MM if command.code == "G20" else 1.0

    def _plane(self, command: Command, _: int) -> None:
        self.flat = command.code == "G17"

    def _home(self, command: Command, _: int) -> None:
        every = not command.has("XYZ")
        self.x, self.y, self.z = (
            0.0 if every or command.has(letter) else old
            for letter, old in zip("XYZ", (self.x, self.y, self.z), strict=True)
        )

    def _place(self, command: Command, number: int) -> None:
        if not command.has("XYZE"):
            self.x = self.y = self.z = self.e = 0.0
        x, y, z, e = (self._number(command, letter, number) for letter in "XYZE")
        self.x = self.x if x is None else x * self.scale
        self.y = self.y if y is None else y * self.scale
        self.z = self.z if z is None else z * self.scale
        self.e = self.e if e is None else e * self.scale


def macro_name(command: Command) -> str:
    """File that ``M98`` calls, without drive and folders."""
    return (command.text("P") or "").rpartition(":")[2].rpartition("/")[2]


def _nothing(_: Command, __: int) -> None:
    """Most commands move nothing."""
