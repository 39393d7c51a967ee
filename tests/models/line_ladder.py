"""The pressed line as a ladder of resistors and capacitors: what a circuit simulator would be given.

For comparison with `line` and as the circuit behind the ngspice tests; see docs/line.md.
"""

from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange
from sensorgen.solvers.line.inputs import PressedLine, read

SOURCE = "Thesis Figs. 2.3, 2.4 and B.4: cells of finite length"


def impedance(line: PressedLine, cells: int = 100, *, one_sided: bool = False) -> Complex:
    r"""Impedance at the contacts of a ladder, the same number of cells in each of the three sections.

    .. math:: Y \leftarrow \frac{y h}{2} + \left(r h + \frac{1}{Y + y h / 2}\right)^{-1}
              \quad \text{or, one-sided,} \quad Y \leftarrow \left(r h + \frac{1}{Y + y h}\right)^{-1}

    Parameters
    ----------
    line : PressedLine
        As of :func:`sensorgen.models.line.impedance`; the far end has to be open.
    cells : int
        Cells per section, 1 or more [-].
    one_sided : bool
        The whole capacitance behind the resistor, as in the thesis's figures, in place of half on each side.

    Returns
    -------
    complex array
        Impedance in the broadcast shape [ohm].

    Raises
    ------
    OutOfRange
        A far end that is not open; no current at all (f = 0 without leak).

    Notes
    -----
    Second order in 1/cells; one-sided first order only. Far above the corner frequency a cell has to be shorter than
    the depth to which the current reaches.

    Examples
    --------
    >>> plate = PressedLine(length_m=0.1, width_m=0.01, top_thickness_m=3e-4, bottom_thickness_m=3e-4,
    ...     top_resistivity_ohm_m=0.07, bottom_resistivity_ohm_m=0.2, film_m=6e-4, eps_r=4.68, frequency_hz=99.7e3)
    >>> [round(float(impedance(plate, n).real), 2) for n in (1, 10, 100)]
    [2228.88, 2989.54, 2997.04]
    """
    found = read(line)
    if found.load_ohm is not None:
        raise OutOfRange("the ladder's far end is open; for others take model 'line'")
    behind, before = (1.0, 0.0) if one_sided else (0.5, 0.5)
    admittance: Any = np.asarray(0j)
    with np.errstate(all="ignore"):
        for r, y, length in zip(*(reversed(part) for part in found.sections()), strict=True):
            step = length / cells
            for _ in range(cells):
                admittance = admittance + behind * y * step
                admittance = admittance / (1 + r * step * admittance) + before * y * step
        z = np.asarray(1 / admittance)
    if not np.isfinite(z).all():
        raise OutOfRange("no current flows through the ladder: its impedance is infinite")
    return z
