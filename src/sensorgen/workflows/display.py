"""Drawings, tables and figures of results, as a notebook shows them."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.fit.estimates import Fit
from sensorgen.checks.review import Review
from sensorgen.core import display, document, findings
from sensorgen.design.design import Design
from sensorgen.prediction.calibration.calibration import Calibration
from sensorgen.prediction.calibration.inversion import InvertedPresses
from sensorgen.prediction.capacitance_answer import CellCapacitance
from sensorgen.prediction.compression import CompressionResult
from sensorgen.prediction.inverse.estimator import Estimates
from sensorgen.prediction.loaded import Loaded
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sweep import Sweep
from sensorgen.workflows.build import Built

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sensorgen.core.document import Part


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
    (CellCapacitance, "tried"), (Fit, "fitted"), (InvertedPresses, "presses"), (Estimates, "presses"),
):  # fmt: skip
    display.figure.register(_kind, partial(_figure, _name))


@display.figure.register(Loaded)
def _(of: Loaded) -> "Figure":
    from sensorgen.analysis.plots import results, static

    z = of.impedance
    axes = (np.asarray(z.force_n), np.asarray(z.position_mm))
    return static.whole(results.lines(z.frequency_hz, *axes, z.impedance_ohm, of.prediction.design))


@display.figure.register(Built)
def _(of: Built) -> "Figure":
    return _figure("ranges", of.prediction)


@display.parts.register(Comparison)
def _(of: Comparison) -> "tuple[Part, ...]":
    from sensorgen.analysis.report import alternating, electrodes, yields
    from sensorgen.core.document import Table

    ac = alternating.rows(of)
    tables = (electrodes.readings(of), yields.table(of)) if of.direct else ()
    words = (*electrodes.headline(of), *yields.headline(of), *alternating.headline(ac))
    return (*words, *tables, *Table.some("ac", "AC readings and their prediction", ac))


@display.figure.register(Comparison)
def _(of: Comparison) -> "Figure":
    from sensorgen.analysis.plots import static
    from sensorgen.analysis.report import electrodes

    return static.first(of, electrodes.figures(of))


@display.figure.register(Calibration)
def _(of: Calibration) -> "Figure":
    from sensorgen.analysis.calibration import page
    from sensorgen.analysis.plots import static

    return static.whole(page.learnt(of))
