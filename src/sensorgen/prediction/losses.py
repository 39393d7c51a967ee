"""Losses of dielectrics: the complex permittivities of a design at a frequency, and what the line makes of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi

from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.materials import FILM_LEAK, SET
from sensorgen.design.values import ASSUMED, MaterialValue, dielectrics, permittivities
from sensorgen.prediction.capacitance import capacitance

LOSSES = ("loss_tangent", "resistivity_ohm_m")
LARGEST_TANGENT = 0.05  # assumed of an elastomer of which nothing is stated, its conduction included
LOWEST_HZ = 1.1e3  # of the bench's tones: a leak is strongest there

_ACCURACY = 1e-5
_WEAK = 0.1  # of what is stored: up to here a leak is a conductance within 1 %


def set_losses(design: Design) -> list[MaterialValue]:
    """Loss tangents and resistivities that a design sets for its dielectrics itself.

    No source gives a loss tangent, and the one resistivity that a source prints is a slip: what the user does not set
    is taken for lossless; only the range of an impedance holds up to ``LARGEST_TANGENT``.
    """
    names = dielectrics(design) | {"air"}
    return [
        MaterialValue(name, quantity, values[quantity], SET)
        for name, values in sorted(design.material_values.items())
        if name in names
        for quantity in LOSSES
        if quantity in values
    ]


def permittivity(design: Design, frequency_hz: float | None = None) -> tuple[dict[str, complex], list[MaterialValue]]:
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
    found = _with(taken, set_losses(design), frequency_hz)
    return found, [*taken, *set_losses(design)]


def _with(
    taken: Sequence[MaterialValue], lost: Sequence[MaterialValue], frequency_hz: float | None
) -> dict[str, complex]:
    found: dict[str, complex] = {t.material: t.value for t in taken}
    for loss in lost:
        if loss.quantity == "loss_tangent":
            found[loss.material] -= 1j * found[loss.material].real * loss.value
        elif frequency_hz is None:
            raise BadInput(
                f"{loss.material} leaks ({loss.value:g} ohm m), and its share depends on the frequency; "
                "expected one: --frequency 1.1kHz"
            )
        else:
            found[loss.material] -= 1j * _conduction(loss.value, frequency_hz)
    return found


def _conduction(resistivity_ohm_m: float, frequency_hz: float) -> float:
    """Addition of a leak to the permittivity, minus its imaginary part [-]."""
    return 1 / (2 * pi * frequency_hz * EPS0_F_PER_M * resistivity_ohm_m)


@dataclass(frozen=True)
class Lost:
    """Losses of the dielectrics of a whole sensor.

    Attributes
    ----------
    tan_delta : float
        Of the whole, the same at every frequency [-].
    largest_tangent : float
        Up to which it may be, where the design states none for its dielectrics [-].
    leak_s : float
        Conductance between the electrodes, the same at every frequency [S].
    taken : tuple of MaterialValue
        What both rest on; empty where nothing is lost.
    doubts : tuple of str
        Why they are to be taken with care.
    """

    tan_delta: float = 0.0
    largest_tangent: float = LARGEST_TANGENT
    leak_s: float = 0.0
    taken: tuple[MaterialValue, ...] = ()
    doubts: tuple[str, ...] = ()


NOTHING_LOST = Lost()


def lost(design: Design) -> Lost:
    r"""Losses of the dielectrics of a design, as far as the design or a source that it names says.

    A weak leak is a conductance :math:`G = \omega C''`: to first order in :math:`1 / (\omega \varepsilon \varrho)` it
    does not depend on the frequency, whatever lies in series with what leaks. It is taken at the lowest tone. What a
    film leaks per area, as a fit finds it, is a conductance of its own beside that.

    Raises
    ------
    Unpredictable
        No model knows the losses of this scene.
    """
    taken, sets = permittivities(design), set_losses(design)
    parts = {quantity: [t for t in sets if t.quantity == quantity] for quantity in LOSSES}
    tangents, leaks = (_tangent(design, taken, parts[quantity]) for quantity in LOSSES)
    film = _film_leak(design)
    through_film_s = sum(t.value for t in film) * design.area_mm2 * M_PER_MM**2
    largest = _largest(design, taken, parts[LOSSES[0]])
    leak_s, doubts = 2 * pi * LOWEST_HZ * leaks[1] + through_film_s, tuple(_strong(taken, parts[LOSSES[1]]))
    return Lost(tangents[0], largest, leak_s, (*sets, *film), doubts)


def _largest(design: Design, taken: Sequence[MaterialValue], given: Sequence[MaterialValue]) -> float:
    """Largest C''/C' [-]: as given, and ``LARGEST_TANGENT`` for each dielectric but air of which none is."""
    known = {value.material for value in given} | {"air"}
    assumed = [
        MaterialValue(name, LOSSES[0], LARGEST_TANGENT, ASSUMED)
        for name in dict.fromkeys(value.material for value in taken) if name not in known
    ]  # fmt: skip
    if not given or known == {"air"}:
        return LARGEST_TANGENT
    return _tangent(design, taken, [*given, *assumed])[0]


def _film_leak(design: Design) -> list[MaterialValue]:
    """Leak of the film per area [S/m2], where one is known."""
    material, source = design.slot("film")
    try:
        value = material.value(FILM_LEAK, source or design.used().get(material.name, ""))
    except MissingValue:
        return []
    return [MaterialValue(material.name, FILM_LEAK, value.value, value.source)]


def _tangent(design: Design, taken: Sequence[MaterialValue], some: Sequence[MaterialValue]) -> tuple[float, float]:
    """C''/C' [-] and C'' [F] of the sensor with some of its losses."""
    if not some:
        return 0.0, 0.0
    found = capacitance(design.in_use, _with(taken, some, LOWEST_HZ), _ACCURACY)
    if found.loss_f is None:
        return 0.0, 0.0
    loss = (found.loss_f.lower + found.loss_f.upper) / 2
    return loss / found.capacitance_f.middle(), loss


def _strong(taken: Sequence[MaterialValue], leaks: Sequence[MaterialValue]) -> Iterator[str]:
    eps = {t.material: t.value for t in taken}
    for leak in leaks:
        share = _conduction(leak.value, LOWEST_HZ) / eps[leak.material]
        if share > _WEAK:
            yield (
                f"{leak.material} leaks {share:.2g} of what it stores at {LOWEST_HZ / 1e3:g} kHz: beyond {_WEAK:g} its "
                "leak depends on the frequency, and is taken as of that tone"
            )
