"""Recordings of the rig as figures: readings over time, differences by loads, hysteresis, and the plan of a run.

Raw and filtered readings with the points before and under each load (thesis Fig. 6.26 to 6.29), differences over force
and position (6.30 to 6.32), and normalised differences of several recordings (6.33).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots.figure import (
    BLUE,
    COLOURS,
    GREEN,
    MOST_POINTS,
    ORANGE,
    SKY,
    Axis,
    Curve,
    Figure,
    Map,
    Panel,
    look,
    scale,
    thinned,
)
from sensorgen.analysis.plots.pages import PageSection, page
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.signal.presses import Pairs, Step
    from sensorgen.measure.signal.run import Hysteresis

PARTS = {"resistance": ("R", "real"), "reactance": ("X", "imag")}
_FEWEST = 200  # points of a curve, however many recordings are on a page
_TIME, _FORCE, _POSITION = Axis("time [s]"), Axis("force [N]"), Axis("position [mm]")


@dataclass(frozen=True, eq=False)
class DrawnRecording:
    """Recording, as it is drawn.

    Attributes
    ----------
    name : str
        Of the specimen, or the file.
    tones_hz : (m,) array
        Frequencies [Hz].
    time_s, raw_ohm : (n,) and (n, m) array
        Valid readings [s], [ohm].
    filtered_s, filtered_ohm : (k,) and (k, m) array
        The same, filtered [s], [ohm].
    pairs : Pairs or None
        Before and under each load.
    """

    name: str
    tones_hz: Real
    time_s: Real
    raw_ohm: Complex
    filtered_s: Real
    filtered_ohm: Complex
    pairs: "Pairs | None"


def series(run: DrawnRecording, key: str = "time", together: int = 1) -> Figure:
    """R and X over time at each frequency: raw, filtered, before and under each load.

    ``together``, the number of recordings on a page, divides the points of a curve.
    """
    most = max(MOST_POINTS // together, _FEWEST)

    def panels(k: int, at: str) -> Iterator[Panel]:
        for symbol, part in PARTS.values():
            raw, smooth = (getattr(z[:, k], part) for z in (run.raw_ohm, run.filtered_ohm))
            divisor, unit = scale(raw, "Ω")
            curves = [_line("raw", run.time_s, raw / divisor, SKY, most),
                      _line("filtered", run.filtered_s, smooth / divisor, BLUE, most)]  # fmt: skip
            if run.pairs is not None:
                for name, z, how in (("before", run.pairs.before_ohm, {"colour": GREEN, "symbol": "circle-open"}),
                                     ("pressed", run.pairs.pressed_ohm, {"colour": ORANGE})):  # fmt: skip
                    curves.append(Curve("points", name, run.pairs.time_s, getattr(z[:, k], part) / divisor, **how))
            yield Panel(tuple(curves), _TIME, Axis(f"{symbol} [{unit}]"), title=at)

    return Figure.by_frequency(
        key, f"Readings over time: {run.name}",
        "R and X over time, as recorded and low-passed. Of long recordings the least and the largest value of every "
        "stretch are drawn; everything is computed from all samples.", run.tones_hz, panels, columns=2,
    )  # fmt: skip


def _line(name: str, time_s: Real, values: Real, colour: str, most: int) -> Curve:
    at = thinned(values, most)
    return Curve("line", name, time_s[at], values[at], colour=colour)


def differences(run: DrawnRecording, part: str, key: str = "", together: int = 1) -> Figure:
    """Change of "resistance" or "reactance" by the loads over force and position, at each frequency.

    ``together``, the number of recordings on a page, makes the grid coarser, to a third at most.

    Raises
    ------
    BadInput
        As :func:`sensorgen.measure.signal.presses.surface`; no loads.
    """
    from sensorgen.measure.signal.presses import POINTS, surface

    pairs, (symbol, share) = run.pairs, PARTS[part]
    if pairs is None:
        raise BadInput(f"{run.name}: no loads of known force")
    grid = max(round(POINTS / together**0.5), POINTS // 3)
    through = surface(pairs.force_n, pairs.position_mm, getattr(pairs.difference_ohm, share), grid)

    def panels(k: int, at: str) -> Iterator[Panel]:
        divisor, unit = scale(through.values[..., k], "Ω")
        label = f"Δ{symbol} [{unit}]"
        content = (Map(through.position_mm, through.force_n, through.values[..., k] / divisor, label),
                   Curve("points", "", pairs.position_mm, pairs.force_n, colour="#000000"))  # fmt: skip
        yield Panel(content, _POSITION, _FORCE, title=f"Δ{symbol} at {at}")

    alt = f"Change of {part} over force and position, interpolated between {len(pairs.time_s)} loads (dots)."
    title = f"Change of {part} under load: {run.name}"
    return Figure.by_frequency(key or part, title, alt, run.tones_hz, panels, columns=4)


def compared(
    runs: "Mapping[str, Pairs]", tones_hz: Real, *, together: bool = False, key: str = "normalised", left_out: str = ""
) -> Figure:
    """Differences of several recordings on one scale from 0 to 1, over force, R and X at each frequency.

    Parameters
    ----------
    runs : mapping of str to Pairs
        By the name of the recording, all with the same frequencies.
    tones_hz : (m,) array
        Frequencies [Hz].
    together : bool
        As :func:`sensorgen.measure.signal.presses.normalised`.
    key : str
        Name of the figure.
    left_out : str
        Sentence on recordings that are not drawn.
    """
    from sensorgen.measure.signal.presses import normalised

    parts = {
        symbol: normalised([getattr(pairs.difference_ohm, part) for pairs in runs.values()], together=together)
        for symbol, part in PARTS.values()
    }

    def panels(k: int, at: str) -> Iterator[Panel]:
        for symbol, scaled in parts.items():
            curves = tuple(
                Curve("points", name, pairs.force_n, values[:, k], **look(j),
                      text=[f"{name}, at {x:.4g} mm" for x in pairs.position_mm])
                for j, ((name, pairs), values) in enumerate(zip(runs.items(), scaled, strict=True))
            )  # fmt: skip
            yield Panel(curves, _FORCE, Axis(f"Δ{symbol}, normalised"), title=at)

    how = "one scale for all" if together else "each recording on a scale of its own"
    alt = (
        f"Change of R and of X by each load of {len(runs)} recordings over its force: 0 is the least and 1 the largest "
        f"change ({how}).{left_out}"
    )
    return Figure.by_frequency(key, f"Normalised differences under load, {how}", alt, tones_hz, panels, columns=2)


def hysteresis(loads: "Mapping[float, Hysteresis]", tones_hz: Real, name: str) -> Figure:
    """Change of R and X under rising (solid) and falling force (dashed), at the first and the last frequency.

    Parameters
    ----------
    loads : mapping of float to Hysteresis
        By the begin of the load [s].
    tones_hz : (m,) array
        Frequencies [Hz]; columns of the loads are R of all of them, then X.
    name : str
        Of the recording.
    """
    ends = sorted({0, len(tones_hz) - 1})

    def panels(k: int, at: str) -> Iterator[Panel]:
        for part, symbol in enumerate("RX"):
            column = ends[k] + part * len(tones_hz)
            curves = tuple(
                Curve("line", "", load.force_n, values[:, column] - load.up[0, column],
                      colour=COLOURS[j % len(COLOURS)], dash=dash)
                for j, load in enumerate(loads.values()) for values, dash in ((load.up, "solid"), (load.down, "dash"))
            )  # fmt: skip
            yield Panel(curves, _FORCE, Axis(f"Δ{symbol} [Ω]"), title=f"Δ{symbol} at {at}")

    title = f"Hysteresis of {name}: rising force solid, falling dashed, a colour for each load"
    alt = "Change of R and of X since each load began, over force."
    return Figure.by_frequency("hysteresis", title, alt, tones_hz[ends], panels, columns=2)


def schedule(steps: "Sequence[Step]", seconds: float) -> Figure:
    """Plan of a run: force over position in the order of the run, and force over time."""
    force, position = np.array([s.force_n for s in steps]), np.array([s.position_mm for s in steps])
    order = Map(position, force, np.arange(1.0, len(steps) + 1), "number of the load")
    edges = [(0.0, 0.0)]
    for s in steps:
        end_s = s.start_s + s.dwell_s
        edges += [(s.start_s, 0.0), (s.start_s, s.force_n), (end_s, s.force_n), (end_s, 0.0)]
    x, y = zip(*edges, (seconds, 0.0), strict=True)
    divisor, unit = (60.0, "min") if seconds > 600 else (1.0, "s")
    when = Curve("line", "", np.array(x) / divisor, y, colour=BLUE)
    panels = (Panel((order,), _POSITION, _FORCE), Panel((when,), Axis(f"time [{unit}]"), _FORCE))
    return Figure("plan", f"{len(steps)} loads in {seconds:.0f} s", "The plan.", {"": panels}, columns=2)


def html(run: DrawnRecording) -> str:
    """The run as a page: readings over time and differences over force and position, frequency by frequency."""
    figures = [differences(run, part) for part in PARTS] if run.pairs is not None else []
    loads = f"{len(run.pairs.time_s)} loads, " if run.pairs is not None else ""
    section = PageSection(figures=(*figures, series(run)))
    return page(run.name, [f"{loads}{len(run.tones_hz)} frequencies, {run.time_s[-1]:.0f} s."], [section])
