"""Maps of how well a press is located on a sheet."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sensorgen.analysis.plots import panels
from sensorgen.analysis.plots.libraries import needed

if TYPE_CHECKING:
    from sensorgen.models.sheet import Bounds, Port, Sheet

_MM = 1e3
_SHARES = (1 / 30, 1 / 10, 1 / 3, 1.0)  # of a guess, at which the scale is marked


def png(film: "Sheet", bounds: Mapping[str, "Bounds"], ports: Mapping[str, Sequence["Port"]]) -> bytes:
    """Standard errors of x and y over the sheet, one column per set of contacts, as shares of a guess's.

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

    guess_m = next(iter(bounds.values())).guess_m
    norm = LogNorm(1 / 30, 1)
    height = 2.3 * min(2.0, max(0.4, film.width_m / film.length_m))
    figure = Figure(figsize=(2.1 + 2.3 * len(bounds), 1.0 + 2 * height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(2, len(bounds), squeeze=False, sharex=True, sharey=True)
    for column, (name, found) in enumerate(bounds.items()):
        shares = found.sigma(outline=True)[..., 1:] / guess_m
        for row, axis in enumerate("xy"):
            frame = grid[row][column]
            shown = np.clip(shares[..., row], norm.vmin, norm.vmax)
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
    bar = figure.colorbar(image, ax=grid, extend="min", shrink=0.9, label="standard error, outline known")
    bar.set_ticks(_SHARES, labels=[_mark(share, guess_m) for share in _SHARES])
    bar.minorticks_off()
    return figure


def _mark(share: float, guess_m: tuple[float, float]) -> str:
    r"""What a share of a guess is in x and in y, once where both are alike.

    >>> _mark(0.1, (0.03, 0.03)), _mark(0.1, (0.03, 0.015))
    ('3 mm', 'x 3 mm\ny 1.5 mm')
    """
    x, y = (f"{share * guess * _MM:.2g}" for guess in guess_m)
    said = f"{x} mm" if x == y else f"x {x} mm\ny {y} mm"
    return f"{said}\n(a guess)" if share == 1 else said


def _contacts(frame: Any, ports: Sequence["Port"]) -> None:
    for plus, _ in ports:
        (left, right), (front, back) = ((a * _MM for a in span) for span in (plus.x_m, plus.y_m))
        x, y = [left, right, right, left, left], [front, front, back, back, front]
        frame.plot(x, y, color="red", linewidth=3, solid_joinstyle="miter", clip_on=False)
