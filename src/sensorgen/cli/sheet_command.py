"""``sensorgen sheet``: which contacts and tones locate a press in two dimensions."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import body_options, sheet_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Share, Values, one, proper
from sensorgen.core import units
from sensorgen.core.errors import BadInput, OutOfRange

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.models.sensor import Sensor
    from sensorgen.models.sheet import Bounds, Patch, Port, Sheet

SETS = ("one-edge", "opposite", "two-edges", "corner", "corners")
PLACES = 7  # along each side
MM_PER_M = 1e3
Rectangle = tuple[tuple[float, float], tuple[float, float]]  # [mm]


class Pad(click.ParamType):  # type: ignore[type-arg]
    """A rectangle on the sheet, or a stretch of an edge where it has no width."""

    name = "X0-X1,Y0-Y1"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        """Read ``90-100,0-10``, or ``0,20-60`` for a stretch of an edge [mm]."""
        spans = [span.split("-") for span in value.split(",")]
        if len(spans) != 2 or any(len(span) > 2 for span in spans):
            raise BadInput(f"--pad {value!r}; expected {self.name} in mm, as in 90-100,0-10, or 0,20-60 on an edge")
        try:
            return tuple((units.length_mm(span[0]), units.length_mm(span[-1])) for span in spans)
        except BadInput as error:
            raise error.within(f"--pad {value!r}") from None


OWN: list[click.Parameter] = [
    click.Option(
        ["--contacts"], type=OneOf([*SETS, "all"]),
        help="Contacts to read: one edge, both ends, two edges that meet, one corner, or four.  [default: all, or "
        "those of --pad]",
    ),
    click.Option(
        ["--pad", "pads"], type=Pad(), multiple=True,
        help="Contacts of your own, on top and on the bottom at the same place; give one for each pair to read, as "
        "in 90-100,0-10 [mm], or 0,20-60 for a stretch of an edge.",
    ),
    click.Option(
        ["--frequencies"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Tones, as in 10kHz,100kHz,1MHz; the thesis's seven if not given.",
    ),
    click.Option(
        ["--force"], type=Values(units.FORCE_N, zero=False), metavar="N", default="6",
        help="Force of the press.  [default: 6 N]",
    ),
    click.Option(
        ["--tip"], type=Values(units.LENGTH_MM, zero=False), metavar="MM", default="10",
        help="Side of the square tip.  [default: 10]",
    ),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", help="Standard error of R and X relative to |Z|.  [default: 0.1%]"
    ),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded")),
        help="Compression law of a plate; the best of the cell if not given.",
    ),
    *body_options.body_options(),
    click.Option(["--json", "as_json"], is_flag=True, help="Print impedances, bounds, and their maps, as JSON."),
    click.Option(["--plot"], type=click.Path(path_type=Path), metavar="DIR", help="Write maps of the bounds there."),
]  # fmt: skip


def _work(
    design: "Design", *, contacts: str | None, pads: tuple[Rectangle, ...], frequencies: tuple[float, ...] | None,
    force: tuple[float, ...], tip: tuple[float, ...], noise: float, compression: str | None, as_json: bool,
    plot: Path | None, drawn: bool, slicer: str | None, walls: str | None,
) -> int:  # fmt: skip
    from sensorgen.models.sheet import impedance
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.query import TONES_HZ, Query

    force_n, tip_mm, tones = one("--force", force), one("--tip", tip), frequencies or TONES_HZ
    proper("--noise", noise)
    model = sensor_model(body_options.body_of(drawn, slicer, walls)(design), Query(law=compression or ""))[0]
    film = _sheet(model.sensor)
    press, per_newton = _press(model.sensor, tip_mm * units.M_PER_MM, force_n)
    ports = _ports(film, contacts, pads)
    bounds = _bounds(film, ports, tones, press, per_newton, noise)
    if plot is not None:
        from sensorgen.analysis.plots import sheet
        from sensorgen.core import files as store

        where = plot / f"{design.name}-sheet.png"
        store.replace(where, sheet.png(film, bounds, ports))
        if not as_json:
            click.echo(f"wrote {where}")
    given = {"force_n": force_n, "tip_mm": tip_mm, "noise": noise, "doubts": list(model.doubts)}
    if as_json:
        loose = {name: impedance(film, ports[name], tones, cells=found.cells) for name, found in bounds.items()}
        found = {name: sheet_text.plain_bounds(bounds[name], loose[name]) for name in bounds}
        show.as_json(given | sheet_text.plain(film, press, found))
    else:
        for line in sheet_text.lines(film, press, bounds, given):
            click.echo(line)
    return 0


def _ports(film: "Sheet", contacts: str | None, pads: tuple[Rectangle, ...]) -> "dict[str, tuple[Port, ...]]":
    """Sets of contacts by name: the usual ones, and the user's own."""
    from sensorgen.models.sheet import Contact, contact_sets

    own = [[(start * units.M_PER_MM, stop * units.M_PER_MM) for start, stop in pad] for pad in pads]
    found = {"pads": tuple((Contact("top", x, y), Contact("bottom", x, y)) for x, y in own)} if pads else {}
    wanted = contacts or ("" if pads else "all")
    return found | {name: ports for name, ports in contact_sets(film).items() if wanted in (name, "all")}


def _bounds(
    film: "Sheet", ports: "dict[str, tuple[Port, ...]]", tones: tuple[float, ...], press: "Patch",
    per_newton: dict[str, float], noise: float,
) -> "dict[str, Bounds]":  # fmt: skip
    """Bounds of each set, with a bar on the terminal: at high frequencies they take minutes."""
    from sensorgen.models.sheet import localise

    places = PLACES**2
    with show.progress([f"{name} {k + 1}/{places}" for name in ports for k in range(places)]) as step:

        def told(name: str) -> Callable[[int], None]:
            return lambda count: step(f"{name} {count + 1}/{places}")

        return {
            name: localise(film, pairs, tones, press, per_newton, noise, PLACES, told(name))
            for name, pairs in ports.items()
        }


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
            "a smaller --tip or a wider sensor, as with --size 100x100 (for strips: `sensorgen predict`)"
        )
    area = tip_m**2
    stress = np.asarray(force_n / area)
    thinning, slope = (float(value) for value in sensor.compression.capacitive_strain(stress))
    sensor.check_tracks(stress)
    rises = [rise / area for rise in sensor.piezoresistance_per_pa]
    factor = 1 / (1 - thinning)
    top, bottom = (1 + rise * force_n for rise in rises)
    per_newton = {"capacitance_factor": factor**2 * slope / area}
    per_newton |= {f"{end}_resistance_factor": rise for end, rise in zip(("top", "bottom"), rises, strict=True)}
    return Patch(0.0, 0.0, tip_m, tip_m, factor, (top, bottom)), per_newton


command = DesignGroup(
    _work, OWN, name="sheet",
    help="Bounds on force and place of a press in two dimensions, for the usual sets of contacts.",
    short_help="Which contacts and frequencies locate a load in two dimensions.",
)  # fmt: skip
