"""Arrays of triX with air between their columns."""

import pytest

from sensorgen.design.design import make
from sensorgen.prediction.array.model import array_model

TRI = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}}


def array_of(parameters, **data):
    """Model of an array."""
    given = {"shape": "array", "name": "a", "cell": TRI, "parameters": {"between": "air"} | parameters}
    return array_model(make(given | data))


@pytest.fixture(scope="session")
def model():
    """Of 5 x 6 crossings."""
    return array_of({"length_mm": 60, "width_mm": 50})
