"""``sensorgen bench``: what a rig is to do, and what it did."""

from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import FOUND_ERRORS, render
from sensorgen.cli.bench_recordings import bench as command  # with its own commands
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import InputResistance, LogFile, Readout, refuse_input
from sensorgen.core.errors import BadInput, OutOfRange, within
from sensorgen.core.options import Option
from sensorgen.prediction.query import Noise

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.lab.devices import Clock, FrameMeter, Identity
    from sensorgen.measure.lab.experiment import Experiment
    from sensorgen.measure.lab.frame_live import FrameFeed, NamedPress
    from sensorgen.measure.lab.run import PlannedRun
    from sensorgen.prediction.array.live import LiveMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.calibration.specimen import SpecimenModel


@dataclass(frozen=True)
class Rig:
    """The rig: the real one, or a virtual one.

    Attributes
    ----------
    simulate
        A virtual specimen on a virtual rig, by its own clock.
    real_time
        With --simulate: by the real clock, to watch.
    again, --resume : RUN
        Go on with a run that ended early.
    page, --page/--no-page
        Show the run in the browser; with real devices by default.
    watchdog, --watchdog/--no-watchdog
        Load a program that lifts the tip into the actuator's controller; required above 1 N.
    yes
        Do not ask before the rig moves.
    """

    simulate: bool = False
    real_time: bool = False
    again: str = ""
    page: bool | None = None
    watchdog: bool = True
    yes: bool = False

    def __post_init__(self) -> None:
        """Refuse the real clock twice."""
        if self.real_time and not self.simulate:
            raise BadInput("--real-time without --simulate; real devices know no other time")

    def shows(self, *, simulated: bool) -> bool:
        """True where the run is shown in the browser."""
        return (self.page if self.page is not None else not simulated or self.real_time) and not render.form()


@of_function(
    "run",
    *render.options("json", file=False),
    group=command,
    short="Press a specimen by an experiment file, or a virtual one.",
)
def _run(experiment: Path | None = None, *, rig: Rig, log: LogFile) -> int:
    """Run an experiment: check, zero and find the contact gently, press, and record into the log.

    The tip goes up whatever happens: at the end, at an error of any device, at Ctrl-C, and when this process dies.
    Keys while it runs: p pause, r resume, q end. --simulate runs the same experiment on a virtual rig, as fast as it
    goes, and the log says so. 'sensorgen new experiment NAME' writes a file to begin with.

    Exit code 1: a rule, a fault or somebody ended the run early; the reason is printed, what was recorded is in the
    log, and --resume goes on.

    Parameters
    ----------
    experiment : EXPERIMENT.yaml
    """
    from sensorgen.measure.lab import sessions

    if bool(experiment) == bool(rig.again):
        raise BadInput(f"{'both' if experiment else 'neither'} of an experiment and --resume; expected one of them")
    with ExitStack() as stack:
        rows = stack.enter_context(log.opened(create=rig.simulate))
        asked = sessions.new(experiment, simulate=rig.simulate) if experiment else sessions.again(rows, rig.again)
        if asked.simulated:
            render.say("solving the virtual specimen, once for each design", err=True)
        page = rig.shows(simulated=asked.simulated)
        session = stack.enter_context(sessions.Session(asked, rows, real_time=rig.real_time, page=page, model=_model))
        if session.url:
            render.say(f"live page: {session.url}", err=True)
        sure = rig.yes or asked.simulated
        result = session.run(lambda plan, who: _confirmed(plan, who, yes=sure), watchdog=rig.watchdog)
    render.deliver(result)
    return 0 if result.end == "done" else FOUND_ERRORS


def _model(design: "Design", experiment: "Experiment") -> "SpecimenModel":
    """Model of a specimen by its design, for the choice of presses and the page's prediction."""
    import numpy as np

    from sensorgen.analysis.calibration import Bench, spread_of
    from sensorgen.prediction import bodies
    from sensorgen.prediction.calibration.specimen import SpecimenModel
    from sensorgen.prediction.query import Query, Tip
    from sensorgen.prediction.sensor_model import sensor_model

    tip_m = experiment.pressing.length_mm * 1e-3
    predicted, _ = sensor_model(bodies.default_body(design), Query(tip=Tip(tip_m)))
    tones = np.array(experiment.readout.tones_hz)
    return SpecimenModel(predicted.sensor, tones, spread_of(predicted, Bench(tip_m)))


