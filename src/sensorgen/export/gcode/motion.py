"""Motion of the nozzle: a file read once, all its moves followed at once, in columns, and the lines that it prints."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sensorgen.core.arrays import ColumnRecord, Mask, Real, Whole
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
        faults += self._odd_words()
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

    def _odd_words(self) -> Iterator[FileFault]:
        """R, I and J of straight moves, where they mean no arc."""
        straight = self.moves & (self.code < 2)
        for letters, what in (
            ("R", "R of G0 or G1 goes by a stored place"),
            ("IJ", "I or J stands in a straight move"),
        ):
            given = straight & np.any([~np.isnan(self.words[letter]) for letter in letters], axis=0)
            yield from (FileFault(n >> SHIFT, what) for n in self.place[given].tolist())

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
        return Arcs.between(row[fits], start[fits], end[fits], centre[fits], clockwise[fits]), faults

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


Numbering = Literal["printer", "slicer"]

# What the slicers' ";TYPE:" comments call lines that are not part of a body, in lower case.
NOT_MODEL = frozenset(
    {
        "skirt", "brim", "skirt/brim", "prime-tower", "prime tower", "prime pillar", "wipe tower", "custom",
        "support", "support-interface", "support material", "support material interface",
    }
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Paths(ColumnRecord):
    """One row per move that extrudes; arcs stand as chords, retractions and their return count for nothing.

    Attributes
    ----------
    start_mm, end_mm : (n, 3) float64 array
        Where the line begins and ends [mm].
    filament_mm : (n,) float64 array
        Filament that it takes [mm].
    tool : (n,) int64 array
        The printer's own number of its tool [-].
    kind : (n,) int64 array
        Index into ``kinds`` [-].
    height_mm, width_mm : (n,) float64 array
        Height and width that the file declares [mm]; nan where it does not.
    layer : (n,) int64 array
        Layer from 1 at the bed, as the comments count; by heights where no comment does [-].
    number : (n,) int64 array
        Line of the file, from 1 [-].
    kinds : tuple of str
        What the file's comments call its lines, in lower case; the first is "".
    """

    start_mm: Real
    end_mm: Real
    filament_mm: Real
    tool: Whole
    kind: Whole
    height_mm: Real
    width_mm: Real
    layer: Whole
    number: Whole
    kinds: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.number)

    def length_mm(self) -> Real:
        """Length of each line [mm]; 0 where filament is pushed on the spot."""
        way: Real = np.sqrt(((self.end_mm - self.start_mm) ** 2).sum(axis=1))
        return way

    def volume_mm3(self, filament_diameter_mm: float) -> Real:
        """Volume of each line [mm3].

        Parameters
        ----------
        filament_diameter_mm : float
            Diameter of the filament [mm].
        """
        return self.filament_mm * (math.pi / 4 * filament_diameter_mm**2)

    def model(self) -> "Paths":
        """The lines of the bodies: neither skirt, tower nor support, and nothing pushed on the spot."""
        bodies = np.array([name not in NOT_MODEL for name in self.kinds])
        return self.of(bodies[self.kind] & (self.length_mm() > 0))


def read(source: Source, machine: Printer, numbering: Numbering = "printer") -> Paths:
    """Read the lines that a file prints.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines.
    machine : Printer
        Whose G-code it is.
    numbering : "printer" or "slicer"
        Whether T counts as the printer does, or from 0 as a slicer's own file does.

    Raises
    ------
    BadInput
        The file is not there, or no G-code.

    Examples
    --------
    >>> from sensorgen.design.printer import load_printer
    >>> paths = read(["M83", "T3", "G1 Z0.1", ";WIDTH:0.44", "G1 X10 E0.2"], load_printer("diabase-h5"))
    >>> paths.tool.tolist(), paths.length_mm().tolist(), paths.width_mm.tolist(), paths.layer.tolist()
    ([3], [10.0], [0.44], [1])
    """
    return paths_of(follow(source, machine.control.prime_macro), machine, numbering)


def paths_of(motion: Motion, machine: Printer, numbering: Numbering = "printer") -> Paths:
    """The lines that a followed file prints; see :func:`read`."""
    rows, start, end, share = _straight(motion, np.flatnonzero(motion.extruded_mm > 0))
    count, tools = len(motion.rows), tools_of(motion, machine, numbering)[rows]
    if motion.layer.rows:
        layer = motion.layer.column(count, 0)[rows].astype(np.int64)
    else:
        heights = np.round(motion.end_mm[rows, 2], 4)
        layer = np.unique(heights, return_inverse=True)[1].astype(np.int64).ravel() + 1
    return Paths(
        start, end, motion.extruded_mm[rows] * share, tools, motion.kind.column(count, 0)[rows].astype(np.int64),
        motion.height_mm.column(count)[rows], motion.width_mm.column(count)[rows], layer, motion.number[rows],
        motion.kinds,
    )  # fmt: skip


def tools_of(motion: Motion, machine: Printer, numbering: Numbering = "printer") -> Whole:
    """The printer's own number of the tool in each move; one that the printer lacks stays negative."""
    own = np.array([*machine.tool_numbers, NO_TOOL])
    tools = motion.tools.column(len(motion.rows), NO_TOOL).astype(np.int64)
    if numbering == "slicer":
        return own[np.where(tools < len(own) - 1, np.maximum(tools, 0), len(own) - 1)]
    return np.where(tools == NO_TOOL, own[0], tools)  # a file without any tool means the printer's first


def _straight(motion: Motion, rows: Whole) -> tuple[Whole, Real, Real, Real]:
    """Some moves as straight lines: the move of each, its start and end [mm], and its share of the move's filament."""
    bent = np.isin(motion.arcs.row, rows)
    which, start, end = motion.arcs.of(bent).chords()
    row = motion.arcs.row[bent]
    straight = rows[~np.isin(rows, row)]
    every = np.concatenate([straight, row[which]])
    order = np.argsort(every, kind="stable")
    starts, ends = np.concatenate([motion.start_mm[straight], start]), np.concatenate([motion.end_mm[straight], end])
    share = np.concatenate([np.ones(len(straight)), 1.0 / np.bincount(which, minlength=1)[which]])
    return every[order], starts[order], ends[order], share[order]
