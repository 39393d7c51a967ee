"""``sensorgen batch``: a plan of several sensors to the files of one plate; and whether they are still the same."""

from pathlib import Path

import click
from click.shell_completion import CompletionItem

from sensorgen.cli import FOUND_ERRORS, log_words, render, show, sweeps
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.export.slicers import TIME_LIMIT_S


class _PlanGroup(click.Group):
    """A command whose first word is a plan's file, or ``verify``."""

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """``verify``, or the command for a plan."""
        return super().get_command(ctx, name) or _plan_command(name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Take the first word; an option in its place is the user's slip."""
        if args[0].startswith("-") and not ctx.resilient_parsing:
            raise BadInput(f"{args[0]} stands before the plan; write {ctx.command_path} PLAN.yaml {args[0]} ...")
        return args[0], self.get_command(ctx, args[0]), args[1:]

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Files, and ``verify``."""
        return [CompletionItem(incomplete, type="file"), *super().shell_complete(ctx, incomplete)]


def _plan_command(name: str) -> click.Command:
    return click.Command(
        name, callback=lambda **given: _make(name, **given), help="Write all files of a plan's plate.",
        params=[
            click.Option(
                ["--out"], default="out", show_default=True, metavar="DIR", help="Folder for batches' folders."
            ),
            click.Option(["--no-gcode"], is_flag=True, help="Leave out slicing, which takes most of the time."),
            click.Option(
                ["--time-limit", "time_limit_s"], type=float, default=TIME_LIMIT_S, show_default=True,
                metavar="SECONDS", help="End a slicer after this time.",
            ),
            click.Option(["--force"], is_flag=True, help="Write the files even if checks report errors."),
            click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
            *sweeps.workers("one"), *render.options(),
        ],
    )  # fmt: skip


def _make(
    plan: str, *, out: str, no_gcode: bool, time_limit_s: float, force: bool, strict: bool, jobs: int | None,
    cluster: str,
) -> int:  # fmt: skip
    from sensorgen.workflows.batch import STEPS, make

    if not 0 < time_limit_s < float("inf"):
        raise OutOfRange(f"--time-limit {time_limit_s:g}; expected seconds above 0")
    with log_words.existing(None) as log:
        head = log.head()[1] if log else ""
    with render.refused(Path(plan).stem), show.progress(STEPS) as step:
        made = make(
            Path(plan), Path(out), gcode=not no_gcode, time_limit_s=time_limit_s, force=force, strict=strict,
            log_head=head, jobs=jobs or 1, cluster=cluster, step=step,
        )  # fmt: skip
    render.deliver(made)
    return FOUND_ERRORS if made.errors(force=force) else 0


def _verify(folder: str, file: str | None) -> int:
    """Hash every file of a batch's folder again, and say what differs from its record; exit code 1 if anything does.

    The record itself is compared with the log, if that has the batch.
    """
    from sensorgen.workflows.batch.record import RECORD
    from sensorgen.workflows.sealed import batch_differences

    with log_words.existing(file) as log:
        found = batch_differences(Path(folder), RECORD, log)
    render.deliver(found)
    return FOUND_ERRORS if found else 0


command = _PlanGroup(
    "batch",
    commands=[
        click.Command(
            "verify",
            callback=_verify,
            help=_verify.__doc__,
            short_help="Hash every file again and say what differs.",
            params=[click.Argument(["folder"]), log_words.where(), *render.options("json", "markdown")],
        )
    ],
    options_metavar="",
    subcommand_metavar="{PLAN.yaml|verify} [OPTIONS]",
    context_settings={"ignore_unknown_options": True},
    help="""Put several sensors on one plate: 3MF, G-code, labels, and a record of what lies where.

    \b
    sensorgen batch plan.yaml            all files of the plan's plate
    sensorgen batch verify out/NAME      are they still what was written?

    docs/batch.md has an example of a plan.
    """,
    epilog="PLAN.yaml --help lists the options.",
)
