"""``sensorgen compress``: displacement and capacitance of a cell under pressure."""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import options, render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.commands import ended
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Explain, NoCache, Sides, Sweeping
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.compression import PressQuestion

MODELS = ("press2d", "press3d", "press_round", "springs", "unconfined", "bonded", "infill")


@dataclass(frozen=True)
class PressOptions:
    """Stresses, boundary conditions and accuracy.

    Attributes
    ----------
    stress
        Stresses on the top [kPa]; 0 is put before them.
    contact
        What faces do that touch.
    model
        Finite elements of a cross-section, of boxes or of round bodies, springs of columns, or laws of a plate (B.49,
        bonded) or of infill; the first that fits if not given.
    accuracy
        Largest relative error of the rise C(p) - C(0), as 2e-2: the coarsest mesh within it. 1e-2 is the least.
    check_mesh
        Solve on a finer mesh too, and compare.
    """

    stress: Annotated[tuple[float, ...], Option(kind=units.STRESS_KPA, typed="0:100:10", zero=True)] = ()
    sides: Sides = "bonded"
    contact: Annotated[str, Option(kind=("frictionless", "stick"))] = "frictionless"
    model: Annotated[str, Option(kind=MODELS)] = ""  # fmt: skip
    accuracy: Annotated[float | None, Option(kind="ratio")] = None
    check_mesh: bool = False
    no_cache: NoCache = False

    def __post_init__(self) -> None:
        """Refuse two checks of the mesh."""
        if self.accuracy is not None and self.check_mesh:
            raise BadInput("--accuracy and --check-mesh at once; the first checks the mesh too, expected one of them")

    def asked(self) -> "PressQuestion":
        """The question as the solvers take it."""
        from sensorgen.prediction import compression

        return compression.PressQuestion(
            compression.stresses_kpa(self.stress), compression.boundary(self.sides, contact=self.contact), self.model,
            self.accuracy or inf, check_mesh=self.check_mesh, keep=not self.no_cache, sides=self.sides,
        )  # fmt: skip


@of_design(
    "compress", *render.options(), tip=True,
    about="Press a cell: displacement and capacitance over stress, by finite elements with contact; of a cross-section "
    "in plane strain, of boxes in 3D, of round and tapered bodies about their axis. Exit code 1 where a check says "
    "that the answer is not to be trusted.",
)  # fmt: skip
def command(
    design: "Design", question: PressOptions, body: BodyChoice, sweeping: Sweeping, *, explain: Explain = False,
    plot: Annotated[Path | None, Option(kind="png")] = None,
) -> int:  # fmt: skip
    """Press one design, or each of a sweep.

    Parameters
    ----------
    plot : FILE.png
        Draw displacement and capacitance over stress.
    """
    from sensorgen.prediction import compression

    options.refuse_explain(explain, many=bool(sweeping.sweep))
    if explain and question.accuracy is None:
        raise BadInput("--explain without --accuracy: there is no plan; expected an accuracy, as --accuracy 1e-2")
    if plot and sweeping.sweep:
        raise BadInput("--plot draws one design; expected --csv or --json with --sweep")
    asked = question.asked()
    if sweeping.sweep:
        return ended(sweeping.over(design, body, compression.sweep, asked))
    with render.pressing(asked.stress_kpa) as step:
        result: Any = compression.answer(body(design), asked, step=step)
    if plot:
        from sensorgen.analysis.plots import compression as figures
        from sensorgen.analysis.plots import static
        from sensorgen.core import files

        files.replace(plot, static.png(figures.figure(result)))
    return ended(result, before=result.explained() if explain else ())
