"""What is expected of a design: by the log, as it was predicted when it was made, else predicted now and said so."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sensorgen import __version__
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import MissingValue
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.measure.log import Prediction
from sensorgen.prediction.prediction import prediction

ENDS = ("top", "bottom")


@dataclass(frozen=True)
class Tone:
    """Impedance of one tone, unloaded: between what the bounds of the capacitance make of it [ohm]."""

    frequency_hz: float
    impedance_ohm: complex
    re_range: tuple[float, float]
    im_range: tuple[float, float]


@dataclass(frozen=True)
class Predicted:
    """What a design should measure before anything presses on it.

    Attributes
    ----------
    design, design_id : str
        Name and identity.
    ry_ohm : Interval or None
        Along one electrode [ohm]; None where nothing is known. Nobody wrote down which of the two electrodes was
        measured: it begins with the better one and ends with the worse one.
    capacitance_f : Interval or None
        Between the electrodes [F]; None where no model can speak of the design.
    tones : tuple of Tone
        Impedance; none where there is no capacitance.
    touches : bool
        Whether the electrodes touch as drawn, so that the film is a short by design.
    stored_at : str
        When the log took the prediction, UTC; "" where it was made now, after the measurement.
    version : str
        Of sensorgen, which made it.
    reason : str
        Why there is no capacitance.
    values : tuple of mapping
        Material values that it rests on, with their sources.
    card : mapping
        Its identifiability card, or the reason why there is none.
    """

    design: str
    design_id: str
    ry_ohm: Interval | None
    capacitance_f: Interval | None
    tones: tuple[Tone, ...]
    touches: bool
    stored_at: str
    version: str
    reason: str
    values: tuple[Mapping[str, Any], ...]
    card: Mapping[str, Any]

    @property
    def provenance(self) -> str:
        """Where the prediction comes from, in words."""
        if self.stored_at:
            return f"stored {self.stored_at} by sensorgen {self.version}"
        return f"made afterwards by sensorgen {self.version}: none was stored before"


def predicted(design: Design, stored: Sequence[Prediction] = ()) -> Predicted:
    """The earliest prediction that the log has of a design, else one that is made now.

    Parameters
    ----------
    design : Design
        As drawn.
    stored : sequence of Prediction
        The log's predictions of this very design.
    """
    first = min(stored, key=lambda p: p.number, default=None)
    data = json.loads(first.data) if first else prediction(design)
    return Predicted(
        design.name, design.id(), electrode_ohm(design, data.get("electrode_resistance_ohm")),
        _interval(data.get("capacitance_f")), tuple(_tone(t) for t in data.get("impedance_ohm", ())),
        "electrodes touch" in data.get("reason", ""), first.logged_at if first else "",
        first.version if first else __version__, data.get("reason", ""), tuple(data.get("values", ())),
        data.get("identifiability") or {"reason": data.get("reason", "")},
    )  # fmt: skip


def _interval(data: Mapping[str, float] | None) -> Interval | None:
    return Interval(data["lower"], data["upper"]) if data else None


def _tone(data: Mapping[str, Any]) -> Tone:
    low, high = tuple(data["re_range"]), tuple(data["im_range"])
    return Tone(data["frequency_hz"], complex(data["re"], data["im"]), low, high)


def electrode_ohm(design: Design, plates: Mapping[str, float] | None = None) -> Interval | None:
    r"""Resistance of an electrode from end to end, between bounds [ohm].

    .. math:: \frac{\varrho L^2}{V} \le R \le \frac{\varrho L}{H W}

    Parameters
    ----------
    design : Design
        As drawn.
    plates : mapping or None
        The right-hand side for "top" and "bottom" [ohm], where that is known; worked out if not given.

    Returns
    -------
    Interval or None
        From the left-hand side of the better electrode to the right-hand side of the worse one; None where no source
        gives a resistivity.

    Notes
    -----
    Cogs only add paths, so the plate without them is the upper bound (Rayleigh). An even field is one that Dirichlet's
    principle allows, and gives the lower bound with all the electrode's volume V.
    """
    plates = plates or _plates(design)
    if not plates:
        return None
    p = design.params
    plate_mm3 = p.length_mm * p.width_mm * p.electrode_mm
    volume = {b.terminal: b.volume_mm3() for b in design.in_use.bodies if b.terminal}
    lower = [plates[end] * min(1.0, plate_mm3 / volume[end]) for end in ENDS]
    return Interval(min(lower), max(plates[end] for end in ENDS))


def _plates(design: Design) -> dict[str, float]:
    p = design.params
    squares_per_m = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    found = {}
    for end in ENDS:
        material, source = design.slot(f"{end}_electrode")
        try:
            found[end] = material.value("resistivity_ohm_m", source).value * squares_per_m
        except MissingValue:
            return {}
    return found
