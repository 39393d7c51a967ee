"""``sensorgen build``: all files of a design."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import asprinted_text, show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    click.Option(["--out"], default="out", show_default=True, metavar="DIR", help="Folder for the designs' folders."),
    click.Option(["--no-cad"], is_flag=True, help="Skip the STEP file (saves about 3 s)."),
    click.Option(["--force"], is_flag=True, help="Write the files even if checks report errors."),
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    asprinted_text.compensate_option(),
    click.Option(["--details"], is_flag=True, help="Print all findings and the whole prediction."),
    click.Option(["--json", "as_json"], is_flag=True, help="Print the result as JSON."),
]


def _work(
    design: "Design", *, out: str, no_cad: bool, force: bool, strict: bool, compensate: str | None, details: bool,
    as_json: bool,
) -> int:  # fmt: skip
    from sensorgen.core import document
    from sensorgen.core import files as store
    from sensorgen.core.errors import Unprintable
    from sensorgen.workflows.build import STEPS, as_dict, build

    design, changes = asprinted_text.compensated(design, compensate, "arachne", silent=as_json)
    try:
        with show.progress(STEPS) as step:
            built = build(design, Path(out), cad=not no_cad, force=force, strict=strict, step=step)
    except Unprintable as error:
        if as_json:
            show.as_json({"name": design.name, "folder": None, "findings": [f.as_dict() for f in error.findings]})
        else:
            click.echo(f"CHANGE  {design.name}\n")
            show.findings(error.findings)
        raise
    code = 1 if built.review.lost() and not force else 0
    files = sorted([*store.listed(built.folder), store.MANIFEST])
    if as_json:
        show.as_json(as_dict(design, built, files) | {"compensated": changes})
        return code
    click.echo(f"{built.verdict}  {design.name}: {show.summary(built.review)}\n")
    if details:
        show.findings(built.review.findings)
        click.echo("\n".join(("", *document.text(built.prediction.document()))))
    else:
        click.echo("\n".join(document.text([*built.prediction.summary(), ""])))
        show.findings(show.most_severe(built.review.findings, 3))
    click.echo(f"\n{built.folder}: {len(files)} files; {'' if details else '--details prints all'}".rstrip("; "))
    return code


command = DesignGroup(
    _work, OWN, name="build",
    help="Write everything that a design's print needs: 3MF, STEP, profiles, drawing, prediction.",
    short_help="Write all that a print needs: 3MF, STEP, profiles, drawing.",
)  # fmt: skip
