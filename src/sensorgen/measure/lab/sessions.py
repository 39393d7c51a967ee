"""One session at the rig, real or simulated: task, devices, clock, view, guardian, and presses chosen by a model."""

import queue
import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.measure.lab import experiment as experiments
from sensorgen.measure.lab import recorder, rigs
from sensorgen.measure.lab.devices import (
    Clock,
    DeviceFault,
    Identity,
    ImpedanceMeter,
    Readings,
    RealClock,
    SimulatedClock,
)
from sensorgen.measure.lab.experiment import Choice, DonePress, Experiment, Next
from sensorgen.measure.lab.guardian import Guardian, Orders
from sensorgen.measure.lab.live import LiveText, LiveView, Sample
from sensorgen.measure.lab.run import Confirm, RunResult, design_of, planned, run
from sensorgen.measure.lab.safety import RunDevices
from sensorgen.measure.log import Log
from sensorgen.measure.virtual.mechanics import VirtualRig
from sensorgen.prediction.calibration.fitting import NOISE, Data, Posterior, by_rest, calibrated
from sensorgen.prediction.calibration.next_press import NextPress, PossiblePresses
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel, unknown

_POLL_S, _LONGEST_S = 0.005, 5.0  # between two questions; longer than any answer takes


class Background:
    """An :class:`ImpedanceMeter` that another one is read through, in a thread.

    Parameters
    ----------
    meter : ImpedanceMeter
        Whose ``read`` may wait, as for an answer by VISA.
    """

    def __init__(self, meter: ImpedanceMeter) -> None:
        self._meter, self._tones = meter, 0
        self._found: queue.SimpleQueue[Readings] = queue.SimpleQueue()
        self._fault: BaseException | None = None
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def identify(self) -> Identity:
        """Ask what it is."""
        return self._meter.identify()

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure, and to read [Hz], [V]."""
        self._meter.start(tones_hz, voltage_v)
        self._tones = len(tones_hz)
        self._thread = threading.Thread(target=self._work, name="impedance", daemon=True)
        self._thread.start()

    def read(self) -> Readings:
        """Readings since the last call; a failure of the meter is raised here."""
        if self._fault:
            raise self._fault
        parts = []
        while not self._found.empty():
            parts.append(self._found.get())
        return Readings.joined(parts, self._tones)

    def stop(self) -> None:
        """End the reading, then the measurement.

        Raises
        ------
        DeviceFault
            The meter still waits for an answer.
        """
        self._end.set()
        if self._thread:
            self._thread.join(_LONGEST_S)
            if self._thread.is_alive():
                raise DeviceFault(f"impedance meter: no answer for {_LONGEST_S:g} s; switch its output off by hand")
        self._meter.stop()

    def close(self) -> None:
        """Give the connection back."""
        self._meter.close()

    def _work(self) -> None:
        try:
            while not self._end.wait(_POLL_S):
                readings = self._meter.read()
                if len(readings.time_s) or readings.lost:
                    self._found.put(readings)
        except BaseException as error:  # for the run, which lifts the tip
            self._fault = error


_LEAST = 3e-4  # relative error of a mean at rest: from one place and time to the next it differs by more than noise
_SHORTEST_S = 0.1  # of a hold: its logarithm counts
_WIDTH = 2 * 1.959963984540054  # of a 95 % interval, in standard deviations
_OF = {"resistance": "resistance", "capacitance": "capacitance", "rise": "law"}  # parameter, and its spread


@dataclass(frozen=True, eq=False)
class ByModel:
    """The choice by a specimen's model; a :data:`sensorgen.measure.lab.experiment.NextPress`.

    Attributes
    ----------
    model : SpecimenModel
        Of the specimen, for the tones of the run.
    """

    model: SpecimenModel

    def __call__(self, part: Next, pressed: Sequence[DonePress], rest_ohm: Complex) -> Choice:
        """The best next press.

        Parameters
        ----------
        part : Next
            With the places that are possible.
        pressed : sequence of DonePress
            All so far.
        rest_ohm : (m,) array
            The latest mean at rest [ohm].

        Raises
        ------
        BadInput
            No reading at rest, or a part without places.
        """
        if not np.isfinite(rest_ohm).all() or part.position_mm is None:
            raise BadInput("the next press needs a reading at rest, and places that are possible")
        known = self._known(pressed, rest_ohm)
        low, high = part.position_mm
        within = PossiblePresses(part.force_n, (low * M_PER_MM, high * M_PER_MM), part.hold_s)
        noise = np.median([press.noise for press in pressed], axis=0) if pressed else np.full(len(rest_ohm), NOISE)
        best = NextPress(self.model, within, np.maximum(noise, _LEAST), part.aim).best(known)
        interval = self._interval(known) if pressed else inf
        place = round(best.position_m / M_PER_MM, 3)
        return Choice(round(best.force_n, 3), place, round(best.peak_n, 3), round(best.hold_s, 3), interval)

    def predicted(self, force_n: float, place_mm: float, rest_ohm: Complex) -> Complex:
        """Expected impedances under a press, by the design and what was read at rest before it (m,) [ohm]."""
        press = unknown(np.array([force_n]), np.array([place_mm * M_PER_MM]))
        return np.asarray(rest_ohm * np.exp(self.model.ratio(np.zeros(len(self.model.names)), press)[0]))

    def _known(self, pressed: Sequence[DonePress], rest_ohm: Complex) -> Posterior:
        if not pressed:
            return by_rest(self.model, np.log(rest_ohm), _LEAST, NOISE)
        steps = [press.step for press in pressed]
        force, peak = (np.array([getattr(step, name) for step in steps]) for name in ("force_n", "peak_n"))
        place, hold = (np.array([getattr(step, name) for step in steps]) for name in ("place_mm", "hold_s"))
        presses = Presses(
            force, place * M_PER_MM, 1 - force / np.maximum(peak, force), np.log10(np.maximum(hold, _SHORTEST_S))
        )
        rest = np.log([press.before_ohm for press in pressed])
        ratio = np.log([press.pressed_ohm for press in pressed]) - rest
        noise: Real = np.maximum([press.noise for press in pressed], _LEAST)
        return calibrated(self.model, Data(presses, ratio, noise, rest.mean(axis=0), np.full(rest.shape[1], _LEAST)))

    def _interval(self, known: Posterior) -> float:
        """Widest 95 % interval of resistance, capacitance and the rise under load, relative [-]."""
        sd = np.sqrt(np.diag(known.covariance))
        widths = (
            _WIDTH * float(sd[self.model.names.index(name)]) * getattr(self.model.spread, spread)
            for name, spread in _OF.items()
        )
        return float(max(widths))


@dataclass(frozen=True)
class SessionTask:
    """Task of a session.

    Attributes
    ----------
    experiment : Experiment
        All of it.
    simulated : bool
        Whether on a virtual rig.
    folder : Path or None
        Of the run that goes on; None for a new one.
    """

    experiment: Experiment
    simulated: bool
    folder: Path | None = None


def new(path: Path, *, simulate: bool) -> SessionTask:
    """A new run of an experiment's file.

    Raises
    ------
    BadInput
        The file is wrong, or has no devices although real ones are meant.
    """
    experiment = experiments.read(path)
    if not simulate and experiment.devices is None:
        raise BadInput(f"{path}: devices is missing; expected actuator, stage and impedance, or --simulate")
    return SessionTask(experiment, simulate)


def again(log: Log, name: str) -> SessionTask:
    """A run that ended early, by its folder or the folder's name.

    Raises
    ------
    BadInput
        No such run, or all of it is done.
    """
    folder = Path(name) if Path(name).is_dir() else recorder.home(log.path) / name
    if not folder.is_dir():
        runs = sorted(each.name for each in recorder.home(log.path).glob("*/"))
        raise BadInput(f"--resume {name!r:.80}: no such run; expected one of {', '.join(runs[-5:]) or 'none yet'}")
    before = recorder.RunFolder.read(folder)
    begun = next(before.of("begun"), None)
    if begun is None:
        raise BadInput(f"--resume {name!r:.80}: it never began; run its experiment again")
    if before.finished:
        raise BadInput(f"--resume {name!r:.80}: all of it is done; expected a run that ended early")
    return SessionTask(experiments.from_json(begun["experiment"]), bool(begun["simulated"]), folder)


class Views:
    """Several views as one; one that fails is left out, and the run goes on."""

    def __init__(self, views: list[LiveView | LiveText]) -> None:
        self._views = views

    def update(self, sample: Sample) -> None:
        """Show a sample."""
        for view in tuple(self._views):
            try:
                view.update(sample)
            except Exception:  # a picture of the run is no reason to end it
                self._views.remove(view)

    def commands(self) -> list[str]:
        """Commands of the page since the last call."""
        return [command for view in self._views if isinstance(view, LiveView) for command in view.commands()]


class Session(AbstractContextManager["Session", None]):
    """Devices, clock, view and guardian of one run; use it in a ``with`` statement.

    Parameters
    ----------
    asked : SessionTask
        What is to be done.
    log : Log
        An open log.
    real_time : bool
        Whether a simulated run takes its time.
    page, text : bool
        Whether to show the run as a page, and in the terminal.
    model : callable, optional
        Makes the specimen's model by its design and the experiment: for parts ``next``, and for the page's prediction.

    Attributes
    ----------
    url : str
        Address of the page; "" without one.
    mechanism : RunDevices or None
        Of a simulated run: what was really done to the specimen.

    Raises
    ------
    SensorgenError
        An experiment that cannot be run, or devices that are not there.
    """

    def __init__(
        self, asked: SessionTask, log: Log, *, real_time: bool = False, page: bool = False, text: bool = True,
        model: Callable[[Design, Experiment], SpecimenModel] | None = None,
    ) -> None:  # fmt: skip
        self._asked, self._log, self._stack = asked, log, ExitStack()
        experiment = asked.experiment
        plan = planned(experiment, log)  # refuses what is wrong before a line is opened
        self._clock: Clock = RealClock()
        if asked.simulated and not real_time:
            self._clock = SimulatedClock(epoch_s=self._clock.epoch())
        needed = page or any(part.kind == "next" for part in experiment.plan)
        self._model = ByModel(model(_design(experiment, log), experiment)) if needed and model else None
        self.mechanism: VirtualRig | None = None
        self.url, views = "", list[LiveView | LiveText]()
        if page:
            view = self._stack.enter_context(LiveView(plan.summary(), experiment.readout.tones_hz))
            self.url = view.url
            views.append(view)
        if text:
            views.append(LiveText(experiment.readout.tones_hz))
            self._stack.callback(views[-1].close)
        self._views = Views(views)
        try:
            self._rig = self._devices(experiment)
        except BaseException:
            self._stack.close()
            raise

    def _devices(self, experiment: Experiment) -> RunDevices:
        if self._asked.simulated:
            rig, self.mechanism = rigs.simulated(experiment, _design(experiment, self._log), self._clock)
            return rig
        if experiment.devices is None:
            raise BadInput("devices is missing; expected actuator, stage and impedance")
        rig = rigs.real(experiment.devices, self._clock)
        rig.impedance = Background(rig.impedance)
        return rig

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def run(self, confirm: Confirm = lambda *_: True, *, watchdog: bool = True) -> RunResult:
        """Do it; see :func:`sensorgen.measure.lab.run.run`."""
        experiment, asked = self._asked.experiment, self._asked
        folder = asked.folder or recorder.new_folder(self._log.path)
        guardian = None
        if not asked.simulated and experiment.devices:
            devices = {"actuator": experiment.devices.actuator, "stage": experiment.devices.stage}
            guardian = self._stack.enter_context(
                Guardian(Orders(devices=devices, dead_man_s=experiment.limits.dead_man_s, folder=str(folder)))
            )
        return run(
            experiment, clock=self._clock, log=self._log, rig=self._rig, simulated=asked.simulated, view=self._views,
            guardian=guardian, next_press=self._model, resume=folder, confirm=confirm,
            watchdog=watchdog, predicted=self._model.predicted if self._model else None,
        )  # fmt: skip


def _design(experiment: Experiment, log: Log) -> Design:
    design = design_of(experiment, log)
    if design is None:
        raise BadInput(f"no design is known of {experiment.specimen!r:.80}; give virtual.design, or bind it to one: "
                       "sensorgen log specimen NAME --design FILE")  # fmt: skip
    return design
