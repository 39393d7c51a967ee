r"""Multimeter readings of two electrodes, R and R', with a film that leaks evenly, G in all: a ladder of resistors.

Along the electrode R, the other one floating, and between both at their contacts, with :math:`q = \sqrt{(R + R') G}`:

.. math:: R_Y = \frac{R}{R + R'} \left(R' + R\,\frac{\tanh(q/2)}{q/2}\right), \qquad
          R_Z = \frac{R + R'}{q \tanh q}

They follow from :math:`u'' = (R + R') G\,u / L^2` for the voltage u across the film, and from the current of R' being
0 at both ends. A film that leaks carries a part of the current over to the other electrode and back: R_Y falls from R
to both in parallel. A small leak reads :math:`1/G`.
"""

from collections.abc import Callable
from math import inf, sqrt, tanh

from sensorgen.core.errors import OutOfRange

_SMALL, _LARGE = 1e-12, 1e12  # of q: below, the film is tight; above, it is a short all along
_STEPS, _ROUNDING = 50, 1e-15


def along_ohm(electrode_ohm: float, leak_s: float, other: float = 1.0) -> float:
    """R_Y [ohm].

    Parameters
    ----------
    electrode_ohm : float
        R of one electrode, end to end [ohm].
    leak_s : float
        G of the whole film, infinite for a short all along [S].
    other : float
        Resistance of the other electrode over this one's [-].

    Examples
    --------
    >>> along_ohm(600.0, 0.0), along_ohm(600.0, inf), along_ohm(600.0, inf, other=2.0)
    (600.0, 300.0, 400.0)
    """
    return electrode_ohm * _along(sqrt((1 + other) * electrode_ohm * leak_s), other)


def _along(q: float, other: float) -> float:
    return 1.0 if q < _SMALL else (other + tanh(q / 2) / (q / 2)) / (1 + other)


def across_ohm(electrode_ohm: float, leak_s: float) -> float:
    """R_Z, infinite for a tight film [ohm]; parameters as of :func:`along_ohm`.

    Examples
    --------
    >>> round(across_ohm(600.0, 1e-6))  # the leak, and two thirds of an electrode
    1000400
    """
    if leak_s == 0:
        return inf
    q = sqrt(2 * electrode_ohm * leak_s)
    return 1 / leak_s if q < _SMALL else 2 * electrode_ohm / (q * tanh(q))


def leak_s(rz_ohm: float, electrode_ohm: float) -> float:
    """Leakage of the whole film by a reading between electrodes of known resistance [S].

    Parameters
    ----------
    rz_ohm : float
        Resistance between the electrodes, inf for an overload [ohm].
    electrode_ohm : float
        R of one electrode, end to end [ohm].

    Raises
    ------
    OutOfRange
        Readings below 0.

    Examples
    --------
    >>> round(1 / leak_s(1e6, 600.0))  # far above the electrodes: the leakage alone, less two thirds of one
    999600
    """
    if rz_ohm < 0 or electrode_ohm < 0:
        raise OutOfRange(f"readings of {electrode_ohm:g} and {rz_ohm:g} ohm; expected numbers from 0 on")
    line = 2 * electrode_ohm
    if rz_ohm in (0, inf) or line == 0 or rz_ohm / line > 1e7:
        return inf if rz_ohm == 0 else (1 + line / rz_ohm / 3) / rz_ohm  # to 4/45 (line/rz)^2
    wanted = line / rz_ohm
    q = sqrt(wanted) if wanted < 1 else wanted  # of q tanh q = wanted, by Newton's method
    for _ in range(_STEPS):
        t = tanh(q)
        step = (q * t - wanted) / (t + q * (1 - t * t))
        q -= step
        if abs(step) <= _ROUNDING * q:
            break
    return q**2 / line


def electrode_and_leak(along: float, across: float, other: float = 1.0) -> tuple[float, float]:
    """The R [ohm] and G [S] that read as R_Y and R_Z.

    Parameters
    ----------
    along, across : float
        R_Y, above 0, and R_Z, 0 for a short all along, infinite for a tight film [ohm].
    other : float
        Resistance of the other electrode over that of R_Y's [-].

    Raises
    ------
    OutOfRange
        R_Y is not above 0, or R_Z is below 0.

    Examples
    --------
    >>> r, g = electrode_and_leak(along_ohm(700.0, 1e-3), across_ohm(700.0, 1e-3))
    >>> round(r, 6), round(g, 9)
    (700.0, 0.001)
    """
    if not (0 < along < inf and across >= 0):
        raise OutOfRange(f"readings of {along:g} and {across:g} ohm; expected R_Y above 0, and R_Z from 0 on")
    if across in (0, inf):
        return (along, 0.0) if across else (along / _along(inf, other), inf)
    q = _root(lambda q: (1 + other) / (q * tanh(q)) / _along(q, other), across / along)
    electrode = along / _along(q, other)
    return electrode, q**2 / ((1 + other) * electrode)


def _root(falling: Callable[[float], float], value: float) -> float:
    """Where a function of q falls to a value, by halving in the logarithm."""
    low, high = _SMALL, _LARGE
    while high / low > 1 + 1e-15 and low < (middle := sqrt(low * high)) < high:
        low, high = (middle, high) if falling(middle) > value else (low, middle)
    return low
