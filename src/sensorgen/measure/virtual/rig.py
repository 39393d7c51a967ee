"""Section ``virtual`` of an experiment, and the simulated rig that it describes."""

from dataclasses import fields, replace
from typing import Annotated, Any

from pydantic import Field, model_validator

from sensorgen.core.errors import UnknownName
from sensorgen.core.records import Strict
from sensorgen.design.design import Design
from sensorgen.measure.virtual.faults import FaultSchedule, Planted
from sensorgen.measure.virtual.mechanics import Mechanics, VirtualRig
from sensorgen.measure.virtual.specimen import PressedSpecimen, Truth, drawn

Waves = Annotated[tuple[float, ...], Field(strict=False)]


class VirtualSpecimen(Strict):
    """The section ``virtual`` of an experiment: what a simulated run presses, and what goes wrong.

    Attributes
    ----------
    design : str or None
        File or shape; the design of the specimen in the log if None.
    seed : int
        Of materials, errors and drift.
    truth : mapping
        Values of :class:`sensorgen.measure.virtual.specimen.Truth` in place of drawn ones.
    rig : mapping
        Values of :class:`sensorgen.measure.virtual.mechanics.Mechanics` in place of its defaults.
    noise : float
        Relative standard deviation of both parts of a reading, beside the instrument's own noise [-].
    faults : sequence of Planted
        What goes wrong, and when.
    """

    design: str | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    truth: dict[str, float | Waves] = Field(default={})
    rig: dict[str, float] = Field(default={})
    noise: Annotated[float, Field(ge=0, le=1)] = 0.0
    faults: tuple[Planted, ...] = Field(default=(), strict=False)

    @model_validator(mode="after")
    def _known(self) -> "VirtualSpecimen":
        for given, kind in ((self.truth, Truth), (self.rig, Mechanics)):
            known = [one.name for one in fields(kind)]
            for name in given:
                if name not in known:
                    raise ValueError(str(UnknownName(f"value of a virtual {kind.__name__.lower()}", name, known)))
        return self


def rig_of(settings: VirtualSpecimen, design: Design, tip_m: float) -> VirtualRig:
    """The simulated rig of an experiment, with its faults planted.

    Parameters
    ----------
    settings : VirtualSpecimen
        Of the experiment's file.
    design : Design
        What the specimen was printed of.
    tip_m : float
        Length of the tip along the strip [m].

    Raises
    ------
    BadInput, OutOfRange, MissingValue
        A truth, rig or body that cannot be.
    """
    changes: dict[str, Any] = dict(settings.truth)
    specimen = PressedSpecimen(design, replace(drawn(design, settings.seed), **changes), tip_m)
    rig = VirtualRig(specimen, Mechanics(**settings.rig), settings.seed, settings.noise)
    rig.planted = FaultSchedule(settings.faults)
    return rig
