"""``sensorgen stack``: what a second film tells that one does not, and what a touch does to a reading."""

import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Share, Values, one, proper
from sensorgen.core import units

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.double_layer import StackStudy

WIDTH = 80

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
        ["--touch", "tip_mm"], type=Values(units.LENGTH_MM, zero=False), metavar="MM", default="10mm",
        show_default=True,
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
        help="Compression law of a plate; the best of the cell if not given.",
    ),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
]  # fmt: skip


def _work(
    design: "Design", *, force_n: Sequence[float], position_mm: Sequence[float] | None,
    frequency_hz: Sequence[float] | None, tip_mm: Sequence[float], noise: float, drift: float,
    within_n: Sequence[float], compression: str | None, as_json: bool,
) -> int:  # fmt: skip
    from sensorgen.prediction.double_layer import StackStudy, study
    from sensorgen.prediction.query import TONES_HZ

    at_mm = None if position_mm is None else one("--position", position_mm)
    found = study(
        design, frequency_hz or TONES_HZ, one("--force", force_n), None if at_mm is None else at_mm * units.M_PER_MM,
        proper("--noise", noise), proper("--drift", drift), one("--within", within_n), compression or "",
        one("--touch", tip_mm) * units.M_PER_MM,
    )  # fmt: skip
    if as_json:
        from pydantic import TypeAdapter

        show.as_json(TypeAdapter(StackStudy).dump_python(found, mode="json"))
    else:
        _print(found)
    return 0


def _print(found: "StackStudy") -> None:
    """Tables for a person."""
    for line in (*_head(found), "", *_double(found), "", *_touch(found), ""):
        click.echo(line)
    for doubt in found.doubts:
        _wrapped(f"doubt: {doubt}")
    _wrapped("assumptions: " + "; ".join(found.assumptions))


def _wrapped(text: str) -> None:
    click.echo(textwrap.fill(text, WIDTH, subsequent_indent="  "))


def _head(found: "StackStudy") -> list[str]:
    return textwrap.wrap(
        f"{found.force_n:g} N at {found.position_m / units.M_PER_MM:g} mm, noise {found.noise * 100:g} %; "
        f"it moves a reading by {found.press_shift * 100:.3g} %",
        WIDTH,
    )


def _double(found: "StackStudy") -> Iterator[str]:
    yield "two films that share the middle electrode; R and X [ohm]"
    yield f"{'':>9} {'lower':^22} {'upper':^22} {'upper - lower':^22}".rstrip()
    for row in found.readings_ohm:
        lower, upper = (row.lower_re, row.lower_im), (row.upper_re, row.upper_im)
        apart = (upper[0] - lower[0], upper[1] - lower[1])
        said = " ".join(f"{re:10.4g} {im:11.5g}" for re, im in (lower, upper, apart))
        yield f"{show.si(row.frequency_hz, 'Hz'):>9} {said}"
    yield ""
    drift = f"it may drift by {found.drift * 100:g} %"
    yield f"{'standard errors':18} {'permittivity known':>23}   {drift:>27}"
    for errors in found.bounds:
        force, position = errors.force_n, errors.position_m
        known = f"{_said(force.known, 'N'):>11} {_said(position.known, 'm'):>11}"
        drifting = f"{_said(force.drifting, 'N'):>11} {_said(position.drifting, 'm'):>11}"
        yield f"{errors.reading:18} {known}       {drifting}"


def _said(value: float | None, unit: str) -> str:
    return "undefined" if value is None else show.si(value, unit)


def _touch(found: "StackStudy") -> Iterator[str]:
    """One row per thickness and one pair of columns per wiring: thicknesses may be many, wirings are three."""
    yield from textwrap.wrap(
        "A body that touches the top beside the press: shift of the reading, and the force that it is mistaken for",
        WIDTH,
    )
    yield _columns("isolation", [row.wiring for row in found.touch])
    for rows in zip(*(row.by_isolation for row in found.touch), strict=True):
        thickness = rows[0].isolation_mm
        cells = [f"{r.largest_shift * 100:.2g} % {r.mistaken_for_n:8.3g} N" for r in rows]
        yield _columns(f"{thickness:.4g} mm" if thickness else "bare", cells)
    yield _columns("needed", [_needed(row.needed_mm) for row in found.touch])
    yield f"needed: isolation from which on it stays within {found.within_n:g} N"


def _columns(head: str, cells: Sequence[str]) -> str:
    return f"{head:>9} " + " ".join(f"{cell:>{width}}" for cell, width in zip(cells, (22, 22, 24), strict=True))


def _needed(thickness_mm: float | None) -> str:
    if thickness_mm is None:
        return "not even 10 mm"
    return "none" if thickness_mm == 0 else f"{thickness_mm:.3g} mm"


command = DesignGroup(
    _work, OWN, name="stack",
    help="What a double sensor tells that a single one does not, and what a touch does, with isolation and without.",
    short_help="Double sensor, and isolation against touch.",
)  # fmt: skip
