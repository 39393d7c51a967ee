"""``sensorgen bench run``: press a specimen and record it into the log, or try that on a virtual one."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import FOUND_ERRORS, log_words, render
from sensorgen.cli.log_words import made
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.lab.devices import Identity
    from sensorgen.measure.lab.experiment import Experiment
    from sensorgen.measure.lab.run import Planned
    from sensorgen.prediction.calibration.specimen import SpecimenModel


def _run(
    experiment: str | None, again: str | None, file: str | None, *, simulate: bool, real_time: bool, page: bool | None,
    yes: bool, watchdog: bool,
) -> int:  # fmt: skip
    """Run an experiment: check, zero and find the contact gently, press, and record into the log.

    The tip goes up whatever happens: at the end, at an error of any device, at Ctrl-C, and when this process dies.
    Keys while it runs: p pause, r resume, q end. --simulate runs the same experiment on a virtual rig, as fast as it
    goes, and the log says so. 'sensorgen new experiment NAME' writes a file to begin with.

    Exit code 1: a rule, a fault or somebody ended the run early; the reason is printed, what was recorded is in the
    log, and --resume goes on.
    """
    from sensorgen.measure.lab import sessions

    if (experiment is None) == (again is None):
        raise BadInput(f"{'neither' if again is None else 'both'} of an experiment and --resume; expected one of them")
    if real_time and not simulate:
        raise BadInput("--real-time without --simulate; real devices know no other time")
    with ExitStack() as stack:
        log = stack.enter_context(log_words.opened(file, create=simulate))
        asked = sessions.again(log, again) if again else sessions.new(Path(experiment or ""), simulate=simulate)
        if asked.simulated:
            render.say("solving the virtual specimen, once for each design", err=True)
        shown = (page if page is not None else not asked.simulated or real_time) and not render.form()
        session = stack.enter_context(sessions.Session(asked, log, real_time=real_time, page=shown, model=_model))
        if session.url:
            render.say(f"live page: {session.url}", err=True)
        found = session.run(lambda plan, who: _confirmed(plan, who, yes=yes or asked.simulated), watchdog=watchdog)
    render.deliver(found)
    return 0 if found.end == "done" else FOUND_ERRORS


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


def _confirmed(plan: "Planned", identities: "Mapping[str, Identity]", *, yes: bool) -> bool:
    """Print who is there and what is planned; whether the rig may move."""
    for role, who in identities.items():
        render.say(f"{role}: {who.model} {who.serial} {who.firmware}", err=True)
    render.say(plan.summary(), err=True)
    try:
        return yes or click.confirm("The rig moves now. Is it free, and the specimen in place?", err=True)
    except click.Abort:  # no terminal to ask
        return False


command = made(
    _run, "run", "Press a specimen by an experiment file, or a virtual one.",
    click.Argument(["experiment"], metavar="EXPERIMENT.yaml", required=False),
    click.Option(["--simulate"], is_flag=True, help="A virtual specimen on a virtual rig, by its own clock."),
    click.Option(["--real-time"], is_flag=True, help="With --simulate: by the real clock, to watch."),
    click.Option(["--resume", "again"], metavar="RUN", help="Go on with a run that ended early."),
    click.Option(["--page/--no-page"], default=None, help="Show the run in the browser; with real devices by default."),
    click.Option(["--watchdog/--no-watchdog"], default=True,
                 help="Load a program that lifts the tip into the actuator's controller; required above 1 N."),
    click.Option(["--yes"], is_flag=True, help="Do not ask before the rig moves."),
    log_words.where(),
    *render.options("json", file=False),
)  # fmt: skip
