"""Other people's programs on the same line: scikit-rf's media and ngspice's circuits."""

import line_ladder
import numpy as np
import pytest
from line_cases import PLATE

from sensorgen.models import line
from sensorgen.verification import line_models


def through_scikit_rf(inputs) -> complex:
    pytest.importorskip("skrf", reason="scikit-rf is not installed")
    return complex(line_models.scikit_rf(line.PressedLine(**inputs))[0])


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("f", "whole", "real"), [(1.1e3, 1e-10, 1e-7), (99.7e3, 1e-12, 1e-11), (1e7, 1e-13, 1e-13)])
def test_scikit_rf_agrees(f, whole, real):
    inputs = PLATE | {"frequency_hz": f}
    z, theirs = line.impedance(line.PressedLine(**inputs)), through_scikit_rf(inputs)
    assert abs(theirs - z) < whole * abs(z)
    assert abs(theirs.real - z.real) < real * z.real


@pytest.mark.parametrize("f", [1.1e3, 99.7e3, 1e6])
def test_ngspice_solves_the_same_ladder(f, program):
    program("ngspice", "ngspice")
    given = line.PressedLine(**PLATE | {"frequency_hz": np.array([f])})
    (theirs,) = line_models.ngspice(given, 100)
    assert theirs == pytest.approx(complex(line_ladder.impedance(given, 100)[0]), rel=1e-8)
    z = complex(line.impedance(given)[0])
    assert abs(theirs - z) < 1e-4 * abs(z)
    assert abs(theirs.real - z.real) < 1e-3 * z.real
