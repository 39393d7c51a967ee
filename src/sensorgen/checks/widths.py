"""Rules 5 and 6: what is too narrow at mid-layer vanishes or swells, and narrow gaps close.

The limits were found by slicing (PrusaSlicer 2.5 with Arachne and with classic walls, CuraEngine 4.13; nozzle
0.4 mm, line 0.44 mm) and scale with the nozzle.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from sensorgen.checks.slices import TOUCH_MM, Layers, Run, Slice, Slices, shown
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer
from sensorgen.scene.scene import Body, Prism

# As shares of the nozzle.
VANISHES = 0.12 / 0.4  # only Cura filling outline gaps prints a stretch this narrow
SWELLS = 0.34 / 0.4  # Arachne prints anything narrower at this width
OVERFILLED = 0.70 / 0.4  # classic walls put 1.8 to 1.17 times the material into anything narrower
GAP_CLOSES = 0.10 / 0.4


@dataclass(frozen=True)
class _Band:
    """What becomes of stretches up to a width."""

    upto_mm: float
    severity: str
    message: str
    advice: str


def _bands(printer: Printer) -> tuple[_Band, ...]:
    """What a printer's nozzle makes of narrow stretches, from the narrowest on; a whole line prints."""
    line, swells = printer.line_mm(), SWELLS * printer.nozzle_mm
    return (
        _Band(
            VANISHES * printer.nozzle_mm, "error", "vanishes (Cura filling outline gaps prints it 1.7 times too full)",
            f"widen it to {line:.2g} mm",
        ),
        _Band(
            swells, "warning", f"prints {swells:.2g} mm wide (Arachne) or not at all (classic walls, plain Cura)",
            f"widen it to {line:.2g} mm",
        ),
        _Band(
            line - 2 * TOUCH_MM, "warning", "is narrower than a line: classic walls and plain Cura drop it",
            f"widen it to {line:.2g} mm, or slice with Arachne",
        ),
        _Band(
            OVERFILLED * printer.nozzle_mm, "info", "gets 1.2 to 1.8 times its material with classic walls",
            "slice with Arachne",
        ),
    )  # fmt: skip


def check(slices: Slices, printer: Printer) -> Iterator[Finding]:
    """Findings about widths and gaps at mid-layer, one per body, layer and width."""
    layers = slices.layers
    for body in slices.scene.bodies:
        pieces = {shape: Slice(shape) for shape in (slices.body(body, k) for k in range(len(layers))) if shape}
        for number in range(len(layers)):
            if slices.body(body, number):
                piece = pieces[slices.body(body, number)]
                yield from _narrow(body, piece, number, printer, layers)
                yield from _closing(body, piece, number, printer, layers)


def _narrow(body: Body, piece: Slice, number: int, printer: Printer, layers: Layers) -> Iterator[Finding]:
    bands = _bands(printer)
    tips = None
    for width, runs in _by_width(piece.runs(piece.filled), bands[-1].upto_mm).items():
        band = next(b for b in bands if width <= b.upto_mm + TOUCH_MM)
        if band.severity == "error" and tips is None:
            tips = _tips(body, number, layers)
        tip = band.severity == "error" and all((r.axis, r.start, r.end) in (tips or ()) for r in runs)
        severity = "warning" if tip or (band.severity == "error" and body.is_support()) else band.severity
        yield Finding(
            "5-width", severity, body.name,
            f"a {'tip' if tip else 'stretch'} {width:.3g} mm wide at mid-layer {band.message}",
            f"blunt the tip to {printer.line_mm():.2g} mm" if tip else band.advice,
            width, round(band.upto_mm, 6), number + 1, _place(runs[0], layers.mids_mm[number]), len(runs),
        )  # fmt: skip


def _closing(body: Body, piece: Slice, number: int, printer: Printer, layers: Layers) -> Iterator[Finding]:
    limit = GAP_CLOSES * printer.nozzle_mm
    for width, runs in _by_width(piece.enclosed(), limit - 2 * TOUCH_MM).items():
        yield Finding(
            "6-gap", "warning", body.name, f"a gap of {width:.3g} mm within the body closes when sliced",
            f"widen it to {limit:.2g} mm or more", width, round(limit, 9), number + 1,
            _place(runs[0], layers.mids_mm[number]), len(runs),
        )  # fmt: skip


def _by_width(runs: Iterable[Run], limit_mm: float) -> dict[float, list[Run]]:
    """Runs up to a width, by width; those along x first, so that a square counts once."""
    found: dict[float, list[Run]] = {}
    for run in sorted(runs):
        if run.width <= limit_mm + TOUCH_MM:
            found.setdefault(run.width, []).append(run)
    return {w: [r for r in rs if r.axis == rs[0].axis] for w, rs in sorted(found.items())}


def _tips(body: Body, number: int, layers: Layers) -> set[tuple[str, float, float]]:
    """Stretches that run out before the next sample, by axis, start and end [mm]: no thin walls or strips.

    Such a stretch loses half of its width or more between mid-layer and boundary, and so all of it up to the
    next sample, twice as far away.
    """
    mid, half = layers.mids_mm[number], layers.mids_mm[number] - layers.boundaries_mm[number]
    near = 1e-3 * half
    found = set()
    for prism in body.prisms:
        if prism.is_box() or prism.axis == "z":
            continue
        axis = "x" if prism.axis == "y" else "y"
        below, here, above = (_runs(prism, z, axis) for z in (mid - near, mid, mid + near))
        if len(below) == len(here) == len(above):  # the same pieces, each a little wider or narrower
            for (a0, a1), (start, end), (b0, b1) in zip(below, here, above, strict=True):
                loss = abs((b1 - b0) - (a1 - a0)) / 2 * half / near
                if end - start - loss < 0.51 * (end - start):
                    found.add((axis, start, end))
    return found


def _runs(prism: Prism, z_mm: float, axis: str) -> list[tuple[float, float]]:
    """Where a prism starts and ends along an axis at a height, in order [mm]."""
    return sorted((r.x0, r.x1) if axis == "x" else (r.y0, r.y1) for r in shown(prism, z_mm))


def _place(run: Run, z_mm: float) -> tuple[float, float, float]:
    middle = round((run.start + run.end) / 2, 9)
    return (middle, run.across, z_mm) if run.axis == "x" else (run.across, middle, z_mm)
