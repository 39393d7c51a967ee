"""Ledger of the nozzle and of time: melt that it has when it prints, dwell, fan, speed, and travel over other tools.

Also the insulation that would be left if what a conductor's nozzle drags over another material conducted.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import shapely

from sensorgen.asprinted.beads import Beads, beads, placed
from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.export.gcode.crossings import (
    CONTACT_MM,
    PrintedLines,
    crossings,
    habits,
    printed_lines,
    retracted,
    summed,
)
from sensorgen.export.gcode.motion import Numbering, follow, tools_of
from sensorgen.export.gcode.moves import Motion, seconds
from sensorgen.export.gcode.reading import Source, text_of
from sensorgen.export.gcode.results import Drags, GcodeFinding

BALANCE_MM = 0.5  # of filament, that a travel may add to the melt in the nozzle or take
_GAIN, _LOSS = 0.1, 0.3  # in all, of the filament of a tool's lines; a lower flow of primes alone loses a quarter
_RETRACTION = (0.1, 2.0)  # of the material's own
_TRAVEL_MM, _TRAVELS, _UNRETRACTED = 5.0, 10, 0.85  # travels so long, so many, and their share; slicers: up to 0.56
_FAR_MM = 1e4
DWELL_S, DWELL_ON_PART_S = 60.0, 5.0
_ABOVE_MM = 0.5  # a nozzle higher than this over its last line is off the part
FIRST_LAYER_MM_S = 35.0  # slicers' usual profiles have up to 30
_FAN_FROM, _FAN = 4, 0.4  # layers without fan, of usual profiles; share of the least that a source advises
DRAGGED_MM = 100.0  # of each 1000 mm2: unretracted travel in contact; files of slicers have up to 70
_STEP_MM = 0.01  # to which insulation is rounded


def check(design: Design, motion: Motion, lines: Beads) -> Iterator[GcodeFinding]:
    """Findings about the nozzle while it prints a piece.

    Parameters
    ----------
    design : Design
        That is to be printed.
    motion : Motion
        The file, with the printer's own tool numbers.
    lines : Beads
        Of the piece.
    """
    tool = tools_of(motion, design.machine)
    piece = motion.prints & np.isin(motion.number, lines.number)
    if not piece.any() or not set(lines.tool.tolist()) <= set(tool[piece].tolist()):
        return  # a slicer's own file, which is refused as such
    layer = np.zeros(len(tool), np.int64)
    number, first = np.unique(lines.number, return_index=True)
    layer[piece] = lines.layer[first][np.searchsorted(number, motion.number[piece])]
    for material in design.used():
        mine = design.tool(material)
        yield from _balance(design, motion, tool == mine, piece, mine, material)
        yield from _fan(design, motion, piece & (tool == mine) & (layer >= _FAN_FROM), mine, material)
    yield from _dwell(motion, design, piece)
    fast = piece & (layer == 0) & (motion.feed_mm_min > 60 * FIRST_LAYER_MM_S * (1 + 1e-6))
    if fast.any():
        speed = float(motion.feed_mm_min[fast].max()) / 60
        message = f"the first layer is printed at {speed:g} mm/s; at most {FIRST_LAYER_MM_S:g} mm/s adhere"
        yield GcodeFinding.of("speed", motion.number[fast], message, "print the first layer slower")
    yield from _drags(design, motion, tool, piece)


def _value(design: Design, material: str, quantity: str) -> float | None:
    try:
        return design.material(material).value(quantity, design.used()[material]).value
    except MissingValue:
        return None


def _still(motion: Motion, usual_mm: float) -> Real:
    """Filament moved without printing a line by each move, retraction by the firmware included."""
    still = np.where((motion.filament_mm > 0) & (motion.across_mm > 0), 0.0, motion.filament_mm)
    for event in motion.events:
        bare = event.command.code in ("G10", "G11") and not event.command.has("PSRLXYZ")
        if bare and event.row < len(still):
            still[event.row] += usual_mm if event.command.code == "G11" else -usual_mm
    return still


def _balance(
    design: Design, motion: Motion, mine: Mask, piece: Mask, tool: int, material: str
) -> Iterator[GcodeFinding]:  # fmt: skip
    """Melt in the nozzle where a line begins is that where the one before it ended."""
    usual_mm = _value(design, material, "retraction_mm")
    at = np.cumsum(np.where(mine, _still(motion, usual_mm or 1.0), 0.0))
    lines = np.flatnonzero(mine & motion.prints)
    primed = [change.row for change in motion.changes if change.macro]  # by a macro of which nothing is known
    known = np.searchsorted(primed, lines) == np.searchsorted(primed, np.append(0, lines[:-1]))
    off = np.diff(at[lines], prepend=0.0)
    mine_off = off[piece[lines] & known]
    here = lines[piece[lines] & known]
    if not len(here):
        return
    wrong = np.abs(mine_off) > BALANCE_MM
    if wrong.any():
        worst = float(mine_off[wrong][np.abs(mine_off[wrong]).argmax()])
        what = "more" if worst > 0 else "less"
        message = f"{abs(worst):.2g} mm of filament {what} are pushed than drawn back before a line of tool {tool}"
        advice = f"balance retraction and prime of each travel within {BALANCE_MM:g} mm"
        yield GcodeFinding.of("melt", motion.number[here[wrong]], message, advice)
    in_lines, total = float(motion.extruded_mm[here].sum()), float(mine_off[~wrong].sum())
    if not -_LOSS * in_lines <= total <= _GAIN * in_lines:
        message = (
            f"tool {tool}: primes exceed retractions by {total:.3g} mm of filament; its lines have {in_lines:.3g} mm"
        )
        yield GcodeFinding.of("melt", motion.number[here[:1]], message, "prime as much as is drawn back")
    if usual_mm:
        yield from _retraction(design, motion, mine, tool, usual_mm)


def _retraction(design: Design, motion: Motion, mine: Mask, tool: int, usual_mm: float) -> Iterator[GcodeFinding]:
    """Filament is drawn back before travels, about as far as the material needs."""
    length_mm = habits(motion).get(float(tool), (0.0, 0.0))[0]
    least, most = (share * usual_mm for share in _RETRACTION)
    far = mine & (motion.extruded_mm <= 0) & (motion.across_mm > _TRAVEL_MM)
    bare = far & ~retracted(motion, design.machine)
    by_firmware = any(event.command.code == "G11" for event in motion.events)
    never = not by_firmware and bare.sum() > _TRAVELS and bare.sum() > _UNRETRACTED * far.sum()
    if never or (length_mm and not least <= length_mm <= most):
        rows = far if never else mine & (motion.filament_mm < 0)
        how_mm = 0.0 if never else length_mm
        message = f"tool {tool} draws {how_mm:g} mm back before travels; its material needs {usual_mm:g} mm"
        advice = f"retract {least:.2g} to {most:.2g} mm"
        yield GcodeFinding.of("melt", motion.number[rows], message, advice)


def _fan(design: Design, motion: Motion, rows: Mask, tool: int, material: str) -> Iterator[GcodeFinding]:
    """The fan on the part runs where every source of the material advises it."""
    fan, least = design.machine.control.layer_fan, design.material(material).print_range("fan_percent", 0.0)[0]
    if fan is None or not 0 < least <= 100:
        return
    level = np.zeros(len(rows))
    for event in motion.events:
        command = event.command
        if command.code in ("M106", "M107") and (not command.has("P") or command.number("P") == fan):
            level[event.row :] = (command.number("S") or 0.0) / 2.55 if command.code == "M106" else 0.0
    wrong = rows & (level < _FAN * least)
    if wrong.any():
        message = (
            f"tool {tool} prints {material} with the fan at {level[wrong].min():.0f} %; its sources advise {least:g} %"
        )
        advice = f"switch the fan on (M106 P{fan} S255)"
        yield GcodeFinding.of("fan", motion.number[wrong], message, advice)


def _dwell(motion: Motion, design: Design, piece: Mask) -> Iterator[GcodeFinding]:
    """The nozzle never stands long, and hardly on the part."""
    rows = np.flatnonzero(motion.prints)
    if not len(rows):
        return
    took = seconds(motion, design.machine.max_speed_mm_s)
    waits = [(row, float(took[row])) for row in np.flatnonzero(took > DWELL_S).tolist()]
    stands = 0.0
    for row, wait in _waits(motion):
        last = int(rows[max(int(np.searchsorted(rows, row, side="right")) - 1, 0)])
        amid = rows[0] <= row < rows[-1]
        stands += wait * amid
        on_part = piece[last] and motion.end_mm[row, 2] - motion.end_mm[last, 2] < _ABOVE_MM
        if amid and (max(wait, stands) > DWELL_S or (wait > DWELL_ON_PART_S and on_part)):
            waits.append((row, wait))
    if waits:
        row, wait = max(waits, key=lambda each: each[1])
        message = (
            f"the nozzle stands for {wait:.3g} s; at most {DWELL_S:g} s in all, and {DWELL_ON_PART_S:g} s on the part"
        )
        yield GcodeFinding("dwell", "error", int(motion.number[row]), message, "leave the wait out", len(waits))


def _waits(motion: Motion) -> Iterator[tuple[int, float]]:
    """Move before each dwell (G4), and how long it is [s]."""
    for event in motion.events:
        if event.command.code == "G4" and event.row:
            yield event.row - 1, (event.command.number("S") or 0.0) + (event.command.number("P") or 0.0) / 1000


def _drags(design: Design, motion: Motion, tool: Whole, piece: Mask) -> Iterator[GcodeFinding]:
    """Travel in contact with what another tool has printed of the piece, without retraction."""
    if motion.length_mm.max() > _FAR_MM:
        return  # beyond reach, which another rule says
    found = crossings(motion, design.machine, rubbing_mm=np.zeros(int((motion.extruded_mm > 0).sum()))).travel
    low, high = (of(motion.end_mm[piece, :2], axis=0) for of in (np.min, np.max))
    here = ((found.place_mm[:, :2] > low) & (found.place_mm[:, :2] < high)).all(1) & (found.gap_mm <= CONTACT_MM)
    here &= ~retracted(motion, design.machine)[found.row]
    length, width, _ = design.printed.size_mm
    most_mm = DRAGGED_MM * max(length * width / 1000, 1.0)
    for one in np.unique(tool[found.row[here]]).tolist():
        mine = here & (tool[found.row] == one)
        dragged_mm = float(found.length_mm[mine].sum())
        if dragged_mm > most_mm:
            message = (
                f"tool {one} travels {dragged_mm:.0f} mm unretracted in contact with what other tools have printed"
            )
            advice = f"retract or lift; at most {most_mm:.0f} mm"
            yield GcodeFinding.of("drag", motion.number[found.row[mine]], message, advice)


@dataclass(frozen=True)
class Strand:
    """Travel of an electrode's nozzle over another material, by what insulates a strand on it from the other."""

    z_mm: Annotated[float, Column("z", "mm", "top of the other material")]
    insulation_mm: Annotated[
        float | None, Column("insulation left", "mm", "straight up or down to an electrode of the other terminal")
    ]
    contact_mm: Annotated[float, Column("contact", "mm")]
    near_mm: Annotated[float, Column("near", "mm")]


