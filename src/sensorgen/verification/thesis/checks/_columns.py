"""Columns of layers between two electrodes, as our model of columns has them; and cells as field solvers have them."""

from collections.abc import Sequence

from sensorgen.core.errors import MissingValue
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.values import permittivities
from sensorgen.models import columns
from sensorgen.prediction import capacitance as planner
from sensorgen.scene.scene import Body, Scene, box

EPS_R = 4.68
PERMITTIVITY = {"x60": EPS_R, "air": 1.0}  # the thesis takes air for vacuum
FILM_MM = 0.1
SHOWN = 3  # digits of a field solver's answer
_ACCURACY = 1e-3  # of it, against which 20 % show

Layer = tuple[str, float]  # material and thickness [mm]
_ELECTRODE_MM = 0.1


Pile = tuple[float, Sequence[Layer]]  # of a width [mm], and of layers from below


def piles(side_by_side: Sequence[Pile], depth_mm: float) -> Scene:
    """Columns between two electrodes; the top one reaches down to each of them, so that it holds what is named."""
    top = 2 * _ELECTRODE_MM + max(sum(thickness for _, thickness in layers) for _, layers in side_by_side)
    end = sum(width for width, _ in side_by_side)
    solid, conductor, left = [], [], 0.0
    for width, layers in side_by_side:
        z = _ELECTRODE_MM
        for material, thickness in layers:
            if material == "x60":
                solid.append(box(left, left + width, 0.0, depth_mm, z, z + thickness))
            z += thickness
        conductor.append(box(left, left + width, 0.0, depth_mm, z, top))
        left += width
    bodies = (
        Body("bottom_electrode", "etpu", (box(0.0, end, 0.0, depth_mm, 0.0, _ELECTRODE_MM),), "bottom"),
        Body("film", "x60", tuple(solid)),
        Body("top_electrode", "etpu", tuple(conductor), "top"),
    )
    return Scene(bodies, (end, depth_mm, top))


def piles_f(side_by_side: Sequence[Pile], depth_mm: float = 1.0) -> float:
    """Capacitance of columns side by side [F]."""
    return columns.capacitance(piles(side_by_side, depth_mm), PERMITTIVITY).lower


def pile_f_per_m2(layers: Sequence[Layer]) -> float:
    """Capacitance per area of layers on one another [F/m2]."""
    return piles_f([(1.0, layers)]) / M_PER_MM**2


def exact_f_per_m2(shape: str) -> float:
    """Capacitance per area of a shape's default cell, the mean of close bounds [F/m2].

    Raises
    ------
    MissingValue
        No solver that is installed meets the tolerance.
    """
    design = designs.make({"shape": shape, "parameters": {"dielectric_mm": FILM_MM}})
    eps = {taken.material: taken.value for taken in permittivities(design)}
    solved = planner.capacitance(design.in_use, eps, _ACCURACY)
    if not solved.reached():
        raise MissingValue(f"no model here meets a tolerance of {_ACCURACY:g}: {'; '.join(solved.refused)}")
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    return (solved.capacitance_f.lower + solved.capacitance_f.upper) / 2 / area
