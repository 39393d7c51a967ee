"""``sensorgen new``: a file of one's own."""

from typing import Any

import click

from sensorgen.cli import render
from sensorgen.cli.words import OneOf

KINDS = ("material", "shape", "printer", "quality", "instrument", "design", "target", "experiment")


def _new(what: Any, name: str, pack: str) -> None:
    """Write a commented file of your own to change, as a material, a shape, a design or an experiment.

    It goes to a folder of its kind in the working folder, as materials/NAME.yaml, where designs in this folder take it
    by its name; with --pack to one of your packs, for all designs. An existing file is never replaced.
    """
    from sensorgen.workflows.templates import new

    render.deliver(new(what, name, pack))


command = click.Command(
    "new", callback=_new, help=_new.__doc__,
    params=[
        click.Argument(["what"], type=OneOf(KINDS), metavar="{" + "|".join(KINDS) + "}"), click.Argument(["name"]),
        click.Option(["--pack"], default="", metavar="PACK", help="One of your packs, in place of the working folder."),
        *render.options("json", file=False),
    ],
)  # fmt: skip
