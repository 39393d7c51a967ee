"""Resistance of the electrodes of a body, end to end, cogs included."""

import numpy as np

from sensorgen.asprinted.beads import Beads
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.values import resistivities
from sensorgen.models import conduction, traxels
from sensorgen.prediction.spread import spread
from sensorgen.scene.scene import Scene
from sensorgen.solvers.network.lines import Lines

_CLAMP_LINES = 2.6  # the contacts hold what lies nearer to an end than this many lines: walls and turns of infill
_JOINED_MM = 1e-4


def electrode_resistance(body: Body) -> dict[str, Bounds]:
    """Resistance of the top and the bottom electrode from end to end [ohm].

    Parameters
    ----------
    body : Body
        Drawn or printed. Cogs conduct as :mod:`sensorgen.models.conduction` says; along a tool path the contacts
        between extruded lines, of no resistance of their own, add what the network of lines says.

    Raises
    ------
    MissingValue
        No source gives a resistivity.
    OutOfRange
        An electrode that does not reach from end to end.
    """
    design, found = body.design, {}
    for end, rho in resistivities(design).items():
        scene, *others = dict.fromkeys(body.cells.scenes.values())
        solid = _of_cell(body, scene, end, rho.value)
        printed = [solid.middle()]
        for other in others:
            try:
                printed.append(_of_cell(body, other, end, rho.value).middle())
            except OutOfRange:  # by this rule the electrode is interrupted
                printed.append(float("inf"))
        lines = _line_factor(body, end, rho.value)
        value, (low, high) = solid.middle() * lines, spread(design, rho)
        relative = Interval(low / rho.value, high / rho.value) if rho.value else Interval(1.0, 1.0)
        found[end] = Bounds.of(
            value, "ohm", model=solid.times(lines), print=Interval(min(printed), max(*printed, value)), certified=True,
            material=relative.times(value),
        )  # fmt: skip
    return found


def _of_cell(body: Body, scene: Scene, end: str, resistivity_ohm_m: float) -> Interval:
    """Of the whole sensor, from one unit cell: cells in series along it, in parallel across it [ohm]."""
    p = body.design.params
    in_series, in_parallel = p.length_mm / scene.size_mm[0], p.width_mm / scene.size_mm[1]
    return conduction.electrode_resistance(scene, end, resistivity_ohm_m).times(in_series / in_parallel)


def _line_factor(body: Body, end: str, resistivity_ohm_m: float) -> float:
    """Resistance of extruded lines over that of the solid plate, where a tool path is known [-]."""
    if body.cells.tracks is None or not resistivity_ohm_m:
        return 1.0
    design = body.design
    length, width, _ = design.printed.size_mm
    clamp = _CLAMP_LINES * design.machine.line_mm()
    if length <= 4 * clamp:
        raise OutOfRange(f"an electrode of {length:g} mm; expected more than {4 * clamp:g} mm to tell its resistance")
    area, reach = design.params.electrode_mm * width * M_PER_MM**2, (length / 2 - clamp) * M_PER_MM
    lines = electrode_lines(design, body.cells.tracks, end)
    return traxels.resistance(lines, resistivity_ohm_m, 0.0, (-reach, reach), area).ratio


def electrode_lines(design: Design, lines: Beads, end: str) -> Lines:
    """The lines of one electrode, its middle at the origin.

    Parameters
    ----------
    design : Design
        As drawn.
    lines : Beads
        Of the whole sensor.
    end : str
        "top" or "bottom".

    Raises
    ------
    OutOfRange
        None of it is printed.
    """
    mine = [k for k, body in enumerate(design.printed.bodies) if body.terminal == end]
    found = lines.of(np.isin(lines.body, mine))
    if not len(found.number):
        raise OutOfRange(f"no line prints the {end} electrode")
    middle = np.array(design.printed.size_mm[:2]) / 2
    start, stop = ((p - middle) * M_PER_MM for p in (found.start_mm, found.end_mm))
    meets = np.append(False, (np.abs(start[1:] - stop[:-1]) < _JOINED_MM * M_PER_MM).all(1))
    meets[1:] &= found.layer[1:] == found.layer[:-1]
    return Lines(start, stop, found.width_mm * M_PER_MM, found.height_mm * M_PER_MM, found.layer, meets)
