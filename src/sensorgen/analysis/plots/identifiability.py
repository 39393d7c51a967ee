"""Identifiability as a figure: standard errors over force and position, and what each frequency alone would give."""

from collections.abc import Sequence

import numpy as np

from sensorgen.analysis.plots.figure import BLUE, GREY, ORANGE, Axis, Curve, Figure, Map, Panel
from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability.fisher import LeastErrors, Setup, bounds, required, slopes
from sensorgen.prediction.identifiability.identify import HIGHEST_HZ, surface
from sensorgen.prediction.query import FORCE_N, NOISE

FORCES, POSITIONS, FREQUENCIES = 60, 161, 121
HZ_PER_KHZ = 1e3


def figure(
    sensor: Sensor, frequency_hz: Sequence[float], noise: float = NOISE, force_n: float = FORCE_N, title: str = ""
) -> Figure:
    """Maps of the standard errors of force and position, and both for a single frequency.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz : sequence of float
        Frequencies [Hz].
    noise : float
        As of :func:`sensorgen.prediction.identifiability.card` [-].
    force_n : float
        Greatest load [N].
    title : str
        Name of the sensor.
    """
    setup = Setup(sensor, tuple(frequency_hz), noise, force_n, sensor.length_m / 2, max(HIGHEST_HZ, *frequency_hz))
    force, place = np.linspace(force_n / FORCES, force_n, FORCES), np.linspace(0.0, sensor.length_m, POSITIONS)
    limits, need = surface(setup, force, place), required(setup)
    panels = (
        _map("force", "N", place, force, limits.force_n, need.force_n),
        _map("position", "mm", place, force, limits.position_m / M_PER_MM, need.position_m / M_PER_MM),
        *_by_frequency(setup),
    )
    words = f"{title}{', ' if title else ''}{len(setup.frequency_hz)} frequencies, noise {noise * 100:g} %"
    alt = (
        "Standard errors of force and position over force and position (Cramér-Rao), and below them the error that one "
        "frequency alone would give. Solid line: the required error; dashed: ten times that."
    )
    return Figure("identifiability", f"Can it sense force and position? {words}", alt, {"": panels}, columns=2)


def _map(quantity: str, unit: str, place: Real, force: Real, sigma: Real, need: float) -> Panel:
    """Standard error on a logarithmic scale about the required one."""
    drawn = Map(place / M_PER_MM, force, sigma, f"standard error of {quantity} [{unit}]", need / 10, need * 1e3,
                log=True, levels=(need, 10 * need))  # fmt: skip
    x, y = Axis("position, centre of the tip [mm]"), Axis("force [N]")
    return Panel((drawn,), x, y, title=f"error of {quantity} (solid line: {need:g} {unit}, as required)")


def _by_frequency(setup: Setup) -> tuple[Panel, Panel]:
    """Standard errors that one frequency alone would give, those in use marked."""
    grid = np.geomspace(min(setup.frequency_hz), setup.highest_hz, FREQUENCIES)
    used = np.array(setup.frequency_hz)
    swept, marked = _single(setup, grid), _single(setup, used)
    corner = setup.sensor.corner_frequency_hz() / HZ_PER_KHZ if setup.sensor.resistance_ohm() else 0.0
    panels = []
    for quantity, unit, colour, pick in (("force", "N", BLUE, "force_n"), ("position", "mm", ORANGE, "position_m")):
        per = M_PER_MM if unit == "mm" else 1.0
        line, dots = getattr(swept, pick) / per, getattr(marked, pick) / per
        finite = line[np.isfinite(line) & (line > 0)]
        low, high = (finite.min() / 3, finite.max() * 3) if len(finite) else (1e-3, 1.0)  # a flat curve looks flat
        content = [
            Curve("line", "", grid / HZ_PER_KHZ, line, colour=colour),
            Curve("points", "", used / HZ_PER_KHZ, dots, colour=colour),
        ]
        if corner:
            content.append(Curve("line", "corner frequency", [corner, corner], [low, high], colour=GREY, dash="dot"))
        y = Axis(f"standard error of {quantity} [{unit}]", log=True, low=float(low), high=float(high))
        words = f"one frequency alone, {setup.force_n:g} N in the middle"
        panels.append(Panel(tuple(content), Axis("frequency [kHz]", log=True), y, title=words))
    return panels[0], panels[1]


def _single(setup: Setup, frequency_hz: Real) -> LeastErrors:
    by_press = slopes(setup.sensor, frequency_hz, setup.force_n, setup.position_m)
    return bounds(type(by_press)(*(slope[:, None] for slope in by_press)), setup.noise)
