"""``sensorgen array``: what an array of crossing tracks resolves, by its network."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sensorgen.cli import options, render
from sensorgen.cli.array_frames import refuse_input
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.options import option
from sensorgen.cli.words import Ratio, proper

if TYPE_CHECKING:
    from sensorgen.design.design import Design


OWN: list[click.Parameter] = [
    *options.array_readout(), options.frequencies(), options.noise(),
    option("--noise-siemens noise_s", Ratio(), "Standard error of a reading, absolute [S]."),
    option("--pressure pressure_kpa", Ratio(), "Even pressure at which resolution is stated [kPa].", default="100"),
    option(
        "--fault faults", None, "Fault of the print: r3:5 breaks row 3 behind column 5 (:0 its lead), r2c4 is shorted.",
        multiple=True,
    ),
    option(
        "--simulate", click.Path(path_type=Path),
        "Write frames of a step there as the array would give them: 5 at rest, 60 with a foot of 357 kPa at its peak, "
        "cells that scatter by 5 %, noise, faults; with the true pressures.", metavar="FILE.npz",
    ),
    option("--plot", click.Path(path_type=Path), "Write the map over the outline there.", metavar="DIR"),
    *render.options(),
]  # fmt: skip


def _work(
    design: "Design", *, readout: str, input_ohm: float, frequency_hz: tuple[float, ...] | None, noise: float,
    noise_s: float | None, pressure_kpa: float, faults: tuple[str, ...], simulate: Path | None, plot: Path | None,
) -> int:  # fmt: skip
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import study

    proper("--noise", noise)
    refuse_input(readout)
    how = ArrayReadout(readout, input_ohm, frequency_hz or (10e3,), noise, noise_s or 0.0)  # type: ignore[arg-type]
    model = array_model(design)
    found = study(model, how, pressure_kpa, faults)
    if simulate is not None:
        from sensorgen.core import files
        from sensorgen.measure.virtual.array import step

        files.replace(simulate, step(model, how, faults))
        render.say(f"wrote {simulate}", err=bool(render.form()))
    if plot is not None:
        from sensorgen.analysis.plots import array
        from sensorgen.core import files

        where = plot / f"{design.name}-array.png"
        files.replace(where, array.png(found))
        render.say(f"wrote {where}", err=bool(render.form()))
    render.deliver(found)
    return 0


command = DesignGroup(
    _work, OWN, name="array",
    help="Resolution of an array of crossing tracks: pressure and force of every crossing, crosstalk, faults.",
)  # fmt: skip
