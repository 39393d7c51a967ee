"""What is really printed, as outlines over the drawn section."""

from collections.abc import Iterator

from sensorgen.scene.drawing.panels import Panel
from sensorgen.scene.drawing.paper import element
from sensorgen.scene.scene import Scene, clipped


def over(panel: Panel, printed: Scene) -> Iterator[str]:
    """Outlines of the printed bodies where a view cuts them, one path for each body."""
    view = panel.view
    for body in printed.bodies:
        seen = (outline for p in body.prisms for outline in p.cut(view.normal, view.section.at_mm))
        path = "".join(panel.frame.outline(part) for o in seen if (part := clipped(o, view.end_mm)))
        if path:
            yield element("path", "halo-line", "", d=path) + element("path", "printed", "", d=path, data_body=body.name)
