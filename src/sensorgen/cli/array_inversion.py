"""``sensorgen calibrate`` and ``invert`` of arrays: frames to pressure maps, and sessions with references."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.cli import render
from sensorgen.cli.inversion_task import Task
from sensorgen.cli.options import ArrayFrames, refuse_input
from sensorgen.core.errors import BadInput, within

if TYPE_CHECKING:
    from sensorgen.cli.inversion_task import Task
    from sensorgen.design.design import Design
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.sessions import ArrayCalibration


def invert(design: "Design", task: Task, frames: ArrayFrames, *, perfect: bool, law: str) -> int:
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


def _refuse(task: Task, *, perfect: bool, law: str) -> None:
    """Refuse options of lines."""
    given = {"--perfect": perfect, "--compression": law, "--prior": task.prior, "--force-limit": task.force_limit_n,
             "--newest": task.newest}  # fmt: skip
    if refused := next((option for option, value in given.items() if value), None):
        raise BadInput(f"{refused} is for lines; an array is inverted with --readout, --input, --noise and --scatter")


def _write(maps: "PressureMaps", output: str) -> None:
    """The maps as NPZ, or a row per frame as CSV, "-" to the terminal."""
    if output == "-":
        print("".join(maps.csv()), end="", flush=True)
    else:
        render.file(Path(output), maps.npz() if output.endswith(".npz") else "".join(maps.csv()))


SUFFIXES = (".csv", ".npz", ".h5", ".hdf5", ".hdf")


@dataclass(frozen=True)
class ArrayOptions:
    """Calibration of an array.

    Attributes
    ----------
    array : DESIGN.yaml
        Of an array's frames: its design, so that C/C0 is calibrated.
    frequency_hz
        Of an array's frames, where their file has none.
    calibration : FILE.npz
        Of an array: write the calibration there.
    by_first
        Of an array: test each session by a calibration of the first alone.
    """

    array: Path | None = None
    frequency_hz: float | None = None
    calibration: Path | None = None
    by_first: bool = False


def are_files(words: Sequence[str]) -> bool:
    """Test whether words are recordings, not specimens; BadInput of both."""
    count = sum(Path(word).suffix in SUFFIXES for word in words)
    if 0 < count < len(words):
        raise BadInput(f"{count} recordings beside {len(words) - count} specimens; expected files of one array alone")
    return count > 0


def calibrate(files: Sequence[str], how: ArrayOptions) -> int:
    """Calibrate the elements of an array by sessions."""
    from sensorgen.core import files as store
    from sensorgen.measure.array_sessions import of_frames, session
    from sensorgen.prediction.array.sessions import study

    if how.array is None:
        if how.frequency_hz is not None:
            raise BadInput("--frequency is of an array's frames; expected --array DESIGN.yaml beside it")
        sessions = [session(Path(file), k) for k, file in enumerate(files)]
    else:
        from sensorgen.design.design import load
        from sensorgen.prediction.array.model import array_model

        sessions = of_frames([Path(file) for file in files], array_model(load(how.array)), how.frequency_hz)
    studied = study(sessions, by_first=how.by_first)
    if how.calibration is not None:
        store.replace(how.calibration, studied.calibration.npz())
    render.deliver(studied)
    if how.calibration is not None:
        render.say(how.calibration, err=bool(render.form()))
    return 0


def invert_calibrated(calibration: str, task: Task) -> int:
    """Pressures of an array's elements by a calibration alone, a row for each frame, with half-widths of 90 %."""
    import numpy as np

    from sensorgen.core import files
    from sensorgen.core.document import Column, Table, comma_separated
    from sensorgen.measure.array_sessions import session
    from sensorgen.prediction.array.sessions import stored

    given = {"--rest": task.rest_file, "--noise": task.noise, "--prior": task.prior, "--newest": task.newest,
             "--force-limit": task.force_limit_n}  # fmt: skip
    if refused := next((option for option, value in given.items() if value), None):
        raise BadInput(f"{refused} has no meaning with a calibration of an array; mark unloaded frames in 'rest'")
    measured, output, known = task.measured, task.output, stored(Path(calibration))
    of = session(Path(measured), nan)
    with within(measured):
        of = replace(of.matched(known.names), day=known.counted(of.day))
    if of.reading.shape[1] != len(known.law.alive):
        raise BadInput(f"{measured}: {of.reading.shape[1]} elements; expected {len(known.law.alive)}, as calibrated")
    free = of.unloaded if of.rest.any() else known.recognised(of)
    tare = replace(of, rest=free).tare
    mean, half = known.pressures(of, tare)
    elements = known.names or range(1, mean.shape[1] + 1)
    names = [f"{part}_{element}_kpa" for element in elements for part in ("p", "half")]
    both = np.stack([mean, half], -1).reshape(len(mean), -1)
    cells = [[None if v != v else v for v in row] for row in np.column_stack([of.time_s, both]).tolist()]
    columns = tuple(Column(name, key=name) for name in ("time_s", *names))
    text = comma_separated(Table("pressures", "", columns, tuple(map(tuple, cells))))
    if output in ("", "-"):
        print(text, end="")
        return 0
    files.replace(Path(output), text.encode())
    first = of.time_s[free.argmax()]
    render.say(f"{output}: {len(mean)} frames, unloaded from {first:g} s, {int(known.law.alive.sum())} elements")
    return 0
