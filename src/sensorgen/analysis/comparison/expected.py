"""What is expected of a design: by the log, as it was predicted when it was made, else predicted now and said so."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sensorgen import __version__
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.design.values import ENDS, resistivities
from sensorgen.measure.log import Prediction
from sensorgen.models.conduction import electrode_resistance
from sensorgen.prediction.prediction import prediction


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
    known = data.get("electrode_resistance_ohm", {}).values()
    return Predicted(
        design.name, design.id(), Interval(min(known), max(known)) if known else electrode_ohm(design),
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


def electrode_ohm(design: Design, resistivity_ohm_m: Mapping[str, float] | None = None) -> Interval | None:
    """Resistance of an electrode from end to end, cogs included: from the better to the worse of the two [ohm].

    Parameters
    ----------
    design : Design
        As drawn.
    resistivity_ohm_m : mapping or None
        Of the "top" and the "bottom" electrode; by their materials' sources if not given.

    Returns
    -------
    Interval or None
        As :func:`sensorgen.models.conduction.electrode_resistance`; None where no source gives a resistivity.
    """
    try:
        rho = resistivity_ohm_m or {end: value.value for end, value in resistivities(design).items()}
    except MissingValue:
        return None
    found = [electrode_resistance(design.in_use, end, rho[end]) for end in ENDS]
    return Interval(min(ohm.lower for ohm in found), max(ohm.upper for ohm in found))
