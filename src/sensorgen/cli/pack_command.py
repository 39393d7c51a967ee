"""``sensorgen pack``: test packs, and trust shape files."""

import click

from sensorgen.cli import FOUND_ERRORS, render, show


def _test(pack: str) -> int:
    """Test a pack, its folder, or one file: values and their sources, scenes, profiles, start and end code.

    Exit code 1 with findings.
    """
    from sensorgen.workflows.conformance import conformance

    with show.progress(()) as step:
        made = conformance(pack, step)
    render.deliver(made)
    return FOUND_ERRORS if made.findings else 0


def _trust(pack: str) -> None:
    """Let shape files run: of a pack, one file, or a design that contains its shape. Read them first.

    Only with their content of now; a changed file is not trusted. They run confined: on Linux they can open no file,
    network or process; docs/packs.md states what other systems lack.
    """
    from sensorgen.core import confine
    from sensorgen.workflows.conformance import trust

    for path in trust(pack):
        render.say(f"trusted: {path}")
    if not confine.available():
        render.say("this system cannot confine it: it runs with your rights")


_ARGUMENT = click.Argument(["pack"], metavar="PACK|FOLDER|FILE")
command = click.Group(
    "pack", help="Test packs of materials, shapes, printers, qualities and instruments; trust shape files.",
    commands=[
        click.Command(
            "test", callback=_test, help=_test.__doc__, short_help="Test a pack, its folder, or one file.",
            params=[_ARGUMENT, *render.options()],
        ),
        click.Command(
            "trust", callback=_trust, help=_trust.__doc__, short_help="Let shape files run, as they are now.",
            params=[_ARGUMENT],
        ),
    ],
)  # fmt: skip
