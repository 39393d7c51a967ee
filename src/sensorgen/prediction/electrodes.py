"""Resistance of the electrodes of a body, end to end, cogs included."""

from collections.abc import Sequence

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.design.body import Body
from sensorgen.design.values import ENDS, resistivities, spread
from sensorgen.models import conduction
from sensorgen.scene.scene import Scene


def electrode_resistance(body: Body, ends: Sequence[str] = ENDS) -> dict[str, Bounds]:
    """Resistance of the top and the bottom electrode from end to end [ohm].

    Parameters
    ----------
    body : Body
        Drawn or printed; a print is solid where it is printed, as contacts between lines cost nothing.
    ends : sequence of str
        Which electrodes.

    Raises
    ------
    MissingValue
        No source gives a resistivity.
    OutOfRange
        An electrode that does not reach from end to end.
    """
    design, found = body.design, {}
    for end, rho in ((end, rho) for end, rho in resistivities(design).items() if end in ends):
        scene, *others = dict.fromkeys(body.cells.scenes.values())
        solid = _of_cell(body, scene, end, rho.value)
        printed = [solid.middle()]
        for other in others:
            try:
                printed.append(_of_cell(body, other, end, rho.value).middle())
            except OutOfRange:  # by this rule the electrode is interrupted
                printed.append(float("inf"))
        value, (low, high) = solid.middle(), spread(design, rho)
        relative = Interval(low / rho.value, high / rho.value) if rho.value else Interval(1.0, 1.0)
        found[end] = Bounds.of(
            value, "ohm", model=solid, print=Interval(min(printed), max(printed)), certified=True,
            material=relative.times(value),
        )  # fmt: skip
    return found


def _of_cell(body: Body, scene: Scene, end: str, resistivity_ohm_m: float) -> Interval:
    """Of the whole sensor, from one unit cell: cells in series along it, in parallel across it [ohm]."""
    p = body.design.params
    in_series, in_parallel = p.length_mm / scene.size_mm[0], p.width_mm / scene.size_mm[1]
    return conduction.electrode_resistance(scene, end, resistivity_ohm_m).times(in_series / in_parallel)
