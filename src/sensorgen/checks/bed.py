"""Rule 8: the sensor fits on the bed."""

from collections.abc import Iterator

from sensorgen.checks.slices import TOUCH_MM
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer
from sensorgen.scene.scene import Scene


def check(scene: Scene, printer: Printer) -> Iterator[Finding]:
    """Findings about the footprint and the height."""
    length, width, height = scene.size_mm
    bed_x, bed_y = printer.bed_mm
    if length > bed_x + TOUCH_MM or width > bed_y + TOUCH_MM:
        turned = length <= bed_y + TOUCH_MM and width <= bed_x + TOUCH_MM
        side = max(((length, bed_x), (width, bed_y)), key=lambda pair: pair[0] - pair[1])
        yield Finding(
            "8-bed", "error", "sensor",
            f"{length:g} x {width:g} mm do not fit on the bed of {printer.name}, {bed_x:g} x {bed_y:g} mm",
            "swap length and width" if turned else "make it smaller, or print it in tiles",
            side[0], side[1], place_mm=(0.0, 0.0, 0.0),
        )  # fmt: skip
    if height > printer.height_mm + TOUCH_MM:
        yield Finding(
            "8-bed", "error", "sensor",
            f"{height:g} mm are higher than {printer.name} prints, {printer.height_mm:g} mm",
            "make it lower", height, printer.height_mm, place_mm=(0.0, 0.0, height),
        )  # fmt: skip