def _confirmed(plan: "PlannedRun", identities: "Mapping[str, Identity]", *, yes: bool) -> bool:
    """Print who is there and what is planned; whether the rig may move."""
    for role, who in identities.items():
        render.say(f"{role}: {who.model} {who.serial} {who.firmware}", err=True)
    render.say(plan.summary(), err=True)
    try:
        return yes or click.confirm("The rig moves now. Is it free, and the specimen in place?", err=True)
    except click.Abort:  # no terminal to ask
        return False


Presses = Annotated[int, Option(kind=click.IntRange(1))]
Repeats = Annotated[int, Option(kind=click.IntRange(0))]
Forces = Annotated[tuple[float, ...], Option(typed="0,6N", zero=True)]


@of_design(
    "plan", *render.options("json", "markdown", file=False), group=command,
    short_help="Write random presses, seeded, inside the sensor.",
    about="Write random presses for a rig: seeded, so that the same seed is the same plan, forces and positions "
    "independent of each other, the tip whole on the sensor. CSV, a row per press, from the begin of the run.",
)  # fmt: skip
def _plan(
    design: "Design", *, presses: Presses = 100, repeats: Repeats = 0, force_n: Forces,
    tip_mm: Annotated[float, Option(typed="10mm")], dwell_s: float = 4.0, rest_s: float = 6.0, seed: int = 0,
    output: Path | None = None, picture: Annotated[Path | None, Option(kind="png")] = None,
) -> None:  # fmt: skip
    """Write a plan of random presses.

    Parameters
    ----------
    presses
        How many points are pressed.
    repeats
        How often each point comes back.
    force_n : LOW,HIGH
        Least and largest force.
    tip_mm : MM
        Length of the tip, which stays on the sensor whole.
    dwell_s : S
        How long each press lasts.
    rest_s : S
        How long each rest lasts.
    seed
        Of the random numbers: the same, the same plan.
    output, --output, -o : FILE
        CSV file to write; the terminal if not given.
    picture : FILE.png
        Draw the plan.
    """
    from sensorgen.core import files
    from sensorgen.measure.signal.presses import RunPlan

    if len(force_n) != 2:
        raise BadInput(f"--force: {len(force_n)} values; expected the least and the largest, as in 0,6N")
    if seed < 0:
        raise OutOfRange(f"--seed {seed}; expected a whole number from 0 on")
    length = design.params.length_mm
    if tip_mm > length:
        raise OutOfRange(f"--tip {tip_mm:g} mm is longer than the sensor, {length:g} mm; expected a shorter one")
    where = (tip_mm / 2, length - tip_mm / 2)
    plan = RunPlan(seed, presses, (force_n[0], force_n[1]), where, dwell_s, rest_s, repeats, design.name)
    if picture:
        from sensorgen.analysis.plots import recordings, static

        files.replace(picture, static.png(recordings.schedule(plan.steps(), plan.seconds())))
    table = "".join(render.pieces(plan, "csv"))
    if output:
        files.replace(output, table.encode())
    if render.form():
        render.deliver(plan)
    else:
        render.say(f"{output}: {list(plan.document())[-1]}" if output else table, nl=bool(output))


Scatter = Annotated[float, Option(kind="share", typed="5%")]
_FREQUENCY_HZ = 10e3  # of a virtual array


