"""Test structures (coupons) in closed form: four-wire bars, a ladder of contacts, round plates, compressed discs.

Every function takes scalars or arrays that broadcast, so that all derivatives of a coupon come from one call.
"""

from math import cos, pi, radians, sin

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M

SOURCE = "Berger (1972), ladder; Chew and Kong (1980), Hammerstad and Jensen (1980), round plates; Gent and Lindley (1959), bonded discs"
COST = 0


def bar_resistance(
    along_ohm_m: Real | float, across_ohm_m: Real | float, degrees: float, length_m: Real | float,
    width_m: Real | float, height_m: Real | float,
) -> Real:  # fmt: skip
    r"""Resistance of a long bar between its voltage taps, its lines at an angle to it.

    .. math:: R = (\varrho_\parallel \cos^2\varphi + \varrho_\perp \sin^2\varphi) \frac{L}{W H}

    Parameters
    ----------
    along_ohm_m, across_ohm_m : float or array
        Resistivity along and across the printed lines [ohm m].
    degrees : float
        Angle between bar and lines [degree].
    length_m, width_m, height_m : float or array
        Distance of the taps, and cross-section [m].

    Notes
    -----
    Exact far from the ends: the current follows the bar, the field turns.

    Examples
    --------
    >>> float(bar_resistance(0.07, 0.13, 45.0, 0.04, 6e-3, 1e-3).round(3))
    666.667
    """
    share = cos(radians(degrees)) ** 2, sin(radians(degrees)) ** 2
    resistivity = share[0] * np.asarray(along_ohm_m) + share[1] * np.asarray(across_ohm_m)
    return np.asarray(resistivity * length_m / (width_m * height_m))


def ladder_contact(
    along_ohm_m: Real | float, through_ohm_m: Real | float, contact_ohm_m2: Real | float, contact_length_m: float,
    width_m: Real | float, height_m: Real | float, spreading: Real | float = 0.8,
) -> Real:  # fmt: skip
    r"""Resistance of one contact strip across a bar, current from one side.

    .. math:: R_c = \frac{\varrho\, l}{W H} \coth\frac{d}{l}, \quad
              l = \sqrt{\frac{(\sigma_t + s \varrho_z H / 3) H}{\varrho}}

    Parameters
    ----------
    along_ohm_m, through_ohm_m : float or array
        Resistivity along the bar, and through its layers [ohm m].
    contact_ohm_m2 : float or array
        Contact resistivity of the strip [ohm m2].
    contact_length_m : float
        d, of the strip along the bar [m].
    width_m, height_m : float or array
        Cross-section of the bar [m].
    spreading : float or array
        s, 1 where the current enters evenly; 0.72 to 0.87 by finite differences of usual ladders [-].

    Notes
    -----
    Berger, Solid-State Electronics 15 (1972) 145; the current crosses a third of the height, as in a fin.

    Examples
    --------
    >>> float(ladder_contact(0.07, 0.07, 1e-4, 3e-3, 6e-3, 1e-3).round(3))
    15.771
    """
    contact = np.asarray(contact_ohm_m2) + np.asarray(through_ohm_m) * height_m / 3 * spreading
    reach = np.sqrt(contact * height_m / along_ohm_m)
    return np.asarray(along_ohm_m * reach / (width_m * height_m) / np.tanh(contact_length_m / reach))


