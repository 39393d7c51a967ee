"""``sensorgen list``: what there is."""

import click

from sensorgen.cli import render
from sensorgen.cli.words import OneOf

KINDS = ("shapes", "materials", "printers", "qualities", "instruments", "devices", "packs", "models", "sources")


def _list(kind: str) -> None:
    """List what goes by a name.

    Shapes with their parameters, materials with every value and its source, printers, qualities, instruments, devices
    of the laboratory, packs, models, or what the sources stand for; with the pack that each comes from.
    """
    from sensorgen.cli import catalogue

    render.deliver((catalogue.all_packs if kind == "packs" else getattr(catalogue, kind))())


command = click.Command(
    "list", params=[click.Argument(["kind"], type=OneOf(KINDS)), *render.options("json", "markdown")], callback=_list,
    help=_list.__doc__,
)  # fmt: skip
