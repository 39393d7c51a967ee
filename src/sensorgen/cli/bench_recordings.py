"""``sensorgen bench show|hysteresis|sets|live``: recordings from files, or by their number in the log."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli import render
from sensorgen.cli.commands import NumberRange, command
from sensorgen.cli.options import ColumnNames, LogFile
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sensorgen.core.arrays import Complex, Real
    from sensorgen.core.document import Documented
    from sensorgen.measure.recording import Recording, RigLog
    from sensorgen.measure.signal.presses import Pairs
    from sensorgen.measure.signal.run import Processed


bench = click.Group("bench", help="Plans and runs of the rig that presses sensors, and its recordings.")
Rig = Annotated[Path | None, Option("The rig's log that belongs to RECORDING_FILE.", ("--rig",), metavar="FILE")]
Cutoff = Annotated[float | None, Option("Of the low-pass; the thesis's 0.2727 Hz if not given.")]


@dataclass(frozen=True)
class Opening:
    """Recording that is meant, and how it is worked up.

    Attributes
    ----------
    lockin
        Which one, if the file has several.
    part
        Which one, if pauses divide it.
    law, --drift : LAW
        Law that the drift follows, line, smooth, memory, wandering or memory+wandering; the one that explains it best
        if not given.
    keep_drift
        Leave the drift in the presses' readings.
    """

    columns: ColumnNames = field(default_factory=ColumnNames)
    lockin: Annotated[int | None, Option(kind=click.IntRange(1))] = None
    part: Annotated[int | None, Option(kind=click.IntRange(1))] = None
    law: str = ""  # fmt: skip
    keep_drift: bool = False
    log: LogFile = field(default_factory=LogFile)

    def __post_init__(self) -> None:
        """Refuse a law of a drift that is kept."""
        if self.keep_drift and self.law:
            raise BadInput(f"--keep-drift and --drift {self.law} at once; expected one of them")

    def processed(self, what: str, rig_file: Path | None, **how: Any) -> "tuple[Processed, RigLog | None]":
        """A recording with what pressed, freed of drift, cut into presses; and the rig's log, if there is one."""
        from sensorgen.measure import recording
        from sensorgen.measure.signal.run import processed

        parts, rig = self._opened(what, rig_file)
        lockins = _part(parts, self.part)
        del parts  # with the part after it
        _refuse(self.lockin, "lockin", len(lockins), "lock-ins")
        which = (self.lockin or 1) - 1
        pressed = recording.joined_all(lockins, rig)[which] if rig else None
        return processed(lockins[which], pressed, remove_drift=not self.keep_drift, law=self.law, **how), rig

    def _opened(self, what: str, rig_file: Path | None) -> "tuple[Iterator[tuple[Recording, ...]], RigLog | None]":
        """Recordings, part after part, and the rig's log, from files or by their number in the log."""
        from sensorgen.measure import recording
        from sensorgen.measure.log import BenchRun, bench

        if not (what.isascii() and what.isdigit()) or Path(what).is_file():
            read = recording.parts(what, self.columns.of_readings())
            return read, recording.rig(rig_file, self.columns.of_rig()) if rig_file else None
        if rig_file or self.columns != ColumnNames():
            raise BadInput(f"recording {what} of the log has its rig's log and columns; expected no others beside it")
        with self.log.opened() as log:
            entry = next(log.entries(BenchRun, superseded=True, number=int(what)), None)
            if entry is None:
                raise BadInput(f"no recording {what} in {str(log.path)!r}; sensorgen log list shows their numbers")
            return bench.read_again(log, entry)


def _part(parts: "Iterator[tuple[Recording, ...]]", which: int | None) -> "tuple[Recording, ...]":
    """The part that was asked for, or the only one."""
    count = 0
    for count, lockins in enumerate(parts, 1):
        if count == (which or 1):
            found = lockins
        if count == which:
            return found
    _refuse(which, "part", count, "parts, with pauses between them or too long for one")
    return found