@dataclass(frozen=True)
class DesignDrags(Drags):
    """Travel over foreign material in the print of a design.

    Attributes
    ----------
    strands : tuple of Strand
        By layer, the thinnest insulation first.
    """

    strands: tuple[Strand, ...]

    def document(self) -> Iterator[Part]:
        """Tables by tool, by layer, and of strands."""
        yield from super().document()
        if self.strands:
            yield Table.of("strands", "Insulation left if a strand from an electrode conducted", self.strands)


def drags(design: Design, source: Source) -> DesignDrags:
    """Measure the travel over foreign material in a print of a design, by whatever slicer.

    Parameters
    ----------
    design : Design
        That was sliced.
    source : Path, bytes or iterable of str
        The G-code.

    Raises
    ------
    BadInput
        The file cannot be read, or prints something else.

    Notes
    -----
    A strand belongs to the electrode that was printed last. It is taken as thin, and for conducting over all its
    length: whether it does is not known. Vertical distance alone, by lines as rectangles of their volume.
    """
    text = text_of(source)
    here, machine = placed(design, text), design.machine
    motion = follow(text, machine.control.prime_macro)
    wanted = {design.tool(body.material) for body in design.printed.bodies}
    used = set(printed_lines(motion, machine, "printer").tool.tolist())
    numbering: Numbering = "printer" if wanted <= used else "slicer"
    found, lines = crossings(motion, machine, numbering), printed_lines(motion, machine, numbering)
    known = beads(design, here.paths, here.centre_mm)
    terminals = [body.terminal for body in design.printed.bodies]
    of = {number: terminals[body] for number, body in zip(known.number.tolist(), known.body.tolist(), strict=True)}
    terminal = np.array([of.get(number, "") for number in lines.number.tolist()])
    travel, row = found.travel, found.travel.row
    place = travel.place_mm - travel.gap_mm[:, None] * [0.0, 0.0, 1.0]  # where a strand would lie
    last = _last_lines(lines, found.tool[row], motion.number[row])
    own = np.where(last >= 0, terminal[last], "")
    left = np.full(len(row), np.inf)
    for one in set(terminals) - {""}:
        others = (terminal != "") & (terminal != one)
        left[own == one] = _insulation(place[own == one], lines.of(others), np.unique(lines.top_mm))
    keys = np.round(np.column_stack([left / _STEP_MM, place[:, 2] / _STEP_MM]))
    touches, strands = travel.gap_mm <= CONTACT_MM, []
    for left_steps, z_steps in np.unique(keys[own != ""], axis=0).tolist():
        here = (keys == (left_steps, z_steps)).all(1) & (own != "")
        lengths = [float(travel.length_mm[here & rows].sum()) for rows in (touches, ~touches)]
        insulation = round(left_steps * _STEP_MM, 4) if np.isfinite(left_steps) else None
        strands.append(Strand(round(z_steps * _STEP_MM, 4), insulation, *lengths))
    return DesignDrags(**vars(summed(motion, found, machine)), strands=tuple(strands))


