"""Tip that presses a sensor, without pydantic: the options of a query load none of it for ``--help``."""

from dataclasses import dataclass

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM

TIP_M = 0.01  # thesis, Table C.1: L_press
TOPS = EVEN, STIFF = "even", "stiff"  # in place of a block's material: an even pressure, a stiff plate


@dataclass(frozen=True)
class Tip:
    """Tip that presses a sensor across its whole width.

    Attributes
    ----------
    length_m : float
        Along the sensor [m].
    profile : str
        Distribution of its pressure along the sensor: one of :data:`sensorgen.models.pressure.PROFILES`.
    radius_m : float or None
        Of a hard round tip, whose contact grows with the force up to ``length_m`` [m]; None where all of it touches.
    block : str
        Material of a flat block, bonded to the sensor's top and pressed evenly on its own; ``EVEN`` or ``STIFF``.
    height_m : float
        Of the block [m].

    Raises
    ------
    OutOfRange
        A height that is not above 0.
    """

    length_m: float = TIP_M
    profile: str = "uniform"
    radius_m: float | None = None
    block: str = "ninjaflex"
    height_m: float = 0.01  # the thesis's soft tip

    def __post_init__(self) -> None:
        """Refuse a block without a height."""
        if not self.height_m > 0:
            raise OutOfRange(f"a block of {self.height_m / M_PER_MM:g} mm; expected a height above 0")

    @property
    def soft(self) -> bool:
        """True of a block that deforms."""
        return self.block not in (EVEN, STIFF)

    @property
    def material(self) -> str:
        """Block, plate or pressure, in words."""
        return f"{self.block} block of {self.height_m / M_PER_MM:g} mm" if self.soft else WORDS[self.block]


WORDS = {EVEN: "even pressure", STIFF: "stiff plate"}