def _refuse(which: int | None, option: str, count: int, words: str) -> None:
    """Refuse a number beyond a count, and none where several are there."""
    if which is None and count > 1:
        raise BadInput(f"{count} {words}; choose one with --{option} 1 to {count}")
    if which is not None and which > count:
        raise BadInput(f"--{option} {which}: expected 1{f' to {count}' if count > 1 else ', the only one'}")


def name_of(what: str) -> str:
    """Name of a recording in a title: its file, or its number in the log."""
    return f"recording {what}" if what.isdigit() and not Path(what).is_file() else Path(what).name


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
        files += _drawn(run, name_of(what), plot)
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
    import numpy as np

    heads = [f"{part}_ohm_{units.frequency_text(float(f))}" for f in tones_hz for part in ("re", "im")]
    values = np.column_stack([*beside, np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)])
    return render.columns([*names, *heads], values.tolist()).encode()


def _drawn(processed: "Processed", name: str, folder: Path) -> list[str]:
    """Pictures, and the page; surfaces only where presses span one."""
    from sensorgen.analysis.plots import recordings, static

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
    figures = [recordings.series(run)]
    if processed.by_force:
        figures += [recordings.differences(run, part) for part in recordings.PARTS]
    files = {f"{figure.key}.png": static.png(figure) for figure in figures}
    if processed.by_force:
        files["run.html"] = recordings.html(run).encode()
    return render.written(folder, files.items())


_LAW = "smooth"
Threshold = Annotated[float, Option(kind=NumberRange(0, min_open=True))]


@command(
    "hysteresis", *render.options("json", "markdown"), group=bench,
    short="Show how far ways up and down of presses lie apart.",
)  # fmt: skip
def _hysteresis(
    what: str, *, rig_file: Rig = None, opening: Opening, threshold_n: Threshold = 0.2,
    plot: Annotated[Path | None, Option(kind="png")] = None,
) -> "Documented":  # fmt: skip
    """Show how far readings on the way down of each press lie from those on its way up, at the same force.

    For presses that go up and down again over some seconds, with the rig's log that measured the force. The distance is
    the largest one, over the span of the readings from --threshold on, with the standard error that noise and the
    rig's clock give it.
    Drift is taken out by a law of time alone: what the film remembers of presses is what is looked for.

    Parameters
    ----------
    what : RECORDING_FILE|NUMBER
    threshold_n : N
        Force from which on the tip presses.
    plot : FILE.png
        Draw the ways up and down over the force.
    """
    from sensorgen.measure.signal.results import of_ways
    from sensorgen.measure.signal.run import of_presses

    if not opening.keep_drift:
        opening = replace(opening, law=opening.law or _LAW)
    run, rig = opening.processed(what, rig_file)
    if rig is None:
        raise BadInput(f"{what}: no log of a rig; expected one with the force, with --rig FILE")
    presses = of_presses(run, threshold_n)
    if plot:
        from sensorgen.analysis.plots import recordings, static
        from sensorgen.core import files

        figure = recordings.hysteresis(presses.ways, run.recording.tones_hz, name_of(what))
        files.replace(plot, static.png(figure))
    return of_ways(run.recording.tones_hz, presses, [str(plot)] if plot else [])


@command(
    "sets", *render.options("json", "markdown", file=False), group=bench,
    short="Compare what presses change of several recordings.",
)  # fmt: skip
def _sets(
    what: tuple[str, ...], *, rig_files: tuple[Path, ...] = (), together: bool = False, opening: Opening,
    output: Path | None = None, plot: Annotated[Path | None, Option(kind="png")] = None,
) -> "Documented":  # fmt: skip
    """Bring what presses change of several recordings to a scale from 0 to 1, tone by tone, R and X apart.

    0 is the least difference and 1 the largest: of each recording by itself, so that their courses compare, or of all
    of them --together, so that their sizes do. Files need a --rig each, in the same order; recordings of the log have
    theirs.

    Parameters
    ----------
    what : RECORDING_FILE|NUMBER ...
    rig_files, --rig : FILE
        A rig's log for each RECORDING_FILE.
    together
        One scale for all, so that sizes compare.
    output, --output, -o : FILE.csv
        Write a row per press, on its scale.
    plot : FILE.png
        Draw them over the force, tone by tone.
    """
    from sensorgen.core import files
    from sensorgen.measure.signal.results import of_sets

    if rig_files and len(rig_files) != len(what):
        raise BadInput(f"{len(rig_files)} --rig for {len(what)} recordings; expected one each, in the same order")
    tones, sets = _read(what, rig_files or (None,) * len(what), opening)
    if output:
        files.replace(output, _table(sets, tones, together=together))
    if plot:
        from sensorgen.analysis.plots import recordings, static

        files.replace(plot, static.png(recordings.compared(sets, tones, together=together)))
    return of_sets(tones, sets, [str(name) for name in (output, plot) if name])


