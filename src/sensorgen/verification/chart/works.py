"""Pieces of work of a chart; each imports what it needs when it runs, so that a new process loads nothing else."""

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from sensorgen.verification.apart import ModelAnswer

if TYPE_CHECKING:
    from sensorgen.core.bounds import Interval
    from sensorgen.design.body import Body
    from sensorgen.prediction.mesh_ladder import Case
    from sensorgen.prediction.query import Query
    from sensorgen.scene.scene import Scene
    from sensorgen.solvers.line.inputs import PressedLine


def capacitance(
    model: str, scene: "Scene", permittivity: Mapping[str, float], width: float | None, count: float
) -> ModelAnswer:  # fmt: skip
    """Of ``count`` cells [F], by one of our models; ``width`` of the bounds is relative [-], or None."""
    module = import_module(f"sensorgen.models.{model}")
    return bounded(module.capacitance(scene, permittivity, *([] if width is None else [width])), count)


def bounded(bounds: "Interval", count: float) -> ModelAnswer:
    """Bounds of one cell as those of ``count`` cells."""
    middle = (bounds.lower + bounds.upper) / 2
    return ModelAnswer((count * middle,), (bounds.upper - bounds.lower) / 2 / middle, certified=True)


def formula(name: str, params: Any, eps_r: float, area_m2: float) -> ModelAnswer:
    """Capacitance of an area as drawn [F], by a formula of the thesis."""
    from sensorgen.models import thesis_cells

    return ModelAnswer((area_m2 * thesis_cells.NAMED[name].value_f_per_m2(params, eps_r),))


def peer(name: str, scene: "Scene", permittivity: Mapping[str, float], level: int, count: float) -> ModelAnswer:
    """Capacitance of ``count`` cells [F] by another program, certified where it gives bounds."""
    from sensorgen.core.bounds import Interval
    from sensorgen.verification import peers

    value = peers.levels(name, scene, permittivity)[level][1]()
    return bounded(value, count) if isinstance(value, Interval) else ModelAnswer((count * value,))


def rise_by_law(body: "Body", law: str, stress_pa: float) -> ModelAnswer:
    """Relative rise of the capacitance under a pressure [-], by a law that solves no field."""
    import numpy as np

    from sensorgen.prediction.sensor_model import rough_sensor

    compression = rough_sensor(body, law).law.compression
    strain = float(compression.capacitive_strain(np.asarray(stress_pa))[0])
    return ModelAnswer((strain / (1 - strain),), getattr(compression, "within", None))


def rise_by_mesh(case: "Case", level: int, stress_pa: float, stated: float) -> ModelAnswer:
    """Relative rise of the capacitance under a pressure [-], by finite elements."""
    from sensorgen.core.errors import OutOfRange
    from sensorgen.prediction.mesh_ladder import pressed

    curve = pressed(case, [0.0, stress_pa / 2, stress_pa], level)
    first, last = curve.capacitance_f_per_m2[0], curve.capacitance_f_per_m2[-1]
    if curve.faults or not (first and last) or curve.converged_pa < stress_pa:
        raise OutOfRange("; ".join(curve.faults) or f"solved up to {curve.converged_pa / 1e3:.3g} kPa only")
    return ModelAnswer((last.middle() / first.middle() - 1,), stated)


def line(model: str, line: "PressedLine", fineness: Mapping[str, Any]) -> ModelAnswer:
    """Impedance at every frequency [ohm] by a model of lines, or by another program."""
    from sensorgen.verification.line_models import impedance

    return ModelAnswer(tuple(impedance(model, line, **fineness).ravel().tolist()))


def predicted(body: "Body", query: "Query", *, rough: bool = False) -> ModelAnswer:
    """Impedance of the sensor under the reference load at every frequency [ohm]."""
    from sensorgen.prediction import sensor_model

    load, width = query.load(body.design), None
    if rough:
        model = sensor_model.rough_sensor(body, query.law, query.tip_of(body.design))
    else:
        model, plan = sensor_model.sensor_model(body, query)
        width = plan.width
    z = model.sensor.impedance(list(load.frequency_hz), load.force_n, load.position_m)
    return ModelAnswer(tuple(z.tolist()), width)
