"""Stacks of tracks and films made from a design."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make
from sensorgen.design.values import MaterialValue, material_value
from sensorgen.models.sensor import Sensor
from sensorgen.models.stack import Film, Press, Stack, Track
from sensorgen.prediction import bodies
from sensorgen.prediction.planning import sensor_model
from sensorgen.prediction.query import TIP_M, Query, Tip


@dataclass(frozen=True)
class Stacked:
    """Stacks of a design.

    Attributes
    ----------
    own, double : Stack
        As drawn; and with two films: the same for a double sensor, two equal films for any other.
    tip_m : float
        Length of the tip and of the touch [m].
    isolation_eps_r : float
        Relative permittivity of the isolation's material [-].
    taken : tuple of MaterialValue
        Material values used.
    doubts : tuple of str
        Why the numbers are uncertain.
    """

    own: Stack
    double: Stack
    tip_m: float
    isolation_eps_r: float
    taken: tuple[MaterialValue, ...]
    doubts: tuple[str, ...]


def stacked(
    design: Design, law: str = "", tip_m: float = TIP_M, body: Callable[[Design], Body] = bodies.default_body
) -> Stacked:
    """The stacks of a design.

    Parameters
    ----------
    design : Design
        Double, or any other.
    law, tip_m : str, float
        Law of compression, "" for the default; length of the tip and of the touch [m].
    body : callable
        The body of a design: as printed unless given, or :func:`sensorgen.prediction.bodies.drawn`.

    Raises
    ------
    SensorgenError
        As :func:`sensorgen.prediction.planning.sensor_model`.
    """
    found = [sensor_model(body(half), Query(tip=Tip(tip_m), law=law))[0] for half in halves(design)]
    lower, upper = found[0], found[-1]
    double = stack_of([lower.sensor, upper.sensor])
    own = double if len(found) > 1 else stack_of([lower.sensor])
    material, source = design.slot("isolation")
    taken = {value for half in found for value in half.values}
    return Stacked(
        own, double, tip_m, material_value(material, source, "relative_permittivity").value,
        tuple(sorted(taken, key=lambda value: tuple(vars(value).values()))),
        tuple(dict.fromkeys(doubt for half in found for doubt in half.doubts)),
    )  # fmt: skip


def halves(design: Design) -> list[Design]:
    """A double sensor as the two plates that share its middle electrode; any other design is its own only one."""
    if design.shape == "double_tri":
        data = design.model_dump(include={"printer", "quality", "tools", "material_values", "own", "materials"})
        parameters = dataclasses.asdict(design.params) | {"isolation_mm": 0.0}
        lower = make(data | {"shape": "tri", "parameters": parameters})
        upper = data["materials"] | {"bottom_electrode": data["materials"]["top_electrode"]}
        return [lower, make(data | {"shape": "tri", "parameters": parameters, "materials": upper})]
    if design.shape != "double":
        return [design]
    p = design.params
    data = design.model_dump(include={"printer", "quality", "tools", "material_values", "own"}) | {"shape": "reference"}
    envelope = {f.name: getattr(p, f.name) for f in dataclasses.fields(p) if not f.name.endswith("dielectric_mm")}
    slots = design.model_dump(include={"materials"})["materials"]
    return [
        make(
            data
            | {
                "parameters": envelope | {"dielectric_mm": getattr(p, f"{half}_dielectric_mm"), "isolation_mm": 0.0},
                "materials": slots | {"dielectric": slots[part], "bottom_electrode": slots[below]},
            }
        )
        for half, part, below in (("lower", "film", "bottom_electrode"), ("upper", "dielectric", "top_electrode"))
    ]


def stack_of(sensors: Sequence[Sensor]) -> Stack:
    """Sensors on top of each other, from the bottom; each takes over the electrode below it from its neighbour.

    Parameters
    ----------
    sensors : sequence of Sensor
        Of one outline.
    """

    def track(sensor: Sensor, end: int) -> Track:
        section = sensor.electrode_m[end] * sensor.width_m
        return Track(sensor.resistivity_ohm_m[end] / section, sensor.piezoresistance_per_pa[end])

    first = sensors[0]
    films = [Film(s.capacitance_f_per_m, s.compression.capacitive_strain, s.tan_delta, s.leak_s_per_m) for s in sensors]
    tracks = (track(first, 1), *(track(sensor, 0) for sensor in sensors))
    return Stack(first.length_m, first.width_m, tracks, tuple(films))


def press_at(found: Stacked, force_n: float, position_m: float | None) -> Press:
    """The tip centred at a position, or in the middle; raises OutOfRange where it overhangs the sensor's end."""
    centre = found.own.length_m / 2 if position_m is None else position_m
    left = centre - found.tip_m / 2
    if not -1e-12 <= left <= found.own.length_m - found.tip_m + 1e-12:
        raise OutOfRange(
            f"a tip of {found.tip_m / M_PER_MM:g} mm at {centre / M_PER_MM:g} mm overhangs the sensor of "
            f"{found.own.length_m / M_PER_MM:g} mm: move it inwards"
        )
    return Press(force_n, max(left, 0.0), found.tip_m)
