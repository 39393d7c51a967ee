"""``sensorgen characterise``: a plate of test structures, and material values from its readings."""

from pathlib import Path

import click

from sensorgen.cli import render, show
from sensorgen.core.errors import BadInput


class _PrinterGroup(click.Group):
    """A command whose first word is a printer, or ``read``."""

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """``read``, or the command for a printer."""
        return super().get_command(ctx, name) or _printer_command(name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Take the first word; an option in its place is the user's slip."""
        if args[0].startswith("-") and not ctx.resilient_parsing:
            raise BadInput(f"{args[0]} stands before the printer; write {ctx.command_path} PRINTER MATERIALS {args[0]}")
        return args[0], self.get_command(ctx, args[0]), args[1:]


def _printer_command(printer: str) -> click.Command:
    return click.Command(
        printer, callback=lambda **given: _plan(printer, **given), help="Choose coupons and write their plate's files.",
        params=[
            click.Argument(["materials"], nargs=-1, required=True, metavar="MATERIALS"),
            click.Option(["--quality"], default="fine", show_default=True, metavar="NAME", help="Print quality."),
            click.Option(["--tool"], multiple=True, metavar="MATERIAL=NUMBER", help="Tool of a material."),
            click.Option(["--name"], default="", metavar="NAME", help="Of the plate, and of its folder."),
            click.Option(["--count"], type=int, default=12, show_default=True, help="Most coupons."),
            click.Option(["--hours"], type=float, default=4.0, show_default=True, help="Longest print [h]."),
            click.Option(["--out"], default="out", show_default=True, metavar="DIR", help="Folder of plates."),
            *render.options(),
        ],
    )  # fmt: skip


def _plan(
    printer: str, *, materials: tuple[str, ...], quality: str, tool: tuple[str, ...], name: str, count: int,
    hours: float, out: str,
) -> None:  # fmt: skip
    from sensorgen.workflows.characterise import STEPS, Study, plan

    pairs = [pair.partition("=") for pair in tool]
    if wrong := next((word for word, (_, _, number) in zip(tool, pairs, strict=True) if not number.isdigit()), None):
        raise BadInput(f"--tool {wrong!r}; expected MATERIAL=NUMBER, as in etpu=3")
    names = [name for word in materials for name in word.split(",")]
    with show.progress(STEPS) as step:
        study = Study.of(printer, names, quality=quality, tools={key: int(number) for key, _, number in pairs})
        made = plan(study, Path(out), name=name, count=count, hours=hours, step=step)
    render.deliver(made)


def _read(form: str, name: str, picture: str | None, *, dry_run: bool, force: bool) -> None:
    """Evaluate a form that was filled in: values with 95 % intervals, kept as a source that designs can name.

    Gaps are allowed. A coupon that contradicts the others is left out, with the probability that it is broken.
    """
    from sensorgen.core import files
    from sensorgen.workflows.characterise import read
    from sensorgen.workflows.characterise.intervals import svg

    found = read(Path(form), name, keep=not dry_run, force=force)
    if picture:
        files.replace(Path(picture), svg(found.source, found.rows).encode())
    render.deliver(found)


command = _PrinterGroup(
    "characterise",
    commands=[
        click.Command(
            "read", callback=_read, help=_read.__doc__, short_help="Values from a filled-in form.",
            params=[
                click.Argument(["form"]),
                click.Option(["--name"], default="", metavar="SOURCE", help="As in etpu@SOURCE; else from the plate."),
                click.Option(["--picture"], metavar="FILE", help="Draw the intervals before and after, as SVG."),
                click.Option(["--force"], is_flag=True, help="Replace a source of that name."),
                click.Option(["--dry-run"], is_flag=True, help="Write no file."),
                *render.options(file=False),
            ],
        )
    ],
    options_metavar="",
    subcommand_metavar="{PRINTER MATERIALS|read FORM} [OPTIONS]",
    context_settings={"ignore_unknown_options": True},
    help="""Print test structures (coupons), and turn their readings into material values.

    \b
    sensorgen characterise diabase-h5 etpu x60      plate, form, intervals
    sensorgen characterise read out/NAME/form.yaml  values: etpu@lab-NAME

    docs/characterise.md explains the coupons.
    """,
    epilog="PRINTER MATERIALS --help lists the options.",
)  # fmt: skip
