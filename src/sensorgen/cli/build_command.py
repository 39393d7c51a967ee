"""``sensorgen build``: all files of a design."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, body_options, render, settings, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.core.errors import Unprintable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--out", "-o"], default="out", show_default=True, metavar="DIR", help="Folder for the designs' folders."
    ),
    click.Option(["--no-cad"], is_flag=True, help="Skip the STEP file (saves about 3 s)."),
    click.Option(["--force"], is_flag=True, help="Write the files even if checks report errors."),
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    body_options.compensate_option(),
    click.Option(["--verify"], is_flag=True, help="Write nothing: compare the folder with its record and the log."),
    click.Option(["--details"], is_flag=True, help="Print all findings and the whole prediction."),
    click.Option(["--advise"], is_flag=True, help="Also try changes that remove findings, as sensorgen check does."),
    *settings.advice_options(),
    *render.options("json", "markdown", outputs=("--output",)),
]


def _work(
    design: "Design",
    *,
    out: str,
    no_cad: bool,
    force: bool,
    strict: bool,
    compensate: str | None,
    verify: bool,
    details: bool,
    advise: bool,
    budget: float,
    apply_change: int | None,
) -> int:
    from sensorgen.core import document
    from sensorgen.workflows.build import STEPS, Built, DetailedBuild, build

    if verify:
        return _verify(design, Path(out) / design.name)
    design, changes = body_options.compensated(design, compensate, design.walls)
    kind, budget_s = DetailedBuild if details else Built, budget if advise or apply_change else None

    def decided(built: Built) -> None:  # before the files, which take longer
        show.clear()
        render.deliver(kind(**vars(built)))

    try:
        with show.progress(STEPS) as step:
            built = build(
                design, Path(out), cad=not no_cad, force=force, strict=strict, compensated=changes, budget_s=budget_s,
                step=step, decided=decided if render.early() else lambda _: None,
            )  # fmt: skip
    except Unprintable as error:
        _refuse(design, error, budget_s, apply_change)
        if apply_change is None:
            raise
        return FOUND_ERRORS  # of the design as it was: the file has another one now
    if render.early():
        render.say("\n".join(document.text(built.written())))
    else:
        render.deliver(kind(**vars(built)))
    settings.applied(design, built.advice, apply_change)
    return 1 if built.verdict == "CHANGE" and not force else 0


def _refuse(design: "Design", error: Unprintable, budget_s: float | None, apply_change: int | None) -> None:
    """Deliver why a design is not built, and the changes that were tried."""
    from sensorgen.prediction.slices import reviewed
    from sensorgen.workflows.decision import STEPS, RefusedBuild, decision

    with show.progress(STEPS) as step:
        advice = decision(design, reviewed(design), budget_s, predict=bool(budget_s), step=step).advice
    render.deliver(RefusedBuild(design.name, tuple(error.findings), len(error.stopping), advice=advice))
    settings.applied(design, advice, apply_change)


def _verify(design: "Design", folder: Path) -> int:
    from sensorgen.cli import log_words
    from sensorgen.workflows.sealed import build_differences

    with log_words.existing(None) as log:
        found = build_differences(folder, design, log)
    render.deliver(found)
    return FOUND_ERRORS if found else 0


def _tiles(design: "Design", given: dict[str, Any]) -> "Sequence[Design]":
    """Tiles of an array that the bed does not hold, with a table of their places; else the design."""
    if not design.layout:
        return (design,)
    from sensorgen.core import document, files
    from sensorgen.workflows import tiles

    found = tiles.tiles(design)
    if not found:
        return (design,)
    where = Path(given["out"]) / f"{design.name}-tiles.csv"
    files.replace(where, document.comma_separated(tiles.table(found)).encode())
    render.say(f"{len(found)} tiles, as it does not fit the bed: {where}", err=bool(render.form()))
    return [tile for _, tile in found]


command = DesignGroup(
    _work, OWN, _tiles, name="build",
    help="Write everything that a design's print needs: 3MF, STEP, profiles, drawing, prediction.",
)  # fmt: skip
