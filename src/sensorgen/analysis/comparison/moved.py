"""A prediction with one of its parameters moved: what fits and explanations are made of."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sensorgen.design.body import Body
from sensorgen.design.design import make
from sensorgen.measure.recording.samples import Complex, Real
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import bodies
from sensorgen.prediction.planning import sensor_model
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import SensorModel

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
        """As predicted; raises as :func:`sensorgen.prediction.planning.sensor_model`."""
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
