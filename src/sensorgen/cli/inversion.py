"""``sensorgen invert``: readings of a line or an array, what becomes of them; and sessions that calibrate an array."""

import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import render
from sensorgen.cli.options import ArrayFrames, InputResistance, Readout, refuse_input, refuse_typed
from sensorgen.core import files as store
from sensorgen.core import units
from sensorgen.core.errors import BadInput, within
from sensorgen.core.options import Argument, Option

if TYPE_CHECKING:
    from sensorgen.cli.designs import BodyChoice
    from sensorgen.core.arrays import Real
    from sensorgen.core.document import Documented
    from sensorgen.design.design import Design
    from sensorgen.measure.array_frames import Frames
    from sensorgen.measure.readings import Readings
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.sessions import ArrayCalibration
    from sensorgen.prediction.inverse.estimator import Prior


_NORMAL = re.compile(r"(force|position)=(.+?)(?:\+-|±)(.+)")


@dataclass(frozen=True)
class Task:
    """Readings to invert, their noise and prior.

    Attributes
    ----------
    measured : MEASURED.csv
    rest_file, --rest : FILE.csv
        Readings with nothing on the sensor, if MEASURED.csv has no column 'rest' with 1 for them.
    noise : SHARE
        Standard deviation of R and of X, each as a share of the impedance's magnitude [default: what the readings at
        rest scatter by, else 0.1 %].
    prior : WHAT
        Prior: uniform, or force=3+-1, position=50+-20 (N, mm), or both with a comma.
    force_limit_n : N
        Largest force to look for [default: 13 N, or a quarter above the largest that calibrated].
    output, --output, -o : FILE.csv
        Write a row per sample, '-' to the terminal; readings from the standard input go there by themselves.
    newest
        In real time: of readings that wait, only those at rest and the newest are used; the others are counted.
    """

    measured: Annotated[str, Argument()]
    rest_file: str = ""  # fmt: skip
    noise: Annotated[float | None, Option(kind="share")] = None  # fmt: skip
    prior: str | None = None
    force_limit_n: float | None = None  # fmt: skip
    output: str = ""  # fmt: skip
    newest: bool = False

    def __post_init__(self) -> None:
        """Refuse a noise that none can be."""
        if self.noise is not None and not 0 < self.noise <= 1:
            raise BadInput(f"a noise of {self.noise:g}; expected a share above 0, up to 100 %")

    @property
    def terminal(self) -> bool:
        """True where rows go to the terminal, at once."""
        return self.output == "-" or (self.measured == "-" and not self.output)

    @cached_property
    def distribution(self) -> "Prior | None":
        """The prior as typed."""
        from sensorgen.prediction.inverse.estimator import Prior

        if self.prior is None or self.prior.strip() == "uniform":
            return None if self.prior is None else Prior()
        normal: dict[str, tuple[float, float]] = {}
        for word in self.prior.split(","):
            match = _NORMAL.fullmatch(word.strip().replace(" ", ""))
            if match is None or match[1] in normal:
                raise BadInput(f"--prior {self.prior!r}: expected uniform, or force=3+-1,position=50+-20 (N, mm)")
            read, scale = (units.force_n, 1.0) if match[1] == "force" else (units.length_mm, units.M_PER_MM)
            with within("--prior"):
                normal[match[1]] = read(match[2]) * scale, read(match[3]) * scale
        return Prior(normal.get("force"), normal.get("position"))

    def run(self, beside: tuple[str, ...], method: "Callable[[Readings], Any]") -> int:
        """Invert block by block, and write a row for each reading; then the summary."""
        from sensorgen.measure.readings import readings

        with readings(self.measured, beside=beside, newest=self.newest) as source, ExitStack() as stack:
            inversion = method(source)
            to_file = self.output and not self.terminal
            file = stack.enter_context(store.replacing(Path(self.output))) if to_file else None
            step = stack.enter_context(render.progress(["reading"]))

            def write(text: str) -> None:
                if file:
                    file.write(text.encode())
                elif self.terminal:
                    print(text, end="", flush=True)

            write(inversion.header())
            for block in source.blocks():
                write(inversion.rows(block))
                step(f"{inversion.summary.samples} samples")
        self._deliver(inversion.result(), source.dropped)
        return 0

    def _deliver(self, result: "Documented", dropped: int) -> None:
        if dropped:
            render.say(f"{dropped} readings were dropped for newer ones", err=True)
        for piece in render.pieces(result, render.form()):
            render.say(piece, nl=False, err=self.terminal)
        if not render.form() and not self.terminal:
            render.say(self.output or "--output FILE.csv writes force and position of every sample")


