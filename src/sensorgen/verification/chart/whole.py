"""Whole predictions of a sensor, cell to line, against parts that are known from elsewhere."""

from dataclasses import replace

from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.prediction import bodies
from sensorgen.prediction.query import Query
from sensorgen.verification.chart import cells, presses
from sensorgen.verification.chart.design import composed, prediction
from sensorgen.verification.chart.question import Question, Reference

_FORCE_N = 5.0  # 50 kPa
_FILM = "0.1 mm"
STANDARD = {f"prediction of tri, {_FILM}": f"tri, {_FILM}"}


def question(name: str) -> Question:
    """Impedance of a sensor under a load, by predictions from rough to accurate [ohm]."""
    design = designs.make({"shape": "tri", "parameters": {"dielectric_mm": float(_FILM.removesuffix(" mm"))}})
    body, query = bodies.drawn(design), Query(force_n=_FORCE_N)
    cell, known = cells.STANDARD[STANDARD[name]](), presses.CELLS[_FILM]
    area_m2 = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    rise = known.rise_pf_per_m[known.stress_kpa.index(50)] / known.rest_pf_per_m
    best = {
        "capacitance": [Reference("another program", "", (cell.capacitance_f_per_m2 * area_m2,), cell.known_to)],
        "compression": [Reference("two other programs", "", (rise,), known.known_to[1])],
    }
    asked, references = "abs(Z) of a sensor under a load", tuple(composed(body, query, best))
    return replace(prediction(body, query), key=name, title=name, asked=asked, references=references)
