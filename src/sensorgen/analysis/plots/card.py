"""A picture of the identifiability card: bounds over force and position, and which tones tell what."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import FORCE_N, HIGHEST_HZ, NOISE, surface
from sensorgen.prediction.identifiability.fisher import Bounds, Real, Setup, bounds, slopes
from sensorgen.prediction.identifiability.verdict import required

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORCES, POSITIONS, TONES = 60, 161, 121
KHZ, MM = 1e3, 1e-3
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "0.45"


def figure(
    sensor: Sensor,
    frequency_hz: Sequence[float],
    noise: float = NOISE,
    force_n: float = FORCE_N,
    title: str = "",
) -> "Figure":
    """Three panels: standard error of force, that of position, and both for a single tone over its frequency.

    Parameters
    ----------
    sensor : Sensor
        What is pressed.
    frequency_hz : sequence of float
        Tones [Hz].
    noise : float
        As of :func:`sensorgen.prediction.identifiability.identify` [-].
    force_n : float
        Greatest press [N].
    title : str
        What the sensor is.
    """
    from matplotlib.figure import Figure

    highest = max(HIGHEST_HZ, *frequency_hz)
    setup = Setup(sensor, tuple(frequency_hz), noise, force_n, sensor.length_m / 2, highest)
    drawn = Figure(figsize=(13, 4), layout="constrained")
    left, middle, right = drawn.subplots(1, 3)
    force, place = np.linspace(force_n / FORCES, force_n, FORCES), np.linspace(0.0, sensor.length_m, POSITIONS)
    limits, need = surface(setup, force, place), required(setup)
    _map(left, force, place / MM, limits.force_n, need.force_n, "force", "N")
    _map(middle, force, place / MM, limits.position_m / MM, need.position_m / MM, "position", "mm")
    _tones(right, setup)
    drawn.suptitle(f"{title}{', ' if title else ''}{len(setup.frequency_hz)} tones, noise {noise * 100:g} %")
    return drawn


def _map(axes: "Axes", force: Real, place: Real, sigma: Real, serves: float, quantity: str, unit: str) -> None:
    """Colours on a logarithmic scale about what serves; a line where an error just serves, dashed at ten times that."""
    from matplotlib.colors import LogNorm

    drawn = axes.pcolormesh(
        place, force, sigma, norm=LogNorm(serves / 10, serves * 1e3), cmap="viridis_r", shading="nearest",
        rasterized=True,
    )  # fmt: skip
    bar = axes.figure.colorbar(drawn, ax=axes, extend="both", format="{x:g}", label=f"standard error [{unit}]")
    for level, style in ((serves, "solid"), (10 * serves, "dashed")):
        bar.ax.axhline(level, color="white", linestyle=style)
        if (sigma < level).any() and (sigma > level).any():
            axes.contour(place, force, sigma, levels=[level], colors="white", linestyles=style)
    axes.set(
        xlabel="position, centre of the tip [mm]",
        ylabel="force [N]",
        title=f"{quantity} (solid line: {serves:g} {unit}, as required)",
    )
    axes.set_facecolor("0.85")  # where it is undefined


def _tones(axes: "Axes", setup: Setup) -> None:
    """What one tone alone would tell of a press, the tones that are used marked."""
    grid = np.geomspace(min(setup.frequency_hz), setup.highest_hz, TONES)
    right: Any = axes.twinx()
    for f, style in ((grid, "-"), (np.array(setup.frequency_hz), "o")):
        found = _single(setup, f)
        axes.loglog(f / KHZ, found.force_n, style, color=BLUE)
        right.loglog(f / KHZ, found.position_m / MM, style, color=ORANGE)
    if setup.sensor.resistance_ohm():
        corner = setup.sensor.corner_frequency_hz() / KHZ
        axes.axvline(corner, color=GREY, linestyle=":")
        axes.annotate("corner ", (corner, 0.02), xycoords=("data", "axes fraction"), ha="right", color=GREY, fontsize=9)
    low, high = axes.get_ylim()
    axes.set_ylim(low / 5, high * 5)  # a decade at least: a flat curve is to look flat
    axes.set(xlabel="frequency [kHz]", title=f"one tone alone, {setup.force_n:g} N in the middle")
    axes.set_ylabel("standard error of force [N]", color=BLUE)
    right.set_ylabel("standard error of position [mm]", color=ORANGE)
    for axis in (axes.xaxis, axes.yaxis, right.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("")
    axes.grid(visible=True, alpha=0.3)


def _single(setup: Setup, frequency_hz: Real) -> Bounds:
    found = slopes(setup.sensor, frequency_hz, setup.force_n, setup.position_m)
    return bounds(type(found)(*(slope[:, None] for slope in found)), setup.noise)
