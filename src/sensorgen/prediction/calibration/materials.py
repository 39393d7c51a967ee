"""Values of materials behind a calibration: what R, C and the rise of one specimen say of resistivity and the like.

A parameter of the specimen differs from the prediction by the material's value, and by the errors of sizes as printed
and of the models. Both are normal in the logarithm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, sqrt
from typing import Annotated

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.document import Column
from sensorgen.core.errors import BadInput
from sensorgen.core.lazy import by_key
from sensorgen.design.design import Design
from sensorgen.design.materials import SourceValue, source_file
from sensorgen.design.values import film, ln_spread, material_value
from sensorgen.prediction.calibration.fitting import Posterior
from sensorgen.prediction.calibration.specimen import FORCES_N, SpecimenModel
from sensorgen.prediction.inference import standard
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import SensorModel

NORMAL_95 = 1.959963984540054
_NUDGE = 0.02  # of ln of the permittivity, for the slope
_WIDTH = 1e-3  # of the capacitances behind that slope, relative
_TRACKS, _CELLS = 0.02, 0.01  # of ln R and ln C: sizes of printed lines, and the model of the cell
_PRESS, _PRESS_SHAPE = 0.05, 0.03  # of ln of the rise: tip 4.4 %, boundary 2.7 % (error budget); from force to force
_BY_READINGS = "presses and rest"
TOLD = 0.8  # of the prior's standard deviation: a value or parameter that keeps more was not identified


@dataclass(frozen=True)
class Link:
    """Dependence of a specimen's parameter on a material's value.

    Attributes
    ----------
    material, quantity : str
        As in the material's file.
    parameter : str
        "resistance", "capacitance" or "rise".
    value : float
        That the prediction rests on, in the unit of the quantity.
    middle, spread : float
        Mean and standard deviation of ln of the specimen's value over that, before calibration [-].
    slope : float
        Derivative of ln of the parameter by ln of the value; of the rise by the modulus, that over the one of the
        pressure [-].
    error, shape : float
        Standard deviation of ln of the parameter for other reasons: as a whole, and from one force to another [-].
    """

    material: str
    quantity: str
    parameter: str
    value: float
    middle: float
    spread: float
    slope: float
    error: float
    shape: float = 0.0


@dataclass(frozen=True)
class MaterialEstimate:
    """A material's value by one specimen, and before."""

    material: Annotated[str, Column("material")]
    quantity: Annotated[str, Column("quantity")]
    value: Annotated[float, Column("median")]
    lower: Annotated[float, Column("2.5 %")]
    upper: Annotated[float, Column("97.5 %")]
    before_lower: Annotated[float, Column("before 2.5 %")]
    before_upper: Annotated[float, Column("before 97.5 %")]
    by: Annotated[str, Column("known by", about="presses and rest: what the readings say; prediction: what was known")]

    @property
    def told(self) -> bool:
        """True if the readings say more than the prediction did."""
        return self.by == _BY_READINGS

    @property
    def has_left(self) -> bool:
        """True if its median is none of the values that were expected."""
        return not self.before_lower <= self.value <= self.before_upper

    def interval(self, level: float) -> tuple[float, float]:
        """Ends of another interval of a probability [-]."""
        from scipy.special import ndtri

        half = log(self.upper / self.lower) / 2 / NORMAL_95 * float(ndtri((1 + level) / 2))
        return self.value * exp(-half), self.value * exp(half)


def source_text(about: str, estimates: Sequence[MaterialEstimate]) -> str:
    """A file of a source of material values: those that readings tell, with their intervals.

    Raises
    ------
    BadInput
        The readings tell none.
    """
    told = [one for one in estimates if one.told]
    if not told:
        raise BadInput(f"{about}: the readings tell no material value; known presses tell them")
    values = ((one.material, SourceValue(one.quantity, one.value, one.lower, one.upper)) for one in told)
    return source_file(about, by_key(values))


def links(predicted: SensorModel) -> tuple[Link, ...]:
    """Links from a calibration of a body to its materials; without those that no source gives a value of.

    Parameters
    ----------
    predicted : SensorModel
        Of the body.
    """
    design, linked = predicted.body.design, list[Link]()
    electrodes = [design.slot(f"{end}_electrode") for end in ("bottom", "top")]
    common = predicted.sensor.common_resistivity_ohm_m()
    if len({material.name for material, _ in electrodes}) == 1:
        linked.append(_link(design, electrodes[0][0].name, "resistivity_ohm_m", "resistance", 1.0, _TRACKS, common))
    dielectric = film(design)
    linked.append(
        _link(design, dielectric, "relative_permittivity", "capacitance", *_capacitance(predicted, dielectric))
    )
    if any(v.material == dielectric and v.quantity == "youngs_modulus_pa" for v in predicted.values):
        linked.append(_link(design, dielectric, "youngs_modulus_pa", "rise", -1.0, _PRESS, shape=_PRESS_SHAPE))
    return tuple(linked)


