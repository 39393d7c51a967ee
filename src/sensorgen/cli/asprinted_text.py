"""A design as drawn and as printed, as lines for the terminal."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.words import OneOf

if TYPE_CHECKING:
    from sensorgen.checks.volumes import Row
    from sensorgen.design.design import Design


def compensate_option() -> click.Option:
    """``--compensate``, for commands that make files."""
    return click.Option(
        ["--compensate"], type=OneOf(("print", "bake")),
        help="Change the design so that what is asked for comes out: whole layers, widths of a line, the electrode "
        "gap; with bake also larger by the 20 % that the bake takes off.",
    )  # fmt: skip


def compensated(
    design: "Design", word: str | None, walls: str, *, silent: bool
) -> tuple["Design", list[dict[str, Any]]]:
    """The design to print, and what was changed, which is also printed."""
    if word is None:
        return design, []
    from sensorgen.asprinted.compensation import compensated as changed

    found, changes = changed(design, walls, bake=word == "bake")
    if not silent:
        click.echo(f"{design.name} compensated for the print, by the estimate for {walls} walls: {found.name}")
        for c in changes or ():
            click.echo(f"  {c.what:30} {c.before:g} -> {c.after:g}: {c.why}")
        if not changes:
            click.echo("  nothing to change")
    return found, [c.as_dict() for c in changes]


def table(rows: "Sequence[Row]") -> Iterator[str]:
    """Printed over drawn volume of every body, layer by layer from the top."""
    bodies = list(dict.fromkeys(row.body for row in rows))
    cells = {(row.layer, row.body): _cell(row) for row in rows}
    spans = {row.layer: f"{row.bottom_mm:g}-{row.top_mm:g}" for row in rows}
    yield "printed over drawn volume (-n: missing parts, +n: merged parts)"
    yield f"{'layer':>5} {'mm':11}" + " ".join(f"{name:>{_wide(name)}}" for name in bodies)
    for layer in sorted(spans, reverse=True):
        row = " ".join(f"{cells.get((layer, name), ''):>{_wide(name)}}" for name in bodies)
        yield f"{layer:>5} {spans[layer]:11}{row}".rstrip()


def _wide(name: str) -> int:
    return max(len(name), 12)


def _cell(row: "Row") -> str:
    lost = f" -{row.vanished}" if row.vanished else ""
    fused = f" +{row.fused}" if row.fused else ""
    return f"{format(row.ratio, '.2f') if row.exact_mm3 > 0 else 'extra'}{lost}{fused}"
