"""``sensorgen sheet``: which contacts and frequencies locate a load in two dimensions."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import body_options, options, render, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.options import option
from sensorgen.cli.words import OneOf, Pad, one, proper
from sensorgen.core import units

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.sheet_study import Rectangle

SETS = ("one-edge", "opposite", "two-edges", "corner", "corners")

OWN: list[click.Parameter] = [
    option(
        "--contacts", OneOf([*SETS, "all"]),
        "Contacts to read: one edge, both ends, two edges that meet, one corner, or four.  [default: all, or "
        "those of --pad]",
    ),
    option(
        "--pad pads", Pad(),
        "Contacts of your own, on top and on the bottom at the same place; give one for each pair to read, as "
        "in 90-100,0-10 [mm], or 0,20-60 for a stretch of an edge.", multiple=True,
    ),
    options.frequencies(),
    options.force(), options.tip("--tip tip_mm", "Side of the square tip."), options.noise(), options.compression(),
    *body_options.body_options(),
    option("--plot", click.Path(path_type=Path), "Write maps of the bounds there.", metavar="DIR"),
    *render.options(),
]  # fmt: skip


def _work(
    design: "Design", *, contacts: str | None, pads: "tuple[Rectangle, ...]", frequency_hz: tuple[float, ...] | None,
    force_n: tuple[float, ...], tip_mm: tuple[float, ...], noise: float, compression: str | None, plot: Path | None,
) -> int:  # fmt: skip
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.query import TONES_HZ, Query
    from sensorgen.prediction.sheet_study import PLACES, study

    force, tip_m = one("--force", force_n), one("--tip", tip_mm) * units.M_PER_MM
    proper("--noise", noise)
    model = sensor_model(body_options.body_of()(design), Query(law=compression or ""))[0]
    wanted, places = contacts or ("" if pads else "all"), PLACES**2
    names = [*(["pads"] if pads else []), *(name for name in SETS if wanted in (name, "all"))]
    with show.progress([f"{name} {k + 1}/{places}" for name in names for k in range(places)]) as step:
        found = study(
            model, frequency_hz or TONES_HZ, force, tip_m, noise, contacts=wanted, pads=pads,
            step=lambda name, count: step(f"{name} {count + 1}/{places}"),
        )  # fmt: skip
    if plot is not None:
        from sensorgen.analysis.plots import sheet
        from sensorgen.core import files

        where = plot / f"{design.name}-sheet.png"
        files.replace(where, sheet.png(found.sheet, found.bounds, found.ports))
        render.say(f"wrote {where}", err=bool(render.form()))
    render.deliver(found)
    return 0


command = DesignGroup(
    _work, OWN, name="sheet",
    help="Bounds on force and place of a press in two dimensions, for the usual sets of contacts.",
)  # fmt: skip
