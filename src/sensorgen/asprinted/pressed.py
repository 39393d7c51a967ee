"""What is printed of a design under pressure: the cell that is pressed, and the sensor that it makes."""

from dataclasses import replace

from sensorgen.asprinted import compared
from sensorgen.asprinted.compared import Printed
from sensorgen.core.bounds import Interval
from sensorgen.design.design import Design
from sensorgen.models.sensor import UNIFORM
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction import sensor_of_design as sensing
from sensorgen.prediction.capacitance import Unloaded, Unpredictable
from sensorgen.prediction.compression_law import Law
from sensorgen.prediction.mesh_ladder import Piece, drawn
from sensorgen.prediction.sensor_of_design import Sensed
from sensorgen.scene.sections import sections

_SOLID = "electrodes as solid plates: the contacts between printed lines add to their resistance"
_LOSSES = "losses of the cell as drawn"


def piece(design: Design, printed: Printed) -> Piece:
    """One period of a print, by the first convention for a line's width.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Printed
        What is printed of it.
    """
    scene, _ = compared.cell(design, printed.first())
    if drawn(design).period_mm is None:
        return Piece(scene, None)
    return Piece(scene, scene.size_mm["xy".index(sections(scene)[0].across)])


def width_by(printed: Printed) -> str:
    """Who says what is printed, and how wide its lines are taken to be where it is pressed."""
    return f"{printed.source}, lines by {next(iter(printed.layers))}"


def unloaded(design: Design, printed: Printed, accuracy: float = compared.ACCURACY) -> Unloaded:
    """What is known of a print before anything presses on it; its capacitance between all conventions.

    Parameters
    ----------
    design, printed : Design, Printed
        As of :func:`piece`.
    accuracy : float
        How wide the bounds by one convention may be, relative to their middle [-].

    Raises
    ------
    Unpredictable
        No model can speak of what is printed, or of what is drawn.
    """
    found = compared.capacitance_f(design, printed, accuracy)
    known = [c for c in found.values() if isinstance(c, Interval)]
    if not known:
        raise Unpredictable(f"as printed: {next(iter(found.values()))}")
    span = Interval(min(c.lower for c in known), max(c.upper for c in known))
    plain = planner.unloaded(design)
    said = f"printed, lines by {', '.join(found)}"
    return replace(plain, answer=planner.Answer(said, span, (), wanted=accuracy))


def sensor_of(
    design: Design, printed: Printed, law: str | Law = "", tip_m: float = sensing.TIP_M, *,
    profile: str = UNIFORM, radius_m: float | None = None, known: Unloaded | None = None,
) -> Sensed:  # fmt: skip
    """The sensor that is printed.

    Parameters
    ----------
    design, printed : Design, Printed
        As of :func:`piece`.
    law, tip_m, profile, radius_m : str or Law, float, str, float
        As of :func:`sensorgen.prediction.sensor_of_design.sensor_of`; lengths in [m].
    known : Unloaded
        What :func:`unloaded` says, if it is at hand.

    Raises
    ------
    Unpredictable
        As :func:`unloaded`.
    MissingValue, UnknownName, OutOfRange
        As :func:`sensorgen.prediction.sensor_of_design.sensor_of`.
    """
    found = sensing.sensor_of(
        design, law, tip_m, profile=profile, radius_m=radius_m, known=known or unloaded(design, printed),
        printed=piece(design, printed),
    )  # fmt: skip
    return replace(
        found, caveats=(f"as printed: {width_by(printed)}", _SOLID, *([_LOSSES] if found.lost.taken else []))
    )
