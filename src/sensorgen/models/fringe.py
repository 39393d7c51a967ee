"""Field beyond the edge of parallel plates, in closed form."""

from math import log, pi

from sensorgen.core.units import EPS0_F_PER_M

SOURCE = "Palmer, AIEE Trans. 46 (1937) 363, of a strip; thickness by Kirchhoff, as in Maxwell, Treatise, art. 202"


def edge_fringe_f(
    perimeter_m: float, gap_m: float, across_m: float, electrode_m: float = 0.0, permittivity: float = 1.0
) -> float:
    r"""Capacitance that the edge adds to that between the faces of two equal plates [F].

    .. math:: \Delta C = \frac{\varepsilon_0 \varepsilon P}{2 \pi}
              \left[1 + \ln\frac{2 \pi b}{d} + (1 + x) \ln(1 + x) - x \ln x\right], \quad x = e / d

    Parameters
    ----------
    perimeter_m, gap_m, across_m, electrode_m : float
        P, distance d of the plates, their width b and thickness e [m]; b above d.
    permittivity : float
        Of all space, relative: 1 is the least and the film's the most of a film that ends with the plates [-].

    Examples
    --------
    >>> round(edge_fringe_f(0.22, 0.3e-3, 10e-3) * 1e12, 2)  # of 89 pF with a permittivity of 3, in pF
    1.97
    """
    x = electrode_m / gap_m
    thick = (1 + x) * log(1 + x) - x * log(x) if x else 0.0
    return EPS0_F_PER_M * permittivity * perimeter_m / (2 * pi) * (1 + log(2 * pi * across_m / gap_m) + thick)
