"""``sensorgen bench array``: an array read live, or a virtual one."""

from contextlib import ExitStack, suppress
from math import inf, nan
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.bench_recordings import bench
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import InputResistance, Readout, refuse_input
from sensorgen.core.errors import BadInput, within
from sensorgen.core.options import Option
from sensorgen.prediction.query import Noise

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.lab.devices import Clock, FrameMeter
    from sensorgen.measure.lab.frame_live import FrameFeed, NamedPress
    from sensorgen.prediction.array.live import LiveMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.readout import ArrayReadout

Scatter = Annotated[float, Option(kind="share", typed="5%")]
_FREQUENCY_HZ = 10e3  # of a virtual array


@of_design(
    "array", group=bench, short_help="Read an array live: map, centre of pressure and force in the browser.",
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
    _refuse_times(seconds, unloaded_s)
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


def _refuse_times(seconds: float, unloaded_s: float) -> None:
    if not (seconds > 0 and 0 <= unloaded_s < inf):
        raise BadInput(f"--seconds {seconds:g}, --unloaded {unloaded_s:g}; expected seconds above 0, and 0 or more")


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
