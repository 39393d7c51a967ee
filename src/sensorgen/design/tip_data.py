"""Tip in a design file."""

from typing import Annotated, Literal

from pydantic import Field

from sensorgen.core.records import Strict
from sensorgen.core.units import M_PER_MM
from sensorgen.design.tip import TIP_M, Tip

_PROFILES = {"flat": "uniform", "hertz": "hertz", "parabola": "parabola"}
_Length = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]


class TipData(Strict):
    """Tip of a design file."""

    shape: Literal["flat", "hertz", "parabola"] = Field(
        default="flat", description="Flat, or the pressure of a round one on a thick body or on a thin film."
    )
    width_mm: _Length = Field(default=TIP_M / M_PER_MM, description="Along the sensor [mm].")
    block: Annotated[str, Field(pattern="^[a-z0-9-]+$", examples=["ninjaflex", "stiff", "even"])] = Field(
        default=Tip.block, description="Material of a block, or stiff (a plate), or even (pressure)."
    )
    height_mm: _Length = Field(default=Tip.height_m / M_PER_MM, description="Of the block [mm].")

    def tip(self) -> Tip:
        """As models take it."""
        return Tip(self.width_mm * M_PER_MM, _PROFILES[self.shape], None, self.block, self.height_mm * M_PER_MM)
