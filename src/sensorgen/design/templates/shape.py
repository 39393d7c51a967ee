"""Blocks on a film: NAME.

One period, seen along the blocks (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeee   top electrode
    xxx      xxx   blocks, half a period wide
    xxxxxxxxxxxx   film
    eeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from math import ceil

from sensorgen.scene.scene import Body, Envelope, Fill, Scene, box


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters beside length, width, electrode and isolation; each becomes an option, as --height."""

    period_mm: float = field(default=4.0, metadata={"help": "Period of the blocks.", "range": (0.5, 50.0)})
    height_mm: float = field(default=0.4, metadata={"help": "Height of the blocks.", "range": (0.05, 5.0)})
    film_mm: float = field(default=0.2, metadata={"help": "Thickness of the film.", "range": (0.05, 5.0)})

    def cells(self) -> float:
        """Number of periods in the sensor [-]."""
        return self.length_mm / self.period_mm


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies, from bottom to top; what no body fills is air, or the support where there is one."""
    low = p.electrode_mm
    film = low + p.film_mm
    roof = film + p.height_mm
    top = roof + p.electrode_mm
    # Half a block at either end: a mirror in its middle, so that one period is solved for the whole sensor.
    quarter, end, across = p.period_mm / 4, p.length_mm, (0, p.width_mm, film, roof)
    middles = [k * p.period_mm for k in range(ceil(p.cells()) + 1)]
    blocks = [box(max(x - quarter, 0), min(x + quarter, end), *across) for x in middles if x - quarter < end]
    gaps = [box(x + quarter, min(x + 3 * quarter, end), *across) for x in middles if x + quarter < end]
    whole = (0, p.length_mm, 0, p.width_mm)
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, (box(*whole, 0, low),), "bottom"),
        Body("film", fill.film, (box(*whole, low, film),)),
        Body("blocks", fill.dielectric, tuple(blocks)),
        Body("support", fill.support, tuple(gaps) if fill.support else ()),
        Body("top_electrode", fill.top_electrode, (box(*whole, roof, top),), "top"),
        Body("isolation", fill.isolation, (box(*whole, top, top + p.isolation_mm),) if p.isolation_mm else ()),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, top + p.isolation_mm))
