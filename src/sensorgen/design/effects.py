"""Tip of a design file, and effects on a reading beside the press: drift since the last rest, dispersion, person.

No source of the materials gives these effects: the defaults are assumed, for filaments of TPU on a bench in a room. A
design states its own under ``effects:``.
"""

from typing import Annotated, Literal

from pydantic import Field

from sensorgen.core.records import Strict, stated
from sensorgen.core.units import M_PER_MM
from sensorgen.design.tip import TIP_M, Tip

_PROFILES = {"flat": "uniform", "hertz": "hertz", "parabola": "parabola"}
_Length = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]


class TipData(Strict):
    """Tip of a design file."""

    shape: Literal["flat", "hertz", "parabola"] = stated(
        "flat", "Flat, or the pressure of a round one on a thick body or on a thin film."
    )
    width_mm: _Length = stated(TIP_M / M_PER_MM, "Along the sensor [mm].")
    block: Annotated[str, Field(pattern="^[a-z0-9-]+$", examples=["ninjaflex", "stiff", "even"])] = stated(
        Tip.block, "Material of a block, or stiff (a plate), or even (pressure)."
    )
    height_mm: _Length = stated(Tip.height_m / M_PER_MM, "Of the block [mm].")

    def tip(self) -> Tip:
        """As models take it."""
        return Tip(self.width_mm * M_PER_MM, _PROFILES[self.shape], None, self.block, self.height_mm * M_PER_MM)


GUESS = "guess"
GIVEN = "the design"

Size = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Effects(Strict):
    """Sizes of the effects, either sign; 0 leaves one out."""

    temperature_k: Size = stated(1.0, "Change of temperature since the last reading at rest [K].")
    humidity_percent: Size = stated(2.0, "Change of relative humidity since the last reading at rest [percent].")
    permittivity_per_k: Size = stated(2e-3, "Relative change of the permittivity [1/K].")
    permittivity_per_percent: Size = stated(1e-3, "Relative change of the permittivity per percent of humidity [-].")
    resistivity_per_k: Size = stated(3e-3, "Relative change of the resistivity [1/K].")
    resistivity_per_percent: Size = stated(1e-3, "Relative change of the resistivity per percent of humidity [-].")
    permittivity_dispersion: Annotated[float, Field(ge=0, le=0.5)] = stated(
        0.01, "n of a permittivity that falls as frequency^-n, with the loss that belongs to it [-]."
    )
    resistivity_dispersion: Annotated[float, Field(ge=0, le=0.5)] = stated(
        0.005, "Largest n of a resistivity that falls as frequency^-n [-]."
    )
    piezoresistance: Size = stated(0.1, "Relative change of the resistivity under the tip at the reference load [-].")
    hysteresis: Size = stated(0.15, "Relative change of the rise of C after a higher load [-].")
    creep: Size = stated(0.05, "Relative change of the rise of C under a load that lasts [-].")
    off_middle_mm: Size = stated(2.0, "Tip off the middle of the width [mm].")
    tilt_deg: Annotated[float, Field(ge=0, lt=45)] = stated(2.0, "Tilt of the tip across the sensor [degree].")
    meter: Size = stated(1e-3, "Gain error of the meter, relative [-].")
    meter_circuit: bool = stated(True, "C and R of a series circuit may be taken for those of a parallel one.")
    squeezed_mm: Size = stated(0.05, "First layer squeezed by this much [mm].")
    bed_mm: Size = stated(0.05, "Height of the bed differs over the sensor by this much [mm].")
    person_n: Size = stated(0.1, "Error of the force that a person notes [N].")
    person_mm: Size = stated(1.0, "Error of the place that a person sets [mm].")

    def source(self, *names: str) -> str:
        """Source of some of them: the design where it states one, else an assumption."""
        return GIVEN if self.model_fields_set & set(names) else GUESS
