"""Test structures (coupons) in closed form: four-wire bars, a ladder of contacts, round plates, compressed discs.

Every function takes scalars or arrays that broadcast, so that all derivatives of a coupon come from one call.
"""

from math import cos, pi, radians, sin

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M

SOURCE = "Berger (1972), ladder; Chew and Kong (1980), round plates; Siebel (1923), Gent and Lindley (1959), discs"
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


def to_and_fro_resistivity(
    along_ohm_m: Real | float, across_ohm_m: Real | float, line_m: float, width_m: Real | float, corner: float = 0.5
) -> Real:
    r"""Resistivity of a bar across lines that are laid to and fro, joined to the next one at alternating ends.

    .. math:: \frac{1}{\varrho} = \frac{p}{W} \left[\frac{W - p}{p \varrho_\perp} + \frac{1 - b}{\varrho_\parallel}
              + \frac{c (1 + b)}{\varrho_\perp}\right], \quad
              b = \frac{1 / \varrho_\parallel - c / \varrho_\perp}{1 / \varrho_\parallel + c / \varrho_\perp
              + \coth(k W / 2) / \sqrt{\varrho_\parallel \varrho_\perp}}, \quad
              k = \frac{2}{p} \sqrt{\varrho_\parallel / \varrho_\perp}

    Parameters
    ----------
    along_ohm_m, across_ohm_m : float or array
        Resistivity along and across the lines [ohm m].
    line_m : float
        Distance p of neighbouring lines [m].
    width_m : float or array
        W of the bar, the length of a line [m].
    corner : float
        c, length over which lines touch where they are not joined, beyond the joints' sides, over p [-].

    Notes
    -----
    Each line is a conductor along itself with contacts to both neighbours all along; the potential of the next line is
    that of the one before, turned end for end. b is the voltage between the ends of one line over that of a pitch.
    Within 1 % of a grid of nodes on every line.

    Examples
    --------
    >>> float(to_and_fro_resistivity(1.0, 1.7, 0.44e-3, 6e-3).round(3))  # the joints short 5 % of the contacts
    1.607
    """
    along, across = np.asarray(along_ohm_m), np.asarray(across_ohm_m)
    joint, touch = 1 / along, corner / across
    line = 1 / (np.sqrt(along * across) * np.tanh(np.sqrt(along / across) * width_m / line_m))
    b = (joint - touch) / (joint + touch + line)
    conducts = (width_m - line_m) / (line_m * across) + joint * (1 - b) + touch * (1 + b)
    return np.asarray(width_m / (line_m * conducts))


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
    15.496
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


def sliding_modulus(
    modulus_pa: Real | float, friction: Real | float, diameter_m: Real | float, height_m: Real | float
) -> Real:
    r"""Apparent modulus of a disc between lubricated plates, on which it slides.

    .. math:: E_a = E \left(1 + \frac{\mu D}{3 h}\right)

    Parameters
    ----------
    modulus_pa : float or array
        Young's modulus E [Pa].
    friction : float or array
        Coefficient mu of friction, small [-].
    diameter_m, height_m : float or array
        D and h of the disc [m].

    Notes
    -----
    Siebel (1923): the pressure rises from the rim inwards as friction holds the disc back.

    Examples
    --------
    >>> float(sliding_modulus(6e6, 0.05, 8e-3, 6e-3).round(-3)) / 1e6
    6.133
    """
    return np.asarray(modulus_pa * (1 + np.asarray(friction) * diameter_m / (3 * np.asarray(height_m))))


def bonded_modulus(
    modulus_pa: Real | float, incompressibility: Real | float, radius_m: Real | float, height_m: Real | float
) -> Real:
    r"""Apparent modulus of a disc that is glued to rigid plates, small strain.

    .. math:: E_a = E + K \left[1 - \frac{2}{x} \frac{I_1(x)}{I_0(x)}\right], \quad
              x = \frac{a}{h} \sqrt{\frac{12 G}{K}}, \quad K = \frac{E}{3 (1 - 2\nu)}

    Parameters
    ----------
    modulus_pa : float or array
        Young's modulus E [Pa].
    incompressibility : float or array
        1 - 2 nu, above 0 [-].
    radius_m, height_m : float or array
        a and h of the disc [m].

    Notes
    -----
    Incompressible, :math:`E (1 + 2 S^2)` with :math:`S = a / 2h` (Gent and Lindley, Proc. Inst. Mech. Eng. 173 (1959)
    111). Within 6 % of finite elements for S from 0.3 to 7 and nu above 0.49.

    Examples
    --------
    >>> float((bonded_modulus(6e6, 2e-4, 5e-3, 2.5e-3) / 6e6).round(3))  # S = 1
    2.997
    """
    from scipy.special import ive

    q = np.asarray(incompressibility)
    bulk = modulus_pa / (3 * q)
    shear = modulus_pa / (3 - q)  # E / (2 (1 + nu))
    x = np.asarray(radius_m / height_m * np.sqrt(12 * shear / bulk))
    # 1 - 2 I1 / (x I0) cancels for small x; its series is x^2 / 8 - x^4 / 48
    exact = 1 - 2 * ive(1, x) / (np.maximum(x, 1e-9) * ive(0, x))
    return np.asarray(modulus_pa + bulk * np.where(x < 0.03, x**2 / 8 - x**4 / 48, exact))


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
