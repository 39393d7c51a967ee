"""``sensorgen list``: what there is."""

import click

KINDS = ("shapes", "materials", "printers", "qualities", "models")


@click.command("list", help="List the shapes, materials (with every value and its source), printers, qualities or models.")
@click.argument("kind", type=click.Choice(KINDS))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def command(kind: str, as_json: bool) -> None:
    """Print what goes by a name, with its first words."""
    from sensorgen import catalogue
    from sensorgen.cli import show

    entries = getattr(catalogue, kind)()
    if as_json:
        show.as_json(entries)
        return
    for name, entry in entries.items():
        click.echo(f"{click.style(name, bold=True):20} {entry['about']}")
        for line in entry.get("values", []):
            click.echo(f"    {line}")
