"""What the sources of a material value differ by."""

from sensorgen.design.design import Design
from sensorgen.design.materials import SET
from sensorgen.design.values import MaterialValue


def spread(design: Design, value: MaterialValue) -> tuple[float, float]:
    """Lowest and highest of a value: its source's own interval, else what all sources give.

    A value that the user set is not doubted. One with an interval, as from coupons or a fit, is as uncertain as that:
    what other sources say of other spools does not count.
    """
    given = design.material(value.material).properties.get(value.quantity, [])
    plausible = [] if value.source == SET else [v.value for v in given if not v.implausible]
    for own in given:
        if own.source == value.source and own.low is not None and own.high is not None:
            plausible = [own.low, own.high]
    return min([value.value, *plausible]), max([value.value, *plausible])
