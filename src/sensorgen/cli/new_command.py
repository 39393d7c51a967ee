"""``sensorgen new``: a file of one's own."""

from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import render
from sensorgen.cli.commands import command as of_function
from sensorgen.core.options import Argument

if TYPE_CHECKING:
    from sensorgen.core.document import Documented

KINDS = ("material", "shape", "printer", "quality", "instrument", "design", "target", "experiment")


@of_function("new", *render.options("json", file=False))
def command(what: Annotated[Any, Argument(kind=KINDS)], name: str, *, pack: str = "") -> "Documented":
    """Write a commented file of your own to change, as a material, a shape, a design or an experiment.

    It goes to a folder of its kind in the working folder, as materials/NAME.yaml, where designs in this folder take it
    by its name; with --pack to one of your packs, for all designs. An existing file is never replaced.

    Parameters
    ----------
    what : {material|shape|printer|quality|instrument|design|target|experiment}
    pack : PACK
        One of your packs, in place of the working folder.
    """
    from sensorgen.workflows.templates import new

    return new(what, name, pack)
