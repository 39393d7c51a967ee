"""Predictions that say nothing, or little, for tests that look at other things."""

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


@contextmanager
def at_rest(folder="at-rest"):
    """Capacitance and resistance as ever, nothing under a load."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(quantities, "_model", lambda *_: (None, None, ""))  # without a sensor to load
        patch.setenv("SENSORGEN_CACHE", str(Path(os.environ["SENSORGEN_CACHE"]) / folder))
        yield


@contextmanager
def roughly_at_rest():
    """Resistance as ever, capacitance of the likely print by closed forms, no load; for readings of a multimeter."""
    from sensorgen.prediction import capacitance, rest_state, sensor_model

    with pytest.MonkeyPatch.context() as patch, at_rest("rough"):
        for name in ("PLANE", "SPATIAL", "OPEN"):
            patch.setattr(capacitance, name, 10.0)
        patch.setattr(rest_state, "PLANE", 10.0)
        patch.setattr(rest_state, "_other_prints", lambda *_: ([], [], False))
        patch.setattr(rest_state, "_film_ratios", lambda *_: (1.0, 1.0, 0.0))
        patch.setattr(sensor_model, "ACCURACY", 10.0)
        yield
