r"""Both bounds of a capacitance: potentials from above, fluxes from below.

Dirichlet: any continuous u, 0 and 1 V on the electrodes, has :math:`C \le \int \varepsilon |\nabla u|^2`.
Thomson: any D of continuous normal component, without sources, tangential at the mirrors, has
:math:`C \ge 2 Q(D) - \int |D|^2 / \varepsilon`, Q its flux into the electrode at 1 V.
Both are stationary at their best field: what a solver leaves unsolved enters squared, and to the safe side.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.bounds import Disc, Interval
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.scene.scene import FLOATING, Scene


class CrossedBounds(SensorgenError):
    """A lower bound above its upper one: a fault of the solver, and no result."""


class Unsolved(SensorgenError):
    """A mesh so slender that doubles do not solve it."""


ROUNDING = 1e-9  # relative: what edges nearer than a nanometre's thousandth lose; both bounds are moved outwards by it


@dataclass(frozen=True)
class Energies:
    """Energies by one mesh and order, each over eps0: [mm], or per depth in two dimensions [-].

    Attributes
    ----------
    lower, upper : float
        By Thomson's and by Dirichlet's principle.
    part : float
        Of ``upper``: the energy weighted with how often each region occurs beyond the least.
    unknowns : int
        That the larger of the two systems couples.
    rounding : float
        Share by which doubles may be off, where it was estimated; an answer allows for ``ROUNDING`` at least [-].
    enclosed : bool
        Whether the potential is of a cell with more conductor or permittivity.
    """

    lower: float
    upper: float
    part: float
    unknowns: int
    rounding: float = 0.0
    enclosed: bool = False


@dataclass(frozen=True)
class FieldStep:
    """One mesh and order on the way to an accuracy.

    Attributes
    ----------
    order : int
        Of the potential's polynomials.
    elements, unknowns : int
        Of the mesh, and the unknowns that they couple.
    interval : Interval
        Capacitance of the whole sensor [F], or another quantity of the field.
    layers, flux_order : int
        Layers that shrink towards edges, and order of the flux's polynomials, where a model has these.
    """

    order: int
    elements: int
    unknowns: int
    interval: Interval
    layers: int = 0
    flux_order: int = 0


def narrowest(steps: Iterable[FieldStep]) -> Interval:
    """The narrowest interval of some steps; all from 0 on where there are none."""
    intervals = (step.interval for step in steps)
    return min(intervals, key=lambda interval: interval.upper - interval.lower, default=Interval(0.0, np.inf))


def third_conductor(scene: Scene) -> str | None:
    """Why bounds between two terminals do not apply to a scene of more, or None."""
    terminals = {body.terminal for body in scene.bodies} - {"", "top", "bottom"}
    if terminals == {FLOATING}:
        return "a conductor floats: the model prisms solves it"
    if terminals:
        return "more than two electrodes: use sensorgen stack"
    return None


def unmirrored(scene: Scene) -> str | None:
    """Why bounds between mirrors do not apply to a scene, or None."""
    if any(scene.repeats):
        return "the pattern repeats by shifts, not by mirrors: the model prisms solves it"
    return third_conductor(scene)


def check(permittivity: Mapping[str, complex], width: float) -> None:
    """Refuse permittivities and accuracies that mean nothing."""
    for material, value in permittivity.items():
        if not (np.isfinite(value) and np.real(value) > 0):
            raise OutOfRange(f"relative permittivity of {material} is {value:g}; expected a number above 0")
    if not width > 0:
        raise OutOfRange(f"accuracy is {width:g}; expected a number above 0, as 1e-4")


def whole(energies: Energies, shares: Sequence[float]) -> Interval:
    r"""All cells of the sensor from one, and the cut ones at its ends from the energy in their part of it.

    With weights w up to W on parts of the cell, the energy norm of the exact field differs from the computed one by at
    most :math:`\sqrt{W (C_{upper} - C_{lower})}`, since its error over the whole cell is
    :math:`\|u_h - u\|^2 = C_{upper} - C`. Of a cell that encloses the true one, the energy of the computed field in the
    part may be that much larger than in the true one.

    Raises
    ------
    CrossedBounds
        The lower bound lies above the upper one by more than rounding.
    Unsolved
        The lower bound is not above 0.
    """
    below, above, rounding = energies.lower, energies.upper, max(energies.rounding, ROUNDING)
    if not (below > 0 and np.isfinite(above)):
        raise Unsolved(f"doubles do not solve this scene: its lower bound is {below:.3g}, its upper one {above:.3g}")
    if below > above * (1 + rounding):
        raise CrossedBounds(
            f"lower bound {below:.12g} above upper bound {above:.12g}: the solver failed on this scene; report it, "
            "and use --model columns meanwhile"
        )
    least, most = min(shares), max(shares)
    apart = above - below + energies.rounding * (above + below)
    part, off = np.sqrt(energies.part), np.sqrt((most - least) * max(apart, 0.0))
    lower = least * below + max(part - (1 + energies.enclosed) * off, 0.0) ** 2
    upper = least * above + (part + off) ** 2
    return Interval(float(min(lower, upper) * (1 - rounding)), float(upper * (1 + rounding)))


@dataclass(frozen=True)
class Turned:
    """Permittivities turned by one angle, so that all real parts are as far above 0 as they can be.

    Attributes
    ----------
    weight : dict of complex to float
        rho of each permittivity [-].
    tangent : float
        Largest of their angles [-]; below 1 where losses are positive.
    """

    weight: dict[complex, float]
    tangent: float

    def kappa(self) -> float:
        """Largest modulus over rho [-]."""
        return float(np.hypot(1.0, self.tangent))


def turned(permittivity: Iterable[complex]) -> Turned:
    """The best angle for some permittivities, whose real parts are above 0.

    >>> round(turned([1.0, 1 - 1j]).tangent, 3)
    0.414
    """
    values = list(permittivity)
    angles = np.angle(values)
    back = np.exp(-1j * (angles.min() + angles.max()) / 2)
    return Turned({eps: float((eps * back).real) for eps in values}, float(np.tan(np.ptp(angles) / 2)))


@dataclass(frozen=True)
class Fields:
    """A potential and a flux of one cell, each integral over eps0: [mm], or per depth in two dimensions [-].

    Attributes
    ----------
    lower : complex
        Thomson's functional of the flux.
    energy, part : complex
        Of the potential; and weighted with how often each region occurs beyond the least.
    size : float
        As ``part``, of the modulus squared of the field, times rho.
    apart : float
        eta squared.
    unknowns : int
        That the larger of the two systems couples.
    rounding : float
        Share by which doubles may be off, where it was estimated; an answer allows for ``ROUNDING`` at least [-].
    """

    lower: complex
    energy: complex
    part: complex
    size: float
    apart: float
    unknowns: int
    rounding: float = 0.0


def disc(fields: Fields, turn: Turned, shares: Sequence[float]) -> Disc:
    r"""Where the capacitance of the whole sensor lies, whose cell's regions occur as often as ``shares`` say.

    In the regions that occur more often, by w up to W, the energy is off by no more than
    :math:`\kappa (2 \sqrt{W s}\,\eta + W \eta^2)`, s the size of the part.
    """
    least, most = min(shares), max(shares) - min(shares)
    beyond = 2 * np.sqrt(most * fields.size * fields.apart) + most * fields.apart
    t = turn.tangent
    cells = [(fields.energy, turn.kappa() * fields.apart)]  # values of the whole cell, and their errors
    if t < 1:
        cells.append(((fields.energy + fields.lower) / 2, fields.apart / 2 * np.sqrt((1 + t) / (1 - t))))
    discs = []
    for value, error in cells:
        centre, off = complex(least * value + fields.part), least * error + turn.kappa() * beyond
        discs.append(Disc(centre, float(off + max(fields.rounding, ROUNDING) * abs(centre))))
    return min(discs, key=lambda disc: disc.radius)
