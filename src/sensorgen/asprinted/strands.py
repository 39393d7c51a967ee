"""Insulation that would be left if what a conductor's nozzle drags over another material conducted."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import shapely

from sensorgen.asprinted.beads import beads
from sensorgen.asprinted.registration import placed
from sensorgen.core.arrays import Real
from sensorgen.core.document import Column, Part, Table
from sensorgen.design.design import Design
from sensorgen.export.gcode.crossings import CONTACT_MM, PrintedLines, crossings, printed_lines
from sensorgen.export.gcode.drags import summed
from sensorgen.export.gcode.motion import Numbering, follow
from sensorgen.export.gcode.reading import Source, text_of
from sensorgen.export.gcode.results import Drags

_STEP_MM = 0.01  # to which insulation is rounded


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
    # the line that a tool has printed last before each of its travels
    last = np.full(len(row), -1)
    for tool in np.unique(lines.tool).tolist():
        mine, rows = np.flatnonzero(lines.tool == tool), found.tool[row] == tool
        before = np.searchsorted(lines.number[mine], motion.number[row[rows]]) - 1
        last[rows] = np.where(before >= 0, mine[before], -1)
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
