"""Pictures of a calibration: presses found again, what was learnt of each parameter, and what is left over."""

from collections.abc import Sequence

import numpy as np

from sensorgen.analysis.calibration import CalibrationWork, Recheck
from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import BLUE, COLOURS, GREY, ORANGE, Axis, Curve, Figure, Panel
from sensorgen.core import document
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.calibration.calibration import Calibration, inside
from sensorgen.prediction.calibration.inversion import LEVEL
from sensorgen.prediction.inference import NORMAL_90

_RESIDUALS = ("residual of the magnitude [%]", "residual of the phase [0.01 rad]")  # measured less fitted


def html(works: Sequence[CalibrationWork | Recheck]) -> str:
    """A page for the browser; raises MissingValue where Plotly is not installed."""
    sections = []
    for number, one in enumerate(works):
        fit = (*_presses(one, number), *_left_over(one, number)) if isinstance(one, CalibrationWork) else ()
        figures, specimen = (*fit, learnt(one.calibration, number)), document.visible(one.calibration.specimen)
        sections.append(pages.PageSection(f"specimen-{number}", specimen, figures, tuple(one.document())))
    return pages.page(f"Calibration of {', '.join(section.title for section in sections)}", (), sections)


def _presses(work: CalibrationWork, number: int) -> list[Figure]:
    """Force and position of known presses against what was found of them without them."""
    if work.held is None:
        return []
    known, inverted = work.data.presses, work.held
    panels = []
    force, place = inside(inverted, known)
    for truth, middle, ends, within, words in (
        (known.force_n, inverted.force_n, inverted.force_90_n, force, "force [N]"),
        (known.position_m / M_PER_MM, inverted.position_m / M_PER_MM, inverted.position_90_m / M_PER_MM, place,
         "position [mm]"),
    ):  # fmt: skip
        most = float(max(truth.max(), ends.max()))
        content = [Curve("line", "true", [0, most], [0, most], colour=GREY, dash="dash")]
        for name, rows, colour in ((f"in the {LEVEL:.0%} interval", within, BLUE), ("outside", ~within, ORANGE)):
            if rows.any():
                content.append(Curve(
                    "points", name, middle[rows], truth[rows], low=ends[rows, 0], high=ends[rows, 1], colour=colour
                ))  # fmt: skip
        panels.append(Panel(tuple(content), Axis(f"found {words}"), Axis(f"known {words}")))
    title = f"{work.calibration.specimen}: each press found again from the others"
    alt = "Force and position that were found, with their intervals, against those that are known."
    return [Figure(f"presses-{number}", title, alt, {"": tuple(panels)}, columns=2)]


def _left_over(work: CalibrationWork, number: int) -> list[Figure]:
    """Residuals of the ratios of presses at each tone over force, and of the reading at rest over frequency."""
    model, data = work.calibration.model, work.data
    specimen, at = work.calibration.specimen, work.calibration.posterior.at
    khz = model.frequency_hz / 1e3
    rest = 100 * (data.rest - model.rest(at))
    panels = tuple(
        Panel((Curve("points", "", khz, values, colour=BLUE),), Axis("frequency [kHz]", log=True), Axis(words))
        for words, values in zip(_RESIDUALS, (rest.real, rest.imag), strict=True)
    )
    alt = "Residuals of the reading at rest over frequency: of its magnitude and of its phase."
    figures = [Figure(f"rest-{number}", f"{specimen}: residuals at rest", alt, {"": panels}, columns=2)]
    if len(data.presses.force_n):
        left = 100 * (data.ratio - model.ratio(at, data.presses))
        panels = tuple(
            Panel(
                tuple(
                    Curve("points", f"{f:g} kHz", data.presses.force_n, values[:, k], colour=COLOURS[k % len(COLOURS)])
                    for k, f in enumerate(khz.tolist())
                ),
                Axis("force [N]"), Axis(words),
            )
            for words, values in zip(_RESIDUALS, (left.real, left.imag), strict=True)
        )  # fmt: skip
        alt = "Residuals of the ratio of pressed over rest, over force: of its magnitude and of its phase."
        figures.append(Figure(f"residuals-{number}", f"{specimen}: residuals under load", alt, {"": panels}, columns=2))
    return figures


def learnt(calibration: Calibration, number: int = 0) -> Figure:
    """Posterior of every parameter beside its prior, in standard deviations of the prior."""
    p, names = calibration.posterior, calibration.model.names
    sd = np.sqrt(np.diag(p.covariance))
    before = np.full(len(names), NORMAL_90)
    content = (
        Curve("ranges", "before", np.zeros(len(names)), names, low=-before, high=before, colour=GREY),
        Curve("ranges", "after", p.at, names, low=p.at - NORMAL_90 * sd, high=p.at + NORMAL_90 * sd, colour=BLUE),
    )
    alt = "Ranges of 90 % of each parameter before and after calibration, in standard deviations before."
    panel = Panel(content, Axis("standard deviations of what was known before"), Axis(names=tuple(names)))
    return Figure(f"parameters-{number}", f"{calibration.specimen}: what was learnt", alt, {"": (panel,)})
