"""Drawings, tables and figures of results, as a notebook shows them."""

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


@display.figure.register(Review)
def _(of: Review) -> "Figure":
    from sensorgen.analysis.plots import results, static

    return static.whole(results.findings(of))


@display.figure.register(Sweep)
def _(of: Sweep[Any]) -> "Figure":
    from sensorgen.analysis.plots import results, static

    return static.whole(results.sweep(of))


@display.figure.register(CompressionResult)
def _(of: CompressionResult) -> "Figure":
    from sensorgen.analysis.plots import results, static

    return static.whole(results.compression_figure(of))


@display.figure.register(Loaded)
def _(of: Loaded) -> "Figure":
    from sensorgen.analysis.plots import results, static

    z = of.impedance
    axes = (np.asarray(z.force_n), np.asarray(z.position_mm))
    return static.whole(results.lines(z.frequency_hz, *axes, z.impedance_ohm, of.prediction.design))


@display.figure.register(Prediction)
def _(of: Prediction) -> "Figure":
    from sensorgen.analysis.plots import results, static

    return static.whole(results.ranges(of))
