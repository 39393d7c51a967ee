"""A design as drawn and as printed, as lines for the terminal."""

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import show
from sensorgen.cli.show import si
from sensorgen.cli.words import OneOf
from sensorgen.core.errors import BadInput
from sensorgen.export.slicers import SLICERS

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.checks.volumes import Row
    from sensorgen.design.design import Design
    from sensorgen.prediction.as_printed import Capacitance, Comparison, Resistance


def compensate_option() -> click.Option:
    """``--compensate``, for commands that make files."""
    return click.Option(
        ["--compensate"], type=OneOf(("print", "bake")),
        help="Change the design so that what is asked for comes out: whole layers, widths of a line, the electrode "
        "gap; with bake also larger by the 20 % that the bake takes off.",
    )  # fmt: skip


def printed_options(about: str = "Hold what is printed against what is drawn.") -> list[click.Parameter]:
    """``--as-printed`` with whose print is meant, for commands that look at a print beside the drawing."""
    return [
        click.Option(["--as-printed"], is_flag=True, help=about),
        click.Option(
            ["--slicer"], type=OneOf(SLICERS),
            help="With --as-printed: slice for real; estimated from each layer's mid-plane if not given.",
        ),
        click.Option(
            ["--walls"], type=OneOf(("arachne", "classic", "cura", "cura-gaps")),
            help="With --as-printed and no slicer: whose walls are estimated.  [default: arachne]",
        ),
    ]  # fmt: skip


def refuse_strays(*, as_printed: bool, slicer: str | None, walls: str | None) -> None:
    """Refuse words on a print that nobody asked about, or two ways at once."""
    if not as_printed and (slicer or walls):
        raise BadInput("--slicer and --walls say how it is printed; expected --as-printed with them")
    if slicer and walls:
        raise BadInput("--slicer and --walls at once; expected one: the slicer's profile says what walls it makes")


def printed(design: "Design", slicer: str | None, walls: str | None) -> "Printed":
    """What is printed of a design: sliced for real, or estimated."""
    from sensorgen.asprinted.printed import body

    if not slicer:
        return body(design, walls=walls or "arachne")
    from sensorgen.export import slicing

    with tempfile.TemporaryDirectory() as folder, show.progress(slicing.STEPS) as step:
        made = slicing.sliced([slicing.alone(design)], slicer, Path(folder), step=step)
    return body(design, made.lines, slicer=f"{slicer} {made.version}")


def compensated(
    design: "Design", word: str | None, walls: str, *, silent: bool
) -> tuple["Design", list[dict[str, Any]]]:
    """The design to print, and what was changed, which is also told."""
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


def lines(found: "Comparison") -> Iterator[str]:
    """The whole comparison."""
    gap = found.electrode_gap_mm
    yield f"{found.design}, as drawn and as printed: {found.source}"
    if found.estimate:
        yield "an ESTIMATE: no slicer was asked; --slicer prusa or cura does"
    yield ""
    yield f"{'':18}{'drawn':>12}   printed"
    yield f"{'electrode gap':18}{gap.drawn:>9g} mm   {' .. '.join(f'{g:g}' for g in sorted(set(gap.printed)))} mm"
    yield from _capacitance(found.capacitance_f)
    yield from _resistance(found.electrode_resistance_ohm, found.contact_ohm_m2)
    yield ""
    yield from table(found.layers)


def _capacitance(c: "Capacitance") -> Iterator[str]:
    if isinstance(c.drawn, str):
        yield f"{'capacitance':18}{'none':>12}   {c.drawn}"
        return
    drawn = si(c.drawn.middle, "F")
    if c.printed is None:
        yield f"{'capacitance':18}{drawn:>12}   none: {next(iter(c.by_width.values()))}"
        return
    yield f"{'capacitance':18}{drawn:>12}   {si(c.printed.lower, 'F')} .. {si(c.printed.upper, 'F')}"
    for name, value in c.by_width.items():
        said = value if isinstance(value, str) else si(value.middle, "F")
        yield f"{'  lines by ' + name:30}   {said}"


def _resistance(r: "Resistance", contacts: Sequence[float]) -> Iterator[str]:
    if r.drawn is None or r.printed is None:
        yield f"{'electrodes':18}{'':12}   {r.reason}"
        return
    for end, solid in r.drawn.items():
        yield f"{end + ' electrode':18}{si(solid, 'ohm'):>12}"
        for contact, value in zip(contacts, r.printed[end], strict=True):
            yield f"{f'  contacts {contact:g} ohm m2':30}   {si(value, 'ohm')}"


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
