r"""What a multimeter reads of two equal electrodes of resistance R each, with a film that leaks evenly, G in all.

Along one electrode, the other one floating, and between the electrodes at their contacts, with
:math:`q = \sqrt{2 R G}`:

.. math:: R_Y = R \left(\frac12 + \frac{\tanh(q/2)}{q}\right), \qquad R_Z = \frac{2 R}{q \tanh q}

A film that leaks carries a part of the current over to the other electrode and back: R_Y falls to R/2.
"""

from math import inf, sqrt, tanh

from sensorgen.core.errors import OutOfRange

_SMALL, _LARGE = 1e-12, 1e12  # of q: below, the film is tight; above, it is a short all along


def along_ohm(electrode_ohm: float, leak_s: float) -> float:
    """R_Y [ohm].

    Parameters
    ----------
    electrode_ohm : float
        R of one electrode, end to end [ohm].
    leak_s : float
        G of the whole film [S].

    Examples
    --------
    >>> along_ohm(600.0, 0.0), round(along_ohm(600.0, 1e15), 3)
    (600.0, 300.0)
    """
    q = sqrt(2 * electrode_ohm * leak_s)
    return electrode_ohm * _along(q)


def _along(q: float) -> float:
    return 1.0 if q < _SMALL else 0.5 + tanh(q / 2) / q


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


def electrode_and_leak(along: float, across: float) -> tuple[float, float]:
    """The R [ohm] and G [S] that read as R_Y and R_Z.

    Parameters
    ----------
    along, across : float
        R_Y, above 0, and R_Z, above 0, infinite for a tight film [ohm].

    Raises
    ------
    OutOfRange
        Readings that are not above 0.

    Examples
    --------
    >>> r, g = electrode_and_leak(along_ohm(700.0, 1e-3), across_ohm(700.0, 1e-3))
    >>> round(r, 6), round(g, 9)
    (700.0, 0.001)
    """
    if not (0 < along < inf and across > 0):
        raise OutOfRange(f"readings of {along:g} and {across:g} ohm; expected numbers above 0")
    if across == inf:
        return along, 0.0
    low, high = _SMALL, _LARGE
    while high / low > 1 + 1e-15 and low < (middle := sqrt(low * high)) < high:
        if 2 / (middle * tanh(middle)) / _along(middle) > across / along:
            low = middle
        else:
            high = middle
    electrode = along / _along(low)
    return electrode, low**2 / (2 * electrode)
