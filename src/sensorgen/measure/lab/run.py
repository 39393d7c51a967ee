"""Run an experiment: prepare the rig, press, record into the log, and leave the tip up whatever happens."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, within
from sensorgen.core.version import __version__
from sensorgen.design.design import Design, load, make
from sensorgen.measure.lab import experiment as experiments
from sensorgen.measure.lab import press, recorder, safety
from sensorgen.measure.lab.devices import Clock, Identity, SelfLifting, SimulatedClock
from sensorgen.measure.lab.experiment import Choice, DonePress, Experiment, Next, NextPress, PlannedPress
from sensorgen.measure.lab.guardian import Guardian
from sensorgen.measure.lab.live import Controls
from sensorgen.measure.lab.press import Loop, Paused, Predicted, RunView
from sensorgen.measure.lab.recorder import Recorder, RunFolder
from sensorgen.measure.lab.safety import Ended, RunDevices, Watch
from sensorgen.measure.log import BenchRun, Log, notes

Confirm = Callable[["PlannedRun", dict[str, Identity]], bool]
"""Whether the rig may move, by what is planned and what each device said that it is."""
WATCHDOG_S = 1.5  # without a reading, until the actuator's controller lifts
UNWATCHED_N = 1.0  # highest limits.force_n without that: the weight of the piston alone is 0.9 N
_PLANNED = ("place_mm", "force_n", "peak_n", "hold_s")  # of a press that was done, in the journal
_MEASURED = ("before_ohm", "pressed_ohm", "noise")
USUAL_MM = 100.0  # length of a specimen whose design is unknown


@dataclass(frozen=True)
class RunResult:
    """Outcome of a run.

    Attributes
    ----------
    specimen : str
        Its name in the log.
    folder : str
        Of the run, beside the log; ``--resume`` takes it.
    end : str
        "done", "rule", "abort" or "fault".
    reason : str
        Why it ended.
    done, steps : int
        Presses that are done, of all attempts, and those of the plan.
    simulated : bool
        Whether no real device was there.
    tip_up : bool
        Whether actuator or stage said at the end that the tip is up.
    rows : tuple of BenchRun
        New recordings in the log.
    problems : tuple of str
        What failed beside, as while the rig was made safe.
    identities : dict of str to Identity
        What each device said that it is.
    counts : dict of str to int
        Impedances that were read, lost, clipped and invalid, and late periods.
    """

    specimen: str
    folder: str
    end: str
    reason: str
    done: int
    steps: int
    simulated: bool
    tip_up: bool
    rows: tuple[BenchRun, ...] = ()
    problems: tuple[str, ...] = ()
    identities: dict[str, Identity] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)

    def document(self) -> Iterator[Part]:
        """Outcome, recordings and problems."""
        yield f"{self.specimen}: {self.done} of {self.steps} presses{', simulated' if self.simulated else ''}"
        facts = [("end", f"{self.end}: {self.reason}"), ("tip", "up" if self.tip_up else "NOT KNOWN TO BE UP")]
        facts += [("device", f"{role}: {who.words()}") for role, who in self.identities.items()]
        facts += [("readings", ", ".join(f"{count} {name}" for name, count in self.counts.items()))]
        facts += [("log", f"recording {row.number}") for row in self.rows] or [("log", "no new recording")]
        facts += [("problem", problem) for problem in self.problems]
        yield Facts((*facts, ("run", self.folder)))
        if self.done < self.steps:
            yield f"go on: sensorgen bench run --resume {Path(self.folder).name}"


@dataclass(frozen=True)
class PlannedRun:
    """A checked experiment with its presses.

    Attributes
    ----------
    experiment : Experiment
        What was asked.
    length_mm : float
        Of the specimen [mm].
    steps : tuple of PlannedPress
        All presses.
    seconds : float
        How long they take, about [s].
    """

    experiment: Experiment
    length_mm: float
    steps: tuple[PlannedPress, ...]
    seconds: float

    def summary(self) -> str:
        """One line."""
        kinds = Counter(step.kind for step in self.steps)
        presses = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        hours, minutes = divmod(ceil(self.seconds / 60), 60)
        limits = self.experiment.limits
        return (
            f"{self.experiment.specimen}, {self.length_mm:g} mm: presses {presses}; about {hours} h {minutes} min; tip "
            f"{self.experiment.pressing.length_mm:g} mm; limits {limits.force_n:g} N, {limits.deepest_mm:g} mm deep"
        )


def planned(experiment: Experiment, log: Log | None = None) -> PlannedRun:
    """Check an experiment against its specimen, and make its presses; nothing moves.

    Raises
    ------
    SensorgenError
        What :func:`sensorgen.measure.lab.experiment.check` refuses; a plan that takes too long; a specimen whose name
        the log does not take.
    """
    with within("specimen"):
        notes.named(experiment.specimen, log)
    design = None if experiment.length_mm else design_of(experiment, log)
    length = experiment.length_mm or (float(design.params.length_mm) if design else USUAL_MM)
    experiments.check(experiment, length)
    steps = experiments.steps(experiment, length)
    holds = [part.content.hold_s[1] for part in experiment.plan if isinstance(part.content, Next)]
    seconds, hours = experiments.seconds(steps, max(holds, default=0.0)), experiment.limits.hours
    if seconds > hours * 3600:
        raise OutOfRange(
            f"plan: takes about {seconds / 3600:.3g} h, limits.hours is {hours:g}; expected fewer presses, shorter "
            "holds, or a larger limit"
        )
    return PlannedRun(experiment, length, tuple(steps), seconds)


def design_of(experiment: Experiment, log: Log | None) -> Design | None:
    """Design of the specimen: the virtual one's own, else that in the log, else the one that its name stands for."""
    from sensorgen.measure.log import prints

    if experiment.virtual and experiment.virtual.design:
        named = experiment.virtual.design
        with within("virtual.design"):
            return load(Path(named)) if Path(named).suffix else make({"shape": named})
    logged = prints.designs(log).get(notes.named(experiment.specimen, log).design_id) if log else None
    try:
        return logged or notes.design_of(experiment.specimen)
    except BadInput:
        return None


