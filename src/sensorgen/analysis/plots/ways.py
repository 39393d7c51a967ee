"""Ways up and down of presses over the force, as PNG."""

from collections.abc import Mapping

from sensorgen.analysis.plots import panels
from sensorgen.analysis.plots.field import tone
from sensorgen.analysis.plots.libraries import needed
from sensorgen.measure.recording.samples import Real
from sensorgen.measure.signal.hysteresis import Hysteresis

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555555")


def ways(presses: Mapping[float, Hysteresis], tones_hz: Real, name: str) -> bytes:
    """R above X at the first and at the last tone, as changes since each press began; a colour for each press.

    Parameters
    ----------
    presses : mapping of float to Hysteresis
        By the begin of the press [s].
    tones_hz : (m,) array
        Tones [Hz]; columns of the presses are R of all of them, then X.
    name : str
        Of the recording.
    """
    needed("matplotlib")
    from matplotlib.figure import Figure

    count = len(tones_hz)
    ends = sorted({0, count - 1})
    figure = Figure(figsize=(1.0 + 3.6 * len(ends), 5.6), dpi=100, layout="constrained")
    shown = name.replace("$", r"\$")
    figure.suptitle(f"{shown}: up solid, down dashed, a colour for each press", fontsize="medium")
    grid = figure.subplots(2, len(ends), squeeze=False, sharex=True)
    for part, (row, symbol) in enumerate(zip(grid, "RX", strict=True)):
        for axes, k in zip(row, ends, strict=True):
            for j, press in enumerate(presses.values()):
                column, colour = k + part * count, _COLOURS[j % len(_COLOURS)]
                for values, style in ((press.up, "-"), (press.down, "--")):
                    change = values[:, column] - press.up[0, column]
                    axes.plot(press.force_n, change, style, color=colour, linewidth=1.0)
            axes.set_title(f"Δ{symbol} [Ω] at {tone(tones_hz[k])}", fontsize="medium")
    figure.supxlabel("force F [N]", fontsize="medium")
    return panels.png(figure)
