"""Duration of moves, as far as a file says: feeds and the axes' limits, without acceleration."""

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.printer import MaxSpeed
from sensorgen.export.gcode.moves import Motion

Floats = NDArray[np.float64]


def seconds(motion: Motion, fastest: MaxSpeed) -> Floats:
    """Duration of each move, (n,) [s].

    The feed is that of the nozzle, or of the filament where the nozzle rests; an axis that could not follow
    slows the whole move, as the firmware does. Accelerations are the printer's own and unknown here, so a
    print takes longer than the sum.

    Parameters
    ----------
    motion : Motion
        The moves.
    fastest : MaxSpeed
        The axes' limits [mm/s].
    """
    filament = np.abs(motion.filament_mm)
    across, up = motion.across_mm, np.abs(motion.rows[:, 5] - motion.rows[:, 2])
    way = np.hypot(across, up)
    longest: Floats = np.where(way > 0, way, filament) / np.maximum(motion.feed_mm_min / 60, 1e-3)
    for length, limit in ((across, fastest.xy), (up, fastest.z), (filament, fastest.extruder)):
        np.maximum(longest, length / limit, out=longest)
    return longest
