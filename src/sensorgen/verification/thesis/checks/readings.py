"""Readings of the multimeter: Table D.1 as the log keeps it."""

from sensorgen.measure.log import tables
from sensorgen.measure.signal.verdicts import Evidence, verdict
from sensorgen.verification.thesis.verdicts import Part

Printed = dict[str, list[float]]


def multimeter(rows: int, y_ohm: Printed, z_ohm: Printed) -> list[Part]:
    """Table D.1: how many rows, some of its readings; and in how many rows the film conducts as an electrode does."""
    found = tables.thesis()
    by_name = {reading.written: reading for reading in found}
    orders = [verdict(Evidence(r.written, r.y_ohm, r.z_ohm)).same_order for r in found]
    both = [order for order in orders if order is not None]
    return [
        Part("rows", "", len(found), rows),
        Part("rows with both readings, and those whose Z is of Y's order or less", "", [len(both), sum(both)]),
        *(Part(f"{name}, Y", "ohm", by_name[name].y_ohm, value) for name, value in y_ohm.items()),
        *(Part(f"{name}, Z", "ohm", by_name[name].z_ohm, value) for name, value in z_ohm.items()),
    ]
