"""``sensorgen stack|sheet|array``: a second film, contacts of a sheet, and the resolution of crossing tracks."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.cli import render
from sensorgen.cli.designs import BodyChoice, of_design
from sensorgen.cli.options import Force, InputResistance, Law, Readout, refuse_input
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option
from sensorgen.core.units import FREQUENCY_HZ
from sensorgen.prediction.query import TONES_HZ, Frequencies, Noise, Query

if TYPE_CHECKING:
    from sensorgen.core.arrays import Real
    from sensorgen.design.design import Design
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import ArrayStudy
    from sensorgen.prediction.double_layer import StackStudy
    from sensorgen.prediction.sheet_study import Rectangle, SheetStudy


Drift = Annotated[float, Option(kind="proper share", typed="10%")]


def _refuse_array(design: "Design") -> None:
    """Refuse an array, of which one crossing would be taken for the sensor."""
    if design.layout:
        raise BadInput(f"{design.name} is an array; expected a sensor of one top electrode, or 'sensorgen array'")


@of_design("stack", *render.options())
def stack_command(
    design: "Design", *, force_n: Force, position_mm: Annotated[float | None, Option(zero=True)] = None,
    frequency_hz: Frequencies = TONES_HZ, tip_mm: Annotated[float, Option(typed="10mm")], noise: Noise, drift: Drift,
    within_n: Annotated[float, Option(typed="0.1N")], law: Law = "",
) -> "StackStudy":  # fmt: skip
    """Compare a double sensor with a single one, and what a touch does to them, with isolation and without.

    Parameters
    ----------
    position_mm
        Position of the tip's middle [mm]; the sensor's middle if not given.
    tip_mm, --touch : MM
        Length of the tip that presses, and of the body that touches.
    drift
        What the films' permittivity may have drifted by, both alike.
    within_n
        Largest force that a touch may be mistaken for.
    """
    from sensorgen.prediction.double_layer import study

    _refuse_array(design)
    position_m = None if position_mm is None else position_mm * units.M_PER_MM
    return study(design, frequency_hz, force_n, position_m, noise, drift, within_n, law, tip_mm * units.M_PER_MM)


SETS = ("one-edge", "opposite", "two-edges", "corner", "corners")
Pads = Annotated[tuple["Rectangle", ...], Option(kind="pad")]  # fmt: skip


@of_design("sheet", *render.options())
def sheet_command(
    design: "Design", *, contacts: Annotated[str, Option(kind=(*SETS, "all"))] = "", pads: Pads = (),
    frequency_hz: Frequencies = TONES_HZ, force_n: Force, tip_mm: Annotated[float, Option(typed="10mm")], noise: Noise,
    law: Law = "", body: BodyChoice, plot: Path | None = None,
) -> "SheetStudy":  # fmt: skip
    """Bounds on force and place of a press in two dimensions, for the usual sets of contacts.

    Parameters
    ----------
    contacts
        Contacts to read: one edge, both ends, two edges that meet, one corner, or four.  [default: all, or those of
        --pad]
    pads, --pad
        Contacts of your own, on top and on the bottom at the same place; give one for each pair to read, as in
        90-100,0-10 [mm], or 0,20-60 for a stretch of an edge.
    tip_mm : MM
        Side of the square tip.
    plot : DIR
        Write maps of the bounds there.
    """
    from sensorgen.prediction.sensor_model import sensor_model
    from sensorgen.prediction.sheet_study import PLACES, study

    _refuse_array(design)
    model = sensor_model(body(design), Query(law=law))[0]
    wanted, places = contacts or ("" if pads else "all"), PLACES**2
    names = [*(["pads"] if pads else []), *(name for name in SETS if wanted in (name, "all"))]
    with render.progress([f"{name} {k + 1}/{places}" for name in names for k in range(places)]) as step:
        bounds = study(
            model, frequency_hz, force_n, tip_mm * units.M_PER_MM, noise, contacts=wanted, pads=pads,
            step=lambda name, count: step(f"{name} {count + 1}/{places}"),
        )  # fmt: skip
    if plot is not None:
        from sensorgen.analysis.plots import results, static

        figure = results.sheet(bounds.sheet, bounds.bounds, bounds.ports)
        render.file(plot / f"{design.name}-sheet.png", static.png(figure), "wrote ")
    return bounds


ArrayFrequencies = Annotated[
    tuple[float, ...],
    Option("Frequencies, as in 10kHz,100kHz; 10 kHz if not given.", ("--frequencies",), FREQUENCY_HZ),
]
Short = Annotated[float | None, Option(kind="proper share")]
Pressure = Annotated[float, Option(kind="ratio", typed="100")]


@of_design("array", *render.options())
def array_command(
    design: "Design", *, readout: Readout = "guarded", input_ohm: InputResistance,
    frequency_hz: ArrayFrequencies = (10e3,), noise: Noise,
    noise_s: Annotated[float | None, Option(kind="ratio")] = None, pressure_kpa: Pressure,
    faults: tuple[str, ...] = (), short: Short = None, simulate: Path | None = None, plot: Path | None = None,
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
    resolution = replace(study(model, how, pressure_kpa, faults, short or 0.0), notes=_tiled(design))
    if simulate is not None:
        from sensorgen.measure.virtual.array import step

        render.file(simulate, step(model, how, faults), "wrote ")
    if plot is not None:
        from sensorgen.analysis.plots import array, static

        render.file(plot / f"{design.name}-array.png", static.png(array.resolution(resolution)), "wrote ")
        render.file(plot / f"{design.name}-array.html", array.page(resolution, *_foot(model, how)), "wrote ")
    return resolution


def _tiled(design: "Design") -> tuple[str, ...]:
    """That an array is not printed as the one print that its numbers are of, if so."""
    from sensorgen.workflows.tiles import tiles

    try:
        placed = tiles(design)
    except BadInput as error:
        return (f"not printable: {error}",)
    if not placed:
        return ()
    first, wires = placed[0][0].design, sum(tile.rows + tile.columns for tile, _ in placed)
    return (
        f"larger than the bed: {len(placed)} tiles are printed, of {wires} wires together; the numbers are of one "
        f"print (of a tile: sensorgen array out/{first}/design.json)",
    )


def _foot(model: "ArrayModel", readout: "ArrayReadout") -> "tuple[PressureMaps, Real]":
    """A simulated foot on the array: maps of one frame, and the true pressures."""
    import numpy as np

    from sensorgen.measure.virtual.array import foot, simulated
    from sensorgen.prediction.array.frames import inverted

    load = np.stack([np.zeros(model.here.shape), foot(model.layout)])
    first = replace(readout, frequency_hz=readout.frequency_hz[:1])
    return inverted(model, first, simulated(model, first, load), np.array([True, False]), np.arange(2.0)), load[1:]
