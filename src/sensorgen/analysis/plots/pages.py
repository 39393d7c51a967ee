"""HTML pages that need nothing else: one head, style and script for all, and nothing is fetched.

A page is a title, sentences, and sections of figures, paragraphs, tables and drawings. Figures and Plotly's script are
inside, compressed; a browser unpacks them.
"""

import base64
import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from sensorgen.core import document
from sensorgen.core.document import Part, Table
from sensorgen.core.version import __version__

if TYPE_CHECKING:
    from jinja2 import Environment

    from sensorgen.analysis.plots.figure import Figure
    from sensorgen.scene.layers import Region

_OWN = "sensorgen.analysis.plots"
_COARSE_MM = 5e-3  # by which an outline may be moved to spare corners


@dataclass(frozen=True)
class Drawing:
    """A drawing on a page.

    Attributes
    ----------
    design, design_id : str
        Name and identity.
    svg : str
        The drawing itself.
    words : str
        Its caption.
    """

    design: str
    design_id: str
    svg: str
    words: str


@dataclass(frozen=True, eq=False)
class PageSection:
    """A part of a page.

    Attributes
    ----------
    key, title : str
        Anchor and heading; a section without a title has neither.
    figures, parts, drawings : tuple
        In the order in which they stand; parts are tables and paragraphs.
    """

    key: str = ""
    title: str = ""
    figures: "tuple[Figure, ...]" = ()
    parts: tuple[Part, ...] = ()
    drawings: tuple[Drawing, ...] = ()

    @property
    def tables(self) -> tuple[Table, ...]:
        """The tables among its parts."""
        return tuple(part for part in self.parts if isinstance(part, Table))

    @property
    def notes(self) -> tuple[str, ...]:
        """The paragraphs among its parts."""
        return tuple(part for part in self.parts if isinstance(part, str))


def page(
    title: str, words: Sequence[str], sections: Sequence[PageSection], *, headline: Sequence[str] = (),
    findings: Sequence[str] = (), made_at: str = "",
) -> str:  # fmt: skip
    """A page of sections.

    Parameters
    ----------
    title : str
        Heading of the page.
    words, headline, findings : sequence of str
        Paragraphs below it, sentences that decide, and further ones in a list.
    sections : sequence of PageSection
        With links to those that have a title.
    made_at : str
        For the foot of the page.

    Raises
    ------
    MissingValue
        Plotly is not installed, and there are figures.
    """
    from sensorgen.analysis.plots.figure import needed
    from sensorgen.analysis.plots.interactive import data, height_px

    figures = [figure for section in sections for figure in section.figures]
    sheets = {drawing.design: drawing.svg for section in sections for drawing in section.drawings}
    if figures:
        needed("plotly")
    return render(
        _OWN, "page.html", title=title, words=words, sections=sections, headline=headline, findings=findings,
        made_at=made_at, height_px=height_px, plotly=_plotly() if figures else "",
        content=packed_json({"figures": [data(figure) for figure in figures], "drawings": sheets}),
    )  # fmt: skip


def render(package: str, name: str, **context: Any) -> str:
    """A page from a template that extends ``base.html``; whatever text stands in it is escaped.

    Parameters
    ----------
    package : str
        In whose folder ``templates`` it is.
    name : str
        Of the template.
    **context
        What the template shows.
    """
    return _environment(package).get_template(name).render(context) + "\n"


def packed(content: bytes) -> str:
    """Content for a page's script to unpack: gzip in base64, the same for the same content."""
    return encoded(gzip.compress(content, 6, mtime=0))


def packed_json(content: Any) -> str:
    """Data for a page's script to unpack."""
    return packed(json.dumps(content, allow_nan=False, separators=(",", ":")).encode())


def encoded(content: bytes) -> str:
    """Content in base64."""
    return base64.b64encode(content).decode()


def path(region: "Region", height_mm: float) -> str:
    """A region as the data of an SVG path, y upwards from the bottom of the picture [mm]."""
    import shapely

    from sensorgen.scene.drawing.paper import ViewFrame
    from sensorgen.scene.layers import parts

    frame, pieces = ViewFrame(0.0, height_mm, 0.0, 0.0, 1.0, 1.0), parts(shapely.simplify(region, _COARSE_MM))
    rings = (ring for part in pieces for ring in (part.exterior, *part.interiors))
    return "".join(frame.outline(shapely.get_coordinates(ring)[:-1].tolist()) for ring in rings)


@cache
def _environment(package: str) -> "Environment":
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    def inline(name: str, of: str = _OWN) -> Markup:
        """A style or a script of ours."""
        return Markup((resources.files(of) / "templates" / name).read_text("utf-8"))  # noqa: S704 - our own file

    def parts(content: Sequence[Part]) -> Markup:
        """Paragraphs and tables, whose text is escaped as they are written."""
        return Markup(document.html(content))  # noqa: S704 - escaped there

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader(_OWN)]), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.globals |= {"inline": inline, "parts": parts, "encoded": encoded, "version": __version__, "zip": zip}
    return environment


@cache
def _plotly() -> str:
    from plotly.offline import get_plotlyjs

    return packed(get_plotlyjs().encode())
