"""The prime tower: where the bed is kept clear of sensors, so that each tool starts with a full nozzle.

The Diabase lifts by 40 mm for a tool change and the nozzle oozes meanwhile; without priming the first
lines of each layer would be missing.
"""

import math
from dataclasses import dataclass

from sensorgen.design.printer import Printer, Quality

PRIME_MM3 = 15.0  # what PrusaSlicer takes a nozzle to need before its pressure is steady
MARGIN_MM = 10.0  # to the edges of the bed: the skirt goes round the tower too


@dataclass(frozen=True)
class Tower:
    """A square on the bed, in the printer's own coordinates [mm]: its front left corner and its side."""

    x_mm: float
    y_mm: float
    side_mm: float


def tower(printer: Printer, quality: Quality, tools: int) -> Tower:
    """Place of the prime tower, in the far right corner of the bed.

    Parameters
    ----------
    printer, quality : Printer, Quality
        Their bed and their thinnest layer: priming a volume takes area over height.
    tools : int
        How many tools print [-].

    Returns
    -------
    Tower
        Its square; wide enough for a round tower (Cura's), hence for a rectangular one.
    """
    area_mm2 = tools * PRIME_MM3 / min(quality.layer_mm, quality.first_layer_mm)
    side_mm = float(math.ceil(2 * math.sqrt(area_mm2 / math.pi)))
    centre_x, centre_y = printer.bed_centre_mm()
    return Tower(
        x_mm=centre_x + printer.bed_mm[0] / 2 - MARGIN_MM - side_mm,
        y_mm=centre_y + printer.bed_mm[1] / 2 - MARGIN_MM - side_mm,
        side_mm=side_mm,
    )
