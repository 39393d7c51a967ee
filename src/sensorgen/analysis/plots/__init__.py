"""Figures: described once as data, drawn as pictures or on a page for the browser."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sensorgen.models.sensor import Sensor


PAGE, IDENTIFIABILITY = "predict.html", "identifiability.png"
STEPS = (
    IDENTIFIABILITY, "resistance.png", "reactance.png", "resistance-by-position.png", "resistance-by-force.png",
    "reactance-by-position.png", "reactance-by-force.png", "inverse-position.png", "inverse-force.png", PAGE,
)  # fmt: skip


def files(
    sensor: "Sensor", frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float],
    title: str = "",
) -> Iterator[tuple[str, bytes]]:  # fmt: skip
    """All pictures of a sensor under load, by file name, in the order of ``STEPS``.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz, force_n, position_mm : sequence of float
        Frequencies [Hz], forces [N] and centres of the tip [mm], each rising; at least two forces and two positions.
    title : str
        Name of the design.

    Raises
    ------
    OutOfRange
        As :func:`sensorgen.analysis.plots.results.response`.
    MissingValue
        Matplotlib or Plotly is not installed.
    """
    from sensorgen.analysis.plots import pages, results, static
    from sensorgen.analysis.plots.figure import needed
    from sensorgen.core.units import M_PER_MM

    needed("matplotlib", "plotly")
    answer = results.response(sensor, frequency_hz, force_n, position_mm)
    first = results.identifiability_figure(sensor, frequency_hz, force_n=force_n[-1], title=title)
    drawn = [first, *results.figures(answer)]
    for figure in drawn:
        yield f"{figure.key}.png", static.png(figure)
    words = (
        f"{len(frequency_hz)} frequencies, {force_n[0]:g} to {force_n[-1]:g} N, "
        f"{position_mm[0]:g} to {position_mm[-1]:g} mm, tip {sensor.tip_m / M_PER_MM:g} mm."
    )
    sections = [pages.PageSection(figures=tuple(drawn))]
    yield PAGE, pages.page(f"{title or 'Sensor'} under load", [words], sections).encode()
