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
    """List what goes by a name.

    Shapes with their parameters, materials with every value and its source, printers, qualities, models, or what
    the sources stand for.
    """
    from sensorgen.cli import catalogue, show

    entries = getattr(catalogue, kind)()
    if as_json:
        show.as_json(entries)
        return
    width = min(shutil.get_terminal_size((110, 24)).columns, 120)
    indent = max(map(len, entries)) + 2
    for name, entry in entries.items():
        about = textwrap.fill(entry["about"], width, initial_indent=" " * indent, subsequent_indent=" " * indent)
        click.echo(click.style(f"{name:{indent}}", bold=True) + about[indent:])
        for line in entry.get("values", []):
            click.echo(textwrap.fill(line, width, initial_indent="    ", subsequent_indent=" " * 8))
