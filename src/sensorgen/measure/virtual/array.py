"""Virtual array: a print with scatter, faults, play, creep, drift and noise, walked on; its network is solved.

No code of the inversion: the network is a sparse matrix of all nodes and terminals, :func:`closing` a law of its own.
Loads are maps of pressure on the surface [kPa].
Frames are sent as lines of text.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from io import BytesIO

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.design.arrays import ArrayLayout
from sensorgen.measure.lab.frame_stream import QUESTION, FrameForm
from sensorgen.measure.virtual.plant import Simulator
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout, faulty
from sensorgen.solvers.tracks import Tracks

PEAK_KPA, MEAN_KPA = 357.0, 44.0  # of a foot's map
REST, STEP = 5, 60  # frames
RATE_HZ = 100.0
_SCATTER = 0.05
_FULL_KPA = 100.0
_CREEP_S = 100.0
_LEAK_S = 1e-15  # of every node to ground: a node that nothing joins has a potential
# Heel, lateral and medial metatarsals, hallux: middle and radius along and across the foot, share of the peak [-]
_LOBES = (
    (0.14, 0.50, 0.10, 0.24, 1.0), (0.66, 0.30, 0.07, 0.20, 0.75), (0.70, 0.68, 0.07, 0.20, 0.9),
    (0.90, 0.74, 0.05, 0.13, 0.8),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class WalkedStep:
    """One step over an array.

    Attributes
    ----------
    pressure_kpa : (k, m, n) array
        Mean over the square of each crossing [kPa].
    centre_mm : (k, 2) array
        Centre of pressure of what lies on the squares, by points in each; nan without load [mm].
    """

    pressure_kpa: Real
    centre_mm: Real


def foot(layout: ArrayLayout, fine: int = 1) -> Real:
    """A foot's map on an array: lobes of the heel, the metatarsals and the hallux, (m fine, n fine) [kPa].

    The longer side is the foot's. The peak is ``PEAK_KPA``; an even part brings the mean over the outline near
    ``MEAN_KPA`` where the lobes leave room for it. ``fine``: points along each side of a square.
    """
    (x, y), (along, across) = points(layout, fine), (np.array(layout.x_mm), np.array(layout.y_mm))
    u, v = np.meshgrid((x - along[0]) / max(np.ptp(along), 1.0), (y - across[0]) / max(np.ptp(across), 1.0))
    if np.ptp(across) > np.ptp(along):
        u, v = v, u
    lobes = [share * np.exp(-(((u - a) / ra) ** 2) - ((v - b) / rb) ** 2) for a, b, ra, rb, share in _LOBES]
    here = np.kron(np.array(layout.here), np.ones((fine, fine))) > 0
    shape = np.where(here, np.max(lobes, 0), 0.0)
    shape = shape / shape.max() * PEAK_KPA
    even = max(MEAN_KPA - shape[here].mean(), 0.0)
    return np.where(here, np.maximum(shape, even), 0.0)


def points(layout: ArrayLayout, fine: int) -> tuple[Real, Real]:
    """Middles of the parts of all squares along x and y [mm]."""
    parts = (np.arange(fine) + 0.5) / fine - 0.5
    sides = zip((layout.x_mm, layout.y_mm), layout.params.pitch, strict=True)
    x, y = ((np.array(at)[:, None] + pitch * parts).ravel() for at, pitch in sides)
    return x, y


def walked(layout: ArrayLayout, fine: int = 1, frames: int = STEP) -> WalkedStep:
    """One step from heel to toe."""
    whole, (x, y) = foot(layout, fine), points(layout, fine)
    along = np.broadcast_to((x - x[0]) / max(np.ptp(x), 1.0), whole.shape)
    if np.ptp(y) > np.ptp(x):
        along = np.broadcast_to(((y - y[0]) / max(np.ptp(y), 1.0))[:, None], whole.shape)
    m, n = np.array(layout.here).shape
    maps, centres = np.zeros((frames, m, n)), np.full((frames, 2), np.nan)
    for k, t in enumerate(np.linspace(0.0, 1.0, frames)):
        rise = np.sin(np.pi * (k + 0.5) / frames) ** 0.5
        load = whole * np.clip(1.6 - np.abs(along - t) * 2.0, 0.0, 1.0) * rise
        maps[k] = load.reshape(m, fine, n, fine).mean((1, 3))
        if total := load.sum():
            centres[k] = (load.sum(0) @ x) / total, (load.sum(1) @ y) / total
    return WalkedStep(maps, centres)


@dataclass(frozen=True, eq=False)
class VirtualArray:
    """One print.

    Attributes
    ----------
    tracks : Tracks
        Its network at rest.
    rise : callable
        C/C0 - 1 of every crossing by the pressure that it feels, (m, n) [kPa].
    spread : callable
        Pressures that crossings carry under the cover by those on the surface, (k, m, n) [kPa].
    play : float
        By which unloading lags behind loading, half of it each way, over the largest pressure before [-].
    creep : float
        Share of the pressure that is felt with a delay of 100 s only [-].
    drift : float
        Of the gain [1/d].
    """

    tracks: Tracks
    rise: Callable[[Real], Real]
    spread: Callable[[Real], Real]
    play: float = 0.0
    creep: float = 0.0
    drift: float = 0.0

    def frames(
        self, pressure_kpa: Real, time_s: Real, readout: ArrayReadout, draw: np.random.Generator, day: float = 0.0
    ) -> Complex:
        """Frames under loads, (k, m, n), by the first frequency [S]."""
        pressure_kpa = self.spread(pressure_kpa)
        siemens = np.empty(pressure_kpa.shape, complex)
        play = slow = most = np.zeros(pressure_kpa.shape[1:])
        for k, (load, elapsed) in enumerate(zip(pressure_kpa, np.diff(time_s, prepend=time_s[0]), strict=True)):
            most = np.maximum(most, load)
            play = np.clip(play, load - self.play * most, load + self.play * most)
            slow = slow + (load - slow) * -np.expm1(-elapsed / _CREEP_S)
            felt = (1 - self.creep) * (load + play) / 2 + self.creep * slow
            ratio = 1 + np.exp(self.drift * day) * self.rise(felt)
            siemens[k] = nodal(self.tracks, self.tracks.capacitance_f * ratio, readout)
        sigma = np.hypot(readout.noise * np.abs(siemens), readout.noise_s)
        return np.asarray(siemens + sigma * (draw.normal(size=siemens.shape) + 1j * draw.normal(size=siemens.shape)))


def closing(strain: Real, power: Real) -> Callable[[Real], Real]:
    """Rise of cells whose gap closes by a power of the pressure: strain at 100 kPa, (m, n) each."""

    def rise(kpa: Real) -> Real:
        closed = np.minimum(strain * np.maximum(kpa / _FULL_KPA, 0.0) ** power, 0.8)
        return np.asarray(closed / (1 - closed))

    return rise


def printed(
    model: ArrayModel, seed: int, scatter: float = _SCATTER, faults: Sequence[str] = (), *,
    stiffness: float = 1.0, play: float = 0.0, creep: float = 0.0, drift: float = 0.0, own_law: bool = False,
) -> VirtualArray:  # fmt: skip
    """A print of an array.

    Parameters
    ----------
    model : ArrayModel
        Its prediction, of which the resistances are taken, and what a crossing reads at rest and at 100 kPa.
    seed : int
        Of its scatter.
    scatter : float
        Standard deviation of the capacitance at rest and of its rise, from cell to cell [-].
    faults : sequence of str
        As of :func:`sensorgen.prediction.array.readout.faulty`.
    stiffness : float
        Of the print over the predicted one, with ``own_law`` [-].
    play, creep, drift : float
        As of :class:`VirtualArray`.
    own_law : bool
        Whether cells close by :func:`closing`; else by the predicted law.
    """
    shape, draw = model.here.shape, np.random.default_rng(seed)
    rest, gain = 1 + scatter * draw.normal(size=(2, *shape))
    tracks = faulty(model.tracks(model.capacitances(rest)), faults, model.here)

    def predicted(kpa: Real) -> Real:
        return np.asarray(gain * (model.under(kpa * 1e3)[0] - 1))

    if not own_law:
        return VirtualArray(tracks, predicted, model.carried, play, creep, drift=drift)
    at_full = float(model.under(np.array(_FULL_KPA * 1e3))[0]) - 1
    power = 0.95 + 0.02 * draw.normal(size=shape)
    own = closing(gain * at_full / (1 + at_full) / stiffness, power)
    return VirtualArray(tracks, own, model.carried, play, creep, drift=drift)


def nodal(tracks: Tracks, capacitance_f: Real, readout: ArrayReadout) -> Complex:
    """Readings by a sparse matrix of all nodes and terminals, (m, n) [S]."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import splu

    (m, n), w = capacitance_f.shape, 2j * np.pi * readout.frequency_hz[0]
    row = np.arange(m * n).reshape(m, n)
    column = row + m * n
    rows, columns = 2 * m * n + np.arange(m), 2 * m * n + m + np.arange(n)
    ends = [
        (row, column, w * capacitance_f * (1 - 1j * tracks.tan_delta) + tracks.leak_s),
        (row[:, :-1], row[:, 1:], 1 / tracks.row_ohm), (column[:-1], column[1:], 1 / tracks.column_ohm),
        (rows, row[np.arange(m), tracks.row_end], 1 / np.maximum(tracks.row_lead_ohm, 1e-9)),
        (columns, column[tracks.column_end, np.arange(n)], 1 / np.maximum(tracks.column_lead_ohm, 1e-9)),
    ]  # fmt: skip
    one, other, y = (np.concatenate([np.ravel(end[k]) for end in ends]) for k in range(3))
    terminals = np.concatenate([rows, columns])
    guarded = readout.kind == "guarded"
    ground = np.full(len(terminals), 1 / readout.input_ohm if guarded else _LEAK_S)
    count = 2 * m * n + m + n
    at = np.concatenate([one, other, one, other, terminals, np.arange(2 * m * n)])
    to = np.concatenate([one, other, other, one, terminals, np.arange(2 * m * n)])
    matrix = coo_array(
        (np.concatenate([y, y, -y, -y, ground, np.full(2 * m * n, _LEAK_S)]), (at, to)), shape=(count, count)
    )
    driven = np.zeros((count, len(terminals)), complex)
    driven[terminals, np.arange(len(terminals))] = 1.0
    ohm = splu(matrix.tocsc()).solve(driven[:, :m] if guarded else driven)[terminals]
    if guarded:
        return np.asarray(ohm[m:].T / readout.input_ohm**2)
    own = np.diag(ohm)
    return np.asarray(1 / (own[:m, None] + own[m:] - ohm[:m, m:] - ohm[m:, :m].T))