def _read(what: tuple[str, ...], rigs: tuple[Path | None, ...], opening: Opening) -> "tuple[Real, dict[str, Pairs]]":
    """Tones that all sets share, and presses by the names of the sets."""
    import numpy as np

    tones, sets = None, {}
    for one, rig_file in zip(what, rigs, strict=True):
        run, rig = opening.processed(one, rig_file)
        name = name_of(one)
        if rig is None or run.pairs is None:
            raise BadInput(f"{one}: {run.notes[-1] if rig else 'no log of a rig, so that its forces are not known'}")
        if tones is not None and not np.array_equal(tones, run.recording.tones_hz):
            raise BadInput(f"{one} has tones of {run.recording.tones_hz.tolist()} Hz; expected {tones.tolist()}")
        if name in sets:
            raise BadInput(f"{name!r} twice; expected each recording once")
        tones, sets[name] = run.recording.tones_hz, run.pairs
    return np.asarray(tones), sets


def _table(sets: "Mapping[str, Pairs]", tones_hz: "Real", *, together: bool) -> bytes:
    """CSV with a row for each press of each set, on their scale."""
    import numpy as np

    from sensorgen.measure.signal.presses import normalised

    scaled = [
        normalised([getattr(pairs.difference_ohm, part) for pairs in sets.values()], together=together)
        for part in ("real", "imag")
    ]
    names = [f"{part}_share_{units.frequency_text(float(f))}" for part in ("re", "im") for f in tones_hz]
    rows = (
        [name, *row] for (name, pairs), re, im in zip(sets.items(), *scaled, strict=True)
        for row in np.column_stack([pairs.time_s, pairs.force_n, pairs.position_mm, re, im]).tolist()
    )  # fmt: skip
    return render.columns(["set", "time_s", "force_n", "position_mm", *names], rows).encode()


Rate = Annotated[float, Option(more={"required": True})]


@command("live", group=bench, short="Low-pass readings as they come.")
def _live(measured: str, *, rate_hz: Rate, cutoff_hz: Cutoff = None) -> None:
    """Low-pass readings as they come, row by row, onto the standard output.

    The filter begins in the steady state of the first reading and delays by 1.5 s at the thesis's cut-off. Where a
    reading is missing or exactly 0 the one before is held, and its cells stay empty. Rows must come at an even --rate;
    columns that are no readings pass as they are.

    Parameters
    ----------
    measured : MEASURED.csv|-
    rate_hz : HZ
        Rows per second.
    """
    from sensorgen.core.document import csv_row
    from sensorgen.measure.readings import readings
    from sensorgen.measure.recording.samples import sifted
    from sensorgen.measure.signal.lowpass import CUTOFF_HZ, Live

    smooth = Live(rate_hz, cutoff_hz or CUTOFF_HZ)
    with readings(measured) as source:
        tones = (units.frequency_text(float(f)) for f in source.frequency_hz)
        head = csv_row([*source.kept, *(f"{part}_ohm_{f}" for f in tones for part in ("re", "im"))])
        render.say(head, nl=False)
        for block in source.blocks():
            sifted(block.impedance_ohm)
            for beside, row in zip(block.text, smooth(block.impedance_ohm).tolist(), strict=True):
                parts = (f"{part:.12g}" if isfinite(z.real) else "" for z in row for part in (z.real, z.imag))
                render.say(csv_row([*beside, *parts]), nl=False)
