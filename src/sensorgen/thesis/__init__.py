"""The thesis, reproduced: every numbered equation, table and figure with its value, ours, and a verdict."""

from sensorgen.thesis.markdown import markdown
from sensorgen.thesis.page import html
from sensorgen.thesis.plain import plain
from sensorgen.thesis.reproduced import Row, rows

__all__ = ["Row", "html", "markdown", "plain", "rows"]
