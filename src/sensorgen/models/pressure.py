r"""Distribution of pressure along a tip: a profile is the share of the force on the tip up to a place.

Between two places the mean pressure is then exact, whatever the profile, and the pieces of a tip carry its whole force.
The contact of a round tip grows with the force, by a law that goes with its profile.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange, UnknownName

SOURCE = "Hertz (1882) for a round tip on a thick soft body; Johnson, Contact Mechanics (1985), 5.8 for a thin one"
COST = 0

_ACROSS = (np.arange(400) + 0.5) / 400 - 0.5  # of the width, from its middle
BLUNT_M = 1e-6  # a round tip touches over this length at least, so that no force is a point's


@dataclass(frozen=True)
class PressureProfile:
    """Pressure along a tip, symmetric.

    Attributes
    ----------
    share : function
        Share of the force up to a place, from 0 at one end of the tip to 1 at the other [-].
    density : function
        Its derivative: pressure over its mean [-].
    """

    share: Callable[[Real], Real]
    density: Callable[[Real], Real]


def _hertz_share(place: Real) -> Real:
    angle = 2 * np.arcsin(np.sqrt(place))
    return np.asarray((angle - np.sin(angle) * np.cos(angle)) / np.pi)


_KNOWN = {
    # flat tip, soft, or hard on a film much thinner than itself
    "uniform": PressureProfile(lambda u: u, np.ones_like),
    # round tip on a body much thicker than the contact is long: an ellipse
    "hertz": PressureProfile(_hertz_share, lambda u: 8 / np.pi * np.sqrt(u * (1 - u))),
    # hard round tip on a thin layer, a bed of springs
    "parabola": PressureProfile(lambda u: u * u * (3 - 2 * u), lambda u: 6 * u * (1 - u)),
}
PROFILES = tuple(_KNOWN)


def profile(name: str) -> PressureProfile:
    """A profile by name.

    Raises
    ------
    UnknownName
        There is none of that name.
    """
    if name not in _KNOWN:
        raise UnknownName("profile of pressure", name, PROFILES)
    return _KNOWN[name]


@dataclass(frozen=True)
class RoundContact:
    r"""Contact length of a round tip: :math:`l = c\,(F/W)^n`, up to the tip's own length.

    Attributes
    ----------
    length_at_one_m : float
        c, the length at 1 N per metre of width [m].
    power : float
        n [-].
    """

    length_at_one_m: float
    power: float

    def length_m(self, line_load_n_per_m: Real, longest_m: float) -> tuple[Real, Real]:
        """Length of the contact [m] and its derivative by the load [m2/N], 0 once the whole tip touches.

        Parameters
        ----------
        line_load_n_per_m : array
            Force over width, 0 or more [N/m].
        longest_m : float
            Length of the tip [m].
        """
        load = np.asarray(line_load_n_per_m, float)
        length = self.length_at_one_m * load**self.power
        grows = (length > BLUNT_M) & (length < longest_m)
        slope = self.power * length / np.where(load > 0, load, 1.0)
        return np.clip(length, BLUNT_M, longest_m), np.where(grows, slope, 0.0)


def hertz(radius_m: float, plane_modulus_pa: float) -> RoundContact:
    r"""A hard cylinder across a body that is much thicker than the contact is long.

    .. math:: l = 2 a = 4 \sqrt{\frac{F R}{\pi W E^*}}, \quad E^* = \frac{E}{1 - \nu^2}

    Parameters
    ----------
    radius_m, plane_modulus_pa : float
        R [m]; E* of the body [Pa].

    Raises
    ------
    OutOfRange
        A radius or a modulus that is not above 0.

    Notes
    -----
    Johnson, Contact Mechanics (1985), Eq. 4.43.

    Examples
    --------
    >>> length, _ = hertz(0.01, 8e6).length_m(np.asarray(100.0), 0.01)
    >>> round(float(length) * 1e3, 4)
    0.7979
    """
    _refuse_none(radius_m, plane_modulus_pa)
    return RoundContact(4 * float(np.sqrt(radius_m / (pi * plane_modulus_pa))), 1 / 2)


def bed(radius_m: float, stiffness_pa_per_m: float) -> RoundContact:
    r"""A hard cylinder on a thin layer that deforms as a Winkler foundation, in proportion to the local pressure.

    .. math:: l = 2 a = 2 \sqrt[3]{\frac{3 F R}{2 W k}}, \quad p = \frac{k}{2 R} (a^2 - x^2)

    Parameters
    ----------
    radius_m, stiffness_pa_per_m : float
        R [m]; k, pressure per displacement [Pa/m].

    Raises
    ------
    OutOfRange
        A radius or a stiffness that is not above 0.

    Notes
    -----
    Johnson, Contact Mechanics (1985), 4.3 and 5.8.

    Examples
    --------
    >>> length, _ = bed(0.01, 1e10).length_m(np.asarray(100.0), 0.01)
    >>> round(float(length) * 1e3, 4)
    1.0627
    """
    _refuse_none(radius_m, stiffness_pa_per_m)
    return RoundContact(2 * float(np.cbrt(1.5 * radius_m / stiffness_pa_per_m)), 1 / 3)


def _refuse_none(radius_m: float, stiffness: float) -> None:
    if not (0 < radius_m < np.inf and 0 < stiffness < np.inf):
        raise OutOfRange(
            f"a round tip of radius {radius_m * 1e3:g} mm on a stiffness of {stiffness:g}: expected both above 0"
        )


@dataclass(frozen=True)
class TipPieces:
    """A tip, or the part of it that rests on a sensor, cut into pieces; the last axis counts them.

    Attributes
    ----------
    length : (n,) array
        Of each piece over that of the part [-]; they add up to 1.
    pressure : (..., n) array
        Mean pressure of each piece over that of the part [-].
    """

    length: Real
    pressure: Real


def pieces(name: str, count: int, ends: tuple[Real, Real] = (np.zeros(()), np.ones(()))) -> TipPieces:
    r"""Cut a tip into pieces that are short towards its ends, where the pressure changes most.

    .. math:: w_k = \frac{G(u_{k+1}) - G(u_k)}{(G(b) - G(a))\,(t_{k+1} - t_k)}, \quad u_k = a + (b - a)\, t_k, \quad
              t_k = \tfrac12 (1 - \cos \tfrac{\pi k}{n})

    Parameters
    ----------
    name : str
        Of the profile.
    count : int
        Pieces, 1 or more.
    ends : (array, array)
        Where on the tip the part that rests begins and ends, of one shape; the whole tip is 0 to 1 [-].

    Raises
    ------
    UnknownName, OutOfRange
        No such profile; no piece.

    Notes
    -----
    An ellipse rises with the root of the distance from its end; over the angle of these places it is smooth, so that
    what depends on the pressure converges with the square of their number.

    Examples
    --------
    >>> half = pieces("hertz", 2)
    >>> half.length, half.pressure
    (array([0.5, 0.5]), array([1., 1.]))
    >>> float(pieces("hertz", 64).pressure.max().round(2))  # 4 / pi
    1.27
    """
    if count < 1:
        raise OutOfRange(f"{count} pieces of a tip; expected 1 or more")
    length, _, share, whole = _shares(name, count, ends)
    return TipPieces(length, np.diff(share) / (whole * length))


def pressure_slope(name: str, count: int, ends: tuple[Real, Real], slopes: tuple[Real, Real]) -> Real:
    """Derivative of the pressure of :func:`pieces` along with their ends.

    Parameters
    ----------
    name, count, ends : str, int, (array, array)
        As of :func:`pieces`.
    slopes : (array, array)
        Derivatives of the ends by something, [1/m] by a place.
    """
    length, at, share, whole = _shares(name, count, ends)
    by_begin, by_end = (np.asarray(s, float)[..., None] for s in slopes)
    moved = profile(name).density(at) * (by_begin + (by_end - by_begin) * _places(count))
    whole_moved = moved[..., -1:] - moved[..., :1]
    return np.asarray((np.diff(moved) - np.diff(share) * (whole_moved / whole)) / (whole * length))


def _places(count: int) -> Real:
    return np.asarray((1 - np.cos(np.pi * np.arange(count + 1) / count)) / 2)


def _shares(name: str, count: int, ends: tuple[Real, Real]) -> tuple[Real, Real, Real, Real]:
    """Length of each piece, where they meet on the tip, the share of the force up to there, and what rests in all."""
    begin, end = (np.asarray(e, float)[..., None] for e in ends)
    places = _places(count)
    at = begin + (end - begin) * places
    share = profile(name).share(at)
    return np.diff(places), at, share, share[..., -1:] - share[..., :1]


def off_middle(off: float) -> Real:
    r"""Pressure over its mean across the width, under a stiff tip that is free to turn and pressed off the middle.

    Linear, :math:`1 + 12 e y / W^2`, as long as no side lifts (e up to W/6); else a triangle as wide as
    :math:`3 (W / 2 - e)`: balance of force and moment.

    Parameters
    ----------
    off : float
        e/W, below 1/2 [-].
    """
    if off <= 1 / 6:
        return np.asarray(1 + 12 * off * _ACROSS)
    wide = 3 * (0.5 - off)
    return np.asarray(2 / wide * np.clip(1 - (0.5 - _ACROSS) / wide, 0, None))


def tilted(rise_pa: float, mean_pa: float) -> Real:
    """Pressure over its mean across the width, under a tip that is held at an angle: linear, 0 where it does not touch.

    Parameters
    ----------
    rise_pa : float
        Rise of the pressure from side to side, were all of it to touch: the foundation's and the tip's stiffness in
        series, times the width and the tangent of the angle [Pa].
    mean_pa : float
        Mean pressure, above 0 [Pa].
    """
    slope = rise_pa / mean_pa
    if slope <= 2:
        return np.asarray(1 + slope * _ACROSS)
    wide = (2 / slope) ** 0.5
    return np.asarray(slope * np.clip(wide - (0.5 - _ACROSS), 0, None))
