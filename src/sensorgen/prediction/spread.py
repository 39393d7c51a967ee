"""What the sources of a material value differ by."""

from sensorgen.design.design import Design
from sensorgen.design.materials import SET
from sensorgen.design.values import MaterialValue


def spread(design: Design, value: MaterialValue) -> tuple[float, float]:
    """Lowest and highest of a value and of what all sources give; a value that the user set is not doubted."""
    given = design.material(value.material).properties.get(value.quantity, [])
    plausible = [] if value.source == SET else [v.value for v in given if not v.implausible]
    return min([value.value, *plausible]), max([value.value, *plausible])
