"""``sensorgen new|pack|list|schema|completion``: files of your own, what there is, and the form of files."""

import json
from typing import TYPE_CHECKING, Annotated, Any

import click
from click.shell_completion import get_completion_class

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.commands import command as of_function
from sensorgen.core.options import Argument

if TYPE_CHECKING:
    from sensorgen.cli.catalogue import Catalogue
    from sensorgen.core.document import Documented


TEMPLATES = ("material", "shape", "printer", "quality", "instrument", "design", "target", "experiment")


@of_function("new", *render.options("json", file=False))
def new_command(kind: Annotated[Any, Argument(kind=TEMPLATES)], name: str, *, pack: str = "") -> "Documented":
    """Write a commented file of your own to change, as a material, a shape, a design or an experiment.

    A design, target or experiment goes to the working folder; what designs name to a folder of its kind in it, as
    materials/NAME.yaml, or with --pack to one of your packs, for all designs. An existing file is never replaced.

    Parameters
    ----------
    kind : {material|shape|printer|quality|instrument|design|target|experiment}
    pack : PACK
        One of your packs, in place of the working folder.
    """
    from sensorgen.workflows.templates import new

    return new(kind, name, pack)


pack_command = click.Group(
    "pack", help="Test packs of materials, shapes, printers, qualities and instruments; trust shape files."
)


@of_function("test", *render.options(), group=pack_command, short="Test a pack, its folder, or one file.")
def _test(pack: str) -> int:
    """Test a pack, its folder, or one file: values and their sources, scenes, profiles, start and end code.

    Exit code 1 with findings.

    Parameters
    ----------
    pack : PACK|FOLDER|FILE
    """
    from sensorgen.workflows.conformance import conformance

    with render.progress(()) as step:
        tested = conformance(pack, step)
    render.deliver(tested)
    return FOUND_ERRORS if tested.findings else 0


@of_function("trust", group=pack_command, short="Let shape files run, as they are now.")
def _trust(pack: str) -> None:
    """Let shape files run: of a pack, one file, or a design that contains its shape. Read them first.

    Only with their content of now; a changed file is not trusted. They run confined: on Linux they can open no file,
    network or process; docs/packs.md states what other systems lack.

    Parameters
    ----------
    pack : PACK|FOLDER|FILE
    """
    from sensorgen.core import confine
    from sensorgen.workflows.conformance import trust

    for path in trust(pack):
        render.say(f"trusted: {path}")
    if not confine.available():
        render.say("this system cannot confine it: it runs with your rights")


LISTS = ("shapes", "materials", "printers", "qualities", "instruments", "devices", "packs", "models", "sources")


@of_function("list", *render.options("json", "markdown"))
def list_command(kind: Annotated[str, Argument(kind=LISTS)]) -> "Catalogue":
    """List what goes by a name.

    Shapes with their parameters, materials with every value and its source, printers, qualities, instruments, devices
    of the laboratory, packs, models, or what the sources stand for; with the pack that each comes from.

    Parameters
    ----------
    kind
    """
    from sensorgen.cli import catalogue

    listed: Catalogue = (catalogue.all_packs if kind == "packs" else getattr(catalogue, kind))()
    return listed


@of_function("schema", render.options()[-1])
def schema_command(
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
        from sensorgen.core.records import adapter
        from sensorgen.prediction.results import Prediction

        schema = adapter(Prediction).json_schema(mode="serialization")
    render.write([json.dumps(schema, indent=2, ensure_ascii=False), "\n"])


@of_function("completion")
def completion_command(shell: Annotated[str, Argument(kind=("bash", "zsh", "fish"))]) -> None:
    """Print the completion script for a shell.

    \b
    bash:  eval "$(sensorgen completion bash)"
    zsh:   eval "$(sensorgen completion zsh)"
    fish:  sensorgen completion fish | source
    """  # noqa: D301 - click reads the backspace
    from sensorgen.cli import cli

    kind = get_completion_class(shell)
    if kind:  # click knows the three
        click.echo(kind(cli, {}, "sensorgen", "_SENSORGEN_COMPLETE").source())
