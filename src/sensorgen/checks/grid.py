"""Rules 3 and 4: faces on layer boundaries, and bodies between the sampling planes."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from sensorgen.checks.slices import TOUCH_MM, Layers
from sensorgen.core.findings import Finding
from sensorgen.scene.layers import faces_mm
from sensorgen.scene.scene import Body, Point, Scene


def check(scene: Scene, layers: Layers) -> Iterator[Finding]:
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
