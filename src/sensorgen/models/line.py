r"""The sensor as a line: two resistive tracks with a film between them, pressed or not, any far end.

A recursion from the far end to the contacts. It divides by none of resistance, admittance, length and frequency,
so it survives every limit, and it keeps Re Z, far below the corner a thousandth of \|Z\| that alone tells of position.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.solvers.line.inputs import HIGHEST_OHM, Complex, Inputs, check_fit, far_load, in_blocks, passive, read
from sensorgen.solvers.line.slopes import slopes
from sensorgen.solvers.line.tanhc import tanhc

SOURCE = "Thesis appendix B, solved for unequal tracks, leak, loss and any far end"
COST = 0
UNDIVIDED = 8  # sections


def impedance(**inputs: Any) -> Complex:
    r"""Impedance between the two tracks at the contacts, one patch of the line being pressed.

    .. math:: Y \leftarrow \frac{Y + y l T}{1 + Y r l T}, \quad T = \frac{\tanh z}{z}, \quad z^2 = r y l^2

    from the far end over the sections ``L - x_p - L_p``, ``L_p`` and ``x_p``; then Z = 1/Y. Per length

    .. math:: r = \frac{\rho_t}{H_t W} + \frac{\rho_b}{H_b W}, \quad
              y = G' + (j + \tan\delta)\, \omega \frac{\varepsilon_0 \varepsilon_r W}{d},

    and under the patch rho (1 + S_n F) and d (1 - F / (W L_p E)).

    Parameters
    ----------
    **inputs : float or array
        SI units; arrays broadcast. To compute a grid fast, give each quantity its own axis.

        - ``L_m``, ``W_m``: length and width of the sensor [m]. ``H_top_m``, ``H_bottom_m``: of the electrodes [m].
        - ``rho_top_ohm_m``, ``rho_bottom_ohm_m``: resistivities [ohm m]; 0 is a perfect conductor.
        - ``d_m``: thickness of the film [m]. ``eps_r``: its relative permittivity [-].
        - ``f_Hz``: frequency, 0 or more [Hz].
        - ``F_N``: force [N], 0 unless given; below 0 it pulls, and the same linear law thickens the film.
        - ``x_p_left_edge_m``, ``L_p_m``: left edge and length of the patch [m], 0 unless given.
        - ``E_Pa``: Young's modulus of the film [Pa]; needed with a force.
        - ``S_n_top_per_N``, ``S_n_bottom_per_N``: relative rise of resistivity per force [1/N], 0 unless given.
        - ``tan_delta`` [-], ``G_S_per_m``: loss tangent and leak, the same under the patch [S/m]; 0 unless given.
        - ``far_end``: "open" (default), "short", or a resistor [ohm].
        - ``eps0_F_per_m``: CODATA 2018 unless given [F/m].

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
        An input that is needed, unknown, or no number.

    Notes
    -----
    Only the sum of the tracks enters a reading between their ends. Linear strain without confinement (Eq. B.49), no
    current spreading across the width, no fringe. Equal tracks without force give Eq. B.53.

    Examples
    --------
    >>> plate = dict(L_m=0.1, W_m=0.01, H_top_m=3e-4, H_bottom_m=3e-4, rho_top_ohm_m=0.07, rho_bottom_ohm_m=0.2,
    ...              d_m=6e-4, eps_r=4.68, E_Pa=6e6, L_p_m=0.01)
    >>> z = impedance(**plate, f_Hz=1100.0, F_N=1.0, x_p_left_edge_m=0.02)
    >>> round(float(z.real), 6), round(float(z.imag), 3)
    (2999.654163, -2094651.586)
    """
    return in_blocks(read(inputs), _block)[0]


def _block(inputs: Inputs) -> list[Complex]:
    return [_through(*inputs.sections(), inputs.load_ohm)]


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
    check_fit("the sections' values", [*r, *y, *lengths, *([] if load is None else [load])])
    return _through(r, y, lengths, load)


def sensitivities(of: Iterable[str] | None = None, **inputs: Any) -> tuple[Complex, dict[str, Complex]]:
    r"""Impedance and its exact derivatives.

    Each section's derivative by r, y and l is passed on through the recursion to the contacts. By position

    .. math:: \frac{\partial Y}{\partial x} = - S\, l T\, (r_0 y_p - r_p y_0)\,
              \frac{a + 2 Y + b Y^2}{(1 + b Y)^2}, \quad a = y_p l T, \quad b = r_p l T

    with Y behind the patch and S the derivative through the section before it: nothing cancels, and without a
    change of the characteristic impedance, sqrt(r/y), there is exactly no trace of position.

    Parameters
    ----------
    of : iterable of str
        Inputs to differentiate by, all real ones but ``eps0_F_per_m`` unless given.
    **inputs : float or array
        As of :func:`impedance`; ``E_Pa`` and ``L_p_m`` above 0 are needed for whatever depends on strain.

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
    >>> plate = dict(L_m=0.1, W_m=0.01, H_top_m=3e-4, H_bottom_m=3e-4, rho_top_ohm_m=0.07, rho_bottom_ohm_m=0.2,
    ...              d_m=6e-4, eps_r=4.68, E_Pa=6e6, L_p_m=0.01)
    >>> z, by = sensitivities(of=["F_N", "x_p_left_edge_m"], **plate, f_Hz=99.7e3, F_N=6.0, x_p_left_edge_m=0.045)
    >>> round(float(abs(by["F_N"])), 3), round(float(by["x_p_left_edge_m"].real), 2)
    (3.922, 90.55)
    """
    return slopes(of, inputs)


def corner_frequency_hz(resistance_ohm: float, capacitance_f: float) -> float:
    """Frequency above which a line is no longer short, 1 / (2 pi R C), both tracks together; inf if either is 0 [Hz].

    >>> round(corner_frequency_hz(9000.0, 69.06e-12)), corner_frequency_hz(0.0, 69.06e-12)
    (256065, inf)
    """
    turned = 2.0 * np.pi * resistance_ohm * capacitance_f
    return float(1.0 / turned) if turned else float("inf")


def _through(
    r: Sequence[NDArray[Any]], y: Sequence[NDArray[Any]], lengths: Sequence[NDArray[Any]], load: NDArray[Any] | None
) -> Complex:
    """March admittance from an open end, and impedance from any other: neither is then ever infinite on the way."""
    with np.errstate(all="ignore"):
        if load is None:
            current, voltage = _march(np.asarray(0j), y, r, lengths)
        else:
            voltage, current = _march(load, r, y, lengths)
        return _finite(np.asarray(np.divide(voltage, current), np.complex128), current)


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


def _finite(z: Complex, current: NDArray[Any]) -> Complex:
    """Z, infinite where no current flows; one sum tells whether there is anything to look for."""
    if abs(z.sum()) < HIGHEST_OHM:  # neither part of Z changes its sign: nothing cancels
        return z
    idle = np.asarray(current == 0)
    if not (idle | (np.abs(z) < HIGHEST_OHM)).all():
        raise OutOfRange("the line's numbers are too extreme for double precision")
    return np.where(idle, complex(np.inf, 0.0), z)
