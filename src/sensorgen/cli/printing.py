"""``sensorgen check|build|slice|batch|optimise``: whether to print a design, files of its print, better designs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from sensorgen.cli import FOUND_ERRORS, render, unread
from sensorgen.cli.commands import FirstWord
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import Compensate, compensated, of_design
from sensorgen.cli.options import Advising, Cluster, DesignTip, Jobs, LogFile, NoCache, Out, Strict, TimeLimit
from sensorgen.core.errors import Unprintable
from sensorgen.core.options import Option
from sensorgen.design.walls import SLICERS
from sensorgen.export.slicers import TIME_LIMIT_S

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sensorgen.core.document import Documented, Part
    from sensorgen.design.design import Design
    from sensorgen.workflows.sealed import Differences


def _tiles(design: "Design", _: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, one of each kind; else the array."""
    from sensorgen.workflows.tiles import tiles

    kinds = {(t.rows, t.columns, str(each.parameters["seams"])): each for t, each in reversed(tiles(design))}
    return sorted(kinds.values(), key=lambda each: each.parameters["tile"]) or (design,)


@of_design("check", *render.options(), tip=True, parts=_tiles)
def check_command(design: "Design", advising: Advising, *, strict: Strict = False) -> int:
    """Decide whether to print a design: check it against nozzle, layers and bed, predict it, and try changes."""
    from sensorgen.checks.review import STEPS
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows import decision

    budget_s = advising.budget
    with (
        decision.beside(design, predict=budget_s > 0) as predicted_ahead,
        render.progress((*STEPS, *decision.STEPS)) as step,
    ):
        review = reviewed(design, step)
        predicted_ahead()
        decided = decision.decision(design, review, budget_s, predict=budget_s > 0, step=step, decided=_shown)
    if not render.early():
        render.deliver(decided)
    elif decided.advice:
        render.deliver(decided.advice, before=("",))
    if decided.findings and render.early():
        render.say("each finding in its place, in 3D, drawing and layers: sensorgen show")
    advising.write(design, decided.advice)
    return 1 if review.errors(strict) or review.verdict == "CHANGE" else 0


def _shown(decided: "Documented", shown: "Iterable[Part] | None" = None) -> None:
    """Deliver what is decided to a terminal, before what takes longer."""
    if render.early():
        render.clear()
        with unread():
            render.deliver(decided, shown=shown)


