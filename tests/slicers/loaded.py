"""Printers and qualities that ship, and the usual materials on a printer's tools, for tests of profiles."""

import pytest

from sensorgen.design import materials
from sensorgen.design.printer import Printer, load_printer, load_quality, printer_names, quality_names
from sensorgen.export.slicers.loads import ToolLoad

DIABASE = load_printer("diabase-h5")
FINE = load_quality("fine")
both_printers = pytest.mark.parametrize(
    "printer", [load_printer(name) for name in printer_names()], ids=lambda p: p.name
)
both_qualities = pytest.mark.parametrize("quality", [load_quality(n) for n in quality_names()], ids=lambda q: q.name)


def usual(printer: Printer, **override: object) -> dict[int, ToolLoad]:
    """Electrodes and dielectric on the printer's usual tools; ``override`` is for the dielectric."""
    tools, etpu, x60 = printer.default_tools, materials.load("etpu"), materials.load("x60")
    return {tools["etpu"]: ToolLoad(etpu), tools["x60"]: ToolLoad(x60, **override)}


def ini(text: str) -> dict[str, str]:
    """Settings of a profile of PrusaSlicer."""
    lines = (line.partition("=") for line in text.splitlines() if "=" in line and not line.startswith("#"))
    return {key.strip(): value.strip() for key, _, value in lines}
