"""``sensorgen invert`` of an array: frames to pressure maps."""

from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.cli import render
from sensorgen.cli.options import ArrayFrames, refuse_input
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.cli.inversion_task import Task
    from sensorgen.design.design import Design
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.sessions import ArrayCalibration


def invert(design: "Design", task: "Task", frames: ArrayFrames, *, perfect: bool, law: str) -> int:
    """Pressure maps of an array's frames."""
    from sensorgen.measure.array_frames import read
    from sensorgen.prediction.array.frames import inverted
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.query import NOISE

    _refuse(task, perfect=perfect, law=law)
    refuse_input(frames.readout)
    model = array_model(design)
    shape = (model.here.shape[0], model.here.shape[1])
    read_in = read(Path(task.measured), shape, frames.frequency_hz)
    apart = read(Path(task.rest_file), shape, read_in.frequency_hz).at_rest() if task.rest_file else None
    noise = NOISE if task.noise is None else task.noise
    how = ArrayReadout(frames.readout, frames.input_ohm, (read_in.frequency_hz,), noise)  # type: ignore[arg-type]
    maps = inverted(
        model, how, read_in.siemens, read_in.rest, read_in.time_s, frames.scatter, apart, read_in.unused,
        known(frames.calibration), read_in.day, not frames.cells,
    )  # fmt: skip
    if output := task.output or "-" * task.terminal:
        _write(maps, output)
    if frames.plot is not None:
        from sensorgen.analysis.plots import array

        true = None if read_in.pressure_kpa is None else read_in.pressure_kpa[~read_in.rest]
        true = model.carried(true) if true is not None and frames.cells else true
        render.file(frames.plot / f"{design.name}-map.png", array.maps(maps, true), "wrote ")
    for piece in render.pieces(maps, render.form()):
        render.say(piece, nl=False, err=task.terminal)
    if not output:
        render.say("--output FILE.npz writes the maps, FILE.csv force and centre of pressure of every frame", err=True)
    return 0


def known(calibration: Path | None) -> "ArrayCalibration | None":
    """Calibration of a file, where there is one."""
    from sensorgen.prediction.array.sessions import stored

    return stored(calibration) if calibration else None


def _refuse(task: "Task", *, perfect: bool, law: str) -> None:
    """Refuse options of lines."""
    given = {"--perfect": perfect, "--compression": law, "--prior": task.prior, "--force-limit": task.force_limit_n,
             "--newest": task.newest}  # fmt: skip
    if task.output not in ("", "-") and Path(task.output).suffix not in (".npz", ".csv"):
        raise BadInput(
            f"--output {task.output}: expected a name that ends in .npz (maps) or .csv (a row for each frame)"
        )
    if refused := next((option for option, value in given.items() if value), None):
        raise BadInput(f"{refused} is for lines; an array is inverted with --readout, --input, --noise and --scatter")


def _write(maps: "PressureMaps", output: str) -> None:
    """The maps as NPZ, or a row per frame as CSV, "-" to the terminal."""
    if output == "-":
        print("".join(maps.csv()), end="", flush=True)
    else:
        render.file(Path(output), maps.npz() if output.endswith(".npz") else "".join(maps.csv()))
