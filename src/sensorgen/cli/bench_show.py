"""``sensorgen bench show``: a recording of the bench, filtered, its presses and what they change."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.cli import bench_opened, render
from sensorgen.cli.bench_opened import Cutoff, Opening, Rig, bench
from sensorgen.cli.commands import command
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sensorgen.core.document import Documented
    from sensorgen.measure.recording.samples import Complex, Real
    from sensorgen.measure.signal.run import Processed


@command(
    "show", *render.options("json", "markdown"), group=bench,
    short="Show a recording: its marks, presses and what they change.",
)  # fmt: skip
def _show(
    what: str, *, rig_file: Rig = None, cutoff_hz: Cutoff = None, presses: Path | None = None,
    filtered: Path | None = None, plot: Path | None = None, opening: Opening,
) -> "Documented":  # fmt: skip
    """Show what a recording says: samples and marks, clocks, drift, and what each press changes.

    A file, with the rig's log beside it, or the number of a recording in the log. Without a rig's log, presses are
    looked for in the readings, and their forces are not known. Differences are pressed less before, of means over a
    second, with their standard errors.

    Parameters
    ----------
    what : RECORDING_FILE|NUMBER
    presses : FILE.csv
        Write readings before and under each press, as 'invert' takes them.
    filtered : FILE.csv
        Write the low-passed readings, their drift left in.
    plot : DIR
        Draw readings over time and surfaces of the differences there.
    """
    from sensorgen.measure.signal import lowpass
    from sensorgen.measure.signal.results import of_recording

    run, rig = opening.processed(what, rig_file, cutoff_hz=cutoff_hz or lowpass.CUTOFF_HZ)
    files = _tables(run, presses, filtered)
    if plot:
        files += _drawn(run, bench_opened.name_of(what), plot)
    return of_recording(run, rig, files)


def _tables(run: "Processed", presses: Path | None, filtered: Path | None) -> list[str]:
    """Write the tables that were asked for; columns of tones as 'invert' and 'log bench' read them."""
    import numpy as np

    from sensorgen.core import files as store

    pairs, tones = run.pairs, run.recording.tones_hz
    if presses and pairs is None:
        raise BadInput(f"--presses {presses}: {run.notes[-1]}")
    if presses and pairs is not None:
        at_rest = [pairs.time_s, np.ones(len(pairs.time_s)), *np.full((2, len(pairs.time_s)), np.nan)]
        pressed = [pairs.time_s, np.zeros(len(pairs.time_s)), pairs.force_n, pairs.position_mm]
        beside, z = (
            _in_turn(np.array([at_rest, pressed])),
            _in_turn(np.array([pairs.before_ohm.T, pairs.pressed_ohm.T])),
        )
        store.replace(presses, _csv(("time_s", "rest", "force_n", "position_mm"), [*beside], tones, z.T))
    if filtered:
        store.replace(filtered, _csv(("time_s",), [run.filtered_s], tones, run.filtered_ohm))
    return [str(name) for name in (presses, filtered) if name]


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


def _drawn(processed: "Processed", name: str, folder: Path) -> list[str]:
    """Pictures, and the page; surfaces only where presses span one."""
    from sensorgen.analysis.plots import recordings
    from sensorgen.core import files as store

    if processed.pairs is None:
        raise BadInput(f"--plot {folder}: {processed.notes[-1]}")
    one, valid = processed.recording, processed.recording.valid()
    raw, smooth = one.impedance_ohm[valid], processed.filtered_ohm
    if processed.drift:  # the presses are without it, and have to lie on the curves
        name = f"{name}, drift taken out"
        raw = processed.drift.removed(one.time_s[valid], raw)
        smooth = processed.drift.removed(processed.filtered_s, smooth)
    run = recordings.DrawnRecording(
        name, one.tones_hz, one.time_s[valid], raw, processed.filtered_s, smooth, processed.pairs
    )
    files: dict[str, Callable[[recordings.DrawnRecording], bytes]] = {"time.png": recordings.over_time}
    if processed.by_force:
        files |= {f"{part}.png": partial(recordings.surfaces, part=part) for part in recordings.PARTS}
        files["run.html"] = lambda of: recordings.html(of).encode()
    for file, draw in files.items():
        store.replace(folder / file, draw(run))
    return [str(folder / file) for file in files]