def simulated(
    model: ArrayModel, readout: ArrayReadout, pressure_kpa: Real, *, seed: int = 0, scatter: float = _SCATTER,
    faults: Sequence[str] = (),
) -> Complex:  # fmt: skip
    """Frames of a print by the predicted law, (k, m, n) [S]."""
    print_, time_s = printed(model, seed, scatter, faults), np.arange(len(pressure_kpa)) / RATE_HZ
    return print_.frames(pressure_kpa, time_s, readout, np.random.default_rng([seed, 1]))


def step(model: ArrayModel, readout: ArrayReadout, faults: Sequence[str] = ()) -> bytes:
    """Frames at rest and of one step from heel to toe, as NPZ with the true pressures."""
    true = walked(model.layout).pressure_kpa
    pressure = np.concatenate([np.zeros((REST, *model.here.shape)), true])
    return packed(
        siemens=simulated(model, readout, pressure, faults=faults), pressure_kpa=pressure,
        time_s=np.arange(len(pressure)) / RATE_HZ, rest=np.arange(len(pressure)) < REST,
        frequency_hz=readout.frequency_hz[0],
    )  # fmt: skip


def packed(**content: object) -> bytes:
    """Arrays as NPZ."""
    target = BytesIO()
    np.savez_compressed(target, **content)  # type: ignore[arg-type]
    return target.getvalue()


