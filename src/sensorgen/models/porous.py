"""Effective permittivity and stiffness of a dielectric that is printed with sparse infill, as bounds."""

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange

SOURCE = "Wiener (1912), Hashin & Shtrikman (1962, 1963), Gibson & Ashby (1997)"
COST = 0

_EXTRUDED = ("grid", "honeycomb", "triangles", "concentric")  # the same lines in every layer: upright walls
_ISOTROPIC = ("gyroid",)


def permittivity(solid: float, share: float, pattern: str) -> Interval:
    r"""Effective relative permittivity across the plate of a solid with air.

    .. math:: \left(\frac{\phi}{\varepsilon} + 1 - \phi\right)^{-1} \le \varepsilon_z \le \phi \varepsilon + 1 - \phi

    (Wiener); upright walls reach the upper bound, and isotropic patterns lie between the bounds of Hashin and
    Shtrikman, with n = 3 dimensions:

    .. math:: 1 + \frac{\phi}{\frac{1}{\varepsilon - 1} + \frac{1 - \phi}{n}} \le \varepsilon_z \le
              \varepsilon + \frac{1 - \phi}{\frac{1}{1 - \varepsilon} + \frac{\phi}{n \varepsilon}}

    Parameters
    ----------
    solid : float
        Relative permittivity of the solid, 1 or more [-].
    share : float
        Share of the volume that is solid, above 0, at most 1 [-].
    pattern : str
        Of the infill, as a design names it; of other patterns the bounds of Wiener hold.

    Raises
    ------
    OutOfRange
        The permittivity is below 1, or the share is none.

    Examples
    --------
    >>> found = permittivity(4.68, 0.5, "gyroid")
    >>> round(found.lower, 2), round(found.upper, 2)
    (2.14, 2.56)
    """
    if not 1 <= solid < float("inf"):
        raise OutOfRange(f"relative permittivity of the solid is {solid:g}; expected a number from 1")
    upper = _checked(share) * solid + 1 - share
    if pattern in _EXTRUDED:
        return Interval(upper, upper)
    if pattern in _ISOTROPIC and solid > 1:
        low = 1 + share / (1 / (solid - 1) + (1 - share) / 3)
        return Interval(low, solid + (1 - share) / (1 / (1 - solid) + share / (3 * solid)))
    return Interval(1 / (share / solid + 1 - share), upper)


def modulus(solid_pa: float, poisson_ratio: float, share: float, pattern: str) -> Interval:
    r"""Effective Young's modulus across the plate of a solid with air, at small strain [Pa].

    Not below 0, as lines that cross may be far apart; not above :math:`\phi E` (Voigt), which upright walls reach. Of
    isotropic patterns not above the modulus of Hashin and Shtrikman's bulk and shear bounds for voids.

    Parameters
    ----------
    solid_pa : float
        Young's modulus of the solid [Pa].
    poisson_ratio : float
        Of the solid, 0 to 0.5 [-].
    share, pattern
        As of :func:`permittivity`.

    Examples
    --------
    >>> found = modulus(6e6, 0.2, 0.5, "gyroid")
    >>> found.lower, round(found.upper)
    (0.0, 2000000)
    """
    if not (0 < solid_pa < float("inf") and 0 <= poisson_ratio <= 0.5):
        raise OutOfRange(f"a modulus of {solid_pa:g} Pa with a Poisson's ratio of {poisson_ratio:g} is no solid's")
    upper = _checked(share) * solid_pa
    if pattern in _EXTRUDED:
        return Interval(upper, upper)
    if pattern in _ISOTROPIC and share < 1:
        shear, void = solid_pa / 2 / (1 + poisson_ratio), 1 - share
        compliance = 3 * (1 - 2 * poisson_ratio) / solid_pa  # 1 / K, 0 for rubber
        bulk = share / (compliance + void * 3 / 4 / shear)
        softness = (6 / 5) * (1 + 2 * shear * compliance) / (3 + 4 * shear * compliance)
        rigid = shear * (1 - void / (1 - share * softness)) if softness else upper
        return Interval(0.0, 9 * bulk * rigid / (3 * bulk + rigid))
    return Interval(0.0, upper)


def foam_modulus_pa(solid_pa: float, share: float) -> float:
    r"""Young's modulus of an open foam whose struts bend, :math:`E \phi^2`: an estimate (Gibson & Ashby) [Pa].

    >>> foam_modulus_pa(6e6, 0.5)
    1500000.0
    """
    return solid_pa * _checked(share) ** 2


def _checked(share: float) -> float:
    if not 0 < share <= 1:
        raise OutOfRange(f"share of the solid is {share:g}; expected a number above 0 and at most 1")
    return share
