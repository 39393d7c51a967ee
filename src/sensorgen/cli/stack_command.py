"""``sensorgen stack``: what a second film tells that one does not, and what a touch does to a reading."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from sensorgen.cli import options, render
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.options import option
from sensorgen.cli.words import Share, Values, one, proper
from sensorgen.core import units

if TYPE_CHECKING:
    from sensorgen.design.design import Design

OWN: list[click.Parameter] = [
    options.force(),
    option(
        "--position position_mm", Values(units.LENGTH_MM, zero=True),
        "Position of the tip's middle [mm]; the sensor's middle if not given.",
    ),
    options.frequencies(),
    options.tip("--touch tip_mm", "Length of the tip that presses, and of the body that touches."),
    options.noise(),
    option("--drift", Share(), "What the films' permittivity may have drifted by, both alike.", default="10%"),
    option(
        "--within within_n", Values(units.FORCE_N, zero=False), "Largest force that a touch may be mistaken for.",
        default="0.1N",
    ),
    options.compression(), *render.options(),
]  # fmt: skip


def _work(
    design: "Design", *, force_n: Sequence[float], position_mm: Sequence[float] | None,
    frequency_hz: Sequence[float] | None, tip_mm: Sequence[float], noise: float, drift: float,
    within_n: Sequence[float], compression: str | None,
) -> int:  # fmt: skip
    from sensorgen.prediction.double_layer import study
    from sensorgen.prediction.query import TONES_HZ

    at_mm = None if position_mm is None else one("--position", position_mm)
    found = study(
        design, frequency_hz or TONES_HZ, one("--force", force_n), None if at_mm is None else at_mm * units.M_PER_MM,
        proper("--noise", noise), proper("--drift", drift), one("--within", within_n), compression or "",
        one("--touch", tip_mm) * units.M_PER_MM,
    )  # fmt: skip
    render.deliver(found)
    return 0


command = DesignGroup(
    _work, OWN, name="stack",
    help="What a double sensor tells that a single one does not, and what a touch does, with isolation and without.",
)  # fmt: skip
