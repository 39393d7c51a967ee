"""Log that commands read and write, and columns of files that are logged."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli.words import pairs

if TYPE_CHECKING:
    from sensorgen.measure.log import Log


@dataclass(frozen=True)
class LogFile:
    """The log that ``--log`` names, or the usual one.

    Attributes
    ----------
    file, --log : FILE
        The log; what SENSORGEN_LOG says, or the one of this user, if not given.
    """

    file: Path | None = None

    def opened(self, *, create: bool = False) -> "Log":
        """Open the log."""
        from sensorgen.measure.log import Log, place

        return Log(self.file or place(), create=create)

    def of_command(self, *, create: bool = False) -> "Log":
        """The log, open until the command has ended."""
        log: Log = click.get_current_context().with_resource(self.opened(create=create))
        return log

    @contextmanager
    def existing(self) -> Iterator["Log | None"]:
        """The log, or None where ``--log`` names none and there is none yet."""
        from sensorgen.measure.log import place

        if self.file is None and not place().exists():
            yield None
            return
        with self.opened() as log:
            yield log


@dataclass(frozen=True)
class ColumnNames:
    """Names of columns in an instrument's CSV, and in a rig's log.

    Attributes
    ----------
    columns, --column : OURS=THEIRS
        Column of the readings' file, if it is CSV and calls it otherwise: time_s, stamp_s, re_ohm_1.1kHz ...
    rig_columns, --rig-column : OURS=THEIRS
        Column of the rig's log: time_s, set_force_n, set_position_mm, force_n, error.
    """

    columns: tuple[str, ...] = ()  # fmt: skip
    rig_columns: tuple[str, ...] = ()  # fmt: skip

    def of_readings(self) -> dict[str, str]:
        """Names in the readings' file to ours."""
        return {theirs: ours for ours, theirs in pairs(self.columns, "--column")}

    def of_rig(self) -> dict[str, str]:
        """Names in the rig's log to ours."""
        return {theirs: ours for ours, theirs in pairs(self.rig_columns, "--rig-column")}
