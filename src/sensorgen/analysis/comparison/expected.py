"""Expected readings of a design: the earliest prediction in the log, else one that is made now and named so.

:class:`Movable` moves one parameter of a prediction: what fits and explanations are made of.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import inf, isnan
from statistics import fmean, geometric_mean

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.version import __version__
from sensorgen.design.body import Body
from sensorgen.design.design import make
from sensorgen.measure.log import Entry, Log, Withdrawal
from sensorgen.measure.log import Prediction as Stored
from sensorgen.measure.signal.verdicts import along_ohm, leak_s
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.quantities import impedance_at
from sensorgen.prediction.rest_state import NOTHING_LOST, Lost, lost, rest_state
from sensorgen.prediction.results import Prediction, from_json
from sensorgen.prediction.sensor_model import SensorModel, sensor_model

_MOST_FILMS = 1 << 14  # readings across films, of one design, that are kept with what they predict


@dataclass(frozen=True)
class Predicted:
    """A prediction and where it comes from.

    Attributes
    ----------
    design, design_id : str
        Name and identity of the design.
    prediction : Prediction
        Of the print, unless it was stored by an older version.
    stored_at : str
        When the log stored it, UTC; "" where it was made now, after the measurement.
    version : str
        Of sensorgen, which made it.
    before : bool or None
        Whether it was stored before every reading and recording, by the order of the log's records; None where that
        proves nothing.
    order : str
        Its place in that order, in words.
    losses : Lost
        Of its dielectrics.
    """

    design: str
    design_id: str
    prediction: Prediction
    stored_at: str
    version: str
    before: bool | None = False
    order: str = ""
    losses: Lost = NOTHING_LOST

    @cached_property
    def ry_ohm(self) -> Bounds | None:
        """Along one electrode, of a tight film [ohm]; None where no resistance is predicted."""
        return self.along_ohm(inf)

    @cached_property
    def along_ohm(self) -> Callable[[float], Bounds | None]:
        """Reading along an electrode of a film that reads ``rz_ohm`` across; None where no resistance is predicted.

        The film is a ladder of leaks: one electrode where it is tight, both in parallel where it is a short. Without a
        reading across (nan) it is taken for tight, and the range holds a short too. The value is the geometric mean of
        both electrodes, as the readings do not say which was measured; the range is that of the best and the worst,
        with the errors of models, print and materials. Evaluated once for films that are alike.
        """
        ends = [r.alone() for r in self.prediction.resistance.values()]
        values, parts = [r.value for r in ends], [*zip(*((r, r.model, r.print, r.material) for r in ends), strict=True)]
        ranges = [([of.lower for of in part], [of.upper for of in part]) for part in parts]
        leads = [r.leads.upper - r.value for r in self.prediction.resistance.values() if r.leads]

        def law(rz_ohm: float) -> Bounds | None:
            if not ends:
                return None
            least, most = (0.0, inf) if isnan(rz_ohm) else (rz_ohm, rz_ohm)
            whole, model, by_print, material = (
                Interval(min(_read(low, least)), max(_read(high, most))) for low, high in ranges
            )
            value = geometric_mean(_read(values, most))
            alone = Bounds(value, whole.lower, whole.upper, "ohm", model, by_print, material)
            return alone.plus(0.0, 0.0, max(leads)) if leads else alone

        return lru_cache(maxsize=_MOST_FILMS)(law)

    @cached_property
    def touches(self) -> bool:
        """True if the electrodes touch as printed, so that the film is a short by design."""
        return self.prediction.status == "short"

    @property
    def parted(self) -> bool:
        """True if the electrodes touch as drawn, but have a gap as printed."""
        return self.prediction.drawn is not None and self.prediction.drawn.status == "short" and not self.touches

    def impedance_at(self, frequency_hz: float) -> tuple[complex, complex, complex] | None:
        """Predicted Z, and the ends of its range, R and -X at their least and at their largest [ohm].

        Of the line at this frequency, whichever the prediction lists; None of what is no capacitor.
        """
        at = impedance_at(self.prediction, frequency_hz, self.losses)
        if at is None or at.im.value >= 0:
            return None
        re, im = at.re, at.im
        return complex(re.value, im.value), complex(re.lower, im.upper), complex(re.upper, im.lower)

    @property
    def provenance(self) -> str:
        """Where the prediction comes from, in words."""
        if self.stored_at:
            return f"stored {self.stored_at} by sensorgen {self.version}; {self.order}"
        return f"made afterwards by sensorgen {self.version}: none was stored before"


def _read(ohms: list[float], across_ohm: float) -> list[float]:
    """Readings along each electrode of a film that reads ``across_ohm`` [ohm]."""
    if len(ohms) < 2 or inf in ohms:  # as where walls interrupt an electrode
        return ohms
    leak = leak_s(across_ohm, fmean(ohms))
    return [along_ohm(ohm, leak, sum(ohms) / ohm - 1) for ohm in ohms]


def predicted(body: Body) -> Predicted:
    """A prediction that is made now."""
    return Predicted(body.design.name, body.design.id(), evaluate(body), "", __version__, losses=_losses(body))


def stored_or_made(
    body: Body, log: Log, stored: Sequence[Stored], measured: Sequence[Entry], left_out: list[tuple[str, str]]
) -> Predicted:
    """The earliest prediction that the log has of a body's design, else one that is made now.

    Parameters
    ----------
    body : Body
        That was measured.
    log : Log
        An open one.
    stored : sequence of Stored
        The log's predictions of this very design, withdrawn ones too.
    measured : sequence of Entry
        Readings and recordings of it.
    left_out : list of (str, str)
        Grows by predictions that were withdrawn or cannot be read, and why.
    """
    for first in sorted(stored, key=lambda p: p.number):
        try:
            prediction = from_json(first.data)
            why = next((row.reason for row in log.superseding(first) if isinstance(row, Withdrawal)), "")
        except BadInput as error:
            why = str(error)
        if why:
            left_out.append((f"prediction {first.number} of {first.design}", why))
            continue
        before = log.before(first, measured)
        order = {
            True: "before anything was measured",
            False: "AFTER something was measured",
            None: "before or after the measurement only by clocks",
        }[before]
        place = f"record {log.record_of(first)[0]} of the log, {order}"
        if proof := log.anchored(first):
            anchor, later = proof
            place += f"; anchored {anchor.logged_at} in {anchor.file}"
            place += f", {later} record{'s' * (later > 1)} later" if later else ""
        return Predicted(
            body.design.name, body.design.id(), prediction, first.logged_at, first.version, before, place, _losses(body)
        )  # fmt: skip
    return predicted(body)


def _losses(body: Body) -> Lost:
    """Losses of the dielectrics; none where they are not known."""
    try:
        return lost(body.design)
    except SensorgenError:
        return Lost()


PERMITTIVITY = "relative_permittivity"
FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)  # of permittivity or film at which the capacitance is worked out


@dataclass(frozen=True, eq=False)
class Movable:
    """A body's sensor that parameters can be moved of.

    Attributes
    ----------
    body : Body
        That was measured.
    """

    body: Body

    @cached_property
    def model(self) -> SensorModel:
        """As predicted; raises as :func:`sensorgen.prediction.sensor_model.sensor_model`."""
        return sensor_model(self.body)[0]

    @property
    def film(self) -> str:
        """Name of the film's material."""
        return self.body.design.slot("film")[0].name

    @cached_property
    def permittivity(self) -> float:
        """Of the film, as predicted [-]."""
        return next(t.value for t in self.model.rest.values if t.material == self.film)

    def capacitance_f(self, permittivity: float) -> float:
        """With another permittivity of the film's material [F]."""
        changed = self.body.with_values({self.film: {PERMITTIVITY: permittivity}})
        return rest_state(changed, ranges=False).capacitance.value

    @cached_property
    def by_permittivity(self) -> tuple[Real, Real]:
        """Ln of the capacitance's middle, relative to the predicted one, over ln of the permittivity's factor."""
        return _curve(lambda factor: self.capacitance_f(self.permittivity * factor), self.model.rest.capacitance.value)

    @cached_property
    def by_film(self) -> tuple[Real, Real]:
        """Slopes over ln of the film's factor, of the drawing; flat where a design has no film.

        A print has whole layers, so that its capacitance jumps with the film that is asked for.
        """
        data = self.body.design.model_dump(exclude={"name"}, exclude_defaults=True, mode="json")
        if not (d := getattr(self.body.design.params, "dielectric_mm", 0.0)):
            return np.log(FACTORS), np.zeros(len(FACTORS))

        def at(factor: float) -> float:
            changed = make(data | {"parameters": data.get("parameters", {}) | {"dielectric_mm": d * factor}})
            return rest_state(bodies.drawn(changed), ranges=False).capacitance.value

        return _curve(at, at(1.0))


