"""``sensorgen schema``: what a design file may hold."""

import click


@click.command("schema", short_help="Print the JSON Schema of the design file.")
def command() -> None:
    """Print the JSON Schema of the design file, for editors that check while you type."""
    from sensorgen.cli import catalogue, show

    show.as_json(catalogue.schema())
