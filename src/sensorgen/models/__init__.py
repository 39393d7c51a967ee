"""Physical models, one per file; each states ``SOURCE`` and ``COST``: 0 closed form, 1 quadrature, 2 and 3 field solve.

Capacitance models follow one protocol, :class:`CapacitanceModel`. The scene is in millimetres; models convert to SI
where they read it.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Protocol, cast

from sensorgen.core import lazy
from sensorgen.core.bounds import Interval
from sensorgen.scene.scene import Scene


class CapacitanceModel(Protocol):
    """A module that computes bounds of the capacitance between the two terminals of a scene.

    Attributes
    ----------
    SOURCE : str
        Publication or principle.
    COST : int
        0 closed form, 1 quadrature, 2 field solve in the plane, 3 in space.
    WIDTH : float
        Relative width of the interval unless asked otherwise [-]; inf where the model has one fixed width.
    """

    SOURCE: str
    COST: int
    WIDTH: float

    def why_not_applicable(self, scene: Scene) -> str | None:
        """Why the model does not apply to a scene, or None."""

    def capacitance(self, scene: Scene, permittivity: Mapping[str, float], width: float = ...) -> Interval:
        """Bounds of the capacitance between the terminals, fringes at the sensor's edge left out.

        Parameters
        ----------
        scene : Scene
            As drawn or printed, for which :meth:`why_not_applicable` is None.
        permittivity : mapping of str to float
            Relative permittivity of each material that does not conduct, and of "air", above 0 [-].
        width : float
            Relative width of the interval; wider where the finest mesh, the order or doubles limit it [-].

        Returns
        -------
        Interval
            Capacitance of the whole sensor [F].

        Raises
        ------
        OutOfRange
            A permittivity is not above 0, or the width is.
        KeyError
            A material between the electrodes has no permittivity.
        ValueError
            The model does not apply to the scene.
        CrossedBounds
            The lower bound lies above the upper one: a fault of the solver.
        """
        ...


def refusal(kind: type[Exception], work: Callable[..., object], *given: object) -> str | None:
    """Message of the error by which a piece of work, as the cell of a scene, is refused; None where it is done."""
    try:
        work(*given)
    except kind as error:
        return str(error)
    return None


def names() -> tuple[str, ...]:
    """Names of all models."""
    return lazy.stating(sys.modules[__name__], "SOURCE = ")


def capacitance_models() -> dict[str, CapacitanceModel]:
    """The models of capacitance by name, loaded."""
    names_of_models = lazy.stating(sys.modules[__name__], "def capacitance(")
    return {name: cast(CapacitanceModel, import_module(f"{__name__}.{name}")) for name in names_of_models}