_OF_FRAMES = ("frequency_hz", "readout", "input_ohm")
_OF_LINES = ("perfect", "law", "prior", "force_limit_n", "newest")
_OF_DESIGNS = ("rest_file", "noise", "prior", "newest", "force_limit_n")


def invert(design: "Design", task: Task, frames: ArrayFrames, body: "BodyChoice") -> int:
    """Pressure maps of an array's frames, by a body of one crossing."""
    from sensorgen.measure.array_frames import read
    from sensorgen.prediction.array.frames import inverted
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.query import NOISE

    if task.output not in ("", "-") and Path(task.output).suffix not in (".npz", ".csv"):
        raise BadInput(f"--output {task.output}: expected a name in .npz (maps) or .csv (a row for each frame)")
    refuse_typed(_OF_LINES, "is for lines; an array is inverted with --readout, --input, --noise and --scatter")
    refuse_input(frames.readout)
    model = array_model(design, body=body(design.crossing))
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
        from sensorgen.analysis.plots import array, static

        picture = static.png(array.figure(maps, _true_kpa(read_in, model, cells=frames.cells)))
        render.file(frames.plot / f"{design.name}-map.png", picture, "wrote ")
    for piece in render.pieces(maps, render.form()):
        render.say(piece, nl=False, err=task.terminal)
    if not output:
        render.say("--output FILE.npz writes the maps, FILE.csv force and centre of pressure of every frame", err=True)
    return 0


def _true_kpa(frames: "Frames", model: "ArrayModel", *, cells: bool) -> "Real | None":
    """True pressures of the loaded frames, on the surface or as cells carry them; None where the file has none."""
    if frames.pressure_kpa is None:
        return None
    true = frames.pressure_kpa[~frames.rest]
    return model.carried(true) if cells else true


def known(calibration: Path | None) -> "ArrayCalibration | None":
    """Calibration of a file, where there is one."""
    from sensorgen.prediction.array.sessions import stored

    return stored(calibration) if calibration else None


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
    readout: Readout = "guarded"
    input_ohm: InputResistance = 50.0
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
    from sensorgen.measure.array_frames import of_frames, session
    from sensorgen.prediction.array.sessions import study

    readout = ""
    if how.array is None:
        refuse_typed(_OF_FRAMES, "is of an array's frames; expected --array DESIGN.yaml beside it")
        sessions = [session(Path(file), k) for k, file in enumerate(files)]
    else:
        from sensorgen.design.design import load
        from sensorgen.prediction.array.model import array_model

        refuse_input(readout := how.readout)
        model = array_model(load(how.array))
        recorded = [Path(file) for file in files]
        sessions = of_frames(recorded, model, how.frequency_hz, readout, how.input_ohm)  # type: ignore[arg-type]
    studied = study(sessions, by_first=how.by_first)
    if how.calibration is not None:
        store.replace(how.calibration, replace(studied.calibration, readout=readout).npz())
    render.deliver(studied)
    if how.calibration is not None:
        render.say(how.calibration, err=bool(render.form()))
    return 0


def invert_calibrated(calibration: str, task: Task) -> int:
    """Pressures of an array's elements by a calibration alone, a row for each frame, with half-widths of 90 %."""
    import numpy as np

    from sensorgen.core import files
    from sensorgen.measure.array_frames import session
    from sensorgen.prediction.array.sessions import doubts, stored

    refuse_typed(_OF_DESIGNS, "has no meaning with a calibration of an array; mark unloaded frames in 'rest'")
    measured, output, known = task.measured, task.output, stored(Path(calibration))
    of = session(Path(measured), nan)
    with within(measured):
        of = replace(of.matched(known.names), day=known.counted(of.day))
    if of.reading.shape[1] != len(known.law.alive):
        raise BadInput(f"{measured}: {of.reading.shape[1]} elements; expected {len(known.law.alive)}, as calibrated")
    free = of.unloaded if of.rest.any() else known.recognised(of)
    of = replace(of, rest=free)
    for line in doubts(of):
        render.say(f"{measured}: {line}", err=output in ("", "-"))
    mean, half = known.pressures(of.steady())
    elements = known.names or range(1, mean.shape[1] + 1)
    names = [f"{part}_{element}_kpa" for element in elements for part in ("p", "half")]
    both = np.stack([mean, half], -1).reshape(len(mean), -1)
    text = render.columns(["time_s", *names], np.column_stack([of.time_s, both]).tolist())
    if output in ("", "-"):
        print(text, end="")
        return 0
    files.replace(Path(output), text.encode())
    first = of.time_s[free.argmax()]
    render.say(f"{output}: {len(mean)} frames, unloaded from {first:g} s, {int(known.law.alive.sum())} elements")
    return 0
