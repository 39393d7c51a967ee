"""Presses that an array tells apart: against presses that are fitted to maps of simulated frames."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from sensorgen.core import document
from sensorgen.measure.virtual.array import nodal
from sensorgen.prediction.array.frames import at_rest
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.study import PRESS_N, count, distance_mm, pressures, study

from .conftest import array_of


@pytest.fixture(scope="module")
def model():
    return array_of({"length_mm": 80, "width_mm": 60})


def test_a_press_on_squares_has_its_force(model):
    """By shares of its area: in the middle of a square all on it, a quarter off a corner of four."""
    x, y = model.layout.x_mm[3], model.layout.y_mm[2]
    middle = pressures(model, np.array([[PRESS_N, x, y]]))
    assert middle[2, 3] == pytest.approx(60e3)
    assert middle.sum() == pytest.approx(60e3)
    corner = pressures(model, np.array([[PRESS_N, x + 5, y + 5]]))
    assert corner[2:4, 3:5] == pytest.approx(np.full((2, 2), 15e3))


def test_fitted_presses_are_as_far_apart_as_stated(model):
    """At the distance stated the fitted one errs by less than a third of it, by the median; another network solves."""
    noise = 1e-2
    readout = ArrayReadout(noise=noise)
    distance, draw = study(model, readout, 60.0).apart_mm, np.random.default_rng(1)
    x, y = model.layout.x_mm[4], model.layout.y_mm[3]
    rest = nodal(model.tracks(), model.capacitances(), readout)
    inverter, found = at_rest(model, readout, rest[None]), []
    for phase in (0.0, 2.5, 5.0):
        true = np.array([[PRESS_N, x + phase - distance / 2, y], [PRESS_N, x + phase + distance / 2, y]])
        load = model.carried(pressures(model, true)[None])[0]
        siemens = nodal(model.tracks(), model.capacitances(model.under(load)[0]), readout)
        for _ in range(4):
            off = noise * np.abs(siemens) * (draw.normal(size=load.shape) + 1j * draw.normal(size=load.shape))
            maps = inverter.maps((siemens + off)[None], np.zeros(1)).on_surface()
            one, two = 1e3 * maps.pressure_kpa[0], 1e3 * maps.sigma_kpa[0]
            fit = least_squares(
                lambda at, p=one, s=two: ((pressures(model, at.reshape(2, 3)) - p) / s).ravel(), true.ravel() + 0.2
            )
            found.append(fit.x[4] - fit.x[1])
    assert 1.48 * np.median(np.abs(np.array(found) - distance)) < distance / 3
    assert 10 < distance < 20


def test_fewer_are_told_apart_with_more_noise(model):
    far = [study(model, ArrayReadout(noise=noise), 60.0).apart_mm for noise in (1e-3, 1.5e-2, 1.0)]
    assert far[0] < far[1] < far[2] == np.inf
    assert count(model, 12.5) == 30
    assert distance_mm(model, np.full(48, 1e-30)) == np.inf


def test_what_is_not_told_apart_is_said_as_far_as_it_was_tried():
    """Three rows have room for 10 mm around their middle; beyond, 'however far' was no answer."""
    found = study(array_of({"length_mm": 70, "width_mm": 30}), ArrayReadout())
    assert np.isinf(found.apart_mm)
    words = " ".join("".join(document.text(found.document())).split())
    assert "up to 10 mm apart: farther ones were not tried" in words
