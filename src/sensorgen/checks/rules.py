"""All design rules about a scene: names, and findings merged over layers.

Rule 7, printed against drawn volume, is estimated here; after slicing it is taken from the G-code.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain

from sensorgen.checks import bed, bridges, estimate, gap, grid, support, volumes, widths
from sensorgen.checks.slices import Slices
from sensorgen.core.findings import SEVERITIES, Finding
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.scene import Scene

# Names of all rules; those from 10 on are about the design's file and about the G-code.
RULES = (
    "0-body", "0-printer", "1-short", "2-film", "2-printed-gap", "3-grid", "4-unsampled", "5-width", "6-gap",
    "7-printed", "8-bed", "9-bridge", "9-support", "10-film", "10-waiver", "11-crossing", "11-overlap", "11-profile",
    "11-repaired", "11-size", "11-surface", "12-numbers", "13-gcode",
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
        *gap.check(slices, printer, quality, gap_mm),
        *grid.check(scene, slices.layers),
        *widths.check(slices, printer),
        *bed.check(scene, printer),
        *bridges.check(slices, printer, quality),
        *support.findings(layers, printer.line_mm()),
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
