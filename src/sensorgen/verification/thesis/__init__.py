"""The thesis, reproduced: every numbered equation, table and figure with its value, ours, and a verdict."""

from sensorgen.verification.thesis.documents import html, markdown, plain
from sensorgen.verification.thesis.items import ReproducedItem, rows

__all__ = ["ReproducedItem", "html", "markdown", "plain", "rows"]
