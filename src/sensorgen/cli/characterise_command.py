"""``sensorgen characterise``: a plate of test structures, and material values from its readings."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import render
from sensorgen.cli.commands import FirstWord
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.options import DryRun, Out
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.core.document import Documented


class _PrinterGroup(FirstWord):
    """A command whose first word is a printer, or ``read``."""

    thing, form = "printer", "PRINTER MATERIALS {option}"

    def of(self, name: str) -> click.Command:
        """The command for a printer."""

        @of_function(name, *render.options(folder=True))
        def printer(
            materials: tuple[str, ...], *, quality: str = "fine", tools: tuple[str, ...] = (), plate: str = "",
            count: int = 12, hours: float = 4.0, out: Out = Path("out"),
        ) -> "Documented":  # fmt: skip
            """Choose coupons and write their plate's files.

            Parameters
            ----------
            materials : MATERIALS
            quality : NAME
                Print quality.
            tools, --tool : MATERIAL=NUMBER
                Tool of a material.
            plate, --name : NAME
                Of the plate, and of its folder.
            count
                Most coupons.
            hours
                Longest print [h].
            out
                Folder of plates.
            """
            from sensorgen.workflows.characterise import STEPS, Study, plan

            pairs = {word: word.partition("=") for word in tools}
            if wrong := next((word for word, (_, _, number) in pairs.items() if not number.isdigit()), None):
                raise BadInput(f"--tool {wrong!r}; expected MATERIAL=NUMBER, as in etpu=3")
            names = [material for word in materials for material in word.split(",")]
            numbers = {key: int(number) for key, _, number in pairs.values()}
            with render.progress(STEPS) as step:
                study = Study.of(name, names, quality=quality, tools=numbers)
                return plan(study, out, name=plate, count=count, hours=hours, step=step)

        return printer


command = _PrinterGroup(
    "characterise",
    subcommand_metavar="{PRINTER MATERIALS|read FORM} [OPTIONS]",
    help="""Print test structures (coupons), and turn their readings into material values.

    \b
    sensorgen characterise diabase-h5 etpu x60      plate, form, intervals
    sensorgen characterise read out/NAME/form.yaml  values: etpu@lab-NAME

    docs/characterise.md explains the coupons.
    """,
    epilog="PRINTER MATERIALS --help lists the options.",
)


@of_function("read", *render.options(file=False), group=command, short="Values from a filled-in form.")
def _read(
    form: Path, *, name: str = "", picture: Path | None = None, force: bool = False, dry_run: DryRun = False,
) -> "Documented":  # fmt: skip
    """Evaluate a form that was filled in: values with 95 % intervals, kept as a source that designs can name.

    Gaps are allowed. A coupon that contradicts the others is left out, with the probability that it is broken.

    Parameters
    ----------
    form
    name : SOURCE
        As in etpu@SOURCE; else from the plate.
    picture : FILE
        Draw the intervals before and after, as SVG.
    force
        Replace a source of that name.
    """
    from sensorgen.core import files
    from sensorgen.workflows.characterise import read
    from sensorgen.workflows.characterise.intervals import svg

    values = read(form, name, keep=not dry_run, force=force)
    if picture:
        files.replace(picture, svg(values.source, values.rows).encode())
    return values
