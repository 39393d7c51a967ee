"""Extruded lines of one electrode of a print, for studies of contact resistance."""

import numpy as np

from sensorgen.solvers.network import StraightLines


def electrode_lines(design, lines, end):
    """The extruded lines of one electrode as a network, its middle at the origin."""
    mine = [k for k, body in enumerate(design.printed.bodies) if body.terminal == end]
    found = lines.of(np.isin(lines.body, mine))
    middle = np.array(design.printed.size_mm[:2]) / 2
    start, stop = ((p - middle) * 1e-3 for p in (found.start_mm, found.end_mm))
    meets = np.append(False, (np.abs(start[1:] - stop[:-1]) < 1e-7).all(1))
    meets[1:] &= found.layer[1:] == found.layer[:-1]
    return StraightLines(start, stop, found.width_mm * 1e-3, found.height_mm * 1e-3, found.layer, meets)
