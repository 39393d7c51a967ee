"""Arrays sliced by real slicers, and searched for."""

import numpy as np
import pytest

from sensorgen.core.findings import most_severe
from sensorgen.design.design import make
from sensorgen.design.walls import PROGRAMS
from sensorgen.prediction.new_slice import slice_now
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows.optimise.ladder import everything
from sensorgen.workflows.optimise.target import NUMBERS, Target

PARAMETERS = {"length_mm": 10, "width_mm": 10, "pitch_x_mm": 5, "pitch_y_mm": 5, "column_mm": 4, "row_mm": 4}


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_an_array_of_tri_prints(slicer, program, cache):
    """An array whose base, of another tool than the electrodes, lies on the bed; all dielectric is one body."""
    name, package = PROGRAMS[slicer]
    program(package, name)
    held = reviewed(make({"shape": "array", "parameters": PARAMETERS, "cell": {"shape": "tri"}}), slicer=slicer)
    assert held.source.startswith("sliced by")
    assert not [f for f in held.findings if f.severity == "error"], most_severe(held.findings, 9)


def test_newer_cura_primes_the_tool_of_an_array_that_lies_on_the_bed(newer_program):
    """A skirt of the base's tool, which has not the lowest number: the engine primes that tool alone there."""
    design = make({"shape": "array", "parameters": PARAMETERS, "cell": {"shape": "tri"}})
    report = slice_now(design, "cura", program=str(newer_program("CuraEngine"))).report
    assert not [f for f in report.of_print() if f.severity == "error"], most_severe(report.of_print(), 9)


def test_numbers_of_a_search_are_those_of_the_array(cache):
    design = {"shape": "array", "parameters": PARAMETERS, "cell": {"parameters": {"dielectric_mm": 0.4}}}
    found = []
    for noise in (1e-3, 2e-3):
        target = Target.model_validate({
            "design": design, "parameters": {"pitch_x_mm": [5.0]}, "load": {"noise": noise, "frequency_hz": [20e3]},
            "objectives": {"pressure_resolution_kpa": "minimise", "wires": "minimise"},
        })  # fmt: skip
        trial = everything(make(design), target.query(), "")
        assert NUMBERS["wires"].of(trial.printed).value == 4
        found.append(NUMBERS["pressure_resolution_kpa"].of(trial.printed).value)
    assert np.diff(np.log(found)) == pytest.approx(np.log(2), rel=0.01)
