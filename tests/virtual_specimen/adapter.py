"""Sessions of virtual specimens as the package takes them, and the rows of errors that a calibration has to bear."""

from dataclasses import replace

import numpy as np

from sensorgen.analysis.calibration import Bench, spread_of
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.fitting import Data
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel
from sensorgen.prediction.query import Query, Tip
from sensorgen.prediction.sensor_model import sensor_model
from virtual_specimen import TONES_HZ, Truth, drawn, session

ETPU = "etpu@thesis-3.2"  # 1/1.2 ohm m
DESIGN = {
    "shape": "tri", "parameters": {"dielectric_mm": 0.2},
    "materials": {"top_electrode": ETPU, "bottom_electrode": ETPU},
}  # fmt: skip
LIMIT_N = 6.6
CLEAN = Truth()
ERRORS = {  # what is off, as a truth by a seed
    "nothing": lambda _: CLEAN,
    "C +0.3 %": lambda _: replace(CLEAN, capacitance=3e-3),
    "C +1 %": lambda _: replace(CLEAN, capacitance=1e-2),
    "C +8 %, as a print": lambda _: replace(CLEAN, capacitance=8e-2),
    "resistivity +1 %": lambda _: replace(CLEAN, track_ohm_per_m=1.01 * CLEAN.track_ohm_per_m),
    "modulus -20 %": lambda _: replace(CLEAN, stiffness=float(np.log(0.8))),
    "gain +0.1 %": lambda _: replace(CLEAN, gain=(1e-3 + 0j,) * 7),
    "lead 50 ohm": lambda _: replace(CLEAN, lead_ohm=50.0),
    "stray 1 pF": lambda _: replace(CLEAN, stray_f=1e-12),
    "gain 0.3 %, 20 ohm, 0.3 pF, E -5 %": lambda _: replace(
        CLEAN, gain=(3e-3 + 0j,) * 7, lead_ohm=20.0, stray_f=3e-13, stiffness=float(np.log(0.95))
    ),
    "all at once": drawn,
    "all at once, doubled": lambda seed: drawn(seed, 2.0),
    "all, C law of another solver (free faces)": lambda seed: drawn(seed, boundary="free"),
    "all, tip of 8 mm": lambda seed: drawn(seed, tip_m=8e-3),
    "all, noise 0.01 %": lambda seed: drawn(seed, noise=1e-4),
}


def specimen_model():
    """The model of the design that all of them were printed of, without errors of its own."""
    predicted = sensor_model(bodies.drawn(make(DESIGN)), Query(tip=Tip(5e-3)))[0]
    return SpecimenModel(predicted.sensor, TONES_HZ, spread_of(predicted, Bench()))


def data(found, truth):
    """Known presses of a session."""
    ratio = np.log(found.pressed_ohm / found.rest_ohm)
    noise = np.broadcast_to(
        truth.noise * np.array(truth.noise_by_tone) * np.sqrt(1 + 1 / truth.rest_averages), ratio.shape
    )
    presses = Presses(
        found.force_n, found.position_m, 1 - found.force_n / found.peak_n, np.log10(np.maximum(found.hold_s, 0.1))
    )
    rest_noise = truth.noise * np.array(truth.noise_by_tone) / np.sqrt(truth.rest_averages * max(len(ratio), 1))
    return Data(presses, ratio, noise, np.log(found.rest_ohm).mean(0), rest_noise)


def split(truth, known, unknown, seed):
    """A session's known presses and others, in the order of time each."""
    made = session(truth, known + unknown, seed + 1000)
    order = np.random.default_rng(seed).permutation(known + unknown)
    return made.rows(np.sort(order[:known])), made.rows(np.sort(order[known:]))