def _all_tiles(design: "Design", given: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, with a table of their places; else the array."""
    from sensorgen.core import document
    from sensorgen.workflows import tiles

    placed = tiles.tiles(design)
    if not placed:
        return (design,)
    where = Path(given["out"]) / f"{design.name}-tiles.csv"
    content = document.comma_separated(document.Table.of("tiles", "", [tile for tile, _ in placed]))
    render.file(where, content, f"{len(placed)} tiles, as it does not fit the bed: ")
    return [tile for _, tile in placed]


@of_design("build", *render.options("json", "markdown", folder=True), parts=_all_tiles)
def build_command(
    design: "Design", *, out: Out = Path("out"), no_cad: bool = False, force: bool = False, strict: Strict = False,
    compensate: Compensate = "", verify: bool = False, details: bool = False, advise: bool = False, advising: Advising,
) -> int:  # fmt: skip
    """Write everything that a design's print needs: 3MF, STEP, profiles, drawing, prediction.

    Parameters
    ----------
    out
        Folder for the designs' folders.
    no_cad
        Skip the STEP file (saves about 3 s).
    force
        Write the files even if checks report errors, and end with exit code 0.
    verify
        Write nothing: compare the folder with its record and the log.
    details
        Print all findings and the whole prediction.
    advise
        Also try changes that remove findings, as sensorgen check does.
    """
    from sensorgen.core import document
    from sensorgen.workflows.build import STEPS, Built, build

    if verify:
        from sensorgen.workflows.sealed import build_differences

        with LogFile().existing() as log:
            return _told(build_differences(out / design.name, design, log))
    asked = design
    design, changes = compensated(design, compensate)
    budget_s = advising.budget if advise or advising.apply else None

    def parts(built: Built) -> "Iterable[Part]":
        return built.details() if details else built.document()

    try:
        with render.progress(STEPS) as step:
            built = build(
                design, out, cad=not no_cad, force=force, strict=strict, compensated=changes,
                asked=asked if changes else None, budget_s=budget_s, step=step,
                decided=lambda built: _shown(built, parts(built)),
            )  # fmt: skip
    except Unprintable as error:
        return _refuse(design, error, budget_s, advising)
    if render.early():
        render.say("\n".join(document.text(built.written())))
    else:
        render.deliver(built, shown=parts(built))
    advising.write(design, built.advice)
    return 1 if built.verdict == "CHANGE" and not force else 0


def _refuse(design: "Design", error: Unprintable, budget_s: float | None, advising: Advising) -> int:
    """Deliver why a design is not built, and the changes that were tried; raise the error unless one is applied."""
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows.decision import STEPS, RefusedBuild, decision

    with render.progress(STEPS) as step:
        advice = decision(design, reviewed(design), budget_s, predict=bool(budget_s), step=step).advice
    render.deliver(RefusedBuild(design.name, tuple(error.findings), len(error.stopping), error.source, advice=advice))
    advising.write(design, advice)
    if advising.apply is None:
        raise error
    return FOUND_ERRORS  # of the design as it was: the file has another one now


def _told(differences: "Differences") -> int:
    """Deliver how a folder differs from its record; the exit code."""
    render.deliver(differences)
    return FOUND_ERRORS if differences else 0


@of_design("slice", *render.options("json", "markdown", folder=True))
def slice_command(
    design: "Design", *, slicer: Annotated[str, Option(kind=tuple(SLICERS))] = "prusa", program: str = "",
    time_limit_s: TimeLimit = TIME_LIMIT_S, out: Out = Path("out"), force: bool = False, strict: Strict = False,
    compensate: Compensate = "",
) -> int:  # fmt: skip
    """Slice a design with a real slicer, and write G-code that the printer takes as it is.

    The file is checked, also against the design. One with errors is written as NAME.SLICER.refused.gcode, whatever
    --force says, and an earlier NAME.SLICER.gcode is removed: a file of that name has always passed.

    Parameters
    ----------
    slicer
        PrusaSlicer (2.5 or later), or CuraEngine (4.13 or later).
    program : PATH
        The slicer's program; the one on PATH if not given.
    out
        Folder for the designs' folders.
    force
        Slice even if checks of the design report errors, and end with exit code 0 if the file has none.
    """
    from sensorgen.export.slicing import STEPS
    from sensorgen.workflows.slice import slice_design

    design, changes = compensated(design, compensate, slicer, program)
    with render.refused(design.name), render.progress(("checks", *STEPS)) as step:
        gcode = slice_design(
            design, out, slicer, program=program, time_limit_s=time_limit_s, force=force, strict=strict,
            compensated=changes, step=step,
        )  # fmt: skip
    render.deliver(gcode)
    return 1 if gcode.refused or (gcode.verdict == "CHANGE" and not force) else 0


Sample = Annotated[int | None, Option(kind=click.IntRange(1, 20_000))]  # fmt: skip


@of_function("optimise", *render.options(csv="Print every design as CSV, all digits.", folder=True))
def optimise_command(
    target: str, *, out: Out = Path("out"), sample: Sample = None, tip: DesignTip = None, jobs: Jobs = None,
    cluster: Cluster = "", no_cache: NoCache = False, no_build: bool = False, no_gcode: bool = False,
) -> int:  # fmt: skip
    """Find the designs of a space that no other is better than, as printed, and write the files of up to three.

    Every combination of the target's values is checked, bounded or evaluated; each one that is out has its reason. Of a
    shape or a design, designs like it are tried for the best resolutions; docs/optimise.md has a target. A search that
    was stopped goes on where it was. Exit code 1 where no design meets the target.

    Parameters
    ----------
    target : {SHAPE|DESIGN.yaml|TARGET.yaml}
    out
        Folder of all files.
    sample : N
        Try N designs that NSGA-II chooses, of a space too large to try all; nothing is then proven.
    no_build
        Do not build the recommended designs.
    no_gcode
        Do not slice them.
    """
    from sensorgen.workflows.optimise.front import Workers
    from sensorgen.workflows.optimise.run import optimise

    with render.counted() as step:
        designs = optimise(
            target, out, Workers(render.at_once(jobs), cluster), count=sample or 0,
            keep=not no_cache, built=not no_build, sliced=not no_gcode, tip=tip, progress=step,
        )  # fmt: skip
    render.deliver(designs)
    return render.verdict(*(() if designs.front else ("no design meets the target",)))


PlateJobs = Annotated[int, Option(kind=click.IntRange(1, 64), typed="")]


def _plan(
    name: str, *, out: Out = Path("out"), no_gcode: bool = False, time_limit_s: TimeLimit = TIME_LIMIT_S,
    force: bool = False, strict: Strict = False, jobs: PlateJobs = 1, cluster: Cluster = "",
) -> int:  # fmt: skip
    """Write all files of a plan's plate.

    Parameters
    ----------
    out
        Folder for batches' folders.
    no_gcode
        Leave out slicing, which takes most of the time.
    force
        Write the files even if checks report errors, and end with exit code 0 if the G-code has none.
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


batch_command = FirstWord(
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
    "verify",
    *render.options("json", "markdown"),
    group=batch_command,
    short="Hash every file again and say what differs.",
)
def _verify_batch(folder: Path, log: LogFile) -> int:
    """Hash every file of a batch's folder again, and say what differs from its record; exit code 1 if anything does.

    The record itself is compared with the log, if that has the batch.

    Parameters
    ----------
    folder
    """
    from sensorgen.workflows.batch.record import RECORD
    from sensorgen.workflows.sealed import batch_differences

    with log.existing() as rows:
        return _told(batch_differences(folder, RECORD, rows))
