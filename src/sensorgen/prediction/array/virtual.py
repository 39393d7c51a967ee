"""A virtual array: frames of a step, with cells that scatter, noise and faults."""

from collections.abc import Sequence
from io import BytesIO

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.design.arrays import Layout
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout, faulty
from sensorgen.solvers.tracks import readings

PEAK_KPA, MEAN_KPA = 357.0, 44.0  # of a foot's map
REST, STEP = 5, 60  # frames
RATE_HZ = 100.0
_SCATTER = 0.05
# Heel, lateral and medial metatarsals, hallux: middle and radius along and across the foot, share of the peak [-]
_LOBES = (
    (0.14, 0.50, 0.10, 0.24, 1.0), (0.66, 0.30, 0.07, 0.20, 0.75), (0.70, 0.68, 0.07, 0.20, 0.9),
    (0.90, 0.74, 0.05, 0.13, 0.8),
)  # fmt: skip


def foot(layout: Layout) -> Real:
    """A foot's map on an array: lobes of the heel, the metatarsals and the hallux, (m, n) [kPa].

    The longer side is the foot's. The peak is ``PEAK_KPA``; an even part brings the mean over the outline near
    ``MEAN_KPA`` where the lobes leave room for it.
    """
    x, y = np.array(layout.x_mm), np.array(layout.y_mm)
    along, across = (x - x[0]) / max(np.ptp(x), 1.0), (y - y[0]) / max(np.ptp(y), 1.0)
    u, v = np.meshgrid(along, across)
    if np.ptp(y) > np.ptp(x):
        u, v = v, u
    lobes = [share * np.exp(-(((u - a) / ra) ** 2) - ((v - b) / rb) ** 2) for a, b, ra, rb, share in _LOBES]
    here = np.array(layout.here)
    shape = np.where(here, np.max(lobes, 0), 0.0)
    shape = shape / shape.max() * PEAK_KPA
    even = max(MEAN_KPA - shape[here].mean(), 0.0)
    return np.where(here, np.maximum(shape, even), 0.0)


def simulated(
    model: ArrayModel, readout: ArrayReadout, pressure_kpa: Real, *, seed: int = 0, scatter: float = _SCATTER,
    faults: Sequence[str] = (),
) -> Complex:  # fmt: skip
    """Frames as an array would give them, of the first frequency, (k, m, n) [S].

    Parameters
    ----------
    model, readout : ArrayModel, ArrayReadout
        The array, and how it is read.
    pressure_kpa : (k, m, n) array
        On the surface [kPa].
    seed : int
        Of scatter and noise.
    scatter : float
        Standard deviation of the capacitance at rest and of its rise, from cell to cell [-].
    faults : sequence of str
        As of :func:`sensorgen.prediction.array.readout.faulty`.
    """
    draw = np.random.default_rng(seed)
    rest, gain = 1 + scatter * draw.normal(size=(2, *model.here.shape))
    found = np.empty(pressure_kpa.shape, complex)
    for k, pressure in enumerate(pressure_kpa):
        rise = (model.under(pressure * 1e3)[0] - 1) * gain
        tracks = faulty(model.tracks(model.capacitances(rest * (1 + rise))), faults, model.here)
        found[k] = readings(tracks, readout.frequency_hz[0], readout=readout.kind, input_ohm=readout.input_ohm).siemens
    sigma = np.hypot(readout.noise * np.abs(found), readout.noise_s)
    return np.asarray(found + sigma * (draw.normal(size=found.shape) + 1j * draw.normal(size=found.shape)))


def step(model: ArrayModel, readout: ArrayReadout, faults: Sequence[str] = ()) -> bytes:
    """Frames at rest and of one step from heel to toe, as NPZ with the true pressures."""
    whole, layout = foot(model.layout), model.layout
    x = np.array(layout.x_mm)
    along = np.broadcast_to((x - x[0]) / max(np.ptp(x), 1.0), whole.shape)
    rolled = [np.clip(1.6 - np.abs(along - t) * 2.0, 0.0, 1.0) for t in np.linspace(0.0, 1.0, STEP)]
    rise = np.sin(np.pi * (np.arange(STEP) + 0.5) / STEP) ** 0.5
    pressure = np.concatenate([np.zeros((REST, *whole.shape)), whole * rolled * rise[:, None, None]])
    target = BytesIO()
    np.savez_compressed(
        target, siemens=simulated(model, readout, pressure, faults=faults), pressure_kpa=pressure,
        time_s=np.arange(len(pressure)) / RATE_HZ, rest=np.arange(len(pressure)) < REST,
        frequency_hz=readout.frequency_hz[0],
    )  # fmt: skip
    return target.getvalue()