@of_design(
    "array", group=command, short_help="Read an array live: map, centre of pressure and force in the browser.",
    about="Read the frames of an array as they come, and show pressures, the trace of the centre of pressure, force "
    "and regions in the browser. On the page U says that nothing is on the array, R records, space pauses, Esc ends.",
)  # fmt: skip
def _array(
    design: "Design", *, port: str = "", kind: str = "frame-stream", simulate: bool = False, rate_hz: float = 100.0,
    faults: tuple[str, ...] = (), record: Path | None = None, unloaded_s: float = 0.0, seconds: float = inf,
    readout: Readout = "guarded", input_ohm: InputResistance = 50.0, noise: Noise, scatter: Scatter = 0.05,
    calibration: Path | None = None, day: float = nan, press: str = "", page: bool = True,
) -> int:  # fmt: skip
    """Read an array live.

    Parameters
    ----------
    port : ADDRESS
        Serial port, or socket://HOST:PORT.
    kind
        Of the device, one of 'sensorgen list devices' for arrays.
    simulate
        A virtual array: three seconds at rest (--unloaded 2 takes them for it), then a step each second.
    rate_hz : HZ
        Frames per second of the virtual array.
    faults, --fault
        Of the virtual array, as of 'sensorgen array'.
    record : FILE
        New file of all frames: .h5 or .csv as they come, .npz at the end.
    unloaded_s, --unloaded : S
        Nothing is on the array in the first seconds.
    seconds : S
        End after so long.
    scatter
        Gain from cell to cell, before a calibration.
    calibration : FILE.npz
        By 'sensorgen calibrate --array'.
    day
        Of the recording, as the calibration counts them.
    press : r3c2
        Crossing that is pressed first: wires that are swapped are named.
    page, --page/--no-page
        Show it in the browser.
    """
    from sensorgen.cli.inversion import known
    from sensorgen.measure.lab.devices import RealClock
    from sensorgen.measure.lab.frame_live import FrameFeed, MapView, follow, recorder
    from sensorgen.prediction.array.live import LiveMaps
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout

    if bool(port) == simulate:
        raise BadInput(f"{'both' if port else 'neither'} of --port and --simulate; expected one of them")
    if not (seconds > 0 and 0 <= unloaded_s < inf):
        raise BadInput(f"--seconds {seconds:g}, --unloaded {unloaded_s:g}; expected seconds above 0, and 0 or more")
    refuse_input(readout)
    model, clock = array_model(design), RealClock()
    first = _first_press(press, model.here.shape)
    _ = model.regions  # refused before a device is opened
    how = ArrayReadout(readout, input_ohm, (_FREQUENCY_HZ,), noise)  # type: ignore[arg-type]
    meter = _virtual(model, how, rate_hz, faults, clock) if simulate else _device(kind, port, clock)
    with ExitStack() as stack:
        stack.callback(meter.close)
        render.say(meter.identify().model, err=True)
        _refuse_shape(meter, model)
        how = ArrayReadout(readout, input_ohm, (meter.frequency_hz,), noise)  # type: ignore[arg-type]
        live = LiveMaps(model, how, scatter, known(calibration), day)
        file = recorder(record, meter.shape, meter.frequency_hz) if record else None
        if file:
            stack.callback(file.close)
        feed = FrameFeed(meter, clock, file, unloaded_s)
        view = stack.enter_context(MapView(design.name, model)) if page else None
        if view:
            render.say(f"live page: {view.url}", err=True)
        reader = Thread(target=feed.run, daemon=True)
        stack.callback(reader.join, 5.0)
        stack.callback(feed.stop)
        reader.start()
        with suppress(KeyboardInterrupt):
            follow(feed, live, view, clock, clock.now() + seconds, first)
    _report(feed, live, first)
    return 0


def _report(feed: "FrameFeed", live: "LiveMaps", first: "NamedPress | None") -> None:
    """Say what came, and what the known press showed."""
    from sensorgen.measure.lab.frame_live import PRESS_FRAMES

    counts = ", ".join(f"{count} {name}" for name, count in feed.counts.items())
    by = f"by {live.plan.words()}" if live.tared else "no frame at rest: give --unloaded S, seconds without a load"
    if first:
        render.say(first.words() or f"no press of {PRESS_FRAMES} frames: nothing is known of the wires", err=True)
    render.say(f"{counts}, {live.dropped} not inverted; {by}", err=True)


def _first_press(crossing: str, shape: tuple[int, int]) -> "NamedPress | None":
    """The press on a crossing by its name; BadInput of one that the array has not."""
    from sensorgen.measure.array_frames import crossings
    from sensorgen.measure.lab.frame_live import NamedPress

    with within("--press"):
        return NamedPress(crossings((crossing,), shape)[crossing]) if crossing else None


def _refuse_shape(meter: "FrameMeter", model: "ArrayModel") -> None:
    if meter.shape != model.here.shape:
        (m, n), (rows, columns) = meter.shape, model.here.shape
        raise BadInput(f"frames of {m} x {n}; expected {rows} x {columns}, as of {model.design.name}")


def _device(kind: str, port: str, clock: "Clock") -> "FrameMeter":
    from sensorgen.measure.lab import catalogue

    if catalogue.kind(kind).role != "array":
        raise BadInput(f"--kind {kind}: no device for arrays; 'sensorgen list devices' has them")
    return catalogue.opened(kind, port, {}, clock)  # type: ignore[return-value]


def _virtual(
    model: "ArrayModel", how: "ArrayReadout", rate_hz: float, faults: tuple[str, ...], clock: "Clock"
) -> "FrameMeter":  # fmt: skip
    from sensorgen.measure.lab.frame_stream import FrameStream
    from sensorgen.measure.lab.port import SimulatedPort
    from sensorgen.measure.virtual.array import sender

    return FrameStream(SimulatedPort(sender(model, how, rate_hz, faults=faults), clock), clock)