def run(
    experiment: Experiment, *, clock: Clock, log: Log, rig: RunDevices, simulated: bool, view: RunView | None = None,
    guardian: Guardian | None = None, next_press: NextPress | None = None, predicted: Predicted | None = None,
    resume: Path | None = None, confirm: Confirm = lambda *_: True, watchdog: bool = True,
) -> RunResult:  # fmt: skip
    """Run an experiment.

    Parameters
    ----------
    experiment : Experiment
        What to do.
    clock : Clock
        Real, or simulated, with simulated devices alone.
    log : Log
        An open log, which gets the recording.
    rig : RunDevices
        The devices; they are closed at the end.
    simulated : bool
        Whether the devices are; the log says so.
    view, guardian, predicted
        As of :class:`sensorgen.measure.lab.press.Loop`.
    next_press : callable, optional
        Chooses the presses of ``next`` parts.
    resume : Path, optional
        Folder of a run of this experiment that ended early: the steps not done are done.
    confirm : callable
        Asked when all devices are identified, and before any moves, whether they may.
    watchdog : bool
        Whether the actuator's own controller has to watch the run, where forces are above ``UNWATCHED_N``.

    Raises
    ------
    SensorgenError
        Wrong input, before anything is sent to a device but the question what it is. All that happens later is in the
        result.
    """
    plan = planned(experiment, log)
    if next_press is None and any(part.kind == "next" for part in experiment.plan):
        raise BadInput("plan: a part 'next' needs a model of the specimen; expected other parts here")
    if watchdog:
        _check_watchdog(experiment, rig)
    recorder.recover(log, clock)
    folder = resume or recorder.new_folder(log.path)
    with recorder.alone(folder) as ours:
        if not ours:
            raise BadInput(f"{str(folder)!r} is a run that goes on in another process; expected one that has ended")
        attempt = _Attempt(plan, clock, log, rig, folder, simulated, next_press, confirm, watchdog)
        controls = Controls(view.commands) if view else Controls()
        return attempt.result(view, controls, guardian, predicted)


def _check_watchdog(experiment: Experiment, rig: RunDevices) -> None:
    """Refuse forces that would stay on the specimen if run and guardian ended together."""
    if not isinstance(rig.actuator, SelfLifting) and experiment.limits.force_n > UNWATCHED_N:
        raise BadInput(
            f"limits.force_n: {experiment.limits.force_n:g} N, and this actuator has no watchdog: if run and guardian "
            f"end together, the tip stays down; expected up to {UNWATCHED_N:g} N, or --no-watchdog"
        )


