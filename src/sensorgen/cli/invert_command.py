"""``sensorgen invert``: force and position back from measured impedances."""

import re
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import body_options, render, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import Length, OneOf, Share, Values, one
from sensorgen.core import files as store
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.readings import Readings
    from sensorgen.prediction.inverse import Estimator, Prior

_NORMAL = re.compile(r"(force|position)=(.+?)(?:\+-|±)(.+)")


OWN: list[click.Parameter] = [
    click.Argument(["measured"], metavar="MEASURED.csv"),
    click.Option(
        ["--noise"], type=Share(), default="0.1%", show_default=True, metavar="SHARE",
        help="Standard deviation of R and of X, each as a share of the impedance's magnitude.",
    ),
    click.Option(
        ["--prior"], metavar="WHAT",
        help="Prior: uniform, or force=3+-1, position=50+-20 (N, mm), or both with a comma.",
    ),
    click.Option(
        ["--force-limit", "force_limit_n"], type=Values(units.FORCE_N, zero=False), metavar="N",
        help="Largest force to look for [default: 13 N].",
    ),
    click.Option(["--tip", "tip_mm"], type=Length(), default="10mm", show_default=True, help="Length of the tip."),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded")),
        help="Compression law of a plate; the best of the cell if not given.",
    ),
    click.Option(
        ["--output", "-o"], metavar="FILE.csv",
        help="Write a row per sample, '-' to the terminal; readings from the standard input go there by themselves.",
    ),
    *body_options.body_options(),
    *render.options("json", "markdown", file=False),
]  # fmt: skip


def _work(design: "Design", *, measured: str, output: str | None, **how: Any) -> int:
    """The rows go to the terminal, at once, or to a file that is there when it is whole; then the summary."""
    from sensorgen.measure.readings import readings
    from sensorgen.prediction.inverse import answers

    live = measured == "-" and output is None
    terminal = live or output == "-"
    with readings(measured) as source, ExitStack() as stack:
        estimator, doubts = _estimator(design, source, **how)
        summary = answers.Summary(estimator, doubts)
        file = stack.enter_context(store.replacing(Path(output))) if output and not terminal else None

        def write(text: str) -> None:
            if terminal:
                print(text, end="", flush=True)
            elif file:
                file.write(text.encode())

        step = stack.enter_context(show.progress(["reading"]))
        write(answers.header(source.kept))
        for block in source.blocks(1) if live else source.blocks():
            found = estimator.batch(block.impedance_ohm)
            summary.add(found)
            step(f"{summary.samples} samples")
            if terminal or file:
                write(answers.rows(block.kept, found, prior=estimator.prior is not None))
    for piece in render.pieces(summary.result(), render.form()):
        render.say(piece, nl=False, err=terminal)
    if not render.form() and not terminal:
        render.say(output or "--output FILE.csv writes force and position of every sample")
    return 0


def _estimator(
    design: "Design",
    source: "Readings",
    *,
    noise: float,
    prior: str | None,
    force_limit_n: tuple[float, ...] | None,
    tip_mm: float,
    compression: str | None,
) -> "tuple[Estimator, tuple[str, ...]]":
    """The estimator for this design, and what to doubt about its sensor."""
    from sensorgen.prediction.inverse import FORCE_LIMIT_N, Estimator
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.query import Query, Tip

    query = Query(tip=Tip(tip_mm * units.M_PER_MM), law=compression or "")
    model = sensor_model(body_options.body_of()(design), query)[0]
    limit = one("--force-limit", force_limit_n) if force_limit_n else FORCE_LIMIT_N
    return Estimator(model.sensor, source.frequency_hz, noise, _prior(prior), limit), model.doubts


def _prior(text: str | None) -> "Prior | None":
    if text is None:
        return None
    from sensorgen.prediction.inverse import Prior

    if text.strip() == "uniform":
        return Prior()
    found: dict[str, tuple[float, float]] = {}
    for word in text.split(","):
        match = _NORMAL.fullmatch(word.strip().replace(" ", ""))
        if match is None or match[1] in found:
            raise BadInput(f"--prior {text!r}: expected uniform, or force=3+-1,position=50+-20 (N, mm)")
        read, scale = (units.force_n, 1.0) if match[1] == "force" else (units.length_mm, units.M_PER_MM)
        try:
            found[match[1]] = read(match[2]) * scale, read(match[3]) * scale
        except BadInput as error:
            raise error.within("--prior") from None
    return Prior(found.get("force"), found.get("position"))


command = DesignGroup(
    _work, OWN, name="invert",
    help="Force and position behind the impedances in MEASURED.csv ('-' reads the standard input): one row per sample, "
    "columns re_ohm_1.1kHz and im_ohm_1.1kHz for every tone.",
)  # fmt: skip
