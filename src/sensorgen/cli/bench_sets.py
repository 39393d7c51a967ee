"""``sensorgen bench sets``: what presses change, of several recordings on one scale."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import bench_opened, render
from sensorgen.cli.bench_opened import Opening, bench
from sensorgen.cli.commands import command
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.measure.recording.samples import Real
    from sensorgen.measure.signal.presses import Pairs


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
        from sensorgen.analysis.plots import recordings

        files.replace(plot, recordings.normalised_differences(sets, tones, together=together))
    return of_sets(tones, sets, [str(name) for name in (output, plot) if name])


def _read(what: tuple[str, ...], rigs: tuple[Path | None, ...], opening: Opening) -> "tuple[Real, dict[str, Pairs]]":
    """Tones that all sets share, and presses by the names of the sets."""
    import numpy as np

    tones, sets = None, {}
    for one, rig_file in zip(what, rigs, strict=True):
        run, rig = opening.processed(one, rig_file)
        name = bench_opened.name_of(one)
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
    import csv
    import io

    import numpy as np

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
    return text.getvalue().encode()
