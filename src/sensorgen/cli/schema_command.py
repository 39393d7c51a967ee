"""``sensorgen schema``: JSON schemas of files."""

import json

import click

from sensorgen.cli import render


def _schema(of: str) -> None:
    """Print a schema."""
    if of == "design":
        from sensorgen.cli import catalogue

        found = catalogue.schema()
    elif of == "target":
        from sensorgen.workflows.optimise.target import Target

        found = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Target.model_json_schema()}
    elif of == "experiment":
        from sensorgen.measure.lab.experiment import Experiment

        found = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Experiment.model_json_schema()}
    else:
        from sensorgen.prediction.results import adapter

        found = adapter().json_schema(mode="serialization")
    render.write([json.dumps(found, indent=2, ensure_ascii=False), "\n"])


command = click.Command(
    "schema", callback=_schema, help=_schema.__doc__,
    params=[
        click.Argument(["of"], type=click.Choice(["design", "target", "experiment", "prediction"]), default="design"),
        render.options()[-1],
    ],
)  # fmt: skip
