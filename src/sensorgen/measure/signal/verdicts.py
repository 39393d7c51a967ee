r"""What the multimeter says of a specimen: open electrode, short, leak, dry joint or intact.

Along an electrode it should read :math:`R_Y = \rho L / (H W)`; between the electrodes an intact film lets nothing
through. With electrodes of :math:`R_Y` each and a film that leaks evenly, :math:`G` in all, the line reads

.. math:: R_Z = \sqrt{\frac{2 R_Y}{G}} \coth \sqrt{2 R_Y G},

which tends to :math:`1/G` for a small leak. A bridge without resistance of its own, at a distance x from the contacts,
reads :math:`2 R_Y x / L`: whatever lies below :math:`2 R_Y` may be a short, and nothing above it is one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isnan, nan, sqrt, tanh
from statistics import median

from sensorgen.core.errors import OutOfRange

WORDS = ("open electrode", "short", "leak", "dry joint", "intact", "unknown")
"""Verdicts, the gravest first; unknown where a reading is missing that the others hang on."""

INTACT_OHM = 1e8  # the highest range of a bench multimeter: what it can still tell from open
ORDER = 10.0  # what is of the same order: up to a factor of ten
_DRY, _OPEN, _LOW = 3.0, 100.0, 0.1  # of the expected resistance
_APART = 2.0  # readings of one electrode that disagree by more are a matter of the contact


@dataclass(frozen=True)
class Evidence:
    """Readings of one specimen.

    Attributes
    ----------
    name : str
        Of the specimen.
    ry_ohm, rz_ohm : tuple of float
        Along an electrode, and between the electrodes: several readings are several; inf where the meter showed
        overload; none where nothing was read [ohm].
    expected_ohm : float
        What an electrode should have [ohm]; nan where nobody knows.
    shape, remark : str
        For groups.
    film_mm : float or None
        For groups [mm].
    iteration : str
        For groups.
    touching : bool
        Whether the electrodes touch as drawn: such a short says nothing of how well it was printed.
    """

    name: str
    ry_ohm: tuple[float, ...] = ()
    rz_ohm: tuple[float, ...] = ()
    expected_ohm: float = nan
    shape: str = ""
    film_mm: float | None = None
    remark: str = ""
    iteration: str = ""
    touching: bool = False


@dataclass(frozen=True)
class Verdict:
    """A verdict and the numbers behind it.

    Attributes
    ----------
    word : str
        One of ``WORDS``.
    electrode : str
        "sound", "dry joint", "open electrode" or "unknown".
    film : str
        "intact", "leak", "short" or "unknown".
    ry_ohm, rz_ohm : float
        Least reading of each, nan where there is none: a contact only adds, and the film is as good as its worst place.
    ratio : float
        R_Z over R_Y [-].
    leak_s : float
        Leak through the whole film that would read like that [S]; inf for a reading of 0.
    over_expected : float
        R_Y over what it should be [-].
    reasons : tuple of str
        In words, with numbers.
    """

    word: str
    electrode: str
    film: str
    ry_ohm: float
    rz_ohm: float
    ratio: float
    leak_s: float
    over_expected: float
    reasons: tuple[str, ...]

    @property
    def same_order(self) -> bool | None:
        """Whether R_Z is of the order of R_Y or below, within a factor of ten; None where one is missing."""
        return None if isnan(self.ratio) else self.ratio <= ORDER


def electrode_ohm(resistivity_ohm_m: float, length_m: float, thickness_m: float, width_m: float) -> float:
    """R_Y of an even electrode, rho L / (H W) [ohm].

    Parameters
    ----------
    resistivity_ohm_m : float
        rho [ohm m].
    length_m, thickness_m, width_m : float
        L, H and W [m].

    Examples
    --------
    >>> round(electrode_ohm(0.07, 0.1, 0.4e-3, 0.02), 1)
    875.0
    """
    return resistivity_ohm_m * length_m / (thickness_m * width_m)


def leak_s(rz_ohm: float, ry_ohm: float) -> float:
    r"""Leak through the whole film that reads as ``rz_ohm`` between electrodes of ``ry_ohm`` each [S].

    With :math:`q = \sqrt{2 R_Y G}` the line reads :math:`R_Z / 2 R_Y = \coth(q) / q`, which falls with q.

    Parameters
    ----------
    rz_ohm : float
        Between the electrodes, inf for none [ohm].
    ry_ohm : float
        Of one electrode, end to end [ohm].

    Raises
    ------
    OutOfRange
        Readings below 0.

    Examples
    --------
    >>> round(1 / leak_s(1e6, 600.0))  # far above the electrodes it is the leak alone, less a third of them
    999600
    """
    if rz_ohm < 0 or ry_ohm < 0:
        raise OutOfRange(f"readings of {ry_ohm:g} and {rz_ohm:g} ohm; expected numbers from 0 on")
    if rz_ohm in (0, inf):
        return inf if rz_ohm == 0 else 0.0
    line = 2 * ry_ohm
    if line == 0 or rz_ohm / line > 1e7:
        return 1 / rz_ohm
    ratio = rz_ohm / line
    low, high = 0.5 * min(1 / ratio, 1 / sqrt(ratio)), 2 * max(1 / ratio, 1 / sqrt(ratio))
    for _ in range(200):
        middle = sqrt(low * high)
        low, high = (middle, high) if 1 / (middle * tanh(middle)) > ratio else (low, middle)
    return low * high / line


def verdict(of: Evidence, intact_ohm: float = INTACT_OHM) -> Verdict:
    """The verdict on a specimen.

    Parameters
    ----------
    of : Evidence
        Its readings.
    intact_ohm : float
        What an intact film has at least; what is known of the dielectric, or the meter's highest range [ohm].

    Raises
    ------
    OutOfRange
        A reading that is no number, or an expected resistance that is not above 0.

    Notes
    -----
    A reading below 0 is one of 0: a meter's offset, and its leads, are subtracted.
    """
    if of.expected_ohm <= 0:
        raise OutOfRange(f"{of.name}: {of.expected_ohm:g} ohm expected of an electrode; expected a number above 0")
    if any(isnan(value) for value in (*of.ry_ohm, *of.rz_ohm)):
        raise OutOfRange(f"{of.name}: readings {of.ry_ohm} and {of.rz_ohm} ohm; expected numbers, or none")
    ry, rz = (max(0.0, min(values)) if values else nan for values in (of.ry_ohm, of.rz_ohm))
    electrode, why_electrode = _electrode(of, ry)
    film, why_film = _film(ry, rz, of.expected_ohm, intact_ohm)
    leak = nan if isnan(rz) or isnan(ry) or ry == inf else leak_s(rz, ry)
    ratio = nan if isnan(ry) or isnan(rz) or ry in (0, inf) else rz / ry
    return Verdict(
        _word(electrode, film), electrode, film, ry, rz, ratio, leak, ry / of.expected_ohm, (why_electrode, why_film)
    )


def _word(electrode: str, film: str) -> str:
    """The gravest of the two; a sound half beside an unknown one proves nothing."""
    if electrode == "open electrode" or film in ("short", "leak"):
        return electrode if electrode == "open electrode" else film
    if electrode == "dry joint":
        return electrode
    return "unknown" if "unknown" in (electrode, film) else "intact"


def _electrode(of: Evidence, ry: float) -> tuple[str, str]:
    if isnan(ry):
        return "unknown", "no reading along the electrode"
    if ry == inf:
        return "open electrode", "the meter shows overload along the electrode"
    over, spread = ry / of.expected_ohm, max(of.ry_ohm) / ry if ry else 1.0
    said = f"R_Y {ry:.4g} ohm is {over:.3g} of the expected {of.expected_ohm:.4g} ohm"
    if over >= _OPEN:
        return "open electrode", f"{said}: {_OPEN:g} times and more is a track that is interrupted"
    if over > _DRY:
        return "dry joint", f"{said}: more than {_DRY:g} times"
    if spread > _APART:
        return "dry joint", f"readings of R_Y differ by a factor of {spread:.3g}: more than {_APART:g}"
    if over < _LOW:
        return "unknown", f"{said}: so little is no such electrode; is a k lost?"
    return "sound", f"R_Y {ry:.4g} ohm, nothing expected to hold it against" if isnan(over) else said


def _film(ry: float, rz: float, expected_ohm: float, intact_ohm: float) -> tuple[str, str]:
    if isnan(rz):
        return "unknown", "no reading between the electrodes"
    if rz >= intact_ohm:
        return "intact", f"R_Z {rz:.4g} ohm is at or above the {intact_ohm:.4g} ohm of an intact film"
    line = next((r for r in (ry, expected_ohm) if 0 <= r < inf), 0.0)  # an open electrode says nothing of a bridge
    if rz <= 2 * line:
        return "short", f"R_Z {rz:.4g} ohm is within the {2 * line:.4g} ohm of two electrodes: a bridge reads that"
    return (
        "leak",
        f"R_Z {rz:.4g} ohm is below the {intact_ohm:.4g} ohm of an intact film: {leak_s(rz, line):.3g} S",
    )


def expected_from(group: Sequence[Evidence]) -> float:
    """What an electrode of a group has, by its own least readings: their median [ohm]; nan where there are none.

    Parameters
    ----------
    group : sequence of Evidence
        Specimens that are printed alike.
    """
    readings = [min(of.ry_ohm) for of in group if of.ry_ohm and min(of.ry_ohm) < inf]
    return median(readings) if readings else nan
