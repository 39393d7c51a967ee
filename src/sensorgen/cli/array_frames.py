"""``sensorgen invert`` of an array: frames to pressure maps."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.cli import render
from sensorgen.cli.options import ArrayFrames, refuse_input
from sensorgen.core import files as store
from sensorgen.core.errors import BadInput
from sensorgen.measure.array_frames import read
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.sessions import stored
from sensorgen.prediction.query import NOISE

if TYPE_CHECKING:
    from sensorgen.cli.inversion_task import Task
    from sensorgen.core.arrays import Complex
    from sensorgen.design.design import Design
    from sensorgen.measure.array_frames import Frames
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.live import LiveMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.sessions import ArrayCalibration


def invert(design: "Design", task: "Task", frames: ArrayFrames, *, perfect: bool, law: str) -> int:
    """Pressure maps of an array's frames."""
    from sensorgen.prediction.array.frames import inverted
    from sensorgen.prediction.array.model import array_model

    _refuse(task, perfect=perfect, law=law)
    refuse_input(frames.readout)
    model = array_model(design)
    if task.measured == "-":
        return _as_they_come(model, task, frames)
    shape = (model.here.shape[0], model.here.shape[1])
    read_in = read(Path(task.measured), shape, frames.frequency_hz)
    apart, how = _at_rest(task, shape, read_in), _readout(task, frames, read_in)
    maps = inverted(
        model, how, read_in.siemens, read_in.rest, read_in.time_s, frames.scatter, apart, read_in.unused,
        known(frames.calibration), read_in.day, not frames.cells,
    )  # fmt: skip
    if task.output:
        _write(maps, task.output)
    if frames.plot is not None:
        from sensorgen.analysis.plots import array

        true = None if read_in.pressure_kpa is None else read_in.pressure_kpa[~read_in.rest]
        render.file(frames.plot / f"{design.name}-map.png", array.maps(maps, true), "wrote ")
    for piece in render.pieces(maps, render.form()):
        render.say(piece, nl=False, err=task.output == "-")
    if not task.output:
        render.say("--output FILE.npz writes the maps, FILE.csv force and centre of pressure of every frame")
    return 0


def _as_they_come(model: "ArrayModel", task: "Task", frames: ArrayFrames) -> int:
    """Force and centre of pressure of frames on the standard input, a row each as they come."""
    from sensorgen.measure.array_frames import lots
    from sensorgen.prediction.array.frames import at_rest

    if frames.plot is not None or task.output.endswith(".npz"):
        raise BadInput("frames on the standard input: expected -o FILE.csv, or rows on the terminal, without --plot")
    shape, count = (model.here.shape[0], model.here.shape[1]), 0
    with ExitStack() as stack:
        file = None if task.terminal else stack.enter_context(store.replacing(Path(task.output)))
        for k, lot in enumerate(lots("-", shape, frames.frequency_hz)):
            if k == 0:
                live = _live(model, task, frames, lot)
            if maps := live.take(lot.siemens, lot.time_s, lot.rest):
                text = "".join(maps.csv())
                text, count = text[text.index("\n") + 1 :] if count else text, count + len(maps.time_s)
                file.write(text.encode()) if file else print(text, end="", flush=True)
        if not live.tared:
            at_rest(model, live.readout, lot.siemens[:0], unused=lot.unused)
    render.say(f"{count} frames by {live.plan.words()}; {live.dropped} left out", err=True)
    return 0


def _live(model: "ArrayModel", task: "Task", frames: ArrayFrames, first: "Frames") -> "LiveMaps":
    """Inversion of frames of which the first are known, by readings at rest of a file where there is one."""
    from sensorgen.prediction.array.live import LiveMaps

    readout = _readout(task, frames, first)
    live = LiveMaps(model, readout, frames.scatter, known(frames.calibration), first.day, task.newest)
    apart = _at_rest(task, first.siemens.shape[1:], first)
    if apart is not None:
        live.take(apart, np.arange(float(len(apart))), np.ones(len(apart), bool))
    return live


def known(calibration: Path | None) -> "ArrayCalibration | None":
    """Calibration of a file, where there is one."""
    return stored(calibration) if calibration else None


def _readout(task: "Task", frames: ArrayFrames, of: "Frames") -> "ArrayReadout":
    noise = NOISE if task.noise is None else task.noise
    return ArrayReadout(frames.readout, frames.input_ohm, (of.frequency_hz,), noise)  # type: ignore[arg-type]


def _at_rest(task: "Task", shape: tuple[int, ...], of: "Frames") -> "Complex | None":
    """Readings at rest of a file of their own."""
    return read(Path(task.rest_file), (shape[0], shape[1]), of.frequency_hz).at_rest() if task.rest_file else None


def _refuse(task: "Task", *, perfect: bool, law: str) -> None:
    """Refuse options of lines."""
    given = {"--perfect": perfect, "--compression": law, "--prior": task.prior, "--force-limit": task.force_limit_n,
             "--newest": task.newest and task.measured != "-"}  # fmt: skip
    if refused := next((option for option, value in given.items() if value), None):
        raise BadInput(f"{refused} is for lines; an array is inverted with --readout, --input, --noise and --scatter")


def _write(maps: "PressureMaps", output: str) -> None:
    """The maps as NPZ, or a row per frame as CSV, "-" to the terminal."""
    if output == "-":
        print("".join(maps.csv()), end="", flush=True)
    else:
        render.file(Path(output), maps.npz() if output.endswith(".npz") else "".join(maps.csv()))
