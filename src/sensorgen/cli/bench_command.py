"""``sensorgen bench``: what a rig is to do, and what it did."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from sensorgen.cli import FOUND_ERRORS, bench_array, bench_recordings, render
from sensorgen.cli.bench_recordings import bench as command
from sensorgen.cli.commands import command as of_function
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import LogFile
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.lab.devices import Identity
    from sensorgen.measure.lab.experiment import Experiment
    from sensorgen.measure.lab.run import PlannedRun
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
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.query import Query, Tip

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


__all__ = ["bench_array", "bench_recordings", "command"]
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
    from sensorgen.measure.signal.schedule import RunPlan, schedule

    if len(force_n) != 2:
        raise BadInput(f"--force: {len(force_n)} values; expected the least and the largest, as in 0,6N")
    if seed < 0:
        raise OutOfRange(f"--seed {seed}; expected a whole number from 0 on")
    length = design.params.length_mm
    if tip_mm > length:
        raise OutOfRange(f"--tip {tip_mm:g} mm is longer than the sensor, {length:g} mm; expected a shorter one")
    where = (tip_mm / 2, length - tip_mm / 2)
    plan = schedule(RunPlan(seed, presses, (force_n[0], force_n[1]), where, dwell_s, rest_s, repeats), design.name)
    if picture:
        from sensorgen.analysis.plots import recordings, static

        files.replace(picture, static.png(recordings.schedule(list(plan.steps), plan.seconds)))
    table = "".join(render.pieces(plan, "csv"))
    if output:
        files.replace(output, table.encode())
    if render.form():
        render.deliver(plan)
    else:
        render.say(f"{output}: {list(plan.document())[-1]}" if output else table, nl=bool(output))
