"""Resistance of the electrodes of a body, end to end."""

from sensorgen.asprinted import compared
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import resistivities
from sensorgen.prediction.rest_state import spread


def electrode_resistance(body: Body) -> dict[str, Bounds]:
    """Resistance of the top and the bottom electrode from end to end, rho L / (H W) of its plate [ohm].

    Parameters
    ----------
    body : Body
        Drawn or printed; along a tool path each extruded line conducts, else the electrode is solid.

    Raises
    ------
    MissingValue
        No source gives a resistivity.
    OutOfRange
        A printed electrode too short for a resistance between its ends.
    """
    design, p, found = body.design, body.design.params, {}
    printed = compared.Printed("", {}, body.cells.tracks) if body.kind == "sliced" else None
    squares_per_m = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    for end, rho in resistivities(design).items():
        solid = rho.value * squares_per_m
        ohm = compared.resistance_ohm(design, printed, (0.0,))[end][0] if printed else solid
        low, high = spread(design, rho)
        scale = ohm / rho.value if rho.value else 0.0
        found[end] = Bounds.of(
            ohm, "ohm", print=Interval(min(ohm, solid), max(ohm, solid)), material=Interval(low * scale, high * scale)
        )
    return found
