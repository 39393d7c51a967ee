"""``sensorgen sheet``: which contacts and frequencies locate a load in two dimensions."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render, show
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Force, Law
from sensorgen.core import units
from sensorgen.core.options import Option
from sensorgen.prediction.query import TONES_HZ, Frequencies, Noise, Query

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.sheet_study import Rectangle, SheetStudy

SETS = ("one-edge", "opposite", "two-edges", "corner", "corners")
Pads = Annotated[tuple["Rectangle", ...], Option(kind="pad")]  # fmt: skip


@of_design("sheet", *render.options())
def command(
    design: "Design", *, contacts: Annotated[str, Option(kind=(*SETS, "all"))] = "", pads: Pads = (),
    frequency_hz: Frequencies = TONES_HZ, force_n: Force, tip_mm: Annotated[float, Option(typed="10mm")], noise: Noise,
    law: Law = "", body: BodyChoice, plot: Path | None = None,
) -> "SheetStudy":  # fmt: skip
    """Bounds on force and place of a press in two dimensions, for the usual sets of contacts.

    Parameters
    ----------
    contacts
        Contacts to read: one edge, both ends, two edges that meet, one corner, or four.  [default: all, or those of
        --pad]
    pads, --pad
        Contacts of your own, on top and on the bottom at the same place; give one for each pair to read, as in
        90-100,0-10 [mm], or 0,20-60 for a stretch of an edge.
    tip_mm : MM
        Side of the square tip.
    plot : DIR
        Write maps of the bounds there.
    """
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.sheet_study import PLACES, study

    model = sensor_model(body(design), Query(law=law))[0]
    wanted, places = contacts or ("" if pads else "all"), PLACES**2
    names = [*(["pads"] if pads else []), *(name for name in SETS if wanted in (name, "all"))]
    with show.progress([f"{name} {k + 1}/{places}" for name in names for k in range(places)]) as step:
        bounds = study(
            model, frequency_hz, force_n, tip_mm * units.M_PER_MM, noise, contacts=wanted, pads=pads,
            step=lambda name, count: step(f"{name} {count + 1}/{places}"),
        )  # fmt: skip
    if plot is not None:
        from sensorgen.analysis.plots import sheet

        picture = sheet.png(bounds.sheet, bounds.bounds, bounds.ports)
        render.file(plot / f"{design.name}-sheet.png", picture, "wrote ")
    return bounds