class _Attempt:
    """One attempt at a run: the first, or one that resumes it."""

    def __init__(
        self, plan: PlannedRun, clock: Clock, log: Log, rig: RunDevices, folder: Path, simulated: bool,
        next_press: NextPress | None, confirm: Confirm, watchdog: bool,
    ) -> None:  # fmt: skip
        self.plan, self.clock, self.log, self.rig, self.folder = plan, clock, log, rig, folder
        self.simulated, self.next_press, self.confirm, self.watchdog = simulated, next_press, confirm, watchdog
        before = RunFolder.read(folder) if (folder / recorder.JOURNAL).exists() else RunFolder(folder, ())
        self.number, self.done = before.attempts + 1, before.done
        self.pressed = _pressed(before, plan.steps)
        self.identities: dict[str, Identity] = {}

    def result(
        self, view: RunView | None, controls: Controls, guardian: Guardian | None, predicted: Predicted | None
    ) -> RunResult:
        """Do it."""
        experiment = self.plan.experiment
        tones = np.array(experiment.readout.tones_hz)
        stem = f"{'simulated' if self.simulated else 'run'}-{self.folder.name}-{self.number}"
        recorder.trim(self.folder / recorder.JOURNAL)
        recording = Recorder(self.folder, stem, tones, self.clock)
        self._begin(recording, stem)
        loop = Loop(
            self.rig, self.clock, recording, experiment, controls, Watch(tones), view, guardian, predicted,
            steps=len(self.plan.steps),
        )  # fmt: skip
        fault: BaseException | None = None
        with ExitStack() as listening:  # signals are held back until the tip is up
            try:
                end, reason = self._worked(loop, listening)
            except Ended as error:
                end, reason = error.end, str(error)
            except SensorgenError as error:
                end, reason = "fault", str(error)
            except BaseException as error:  # whatever it is, the tip goes up first
                end, reason, fault = "fault", f"{type(error).__name__}: {error}", error
            up, problems = safety.made_safe(self.rig, self.clock, loop.beat)
            if up and guardian:
                guardian.disarm()
            problems += safety.close(self.rig)
            if end == "done" and problems:
                end, reason = "fault", f"{reason}, but at the end {problems[0]}"
        outcome = self._ended(loop, end, reason, up, problems)
        if fault:
            raise fault
        return outcome

    def _begin(self, recording: Recorder, stem: str) -> None:
        experiment = self.plan.experiment
        words = ["simulated"] if self.simulated else []
        words += [f"run {self.folder.name}, attempt {self.number}", *filter(None, [experiment.remark])]
        recording.journal.note(
            "begun", attempt=self.number, stem=stem, specimen=experiment.specimen, simulated=self.simulated,
            remark="; ".join(words), version=__version__, numpy=np.__version__,
            experiment=experiment.model_dump(mode="json", exclude_unset=True), length_mm=self.plan.length_mm,
            steps=len(self.plan.steps),
        )  # fmt: skip

    def _worked(self, loop: Loop, listening: ExitStack) -> tuple[str, str]:
        """All of the run, but for its end."""
        self.identities = press.identified(self.rig)
        loop.recorder.journal.note("identified", **{role: asdict(who) for role, who in self.identities.items()})
        if not self.confirm(self.plan, self.identities):
            raise Ended("abort", "not confirmed; nothing has moved")
        listening.enter_context(loop.controls.listening())
        if self.watchdog and isinstance(self.rig.actuator, SelfLifting):
            with within("watchdog (without: --no-watchdog)"):
                self.rig.actuator.watch(min(WATCHDOG_S, self.plan.experiment.limits.dead_man_s))
        if loop.guardian:
            loop.guardian.arm()
        loop.begin()
        return self._presses(loop)

    def _presses(self, loop: Loop) -> tuple[str, str]:
        """Prepare the rig, then all presses that are not done."""
        experiment = self.plan.experiment
        low, high = self._places_mm
        middle = experiment.approach.place_mm
        press.prepared(loop, (low + high) / 2 if middle is None else middle)
        for step in self.plan.steps:
            loop.step = step.number
            if step.number not in self.done and not self._step(loop, step):
                return "done", "stop.interval: the widest interval is below it"
            most = experiment.stop.presses
            if most and loop.presses >= most and self.done < {each.number for each in self.plan.steps}:
                raise Ended("rule", f"stop.presses: {most} presses are done")
        loop.message = "last rest"
        loop.wait(experiments.AVERAGED_S)
        return "done", "all presses are done"

    @property
    def _places_mm(self) -> tuple[float, float]:
        return self.plan.experiment.places_mm(self.plan.length_mm)

    def _step(self, loop: Loop, step: PlannedPress) -> bool:
        """One press, again after a pause; False where no further one is worth it."""
        while True:
            loop.pausable = True
            try:
                chosen = self._chosen(loop, step)
                if chosen is None:
                    return False
                loop.message = f"to {chosen.place_mm:g} mm"
                loop.recorder.journal.note("step", step=step.number, place_mm=chosen.place_mm, force_n=chosen.force_n)
                press.travel(loop, chosen.place_mm)
                pressed = press.press(loop, chosen)
            except Paused:
                loop.pausable = False
                press.pause(loop)
                continue
            finally:
                loop.pausable = False
            self.done.add(step.number)
            loop.recorder.journal.note("done", step=step.number, **_kept(pressed))
            if all(np.isfinite(getattr(pressed, name)).all() for name in _MEASURED):
                self.pressed.append(pressed)
            return True

    def _chosen(self, loop: Loop, step: PlannedPress) -> PlannedPress | None:
        """The step with force and place; None where the rule of the interval says that it is enough."""
        part = self.plan.experiment.plan[step.part].content
        if step.course or not isinstance(part, Next) or self.next_press is None:
            return step
        loop.message = f"choosing press {step.number}"
        part = part.model_copy(update={"position_mm": part.position_mm or self._places_mm})
        choose, so_far, rest = self.next_press, tuple(self.pressed), loop.watch.mean()
        choice = _beside(loop, lambda: choose(part, so_far, rest))
        interval = self.plan.experiment.stop.interval
        if interval and choice.interval <= interval:
            return None
        next_one = choice.press(self.plan.experiment.approach, step.rest_s)
        next_one = replace(next_one, number=step.number, part=step.part, kind=step.kind)
        experiments.check_press(
            self.plan.experiment, max(next_one.force_n, next_one.peak_n), next_one.place_mm, self.plan.length_mm
        )  # fmt: skip
        return next_one

    def _ended(self, loop: Loop, end: str, reason: str, up: bool, problems: tuple[str, ...]) -> RunResult:
        """Close the files, log them, and tell."""
        watch, recording = loop.watch, loop.recorder
        counts = {"read": watch.count, "lost": watch.lost, "clipped": watch.clipped, "invalid": watch.invalid,
                  "late periods": loop.late}  # fmt: skip
        failed = list(problems)
        try:
            recording.state(0.0, loop.known_place_mm, float("nan"), reason if end == "fault" else "")
            recording.journal.note("ended", attempt=self.number, end=end, reason=reason, tip_up=up, problems=problems,
                              counts=counts)  # fmt: skip
        except SensorgenError as error:
            failed.append(str(error))
        unkept = recording.close()
        rows: list[BenchRun] = []
        try:
            rows = recorder.log_attempts(self.log, self.folder, self.clock)
        except SensorgenError as error:
            unkept.append(f"not logged yet: {error}")
        if end == "done" and unkept:
            end, reason = "fault", f"{reason}, but {unkept[0]}"
        failed += unkept
        failed += [each["problem"] for each in RunFolder.read(self.folder).of("logged") if each["problem"]]
        return RunResult(
            self.plan.experiment.specimen, str(self.folder), end, reason, len(self.done), len(self.plan.steps),
            self.simulated, up, tuple(rows), tuple(failed), self.identities, counts,
        )  # fmt: skip


