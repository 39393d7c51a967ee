"""Where the nozzle goes and what it extrudes: a file read once, and all its moves followed at once, in columns."""

from collections.abc import Iterator, Sequence

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import words
from sensorgen.export.gcode.moves import (
    NO_TOOL,
    Arcs,
    Event,
    FileFault,
    ModalValues,
    Motion,
    ToolChange,
    centres_of_radius,
)
from sensorgen.export.gcode.reading import OFFSET, PLACE, SHIFT, WORDS, GcodeFile, Holding, Source, text_of
from sensorgen.export.gcode.words import Effect

DEFAULT_FEED_MM_MIN = 3000.0  # RepRapFirmware's, until a line says another
MOST_MM = 1e9  # beyond this a number is a slip, and differences of it are noise


def follow(source: Source, prime_macro: str = "", change: Effect | None = None) -> Motion:
    """Follow a file; places and filament count as absolute until it says otherwise, as firmwares start.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The G-code; see :func:`sensorgen.export.gcode.reading.text_of`.
    prime_macro : str
        Macro that changes tools, as ``tprime{tool}.g``; "" if the printer has none.
    change : Effect, optional
        Of the firmware's macros at a change of tool, which are executed.

    Raises
    ------
    BadInput
        It cannot be read, or is no text.

    Examples
    --------
    >>> motion = follow(["M83", "T3", "G1 X4 Y3 F600", ";TYPE:Perimeter", "G1 E-1", "G1 E1", "G1 X0 E0.5"])
    >>> motion.extruded_mm.tolist(), motion.length_mm.tolist(), motion.kinds
    ([0.0, 0.0, 0.0, 0.5], [5.0, 0.0, 0.0, 4.0], ('', 'perimeter'))
    """
    return _Steps(GcodeFile(text_of(source), prime_macro, change)).motion()


def executed(source: Source, machine: Printer) -> Motion:
    """Follow a file as a printer does, its own macros included."""
    return follow(source, machine.control.prime_macro, words.of_change(machine))