REST_S = 3.0  # unloaded at the begin
_STEP_S, _SWING_S = 0.6, 0.4  # of each step
_SETTLED = 2  # steps until play and creep repeat
_HEADER_S, _HOUR_S = 10.0, 3600.0
_DRIFT = 1e-3  # of all readings, in an hour


class FrameSender(Simulator):
    """Device that sends a frame whenever one is due: first at rest, then a step each second.

    Parameters
    ----------
    rest, step : (m, n), (k, m, n) array
        Readings without noise [S].
    readout : ArrayReadout
        Of the noise.
    rate_hz : float
        Frames per second.
    form : str
        "capacitance" or "siemens".

    Attributes
    ----------
    fault : str
        Also "damaged": each line loses bytes.
    """

    def __init__(
        self, rest: Complex, step: Complex, readout: ArrayReadout, rate_hz: float, form: str = "capacitance"
    ) -> None:
        super().__init__(self)  # type: ignore[arg-type]  # no other mechanism
        m, n = rest.shape
        self.form = FrameForm(m, n, form, "n" if form == "siemens" else "p", readout.frequency_hz[0])
        self._rest, self._walk, self._readout, self._rate_hz = rest, step, readout, rate_hz
        self._draw, self._begun_s, self._sent, self._header_s = np.random.default_rng(0), np.nan, 0, -np.inf

    def advance(self, time_s: float) -> None:
        """Begin with the first message."""
        self._begun_s = time_s if np.isnan(self._begun_s) else self._begun_s

    def _take(self, line: bytes) -> None:
        if line + b"\n" == QUESTION:
            self._out += self.form.header()

    def _step(self) -> None:
        if self._now_s - self._header_s >= _HEADER_S:
            self._out, self._header_s = self._out + self.form.header(), self._now_s
        due = int((self._now_s - self._begun_s) * self._rate_hz + 1e-6)
        for number in range(max(self._sent, due - int(self._rate_hz)), due):  # nobody listened: frames are lost
            line = self.form.frame(number, number / self._rate_hz, self._siemens(number))
            self._out += line[: len(line) // 3] + line[len(line) // 2 :] if self.fault == "damaged" else line
        self._sent = max(self._sent, due)

    def _siemens(self, number: int) -> Complex:
        since = number - round(REST_S * self._rate_hz)
        clean = self._rest if since < 0 else self._walk[since % len(self._walk)]
        clean = clean * (1 + _DRIFT * number / self._rate_hz / _HOUR_S)
        noise = self._draw.normal(size=clean.shape) + 1j * self._draw.normal(size=clean.shape)
        return np.asarray(clean + np.where(clean == 0, 0.0, self._readout.sigma_s(clean)) * noise)


def sender(
    model: ArrayModel, readout: ArrayReadout, rate_hz: float, *, seed: int = 0, faults: Sequence[str] = ()
) -> FrameSender:  # fmt: skip
    """Device on a print with scatter, hysteresis, creep, drift, noise and faults, of a law of its own."""
    print_ = printed(model, seed, faults=faults, own_law=True, play=0.02, creep=0.02)
    maps = walked(model.layout, frames=max(2, round(_STEP_S * rate_hz))).pressure_kpa
    cycle = np.concatenate([maps, np.zeros((max(1, round(_SWING_S * rate_hz)), *maps.shape[1:]))])
    load = np.concatenate([0 * cycle[:1], *[cycle] * _SETTLED])
    quiet = replace(readout, noise=1e-15, noise_s=0.0)
    siemens = print_.frames(load, np.arange(len(load)) / rate_hz, quiet, np.random.default_rng(0))
    return FrameSender(siemens[0], siemens[-len(cycle) :], readout, rate_hz)
