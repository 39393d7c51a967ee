"""``sensorgen invert`` of an array: frames to pressure maps."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from sensorgen.cli import render
from sensorgen.cli.words import one
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.core.arrays import Real
    from sensorgen.design.design import Design
    from sensorgen.prediction.array.frames import PressureMaps

_NOT_HERE = {"perfect": "--perfect", "prior": "--prior", "force_limit_n": "--force-limit", "newest": "--newest",
             "compression": "--compression"}  # fmt: skip


def invert(
    design: "Design", measured: str, output: str | None, noise: float | None, rest_file: str | None, *, readout: str,
    input_ohm: float, frequency: tuple[float, ...] | None, scatter: float, plot: Path | None,
    calibration: Path | None, **others: Any,
) -> int:  # fmt: skip
    """Pressure maps of an array's frames."""
    from sensorgen.measure.array_frames import read
    from sensorgen.prediction.array.frames import inverted
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.sessions import stored
    from sensorgen.prediction.query import NOISE

    _refuse(others)
    refuse_input(readout)
    model = array_model(design)
    shape = (model.here.shape[0], model.here.shape[1])
    hertz = one("--frequency", frequency) if frequency else None
    frames = read(Path(measured), shape, hertz)
    apart = read(Path(rest_file), shape, frames.frequency_hz).at_rest() if rest_file else None
    how = ArrayReadout(readout, input_ohm, (frames.frequency_hz,), NOISE if noise is None else noise)  # type: ignore[arg-type]
    known = None if calibration is None else stored(calibration)
    found = inverted(model, how, frames.siemens, frames.rest, frames.time_s, scatter, apart, frames.unused, known)
    if output:
        _write(found, output)
    if plot is not None:
        true = None if frames.pressure_kpa is None else frames.pressure_kpa[~frames.rest]
        _draw(found, true, plot / f"{design.name}-map.png")
    for piece in render.pieces(found, render.form()):
        render.say(piece, nl=False, err=output == "-")
    if not output:
        render.say("--output FILE.npz writes the maps, FILE.csv force and centre of pressure of every frame")
    return 0


def refuse_input(readout: str) -> None:
    """Refuse ``--input`` of a readout by two terminals."""
    given = click.get_current_context().get_parameter_source("input_ohm")
    if readout != "guarded" and given is ParameterSource.COMMANDLINE:
        raise BadInput("--input is of the guarded readout; expected no --input with --readout two-terminal")


def _refuse(others: dict[str, Any]) -> None:
    """Refuse options of lines."""
    if refused := next((_NOT_HERE[key] for key, value in others.items() if value and key in _NOT_HERE), None):
        raise BadInput(f"{refused} is for lines; an array is inverted with --readout, --input, --noise and --scatter")


def _draw(found: "PressureMaps", true: "Real | None", where: Path) -> None:
    from sensorgen.analysis.plots import array
    from sensorgen.core import files

    files.replace(where, array.maps(found, true))
    render.say(f"wrote {where}", err=bool(render.form()))


def _write(found: "PressureMaps", output: str) -> None:
    """The maps as NPZ, or a row per frame as CSV, "-" to the terminal."""
    if output == "-":
        print("".join(found.csv()), end="", flush=True)
        return
    from sensorgen.core import files

    path = Path(output)
    files.replace(path, found.npz() if path.suffix == ".npz" else "".join(found.csv()).encode())
    render.say(output, err=bool(render.form()))
