"""Recordings that the commands of ``sensorgen bench`` work with: files with the rig's log, or numbers of the log."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli.log_words import ColumnNames, LogFile
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.measure.recording import Recording, RigLog
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
        which = _chosen(lockins, self.lockin)
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
        if count == which:
            return lockins
        if which is None and count == 1:
            only = lockins
    if which is None and count > 1:
        raise BadInput(
            f"{count} parts, with pauses between them or too long for one; choose one with --part 1 to {count}"
        )
    if which is not None:
        raise BadInput(f"--part {which}: expected 1{f' to {count}' if count > 1 else ', the only one'}")
    return only


def _chosen(lockins: "tuple[Recording, ...]", lockin: int | None) -> int:
    """Number of the chosen lock-in, from 0."""
    if lockin is None and len(lockins) > 1:
        raise BadInput(f"{len(lockins)} lock-ins; choose one with --lockin 1 to {len(lockins)}")
    if lockin is not None and lockin > len(lockins):
        raise BadInput(
            f"--lockin {lockin}: expected 1{f' to {len(lockins)}' if len(lockins) > 1 else ', the only one'}"
        )
    return (lockin or 1) - 1


def name_of(what: str) -> str:
    """Name of a recording in a title: its file, or its number in the log."""
    return f"recording {what}" if what.isdigit() and not Path(what).is_file() else Path(what).name
