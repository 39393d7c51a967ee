"""What dielectrics lose: the complex permittivities of a design at a frequency."""

from math import pi

from sensorgen.design import Design
from sensorgen.errors import BadInput
from sensorgen.materials import SET
from sensorgen.planner import Taken, permittivities
from sensorgen.units import EPS0_F_PER_M

LOSSES = ("loss_tangent", "resistivity_ohm_m")


def set_losses(design: Design) -> list[Taken]:
    """Loss tangents and resistivities that a design sets for its dielectrics itself.

    No source gives a loss tangent, and the one resistivity that a source prints is a slip: what the user does not set
    is taken for lossless.
    """
    dielectrics = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return [
        Taken(name, quantity, values[quantity], SET)
        for name, values in sorted(design.material_values.items())
        if name in dielectrics
        for quantity in LOSSES
        if quantity in values
    ]


def permittivity(design: Design, frequency_hz: float | None = None) -> tuple[dict[str, complex], list[Taken]]:
    r"""Relative permittivity of every dielectric and of air, complex where one loses or leaks; and what it rests on.

    .. math:: \varepsilon = \varepsilon' (1 - j \tan\delta) - j / (\omega \varepsilon_0 \varrho)

    Parameters
    ----------
    design : Design
        Its support is taken to be gone.
    frequency_hz : float or None
        Of the field, above 0 [Hz]; needed where a dielectric leaks.

    Raises
    ------
    BadInput
        A resistivity without a frequency.
    MissingValue
        A dielectric without a permittivity.
    """
    taken = permittivities(design)
    found: dict[str, complex] = {t.material: t.value for t in taken}
    for loss in set_losses(design):
        if loss.quantity == "loss_tangent":
            found[loss.material] -= 1j * found[loss.material].real * loss.value
        elif frequency_hz is None:
            raise BadInput(
                f"{loss.material} leaks ({loss.value:g} ohm m), and its share depends on the frequency; "
                "expected one: --frequency 1.1kHz"
            )
        else:
            found[loss.material] -= 1j / (2 * pi * frequency_hz * EPS0_F_PER_M * loss.value)
    return found, [*taken, *set_losses(design)]
