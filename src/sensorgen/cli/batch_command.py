"""``sensorgen batch``: a plan of several sensors to the files of one plate; and whether they are still the same."""

from pathlib import Path
from typing import Annotated

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import FirstWord
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import Cluster, LogFile, Out, Strict, TimeLimit
from sensorgen.core.options import Option
from sensorgen.export.slicers import TIME_LIMIT_S

Jobs = Annotated[int, Option(kind=click.IntRange(1, 64), typed="")]


def _plan(
    name: str, *, out: Out = Path("out"), no_gcode: bool = False, time_limit_s: TimeLimit = TIME_LIMIT_S,
    force: bool = False, strict: Strict = False, jobs: Jobs = 1, cluster: Cluster = "",
) -> int:  # fmt: skip
    """Write all files of a plan's plate.

    Parameters
    ----------
    out
        Folder for batches' folders.
    no_gcode
        Leave out slicing, which takes most of the time.
    force
        Write the files even if checks report errors.
    jobs : N
        Processes at once; one if not given.
    """
    from sensorgen.workflows.batch import STEPS, make

    with LogFile().existing() as log:
        head = log.head()[1] if log else ""
    with render.refused(Path(name).stem), render.progress(STEPS) as step:
        batch = make(
            Path(name), out, gcode=not no_gcode, time_limit_s=time_limit_s, force=force, strict=strict,
            log_head=head, jobs=jobs, cluster=cluster, step=step,
        )  # fmt: skip
    render.deliver(batch)
    return FOUND_ERRORS if batch.errors(force=force) else 0


command = FirstWord(
    "batch",
    _plan,
    *render.options(folder=True),
    thing="plan",
    form="PLAN.yaml {option} ...",
    subcommand_metavar="{PLAN.yaml|verify} [OPTIONS]",
    help="""Put several sensors on one plate: 3MF, G-code, labels, and a record of what lies where.

    \b
    sensorgen batch plan.yaml            all files of the plan's plate
    sensorgen batch verify out/NAME      are they still what was written?

    docs/batch.md has an example of a plan.
    """,
    epilog="PLAN.yaml --help lists the options.",
)


@of_function(
    "verify", *render.options("json", "markdown"), group=command, short="Hash every file again and say what differs."
)
def _verify(folder: Path, log: LogFile) -> int:
    """Hash every file of a batch's folder again, and say what differs from its record; exit code 1 if anything does.

    The record itself is compared with the log, if that has the batch.

    Parameters
    ----------
    folder
    """
    from sensorgen.workflows.batch.record import RECORD
    from sensorgen.workflows.sealed import batch_differences

    with log.existing() as rows:
        differences = batch_differences(folder, RECORD, rows)
    render.deliver(differences)
    return FOUND_ERRORS if differences else 0