def plate_capacitance(
    permittivity: Real | float, gap_m: Real | float, thickness_m: Real | float, radius_m: Real | float,
    electrode_m: float = 0.0, fringe: Real | float = 1.0,
) -> Real:  # fmt: skip
    r"""Capacitance of a round electrode over a larger one, with a film and a thin gap in series between them.

    .. math:: C = \frac{\varepsilon_0 \pi a^2}{t / \varepsilon + g} + k \left(C_r(a + \Delta a)
              - \varepsilon_0 \varepsilon \pi a^2 / t\right), \quad
              \Delta a = \frac{e}{2 \pi} \left(1 + \ln\frac{2 t}{e}\right) \frac{1 + 1 / \varepsilon}{2}

    .. math:: C_r(a) = \frac{\varepsilon_0 \varepsilon \pi a^2}{t} + 2 \varepsilon_0 a
              \left[\ln\frac{a}{2t} + 1.41 \varepsilon + 1.77 + \frac{t}{a} (0.268 \varepsilon + 1.65)\right]

    Parameters
    ----------
    permittivity : float or array
        Of the film, relative [-].
    gap_m : float or array
        Thickness of air with the effect of both interfaces; below 0 where electrodes sink in [m].
    thickness_m, radius_m : float or array
        Of the film, and of the smaller electrode [m].
    electrode_m : float
        e, thickness of the smaller electrode; 0 leaves out its rim [m].
    fringe : float or array
        k, factor of the field beyond the rim [-].

    Notes
    -----
    Chew and Kong, IEEE Trans. Microwave Theory Tech. 28 (1980) 98: film wider than the field, t < a; thickness of the
    electrode by Hammerstad and Jensen (1980). Within 0.7 % of finite volumes for the coupons here.

    Examples
    --------
    >>> float(plate_capacitance(4.68, 0.0, 0.4e-3, 10e-3).round(14))  # 32.55 pF between the faces
    3.449e-11
    """
    t, a, eps = np.asarray(thickness_m), np.asarray(radius_m), np.asarray(permittivity)
    wider = a
    if electrode_m:
        wider = a + electrode_m / (2 * pi) * (1 + np.log(2 * t / electrode_m)) * (1 + 1 / eps) / 2
    rim = np.log(wider / (2 * t)) + 1.41 * eps + 1.77 + t / wider * (0.268 * eps + 1.65)
    beyond = 2 * EPS0_F_PER_M * wider * rim + EPS0_F_PER_M * eps * pi * (wider**2 - a**2) / t
    return np.asarray(EPS0_F_PER_M * pi * a**2 / (t / eps + gap_m) + fringe * beyond)


def disc_modulus(
    modulus_pa: Real | float, incompressibility: Real | float, radius_m: Real | float, height_m: Real | float,
    bonded: Real | float = 1.0,
) -> Real:  # fmt: skip
    r"""Apparent modulus of a disc between rigid plates, small strain.

    .. math:: E_a = E + b K \left[1 - \frac{2}{x} \frac{I_1(x)}{I_0(x)}\right], \quad
              x = \frac{a}{h} \sqrt{\frac{12 G}{K}}, \quad K = \frac{E}{3 (1 - 2\nu)}

    Parameters
    ----------
    modulus_pa : float or array
        Young's modulus E [Pa].
    incompressibility : float or array
        1 - 2 nu, above 0 [-].
    radius_m, height_m : float or array
        a and h of the disc [m].
    bonded : float or array
        b, 1 where the faces stick, 0 where they slide, between them with friction [-].

    Notes
    -----
    Incompressible, :math:`E (1 + 2 S^2)` with :math:`S = a / 2h` (Gent and Lindley, Proc. Inst. Mech. Eng. 173 (1959)
    111). The factor of a tall disc is up to 1.2 instead of 1 (Horton et al., J. Appl. Mech. 69 (2002) 150).

    Examples
    --------
    >>> float((disc_modulus(6e6, 2e-4, 5e-3, 2.5e-3) / 6e6).round(3))  # S = 1
    2.998
    """
    from scipy.special import ive

    q = np.asarray(incompressibility)
    bulk = modulus_pa / (3 * q)
    shear = modulus_pa / (3 - q)  # E / (2 (1 + nu))
    x = np.asarray(radius_m / height_m * np.sqrt(12 * shear / bulk))
    # 1 - 2 I1 / (x I0) cancels below x = 0.1; its series is x^2 / 8 - x^4 / 48
    exact = 1 - 2 * ive(1, x) / (np.maximum(x, 1e-9) * ive(0, x))
    return np.asarray(modulus_pa + bonded * bulk * np.where(x < 0.03, x**2 / 8 - x**4 / 48, exact))


def secant_stiffening(strain: Real | float) -> Real:
    r"""Force of a compressed neo-Hookean disc over that of its small-strain modulus.

    .. math:: \frac{\lambda^{-2} - \lambda}{3 (1 - \lambda)}, \quad \lambda = 1 - \epsilon

    Parameters
    ----------
    strain : float or array
        Compression over height, 0 to below 1 [-].

    Examples
    --------
    >>> float(secant_stiffening(0.05).round(3))
    1.054
    """
    ratio = 1 - np.asarray(strain)
    return np.asarray((ratio**-2 + ratio**-1 + 1) / 3)
