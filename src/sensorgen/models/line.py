r"""Impedance of the line sensor: two resistive tracks with a film between them, one patch pressed, any far end.

A recursion from the far end to the contacts. It divides by none of resistance, admittance, length and frequency, so it
survives every limit. It keeps Re Z, which alone has information on position and far below the corner is 1e-3 of \|Z\|.
"""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.solvers.line.inputs import HIGHEST_OHM, PressedLine, check_fit, far_load, in_blocks, passive, read
from sensorgen.solvers.line.slopes import BY, OF_PATCH, impedance_and_slopes
from sensorgen.solvers.line.tanhc import tanhc

__all__ = ["PressedLine", "cascade", "corner_frequency_hz", "impedance", "sensitivities"]

SOURCE = "Thesis appendix B, solved for unequal tracks, leak, loss and any far end"
COST = 0
UNDIVIDED = 8  # sections


def impedance(line: PressedLine) -> Complex:
    r"""Impedance between the two tracks at the contacts, one patch of the line being pressed.

    .. math:: Y \leftarrow \frac{Y + y l T}{1 + Y r l T}, \quad T = \frac{\tanh z}{z}, \quad z^2 = r y l^2

    from the far end over the sections ``L - x_p - L_p``, ``L_p`` and ``x_p``; then Z = 1/Y. Per length

    .. math:: r = \frac{\rho_t}{H_t W} + \frac{\rho_b}{H_b W}, \quad
              y = G' + (j + \tan\delta)\, \omega \frac{\varepsilon_0 \varepsilon_r W}{d},

    and under the patch rho (1 + S_n F) and d (1 - F / (W L_p E)).

    Parameters
    ----------
    line : PressedLine
        Geometry, materials, press and frequency, SI units; arrays broadcast.

    Returns
    -------
    complex array
        Impedance in the broadcast shape [ohm]. Where no current flows (f = 0 or L = 0, open, no leak) it is inf + 0j.

    Raises
    ------
    OutOfRange
        NaN, an infinite or negative value; a patch beyond the sensor; a strain of 1 or more, where the electrodes
        touch; a force on no area; a negative resistivity under the patch; \|Z\| of 1e150 ohm and more.
    MissingValue, UnknownName, BadInput
        A force without a modulus; no such far end; something that is no number, or shapes that do not broadcast.

    Notes
    -----
    Only the sum of the tracks enters a reading between their ends. Linear strain without confinement (Eq. B.49), no
    current spreading across the width, no fringe. Equal tracks without force give Eq. B.53.

    Examples
    --------
    >>> plate = dict(length_m=0.1, width_m=0.01, top_thickness_m=3e-4, bottom_thickness_m=3e-4,
    ...              top_resistivity_ohm_m=0.07, bottom_resistivity_ohm_m=0.2, film_m=6e-4, eps_r=4.68,
    ...              modulus_pa=6e6, tip_m=0.01)
    >>> z = impedance(PressedLine(**plate, frequency_hz=1100.0, force_n=1.0, left_m=0.02))
    >>> round(float(z.real), 6), round(float(z.imag), 3)
    (2999.654163, -2094651.586)
    """
    return read(line).evaluate(lambda block: [through(*block.sections(), block.load_ohm)])[0]


def cascade(
    r_ohm_per_m: Sequence[ArrayLike] | NDArray[Any],
    y_s_per_m: Sequence[ArrayLike] | NDArray[Any],
    length_m: Sequence[ArrayLike] | NDArray[Any],
    far_end: ArrayLike = "open",
) -> Complex:
    """Impedance of any sections in series, as a profile of pressure under a tip.

    Parameters
    ----------
    r_ohm_per_m, y_s_per_m, length_m : sequence of float or array
        One entry per section, from the contacts to the far end: resistance of both tracks together per length
        [ohm/m], shunt admittance per length [S/m] (complex), length [m]. Entries broadcast against each other.
    far_end : float or array or str
        "open", "short", or a resistor [ohm].

    Returns
    -------
    complex array
        Impedance at the contacts [ohm]; inf + 0j where no current flows.

    Raises
    ------
    OutOfRange
        A value that is not finite, or a resistance, conductance, susceptance or length below 0.
    BadInput
        Not one entry of each kind per section; something that is no number; shapes that do not broadcast.

    Examples
    --------
    A capacitor of 1 nF behind and along 9 kohm, at a low frequency, shows a third of that resistance:

    >>> z = cascade([9000.0], [2j * np.pi * 1e-9], [1.0])
    >>> round(float(z.real), 3)
    3000.0
    """
    r = [passive("resistance", value) for value in r_ohm_per_m]
    y = [passive("admittance", value) for value in y_s_per_m]
    lengths, load = [passive("length", value) for value in length_m], far_load(far_end)
    if not len(r) == len(y) == len(lengths):
        raise BadInput(f"{len(r)} resistances, {len(y)} admittances and {len(lengths)} lengths make no sections")
    arrays = [*r, *y, *lengths, *([] if load is None else [load])]
    check_fit("the sections' values", arrays)
    n = len(r)

    def work(parts: list[NDArray[Any]]) -> list[Complex]:
        return [through(parts[:n], parts[n : 2 * n], parts[2 * n : 3 * n], None if load is None else parts[-1])]

    return in_blocks(arrays, work)[0]


