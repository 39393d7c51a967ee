"""``sensorgen list``: what there is."""

from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.core.options import Argument

if TYPE_CHECKING:
    from sensorgen.cli.catalogue import Catalogue

KINDS = ("shapes", "materials", "printers", "qualities", "instruments", "devices", "packs", "models", "sources")


@of_function("list", *render.options("json", "markdown"))
def command(kind: Annotated[str, Argument(kind=KINDS)]) -> "Catalogue":
    """List what goes by a name.

    Shapes with their parameters, materials with every value and its source, printers, qualities, instruments, devices
    of the laboratory, packs, models, or what the sources stand for; with the pack that each comes from.

    Parameters
    ----------
    kind
    """
    from sensorgen.cli import catalogue

    listed: Catalogue = (catalogue.all_packs if kind == "packs" else getattr(catalogue, kind))()
    return listed
