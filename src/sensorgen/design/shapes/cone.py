r"""Cones in a square array, apex down: cogs that touch the film at a blunt tip.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      \eeeeeeeeeeeeee/     cone, of the top electrode or of dielectric
         \eeeeeeee/
            \ee/           tip
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import TippedParams, revolved_scene
from sensorgen.scene.scene import Fill, Scene, parameter


@dataclass(frozen=True)
class Params(TippedParams):
    """Parameters of the cones."""

    root_mm: float = parameter(1.0, "Diameter of a cone at the top electrode.", 0.02, 100.0)
    tip_mm: float = parameter(0.66, "Diameter of its blunt tip; 0 for a sharp one.", 0.0, 100.0)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of cones."""
    return revolved_scene(p, fill)
