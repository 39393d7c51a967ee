"""Drawings, tables and figures of results, as a notebook shows them."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.checks.review import Review
from sensorgen.core import display, document, findings
from sensorgen.design.design import Design
from sensorgen.prediction.compression import CompressionResult
from sensorgen.prediction.loaded import Loaded
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sweep import Sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@display.html.register(Review)
def _(of: Review) -> str:
    return document.html([findings.table(of.findings)])


@display.html.register(Design)
def _(design: Design) -> str:
    from sensorgen.checks.review import draw
    from sensorgen.prediction.slices import reviewed

    return draw(design, reviewed(design))


def _figure(name: str, of: Any) -> "Figure":
    """Figure of a result by a function of the plots."""
    from sensorgen.analysis.plots import results, static

    return static.whole(getattr(results, name)(of))


for _kind, _name in (
    (Review, "findings"), (Sweep, "sweep"), (CompressionResult, "compression_figure"), (Prediction, "ranges"),
):  # fmt: skip
    display.figure.register(_kind, partial(_figure, _name))


@display.figure.register(Loaded)
def _(of: Loaded) -> "Figure":
    from sensorgen.analysis.plots import results, static

    z = of.impedance
    axes = (np.asarray(z.force_n), np.asarray(z.position_mm))
    return static.whole(results.lines(z.frequency_hz, *axes, z.impedance_ohm, of.prediction.design))
