"""The sensor in two dimensions: two resistive sheets with a film between them, contacts anywhere, a press anywhere.

Finite volumes on grid lines that follow the contacts, with exact derivatives; see docs/sheet.md.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.solvers.sheet.parts import Port, Sheet, SheetPatch, check, check_inside, contacts_of
from sensorgen.solvers.sheet.solve import (
    BY,
    PressErrors,
    SheetProblem,
    Solution,
    converged,
    depth_m,
    frequencies,
    on_grid,
)

SOURCE = "Thesis 7.2.6, and appendix B with current in both directions of the plane"
COST = 2

_ACCURACY = 3e-2  # of the impedances behind a bound [-]
_SHALLOWEST = 1 / 20  # depth of the current over the longer side, under which places would take hours [-]
_ROUNDING = 1e-11  # relative change of an impedance across the sheet [-] below which a derivative is only rounding


def impedance(
    sheet: Sheet,
    ports: Sequence[Port],
    frequency_hz: ArrayLike,
    patch: SheetPatch | None = None,
    cells: int | None = None,
) -> Complex:
    r"""Impedance matrix between pairs of contacts.

    .. math:: -\nabla \cdot \frac{1}{R_t} \nabla u_t + y (u_t - u_b) = 0, \quad
              -\nabla \cdot \frac{1}{R_b} \nabla u_b - y (u_t - u_b) = 0, \quad
              y = G'' + (j + \tan\delta)\, \omega C''

    Parameters
    ----------
    sheet : Sheet
        Outline, sheet resistances and film.
    ports : sequence of pair of Contact
        Current enters at the first contact of a pair and leaves at the second; both may be on one sheet.
    frequency_hz : float or (n,) array
        0 or more [Hz].
    patch : SheetPatch
        Pressed rectangle, if any.
    cells : int
        Cells along the longer side; the fewest of 10, 20, 40 ... with an estimated error under 1e-3 unless given [-].

    Returns
    -------
    (n, ports, ports) complex array
        Impedance [ohm]. Where current has to cross a film that does not conduct (f = 0 without leak), inf + 0j.

    Raises
    ------
    OutOfRange
        Contacts beyond the sheet or shorted, a patch beyond the sheet, a frequency below 0; a grid coarser than the
        depth to which current reaches.
    BadInput
        No contact, or no number.

    Notes
    -----
    No fringe at the rim, no inductance; contacts conduct perfectly. A contact that no port names does not exist, one
    that another port drives floats.

    Examples
    --------
    >>> plate = Sheet(0.1, 0.01, (0.07 / 3e-4, 0.2 / 3e-4), 69.0627e-9)
    >>> pair = (plate.edge("top", "left"), plate.edge("bottom", "left"))
    >>> z = impedance(plate, [pair], 1100.0, cells=40)[0, 0, 0]
    >>> round(float(z.real), 1), round(float(z.imag))
    (2999.5, -2095000)
    """
    return solve(sheet, ports, frequency_hz, patch, cells=cells).impedance_ohm


def solve(
    sheet: Sheet,
    ports: Sequence[Port],
    frequency_hz: ArrayLike,
    patch: SheetPatch | None = None,
    of: Iterable[str] = (),
    cells: int | None = None,
    accuracy: float = 1e-3,
) -> Solution:
    r"""Impedance matrix with exact derivatives and an estimate of its error.

    .. math:: \frac{\partial Z_{pq}}{\partial a} = -\sum_k \frac{\partial y_k}{\partial a} v_{kp} v_{kq}

    over all links k of the network, with v the voltages along them for 1 A through each port: the matrix is
    symmetric, so the solution is its own adjoint and no further system is solved.

    Parameters
    ----------
    sheet, ports, frequency_hz, patch
        As of :func:`impedance`.
    of : iterable of str
        To differentiate by: "x_m", "y_m" (of the patch), "capacitance_factor", "top_resistance_factor",
        "bottom_resistance_factor".
    cells : int
        Cells along the longer side [-]; if not given, doubled from 10 until the estimate meets ``accuracy``.
    accuracy : float
        Largest relative error of resistance and of reactance [-].

    Returns
    -------
    Solution
        With the resolution that was taken.

    Raises
    ------
    OutOfRange
        As :func:`impedance`; a derivative without a patch, or where the impedance is infinite; an accuracy that 320
        cells do not reach.
    BadInput, UnknownName
        As :func:`impedance`; nothing of that name to differentiate by.

    Notes
    -----
    The estimate is half of what the last doubling changed: half as much again as the error of a method of second order.

    Examples
    --------
    >>> plate = Sheet(0.1, 0.1, (900.0, 900.0), 7e-8)
    >>> from sensorgen.solvers.sheet.parts import Contact
    >>> corner = tuple(Contact(side, (0.0, 0.01), (0.0, 0.01)) for side in ("top", "bottom"))
    >>> press = SheetPatch(0.02, 0.03, 0.02, 0.02, capacitance_factor=1.05)
    >>> found = solve(plate, [corner], [1e5], press, of=["x_m"])
    >>> found.cells, found.error < 1e-3, round(float(found.by["x_m"][0, 0, 0].real), 1)
    (80, True, 45.7)
    """
    names, tones = tuple(of), frequencies(frequency_hz)
    contacts_of(sheet, ports)
    if patch:
        check_inside(
            "the pressed patch", sheet, (patch.x_m, patch.x_m + patch.length_m), (patch.y_m, patch.y_m + patch.width_m)
        )
    for name in names:
        if name not in BY:
            raise UnknownName("input of a sheet to differentiate by", name, BY)
    if names and not patch:
        raise OutOfRange("a derivative by a patch needs a patch")
    asked = SheetProblem(sheet, ports, tones, patch, names)
    return converged(asked, accuracy) if cells is None else on_grid(asked, cells)


def localise(
    sheet: Sheet,
    ports: Sequence[Port],
    frequency_hz: ArrayLike,
    press: SheetPatch,
    per_newton: Mapping[str, float],
    noise: float = 1e-3,
    places: int = 7,
    done: Callable[[int], object] | None = None,
) -> PressErrors:
    r"""Cramer-Rao bounds of force, x and y of a press, anywhere on the sheet.

    .. math:: \mathrm{cov} \ge \Bigl(\sum_{f,p} \frac{\Re g\, \Re g^T + \Im g\, \Im g^T}{\nu^2}\Bigr)^{-1},
              \quad g = \frac{1}{Z_{pp}} \frac{\partial Z_{pp}}{\partial (F, x, y)}

    Parameters
    ----------
    sheet, ports
        As of :func:`impedance`; each port is read by itself, the others are open.
    frequency_hz : float or (n,) array
        Frequencies that are read at every port, above 0 unless the film leaks [Hz].
    press : SheetPatch
        Size of the tip, and its factors at the force in question; its place is not looked at.
    per_newton : dict of str to float
        Derivatives by force of the factors, by their names in ``BY`` [1/N].
    noise : float
        Standard error nu of resistance and of reactance, relative to \|Z\| [-].
    places : int
        Along each side [-].
    done : callable
        Called before each place with the number of places done; they may take minutes.

    Returns
    -------
    Bounds
        Maps over the sheet; ``sigma()`` has the standard errors.

    Raises
    ------
    OutOfRange, BadInput
        As :func:`solve`; a noise that is not above 0; a patch larger than the sheet; a frequency at which current
        reaches less than a twentieth of the longer side.

    Notes
    -----
    Impedances within 3 % (resolution chosen with the patch in the middle). A bound on unbiased estimates: where it
    exceeds the spread of a uniform distribution over the sheet, the readings have no information on position.

    Examples
    --------
    One port and one frequency give two numbers, and the press has three unknowns:

    >>> from sensorgen.solvers.sheet.solve import contact_sets
    >>> film = Sheet(0.1, 0.1, (450.0, 450.0), 7e-8)
    >>> tip = SheetPatch(0.0, 0.0, 0.02, 0.02, capacitance_factor=1.05)
    >>> found = localise(film, contact_sets(film)["one-edge"], [1e5], tip, {"capacitance_factor": 0.01}, places=1)
    >>> found.located(), [float(at) for at in found.sigma()[0, 0]]
    (0.0, [inf, inf, inf])
    """
    for name in per_newton:
        if name not in BY:
            raise UnknownName("factor that a force moves", name, BY)
    check("noise", noise, above=True)
    if places < 1:
        raise OutOfRange(f"bounds need one place or more along each side, not {places}")
    tones = frequencies(frequency_hz)
    # Refuse frequencies that would compute for hours: cells have to be as small as the depth
    highest_hz = float(tones.max())
    depth, side = depth_m(sheet, highest_hz, press), max(sheet.length_m, sheet.width_m)
    if depth < _SHALLOWEST * side:
        most = highest_hz * (depth / (_SHALLOWEST * side)) ** 2
        raise OutOfRange(
            f"at {highest_hz:g} Hz current reaches {depth:.3g} m; bounds take {_SHALLOWEST:.0%} or more of the sheet's "
            f"{side:g} m: use frequencies up to {most:.2g} Hz"
        )
    middle = _moved(press, (sheet.length_m - press.length_m) / 2, (sheet.width_m - press.width_m) / 2)
    cells = solve(sheet, ports, tones, middle, accuracy=_ACCURACY).cells
    x, y = (np.linspace(0.0, end, places) for end in (sheet.length_m - press.length_m, sheet.width_m - press.width_m))
    information = np.empty((places, places, len(tones), 3, 3))
    for count, (i, j) in enumerate(np.ndindex(places, places)):
        if done:
            done(count)
        here = solve(sheet, ports, tones, _moved(press, float(x[i]), float(y[j])), BY, cells)
        z = np.einsum("fpp->fp", here.impedance_ohm)
        by = {name: np.einsum("fpp->fp", value) / z for name, value in here.by.items()}
        by_force = sum((by[name] * slope for name, slope in per_newton.items()), np.zeros_like(z))
        # relative derivatives (3, tones, ports); noise relative to the magnitude in both parts
        relative = np.stack([by_force, by["x_m"], by["y_m"]])
        scale = np.array([1.0, sheet.length_m, sheet.width_m])[:, None, None]
        rows = np.concatenate([relative.real, relative.imag], axis=2) / noise
        rows[np.abs(rows) * noise * scale < _ROUNDING] = 0.0
        information[i, j] = np.einsum("afk,bfk->fab", rows, rows)
    guess = (sheet.length_m / 12**0.5, sheet.width_m / 12**0.5)
    return PressErrors(x + press.length_m / 2, y + press.width_m / 2, tones, information, guess, cells)


def _moved(press: SheetPatch, x_m: float, y_m: float) -> SheetPatch:
    return replace(press, x_m=max(x_m, 0.0), y_m=max(y_m, 0.0))
