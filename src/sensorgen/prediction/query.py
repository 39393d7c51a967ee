"""Question about a body; the default is one for all commands."""

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Annotated

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.core.options import Option
from sensorgen.core.units import FREQUENCY_HZ, M_PER_MM
from sensorgen.design.tip import TIP_M, Tip

if TYPE_CHECKING:
    from sensorgen.design.design import Design

TONES_HZ = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)  # thesis, Table 5.1, its 4990 corrected
FORCE_N = 6.0  # thesis 5.2: presses of 0 to 6 N
NOISE = 1e-3  # of Re Z and of Im Z, each, relative to abs(Z)
FLAT = Tip()  # the default
_PERIODS = 1.5  # under the tip, from which on the cell is taken as one of an endless pattern
LAWS = ("unconfined", "bonded", "symmetric", "infill", "free", "solved")  # of compression, closed forms first

Frequencies = Annotated[
    tuple[float, ...],
    Option("Frequencies, as in 1.1kHz,2.3kHz; the thesis's seven if not given.", ("--frequencies",), FREQUENCY_HZ),
]
Noise = Annotated[
    float, Option("Standard error of R and of X of a reading, relative to |Z|.", kind="proper share", typed="0.1%")
]


@dataclass(frozen=True)
class Load:
    """A load at which numbers are stated: frequencies [Hz], force [N], centre of the tip [m]."""

    frequency_hz: tuple[float, ...]
    force_n: float
    position_m: float


@dataclass(frozen=True)
class Query:
    """Question about a body; the default is one for all commands.

    Attributes
    ----------
    frequency_hz : tuple of float
        Of the impedance [Hz].
    force_n, position_m : float or None
        The reference load, at which resolution and error budget are stated [N], [m]; in the sensor's middle if no
        position is given.
    tip : Tip or None
        What presses; the design's own if None.
    law, --compression : str
        How the cell deforms: as a plate, free or bonded, as infill of flat electrodes, or solved (needs NGSolve;
        seconds in a cross-section, up to minutes in 3D); if not given, solved in a cross-section.
    accuracy : float or None
        Of abs(Z): cell, compression and line by the least expensive models that together meet it. Exit code 1 where
        they do not.
    noise : float
        Standard deviation of Re Z and of Im Z, each, relative to abs(Z) [-].
    range_kpa : tuple of (float, float) or None
        Pressures between which the sensitivity is stated [kPa]; from rest to the reference load if not given.
    """

    frequency_hz: Frequencies = TONES_HZ
    force_n: float = FORCE_N
    position_m: float | None = None
    tip: Tip | None = None
    law: Annotated[str, Option(kind=LAWS)] = ""
    accuracy: Annotated[float | None, Option(kind="ratio")] = None
    noise: Noise = NOISE
    range_kpa: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse pressures that do not rise, a law that is unknown, and frequencies and noise that none can be."""
        if self.law not in ("", *LAWS):
            raise UnknownName("law of compression", self.law, LAWS)
        if not self.frequency_hz or not all(0 < one < inf for one in self.frequency_hz):
            raise OutOfRange(f"frequencies {self.frequency_hz} Hz; expected some above 0")
        if not 0 < self.noise < 1:
            raise OutOfRange(f"noise {self.noise:g}; expected a share above 0 and below 1, as 1e-3")
        if self.range_kpa and not 0 <= self.range_kpa[0] < self.range_kpa[1]:
            low, high = self.range_kpa
            raise OutOfRange(f"sensitivity from {low:g} to {high:g} kPa; expected pressures that rise from 0 or more")

    def tip_of(self, design: "Design") -> Tip:
        """Tip that presses a design."""
        return self.tip or design.tip.tip()

    def of(self, design: "Design") -> "Query":
        """The query with the tip that presses a design."""
        return replace(self, tip=self.tip_of(design))

    def load(self, design: "Design") -> Load:
        """The reference load."""
        middle = design.params.length_mm * M_PER_MM / 2
        return Load(self.frequency_hz, self.force_n, middle if self.position_m is None else self.position_m)

    def few_periods(self, design: "Design") -> str:
        """Doubt about a tip that is too short for the cells under it to deform as under a uniform pressure; or ""."""
        period_mm, tip_m = getattr(design.params, "period_mm", None), self.tip_of(design).length_m
        count = tip_m / (period_mm * M_PER_MM) if period_mm else inf
        if count > _PERIODS - 1e-9 or getattr(design.params, "along", "") == "y":
            return ""
        tip = f"the tip covers {count:.2g} periods, less than {_PERIODS:g}"
        return f"{tip}: the response depends on where in one it presses"


DEFAULT = Query()
__all__ = ["DEFAULT", "FLAT", "FORCE_N", "LAWS", "NOISE", "TIP_M", "TONES_HZ", "Load", "Query", "Tip"]
