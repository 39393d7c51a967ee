"""HTML pages that need nothing else: styles, scripts and figures are inside, and nothing is fetched."""

from collections.abc import Iterator, Sequence
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from sensorgen.core.version import __version__

if TYPE_CHECKING:
    from jinja2 import Environment

    from sensorgen.analysis.plots.figure import Figure
    from sensorgen.scene.layers import Region

_OWN = "sensorgen.analysis.plots"
_COARSE_MM = 5e-3  # by which an outline may be moved to spare corners


def render(package: str, name: str, figures: "Sequence[Figure]" = (), **context: Any) -> str:
    """A page from a template that extends ``base.html``; whatever text stands in it is escaped.

    Parameters
    ----------
    package : str
        In whose folder ``templates`` it is.
    name : str
        Of the template.
    figures : sequence of Figure
        Drawn by the page's script, where the template places them.
    **context
        What the template shows.

    Raises
    ------
    MissingValue
        Plotly is not installed, and there are figures.
    """
    drawn: dict[str, Any] = {"figures": figures, "data": [], "plotly": None}
    if figures:
        from sensorgen.analysis.plots.interactive import data, height_px
        from sensorgen.analysis.plots.libraries import needed

        needed("plotly")
        drawn |= {"data": [data(figure) for figure in figures], "plotly": _plotly, "height_px": height_px}
    return _environment(package).get_template(name).render(drawn | context) + "\n"


def page(title: str, words: Sequence[str], figures: "Sequence[Figure]") -> str:
    """A page of figures under a title and paragraphs of text."""
    return render(_OWN, "page.html", figures, title=title, words=words)


def path(region: "Region", height_mm: float) -> str:
    """A region as the data of an SVG path, y upwards from the bottom of the picture [mm]."""
    import shapely

    return "".join(_rings(shapely.simplify(region, _COARSE_MM), height_mm))


def _rings(region: "Region", height_mm: float) -> Iterator[str]:
    import numpy as np
    import shapely

    from sensorgen.scene.layers import parts

    for part in parts(region):
        for ring in (part.exterior, *part.interiors):
            corners = np.round(shapely.get_coordinates(ring)[:-1], 3)
            yield "M" + "L".join(f"{x:g} {round(height_mm - y, 3):g}" for x, y in corners.tolist()) + "Z"


@cache
def _environment(package: str) -> "Environment":
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    def inline(name: str, of: str = _OWN) -> Markup:
        """A style or a script of ours."""
        return Markup((resources.files(of) / "templates" / name).read_text("utf-8"))  # noqa: S704 - our own file

    made = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader(_OWN)]), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    made.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    made.globals |= {"inline": inline, "version": __version__, "zip": zip}
    return made


@cache
def _plotly() -> Any:
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    return Markup(get_plotlyjs())  # noqa: S704 - the library's own script
