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
    """Run shape files, of a pack or one file, in sensorgen's own process from now on: without limits, and faster.

    Only with their content of now; a changed file is not trusted.
    """
    from sensorgen.core.errors import BadInput
    from sensorgen.design import shape_files
    from sensorgen.workflows.conformance import chosen

    files = [file for file in chosen(pack) if file.kind == "shapes" and file.pack.where != "shipped"]
    if not files:
        raise BadInput(f"{pack}: has no shapes; expected a pack with shapes, or a shape's file")
    for file in files:
        shape_files.trust(file.name, file.text())
        render.say(f"trusted: {file.path}")


_ARGUMENT = click.Argument(["pack"], metavar="PACK|FOLDER|FILE")
command = click.Group(
    "pack", help="Test packs of materials, shapes, printers, qualities and instruments; trust shape files.",
    commands=[
        click.Command(
            "test", callback=_test, help=_test.__doc__, short_help="Test a pack, its folder, or one file.",
            params=[_ARGUMENT, *render.options()],
        ),
        click.Command(
            "trust", callback=_trust, help=_trust.__doc__, short_help="Run shape files in sensorgen's own process.",
            params=[_ARGUMENT],
        ),
    ],
)  # fmt: skip
