"""The pressed line by transfer matrices, as textbooks have it: for comparison with `line`, not for use.

Right where Re(gamma l) is under 710, tracks resist and the frequency is not low; see docs/line.md.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import Inputs, PressedLine, read

SOURCE = "Thesis Eqs. B.43, B.51 and B.52, for unequal tracks; D. M. Pozar, Microwave Engineering, 4.4"
Matrix = tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]


def impedance(line: PressedLine) -> Complex:
    r"""Impedance at the contacts from the product of the sections' matrices.

    .. math:: \begin{pmatrix} \cosh \gamma l & Z_c \sinh \gamma l \\
              \sinh(\gamma l) / Z_c & \cosh \gamma l \end{pmatrix}, \quad
              \gamma = \sqrt{r y}, \quad Z_c = \sqrt{r / y}

    Parameters
    ----------
    line : PressedLine
        As of :func:`sensorgen.models.line.impedance`.

    Returns
    -------
    complex array
        Impedance in the broadcast shape [ohm].

    Raises
    ------
    OutOfRange
        Where the matrices have no number: cosh overflows, or r or y is 0 and Zc is undefined. `line` has an answer.

    Notes
    -----
    Loses Re Z at low frequency, where it is a small difference of cosh and sinh.

    Examples
    --------
    >>> z = impedance(PressedLine(length_m=0.1, width_m=0.01, top_thickness_m=3e-4, bottom_thickness_m=3e-4,
    ...     top_resistivity_ohm_m=0.07, bottom_resistivity_ohm_m=0.2, film_m=6e-4, eps_r=4.68, frequency_hz=99.7e3))
    >>> round(float(z.real), 3)
    2997.117
    """
    return _block(read(line))


def _block(inputs: Inputs) -> Complex:
    r, y, lengths = inputs.sections()
    with np.errstate(all="ignore"):
        left, patch, right = (_matrix(*part) for part in zip(r, y, lengths, strict=True))
        a, b, c, d = _product(_product(left, patch), right)
        load = inputs.load_ohm
        z = np.asarray(a / c if load is None else (a * load + b) / (c * load + d), np.complex128)
    if not np.isfinite(z).all():
        raise OutOfRange("transfer matrices have no number here (cosh overflows, or r or y is 0): take model 'line'")
    return z


def _matrix(r: NDArray[Any], y: NDArray[Any], length: NDArray[Any]) -> Matrix:
    z, zc = np.sqrt(r * y) * length, np.sqrt(r / y)
    cosh, sinh = np.cosh(z), np.sinh(z)
    return cosh, zc * sinh, sinh / zc, cosh


def _product(m: Matrix, n: Matrix) -> Matrix:
    return m[0] * n[0] + m[1] * n[2], m[0] * n[1] + m[1] * n[3], m[2] * n[0] + m[3] * n[2], m[2] * n[1] + m[3] * n[3]
