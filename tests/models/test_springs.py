"""Springs of columns: closed forms, and how far they are from the finite elements."""

import pytest

from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.models import springs


def test_a_plate_is_springs_in_series():
    found = springs.displacement_m(make({"shape": "reference"}).in_use, {"x60": 6e6, "etpu": 22e6}, [0.0, 1e5])
    assert found == pytest.approx([0.0, 1e5 * (0.6e-3 / 6e6 + 0.6e-3 / 22e6)], rel=1e-9, abs=0)


def test_a_wedge_closes_with_the_root_of_the_stress():
    """Compliant electrodes apart, a wedge over a bed of constant yielding: stress as displacement squared."""
    scene = make({"shape": "tri"}).in_use
    low, high = springs.displacement_m(scene, {"x60": 6e6, "etpu": 22e6}, [5e3, 2e4])
    assert high / low == pytest.approx(2.0, rel=0.03)


def test_pull_and_flat_are_refused():
    scene = make({"shape": "tri"}).in_use
    with pytest.raises(OutOfRange, match="pulls"):
        springs.displacement_m(scene, {"x60": 6e6, "etpu": 22e6}, [-1.0])
    with pytest.raises(OutOfRange, match="flat"):
        springs.displacement_m(scene, {"x60": 6e6, "etpu": 22e6}, [1e9])
