"""``sensorgen schema``: JSON schemas of files."""

from typing import Any

import click

from sensorgen.cli import show


def _schema(name: str) -> dict[str, Any]:
    if name == "prediction":
        from sensorgen.prediction.results import adapter

        return adapter().json_schema(mode="serialization")
    from sensorgen.cli import catalogue

    return catalogue.schema()


@click.command("schema", help="Print the JSON schema of a design file or of prediction.json.")
@click.argument("of", type=click.Choice(["design", "prediction"]), default="design")
def command(of: str) -> None:
    """Print a schema."""
    show.as_json(_schema(of))
