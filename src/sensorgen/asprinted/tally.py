"""Rule 7: what was printed of each body in each layer, held against what was drawn."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.asprinted.beads import Beads, beads, layers
from sensorgen.asprinted.intervals import Intervals, length_mm
from sensorgen.asprinted.strips import Strips, drawn
from sensorgen.core.findings import Finding
from sensorgen.design.design import Design
from sensorgen.export.gcode.paths import Paths
from sensorgen.scene.scene import SLIVER_MM, Body, Point, Prism, Scene, area_mm2

LOW, HIGH = 0.9, 1.1  # printed over exact volume, within which nothing is said
VANISHED = 0.1  # a strip of which less than this share is printed is gone
_LEAST = 1e-6  # of the sensor's plan, in one layer: less is rounding


@dataclass(frozen=True)
class Row:
    """One body in one layer.

    Attributes
    ----------
    body : str
        Its name.
    layer : int
        From 1 at the bed [-].
    bottom_mm, top_mm : float
        Where the layer starts and ends [mm].
    exact_mm3, printed_mm3 : float
        Volume as drawn, and as printed [mm3].
    strips, vanished, fused : int
        How many strips are drawn, how many of them are not printed, and how many run into their neighbours [-].
    place_mm : (float, float)
        Middle of the first strip that is not printed, or else of the first, at the front or left edge [mm].
    """

    body: str
    layer: int
    bottom_mm: float
    top_mm: float
    exact_mm3: float
    printed_mm3: float
    strips: int
    vanished: int
    fused: int
    place_mm: Point

    @property
    def ratio(self) -> float:
        """Printed over exact volume; infinite where nothing is drawn [-]."""
        return self.printed_mm3 / self.exact_mm3 if self.exact_mm3 > 0 else float("inf")

    def as_dict(self) -> dict[str, Any]:
        """The row with its ratio, for JSON; None where nothing is drawn."""
        return asdict(self) | {"ratio": self.ratio if self.exact_mm3 > 0 else None}


def rule7(design: Design, paths: Paths, centre_mm: Point | None = None) -> tuple[list[Row], list[Finding]]:
    """Printed against exact volume per body and layer, of a slicer's G-code.

    Parameters
    ----------
    design : Design
        That was sliced.
    paths : Paths
        Lines of the file, with the printer's own tool numbers.
    centre_mm : (float, float), optional
        Middle of the piece on the printer's bed [mm]; the middle of the bed if not given.

    Returns
    -------
    rows, findings : list of Row, list of Finding
        From the bed up; a finding for each row outside ``LOW`` to ``HIGH``, an error where nothing is printed. The
        design's waivers are in them.

    Raises
    ------
    NoStrips
        See :func:`sensorgen.asprinted.beads.layers`.
    """
    lines = beads(design, paths, centre_mm)
    rows = tally(design, layers(design, lines), lines)
    return rows, design.waived(findings(rows, design.printed))


def tally(design: Design, printed: Sequence[Strips], lines: Beads | None = None) -> list[Row]:
    """Rows for all bodies and layers in which something is drawn or printed.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : sequence of Strips
        What is printed of it.
    lines : Beads, optional
        The lines that print it, whose own volume counts; that of the strips if not given, as for an estimate.
    """
    scene = design.printed
    plan = drawn(scene, design.layers)
    heights = [[prism.span("z") for prism in body.prisms] for body in scene.bodies]
    found = []
    for k, (meant, made) in enumerate(zip(plan, printed, strict=True)):
        for number, body in enumerate(scene.bodies):
            here = (
                prism for prism, (bottom, top) in zip(body.prisms, heights[number], strict=True)
                if bottom < meant.top_mm and top > meant.bottom_mm
            )  # fmt: skip
            exact = sum(_between(prism, meant.bottom_mm, meant.top_mm) for prism in here)
            volume = _volume(made, body, scene) if lines is None else _extruded(lines, k, number)
            if max(exact, volume) > _LEAST * scene.size_mm[0] * scene.size_mm[1] * (meant.top_mm - meant.bottom_mm):
                found.append(_row(body.name, k + 1, meant, made, (exact, volume)))
    return found


def _row(body: str, number: int, meant: Strips, made: Strips, exact_printed_mm3: tuple[float, float]) -> Row:
    """The row of a body in a layer as drawn and as printed."""
    here = meant.runs.get(body, ())
    gone, fused = _lost(here, made.runs.get(body, ()))
    middle = sum(here[int(gone.argmax())]) / 2 if here else 0.0
    place_mm = (middle, 0.0) if meant.across == "x" else (0.0, middle)
    strips = len(here), int(gone.sum()), fused
    return Row(body, number, meant.bottom_mm, meant.top_mm, *exact_printed_mm3, *strips, place_mm)


def _extruded(lines: Beads, layer: int, body: int) -> float:
    return float(lines.volume_mm3[(lines.layer == layer) & (lines.body == body)].sum())


def _volume(layer: Strips, body: Body, scene: Scene) -> float:
    """Volume of a body's strips [mm3]."""
    long = scene.size_mm["xy".index(layer.along)]
    return length_mm(layer.runs.get(body.name, ())) * long * (layer.top_mm - layer.bottom_mm)