def sensitivities(line: PressedLine, of: Iterable[str] | None = None) -> tuple[Complex, dict[str, Complex]]:
    r"""Impedance and its exact derivatives.

    Each section's derivative by r, y and l is passed on through the recursion to the contacts. By position

    .. math:: \frac{\partial Y}{\partial x} = - S\, l T\, (r_0 y_p - r_p y_0)\,
              \frac{a + 2 Y + b Y^2}{(1 + b Y)^2}, \quad a = y_p l T, \quad b = r_p l T

    with Y behind the patch and S the derivative through the section before it: nothing cancels, and without a
    change of the characteristic impedance, sqrt(r/y), there is exactly no trace of position.

    Parameters
    ----------
    line : PressedLine
        As of :func:`impedance`; ``modulus_pa`` and ``tip_m`` above 0 are needed for derivatives that depend on strain.
    of : iterable of str
        Attributes of ``line`` to differentiate by; all real ones but ``eps0_f_per_m`` unless given.

    Returns
    -------
    tuple of complex array, and dict of str to complex array
        Z [ohm] and dZ/d(input) [ohm per the input's unit], in the broadcast shape.

    Raises
    ------
    OutOfRange
        As :func:`impedance`; also where Z is infinite.
    MissingValue, UnknownName, BadInput
        As :func:`impedance`.

    Examples
    --------
    >>> plate = dict(length_m=0.1, width_m=0.01, top_thickness_m=3e-4, bottom_thickness_m=3e-4,
    ...              top_resistivity_ohm_m=0.07, bottom_resistivity_ohm_m=0.2, film_m=6e-4, eps_r=4.68,
    ...              modulus_pa=6e6, tip_m=0.01)
    >>> line = PressedLine(**plate, frequency_hz=99.7e3, force_n=6.0, left_m=0.045)
    >>> z, by = sensitivities(line, of=["force_n", "left_m"])
    >>> round(float(abs(by["force_n"])), 3), round(float(by["left_m"].real), 2)
    (3.922, 90.55)
    """
    names = tuple(BY if of is None else of)
    for name in names:
        if name not in BY:
            raise UnknownName("input to differentiate by", name, BY)
    if OF_PATCH & set(names) and line.modulus_pa is None:
        raise MissingValue("a derivative by force or patch needs modulus_pa")
    inputs = read(line)
    if OF_PATCH & set(names) and not inputs["tip_m"].all():
        raise OutOfRange("a derivative by force or patch needs a patch: tip_m above 0")
    first, *rest = inputs.evaluate(partial(impedance_and_slopes, names), 1 + len(names))
    return first, dict(zip(names, rest, strict=True))


def corner_frequency_hz(resistance_ohm: float, capacitance_f: float) -> float:
    """Frequency above which a line is no longer short, 1 / (2 pi R C), both tracks together; inf if either is 0 [Hz].

    >>> round(corner_frequency_hz(9000.0, 69.06e-12)), corner_frequency_hz(0.0, 69.06e-12)
    (256065, inf)
    """
    turned = 2.0 * np.pi * resistance_ohm * capacitance_f
    return float(1.0 / turned) if turned else float("inf")


def through(
    r: Sequence[NDArray[Any]], y: Sequence[NDArray[Any]], lengths: Sequence[NDArray[Any]], load: NDArray[Any] | None
) -> Complex:
    """As :func:`cascade`, of values that are known to be in range; ``load`` is None at an open end [ohm].

    March admittance from an open end, and impedance from any other: neither is then ever infinite on the way.
    """
    with np.errstate(all="ignore"):
        if load is None:
            current, voltage = _march(np.asarray(0j), y, r, lengths)
        else:
            voltage, current = _march(load, r, y, lengths)
        # Z, infinite where no current flows; one sum decides whether any value has to be checked
        z = np.asarray(np.divide(voltage, current), np.complex128)
        if abs(z.sum()) < HIGHEST_OHM:  # neither part of Z changes its sign: nothing cancels
            return z
        idle = np.asarray(current == 0)
        if not (idle | (np.abs(z) < HIGHEST_OHM)).all():
            raise OutOfRange("the line's numbers are too extreme for double precision")
        return np.where(idle, complex(np.inf, 0.0), z)


def _march(
    start: NDArray[Any], shunt: Sequence[NDArray[Any]], series: Sequence[NDArray[Any]], lengths: Sequence[NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Immittance at the contacts as numerator and denominator; impedance obeys the same law with r and y exchanged.

    A section multiplies both by less than what the sections' characteristic impedances differ by: they are divided
    in time, and not sooner, since a division takes as long as four products.
    """
    top, bottom = start, np.asarray(1.0)
    for count, (u, v, length) in enumerate(zip(reversed(shunt), reversed(series), reversed(lengths), strict=True), 1):
        t = length * tanhc(length * length * (u * v))
        behind = top
        top = behind + u * t * bottom
        if behind.ndim or behind:  # if not, at an open end or a short, bottom stays a single 1
            bottom = bottom + v * t * behind
        if count % UNDIVIDED == 0:
            top, bottom = top / bottom, np.asarray(1.0)
    return top, bottom
