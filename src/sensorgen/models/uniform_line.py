"""The sensor as a uniform line: two resistive tracks with a capacitance between them, open at the far end."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.errors import OutOfRange

SOURCE = "Thesis appendix B, Eq. B.53, for unequal tracks"
COST = 0


def impedance(frequency_hz: ArrayLike, resistance_ohm: ArrayLike, capacitance_f: ArrayLike) -> NDArray[np.complex128]:
    r"""Impedance between the two tracks at the contacts.

    .. math:: Z = \frac{1}{j \omega C} \frac{z}{\tanh z}, \quad z^2 = j \omega R C

    Parameters
    ----------
    frequency_hz : float or array
        Frequency, above 0 [Hz].
    resistance_ohm : float or array
        Resistance of both tracks together, end to end; only their sum enters [ohm].
    capacitance_f : float or array
        Capacitance of the whole line, above 0 [F].

    Returns
    -------
    complex array
        Impedance, in the shape that the arguments broadcast to [ohm].

    Raises
    ------
    OutOfRange
        A frequency or capacitance is not above 0, or a resistance is negative.

    Notes
    -----
    Written with tanh(z)/z, so that it survives R = 0, where Z is that of a capacitor. Towards low frequency the
    real part tends to R/3, not to R as the thesis's lumped circuit (Eqs. 2.24, 2.25) has it.

    Examples
    --------
    >>> z = impedance(1.0, 9000.0, 69e-12)
    >>> round(float(z.real), 6)
    3000.0
    """
    f, r, c = (np.asarray(v, float) for v in (frequency_hz, resistance_ohm, capacitance_f))
    if not (np.all(f > 0) and np.all(c > 0) and np.all(r >= 0)):
        raise OutOfRange("the line needs frequency and capacitance above 0 and no negative resistance")
    admittance = 2j * np.pi * f * c
    ratio = _tanh_over(np.sqrt(admittance * r))
    return np.asarray(1.0 / (admittance * ratio))


def corner_frequency_hz(resistance_ohm: float, capacitance_f: float) -> float:
    """Frequency above which the line is no longer short: 1 / (2 pi R C), both tracks together [Hz]."""
    return float(1.0 / (2.0 * np.pi * resistance_ohm * capacitance_f))


def _tanh_over(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """tanh(z)/z, by its series near 0, where the quotient would lose the small real part of the impedance."""
    squared = z * z
    small = np.abs(squared) < 1e-2
    terms = (1.0, -1 / 3, 2 / 15, -17 / 315, 62 / 2835, -1382 / 155925)  # next term: 2e-14 of the first at the limit
    series = sum(t * squared**k for k, t in enumerate(terms))
    safe = np.where(small, 1.0, z)
    return np.where(small, series, np.tanh(safe) / safe)
