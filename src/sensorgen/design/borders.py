"""The border of a design: an outline in plan, read from its file when the design is, and part of its identity.

A design holds it as text (``POLYGON ((0 0, 60 0, ...))`` in mm), so that records of the design need no other file.
"""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    import shapely

    from sensorgen.scene.scene import Scene

_START = "POLYGON"
_SAME_MM = 1e-3


def with_border(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's data with the content of its border's file in place of the name, and the border's length and width.

    Raises
    ------
    BadInput
        As :func:`sensorgen.scene.geometry.outline_files.read`; a length or width beside the border that is not its
        own; a border of an imported sensor.
    """
    given = data.get("border")
    if not isinstance(given, str):
        return data
    if data.get("geometry"):
        raise BadInput("border: an imported sensor has its own; cut it in CAD")
    from sensorgen.design import feet

    if given.startswith(_START):
        text = given
    elif (corners := feet.outline(given)) is not None:
        import shapely

        text = str(shapely.Polygon(corners).wkt)
        if data.get("shape") == "array":
            data = {"regions": feet.regions(given), **data}  # of its foot, where it has no others
    else:
        from sensorgen.scene.geometry import outline_files

        text = str(outline_files.read(folder / given).wkt)
    _, _, length, width = region(text).bounds
    parameters = data.get("parameters", {})
    if not isinstance(parameters, Mapping):
        return data
    for key, value in (("length_mm", length), ("width_mm", width)):
        own = parameters.get(key, value)
        if not isinstance(own, float | int) or abs(own - value) > _SAME_MM:
            raise BadInput(f"parameters.{key} is {own}, but the border is {value:g} mm; leave one of them out")
    return {**data, "border": text, "parameters": {**parameters, "length_mm": length, "width_mm": width}}


@lru_cache(maxsize=8)
def region(text: str) -> "shapely.Polygon":
    """The border of a design [mm]; raises BadInput where its text is none."""
    import shapely

    try:
        polygon = shapely.from_wkt(text)
    except shapely.errors.GEOSException as error:
        raise BadInput(f"border: {error}") from None
    if isinstance(polygon, shapely.Polygon) and not polygon.is_valid:
        raise BadInput(f"border: the outline crosses itself: {shapely.is_valid_reason(polygon)} mm; draw it anew there")
    if not (isinstance(polygon, shapely.Polygon) and polygon.area > 0):
        raise BadInput("border: expected an SVG or DXF file, a foot as 'foot 42 left', or one POLYGON around an area")
    if polygon.bounds[:2] != (0.0, 0.0):
        raise BadInput(
            f"border: it begins at {polygon.bounds[0]:g}, {polygon.bounds[1]:g} mm; expected its corner at 0, 0"
        )
    return polygon


def cut(scene: "Scene", text: str) -> "Scene":
    """A scene inside a border."""
    from sensorgen.scene import border

    return border.cut(scene, region(text))
