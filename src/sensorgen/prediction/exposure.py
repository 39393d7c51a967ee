"""Exposures of a reading beside the press: the design's ``effects``, as terms of the error budget."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from math import radians, tan
from typing import Any, NamedTuple

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.effects import Effects
from sensorgen.design.tip import EVEN
from sensorgen.models import pressure
from sensorgen.models.compression import averaged, beyond
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.compression_law import gap_m
from sensorgen.prediction.print_faults import by_first_layer
from sensorgen.prediction.reference_load import Dispersed, ReferenceLoad
from sensorgen.prediction.results import Changes, Term
from sensorgen.prediction.sensor_model import SensorModel, piece

_EDGE = 0.45  # of the width: farthest that a tip is pressed off the middle


class Exposure(NamedTuple):
    """An effect.

    ``keys`` are the design's of its size, ``sensors`` those at its ends: none where it is left out, None where they
    are not known. ``since_rest`` if it came after the last reading at rest, ``at_least`` if the law ends below it.
    """

    keys: tuple[str, ...]
    name: str
    what: str
    kind: Any
    sensors: Sequence[Sensor] | None
    since_rest: bool = True
    at_least: bool = False
    turns: str = ""


def exposed(model: SensorModel, reference: ReferenceLoad) -> Iterator[Term]:
    """Terms of what a reading depends on beside the press; none without a press."""
    effects = model.body.design.effects
    if not reference.force_n > 0:
        return
    for one in chain(_drift(effects, model.sensor), _memory(effects, reference), _tip(effects, model, reference),
                     _first_layer(effects, model)):  # fmt: skip
        source = effects.source(*one.keys)
        if one.sensors is None:
            yield Term(one.name, one.what, one.kind, None, source=source, turns=one.turns)
        elif one.sensors:
            yield reference.term(
                one.name, one.what, one.kind, one.sensors, since_rest=one.since_rest, at_least=one.at_least,
                source=source, turns=one.turns,
            )  # fmt: skip
    if effects.meter:
        gain = Changes(*(effects.meter,) * 5)  # the same at rest: the press is read as it is
        what = f"{effects.meter:.2g} of every reading"
        yield Term("meter's gain", what, "meter", gain, source=effects.source("meter"))
    if effects.meter_circuit:
        circuit, what = reference.other_circuit(), "C, R and D of one circuit taken for those of the other"
        yield Term(
            "meter: series or parallel", what, "meter", circuit, source=effects.source("meter_circuit"),
            turns=reference.turns(circuit),
        )  # fmt: skip
    if effects.person_n or effects.person_mm:
        press = Changes(force_n=effects.person_n, position_m=effects.person_mm * M_PER_MM)
        what = f"press noted {effects.person_n:g} N and {effects.person_mm:g} mm off"
        source = effects.source("person_n", "person_mm")
        yield Term("person", what, "person", press, source=source, turns=reference.turns(press))


def _drift(e: Effects, sensor: Sensor) -> Iterator[Exposure]:
    """Drift of permittivity and resistivity since the reading at rest, and their dispersion."""
    causes = ("temperature", "k", "K"), ("humidity", "percent", "% of humidity")
    for quantity, of in (("permittivity", _permittivity), ("resistivity", _resistivity)):
        for cause, unit, words in causes:
            keys = f"{quantity}_per_{unit}", f"{cause}_{unit}"
            per, change = (getattr(e, key) for key in keys)
            ends = [of(sensor, 1 + sign * per * change) for sign in (-1, 1) if per * change]
            what = f"{per * change:.2g} by {change:g} {words} since the reading at rest"
            yield Exposure(keys, f"{quantity}, {cause}", what, "drift", ends)
    n, m = e.permittivity_dispersion, e.resistivity_dispersion
    dispersed = [Dispersed(**vars(sensor), permittivity_power=n, resistivity_power=m)] if n or m else []
    what = f"permittivity as f^-{n:g}, resistivity as f^-{m:g}"
    yield Exposure(
        ("permittivity_dispersion", "resistivity_dispersion"), "dispersion", what, "drift", dispersed, since_rest=False
    )


def _memory(e: Effects, reference: ReferenceLoad) -> Iterator[Exposure]:
    """Memory of the film: of a higher load, and of the time under this one."""
    for name, share, when in (
        ("hysteresis", e.hysteresis, "after a higher load"), ("creep", e.creep, "under a load that lasts"),
    ):  # fmt: skip
        ends = _with_law(reference, lambda _: np.ones(1), 1 + share) if share else []
        yield Exposure((name,), name, f"rise of C {share:.2g} larger {when}", "drift", ends)


def _tip(e: Effects, model: SensorModel, reference: ReferenceLoad) -> Iterator[Exposure]:
    """Piezoresistance under the tip; uneven pressure across the sensor: a tip off the middle, or tilted."""
    width_m = model.sensor.width_m
    if not model.piezoresistance:
        per_pa = e.piezoresistance / reference.stress_pa()
        changed = [replace(model.sensor, piezoresistance_per_pa=(s * per_pa, s * per_pa)) for s in (-1, 1) if per_pa]
        what = f"resistivity under the tip {e.piezoresistance:g} lower or higher"
        yield Exposure(("piezoresistance",), "piezoresistance", what, "drift", changed)
    if e.off_middle_mm:
        across = pressure.off_middle(min(e.off_middle_mm * M_PER_MM / width_m, _EDGE))
        ends = _with_law(reference, lambda _: across)
        yield Exposure(("off_middle_mm",), "tip off the middle", f"by {e.off_middle_mm:g} mm across", "tip", ends)
    if e.tilt_deg and model.body.design.tip.block != EVEN:
        ends = _tilted(model, reference, tan(radians(e.tilt_deg)) * width_m)
        ended = len(ends or ()) > 1
        what = f"by {e.tilt_deg:g} degrees across{': its edge presses beyond the compression law' * ended}"
        yield Exposure(("tilt_deg",), "tip tilted", what, "tip", ends, at_least=ended)


def _first_layer(e: Effects, model: SensorModel) -> Iterator[Exposure]:
    """A bottom electrode thinner than drawn: its first layer squeezed, or the bed uneven."""
    top, bottom = model.sensor.electrode_m
    for key, least_mm, name in (
        ("squeezed_mm", e.squeezed_mm, "first layer squeezed"), ("bed_mm", e.bed_mm, "bed uneven"),
    ):  # fmt: skip
        thinner = bottom - least_mm * M_PER_MM
        ends = None if thinner <= 0 else [replace(model.sensor, electrode_m=(top, thinner))] if least_mm else []
        what = f"by {least_mm:g} mm: bottom electrode thinner"
        turns = by_first_layer(model.body.design, least_mm) if least_mm else ""
        yield Exposure((key,), name, what, "print", ends, since_rest=False, turns=turns)


def _permittivity(sensor: Sensor, factor: float) -> Sensor:
    return replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * factor)


def _resistivity(sensor: Sensor, factor: float) -> Sensor:
    top, bottom = sensor.resistivity_ohm_m
    return replace(sensor, resistivity_ohm_m=(top * factor, bottom * factor))


def _with_law(
    reference: ReferenceLoad, shares: Callable[[float], Real], scale: float = 1.0
) -> list[Sensor] | None:  # fmt: skip
    """The sensor with the rise of its parts at uneven pressures, times a scale; None beyond the law of a plate.

    Beyond the law of a cell, whose gaps close: with no further rise, and with one by its last slope.
    """
    sensor, mean_pa = reference.sensor, reference.stress_pa()
    try:
        laws = [averaged(law, shares, mean_pa) for law in beyond(sensor.compression, mean_pa, shares)]
    except OutOfRange:
        return None
    return [replace(sensor, compression=law.scaled_rise(scale)) for law in laws]


def _tilted(model: SensorModel, reference: ReferenceLoad, difference_m: float) -> list[Sensor] | None:
    """Under a tip that is held so many metres lower at one side; None where it is not known how the film yields."""
    design, tip = model.body.design, model.body.design.tip.tip()
    block = tip.height_m / design.material(tip.block).value("youngs_modulus_pa").value if tip.soft else 0.0
    try:
        film_pa_per_m = model.sensor.compression.foundation_stiffness_pa_per_m(gap_m(piece(model.body).scene))
    except (MissingValue, OutOfRange):
        return None
    rise_pa = difference_m / (1 / film_pa_per_m + block)
    return _with_law(reference, lambda mean_pa: pressure.tilted(rise_pa, mean_pa))
