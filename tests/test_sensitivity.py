"""Sensitivity: closed forms of how a plate is held."""

import pytest

from plate_sensitivity import BOUNDARIES, sensitivity
from sensorgen.design.design import make
from sensorgen.prediction.query import TONES_HZ

PLATE = make({"shape": "reference"})


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.mark.parametrize("held", BOUNDARIES)
def test_a_plate_gives_way_as_its_three_layers_do(held):
    """Free: they widen alike, by which the area grows as the film thins. Bonded without end: by the modulus of uniaxial
    strain.
    """
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    nu, film, electrode = 0.4999, 6e6, 22e6
    expected = {
        "free": 2 * 6e4 * (1 - nu**2) * 1.2e-3 / (electrode * 6e-4 + film * 6e-4),
        "bonded": 6e4 * (1 + nu) * (1 - 2 * nu) / (film * (1 - nu)),
    }[held]
    assert sensitivity(PLATE, held, TONES_HZ, 6.0).rise == pytest.approx(expected, rel=3e-3)
