"""What a sensor answers to presses, in pictures: maps of R and X, their sensitivities, and the way back (PNG, HTML)."""

from collections.abc import Iterator, Sequence

from sensorgen.analysis.plots.field import QUANTITIES, field
from sensorgen.models.sensor import Sensor

PAGE = "predict.html"
CARD = "identifiability.png"
STEPS = (*(f"{name}.png" for name in QUANTITIES), "inverse-position.png", "inverse-force.png", CARD, PAGE)


def files(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> Iterator[tuple[str, bytes]]:
    """All pictures of a sensor, by file name, in the order of ``STEPS``.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz, force_n, position_mm : sequence of float
        Tones [Hz], forces [N] and centres of the tip [mm], each rising; at least two forces and two positions.

    Raises
    ------
    OutOfRange
        As :func:`sensorgen.analysis.plots.field.field`.
    MissingValue
        Matplotlib or Plotly is not installed.
    """
    from sensorgen.analysis.plots import card, inverse, maps, page, panels
    from sensorgen.analysis.plots.libraries import needed

    needed("matplotlib", "plotly")
    answer = field(sensor, frequency_hz, force_n, position_mm)
    for name in QUANTITIES:
        yield f"{name}.png", maps.png(answer, name)
    yield "inverse-position.png", inverse.png(answer, "position")
    yield "inverse-force.png", inverse.png(answer, "force")
    yield CARD, panels.png(card.figure(sensor, frequency_hz, force_n=force_n[-1]))
    yield PAGE, page.html(answer).encode()
