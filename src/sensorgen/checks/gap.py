"""Rules 1 and 2: the electrodes are apart, and the film between them is printed as drawn."""

from collections.abc import Iterator
from itertools import pairwise
from operator import itemgetter

import shapely

from sensorgen.checks.slices import TOUCH_MM, Slices
from sensorgen.checks.widths import VANISHES
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.scene import Body

Pair = tuple[Body, Body]


def check(slices: Slices, printer: Printer, quality: Quality, gap_mm: float) -> Iterator[Finding]:
    """Findings about the electrode gaps; ``gap_mm`` is the exact smallest distance of the electrodes.

    Of three electrodes or more, plates separate neighbours: there the distance is that of their faces.
    """
    ends = [(*_ends(body), body) for body in slices.scene.bodies if body.terminal]
    pairs = [(a, b) for a, b in pairwise(sorted(ends, key=itemgetter(0))) if a[2].terminal != b[2].terminal]
    for (_, top, low), (bottom, _, high) in pairs:
        apart = gap_mm if len(pairs) == 1 else round(bottom - top, 9)
        place = (0.0, 0.0, top)
        if apart <= TOUCH_MM:
            yield Finding(
                "1-short", "error", f"{low.name} / {high.name}", "the electrodes touch: a short by design",
                "give the film a thickness (dielectric_mm)", round(apart, 9), 0.0, place_mm=place,
            )  # fmt: skip
        elif not _on_edge((low, high), slices, apart):
            film = list(_film((low, high), place, slices, quality.layer_mm, apart))
            yield from film
            if not any(f.severity == "error" for f in film):
                yield from _printed((low, high), place, slices, printer, apart)


def _ends(body: Body) -> tuple[float, float]:
    """Lowest and highest place of a body [mm]."""
    lows, highs = zip(*(piece.span("z") for piece in body.pieces), strict=True)
    return min(lows), max(highs)


def _on_edge(pair: Pair, slices: Slices, gap_mm: float) -> bool:
    """Test whether electrodes are nearest beside each other: lines make such a film (rules 5 and 6), layers do not."""
    regions = ([slices.body(body, k) for body in pair] for k in range(len(slices.layers)))
    return any(float(shapely.distance(*each)) <= gap_mm + TOUCH_MM for each in regions)


def _film(
    pair: Pair, place: tuple[float, float, float], slices: Slices, layer: float, gap_mm: float
) -> Iterator[Finding]:
    """The film's thickness, drawn and printed."""
    names = f"{pair[0].name} / {pair[1].name}"
    printed_mm = round(slices.layers.printed_mm(place[2] + gap_mm) - slices.layers.printed_mm(place[2]), 9)
    if gap_mm < layer / 2 + TOUCH_MM or printed_mm <= 0:
        yield Finding(
            "2-film", "error", names,
            f"the film of {gap_mm:g} mm may not be printed at all: a layer is {layer:g} mm",
            f"use {layer:g} mm or more, or a quality with thinner layers",
            round(gap_mm, 9), round(layer / 2, 9), place_mm=place,
        )  # fmt: skip
        return
    if abs(printed_mm - gap_mm) > TOUCH_MM:
        count = gap_mm / layer
        sizes = dict.fromkeys(f"{max(1, whole) * layer:g}" for whole in (int(count), int(count) + 1))
        yield Finding(
            "2-film", "warning", names,
            f"the film of {gap_mm:g} mm is {count:.3g} layers of {layer:g} mm: it will print {printed_mm:g} mm thick",
            f"use {' or '.join(sizes)} mm", round(gap_mm, 9), printed_mm, place_mm=place,
        )  # fmt: skip
    if printed_mm < 2 * layer - TOUCH_MM:
        yield Finding(
            "2-film", "warning", names,
            "the film is a single layer: one pinhole shorts the electrodes",
            f"use {2 * layer:g} mm or more, or thinner layers", printed_mm, round(2 * layer, 9), place_mm=place,
        )  # fmt: skip


def _printed(
    pair: Pair, place: tuple[float, float, float], slices: Slices, printer: Printer, gap_mm: float
) -> Iterator[Finding]:
    """The gap as printed, where narrow parts vanish: by walls, the width up to which they do."""
    widths = {
        "Arachne": VANISHES * printer.nozzle_mm,
        "classic walls or plain Cura": printer.line_mm() - 2 * TOUCH_MM,  # a whole line prints
        "Cura filling outline gaps": 0.0,
    }
    by_gap: dict[float | None, list[str]] = {}
    for walls, least in widths.items():
        low, high = (slices.printed_layers(body, least) for body in pair)
        boundaries = slices.layers.boundaries_mm
        gap = round(boundaries[high[0]] - boundaries[low[-1] + 1], 9) if low and high else None
        by_gap.setdefault(gap, []).append(walls)
    if all(gap is not None and abs(gap - gap_mm) <= TOUCH_MM for gap in by_gap):
        return
    gaps = (f"{'nothing' if gap is None else f'{gap:g} mm'} ({', '.join(walls)})" for gap, walls in by_gap.items())
    yield Finding(
        "2-printed-gap", "warning", f"{pair[0].name} / {pair[1].name}",
        f"electrode gap: {gap_mm:g} mm drawn, as printed {', '.join(gaps)}",
        "widen narrow parts to a line, use thinner layers, or put the faces on layer boundaries",
        max((gap for gap in by_gap if gap is not None), default=None), round(gap_mm, 9), place_mm=place,
    )  # fmt: skip
