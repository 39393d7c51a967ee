"""HTML pages that need nothing else: styles, scripts and figures are inside, and nothing is fetched."""

from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from sensorgen.core.version import __version__

if TYPE_CHECKING:
    from jinja2 import Environment

    from sensorgen.analysis.plots.figure import Figure

_OWN = "sensorgen.analysis.plots"


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
