"""Rules 1 and 2: the electrodes stay apart, and the film between them is printed as drawn."""

from collections.abc import Iterator
from itertools import pairwise

from sensorgen.checks.slices import TOUCH_MM, Layers, Slices
from sensorgen.checks.widths import VANISHES
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.scene import Body, Scene

Pair = tuple[Body, Body]


def check(slices: Slices, printer: Printer, quality: Quality, gap_mm: float) -> Iterator[Finding]:
    """Findings about the electrode gaps; ``gap_mm`` is the exact smallest distance of the electrodes.

    Of three electrodes or more, plates separate neighbours: there the distance is that of their faces.
    """
    pairs = [pair for pair in pairwise(_electrodes(slices.scene)) if pair[0].terminal != pair[1].terminal]
    for pair in pairs:
        yield from _between_two(pair, slices, printer, quality, gap_mm if len(pairs) == 1 else _apart_mm(pair))


def _apart_mm(pair: Pair) -> float:
    """Height from the lower electrode's top to the upper one's lowest place [mm]."""
    low, high = pair
    return round(min(p.span("z")[0] for p in high.prisms) - max(p.span("z")[1] for p in low.prisms), 9)


def _between_two(pair: Pair, slices: Slices, printer: Printer, quality: Quality, gap_mm: float) -> Iterator[Finding]:
    low, high = pair
    names = f"{low.name} / {high.name}"
    place = (0.0, 0.0, max(p.span("z")[1] for p in low.prisms))
    layer = quality.layer_mm
    if gap_mm <= TOUCH_MM:
        yield Finding(
            "1-short", "error", names, "the electrodes touch: a short by design",
            "give the film a thickness (dielectric_mm)", round(gap_mm, 9), 0.0, place_mm=place,
        )  # fmt: skip
        return
    printed_mm = _between(slices.layers, place[2], gap_mm)
    if gap_mm < layer / 2 - TOUCH_MM or printed_mm <= 0:
        yield Finding(
            "2-film", "error", names,
            f"the film of {gap_mm:g} mm may not be printed at all: a layer is {layer:g} mm",
            f"use {layer:g} mm or more, or a quality with thinner layers",
            round(gap_mm, 9), round(layer / 2, 9), place_mm=place,
        )  # fmt: skip
        return
    yield from _film(names, place, layer, gap_mm, printed_mm)
    yield from _printed(pair, slices, printer, gap_mm)


def _between(layers: Layers, bottom_mm: float, thickness_mm: float) -> float:
    """Thickness that something comes out with [mm]."""
    return round(layers.printed_mm(bottom_mm + thickness_mm) - layers.printed_mm(bottom_mm), 9)


def _film(
    names: str, place: tuple[float, float, float], layer: float, gap_mm: float, printed_mm: float
) -> Iterator[Finding]:
    if abs(printed_mm - gap_mm) > TOUCH_MM:
        count = gap_mm / layer
        below, above = max(1, int(count)) * layer, (int(count) + 1) * layer
        yield Finding(
            "2-film", "warning", names,
            f"the film of {gap_mm:g} mm is {count:.3g} layers of {layer:g} mm: it will print {printed_mm:g} mm thick",
            f"use {below:g} or {above:g} mm", round(gap_mm, 9), printed_mm, place_mm=place,
        )  # fmt: skip
    if printed_mm < 2 * layer - TOUCH_MM:
        yield Finding(
            "2-film", "warning", names,
            "the film is a single layer: one pinhole shorts the electrodes",
            f"use {2 * layer:g} mm or more, or thinner layers", printed_mm, round(2 * layer, 9), place_mm=place,
        )  # fmt: skip


def _printed(pair: Pair, slices: Slices, printer: Printer, gap_mm: float) -> Iterator[Finding]:
    """The gap as printed, where narrow parts vanish."""
    tracks = {
        "Arachne": VANISHES * printer.nozzle_mm,
        "classic walls or plain Cura": printer.line_mm() - 2 * TOUCH_MM,  # a whole line prints
        "Cura filling outline gaps": 0.0,
    }
    gaps = {slicer: printed_gap_mm(pair, slices, least) for slicer, least in tracks.items()}
    if all(gap is not None and abs(gap - gap_mm) <= TOUCH_MM for gap in gaps.values()):
        return
    by_gap = {gap: [slicer for slicer, other in gaps.items() if other == gap] for gap in gaps.values()}
    said = ", ".join(
        f"{'nothing' if gap is None else f'{gap:g} mm'} ({', '.join(slicers)})" for gap, slicers in by_gap.items()
    )
    low, high = pair
    worst = max((gap for gap in gaps.values() if gap is not None), default=None)
    yield Finding(
        "2-printed-gap", "warning", f"{low.name} / {high.name}",
        f"electrode gap: {gap_mm:g} mm drawn, as printed {said}",
        "widen narrow parts to a line, use thinner layers, or put the faces on layer boundaries",
        worst, round(gap_mm, 9), place_mm=(0.0, 0.0, max(p.span("z")[1] for p in low.prisms)),
    )  # fmt: skip


def printed_gap_mm(pair: Pair, slices: Slices, least_mm: float) -> float | None:
    """Distance of the two electrodes when stretches up to ``least_mm`` wide are not printed; None without them [mm]."""
    low, high = (slices.printed_layers(body, least_mm) for body in pair)
    if not low or not high:
        return None
    boundaries = slices.layers.boundaries_mm
    return round(boundaries[high[0]] - boundaries[low[-1] + 1], 9)


def _electrodes(scene: Scene) -> list[Body]:
    """The terminals' bodies, the one nearest to the bed first."""
    bodies = [b for b in scene.bodies if b.terminal]
    return sorted(bodies, key=lambda b: min(p.span("z")[0] for p in b.prisms))