def _between(prism: Prism, low_mm: float, high_mm: float) -> float:
    """Volume of a prism between two heights, exact: cuts are linear in height between corners [mm3]."""
    bottom, top = prism.span("z")
    levels = {low_mm, high_mm, bottom, top} | ({z for _, z in prism.outline} if prism.axis != "z" else set())
    heights = sorted(z for z in levels if max(low_mm, bottom) <= z <= min(high_mm, top))
    return sum(
        sum(abs(area_mm2(outline)) for outline in prism.cut("z", (a + b) / 2)) * (b - a) for a, b in pairwise(heights)
    )


def _lost(meant: Intervals, made: Intervals) -> tuple[NDArray[np.bool_], int]:
    """Which strips are gone, and how many run into their neighbours."""
    plan, found = (np.array(runs, dtype=np.float64).reshape(-1, 2) for runs in (meant, made))
    shared = np.minimum(plan[:, None, 1], found[:, 1]) - np.maximum(plan[:, None, 0], found[:, 0])
    shared[shared <= SLIVER_MM] = 0.0
    gone = shared.sum(axis=1) < VANISHED * (plan[:, 1] - plan[:, 0])
    met = (shared > 0).sum(axis=0)
    return gone, int((met - 1).clip(0).sum())


def findings(rows: Iterable[Row], scene: Scene) -> list[Finding]:
    """What rule 7 says of some rows.

    Parameters
    ----------
    rows : iterable of Row
        Of one print.
    scene : Scene
        The sensor on its bed, for the places.
    """
    return [_finding(row, scene) for row in rows if row.exact_mm3 > 0 and not LOW <= row.ratio <= HIGH]


def _finding(row: Row, scene: Scene) -> Finding:
    gone, sampled = row.printed_mm3 == 0, row.strips > 0
    support = next(b for b in scene.bodies if b.name == row.body).is_support()
    lost = "is not printed at all" if sampled else "ends short of its middle: not printed"
    what = lost if gone else f"prints {row.ratio:.2f} times its volume"
    more = [f"{row.vanished} of {row.strips} strips vanish"] if row.vanished and not gone else []
    more += [f"{row.fused} fuse"] if row.fused else []
    return Finding(
        "7-printed", "error" if gone and sampled and not support else "warning", row.body,
        f"the layer from {row.bottom_mm:g} to {row.top_mm:g} mm {what}" + "".join(f", {word}" for word in more),
        "widen what is narrow there, or slice with other walls; --compensate does what it can",
        layer=row.layer, place_mm=(*row.place_mm, round((row.bottom_mm + row.top_mm) / 2, 9)),
        count=max(row.vanished, 1),
    )  # fmt: skip
