"""``sensorgen bench show``: a recording of the bench, filtered, its presses and what they change."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import bench_opened, render
from sensorgen.cli.log_words import made
from sensorgen.cli.words import Values, one
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sensorgen.measure.recording.samples import Complex, Real
    from sensorgen.measure.signal.run import Processed


def _show(
    what: str, rig_file: str | None, cutoff_hz: tuple[float, ...] | None, presses: str | None, filtered: str | None,
    plot: str | None, **how: Any,
) -> None:  # fmt: skip
    """Show what a recording says: samples and marks, clocks, drift, and what each press changes.

    A file, with the rig's log beside it, or the number of a recording in the log. Without a rig's log, presses are
    looked for in the readings, and their forces are not known. Differences are pressed less before, of means over a
    second, with their standard errors.
    """
    from sensorgen.measure.signal import lowpass
    from sensorgen.measure.signal.results import of_recording

    cutoff = one("--cutoff", cutoff_hz) if cutoff_hz else lowpass.CUTOFF_HZ
    worked, rig = bench_opened.worked_up(what, rig_file, cutoff_hz=cutoff, **how)
    name = bench_opened.name_of(what)
    files = [*_tables(worked, presses, filtered), *(_drawn(worked, name, Path(plot)) if plot else ())]
    render.deliver(of_recording(worked, rig, files))


def _tables(worked: "Processed", presses: str | None, filtered: str | None) -> list[str]:
    """Write the tables that were asked for; columns of tones as 'invert' and 'log bench' read them."""
    import numpy as np

    from sensorgen.core import files as store

    pairs, tones = worked.pairs, worked.recording.tones_hz
    if presses and pairs is None:
        raise BadInput(f"--presses {presses}: {worked.notes[-1]}")
    if presses and pairs is not None:
        at_rest = [pairs.time_s, np.ones(len(pairs.time_s)), *np.full((2, len(pairs.time_s)), np.nan)]
        pressed = [pairs.time_s, np.zeros(len(pairs.time_s)), pairs.force_n, pairs.position_mm]
        beside, z = (
            _in_turn(np.array([at_rest, pressed])),
            _in_turn(np.array([pairs.before_ohm.T, pairs.pressed_ohm.T])),
        )
        store.replace(Path(presses), _csv(("time_s", "rest", "force_n", "position_mm"), [*beside], tones, z.T))
    if filtered:
        store.replace(Path(filtered), _csv(("time_s",), [worked.filtered_s], tones, worked.filtered_ohm))
    return [name for name in (presses, filtered) if name]


def _in_turn(two: "NDArray[Any]") -> "NDArray[Any]":
    """Columns of two tables (2, k, n), a row of the first before each row of the second (k, 2 n)."""
    return two.transpose(1, 2, 0).reshape(two.shape[1], -1)


def _csv(names: tuple[str, ...], beside: "Sequence[Real]", tones_hz: "Real", z: "Complex") -> bytes:
    """Columns, then two for each tone; empty where nothing is known."""
    import io

    import numpy as np

    heads = [f"{part}_ohm_{units.frequency_text(float(f))}" for f in tones_hz for part in ("re", "im")]
    values = np.column_stack([*beside, np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)])
    text = io.StringIO()
    np.savetxt(text, values, "%.12g", ",", header=",".join([*names, *heads]), comments="")
    return text.getvalue().replace("nan", "").encode()


def _drawn(worked: "Processed", name: str, folder: Path) -> list[str]:
    """Pictures, and the page; surfaces only where presses span one."""
    from sensorgen.analysis.plots import recordings
    from sensorgen.core import files as store

    if worked.pairs is None:
        raise BadInput(f"--plot {folder}: {worked.notes[-1]}")
    one, valid = worked.recording, worked.recording.valid()
    raw, smooth = one.impedance_ohm[valid], worked.filtered_ohm
    if worked.drift:  # the presses are without it, and have to lie on the curves
        name = f"{name}, drift taken out"
        raw = worked.drift.removed(one.time_s[valid], raw)
        smooth = worked.drift.removed(worked.filtered_s, smooth)
    run = recordings.Run(name, one.tones_hz, one.time_s[valid], raw, worked.filtered_s, smooth, worked.pairs)
    files: dict[str, Callable[[recordings.Run], bytes]] = {"time.png": recordings.over_time}
    if worked.by_force:
        files |= {f"{part}.png": partial(recordings.surfaces, part=part) for part in recordings.PARTS}
        files["run.html"] = lambda of: recordings.html(of).encode()
    for file, draw in files.items():
        store.replace(folder / file, draw(run))
    return [str(folder / file) for file in files]


command = made(
    _show, "show", "Show a recording: its marks, presses and what they change.",
    click.Argument(["what"], metavar="RECORDING_FILE|NUMBER"),
    click.Option(["--rig", "rig_file"], metavar="FILE", help="The rig's log that belongs to RECORDING_FILE."),
    click.Option(
        ["--cutoff", "cutoff_hz"], type=Values(units.FREQUENCY_HZ, zero=False), metavar="HZ",
        help="Of the low-pass; the thesis's 0.2727 Hz if not given.",
    ),
    click.Option(
        ["--presses"], metavar="FILE.csv", help="Write readings before and under each press, as 'invert' takes them."
    ),
    click.Option(["--filtered"], metavar="FILE.csv", help="Write the low-passed readings, their drift left in."),
    click.Option(["--plot"], metavar="DIR", help="Draw readings over time and surfaces of the differences there."),
    *bench_opened.options(),
    *render.options("json", "markdown"),
)  # fmt: skip
