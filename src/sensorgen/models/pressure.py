r"""How pressure is spread along a tip: a profile is the share of the force that rests on the tip up to a place.

Between two places the mean pressure is then exact, whatever the profile, and the pieces of a tip carry its whole force.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import OutOfRange, UnknownName

SOURCE = "Hertz (1882) for a round tip on a thick soft body; Johnson, Contact Mechanics (1985), 5.8 for a thin one"
COST = 0

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """Pressure along a tip, symmetric.

    Attributes
    ----------
    name, source : str
        What it is, and who says so.
    share : function
        Share of the force up to a place, from 0 at one end of the tip to 1 at the other [-].
    density : function
        Its derivative: pressure over its mean [-].
    """

    name: str
    source: str
    share: Callable[[Real], Real]
    density: Callable[[Real], Real]


def _hertz_share(place: Real) -> Real:
    angle = 2 * np.arcsin(np.sqrt(place))
    return np.asarray((angle - np.sin(angle) * np.cos(angle)) / np.pi)


_KNOWN = (
    Profile("uniform", "flat tip, soft, or hard on a film much thinner than itself", lambda u: u, np.ones_like),
    Profile("hertz", "round tip on a body much thicker than the contact is long: an ellipse", _hertz_share,
            lambda u: 8 / np.pi * np.sqrt(u * (1 - u))),
    Profile("parabola", "hard round tip on a thin layer, a bed of springs", lambda u: u * u * (3 - 2 * u),
            lambda u: 6 * u * (1 - u)),
)  # fmt: skip
PROFILES = tuple(profile.name for profile in _KNOWN)


def profile(name: str) -> Profile:
    """A profile by name.

    Raises
    ------
    UnknownName
        There is none of that name.
    """
    for known in _KNOWN:
        if known.name == name:
            return known
    raise UnknownName("profile of pressure", name, PROFILES)


@dataclass(frozen=True)
class Pieces:
    """A tip, or the part of it that rests on a sensor, cut into pieces; the last axis counts them.

    Attributes
    ----------
    length : (n,) array
        Of each piece over that of the part [-]; they add up to 1.
    pressure : (..., n) array
        Mean pressure of each piece over that of the part [-].
    pressure_slope : (..., n) array
        Its derivative along with the part's ends [1/m].
    """

    length: Real
    pressure: Real
    pressure_slope: Real


def pieces(
    name: str,
    count: int,
    ends: tuple[Real, Real] = (np.zeros(()), np.ones(())),
    slopes: tuple[Real, Real] | None = None,
) -> Pieces:
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
    slopes : (array, array), optional
        Their derivatives by something [1/m].

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
    known = profile(name)
    begin, end = (np.asarray(e, float)[..., None] for e in ends)
    places = (1 - np.cos(np.pi * np.arange(count + 1) / count)) / 2
    length = np.diff(places)
    at = begin + (end - begin) * places
    share = known.share(at)
    whole = share[..., -1:] - share[..., :1]
    pressure = np.diff(share) / (whole * length)
    if slopes is None:
        return Pieces(length, pressure, np.zeros_like(pressure))
    by_begin, by_end = (np.asarray(s, float)[..., None] for s in slopes)
    moved = known.density(at) * (by_begin + (by_end - by_begin) * places)
    whole_moved = moved[..., -1:] - moved[..., :1]
    return Pieces(length, pressure, np.diff(moved) / (whole * length) - pressure * (whole_moved / whole))
