"""``sensorgen bench show``: a recording of the bench, filtered, its presses and what they change."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import floor, isnan, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import bench_opened, show
from sensorgen.cli.log_text import counted, rig_counted, visible
from sensorgen.cli.log_words import as_json as json_option
from sensorgen.cli.log_words import made
from sensorgen.cli.words import Values, one
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.recording import RigLog
    from sensorgen.measure.recording.samples import Complex, Real
    from sensorgen.measure.signal.presses import Pairs
    from sensorgen.measure.signal.run import Processed

_WIDE = 13  # letters of a column


def _show(
    what: str, rig_file: str | None, cutoff_hz: tuple[float, ...] | None, presses: str | None, filtered: str | None,
    plot: str | None, *, as_json: bool, **how: Any,
) -> None:  # fmt: skip
    """Show what a recording says: samples and marks, clocks, drift, and what each press changes.

    A file, with the rig's log beside it, or the number of a recording in the log. Without a rig's log, presses are
    looked for in the readings, and their forces are not known. Differences are pressed less before, of means over a
    second, with their standard errors.
    """
    from sensorgen.measure.signal import lowpass

    cutoff = one("--cutoff", cutoff_hz) if cutoff_hz else lowpass.CUTOFF_HZ
    worked, rig = bench_opened.worked_up(what, rig_file, cutoff_hz=cutoff, **how)
    name = bench_opened.name_of(what)
    files = [*_tables(worked, presses, filtered), *(_drawn(worked, name, Path(plot)) if plot else ())]
    if as_json:
        show.as_json(_data(worked, rig) | {"files": files})
        return
    for line in (*_lines(worked, rig), *files):
        click.echo(visible(line))


def _lines(worked: "Processed", rig: "RigLog | None") -> Iterator[str]:
    """For people."""
    source, tones = worked.recording.source, worked.recording.tones_hz.tolist()
    seconds = float(worked.recording.time_s[-1])
    yield from counted(source.lockin, worked.recording.counts(), tones, seconds, source.program or source.format)
    yield rig_counted(rig.counts()) if rig else f"{'rig':11}no log: forces and positions are not known"
    yield from (f"{'':11}{note}" for note in worked.notes)
    if worked.drift:
        yield f"{'drift':11}{_drifted(worked):.2%} of Z over the run, fitted to the rest, taken out of the presses"
        yield f"{'':11}{worked.drift.law}: {worked.drift.reason}"
    if worked.pairs is not None:
        how = "" if worked.by_force else ", found by the readings alone"
        yield f"{'presses':11}{len(worked.pairs.time_s)}{how}; ΔR and ΔX [ohm], standard errors in brackets"
        yield from _table(worked.pairs, tones)


def _drifted(worked: "Processed") -> float:
    """How far Z went by its drift, at the tone where it went farthest, as a share."""
    return float(abs(worked.drift.at(worked.recording.time_s[-1:])).max()) if worked.drift else 0.0


def _table(pairs: "Pairs", tones_hz: list[float]) -> Iterator[str]:
    """A line for each press: what it changes at the first and at the last tone."""
    ends = sorted({0, len(tones_hz) - 1})
    heads = (f"Δ{part} {units.frequency_text(tones_hz[k])}" for k in ends for part in "RX")
    yield f"{'start [s]':>9} {'[N]':>5} {'[mm]':>5}" + "".join(f" {head:>{_WIDE}}" for head in heads)
    for i, start in enumerate(pairs.time_s):
        at = f"{start:9.2f} {_known(pairs.force_n[i], 2):>5} {_known(pairs.position_mm[i], 1):>5}"
        yield at + "".join(f" {_value(pairs, i, k, part):>{_WIDE}}" for k in ends for part in ("real", "imag"))


def _known(value: float, digits: int) -> str:
    return "?" if isnan(value) else f"{value:.{digits}f}"


def _value(pairs: "Pairs", i: int, k: int, part: str) -> str:
    value, error = (float(getattr(z[i, k], part)) for z in (pairs.difference_ohm, pairs.error_ohm))
    return in_brackets(value, error)


def in_brackets(value: float, error: float) -> str:
    """A value, with its standard error in units of its last digit: one digit of it, two where it begins with 1.

    >>> in_brackets(-12.3456, 0.0312), in_brackets(12345.6, 41.0), in_brackets(1.0, 0.0), in_brackets(-2.0, 0.0996)
    ('-12.35(3)', '12350(40)', '1', '-2.00(10)')
    """
    if not error > 0:
        return f"{value:.6g}"
    power = floor(log10(float(f"{error:.1e}")))
    power -= error < 1.95 * 10.0**power
    last = round(error / 10.0**power)
    shown = round(value, -power) + 0.0  # never -0
    return f"{shown:.{-power}f}({last})" if power < 0 else f"{shown:.0f}({last * 10**power})"


def _data(worked: "Processed", rig: "RigLog | None") -> dict[str, Any]:
    """For programs; what is not known is null."""
    one, pairs = worked.recording, worked.pairs
    return {
        "file": one.source.file, "lockin": one.source.lockin, "program": one.source.program or one.source.format,
        "rate_hz": one.source.rate_hz, "tones_hz": one.tones_hz.tolist(), "counts": one.counts(),
        "rig": rig.counts() if rig else None, "notes": list(worked.notes), "by_force": worked.by_force,
        "drift": _drifted(worked) if worked.drift else None, "drift_law": worked.drift.law if worked.drift else None,
        "presses": [] if pairs is None else [_press(pairs, i) for i in range(len(pairs.time_s))],
    }  # fmt: skip


def _press(pairs: "Pairs", i: int) -> dict[str, Any]:
    known = {name: float(getattr(pairs, name)[i]) for name in ("time_s", "force_n", "position_mm")}
    parts = {"re": "real", "im": "imag"}
    return {name: None if isnan(value) else value for name, value in known.items()} | {
        f"{kind}_{short}_ohm": getattr(getattr(pairs, f"{kind}_ohm")[i], part).tolist()
        for kind in ("before", "pressed", "difference", "error")
        for short, part in parts.items()
    }


def _tables(worked: "Processed", presses: str | None, filtered: str | None) -> list[str]:
    """Write the tables that were asked for; columns of tones as 'invert' and 'log bench' read them."""
    from sensorgen.core import files as store

    pairs, tones = worked.pairs, worked.recording.tones_hz
    if presses and pairs is None:
        raise BadInput(f"--presses {presses}: {worked.notes[-1]}")
    if presses and pairs is not None:
        beside = [pairs.time_s, pairs.force_n, pairs.position_mm]
        store.replace(Path(presses), _csv(("time_s", "force_n", "position_mm"), beside, tones, pairs.pressed_ohm))
    if filtered:
        store.replace(Path(filtered), _csv(("time_s",), [worked.filtered_s], tones, worked.filtered_ohm))
    return [name for name in (presses, filtered) if name]


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
    click.Option(["--presses"], metavar="FILE.csv", help="Write readings under the presses, as 'invert' takes them."),
    click.Option(["--filtered"], metavar="FILE.csv", help="Write the low-passed readings, their drift left in."),
    click.Option(["--plot"], metavar="DIR", help="Draw readings over time and surfaces of the differences there."),
    *bench_opened.options(),
    json_option(),
)  # fmt: skip
