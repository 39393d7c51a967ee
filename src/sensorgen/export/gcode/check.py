"""Check of a G-code file on a simulated printer: faults, and its needs of time, filament and purging."""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from sensorgen.core.errors import MissingValue, UnknownName
from sensorgen.design import materials
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import commands, limits
from sensorgen.export.gcode.motion import NOT_MODEL, executed
from sensorgen.export.gcode.moves import NO_TOOL, Motion, seconds
from sensorgen.export.gcode.reading import Source
from sensorgen.export.gcode.results import Checked, FileNeeds, ToolMaterial, merged


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
        yield ToolMaterial(tool, material, length_mm, purge_mm, volume_mm3, mass_g)


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
    findings = [*limits.check(motion, machine), *commands.check(motion, machine, loads)]
    findings += limits.check_loaded(motion, machine, loads, others_empty=others_empty)
    return Checked(**vars(report(motion, machine, dict(loaded or {}), texts)), findings=merged(findings))