def _curve(at: Callable[[float], float], known: float) -> tuple[Real, Real]:
    return np.log(FACTORS), np.log([at(k) / known if k != 1 else 1.0 for k in FACTORS])


def moved(sensor: Sensor, resistivity: float = 1.0, capacitance: float = 1.0, leak_s: float = 0.0) -> Sensor:
    """A sensor with resistivities and capacitance times a factor [-], and a leak of the whole film [S]."""
    top, bottom = sensor.resistivity_ohm_m
    return replace(
        sensor, resistivity_ohm_m=(top * resistivity, bottom * resistivity),
        capacitance_f_per_m=sensor.capacitance_f_per_m * capacitance, leak_s_per_m=leak_s / sensor.length_m,
    )  # fmt: skip


def at_rest(sensor: Sensor, frequency_hz: Real) -> Complex:
    """Ln Z with nothing on the sensor (m,)."""
    return np.asarray(np.log(sensor.impedance(frequency_hz, 0.0, sensor.length_m / 2)))


def pressed(sensor: Sensor, frequency_hz: Real, force_n: Real, position_m: Real, stiffness: float = 1.0) -> Complex:
    """By how much presses move ln Z (p, m), of a film that is stiffer by a factor [-]: as a weaker press on ours."""
    z = sensor.impedance(frequency_hz, force_n[:, None] / stiffness, position_m[:, None])
    return np.asarray(np.log(z) - at_rest(sensor, frequency_hz))
