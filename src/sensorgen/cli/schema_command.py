"""``sensorgen schema``: JSON schemas of files."""

import json
from typing import Annotated

import click

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.core.options import Argument


@of_function("schema", render.options()[-1])
def command(
    of: Annotated[str, Argument(kind=click.Choice(["design", "target", "experiment", "prediction"]))] = "design",
) -> None:  # fmt: skip
    """Print a schema.

    Parameters
    ----------
    of
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    if of == "design":
        from sensorgen.cli import catalogue

        schema = catalogue.schema()
    elif of == "target":
        from sensorgen.workflows.optimise.target import Target

        schema = {**head, **Target.model_json_schema()}
    elif of == "experiment":
        from sensorgen.measure.lab.experiment import Experiment

        schema = {**head, **Experiment.model_json_schema()}
    else:
        from sensorgen.prediction.results import adapter

        schema = adapter().json_schema(mode="serialization")
    render.write([json.dumps(schema, indent=2, ensure_ascii=False), "\n"])
