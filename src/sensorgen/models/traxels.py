r"""An electrode as the network of lines that it is printed from: bulk along each line, contacts between lines.

Each line is a conductor of its cross-section w h. Its potential is straight between nodes, which sit at its ends and
wherever it crosses a line of the layer above or below. What couples two lines is a resistor in the network:

- side by side, over a length l at a distance d of their middles: :math:`h l / (\rho d + \sigma_c)`;
- crossing, one on the other: :math:`w_1 w_2 / \sin\varphi / (\rho h + \sigma_c)`;
- an end on a side: :math:`w h / \sin\varphi / (\rho d + \sigma_c)`, half of it where the line turns.

Each resistor joins places straight across from each other, by interpolation between nodes where there is none. So any
potential that is linear in space is a solution where contacts cost nothing, and lines of any direction then conduct as
the solid does. Nodes away from the crossings would join places that differ in plan, and short-circuit the layers.
"""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import OutOfRange
from sensorgen.solvers import network as links
from sensorgen.solvers.network import Nodes, StraightLines, product

SOURCE = "Lines as in Dijkshoorn et al., Sensors 2021, 21, 3710 (traxel model); network derived anew"
COST = 2


@dataclass(frozen=True)
class Resistance:
    """Result of a network of lines.

    Attributes
    ----------
    ratio : float
        To a solid electrode's rho L / (H W) [-].
    unknowns : int
        Of the network.
    """

    ratio: float
    unknowns: int


def resistance(
    lines: StraightLines, resistivity_ohm_m: float, contact_ohm_m2: float, ends_m: tuple[float, float], area_m2: float
) -> Resistance:
    """Resistance along x between two planes, beyond which the potential rises as in a solid.

    Parameters
    ----------
    lines : StraightLines
        All of one electrode.
    resistivity_ohm_m : float
        Bulk resistivity along a line [ohm m], above 0.
    contact_ohm_m2 : float
        Contact resistivity between two lines [ohm m2], 0 or more; infinite where they do not conduct.
    ends_m : (float, float)
        Where the planes stand on x [m]; each needs lines beyond it.
    area_m2 : float
        Cross-section of the solid electrode, H W [m2].

    Raises
    ------
    OutOfRange
        A resistivity or the planes make no sense, no line reaches beyond a plane, or nothing conducts between them.
    """
    from scipy.sparse.csgraph import connected_components

    if not 0 < resistivity_ohm_m < np.inf:
        raise OutOfRange(f"a resistivity of {resistivity_ohm_m:g} ohm m; expected a number above 0")
    if not contact_ohm_m2 >= 0:
        raise OutOfRange(f"a contact resistivity of {contact_ohm_m2:g} ohm m2; expected 0 or more")
    if not ends_m[1] > ends_m[0] or not area_m2 > 0:
        raise OutOfRange(
            f"ends at {ends_m[0]:g} and {ends_m[1]:g} m, area {area_m2:g} m2; expected a length and an area"
        )
    pairs = links.near(lines)
    crossings = links.crossings(lines, pairs)
    nodes = Nodes.of(lines, crossings.places())
    network = links.gathered(lines, nodes, pairs, crossings)
    conductance = network.conductance_s(resistivity_ohm_m, contact_ohm_m2)
    # Current along x in a mean field of 1 V/m [A]
    x = nodes.place_m[:, 0]
    left, right = x <= ends_m[0], x >= ends_m[1]
    if not left.any() or not right.any():
        raise OutOfRange(f"no line reaches beyond {ends_m[0]:g} and {ends_m[1]:g} m: put the ends within the electrode")
    matrix = network.matrix(conductance, len(x))
    _, part = connected_components(matrix, directed=False)
    free = ~(left | right) & np.isin(part, part[left | right])
    leaving = matrix @ x  # were the field the same everywhere
    current = float(leaving[right].sum())
    if free.any():
        inner = np.flatnonzero(free)
        current -= product(matrix[inner][:, inner], (matrix @ right.astype(float))[inner], leaving[inner])
    if not current > 0:
        raise OutOfRange("no line conducts from one end to the other: expected lines that meet, or a contact that does")
    return Resistance(float(area_m2 / (resistivity_ohm_m * current)), int(free.sum()))
