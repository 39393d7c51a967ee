"""A prediction that says nothing, for tests that look at what is printed alone."""

import os
from contextlib import contextmanager
from pathlib import Path

import pytest

from sensorgen.prediction import quantities
from sensorgen.prediction.results import SCHEMA, Prediction


def nothing(body, query):
    """In place of :func:`sensorgen.prediction.quantities.prediction`."""
    load = query.load(body.design)
    head = (SCHEMA, body.design.name, body.design.id(), body.provenance, "not predicted", load.force_n, load.position_m)
    return Prediction(*head, reason="by this test")


@contextmanager
def unpredicted():
    """No design is predicted; what is kept meanwhile has a folder of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(quantities, "prediction", nothing)
        patch.setenv("SENSORGEN_CACHE", str(Path(os.environ["SENSORGEN_CACHE"]) / "unpredicted"))
        yield
