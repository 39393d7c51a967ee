"""Recordings that the commands of ``sensorgen bench`` work with: files with the rig's log, or numbers of the log."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.log_words import columns_of, opened, recorded_columns, where
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.measure.recording import Recording, RigLog
    from sensorgen.measure.signal.run import Processed


def options() -> list[click.Parameter]:
    """Words that say which recording is meant, and how it is worked up."""
    return [
        *recorded_columns(),
        click.Option(["--lockin"], type=click.IntRange(1), help="Which one, if the file has several."),
        click.Option(["--part"], type=click.IntRange(1), help="Which one, if pauses divide it."),
        click.Option(
            ["--drift", "law"], metavar="LAW",
            help="Law that the drift follows, line, smooth, memory, wandering or memory+wandering; the one that "
            "explains it best if not given.",
        ),
        click.Option(["--keep-drift"], is_flag=True, help="Leave the drift in the presses' readings."),
        where(),
    ]  # fmt: skip


def worked_up(
    what: str, rig_file: str | None, *, columns: tuple[str, ...], rig_columns: tuple[str, ...], lockin: int | None,
    part: int | None, law: str | None, keep_drift: bool, file: str | None, **how: Any,
) -> "tuple[Processed, RigLog | None]":  # fmt: skip
    """A recording with what pressed, freed of drift, cut into presses; and the rig's log, if there is one."""
    from sensorgen.measure import recording
    from sensorgen.measure.signal.run import processed

    if keep_drift and law:
        raise BadInput(f"--keep-drift and --drift {law} at once; expected one of them")
    parts, rig = _opened(what, rig_file, columns, rig_columns, file)
    found = _part(parts, part)
    del parts  # with the part after it
    which = _chosen(found, lockin)
    beside = recording.joined_all(found, rig)[which] if rig else None
    return processed(found[which], beside, remove_drift=not keep_drift, law=law or "", **how), rig


def _opened(
    what: str, rig_file: str | None, columns: tuple[str, ...], rig_columns: tuple[str, ...], file: str | None
) -> "tuple[Iterator[tuple[Recording, ...]], RigLog | None]":
    """Recordings, part after part, and the rig's log, from files or by their number in the log."""
    from sensorgen.measure import recording
    from sensorgen.measure.log import BenchRun, bench

    if not (what.isascii() and what.isdigit()) or Path(what).is_file():
        read = recording.parts(what, columns_of(columns, "--column"))
        return read, recording.rig(rig_file, columns_of(rig_columns, "--rig-column")) if rig_file else None
    if rig_file or columns or rig_columns:
        raise BadInput(f"recording {what} of the log has its rig's log and columns; expected no others beside it")
    with opened(file) as log:
        entry = next(log.entries(BenchRun, superseded=True, number=int(what)), None)
        if entry is None:
            raise BadInput(f"no recording {what} in {str(log.path)!r}; sensorgen log list shows their numbers")
        return bench.read_again(log, entry)


def _part(parts: "Iterator[tuple[Recording, ...]]", which: int | None) -> "tuple[Recording, ...]":
    """The part that was asked for, or the only one."""
    count = 0
    for count, found in enumerate(parts, 1):
        if count == which:
            return found
        if which is None and count == 1:
            only = found
    if which is None and count > 1:
        raise BadInput(
            f"{count} parts, with pauses between them or too long for one; choose one with --part 1 to {count}"
        )
    if which is not None:
        raise BadInput(f"--part {which}: expected 1{f' to {count}' if count > 1 else ', the only one'}")
    return only


def _chosen(found: "tuple[Recording, ...]", lockin: int | None) -> int:
    """Number of the chosen lock-in, from 0."""
    if lockin is None and len(found) > 1:
        raise BadInput(f"{len(found)} lock-ins; choose one with --lockin 1 to {len(found)}")
    if lockin is not None and lockin > len(found):
        raise BadInput(f"--lockin {lockin}: expected 1{f' to {len(found)}' if len(found) > 1 else ', the only one'}")
    return (lockin or 1) - 1


def name_of(what: str) -> str:
    """Name of a recording in a title: its file, or its number in the log."""
    return f"recording {what}" if what.isdigit() and not Path(what).is_file() else Path(what).name
