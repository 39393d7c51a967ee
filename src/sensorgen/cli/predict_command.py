"""``sensorgen predict``: what the bench should measure."""

from typing import TYPE_CHECKING

import click

from sensorgen.cli import show
from sensorgen.cli.designs import DesignGroup

if TYPE_CHECKING:
    from sensorgen.design import Design

OWN: list[click.Parameter] = [click.Option(["--json", "as_json"], is_flag=True, help="Print the prediction as JSON.")]


def _work(design: "Design", *, as_json: bool) -> int:
    from sensorgen.predict import prediction

    predicted = prediction(design)
    (show.as_json if as_json else show.prediction)(predicted)
    return 0


command = DesignGroup(
    _work, OWN, name="predict",
    help="Predict capacitance with its bounds, electrode resistance, corner frequency and impedance.",
    short_help="Predict capacitance, resistance and impedance.",
)  # fmt: skip
