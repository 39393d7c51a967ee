"""``sensorgen pack``: test packs, and trust shape files."""

import click

from sensorgen.cli import FOUND_ERRORS, render, show
from sensorgen.cli.commands import command as of_function

command = click.Group(
    "pack", help="Test packs of materials, shapes, printers, qualities and instruments; trust shape files."
)


@of_function("test", *render.options(), group=command, short="Test a pack, its folder, or one file.")
def _test(pack: str) -> int:
    """Test a pack, its folder, or one file: values and their sources, scenes, profiles, start and end code.

    Exit code 1 with findings.

    Parameters
    ----------
    pack : PACK|FOLDER|FILE
    """
    from sensorgen.workflows.conformance import conformance

    with show.progress(()) as step:
        tested = conformance(pack, step)
    render.deliver(tested)
    return FOUND_ERRORS if tested.findings else 0


@of_function("trust", group=command, short="Let shape files run, as they are now.")
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
