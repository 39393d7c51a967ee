"""All design rules about a scene: findings merged over layers, and the rules of gap, grid and bed (1 to 4, 8)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, pairwise
from operator import itemgetter

import shapely

from sensorgen.checks import bridges, estimate, volumes, widths
from sensorgen.checks.widths import TOUCH_MM, VANISHES, Layers, Slices
from sensorgen.core.findings import SEVERITIES, Finding
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import faces_mm
from sensorgen.scene.scene import Body, Point, Scene, extent


def bed_findings(scene: Scene, printer: Printer) -> Iterator[Finding]:
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


def grid_findings(scene: Scene, layers: Layers) -> Iterator[Finding]:
    """Findings about bodies and the layer grid."""
    for body in scene.bodies:
        yield from _faces(body, layers)
        yield from _samples(body, layers)


def _faces(body: Body, layers: Layers) -> Iterator[Finding]:
    levels = faces_mm(body)
    off = sorted(z for z in levels if layers.off_grid_mm(z) > TOUCH_MM)
    if not off:
        return
    low, high = min(levels), max(levels)
    thick, printed = high - low, layers.printed_mm(high) - layers.printed_mm(low)
    named = ", ".join(f"{z:g}" for z in off[:3]) + (" ..." if len(off) > 3 else "")
    effect = f"; it prints {printed:g} mm thick instead of {thick:g}" if abs(printed - thick) > TOUCH_MM else ""
    if any(abs(z - mid) < TOUCH_MM for z in off for mid in layers.mids_mm):
        effect += "; at mid-height of a layer: the estimate assumes that the body below takes it, which is not certain"
    yield Finding(
        "3-grid", "warning", body.name, f"faces at {named} mm lie between layer boundaries{effect}",
        f"move them to {', '.join(dict.fromkeys(f'{layers.printed_mm(z):g}' for z in off[:3]))} mm",
        round(off[0], 9), round(layers.printed_mm(off[0]), 9),
        place_mm=_place(body, off[0]), count=len(off),
    )  # fmt: skip


def _samples(body: Body, layers: Layers) -> Iterator[Finding]:
    spans = list(dict.fromkeys(p.span("z") for p in body.pieces))
    lost = [span for span in spans if not any(_within(mid, span) for mid in layers.mids_mm)]
    for low, high in lost:
        yield Finding(
            "4-unsampled", "error", body.name,
            f"{low:g} to {high:g} mm ({high - low:g} mm) lies between the slicer's sampling planes and is not printed",
            "make it a layer thick, or move it onto the layer grid",
            round(high - low, 9), layers.boundaries_mm[1] / 2, place_mm=_place(body, (low + high) / 2),
            count=sum(p.span("z") == (low, high) for p in body.pieces),
        )  # fmt: skip
    yield from _cut_off(body, [span for span in spans if span not in lost], layers)


def _cut_off(body: Body, spans: Sequence[Point], layers: Layers) -> Iterator[Finding]:
    """Ends of a body in layers whose sample hits none of it."""
    for number, ((low, high), mid) in enumerate(zip(pairwise(layers.boundaries_mm), layers.mids_mm, strict=True)):
        here = [(a, b) for a, b in ((max(s[0], low), min(s[1], high)) for s in spans) if b - a > TOUCH_MM]
        if here and not any(_within(mid, span) for span in here):
            bottoms, tops = zip(*here, strict=True)
            height = max(b - a for a, b in here)
            end, side = ("top", "below") if min(tops) < high else ("lowest", "above")
            yield Finding(
                "4-unsampled", "warning", body.name,
                f"the {end} {height:.3g} mm lies {side} the slicer's sampling plane and is not printed",
                "move the face to a layer boundary", round(height, 9), round((high - low) / 2, 9), number + 1,
                _place(body, (min(bottoms) + max(tops)) / 2),
            )  # fmt: skip


def _within(z_mm: float, span: tuple[float, float]) -> bool:
    """Test whether a sample hits: one on a face between two bodies hits the lower one."""
    return span[0] + TOUCH_MM < z_mm < span[1] + TOUCH_MM


def _place(body: Body, z_mm: float) -> tuple[float, float, float]:
    """A place of the body at or next to a height [mm]."""
    piece = min(body.pieces, key=lambda p: max(p.span("z")[0] - z_mm, z_mm - p.span("z")[1], 0.0))
    return (piece.span("x")[0], piece.span("y")[0], round(z_mm, 9))


Pair = tuple[Body, Body]


def gap_findings(slices: Slices, printer: Printer, quality: Quality, gap_mm: float) -> Iterator[Finding]:
    """Findings about the electrode gaps; ``gap_mm`` is the exact smallest distance of the electrodes.

    Of three electrodes or more, plates separate neighbours: there the distance is that of their faces.
    """
    pairs = _neighbours(slices.scene)
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


def _neighbours(scene: Scene) -> list[tuple[tuple[float, float, Body], tuple[float, float, Body]]]:
    """Electrodes of two terminals, one above the other, each with its lowest and highest place [mm]."""
    ends = [(*extent(body.pieces, "z"), body) for body in scene.bodies if body.terminal]
    return [(a, b) for a, b in pairwise(sorted(ends, key=itemgetter(0))) if a[2].terminal != b[2].terminal]


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
    """The gap as printed, where narrow parts vanish."""
    by_gap = _printed_gaps(pair, slices, printer)
    if all(gap is not None and abs(gap - gap_mm) <= TOUCH_MM for gap in by_gap):
        return
    gaps = (f"{'nothing' if gap is None else f'{gap:g} mm'} ({', '.join(walls)})" for gap, walls in by_gap.items())
    yield Finding(
        "2-printed-gap", "warning", f"{pair[0].name} / {pair[1].name}",
        f"electrode gap: {gap_mm:g} mm drawn, as printed {', '.join(gaps)}",
        "widen narrow parts to a line, use thinner layers, or put the faces on layer boundaries",
        max((gap for gap in by_gap if gap is not None), default=None), round(gap_mm, 9), place_mm=place,
    )  # fmt: skip


def _printed_gaps(pair: Pair, slices: Slices, printer: Printer) -> dict[float | None, list[str]]:
    """Gap to the walls that print it [mm]; None where an electrode vanishes, as parts do up to a width."""
    widths = {
        "Arachne": VANISHES * printer.nozzle_mm,
        "classic walls or plain Cura": printer.line_mm() - 2 * TOUCH_MM,  # a whole line prints
        "Cura filling outline gaps": 0.0,
    }
    by_gap: dict[float | None, list[str]] = {}
    for walls, least in widths.items():
        boundaries, count = slices.layers.boundaries_mm, len(slices.layers)
        low, high = ([k for k in range(count) if not slices.printed(body, k, least).is_empty] for body in pair)
        gap = round(boundaries[high[0]] - boundaries[low[-1] + 1], 9) if low and high else None
        by_gap.setdefault(gap, []).append(walls)
    return by_gap


# Names of all rules; those from 10 on are about the design's file and about the G-code.
RULES = (
    "0-body", "0-printer", "1-short", "2-film", "2-printed-gap", "3-grid", "4-unsampled", "5-width", "6-gap",
    "7-printed", "8-bed", "9-bridge", "9-loose", "9-support", "10-film", "10-waiver", "11-crossing", "11-overlap",
    "11-profile", "11-repaired", "11-size", "11-surface", "12-numbers", "13-gcode",
)  # fmt: skip


def findings(
    scene: Scene, printer: Printer, quality: Quality, gap_mm: float, walls: str = "arachne",
    laid: Mapping[str, estimate.LineLayout] | None = None,
) -> list[Finding]:  # fmt: skip
    """All findings about a scene, the most severe first.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    printer, quality : Printer, Quality
        What prints it.
    gap_mm : float
        Smallest distance of the electrodes, exact [mm].
    walls : str
        Of the slicer, one of :data:`sensorgen.checks.estimate.RULES`.
    laid : mapping of str to LineLayout, optional
        Material to its lines; solid ones of the printer's width if not given.
    """
    slices = Slices(scene, quality)
    layers = estimate.layers(scene, printer, quality, walls, laid)
    printed = volumes.findings(volumes.rows(scene, layers), scene)
    every = [
        *gap_findings(slices, printer, quality, gap_mm),
        *grid_findings(scene, slices.layers),
        *widths.check(slices, printer),
        *bed_findings(scene, printer),
        *bridges.check(slices, printer, quality),
        *bridges.loose(slices),
        *bridges.findings(layers, printer.line_mm()),
        *(f for f in printed if f.severity == "error"),  # rules 4 and 5 have its warnings
    ]
    return sorted(_over_layers(every), key=lambda f: (SEVERITIES.index(f.severity), int(f.rule.partition("-")[0])))


def _over_layers(every: Iterable[Finding]) -> Iterator[Finding]:
    """One finding in layer after layer as one, from the first layer to the last."""
    merged: dict[tuple[str, str, str, str], list[Finding]] = {}
    for finding in every:
        alike = merged.setdefault((finding.rule, finding.severity, finding.body, finding.message), [])
        before = alike[-1] if alike else None
        if before and before.layer and finding.layer == (before.last_layer or before.layer) + 1:
            alike[-1] = replace(before, last_layer=finding.layer)
        else:
            alike.append(finding)
    return chain.from_iterable(merged.values())
