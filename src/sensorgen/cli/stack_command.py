"""``sensorgen stack``: information of a second film, and effect of a touch on a reading."""

from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Force, Law
from sensorgen.core import units
from sensorgen.core.options import Option
from sensorgen.prediction.query import TONES_HZ, Frequencies, Noise

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.double_layer import StackStudy

Drift = Annotated[float, Option(kind="proper share", typed="10%")]


@of_design("stack", *render.options())
def command(
    design: "Design", *, force_n: Force, position_mm: Annotated[float | None, Option(zero=True)] = None,
    frequency_hz: Frequencies = TONES_HZ, tip_mm: Annotated[float, Option(typed="10mm")], noise: Noise, drift: Drift,
    within_n: Annotated[float, Option(typed="0.1N")], law: Law = "",
) -> "StackStudy":  # fmt: skip
    """Compare a double sensor with a single one, and what a touch does to them, with isolation and without.

    Parameters
    ----------
    position_mm
        Position of the tip's middle [mm]; the sensor's middle if not given.
    tip_mm, --touch : MM
        Length of the tip that presses, and of the body that touches.
    drift
        What the films' permittivity may have drifted by, both alike.
    within_n
        Largest force that a touch may be mistaken for.
    """
    from sensorgen.prediction.double_layer import study

    position_m = None if position_mm is None else position_mm * units.M_PER_MM
    return study(design, frequency_hz, force_n, position_m, noise, drift, within_n, law, tip_mm * units.M_PER_MM)
