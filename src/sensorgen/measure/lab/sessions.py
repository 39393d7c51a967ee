"""One session at the rig, real or simulated: what is asked, its devices, clock, view and guardian."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

from sensorgen.core.errors import BadInput
from sensorgen.design.design import Design
from sensorgen.measure.lab import experiment as experiments
from sensorgen.measure.lab import recorder, rigs
from sensorgen.measure.lab.background import Background
from sensorgen.measure.lab.clock import Clock, RealClock, SimulatedClock
from sensorgen.measure.lab.experiment import Experiment
from sensorgen.measure.lab.guardian import Guardian, Orders
from sensorgen.measure.lab.live import LiveText, LiveView, Sample
from sensorgen.measure.lab.next_best import ByModel
from sensorgen.measure.lab.run import Confirm, RunResult, design_of, planned, run
from sensorgen.measure.lab.safety import RunDevices

if TYPE_CHECKING:
    from sensorgen.measure.log import Log
    from sensorgen.measure.virtual.mechanics import VirtualRig as Mechanism
    from sensorgen.prediction.calibration.specimen import SpecimenModel


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
    found = experiments.read(path)
    if not simulate and found.devices is None:
        raise BadInput(f"{path}: devices is missing; expected actuator, stage and impedance, or --simulate")
    return SessionTask(found, simulate)


def again(log: "Log", name: str) -> SessionTask:
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

    def __init__(self, views: "list[LiveView | LiveText]") -> None:
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


class Session:
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
        self, asked: SessionTask, log: "Log", *, real_time: bool = False, page: bool = False, text: bool = True,
        model: "Callable[[Design, Experiment], SpecimenModel] | None" = None,
    ) -> None:  # fmt: skip
        self._asked, self._log, self._stack = asked, log, ExitStack()
        experiment = asked.experiment
        plan = planned(experiment, log)  # refuses what is wrong before a line is opened
        self._clock: Clock = SimulatedClock() if asked.simulated and not real_time else RealClock()
        if isinstance(self._clock, SimulatedClock):
            self._clock = replace(self._clock, epoch_s=RealClock().epoch())
        needed = page or any(part.kind == "next" for part in experiment.plan)
        self._model = ByModel(model(_design(experiment, log), experiment)) if needed and model else None
        self.mechanism: Mechanism | None = None
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

    def __enter__(self) -> Self:
        return self

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


def _design(experiment: Experiment, log: "Log") -> Design:
    found = design_of(experiment, log)
    if found is None:
        raise BadInput(f"no design is known of {experiment.specimen!r:.80}; give virtual.design, or bind it to one: "
                       "sensorgen log specimen NAME --design FILE")  # fmt: skip
    return found
