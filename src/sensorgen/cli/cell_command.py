"""``sensorgen cell``: capacitance per area between certified bounds, for one design or along a sweep."""

from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import options, render
from sensorgen.cli.body_options import BodyChoice
from sensorgen.cli.commands import ended
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import Explain, NoCache, Sweeping
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option
from sensorgen.core.units import FREQUENCY_HZ

if TYPE_CHECKING:
    from sensorgen.design.design import Design

FORMULA = "thesis-"  # how the names of formulas begin
Frequency = Annotated[float | None, Option(kind=FREQUENCY_HZ)]
Press = Annotated[tuple[float, ...], Option(zero=True)]  # fmt: skip


@of_design(
    "cell", *render.options(),
    about="Certified bounds of the capacitance per area, by the least expensive model within the accuracy. Exit code 1 "
    "where none reaches it.",
)  # fmt: skip
def command(
    design: "Design", *, accuracy: Annotated[float | None, Option(kind="ratio")] = None, model: str = "",
    frequency_hz: Frequency = None, press_mm: Press = (), explain: Explain = False, no_cache: NoCache = False,
    body: BodyChoice, sweeping: Sweeping,
) -> int:  # fmt: skip
    """Bounds of one design, or of each of a sweep.

    Parameters
    ----------
    accuracy
        Relative width of the bounds; 1e-3 for a cross-section and 1e-2 in 3D if not given, as in all commands.
    model : NAME
        Ask this model only: columns, thesis-3.35.
    frequency_hz
        Of the field, where a dielectric leaks: --set resistivity_x60=1e8; a loss_x60=0.02 needs none.
    press_mm
        Displacement of the top, as 20um or 0:0.05:0.01, for formulas of it; solved: compress.
    """
    from sensorgen.prediction import capacitance_answer as cell

    options.refuse_explain(explain, many=bool(sweeping.sweep))
    asked = cell.CapacitanceQuestion(accuracy, model, not no_cache, frequency_hz)
    if model.startswith(FORMULA):
        if explain:
            raise BadInput(f"--explain: {model} is asked alone, there is no plan; leave out --model")
        return ended(_by_formula(design, asked, press_mm, sweeping))
    if press_mm:
        raise BadInput("--press is for formulas, as --model thesis-3.1.2; solved, under a stress: sensorgen compress")
    if sweeping.sweep:
        return ended(sweeping.over(design, body, cell.sweep, asked))
    bounds = cell.answer(body(design), asked)
    return ended(bounds, before=bounds.explained() if explain else ())


def _by_formula(design: "Design", asked: Any, press_mm: tuple[float, ...], sweeping: Sweeping) -> Any:
    """Answer of a formula of the thesis, for each design and each displacement."""
    from sensorgen.prediction import thesis_formulas as formulas

    if not sweeping.sweep and len(press_mm) < 2:
        return formulas.answer(design, asked, *press_mm)
    key, points = sweeping.designs(design) if sweeping.sweep else ("", [("", design)])
    return formulas.sweep(key, points, asked, press_mm)
