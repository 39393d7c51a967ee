"""``sensorgen bench sets``: what presses change, of several recordings on one scale."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import bench_opened, render
from sensorgen.cli.log_words import made
from sensorgen.cli.words import Png
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.recording.samples import Real
    from sensorgen.measure.signal.presses import Pairs


def _sets(
    what: tuple[str, ...], rig_files: tuple[str, ...], output: str | None, plot: str | None, *, together: bool,
    **how: Any,
) -> None:  # fmt: skip
    """Bring what presses change of several recordings to a scale from 0 to 1, tone by tone, R and X apart.

    0 is the least difference and 1 the largest: of each recording by itself, so that their courses compare, or of all
    of them --together, so that their sizes do. Files need a --rig each, in the same order; recordings of the log have
    theirs.
    """
    from sensorgen.measure.signal.results import of_sets

    if rig_files and len(rig_files) != len(what):
        raise BadInput(f"{len(rig_files)} --rig for {len(what)} recordings; expected one each, in the same order")
    tones, sets = _read(what, rig_files or (None,) * len(what), **how)
    files = [*_table(sets, tones, output, together=together), *_drawn(sets, tones, plot, together=together)]
    render.deliver(of_sets(tones, sets, files))


def _read(what: tuple[str, ...], rigs: tuple[str | None, ...], **how: Any) -> "tuple[Real, dict[str, Pairs]]":
    """Tones that all sets share, and presses by the names of the sets."""
    import numpy as np

    tones, found = None, {}
    for one, rig_file in zip(what, rigs, strict=True):
        worked, rig = bench_opened.worked_up(one, rig_file, **how)
        name = bench_opened.name_of(one)
        if rig is None or worked.pairs is None:
            raise BadInput(f"{one}: {worked.notes[-1] if rig else 'no log of a rig, so that its forces are not known'}")
        if tones is not None and not np.array_equal(tones, worked.recording.tones_hz):
            raise BadInput(f"{one} has tones of {worked.recording.tones_hz.tolist()} Hz; expected {tones.tolist()}")
        if name in found:
            raise BadInput(f"{name!r} twice; expected each recording once")
        tones, found[name] = worked.recording.tones_hz, worked.pairs
    return np.asarray(tones), found


def _table(sets: "Mapping[str, Pairs]", tones_hz: "Real", output: str | None, *, together: bool) -> list[str]:
    """Write a row for each press of each set, on their scale."""
    if output is None:
        return []
    import csv
    import io

    import numpy as np

    from sensorgen.core import files as store
    from sensorgen.measure.signal.surfaces import normalised

    scaled = [
        normalised([getattr(pairs.difference_ohm, part) for pairs in sets.values()], together=together)
        for part in ("real", "imag")
    ]
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    names = [f"{part}_share_{units.frequency_text(float(f))}" for part in ("re", "im") for f in tones_hz]
    rows.writerow(["set", "time_s", "force_n", "position_mm", *names])
    for (name, pairs), re, im in zip(sets.items(), *scaled, strict=True):
        for row in np.column_stack([pairs.time_s, pairs.force_n, pairs.position_mm, re, im]).tolist():
            rows.writerow([name, *(f"{value:.9g}".replace("nan", "") for value in row)])
    store.replace(Path(output), text.getvalue().encode())
    return [output]


def _drawn(sets: "Mapping[str, Pairs]", tones_hz: "Real", plot: str | None, *, together: bool) -> list[str]:
    if plot is None:
        return []
    from sensorgen.analysis.plots import recordings
    from sensorgen.core import files as store

    store.replace(Path(plot), recordings.normalised_differences(sets, tones_hz, together=together))
    return [plot]


command = made(
    _sets, "sets", "Compare what presses change of several recordings.",
    click.Argument(["what"], metavar="RECORDING_FILE|NUMBER ...", nargs=-1, required=True),
    click.Option(["--rig", "rig_files"], metavar="FILE", multiple=True, help="A rig's log for each RECORDING_FILE."),
    click.Option(["--together"], is_flag=True, help="One scale for all, so that sizes compare."),
    *bench_opened.options(),
    click.Option(["--output", "-o"], metavar="FILE.csv", help="Write a row per press, on its scale."),
    click.Option(["--plot"], type=Png(), metavar="FILE.png", help="Draw them over the force, tone by tone."),
    *render.options("json", "markdown", file=False),
)  # fmt: skip
