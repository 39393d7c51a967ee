"""``sensorgen predict``: what the bench should measure."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import FOUND_ERRORS, asprinted_text, budget_text, card_text, plan_text, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length, OneOf, Ratio, Share, Values, proper
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.prediction.plan import plain

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.prediction.ladder import Makers, Outline
    from sensorgen.prediction.plan import Plan
    from sensorgen.prediction.sensor_of_design import Sensed

_WORK = ("cell, compression and line",)
Axes = tuple[Sequence[float], Sequence[float], Sequence[float]]

OWN: list[click.Parameter] = [
    click.Option(
        ["--force", "force_n"], type=Values(units.FORCE_N, zero=True),
        help="Forces as START:STOP:STEP, one, or a list [N]; 0:6:0.1 where only positions are given.",
    ),
    click.Option(
        ["--position", "position_mm"], type=Values(units.LENGTH_MM, zero=True),
        help="Positions of the tip's middle [mm]; the whole sensor in 100 steps where only forces are given.",
    ),
    click.Option(
        ["--frequencies", "frequency_hz"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Tones, as in 1.1kHz,2.3kHz; the thesis's seven if not given.",
    ),
    click.Option(["--tip", "tip_mm"], type=Length(), default=None, help="Length of the tip.  [default: 10 mm]"),
    click.Option(
        ["--tip-radius", "radius_mm"], type=Length(), default=None,
        help="Radius of a hard round tip across the sensor, with --profile hertz or parabola: its contact grows with "
        "the force up to the tip's length. All of the tip touches if not given.",
    ),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded", "solved")),
        help="How the film gives way: a plate free or bonded, a cell solved (needs NGSolve, takes some seconds); the "
        "best that is known of it if not given.",
    ),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", show_default=True,
        help="Standard error of R and of X of a reading, relative to |Z|, for the identifiability card.",
    ),
    click.Option(
        ["--profile"], type=OneOf(("uniform", "hertz", "parabola")), default="uniform", show_default=True,
        help="Pressure under the tip: of a flat one, of a round one on a thick body, of a round one on a thin film.",
    ),
    click.Option(
        ["--accuracy"], type=Ratio(), default=None,
        help="Wanted of |Z|: cell, compression and line by the cheapest models that together come as near. Exit code 1 "
        "where they do not; if not given, 1e-2 is tried.",
    ),
    click.Option(["--explain"], is_flag=True, help="Print the plan, and what came of it."),
    *asprinted_text.printed_options(
        "Hold what is printed against what is drawn; with presses, predict them of what is printed, its cell solved."
    ),
    click.Option(["--json", "as_json"], is_flag=True, help="Print as JSON."),
    click.Option(["--csv", "as_csv"], is_flag=True, help="Print R and X as CSV, a row per force and position."),
    click.Option(["--plot"], metavar="DIR", help="Draw R, X, sensitivities and inverse maps there, as PNG and HTML."),
    click.Option(["--output", "-o"], metavar="FILE", help="File to write instead of the terminal."),
]  # fmt: skip


def _work(
    design: "Design",
    *,
    frequency_hz: Sequence[float] | None,
    force_n: Sequence[float] | None,
    position_mm: Sequence[float] | None,
    tip_mm: float | None,
    radius_mm: float | None,
    compression: str | None,
    profile: str,
    accuracy: float | None,
    noise: float,
    **how: Any,
) -> int:
    asprinted_text.refuse_strays(as_printed=how["as_printed"], slicer=how["slicer"], walls=how["walls"])
    _refuse_two(how)
    how["planned"] = bool(accuracy or how["explain"])  # what nobody asked for is not told
    proper("--noise", noise)
    pressed = bool(force_n or position_mm or how["as_csv"] or how["plot"])
    tip: dict[str, Any] = {
        "profile": profile,
        "radius_m": None if radius_mm is None else radius_mm * units.M_PER_MM,
        **({} if tip_mm is None else {"tip_m": tip_mm * units.M_PER_MM}),
    }
    if how["as_printed"] and not pressed:
        _refuse_strangers((frequency_hz, tip_mm, radius_mm, compression), explain=how["explain"])
        return _as_printed(design, accuracy, how)
    from sensorgen.prediction import ladder as planned
    from sensorgen.prediction.prediction import FORCES_N, TONES_HZ, middle, positions_mm, prediction

    tones, wanted, law = frequency_hz or TONES_HZ, accuracy or planned.ACCURACY, compression or ""
    if not pressed:
        if how["explain"]:
            _explain(planned.outlined(design, planned.drawn(design, **tip), middle(design, tones), wanted, law))
        with _working():
            predicted = prediction(design, tones, law, accuracy=wanted, noise=noise, **tip)
        predicted = predicted if how["planned"] else {key: predicted[key] for key in predicted if key != "plan"}
        if compression or tip_mm is not None or radius_mm is not None:
            _refuse_unjudged(predicted)
        _deliver(_unpressed(predicted, how), how["output"])
        return _verdict(predicted, accuracy)
    axes = tones, force_n or FORCES_N, position_mm or positions_mm(design)
    made = _made(design, (wanted, law, tip), axes, how)
    return _verdict(_pressed(design, made, axes, (wanted, noise), how), accuracy)


def _made(
    design: "Design", asked: tuple[float, str, dict[str, Any]], axes: Axes, how: dict[str, Any]
) -> "tuple[Sensed, Plan | None]":
    """The sensor as drawn, or as printed; and how it was planned."""
    from sensorgen.prediction import ladder as planned

    accuracy, law, tip = asked
    if not how["as_printed"]:
        return _carried_out(design, planned.drawn(design, **tip), axes, (accuracy, law), how)
    from sensorgen.asprinted import pressed

    printed = asprinted_text.printed(design, how["slicer"], how["walls"])
    makers = planned.Makers(
        partial(pressed.unloaded, design, printed),
        lambda law, known: pressed.sensor_of(design, printed, law, known=known, **tip),
        pressed.piece(design, printed),
    )
    return _carried_out(design, makers, axes, (accuracy, law), how)


def _carried_out(
    design: "Design", makers: "Makers", axes: Axes, asked: tuple[float, str], how: dict[str, Any]
) -> "tuple[Sensed, Plan | None]":
    from sensorgen.prediction import ladder as planned
    from sensorgen.prediction.prediction import check_presses, hardest

    outline = partial(planned.outlined, design, makers, hardest(*axes), *asked)
    _, force_n, position_mm = axes
    check_presses(makers.rough(asked[1]).sensor, force_n, [x * units.M_PER_MM for x in position_mm])
    if how["explain"]:
        _explain(outline())
    with _working():
        return planned.carried_out(outline())


@contextmanager
def _working() -> Iterator[None]:
    """Say that something is being worked out, which may take seconds."""
    with show.progress(_WORK) as step:
        step(_WORK[0])
        yield


def _explain(outline: "Outline") -> None:
    click.echo("".join(f"{line}\n" for line in plan_text.planned(plain(outline.plan))))


def _as_printed(design: "Design", accuracy: float | None, how: dict[str, Any]) -> int:
    """Drawn against printed; 1 where a body is missing from a layer and nobody has waived it."""
    from sensorgen.asprinted import compared
    from sensorgen.asprinted.report import report

    printed = asprinted_text.printed(design, how["slicer"], how["walls"])
    found = report(design, printed, accuracy or compared.ACCURACY)
    text = (f"{line}\n" for line in asprinted_text.lines(found))
    _deliver(iter([show.json_text(found)]) if how["as_json"] else text, how["output"])
    return FOUND_ERRORS if any(f["severity"] == "error" and not f["waiver"] for f in found["findings"]) else 0


def _refuse_strangers(pressing: Sequence[object], *, explain: bool) -> None:
    """Without a press, what is printed is told of the sensor at rest."""
    if explain or any(given is not None for given in pressing):
        raise BadInput(
            "--as-printed without a press speaks of the sensor at rest; expected --force or --position with tones, a "
            "tip or a law of compression"
        )


def _refuse_unjudged(predicted: dict[str, Any]) -> None:
    """A tip or a law that was asked for and cannot be is a wrong word, not a reason to leave out the card."""
    found = predicted.get("identifiability")
    if found and not found["verdict"]:
        raise BadInput(found["reason"])


def _verdict(predicted: dict[str, Any], accuracy: float | None) -> int:
    """0, or 1 and a word where abs(Z), or the capacitance where no press could be judged, is not as near as wanted."""
    if accuracy is None or predicted.get("capacitance_f", True) is None:
        return 0
    plan = predicted.get("plan")
    best = plan["width"] if plan else predicted["relative_width"]
    if best is not None and best <= accuracy:
        return 0
    said = "nobody knows how near it is" if best is None else f"the best is {best:.2g}"
    parts = (*(plan_text.shares(plan) if plan else ()), *predicted.get("refused", ()))
    click.echo(
        f"sensorgen: an accuracy of {accuracy:g} was not reached; {said}{''.join(f'; {part}' for part in parts)}",
        err=True,
    )
    return FOUND_ERRORS


def _refuse_two(how: dict[str, Any]) -> None:
    given = [f"--{name.removeprefix('as_')}" for name in ("as_json", "as_csv", "plot") if how[name]]
    given += ["--output"] if how["output"] and (how["plot"] or how["explain"]) else []
    if len(given) > 1:
        raise BadInput(f"{' and '.join(given)} at once; expected one of them")
    if how["explain"] and given:
        raise BadInput(f"--explain is for people, and {given[0]} is not; --json holds the plan too")


def _unpressed(predicted: dict[str, Any], how: dict[str, Any]) -> Iterator[str]:
    """The prediction without a press, the identifiability card, and the error budget."""
    if how["as_json"]:
        yield show.json_text(predicted)
    else:
        lines = (*_measured(predicted, how), *show.prediction_lines(predicted), *_judgement(predicted))
        yield from (f"{line}\n" for line in lines)


def _measured(predicted: dict[str, Any], how: dict[str, Any]) -> Iterator[str]:
    """What came of the plan, where that is asked for."""
    if how["explain"] and "plan" in predicted:
        yield from (*plan_text.measured(predicted["plan"]), "")


def _judgement(predicted: dict[str, Any]) -> Iterator[str]:
    """The identifiability card and the error budget, as lines."""
    yield from card_text.of_prediction(predicted)
    if predicted.get("budget"):
        yield from ("", *budget_text.lines(predicted["budget"]))


def _pressed(
    design: "Design", made: "tuple[Sensed, Plan | None]", axes: Axes, wanted: tuple[float, float], how: dict[str, Any]
) -> dict[str, Any]:
    """Print what presses do, and say as much of it as decides the exit code."""
    sensed, plan = made
    from sensorgen.prediction.prediction import csv_blocks, moves, presses

    if how["plot"]:
        _plot(design.name, sensed, axes, Path(how["plot"]))
    elif how["as_csv"]:
        _deliver(csv_blocks(sensed.sensor, *axes), how["output"], len(axes[1]) * len(axes[2]))
    else:
        predicted = presses(design, sensed, *axes, *wanted, plan if how["planned"] else None)
        lines = (*_measured(predicted, how), *show.presses(predicted, moves(predicted)), *_judgement(predicted))
        text = (f"{line}\n" for line in lines)
        _deliver(show.json_lines(predicted) if how["as_json"] else text, how["output"])
    return {"plan": plain(plan)} if plan else {}


def _plot(name: str, sensed: "Sensed", axes: Axes, folder: Path) -> None:
    from sensorgen.analysis import plots
    from sensorgen.core import files as store
    from sensorgen.prediction.prediction import check_presses

    _, force_n, position_mm = axes
    check_presses(sensed.sensor, force_n, [x * units.M_PER_MM for x in position_mm])
    with show.progress(plots.STEPS) as step:
        for file, content in plots.files(sensed.sensor, *axes, name):
            step(file)
            store.replace(folder / file, content)
    for file in plots.STEPS:
        click.echo(str(folder / file))


def _deliver(pieces: Iterator[str], output: str | None, rows: int = 0) -> None:
    """Print pieces of text as they come, or write them to a file that is there when all of them are."""
    if output in (None, "-"):
        for piece in pieces:
            sys.stdout.write(piece)
        return
    from sensorgen.core import files as store
    from sensorgen.prediction.prediction import ROWS

    with show.progress([f"{share} %" for share in range(101)]) as step, store.replacing(Path(str(output))) as file:
        for k, piece in enumerate(pieces):
            step(f"{100 * k * ROWS // rows if rows else 100} %")
            file.write(piece.encode())
    click.echo(output)


command = DesignGroup(
    _work, OWN, name="predict",
    help="Predict capacitance with its bounds, electrode resistance, corner frequency and impedance; with --force, "
    "--position, --csv or --plot, R and X over force, position and tone.",
    short_help="Predict capacitance, resistance and impedance, pressed or not.",
)  # fmt: skip