def _last_lines(lines: PrintedLines, tool: Whole, number: Whole) -> Whole:
    """Row of the line that a tool has printed last before a line of the file, -1 without any (n,)."""
    last = np.full(len(tool), -1)
    for one in np.unique(lines.tool).tolist():
        mine, rows = np.flatnonzero(lines.tool == one), tool == one
        before = np.searchsorted(lines.number[mine], number[rows]) - 1
        last[rows] = np.where(before >= 0, mine[before], -1)
    return last


def _insulation(place_mm: Real, lines: PrintedLines, tops_mm: Real) -> Real:
    """Height between places and lines straight above or below, of layers with some tops; infinite without any [mm]."""
    found = np.full(len(place_mm), np.inf)
    if not len(lines.tool) or not len(place_mm):
        return found
    height = np.diff(tops_mm, prepend=0.0)[np.searchsorted(tops_mm, lines.top_mm)]
    ways = shapely.linestrings(np.stack([lines.start_mm, lines.end_mm], axis=1))
    tree = shapely.STRtree(shapely.buffer(ways, lines.width_mm / 2, cap_style="square"))
    point, line = tree.query(shapely.points(place_mm[:, :2]), predicate="intersects")
    z, top = place_mm[point, 2], lines.top_mm[line]
    np.minimum.at(found, point, np.maximum(np.maximum(z - top, top - height[line] - z), 0.0))
    return found
