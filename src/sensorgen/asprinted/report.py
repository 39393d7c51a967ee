"""A design as drawn and as printed, as plain data."""

from collections.abc import Sequence
from typing import Any

from sensorgen.asprinted import compared
from sensorgen.asprinted.compared import ACCURACY, CONTACTS_OHM_M2, Printed, cell, gap_mm
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities
from sensorgen.prediction import capacitance as planner


def report(
    design: Design,
    printed: Printed,
    accuracy: float = ACCURACY,
    contacts_ohm_m2: Sequence[float] = CONTACTS_OHM_M2,
) -> dict[str, Any]:
    """Electrode gap, capacitance and electrode resistance of both, and rule 7.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Printed
        What is printed of it.
    accuracy : float
        How wide the bounds of a capacitance may be, relative to their middle [-].
    contacts_ohm_m2 : sequence of float
        Contact resistivities between lines for which resistances are told [ohm m2].

    Returns
    -------
    dict
        Lengths in mm, all else in SI units; a capacitance that no model can speak of has its reason in its place.
    """
    return {
        "design": design.name,
        "design_id": design.id(),
        "source": printed.source,
        "estimate": printed.lines is None,
        "electrode_gap_mm": {"drawn": compared.drawn_gap_mm(design), "printed": _gaps_mm(design, printed)},
        "capacitance_f": {"drawn": _drawn_f(design, accuracy), **_printed_f(design, printed, accuracy)},
        "electrode_resistance_ohm": _resistance(design, printed, contacts_ohm_m2),
        "contact_ohm_m2": list(contacts_ohm_m2),
        "layers": [row.as_dict() for row in printed.rows(design)],
        "findings": [f.as_dict() for f in printed.findings(design)],
    }


def _gaps_mm(design: Design, printed: Printed) -> list[float]:
    """Smallest and largest of the conventions."""
    found = [gap_mm(cell(design, layers)[0]) for layers in printed.layers.values()]
    return [min(found), max(found)]


def _drawn_f(design: Design, accuracy: float) -> dict[str, float] | str:
    permittivity = {t.material: t.value for t in permittivities(design)}
    try:
        return _bounds(planner.capacitance(design.in_use, permittivity, accuracy).capacitance_f)
    except planner.Unpredictable as error:
        return str(error)


def _printed_f(design: Design, printed: Printed, accuracy: float) -> dict[str, Any]:
    found = compared.capacitance_f(design, printed, accuracy)
    known = [c for c in found.values() if isinstance(c, Interval)]
    span = _bounds(Interval(min(c.lower for c in known), max(c.upper for c in known))) if known else None
    by = {name: _bounds(c) if isinstance(c, Interval) else c for name, c in found.items()}
    return {"printed": span, "by_width": by}


def _resistance(design: Design, printed: Printed, contacts_ohm_m2: Sequence[float]) -> dict[str, Any]:
    try:
        solid = {end: ohm for end, (ohm, _) in compared.solid_ohm(design).items()}
        return {"drawn": solid, "printed": compared.resistance_ohm(design, printed, contacts_ohm_m2)}
    except SensorgenError as error:
        return {"drawn": None, "printed": None, "reason": str(error)}


def _bounds(interval: Interval) -> dict[str, float]:
    return {"lower": interval.lower, "middle": interval.middle(), "upper": interval.upper}
