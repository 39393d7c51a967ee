"""``sensorgen stack``: what a second film tells that one does not, and what a touch does to a reading."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from sensorgen import units
from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length, OneOf, Share, Values
from sensorgen.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design import Design

OWN: list[click.Parameter] = [
    click.Option(
        ["--force", "force_n"], type=Values(units.FORCE_N, zero=False), default="6N", show_default=True,
        help="Force of the press.",
    ),
    click.Option(
        ["--position", "position_mm"], type=Values(units.LENGTH_MM, zero=True),
        help="Position of the tip's middle [mm]; the sensor's middle if not given.",
    ),
    click.Option(
        ["--frequencies", "frequency_hz"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Tones, as in 1.1kHz,2.3kHz; the thesis's seven if not given.",
    ),
    click.Option(
        ["--touch", "tip_mm"], type=Length(), default="10mm", show_default=True,
        help="Length of the tip that presses, and of the body that touches.",
    ),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", show_default=True,
        help="Noise of the real and of the imaginary part of a reading, as a share of its modulus.",
    ),
    click.Option(
        ["--drift"], type=Share(), default="10%", show_default=True,
        help="What the films' permittivity may have drifted by, both alike.",
    ),
    click.Option(
        ["--within", "within_n"], type=Values(units.FORCE_N, zero=False), default="0.1N", show_default=True,
        help="Largest force that a touch may be mistaken for.",
    ),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded")),
        help="How a plate gives way; the best that is known of the cell if not given.",
    ),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
]  # fmt: skip


def _work(
    design: "Design", *, force_n: Sequence[float], position_mm: Sequence[float] | None,
    frequency_hz: Sequence[float] | None, tip_mm: float, noise: float, drift: float, within_n: Sequence[float],
    compression: str | None, as_json: bool,
) -> int:  # fmt: skip
    from sensorgen.predict import TONES_HZ
    from sensorgen.stacked import study

    for option, share in (("--noise", noise), ("--drift", drift)):
        if not 0 < share < 1:
            raise OutOfRange(f"{option} {share:g}; expected a share above 0 and below 1, as in 0.1%")
    at_mm = None if position_mm is None else _one("--position", position_mm)
    found = study(
        design, frequency_hz or TONES_HZ, _one("--force", force_n), None if at_mm is None else at_mm * units.M_PER_MM,
        noise, drift, _one("--within", within_n), compression or "", tip_mm * units.M_PER_MM,
    )  # fmt: skip
    (show.as_json if as_json else _print)(found)
    return 0


def _one(option: str, values: Sequence[float]) -> float:
    if len(values) != 1:
        raise BadInput(f"{option}: {len(values)} values; expected one")
    return values[0]


def _print(found: Mapping[str, Any]) -> None:
    """Tables for a person."""
    click.echo(
        f"{found['force_n']:g} N at {found['position_m'] / units.M_PER_MM:g} mm, noise {found['noise'] * 100:g} %; "
        f"it moves a reading by {found['press_shift'] * 100:.3g} %\n"
    )
    _print_double(found)
    _print_touch(found)
    for doubt in found["doubts"]:
        click.echo(f"doubt: {doubt}")
    click.echo("taken for granted: " + "; ".join(found["assumptions"]))


def _print_double(found: Mapping[str, Any]) -> None:
    click.echo("two films that share the middle electrode")
    click.echo(f"{'':>11}  {'lower [ohm]':>24}  {'upper [ohm]':>24}  {'upper - lower [ohm]':>24}")
    for row in found["readings_ohm"]:
        lower, upper = ((row[f"{name}_re"], row[f"{name}_im"]) for name in ("lower", "upper"))
        apart = (upper[0] - lower[0], upper[1] - lower[1])
        said = "  ".join(f"{re:10.5g} {im:+12.5g}j" for re, im in (lower, upper, apart))
        click.echo(f"{show.si(row['frequency_hz'], 'Hz'):>11}  {said}")
    click.echo(
        f"\n{'smallest standard errors':>25}{'permittivity known':>22}"
        f"{'it may drift by ' + format(found['drift'] * 100, 'g') + ' %':>29}"
    )
    for row in found["bounds"]:
        known, drifting = (
            f"{_said(row['force_n'][case], 'N'):>10}  {_said(row['position_m'][case], 'm'):>10}"
            for case in ("known", "drifting")
        )
        click.echo(f"{row['reading']:>20}     {known}       {drifting}")


def _said(value: float | None, unit: str) -> str:
    return "not told" if value is None else show.si(value, unit)


def _print_touch(found: Mapping[str, Any]) -> None:
    click.echo("\na body that touches the top beside the press: shift of the reading, and the force it is mistaken for")
    thicknesses = [row["isolation_mm"] for row in found["touch"][0]["by_isolation"]]
    names = ["bare" if t == 0 else f"{t:g} mm" for t in thicknesses]
    click.echo(f"{'isolation':>24}" + "".join(f"{name:>20}" for name in names))
    for row in found["touch"]:
        cells = (f"{r['largest_shift'] * 100:.2g} %, {r['mistaken_for_n']:.3g} N" for r in row["by_isolation"])
        click.echo(f"{row['wiring']:>24}" + "".join(f"{cell:>20}" for cell in cells))
    click.echo(f"needed to stay within {found['within_n']:g} N:")
    for row in found["touch"]:
        click.echo(f"{row['wiring']:>24}  {_needed(row['needed_mm'])}")
    click.echo("")


def _needed(thickness_mm: float | None) -> str:
    if thickness_mm is None:
        return "no isolation up to 10 mm does it"
    return "none" if thickness_mm == 0 else f"{thickness_mm:.3g} mm or more"


command = DesignGroup(
    _work, OWN, name="stack",
    help="What a double sensor tells that a single one does not, and what a touch does, with isolation and without.",
    short_help="Double sensor, and isolation against touch.",
)  # fmt: skip
