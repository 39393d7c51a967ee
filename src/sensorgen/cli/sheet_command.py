"""``sensorgen sheet``: which contacts and tones locate a press in two dimensions."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen import units
from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length, OneOf, Share, Values
from sensorgen.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design import Design
    from sensorgen.models.sheet import Bounds, Patch, Sheet
    from sensorgen.sensor import Sensor

SETS = ("one-edge", "opposite", "two-edges", "corner", "corners")
MM_PER_M = 1e3

OWN: list[click.Parameter] = [
    click.Option(
        ["--contacts"], type=OneOf([*SETS, "all"]), default="all",
        help="Contacts to read: one edge, both ends, two edges that meet, one corner, or four.  [default: all]",
    ),
    click.Option(
        ["--frequencies"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Tones, as in 10kHz,100kHz,1MHz; the thesis's seven if not given.",
    ),
    click.Option(
        ["--force"], type=Values(units.FORCE_N, zero=False), default="6", help="Force of the press.  [default: 6 N]"
    ),
    click.Option(["--tip"], type=Length(), default="10", help="Side of the square tip.  [default: 10]"),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", help="Standard error of R and X relative to |Z|.  [default: 0.1%]"
    ),
    click.Option(["--json", "as_json"], is_flag=True, help="Print bounds, and their maps, as JSON."),
    click.Option(["--plot"], type=click.Path(path_type=Path), metavar="DIR", help="Write maps of the bounds there."),
]  # fmt: skip


def _work(
    design: "Design", *, contacts: str, frequencies: tuple[float, ...] | None, force: tuple[float, ...], tip: float,
    noise: float, as_json: bool, plot: Path | None,
) -> int:  # fmt: skip
    from sensorgen.models.sheet import contact_sets, localise
    from sensorgen.predict import TONES_HZ
    from sensorgen.sensing import sensor_of

    if len(force) != 1:
        raise BadInput(f"--force takes one number, not {len(force)}: bounds are those of one press")
    sensed = sensor_of(design)
    film = _sheet(sensed.sensor)
    press, per_newton = _press(sensed.sensor, tip / MM_PER_M, force[0])
    ports = {name: found for name, found in contact_sets(film).items() if contacts in (name, "all")}
    tones = frequencies or TONES_HZ
    bounds = {name: localise(film, pairs, tones, press, per_newton, noise) for name, pairs in ports.items()}
    if plot is not None:
        from sensorgen import store
        from sensorgen.plots import sheet

        where = plot / f"{design.name}-sheet.png"
        store.replace(where, sheet.png(film, bounds, ports))
        if not as_json:
            click.echo(f"wrote {where}")
    given = {"force_n": force[0], "tip_mm": tip, "noise": noise, "doubts": list(sensed.doubts)}
    if as_json:
        show.as_json(given | _plain(film, press, bounds))
    else:
        _print(film, press, bounds, given)
    return 0


def _sheet(sensor: "Sensor") -> "Sheet":
    """The film and its sheets; the same numbers as those of the line, per area in place of per length."""
    from sensorgen.models.sheet import Sheet

    top, bottom = (rho / h for rho, h in zip(sensor.resistivity_ohm_m, sensor.electrode_m, strict=True))
    return Sheet(
        sensor.length_m, sensor.width_m, (top, bottom), sensor.capacitance_f_per_m / sensor.width_m,
        sensor.leak_s_per_m / sensor.width_m, sensor.tan_delta,
    )  # fmt: skip


def _press(sensor: "Sensor", tip_m: float, force_n: float) -> tuple["Patch", dict[str, float]]:
    """What a force does under the tip, and the derivatives of that by the force."""
    import numpy as np

    from sensorgen.models.sheet import Patch

    shorter = min(sensor.length_m, sensor.width_m)
    if not 0 < tip_m < shorter:
        raise OutOfRange(
            f"a tip of {tip_m * MM_PER_M:g} mm on a sheet {shorter * MM_PER_M:g} mm wide leaves no place to find: take "
            "a smaller --tip or a wider sensor, as with --size 100x100 (`sensorgen predict` speaks of strips)"
        )
    area = tip_m**2
    thinning, slope = (float(value) for value in sensor.compression.thinning(np.asarray(force_n / area)))
    rises = sensor.piezoresistance_per_n
    factor = 1 / (1 - thinning)
    top, bottom = (1 + rise * force_n for rise in rises)
    per_newton = {"capacitance_factor": factor**2 * slope / area}
    per_newton |= {f"{end}_resistance_factor": rise for end, rise in zip(("top", "bottom"), rises, strict=True)}
    return Patch(0.0, 0.0, tip_m, tip_m, factor, (top, bottom)), per_newton


def _print(film: "Sheet", press: "Patch", bounds: dict[str, "Bounds"], given: dict[str, Any]) -> None:
    import numpy as np

    from sensorgen.models.sheet import depth_m

    tones = next(iter(bounds.values())).frequency_hz
    top, bottom = film.sheet_resistance_ohm
    click.echo(
        f"sheet            {film.length_m * MM_PER_M:g} x {film.width_m * MM_PER_M:g} mm, {show.si(top, 'ohm')} and "
        f"{show.si(bottom, 'ohm')} per square, {show.si(float(film.capacitances().mean()), 'F')}/m2"
    )
    click.echo(
        f"press            {given['force_n']:g} N on {given['tip_mm']:g} x {given['tip_mm']:g} mm: capacitance there "
        f"{press.capacitance_factor - 1:+.2%}; noise {given['noise']:g} of |Z|"
    )
    reach = [_mm(depth_m(film, float(f), press) * MM_PER_M) for f in (tones[0], tones[-1])]
    click.echo(f"current reaches  {reach[0]} at {show.si(tones[0], 'Hz')}, {reach[1]} at {show.si(tones[-1], 'Hz')}")
    for doubt in given["doubts"]:
        click.echo(f"doubt            {doubt}")
    click.echo(f"\n{'contacts':11}{'sigma F':>13}{'sigma x':>12}{'sigma y':>12}{'located':>10}  tones that tell most")
    for name, found in bounds.items():
        force, x, y = (float(np.median(found.sigma()[..., k])) for k in range(3))
        best = ", ".join(show.si(float(found.frequency_hz[k]), "Hz") for k in found.best_tones()[:2])
        newton = f"{force:.3g} N" if np.isfinite(force) else "none"
        row = f"{name:11}{newton:>13}{_mm(x * MM_PER_M):>12}{_mm(y * MM_PER_M):>12}{found.located():10.0%}"
        click.echo(f"{row}  {best}")
    click.echo(
        "\nmedians over the sheet of the smallest standard errors; located: twice as well as by a guess, in x and in y"
    )
    for name, found in bounds.items():
        click.echo(f"{name:11}{found.verdict()}")


def _mm(value: float) -> str:
    if not value < float("inf"):
        return "none"
    return f"{value:.3g} mm" if value < MM_PER_M else f"{value / MM_PER_M:.3g} m"


def _plain(film: "Sheet", press: "Patch", bounds: dict[str, "Bounds"]) -> dict[str, Any]:
    return {
        "length_m": film.length_m,
        "width_m": film.width_m,
        "sheet_resistance_ohm": dict(zip(("top", "bottom"), film.sheet_resistance_ohm, strict=True)),
        "capacitance_f_per_m2": float(film.capacitances().mean()),
        "capacitance_factor": press.capacitance_factor,
        "contacts": {name: _bounds(found) for name, found in bounds.items()},
    }


def _bounds(found: "Bounds") -> dict[str, Any]:
    sigma = found.sigma()
    names = ("sigma_force_n", "sigma_x_m", "sigma_y_m")
    return {
        "verdict": found.verdict(),
        "located": found.located(),
        "frequency_hz": found.frequency_hz.tolist(),
        "best_frequency_hz": [float(found.frequency_hz[k]) for k in found.best_tones()],
        "cells": found.cells,
        "x_m": found.x_m.tolist(),
        "y_m": found.y_m.tolist(),
        **{name: [[_number(v) for v in row] for row in sigma[..., k].tolist()] for k, name in enumerate(names)},
    }


def _number(value: float) -> float | None:
    """JSON has no infinity."""
    return value if value < float("inf") else None


command = DesignGroup(
    _work, OWN, name="sheet",
    help="Bounds on force and place of a press in two dimensions, for the usual sets of contacts.",
    short_help="Which contacts and tones locate a press in two dimensions.",
)  # fmt: skip
