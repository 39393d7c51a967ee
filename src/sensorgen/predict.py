"""What a design should do, by the cheapest model that can speak of it."""

import math
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from sensorgen import materials, models, registry
from sensorgen.design import Design
from sensorgen.errors import MissingValue, SensorgenError
from sensorgen.interval import Interval
from sensorgen.scene import Scene
from sensorgen.units import M_PER_MM

TONES_HZ = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)  # thesis, Table 5.1, its 4990 corrected


class Unpredictable(SensorgenError):
    """No model can speak of the scene; the message holds what each one said."""


@dataclass(frozen=True)
class Answer:
    """A model's capacitance, and what the models before it refused.

    Attributes
    ----------
    model : str
        Name of the model.
    capacitance_f : Interval
        Of the whole sensor [F].
    refused : tuple of str
        Why other models were passed over.
    """

    model: str
    capacitance_f: Interval
    refused: tuple[str, ...]


@dataclass(frozen=True)
class Taken:
    """A material value that a prediction rests on."""

    material: str
    quantity: str
    value: float
    source: str


def capacitance(scene: Scene, permittivity: dict[str, float], width: float = float("inf")) -> Answer:
    """Ask the models, cheapest first, for the capacitance of a scene.

    Parameters
    ----------
    scene : Scene
        As drawn.
    permittivity : dict of str to float
        Relative permittivity of each dielectric, and of "air" [-].
    width : float
        How wide the interval may be, relative to its middle; the narrowest one where none is that narrow [-].

    Raises
    ------
    Unpredictable
        No model can speak of the scene.
    """
    refused: list[str] = []
    answers: list[tuple[Interval, str]] = []
    for name, model in _capacitance_models():
        reason = model.unfit(scene)
        if reason:
            refused.append(f"{name}: {reason}")
            continue
        answers.append((model.capacitance(scene, permittivity), name))
        if answers[-1][0].width() <= width:
            break
    if not answers:
        raise Unpredictable("; ".join(refused))
    best, name = min(answers, key=lambda answer: answer[0].width())
    return Answer(name, best, tuple(refused))


def _capacitance_models() -> list[tuple[str, ModuleType]]:
    loaded = [(name, registry.load(models, name)) for name in registry.names(models)]
    return sorted(((n, m) for n, m in loaded if hasattr(m, "capacitance")), key=lambda pair: pair[1].COST)


def prediction(design: Design) -> dict[str, Any]:
    """Everything that is predicted of a design, as plain data for ``prediction.json`` (SI units).

    A scene that no model can speak of, as a short, or a material without a value has a reason in place of numbers.
    """
    taken: list[Taken] = []
    try:
        taken = _permittivities(design)
        answer = capacitance(design.in_use, {t.material: t.value for t in taken})
        tracks = [_track(design, end) for end in ("top", "bottom")]
    except (Unpredictable, MissingValue) as error:
        return {"capacitance_f": None, "reason": str(error), "values": [vars(t) for t in taken]}
    taken += [value for _, value in tracks]
    resistance = {end: ohm for end, (ohm, _) in zip(("top", "bottom"), tracks, strict=True)}
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    return {
        "model": {"capacitance": answer.model, "line": "line"},
        "refused": list(answer.refused),
        "capacitance_f": _bounds(answer.capacitance_f),
        "capacitance_per_area_f_per_m2": _bounds(answer.capacitance_f.times(1 / area)),
        "electrode_resistance_ohm": resistance,
        **_line(sum(resistance.values()), answer.capacitance_f),
        "values": [vars(t) for t in taken],
        "assumptions": [
            "ideal electrodes and no fringe at the sensor's edge for the capacitance",
            "electrode resistance of the plates alone: cogs can only lower it",
            "no dielectric loss and no leak: the sources give none",
            "unloaded, as drawn",
        ],
    }


def _line(resistance_ohm: float, capacitance_f: Interval) -> dict[str, Any]:
    """Corner frequency and impedance at the tones, for both bounds of the capacitance."""
    from sensorgen.models import line

    ends = (capacitance_f.lower, capacitance_f.middle(), capacitance_f.upper)
    corner = [line.corner_frequency_hz(resistance_ohm, c) for c in ends]
    admittance = [[2j * math.pi * f * c for c in ends] for f in TONES_HZ]
    rows = line.cascade([resistance_ohm], [admittance], [1.0])  # per the sensor's own length
    return {
        "corner_frequency_hz": {"lower": corner[2], "middle": corner[1], "upper": corner[0]},
        "impedance_ohm": [
            {
                "frequency_hz": f,
                "re": float(row[1].real),
                "im": float(row[1].imag),
                "re_range": [float(row.real.min()), float(row.real.max())],
                "im_range": [float(row.imag.min()), float(row.imag.max())],
            }
            for f, row in zip(TONES_HZ, rows, strict=True)
        ],
    }


def _bounds(interval: Interval) -> dict[str, float]:
    return {"lower": interval.lower, "middle": interval.middle(), "upper": interval.upper}


def _permittivities(design: Design) -> list[Taken]:
    """Relative permittivity of every dielectric in the sensor, and of air."""
    used = design.used() | {"air": ""}
    names = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return [_take(materials.load(name), "relative_permittivity", used[name]) for name in sorted(names)]


def _take(material: materials.Material, quantity: str, source: str) -> Taken:
    value = material.value(quantity, source)
    return Taken(material.name, quantity, value.value, value.source)


def _track(design: Design, end: str) -> tuple[float, Taken]:
    """Resistance of one electrode's plate from end to end, rho L / (H W) [ohm]."""
    material, source = design.slot(f"{end}_electrode")
    rho = _take(material, "resistivity_ohm_m", source)
    p = design.params
    return rho.value * p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM, rho
