"""``sensorgen array``: what an array of crossing tracks resolves, by its network."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.designs import of_design
from sensorgen.cli.options import InputResistance, Readout, refuse_input
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option
from sensorgen.core.units import FREQUENCY_HZ
from sensorgen.prediction.query import Noise

if TYPE_CHECKING:
    from sensorgen.core.arrays import Real
    from sensorgen.design.design import Design
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import ArrayStudy

Frequencies = Annotated[
    tuple[float, ...],
    Option("Frequencies, as in 10kHz,100kHz; 10 kHz if not given.", ("--frequencies",), FREQUENCY_HZ),
]
Short = Annotated[float | None, Option(kind="proper share")]
Pressure = Annotated[float, Option(kind="ratio", typed="100")]


@of_design("array", *render.options())
def command(
    design: "Design", *, readout: Readout = "guarded", input_ohm: InputResistance, frequency_hz: Frequencies = (10e3,),
    noise: Noise, noise_s: Annotated[float | None, Option(kind="ratio")] = None, pressure_kpa: Pressure,
    faults: tuple[str, ...] = (), short: Short = None, simulate: Path | None = None,
    plot: Path | None = None,
) -> "ArrayStudy":  # fmt: skip
    """Resolution of an array of crossing tracks: pressure and force of every crossing, crosstalk, faults.

    Parameters
    ----------
    noise_s, --noise-siemens
        Standard error of a reading, absolute [S].
    pressure_kpa
        Even pressure at which resolution is stated [kPa].
    faults, --fault
        Fault of the print: r3:5 breaks row 3 behind column 5 (:0 its lead), r2c4 is shorted.
    short, --p-short
        Probability that a crossing is shorted, as by 'sensorgen gcode pinholes': for the yield of the print.
    simulate : FILE.npz
        Write frames of a step there as the array would give them: 5 at rest, 60 with a foot of 357 kPa at its peak,
        cells that scatter by 5 %, noise, faults; with the true pressures.
    plot : DIR
        Write the map over the outline there, and a page with maps of two faults and of a simulated foot.
    """
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import study

    refuse_input(readout)
    if simulate is not None and simulate.suffix != ".npz":
        raise BadInput(f"--simulate {simulate}: expected a name that ends in .npz")
    how = ArrayReadout(readout, input_ohm, frequency_hz, noise, noise_s or 0.0)  # type: ignore[arg-type]
    model = array_model(design)
    resolution = study(model, how, pressure_kpa, faults, short or 0.0)
    if simulate is not None:
        from sensorgen.measure.virtual.array import step

        render.file(simulate, step(model, how, faults), "wrote ")
    if plot is not None:
        from sensorgen.analysis.plots import array

        render.file(plot / f"{design.name}-array.png", array.png(resolution), "wrote ")
        render.file(plot / f"{design.name}-array.html", array.page(resolution, *_foot(model, how)), "wrote ")
    return resolution


def _foot(model: "ArrayModel", readout: "ArrayReadout") -> "tuple[PressureMaps, Real]":
    """A simulated foot on the array: maps of one frame, and the true pressures."""
    import numpy as np

    from sensorgen.measure.virtual.array import foot, simulated
    from sensorgen.prediction.array.frames import inverted

    load = np.stack([np.zeros(model.here.shape), foot(model.layout)])
    first = replace(readout, frequency_hz=readout.frequency_hz[:1])
    return inverted(model, first, simulated(model, first, load), np.array([True, False]), np.arange(2.0)), load[1:]
