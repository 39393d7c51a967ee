r"""Impedance of sections of a line in many digits: chain matrices by Taylor series in decimal numbers.

.. math:: \begin{pmatrix} \cosh z & rl \, \sinh z / z \\ y l \, \sinh z / z & \cosh z \end{pmatrix}, \quad z^2 = r y l^2

Independent of all models of lines, and exact to the last digit of what it is rounded to.
"""

from collections.abc import Sequence
from decimal import Decimal, localcontext

from sensorgen.core.errors import OutOfRange

_DIGITS = 220
_LARGEST = 1e4  # of abs(z^2): cosh z then has 43 digits before the point

Number = tuple[Decimal, Decimal]  # real and imaginary part


def impedance(r_ohm_per_m: Sequence[float], y_s_per_m: Sequence[complex], length_m: Sequence[float]) -> complex:
    """Of sections from the contacts to the open far end [ohm].

    Parameters
    ----------
    r_ohm_per_m, y_s_per_m, length_m : sequence
        Of each section: resistance [ohm/m], shunt admittance [S/m], length [m].

    Raises
    ------
    OutOfRange
        A section of more than ``_LARGEST``.

    Examples
    --------
    >>> round(impedance([9000.0], [6e-09j], [1.0]).real, 3)  # a third of the resistance
    3000.0
    """
    with localcontext() as context:
        context.prec = _DIGITS
        voltage: Number = (Decimal(1), Decimal(0))
        current: Number = (Decimal(0), Decimal(0))
        for r, y, length in reversed(list(zip(r_ohm_per_m, y_s_per_m, length_m, strict=True))):
            series = (Decimal(r) * Decimal(length), Decimal(0))
            shunt = (Decimal(y.real) * Decimal(length), Decimal(y.imag) * Decimal(length))
            square = _times(series, shunt)
            if abs(complex(*map(float, square))) > _LARGEST:
                raise OutOfRange(f"a section of the line is {abs(complex(*map(float, square))) ** 0.5:.3g} long")
            cosh, sinhc = _series(square, 0), _series(square, 1)
            voltage, current = (
                _plus(_times(cosh, voltage), _times(_times(series, sinhc), current)),
                _plus(_times(_times(shunt, sinhc), voltage), _times(cosh, current)),
            )
        size = current[0] * current[0] + current[1] * current[1]
        found = _times(voltage, (current[0] / size, -current[1] / size))
        return complex(float(found[0]), float(found[1]))


def _times(a: Number, b: Number) -> Number:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _plus(a: Number, b: Number) -> Number:
    return a[0] + b[0], a[1] + b[1]


def _series(square: Number, odd: int) -> Number:
    """Sum of square^k / (2 k + odd)!: cosh z, or sinh z / z."""
    term: Number = (Decimal(1), Decimal(0))
    found, k, least = term, 0, Decimal(10) ** -(_DIGITS - 20)
    while abs(term[0]) + abs(term[1]) > least:
        k += 1
        below = Decimal((2 * k + odd) * (2 * k + odd - 1))
        term = _times(term, (square[0] / below, square[1] / below))
        found = _plus(found, term)
    return found