def _beside(loop: Loop, choose: Callable[[], Choice]) -> Choice:
    """Choose while the loop goes on, tip up; with a simulated clock at once."""
    if isinstance(loop.clock, SimulatedClock):
        return choose()
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(choose)
        while not future.done():
            loop.period()
        return future.result()


def _kept(pressed: DonePress) -> dict[str, Any]:
    """Part of a press that the journal keeps; null for numbers of which some are nan, which JSON has not."""
    values = {name: getattr(pressed, name).view(float) for name in _MEASURED}
    known = {name: each.tolist() if np.isfinite(each).all() else None for name, each in values.items()}
    return {name: getattr(pressed.step, name) for name in _PLANNED} | known


def _pressed(before: RunFolder, steps: Sequence[PlannedPress]) -> list[DonePress]:
    """Presses of earlier attempts, for the choice of further ones."""
    by_number = {step.number: step for step in steps}
    presses = []
    for event in before.of("done"):
        step = by_number.get(event["step"])
        if step and all(event[name] for name in _MEASURED):
            values = {name: event[name] for name in _PLANNED}
            at_rest, after = (np.array(event[name]).view(complex) for name in ("before_ohm", "pressed_ohm"))
            presses.append(DonePress(replace(step, **values), at_rest, after, np.array(event["noise"])))
    return presses
