"""``sensorgen list``: what there is."""

import shutil
import textwrap

import click

from sensorgen.cli.words import OneOf

KINDS = ("shapes", "materials", "printers", "qualities", "models", "sources")


@click.command("list", short_help="List shapes, materials, printers, qualities, models or sources.")
@click.argument("kind", type=OneOf(KINDS))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def command(kind: str, as_json: bool) -> None:
    """List what goes by a name: shapes with their parameters, materials with every value and its source,
    printers, qualities, models, or the sources themselves.
    """
    from sensorgen import catalogue
    from sensorgen.cli import show

    entries = getattr(catalogue, kind)()
    if as_json:
        show.as_json(entries)
        return
    width = min(shutil.get_terminal_size((110, 24)).columns, 120)
    for name, entry in entries.items():
        first, *more = textwrap.wrap(entry["about"], width - 15) or [""]
        click.echo(click.style(f"{name:15}", bold=True) + first)
        for line in more:
            click.echo(" " * 15 + line)
        for line in entry.get("values", []):
            click.echo(textwrap.fill(line, width, initial_indent="    ", subsequent_indent=" " * 8))
