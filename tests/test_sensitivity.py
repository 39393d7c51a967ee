"""Sensitivity: the plate's own numbers, closed forms of how it is held, and cells beside it."""

import pytest

from plate_sensitivity import BOUNDARIES, sensitivity
from sensorgen.design.design import make
from sensorgen.models import compression
from sensorgen.prediction.query import TONES_HZ

PLATE = make({"shape": "reference"})


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


def test_the_plate_of_the_thesis_tells_neither_force_nor_position():
    """Independently derived bounds: 2.23 N and 225 mm by B.49; 214 N and 21 m bonded."""
    free = sensitivity(PLATE, compression.unconfined(6e6), TONES_HZ, 6.0, resistivity_ohm_m=0.135)
    assert free.rise == pytest.approx(0.01 / 0.99)
    assert free.per_newton == pytest.approx(1e4 / 6e6 / 0.99**2)
    assert (free.sigma_force_n, free.sigma_position_m) == pytest.approx((2.23, 0.225), rel=5e-3)
    bonded = sensitivity(PLATE, compression.bonded(6e6, 0.01, 6e-4), TONES_HZ, 6.0, resistivity_ohm_m=0.135)
    assert (bonded.sigma_force_n, bonded.sigma_position_m) == pytest.approx((214, 21), rel=2e-2)


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
