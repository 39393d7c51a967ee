"""Random virtual specimens, calibrated and inverted: which intervals hold the truth."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from sensorgen.analysis.calibration import Bench, spread_of
from sensorgen.design.design import make
from sensorgen.measure.virtual.specimen import PressedSpecimen, VirtualLine, drawn
from sensorgen.prediction import bodies
from sensorgen.prediction.calibration.calibration import inside
from sensorgen.prediction.calibration.fitting import Data, calibrated
from sensorgen.prediction.calibration.inversion import Inverter
from sensorgen.prediction.calibration.materials import estimate, links
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel
from sensorgen.prediction.query import Query, Tip
from sensorgen.prediction.sensor_model import sensor_model

ETPU = "etpu@thesis-3.2"
DESIGN = {
    "shape": "tri", "parameters": {"dielectric_mm": 0.2},
    "materials": {"top_electrode": ETPU, "bottom_electrode": ETPU},
}  # fmt: skip
TONES_HZ = np.array([1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3])
NOISE = 3e-5 * np.array(
    [9.1, 6.2, 4.2, 3.3, 2.5, 1.3, 1.0]
)  # of a mean over a second; by tone as of Table 5.1's weights
GAIN, PHASE_DEG = 5e-3, 0.2  # of the bridge, standard deviations per tone
AGE_S, PAUSE_S, TIP_M = 5.0, 20.0, 5e-3
KNOWN, NEW, LIMIT_N = 30, 20, 6.6
LEVELS = (0.9, 0.95)


@cache
def model():
    """What is predicted of the design, and how its values hang together with the parameters."""
    predicted = sensor_model(bodies.estimated(make(DESIGN)), Query(tip=Tip(TIP_M)))[0]
    return SpecimenModel(predicted.sensor, TONES_HZ, spread_of(predicted, Bench(TIP_M))), links(predicted)


@dataclass(frozen=True)
class Outcome:
    """Of one specimen: by quantity and level, whether intervals hold the truth, and their widths."""

    held: dict
    width: dict


def session(specimen, count, seed):
    """Random presses, half of them after a higher one, held for 0.3 to 30 s: ratios to the rest before, and rest."""
    rng = np.random.default_rng([seed, 2])
    truth, line = specimen.truth, VirtualLine(specimen, TONES_HZ)

    def spread():
        return (rng.permutation(count) + rng.random(count)) / count

    force = 0.3 + 5.7 * spread()
    place = TIP_M / 2 + (specimen.length_m - TIP_M) * spread()
    back = rng.permutation(count) < count // 2
    peak = np.where(back, force + (6.6 - force) * rng.random(count), force)
    hold = 0.3 * 100 ** spread()
    end = np.cumsum(hold + PAUSE_S)
    drift = _drift(np.stack([end - hold - AGE_S, end], -1).ravel(), truth.drift_s, rng).reshape(count, 2, 2)
    gain = np.exp(rng.normal(0, GAIN, 7) + 1j * np.deg2rad(rng.normal(0, PHASE_DEG, 7)))
    scale = np.array([truth.drift_c, truth.drift_r])
    rest, under = np.empty((2, count, 7), complex)
    for k in range(count):
        ends = specimen.patch(place[k])
        lift = specimen.rise(force[k], ends[1] - ends[0], 1 - force[k] / peak[k], float(np.log10(max(hold[k], 0.1))))
        rest[k] = line.impedance(0.0, (0.0, 0.0), *(drift[k, 0] * scale))
        under[k] = line.impedance(lift, ends, *(drift[k, 1] * scale))
    noisy = [z * gain * (1 + NOISE * (rng.normal(size=z.shape) + 1j * rng.normal(size=z.shape))) for z in (rest, under)]
    presses = Presses(force, place, 1 - force / peak, np.log10(hold))
    ratio = np.log(noisy[1] / noisy[0])
    mean = np.log(noisy[0]).mean(0)
    return Data(presses, ratio, np.broadcast_to(NOISE * 2**0.5, ratio.shape), mean, np.full(7, 3e-4))


def _drift(time_s, forgotten_s, rng):
    """Two wanders at times that rise, normal at each, that forget."""
    found = np.empty((len(time_s), 2))
    value = rng.standard_normal(2)
    for k, gap in enumerate(np.diff(time_s, prepend=time_s[0])):
        keep = np.exp(-gap / forgotten_s)
        value = keep * value + np.sqrt(1 - keep**2) * rng.standard_normal(2)
        found[k] = value
    return found


def outcome(seed):
    """One random specimen, from press to verdict."""
    expected, to_material = model()
    specimen = PressedSpecimen(make(DESIGN), drawn(make(DESIGN), seed), TIP_M)
    data = session(specimen, KNOWN + NEW, seed)
    which = np.random.default_rng([seed, 3]).permutation(KNOWN + NEW)
    posterior = calibrated(expected, data.rows(np.sort(which[:KNOWN])))
    held, width = {}, {}
    for link in to_material:
        found, true = estimate(expected, posterior, link), specimen.values()[link.quantity]
        for level in LEVELS:
            low, high = found.interval(level)
            held[link.quantity, level] = [low <= true <= high]
            width[link.quantity, level] = np.log(high / low)
    new = data.rows(np.sort(which[KNOWN:]))
    inverter = Inverter(expected, posterior, force_limit_n=LIMIT_N)
    for inverter.level in LEVELS:
        level, found = inverter.level, inverter.batch(new.ratio)
        force, position = inside(found, new.presses)
        held["F", level], held["x", level] = force.tolist(), position.tolist()
        width["F", level] = np.median(np.ptp(found.force_90_n, axis=1))
        width["x", level] = 1e3 * np.median(np.ptp(found.position_90_m, axis=1))
    return Outcome(held, width)
