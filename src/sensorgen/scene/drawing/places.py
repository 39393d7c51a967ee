"""Places of a scene's faults: three views of triangle meshes, their sharp edges drawn, places in circles."""

from collections.abc import Mapping, Sequence

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.scene.drawing.paper import ESCAPES, element, number
from sensorgen.scene.geometry.meshes import Mesh

_VIEWS = (("from above", 0, 1), ("from the front", 0, 2), ("from the right", 1, 2))
_SIDE, _MARGIN, _LINE = 120.0, 8.0, 5.0  # of the larger side of a view, around views, of text [mm]
_MOST = 20_000  # edges of a view
_SHARP = 0.9  # cosine between faces below which their edge is drawn
_STYLE = (
    ".e{stroke:#606870;stroke-width:.15;fill:none}.p{stroke:#c02020;stroke-width:.5;fill:none}"
    "text{font:3px sans-serif}.p+text{fill:#c02020}"
)


def svg(meshes: Mapping[str, Mesh], places: Sequence[tuple[tuple[float, float, float], str]]) -> str:
    """A page with views from above, the front and the right, as SVG.

    Parameters
    ----------
    meshes : mapping of str to Mesh
        Bodies by name, closed or not.
    places : sequence of (place, text)
        Where circles are drawn [mm], and what the list below the views says of each.
    """
    edges = [mesh.vertices_mm[mesh.sharp_edges(_SHARP)] for mesh in meshes.values()]
    lines = np.concatenate([*edges, np.zeros((0, 2, 3))])
    low, high = (lines.reshape(-1, 3).min(0), lines.reshape(-1, 3).max(0)) if len(lines) else (np.zeros(3), np.ones(3))
    scale = _SIDE / max(float((high - low).max()), 1e-9)
    down, parts = _MARGIN, []
    for title, across, up in _VIEWS:
        down += _LINE
        parts.append(element("text", inside=title, x=_MARGIN, y=down - 1.5))
        corner = np.array([low[across], high[up]])

        def on_page(
            points: Real, axes: tuple[int, int] = (across, up), corner: Real = corner, down: float = down
        ) -> Real:
            return np.asarray((points[..., axes] - corner) * [scale, -scale] + [_MARGIN, down])

        drawn = np.unique(on_page(lines).round(2).reshape(-1, 4), axis=0)[:_MOST]
        path = "".join(f"M{number(a)} {number(b)}L{number(c)} {number(d)}" for a, b, c, d in drawn.tolist())
        parts.append(element("path", "e", d=path))
        for k, (place, _) in enumerate(places, 1):
            x, y = on_page(np.array(place)).tolist()
            parts += [element("circle", "p", cx=x, cy=y, r=2.5), element("text", inside=str(k), x=x + 3, y=y - 1)]
        down += float((high - low)[up]) * scale + _MARGIN
    for k, (place, text) in enumerate(places, 1):
        at = ", ".join(f"{axis} {value:.6g}" for axis, value in zip("xyz", place, strict=True))
        parts.append(element("text", inside=f"{k}: {text.translate(ESCAPES)} ({at} mm)", x=_MARGIN, y=down))
        down += _LINE
    wide = _SIDE + 2 * _MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{number(wide)}mm" height="{number(down)}mm" '
        f'viewBox="0 0 {number(wide)} {number(down)}"><style>{_STYLE}</style>{"".join(parts)}</svg>\n'
    )
