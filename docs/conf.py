"""Settings of the site: `make site` builds it from the Markdown of the repository, and fails on a broken link.

Sources are CONTRIBUTING, CHANGELOG, docs/ and bench/results/, so that links work here as in the repository.
Nothing is fetched when a page is read: equations are MathML, made while the site is built.
"""

import re
from pathlib import Path

from docutils.nodes import SkipNode
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

from sensorgen.core.version import __version__ as release

ROOT = Path(__file__).parents[1]

project = "sensorgen"
author = "The sensorgen developers"
version = release
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
root_doc = "docs/index"
include_patterns = ["CONTRIBUTING.md", "CHANGELOG.md", "docs/**.md", "bench/results/*.md"]
suppress_warnings = ["toc.empty_glob"]  # a page of a model that is not written yet
html_theme = "furo"
html_title = f"sensorgen {release}"
html_extra_path = ["site/index.html"]
html_static_path = ["site/site.css"]
html_css_files = ["site.css"]
html_show_copyright = False
html_copy_source = False
math_number_all = False
html_math_renderer = "mathml"
autodoc_typehints = "description"

REMOTE = re.compile(r"""(?:src|srcset)=["'](?:https?:)?//[^"']+|<link[^>]+href=["'](?:https?:)?//[^"']+""")


def inline(self, node):
    """Write an equation inside a line."""
    self.body.append(convert(node.astext()))
    raise SkipNode


def display(self, node):
    """Write an equation on a line of its own."""
    self.body.append(f'<div class="math">{convert(node.astext(), display="block")}</div>')
    raise SkipNode


def titled(_: Sphinx, docname: str, source: list[str]) -> None:
    """Put a title over a table that a program of bench/ wrote without one."""
    if docname.startswith("bench/") and not source[0].startswith("#"):
        source[0] = f"# {docname.rpartition('/')[2].replace('_', ' ').capitalize()}\n\n{source[0]}"


def offline(app: Sphinx, problem: Exception | None) -> None:
    """Refuse a site whose pages load anything from elsewhere."""
    for page in [] if problem or app.builder.format != "html" else sorted(Path(app.outdir).rglob("*.html")):
        if remote := REMOTE.search(page.read_text("utf-8")):
            raise ExtensionError(f"{page.name} loads {remote[0]}: keep a copy in the repository")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the equations and the last check."""
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(display, None))
    app.connect("source-read", titled)
    app.connect("build-finished", offline)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