def _link(
    design: Design, name: str, quantity: str, parameter: str, slope: float, error: float, value: float = 0.0, *,
    shape: float = 0.0,
) -> Link:  # fmt: skip
    material, source = design.material(name), design.used()[name]
    middle, spread = ln_spread(material, source, quantity)
    value = value or material_value(material, source, quantity).value
    return Link(name, quantity, parameter, value, middle, spread, slope, error, shape)


def _capacitance(predicted: SensorModel, dielectric: str) -> tuple[float, float]:
    """Slope of ln C by ln of the permittivity, and the standard deviation of ln C by sizes and model."""
    body, rest = predicted.body, predicted.rest
    eps = next(v.value for v in rest.values if (v.material, v.quantity) == (dielectric, "relative_permittivity"))
    more = rest_state(body.with_values({dielectric: {"relative_permittivity": eps * exp(_NUDGE)}}), _WIDTH)
    slope = log(more.capacitance.value / rest_state(body, _WIDTH).capacitance.value) / _NUDGE
    by_film = log(rest.by_film.upper / rest.by_film.lower) / 2 / NORMAL_95 if rest.by_film else 0.0
    by_model = log(rest.capacitance.model.upper / rest.capacitance.model.lower) / 2 / NORMAL_95
    return slope, sqrt(by_film**2 + by_model**2 + _CELLS**2)


def estimate(model: SpecimenModel, posterior: Posterior, link: Link) -> MaterialEstimate:
    """A material's value after calibration.

    The readings' information on the parameter is what its posterior holds beyond its prior; with it the value is found
    by its own prior and by the parameter's other errors.

    Parameters
    ----------
    model, posterior
        Of the specimen.
    link : Link
        Of the value to the parameter.
    """
    weights, slope = _weights(model, link)
    difference, pull = posterior.of(weights).beyond(standard(len(model.names)).of(weights))
    values, vectors = np.linalg.eigh(difference)
    information = (vectors * np.maximum(values, 0.0)) @ vectors.T
    of_rise = link.parameter == "rise"
    errors = np.eye(len(slope)) * (0.0 if of_rise else link.error**2)
    if of_rise:
        errors += link.error**2 + link.shape**2 * model.law_likeness()
    inverse = np.linalg.inv(link.spread**2 * np.outer(slope, slope) + errors)
    covariance = np.linalg.inv(information + inverse)
    prior_mean = link.middle * slope - (model.spread.law_middle if of_rise else 0.0)  # of a print that is as estimated
    at = covariance @ (pull + inverse @ prior_mean)
    by = link.spread**2 * slope @ inverse
    ln_value = link.middle + float(by @ (at - prior_mean))
    sd = sqrt(float(link.spread**2 - link.spread**2 * (by @ slope) + by @ covariance @ by))
    value, lower, upper = (link.value * exp(ln_value + k * NORMAL_95 * sd) for k in (0, -1, 1))
    first, last = (link.value * exp(link.middle + k * NORMAL_95 * link.spread) for k in (-1, 1))
    by_what = _BY_READINGS if sd < TOLD * link.spread else "prediction"
    return MaterialEstimate(link.material, link.quantity, value, lower, upper, first, last, by_what)


def _weights(model: SpecimenModel, link: Link) -> tuple[Real, Real]:
    """Ln of the parameter per standard deviation of each of the model's (k, p), and its slope by the value (k,)."""
    if link.parameter == "rise":
        sensor = model.sensor
        force = np.array(FORCES_N)
        ends = [_ln_rise(model, force * exp(k * _NUDGE) / (sensor.width_m * sensor.tip_m)) for k in (1, -1)]
        return model.law_weights(), link.slope * (ends[0] - ends[1]) / (2 * _NUDGE)
    weights = np.zeros((1, len(model.names)))
    weights[0, model.names.index(link.parameter)] = getattr(model.spread, link.parameter)
    return weights, np.array([link.slope])


def _ln_rise(model: SpecimenModel, stress_pa: Real) -> Real:
    share, _ = model.sensor.compression.capacitive_strain(np.minimum(stress_pa, model.most_pa))
    return np.asarray(np.log(share / (1 - share) * np.maximum(stress_pa / model.most_pa, 1.0)))
