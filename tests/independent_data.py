"""Runs of the independent sensor as the package takes them."""

from dataclasses import replace

import numpy as np

from independent_sensor import AVERAGES, TONES_HZ
from sensorgen.analysis.calibration import Bench, spread_of
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.fitting import Data
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel
from sensorgen.prediction.query import Query, Tip
from sensorgen.prediction.sensor_model import sensor_model

DESIGN = {  # the independent strip's electrodes are those of the thesis's Table C.1: 8.64 kohm
    "shape": "tri", "parameters": {"dielectric_mm": 0.2},
    "materials": {"top_electrode": "etpu@thesis-c.1-top", "bottom_electrode": "etpu@thesis-c.1-bottom"},
}  # fmt: skip


def model_of(printed):
    """The model of the design, as printed or as drawn, under a tip told to have 5 mm."""
    body = (bodies.default_body if printed else bodies.drawn)(make(DESIGN))
    predicted = sensor_model(body, Query(tip=Tip(5e-3)))[0]
    return SpecimenModel(predicted.sensor, TONES_HZ, spread_of(predicted, Bench(5e-3)))


def data_of(run, noise):
    """Known presses."""
    m = len(TONES_HZ)
    ratio = np.log(run.pressed_ohm / run.rest_ohm)
    presses = Presses(run.force_n, run.position_m, 1 - run.force_n / run.peak_n, np.log10(np.maximum(run.hold_s, 0.1)))
    rest_noise = np.maximum(np.full(m, noise / np.sqrt(AVERAGES * max(len(ratio), 1))), 3e-4)
    single = np.full(ratio.shape, noise * np.sqrt(1 + 1 / AVERAGES))
    return Data(presses, ratio, single, np.log(run.rest_ohm).mean(0), rest_noise)


def none_of(data):
    """Specimen at rest alone, without known presses."""
    return replace(data.rows(np.zeros(0, int)), single=data.noise[0])
