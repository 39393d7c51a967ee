"""Ledger of the nozzle and of time: melt that it has when it prints, dwell, fan, speed, and travel over other tools."""

from collections.abc import Iterator

import numpy as np

from sensorgen.asprinted.beads import Beads
from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.export.gcode.crossings import CONTACT_MM, crossings
from sensorgen.export.gcode.drags import habits, retracted
from sensorgen.export.gcode.motion import tools_of
from sensorgen.export.gcode.moves import Motion, seconds
from sensorgen.export.gcode.results import GcodeFinding

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
    printing = (motion.extruded_mm > 0) & (motion.across_mm > 0)
    piece = printing & np.isin(motion.number, lines.number)
    if not piece.any() or not set(lines.tool.tolist()) <= set(tool[piece].tolist()):
        return  # a slicer's own file, which is refused as such
    layer = np.zeros(len(tool), np.int64)
    number, first = np.unique(lines.number, return_index=True)
    layer[piece] = lines.layer[first][np.searchsorted(number, motion.number[piece])]
    for material in design.used():
        mine = design.tool(material)
        yield from _balance(design, motion, tool == mine, piece, mine, material)
        yield from _fan(design, motion, piece & (tool == mine) & (layer >= _FAN_FROM), mine, material)
    yield from _dwell(motion, design, printing, piece)
    fast = piece & (layer == 0) & (motion.feed_mm_min > 60 * FIRST_LAYER_MM_S * (1 + 1e-6))
    if fast.any():
        speed = float(motion.feed_mm_min[fast].max()) / 60
        message = f"the first layer is printed at {speed:g} mm/s; at most {FIRST_LAYER_MM_S:g} mm/s adhere"
        yield GcodeFinding(
            "speed", "error", _first(motion, fast), message, "print the first layer slower", int(fast.sum())
        )
    yield from _drags(design, motion, tool, piece)


def _first(motion: Motion, rows: Mask | Whole) -> int:
    return int(motion.number[rows][0])


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
    lines = np.flatnonzero(mine & (motion.extruded_mm > 0) & (motion.across_mm > 0))
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
        yield GcodeFinding("melt", "error", _first(motion, here[wrong]), message, advice, int(wrong.sum()))
    in_lines, total = float(motion.extruded_mm[here].sum()), float(mine_off[~wrong].sum())
    if not -_LOSS * in_lines <= total <= _GAIN * in_lines:
        message = (
            f"tool {tool}: primes exceed retractions by {total:.3g} mm of filament; its lines have {in_lines:.3g} mm"
        )
        yield GcodeFinding("melt", "error", _first(motion, here), message, "prime as much as is drawn back")
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
        yield GcodeFinding("melt", "error", _first(motion, rows), message, advice, int(rows.sum()))


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
        yield GcodeFinding("fan", "error", _first(motion, wrong), message, advice, int(wrong.sum()))


def _dwell(motion: Motion, design: Design, printing: Mask, piece: Mask) -> Iterator[GcodeFinding]:
    """The nozzle never stands long, and hardly on the part."""
    rows = np.flatnonzero(printing)
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
            rows = np.unique(found.row[mine])
            yield GcodeFinding("drag", "error", _first(motion, rows), message, advice, len(rows))
