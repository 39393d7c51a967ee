"""Resistance of an electrode as a network of its extruded lines, estimated or from a tool path."""

from collections.abc import Sequence
from math import ceil

import numpy as np

from sensorgen.asprinted.beads import Beads
from sensorgen.asprinted.rectilinear import plate
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import resistivities
from sensorgen.models import traxels
from sensorgen.solvers.network.lines import Lines

CONTACTS_OHM_M2 = (0.0, 1e-6, 1e-5, 1e-4)  # no source gives the contact resistivity of printed eTPU
DEGREES = 45.0  # direction of PrusaSlicer's infill in our profiles, turned by 90 from layer to layer
_CLAMP_LINES = 2.6  # the contacts hold what lies nearer to an end than this many lines: walls and turns of infill
_JOINED_MM = 1e-4


def resistance_ohm(
    design: Design, lines: Beads | None = None, contacts_ohm_m2: Sequence[float] = CONTACTS_OHM_M2
) -> dict[str, list[float]]:
    """Resistance of each electrode from end to end, one for each contact resistivity [ohm].

    Parameters
    ----------
    design : Design
        As drawn.
    lines : Beads, optional
        Of a tool path; walls and infill as PrusaSlicer lays them if not given.
    contacts_ohm_m2 : sequence of float
        Contact resistivities between lines [ohm m2].

    Raises
    ------
    OutOfRange
        The sensor is too short for its contacts, or no line prints an electrode.
    MissingValue
        No source gives a resistivity.
    """
    length, width, _ = design.printed.size_mm
    clamp = _CLAMP_LINES * design.machine.line_mm()
    if length <= 4 * clamp:
        raise OutOfRange(f"an electrode of {length:g} mm; expected more than {4 * clamp:g} mm between its contacts")
    area, reach = design.params.electrode_mm * width * M_PER_MM**2, (length / 2 - clamp) * M_PER_MM
    rho, found = resistivities(design), {}
    for end, solid in solid_ohm(design).items():
        network = _estimated_lines(design) if lines is None else electrode(design, lines, end)
        found[end] = [
            solid * traxels.resistance(network, rho[end].value, contact, (-reach, reach), area).ratio
            for contact in contacts_ohm_m2
        ]
    return found


def solid_ohm(design: Design) -> dict[str, float]:
    """Of each electrode rho L / (H W) of its plate alone [ohm]."""
    p = design.params
    per_rho = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    return {end: rho.value * per_rho for end, rho in resistivities(design).items()}


def _estimated_lines(design: Design) -> Lines:
    length, width, _ = design.printed.size_mm
    count = max(ceil(design.params.electrode_mm / design.layers.layer_mm - 1e-9), 1)
    height = design.params.electrode_mm / count
    line = width / round(width / design.machine.line_mm())
    return plate(length, width, line, height, [DEGREES + 90 * (k % 2) for k in range(count)])


def electrode(design: Design, lines: Beads, end: str) -> Lines:
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
