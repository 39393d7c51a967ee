"""Maps of how well a press is located on a sheet."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sensorgen.plots import panels
from sensorgen.plots.library import needed

if TYPE_CHECKING:
    from sensorgen.models.sheet import Bounds, Port, Sheet

_MM = 1e3


def png(film: "Sheet", bounds: Mapping[str, "Bounds"], ports: Mapping[str, Sequence["Port"]]) -> bytes:
    """Standard errors of x and y over the sheet, one column per set of contacts, on one logarithmic scale.

    Parameters
    ----------
    film : Sheet
        What is pressed.
    bounds : mapping of str to Bounds
        By the name of the set of contacts.
    ports : mapping of str to sequence of Port
        The contacts of each set.

    Raises
    ------
    MissingValue
        Matplotlib is not installed.
    """
    needed("matplotlib")
    return panels.png(_figure(film, bounds, ports))


def _figure(film: "Sheet", bounds: Mapping[str, "Bounds"], ports: Mapping[str, Sequence["Port"]]) -> Any:
    import numpy as np
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    guess = next(iter(bounds.values())).guess_m[0] * _MM
    norm = LogNorm(guess / 30, guess)
    figure = Figure(figsize=(1.8 + 2.3 * len(bounds), 5.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(2, len(bounds), squeeze=False, sharex=True, sharey=True)
    for column, (name, found) in enumerate(bounds.items()):
        sigma = found.sigma(outline=True) * _MM
        for row, axis in enumerate("xy"):
            frame = grid[row][column]
            shown = np.clip(sigma[..., 1 + row], norm.vmin, norm.vmax)
            image = frame.pcolormesh(
                found.x_m * _MM, found.y_m * _MM, shown.T, norm=norm, cmap="viridis", shading="nearest"
            )
            _contacts(frame, ports[name])
            frame.set(xlim=(0, film.length_m * _MM), ylim=(0, film.width_m * _MM), aspect="equal")
            if row == 0:
                frame.set_title(name)
            else:
                frame.set_xlabel("x [mm]")
            if column == 0:
                frame.set_ylabel(f"error of {axis}\n\ny [mm]")
    bar = figure.colorbar(image, ax=grid, extend="min", shrink=0.8, label="standard error, outline known [mm]")
    ticks = [guess / part for part in (30, 10, 3, 1)]
    bar.set_ticks(ticks, labels=[f"{at:.2g}" for at in ticks[:-1]] + [f"{guess:.2g} (a guess)"])
    bar.minorticks_off()
    return figure


def _contacts(frame: Any, ports: Sequence["Port"]) -> None:
    for plus, _ in ports:
        (left, right), (front, back) = ((a * _MM for a in span) for span in (plus.x_m, plus.y_m))
        x, y = [left, right, right, left, left], [front, front, back, back, front]
        frame.plot(x, y, color="red", linewidth=3, solid_joinstyle="miter", clip_on=False)