class _Steps:
    """All moves of a file, and between them the places that it names anew, as G92 does."""

    def __init__(self, file: GcodeFile) -> None:
        self.file = file
        self.place, table = file.table()
        self.code = table[:, 0]
        self.moves = self.code < PLACE
        numbers = table[:, 1:]
        numbers *= self._held(file.scale, 1.0)[:, None]
        self.words = dict(zip(WORDS, np.clip(numbers, -MOST_MM, MOST_MM, out=numbers).T, strict=True))
        self.sets = ((self._held(file.relative, 0.0) == 0) | ~self.moves) & (self.code != OFFSET)

    def motion(self) -> Motion:
        """The file as moves in columns."""
        file = self.file
        rows = np.empty((np.count_nonzero(self.moves), 10))
        for k, column in enumerate(self._columns()):
            rows[:, k] = column if len(column) == len(rows) else column[self.moves]
        far = ~np.all([np.abs(rows[:, k]) < MOST_MM for k in range(9)], axis=0)
        rows[far, :9] = np.clip(rows[far, :9], -MOST_MM, MOST_MM)
        faults = [FileFault(int(number), "a number beyond all measure") for number in rows[far, 9][:1]]
        straight = self.moves & (self.code < 2)
        for letters, what in (
            ("R", "R of G0 or G1 goes by a stored place"),
            ("IJ", "I or J stands in a straight move"),
        ):
            given = straight & np.any([~np.isnan(self.words[letter]) for letter in letters], axis=0)
            faults += [FileFault(n >> SHIFT, what) for n in self.place[given].tolist()]
        arcs, wrong = self._arcs(rows)
        told = [*file.events, *file.odd]
        before = iter(self._rows([*(place for place, _ in told), *(place for place, _, _ in file.changes)]))
        events = [Event(next(before), place >> SHIFT, command) for place, command in told]
        changes = [ToolChange(next(before), place >> SHIFT, tool, macro) for place, tool, macro in file.changes]
        return Motion(
            rows, arcs, events[: len(file.events)], events[len(file.events) :], changes, self._track(file.tools),
            tuple(file.kinds), self._track(file.kind),
            self._track(file.width_mm), self._track(file.height_mm), self._track(file.layer),
            self._track(file.absolute_e), sorted([*file.faults, *faults, *wrong], key=lambda fault: fault.number),
            file.lines, file.maker, self._z_stated(),
        )  # fmt: skip

    def _columns(self) -> Iterator[Real]:
        """Columns of ``Motion.rows``, for each step; one by one, since a million moves take room."""
        for axis in "XYZ":
            yield _before(_state(self.words[axis], self.sets))
        for axis in "XYZ":
            yield _state(self.words[axis], self.sets)
        given, absolute = self.words["E"], self._held(self.file.absolute_e, 1.0) > 0
        at = _state(given, absolute | ~self.moves)
        filament = np.where(self.moves & ~np.isnan(given), np.where(absolute, at - _before(at), given), 0.0)
        yield _extruded(filament, self._held(self.file.tools, NO_TOOL))
        yield filament
        last = _last(~np.isnan(self.words["F"]))
        yield np.where(last < 0, DEFAULT_FEED_MM_MIN, self.words["F"][last])
        yield (self.place >> SHIFT).astype(np.float64)

    def _z_stated(self) -> Mask:
        """Z has been stated since the last change of tool, for each move."""
        turned = np.zeros(len(self.place) + 1, bool)
        turned[np.searchsorted(self.place, np.array(self.file.turns, np.int64))] = True
        stated = _last(self.sets & ~np.isnan(self.words["Z"]))
        return np.asarray(stated >= _last(turned[:-1]))[self.moves]

    def _held(self, holding: Holding, before: float) -> Real:
        """Value that applies to each step."""
        rows = np.searchsorted(self.place, np.array(holding.places, np.int64))
        return ModalValues(rows.tolist(), holding.values.tolist()).column(len(self.place), before)

    def _arcs(self, rows: Real) -> tuple[Arcs, list[FileFault]]:
        """Moves that are arcs, and what is wrong with those that cannot be."""
        code = self.code[self.moves]
        row = np.flatnonzero((code == 2) | (code == 3))
        start, end, clockwise = rows[row, 0:3], rows[row, 3:6], code[row] == 2
        step = np.flatnonzero(self.moves)[row]
        i, j, radius = (self.words[letter][step] for letter in "IJR")
        offset = np.where(np.isnan(i) & np.isnan(j), np.nan, np.nan_to_num([i, j])).T
        centre = np.where(
            np.isnan(radius)[:, None],
            _fitting(start[:, :2] + offset, start, end),
            centres_of_radius(start[:, :2], end[:, :2], radius, clockwise),
        )
        centre[self._held(self.file.level, 1.0)[step] == 0] = np.nan
        fits = ~np.isnan(centre).any(axis=1)
        faults = [
            FileFault(int(rows[k, 9]), f"G{int(code[k])} without a centre that fits; taken as a straight line")
            for k in row[~fits].tolist()
        ]
        return Arcs.of(row[fits], start[fits], end[fits], centre[fits], clockwise[fits]), faults

    def _rows(self, places: Sequence[int]) -> list[int]:
        """Number of moves before each of some places."""
        counts: list[int] = np.searchsorted(self.place[self.moves], np.array(places, np.int64)).tolist()
        return counts

    def _track(self, holding: Holding) -> ModalValues:
        return ModalValues(self._rows(holding.places), holding.values.tolist())


def _last(given: Mask) -> Whole:
    """For each step the last one until it that is marked; -1 before the first."""
    return np.asarray(np.maximum.accumulate(np.where(given, np.arange(len(given)), -1)))


def _state(given: Real, sets: Mask) -> Real:
    """Where an axis is after each step, which sets it to what is given or moves it by that; 0 at the start."""
    by = np.where(np.isnan(given) | sets, 0.0, given).cumsum()
    last = _last(sets & ~np.isnan(given))
    return np.asarray(np.where(last < 0, by, given[last] + (by - by[last])))


def _before(state: Real) -> Real:
    """The state before each step."""
    return np.concatenate([np.zeros_like(state[:1]), state[:-1]])


def _extruded(filament: Real, tool: Real) -> Real:
    """Filament that each step extrudes: what goes beyond making good for what its tool has drawn back [mm]."""
    extruded = np.maximum(filament, 0.0)
    for one in np.unique(tool[filament < 0]):
        rows = np.flatnonzero((tool == one) & (filament != 0))
        pushed, step = filament[rows], 0
        for first in np.flatnonzero(pushed < 0).tolist():
            if first < step:
                continue
            step, owed = first, -pushed[first]
            while owed and step + 1 < len(rows):  # until the tool owes nothing any more
                step += 1
                extruded[rows[step]] = max(0.0, pushed[step] - owed)
                owed = max(0.0, owed - pushed[step])
            step += 1
    return extruded


def _fitting(centre: Real, start: Real, end: Real) -> Real:
    """Middles that are about as far from the start as from the end of their arc; nan for others."""
    radii = np.array([np.hypot(*(centre - place[:, :2]).T) for place in (start, end)])
    near, far = radii.min(axis=0), radii.max(axis=0)
    fits = (near > 0) & (near < MOST_MM) & (far - near <= 0.1 + 0.02 * near)
    return np.where(fits[:, None], centre, np.nan)
