"""``sensorgen log``: what was measured of printed specimens, kept for good."""

from typing import Any

import click

from sensorgen.cli import log_read, log_write
from sensorgen.core.errors import UnknownName


class _Group(click.Group):
    """The commands in the order in which they are used; the nearest is offered where another is typed."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        return list(self.commands)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        args = ["add", *args[1:]] if args[0] == "multimeter" else args  # its name in version 0.1.0
        if not ctx.resilient_parsing and not args[0].startswith("-") and args[0] not in self.commands:
            raise UnknownName("command of log", args[0], self.commands)
        return super().resolve_command(ctx, args)


@click.group("log", cls=_Group)
def command() -> None:
    """Log of readings, recordings, prints and predictions.

    Readings of a multimeter, recordings of the bench and what was predicted, in one file that only grows: nothing is
    taken out, and a correction is a new row.
    """


for _each in (
    log_write.specimen, log_write.add, log_write.table, log_write.bench, log_write.predict, log_write.withdrawing,
    log_read.listing, log_read.showing, log_read.exporting, log_read.verifying, log_read.heading, log_read.anchoring,
    log_read.syncing, log_read.backing_up, log_read.restoring,
):  # fmt: skip
    command.add_command(_each)
