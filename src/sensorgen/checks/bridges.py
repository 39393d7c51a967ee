"""Rule 9: what is printed over air. Any body below supports, whatever its material."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sensorgen.checks.slices import TOUCH_MM, Rectangle, Slice, Slices, stretches
from sensorgen.checks.widths import VANISHES, line_mm
from sensorgen.findings import Finding
from sensorgen.printer import Printer, Quality
from sensorgen.scene import Body

Mask = NDArray[np.bool_]
Lengths = NDArray[np.float64]


def check(slices: Slices, printer: Printer, quality: Quality) -> Iterator[Finding]:
    """Findings about bridges (held at both ends), overhangs (at one) and islands (at none)."""
    line = line_mm(printer)
    known: dict[object, dict[str, float]] = {}
    for layer in range(1, len(slices.layers)):
        ground = slices.all(layer - 1)
        for body in slices.scene.bodies:
            shape = slices.body(body, layer)
            if not shape or shape <= ground:
                continue
            if (shape, ground) not in known:
                known[shape, ground] = _spans(shape, ground, VANISHES * printer.nozzle_mm)
            yield from _judged(body, layer + 1, slices.layers.mids_mm[layer], known[shape, ground], quality, line)


def _judged(
    body: Body, layer: int, z_mm: float, spans: dict[str, float], quality: Quality, line_mm: float
) -> Iterator[Finding]:
    prism = min(body.prisms, key=lambda p: abs(sum(p.span("z")) / 2 - z_mm))
    place = (prism.span("x")[0], prism.span("y")[0], z_mm)
    limits = {"bridge": (quality.bridge_warning_mm, quality.bridge_error_mm), "overhang": (line_mm / 2, line_mm)}
    for kind, (warn, fail) in limits.items():
        span = spans[kind]
        if span > warn + TOUCH_MM:
            severe = span > fail + TOUCH_MM
            yield Finding(
                "9-bridge", "error" if severe else "warning", body.name,
                f"{'a bridge' if kind == 'bridge' else 'an overhang'} of {span:.3g} mm over air",
                f"narrow it to {warn:.2g} mm, print upside down, or fill the air with support",
                round(span, 9), fail if severe else warn, layer, place,
            )  # fmt: skip
    if spans["island"] > 0:
        yield Finding(
            "9-bridge", "error", body.name, f"an island {spans['island']:.3g} mm wide starts in mid-air",
            "turn the sensor over, or fill the air with support (--support bvoh)",
            round(spans["island"], 9), 0.0, layer, place,
        )  # fmt: skip


def _spans(shape: frozenset[Rectangle], ground: frozenset[Rectangle], least_mm: float) -> dict[str, float]:
    """Longest bridge, overhang and island of a layer's shape above a ground [mm].

    Every unsupported place is held along x or along y; the better way counts. Places that are held neither way,
    as the corners of a roof that juts out on two sides, hold on to those that are.
    """
    piece = Slice(shape, ground)
    air = piece.filled & ~Slice(ground, shape).filled
    found = {"bridge": 0.0, "overhang": 0.0, "island": 0.0}

    def note(kind: str, values: Lengths) -> None:
        found[kind] = max(found[kind], float(values.max(initial=0.0)))

    while air.any():
        ends, lengths, narrow = _best(piece, air)
        note("bridge", lengths[ends == 2])
        note("overhang", lengths[ends == 1])
        if not ends.any():
            note("island", narrow[air & (narrow > least_mm + TOUCH_MM)])
            break
        air &= ends == 0
    return found


def _best(piece: Slice, air: Mask) -> tuple[NDArray[np.int64], Lengths, Lengths]:
    """How every unsupported place is held best: at how many ends, over which length, and its narrower stretch [mm]."""
    filled, (x, y) = piece.filled, piece.lines
    ways = [_held(filled, air, x), tuple(m.T for m in _held(filled.T, air.T, y))]
    ends, lengths = (np.stack([way[k] for way in ways]) for k in (0, 1))
    # A bridge beats an overhang beats an island; among equals the shorter.
    best = np.argmin(np.where(ends == 2, lengths, np.where(ends == 1, 2 * lengths, np.inf)), axis=0)[None]
    return *(np.take_along_axis(m, best, 0)[0] for m in (ends, lengths)), lengths.min(axis=0)


def _held(filled: Mask, air: Mask, line: Lengths) -> tuple[NDArray[np.int64], Lengths]:
    """Along the first axis: at how many ends each unsupported stretch is held, and how long it is [mm]."""
    ends = np.zeros(filled.shape, np.int64)
    lengths = np.zeros(filled.shape)
    padded = np.pad(filled, ((1, 1), (0, 0)))
    starts, stops, rows = stretches(air)
    for start, stop, row in zip(starts, stops, rows, strict=True):
        ends[start:stop, row] = int(padded[start, row]) + int(padded[stop + 1, row])
        lengths[start:stop, row] = line[stop] - line[start]
    return ends, lengths
