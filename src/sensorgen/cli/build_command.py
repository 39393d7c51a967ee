"""``sensorgen build``: all files of a design."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.cli import FOUND_ERRORS, body_options, render, unread
from sensorgen.cli.body_options import Compensate
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Advising, Strict
from sensorgen.core.errors import Unprintable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sensorgen.design.design import Design


def _tiles(design: "Design", given: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, with a table of their places; else the design."""
    if not design.layout:
        return (design,)
    from sensorgen.core import document
    from sensorgen.workflows import tiles

    placed = tiles.tiles(design)
    if not placed:
        return (design,)
    where = Path(given["out"]) / f"{design.name}-tiles.csv"
    content = document.comma_separated(tiles.table(placed))
    render.file(where, content, f"{len(placed)} tiles, as it does not fit the bed: ")
    return [tile for _, tile in placed]


@of_design("build", *render.options("json", "markdown", outputs=("--output",)), parts=_tiles)
def command(
    design: "Design", *, out: Path = Path("out"), no_cad: bool = False, force: bool = False, strict: Strict = False,
    compensate: Compensate = "", verify: bool = False, details: bool = False, advise: bool = False, advising: Advising,
) -> int:  # fmt: skip
    """Write everything that a design's print needs: 3MF, STEP, profiles, drawing, prediction.

    Parameters
    ----------
    out, --out, -o : DIR
        Folder for the designs' folders.
    no_cad
        Skip the STEP file (saves about 3 s).
    force
        Write the files even if checks report errors.
    verify
        Write nothing: compare the folder with its record and the log.
    details
        Print all findings and the whole prediction.
    advise
        Also try changes that remove findings, as sensorgen check does.
    """
    from sensorgen.core import document
    from sensorgen.workflows.build import STEPS, Built, DetailedBuild, build

    if verify:
        return _verify(design, out / design.name)
    design, changes = body_options.compensated(design, compensate, design.walls)
    kind, budget_s = DetailedBuild if details else Built, advising.budget if advise or advising.apply else None

    def decided(built: Built) -> None:  # before the files, which take longer
        render.clear()
        with unread():
            render.deliver(kind(**vars(built)))

    try:
        with render.progress(STEPS) as step:
            built = build(
                design, out, cad=not no_cad, force=force, strict=strict, compensated=changes, budget_s=budget_s,
                step=step, decided=decided if render.early() else lambda _: None,
            )  # fmt: skip
    except Unprintable as error:
        return _refuse(design, error, budget_s, advising)
    if render.early():
        render.say("\n".join(document.text(built.written())))
    else:
        render.deliver(kind(**vars(built)))
    advising.write(design, built.advice)
    return 1 if built.verdict == "CHANGE" and not force else 0


def _refuse(design: "Design", error: Unprintable, budget_s: float | None, advising: Advising) -> int:
    """Deliver why a design is not built, and the changes that were tried; raise the error unless one is applied."""
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows.decision import STEPS, RefusedBuild, decision

    with render.progress(STEPS) as step:
        advice = decision(design, reviewed(design), budget_s, predict=bool(budget_s), step=step).advice
    render.deliver(RefusedBuild(design.name, tuple(error.findings), len(error.stopping), advice=advice))
    advising.write(design, advice)
    if advising.apply is None:
        raise error
    return FOUND_ERRORS  # of the design as it was: the file has another one now


def _verify(design: "Design", folder: Path) -> int:
    from sensorgen.cli.options import LogFile
    from sensorgen.workflows.sealed import build_differences

    with LogFile().existing() as log:
        differences = build_differences(folder, design, log)
    render.deliver(differences)
    return FOUND_ERRORS if differences else 0
