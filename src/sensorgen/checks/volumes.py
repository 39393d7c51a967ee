"""Rule 7: printed against drawn volume of every body in every layer, and the parts that are lost or merged."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby, pairwise

import numpy as np
import shapely

from sensorgen.core.document import Column, Table
from sensorgen.core.findings import Finding, LayerVolume
from sensorgen.scene.layers import LayerRegions, Region, drawn, parts
from sensorgen.scene.scene import SLIVER_MM, Body, Scene

LOW, HIGH = 0.9, 1.1  # printed over drawn volume, within which nothing is said
VANISHED = 0.1  # a part of which less than this share is printed is lost
_LEAST = 1e-6  # of the sensor's plan, in one layer: less is rounding


def table(rows: Sequence[LayerVolume]) -> Table:
    """Printed over drawn volume of every body, layer by layer from the top."""
    bodies = list(dict.fromkeys(row.body for row in rows))
    cells = {(row.layer, row.body): _cell(row) for row in rows}
    spans = {row.layer: f"{row.bottom_mm:g}-{row.top_mm:g}" for row in rows}
    layers = sorted(spans, reverse=True)
    return Table(
        "volumes", "printed over drawn volume (-n: missing parts, +n: merged parts)",
        (Column("layer"), Column("height", "mm"), *(Column(body, right=True) for body in bodies)),
        tuple((n, spans[n], *(cells.get((n, body), "") for body in bodies)) for n in layers),
    )  # fmt: skip


def _cell(row: LayerVolume) -> str:
    lost = f" -{row.vanished}" if row.vanished else ""
    fused = f" +{row.fused}" if row.fused else ""
    return f"{'extra' if row.ratio is None else format(row.ratio, '.2f')}{lost}{fused}"


def rows(
    scene: Scene, printed: Sequence[LayerRegions], volumes_mm3: Mapping[tuple[int, str], float] | None = None
) -> list[LayerVolume]:
    """Rows for all bodies and layers in which something is drawn or printed, from the bed up.

    Parameters
    ----------
    scene : Scene
        As drawn, on its bed.
    printed : sequence of LayerRegions
        As printed.
    volumes_mm3 : mapping, optional
        Volume extruded by layer, from 0, and body [mm3]; area times height of what is printed if not given.
    """
    boundaries = (printed[0].bottom_mm, *(layer.top_mm for layer in printed))
    exact_mm3 = {body.name: _drawn_mm3(body, boundaries) for body in scene.bodies}
    volumes = []
    for number, (meant, laid) in enumerate(zip(drawn(scene, boundaries), printed, strict=True)):
        least = _LEAST * scene.size_mm[0] * scene.size_mm[1] * meant.height_mm
        for body in scene.bodies:
            exact = exact_mm3[body.name][number]
            area = laid.region(body.name).area * laid.height_mm
            volume = area if volumes_mm3 is None else volumes_mm3.get((number, body.name), 0.0)
            if max(exact, volume) > least:
                plan = parts(meant.region(body.name))
                lost, merged = _lost(plan, parts(laid.region(body.name)))
                x0, y0, x1, y1 = plan[lost[0] if lost else 0].bounds if plan else (0.0, 0.0, 0.0, 0.0)
                place = (x0, (y0 + y1) / 2) if meant.along == "x" else ((x0 + x1) / 2, y0)
                counts = len(plan), len(lost), merged
                volumes.append(
                    LayerVolume(body.name, number + 1, meant.bottom_mm, meant.top_mm, exact, volume, *counts, place)
                )
    return volumes


def _drawn_mm3(body: Body, boundaries_mm: Sequence[float]) -> list[float]:
    """Volume of a body between neighbouring boundaries, exact [mm3]."""
    bottom, top = np.array([p.span("z") for p in body.pieces]).T
    volume = np.array([p.volume_mm3() for p in body.pieces])
    upright = np.array([p.is_constant("z") for p in body.pieces])
    volumes = []
    for low, high in pairwise(boundaries_mm):
        share = (np.minimum(top, high) - np.maximum(bottom, low)).clip(0) / (top - bottom)
        cut = ~upright & (share > 0) & (share < 1)
        parts_mm3 = (body.pieces[k].volume_mm3(low, high) for k in np.flatnonzero(cut).tolist())
        volumes.append(float((volume * share)[~cut].sum()) + sum(parts_mm3))
    return volumes


def _lost(plan: Sequence[Region], printed: Sequence[Region]) -> tuple[list[int], int]:
    """Numbers of the parts that are lost, and how many merge with their neighbours."""
    pairs = shapely.STRtree(printed).query(plan) if plan and printed else np.empty((2, 0), np.intp)
    shared = (
        shapely.area(shapely.intersection(np.take(plan, pairs[0]), np.take(printed, pairs[1]))) if pairs.size else []
    )
    areas = np.bincount(pairs[0], weights=shared, minlength=len(plan))
    lost = np.flatnonzero(areas < VANISHED * shapely.area(plan)).tolist() if plan else []
    met = np.bincount(pairs[1][np.asarray(shared) > SLIVER_MM], minlength=1)
    return lost, int((met - 1).clip(0).sum())


def findings(volumes: Iterable[LayerVolume], scene: Scene) -> list[Finding]:
    """Rule 7: an error where a sampled body is not printed at all, else a warning outside ``LOW`` to ``HIGH``.

    Parameters
    ----------
    volumes : iterable of LayerVolume
        Of one print.
    scene : Scene
        The sensor on its bed.
    """
    outside = [row for row in volumes if row.ratio is not None and not LOW <= row.ratio <= HIGH]
    return [finding for body in scene.bodies for finding in _of_body(body, [r for r in outside if r.body == body.name])]


def _words(here: Sequence[LayerVolume], fault: str) -> str:
    """Fault of neighbouring layers, and how many strips vanish or fuse at most."""
    ratios = sorted({f"{row.ratio:.2f}" for row in here})
    words = [fault or f"prints {' to '.join(ratios[:: max(len(ratios) - 1, 1)])} times its volume"]
    most, fused = max(here, key=lambda row: row.vanished), max(row.fused for row in here)
    if most.vanished and not fault:
        words.append(f"{most.vanished} of {most.strips} strips vanish")
    if fused:
        words.append(f"{fused} fuse")
    return ", ".join(words)


def _of_body(body: Body, outside: Sequence[LayerVolume]) -> Iterator[Finding]:
    """One finding for neighbouring layers with the same fault."""
    numbered = list(enumerate(outside))
    for (_, fault, _), group in groupby(numbered, key=lambda p: (p[1].layer - p[0], _fault(p[1]), p[1].grown)):
        here = [row for _, row in group]
        first, last = here[0], here[-1]
        severe = fault == "is not printed at all" and not body.is_support()
        yield Finding(
            "7-printed", "error" if severe else "warning", body.name,
            f"from {first.bottom_mm:g} to {last.top_mm:g} mm it {_words(here, fault)}",
            "make narrow parts at least a line wide, or use other walls or thinner layers",
            layer=first.layer, place_mm=(*first.place_mm, round((first.bottom_mm + first.top_mm) / 2, 9)),
            count=max(1, *(row.vanished for row in here)), last_layer=last.layer if len(here) > 1 else None,
        )  # fmt: skip


def _fault(row: LayerVolume) -> str:
    """Fate of a body that is absent from a layer; "" where it is there."""
    if row.printed_mm3 > 0:
        return ""
    return "is not printed at all" if row.strips else "ends below mid-layer and is not printed"
