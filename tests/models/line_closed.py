"""The thesis's own solution in exponentials, as printed and as corrected: for comparison with `line`, not for use.

Right where Re(gamma l) is under 355, tracks resist and the frequency is not low; see docs/line.md.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import Inputs, PressedLine, read

SOURCE = "Thesis appendix B, Eqs. B.39, B.42, B.48, B.51 and B.53"
PRINTED = ("B.39", "B.42", "B.48")

Array = NDArray[Any]
Matrix = tuple[Array, Array, Array, Array]


def impedance(line: PressedLine, as_printed: str = "") -> Complex:
    r"""Impedance of the pressed line, -A22/A21 of the product of three matrices (B.51 to B.53).

    .. math:: A = \frac{1}{2e} \begin{pmatrix} 1 + e^2 & -\sqrt{2}\,(e^2 - 1)\,\rho / (\sqrt{\Gamma} H W) \\
              -(e^2 - 1) \sqrt{\Gamma} H W / (\sqrt{2} \rho) & 1 + e^2 \end{pmatrix},
              \quad e = \exp(\sqrt{2 \Gamma}\, l)

    Parameters
    ----------
    line : PressedLine
        As of :func:`sensorgen.models.line.impedance`; the far end has to be open. Unequal tracks count as two equal
        ones of the same sum, of the thickness of the top one.
    as_printed : str
        "" for the corrected equations, or the one to take with its misprint: "B.39" has the wrong sign of A21,
        "B.42" has Gamma for its root in A12, "B.48" has sqrt(2 rho) for sqrt(2) rho in A21.

    Returns
    -------
    complex array
        Impedance in the broadcast shape [ohm].

    Raises
    ------
    OutOfRange
        A far end that is not open; or where the exponentials have no number: they overflow, or r or y is 0.

    Notes
    -----
    Without force the misprint of B.48 makes Z 1/sqrt(rho) times itself (not even its dimension is right), that of
    B.39 turns its sign, and that of B.42 does not show, as A12 enters a product only.

    Examples
    --------
    >>> plate = PressedLine(length_m=0.1, width_m=0.01, top_thickness_m=3e-4, bottom_thickness_m=3e-4,
    ...     top_resistivity_ohm_m=0.07, bottom_resistivity_ohm_m=0.2, film_m=6e-4, eps_r=4.68, frequency_hz=99.7e3)
    >>> [round(float(impedance(plate, printed).real), 1) for printed in ("", "B.48", "B.39")]
    [2997.1, 8157.1, -2997.1]
    """
    inputs = _open(line)
    r, y, lengths = inputs.sections()
    height, width = inputs["top_thickness_m"], inputs["width_m"]
    with np.errstate(all="ignore"):
        (a, b, c, d), *others = (
            _matrix(as_printed, rs * height * width / 2, rs * ys / 2, height, width, length)
            for rs, ys, length in zip(r, y, lengths, strict=True)
        )
        for e, f, g, h in others:
            a, b, c, d = e * a + f * c, e * b + f * d, g * a + h * c, g * b + h * d
        return _finite(-d / c)


def _open(line: PressedLine) -> Inputs:
    found = read(line)
    if found.load_ohm is not None:
        raise OutOfRange("the thesis solves the open end only (B.3); for others take model 'line'")
    return found


def _matrix(printed: str, rho: Array, gamma: Array, height: Array, width: Array, length: Array) -> Matrix:
    """B.48: voltage and current behind a section from those before it, of two equal tracks."""
    root, area = np.sqrt(gamma), height * width
    e = np.exp(np.sqrt(2.0) * root * length)
    same, other = (1 + e**2) / (2 * e), (e**2 - 1) / (2 * e)
    a12 = -np.sqrt(2.0) * other * rho / ((gamma if printed == "B.42" else root) * area)
    a21 = -other * root * area / (np.sqrt(2 * rho) if printed == "B.48" else np.sqrt(2.0) * rho)
    return same, a12, -a21 if printed == "B.39" else a21, same


def _finite(z: Array) -> Complex:
    if not np.isfinite(z).all():
        raise OutOfRange("this equation has no number here (it overflows, or r or y is 0): take model 'line'")
    return np.asarray(z, np.complex128)
