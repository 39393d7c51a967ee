"""Readout of an array: noise, information of its readings on every crossing, frames per second, faults."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real, Whole
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.prediction.array.model import SHORT_OHM, ArrayModel
from sensorgen.solvers.tracks import CrossingReadings, Tracks, readings
from sensorgen.solvers.tracks import Readout as Kind

MOST_DENSE = 2000  # crossings of which the information is a whole matrix; beyond, each crossing as if it were alone
FULL_SCALE_PA = 1103e3  # prior standard deviation of a pressure: full scale of a Tekscan HR mat 7101E
_TAUS = 7.0  # time constants of the slowest track until a reading is within 0.1 %
_PERIODS = 10.0  # of the lowest frequency that a reading takes
_LOOSE = 2  # crossings at the end of a track that read nothing, where it is broken
_SHORT, _BREAK = re.compile(r"r(\d+)c(\d+)"), re.compile(r"([rc])(\d+):(\d+)")


@dataclass(frozen=True)
class ArrayReadout:
    """Readout of an array.

    Attributes
    ----------
    kind : str
        "guarded" or "two-terminal".
    input_ohm : float
        Of each terminal, guarded [ohm].
    frequency_hz : tuple of float
        Tones, read at once [Hz].
    noise : float
        Standard deviation of the real and of the imaginary part of a reading, relative to its magnitude [-].
    noise_s : float
        The same, absolute [S].
    """

    kind: Kind = "guarded"
    input_ohm: float = 50.0
    frequency_hz: tuple[float, ...] = (10e3,)
    noise: float = 1e-3
    noise_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse readings without noise, and no frequency."""
        if not (self.noise >= 0 and self.noise_s >= 0 and self.noise + self.noise_s > 0):
            raise OutOfRange(f"noise {self.noise:g} and {self.noise_s:g} S; expected one above 0")
        if not self.frequency_hz:
            raise OutOfRange("no frequency; expected one or more")

    def read(self, tracks: Tracks) -> list[CrossingReadings]:
        """Readings of a network at each frequency."""
        return [readings(tracks, f, readout=self.kind, input_ohm=self.input_ohm) for f in self.frequency_hz]

    def sigma_s(self, siemens: Complex | Real) -> Real:
        """Standard deviation of real and imaginary parts [S]; infinite of readings that are nothing."""
        sigma = np.hypot(self.noise * np.abs(siemens), self.noise_s)
        return np.where(np.abs(siemens) > 0, sigma, np.inf)

    def frame_s(self, model: ArrayModel) -> float:
        """Time of a frame: settling and ten periods for each row, columns at once; of each crossing by two terminals.

        Settling is seven time constants of the slowest track: its resistance to the far end times its capacitance.
        """
        m, n = model.here.shape
        tau = max(wire.end_ohm for wire in model.wires()) * model.capacitance.value * max(m, n)
        return float((_TAUS * tau + _PERIODS / min(self.frequency_hz)) * (m if self.kind == "guarded" else m * n))


def information(
    read: Sequence[CrossingReadings], readout: ArrayReadout, here: Mask,
    whole: "Sequence[CrossingReadings] | None" = None,
) -> Real:  # fmt: skip
    """Information of all readings on the capacitances, (m n, m n); beyond ``MOST_DENSE`` its diagonal, (m n,) [1/F2].

    The diagonal is that of each crossing by its own reading: what others contribute and take is left out. Noise is not
    less than that of the ``whole`` array, and crossings outside the outline are not read: their readings are nearly
    nothing, and noise relative to that would be, too.
    """
    both = zip(read, whole or read, strict=True)
    sizes = [np.where(here, np.maximum(np.abs(one.siemens), np.abs(of.siemens)), 0.0) for one, of in both]
    m, n = read[0].siemens.shape
    if m * n > MOST_DENSE:
        total = np.zeros((m, n))
        for one, size in zip(read, sizes, strict=True):
            own = np.abs(one.own_slopes()) / readout.sigma_s(size)
            total += own**2
        return total.ravel()
    found = np.zeros((m * n, m * n))
    for one, size in zip(read, sizes, strict=True):
        slopes = one.matrix() / readout.sigma_s(size).reshape(-1, 1)
        found += slopes.real.T @ slopes.real + slopes.imag.T @ slopes.imag
    return found


def covariance(found: Real, prior_f: Real) -> Real:
    """Covariance of the capacitances after a reading, or the variances alone [F2].

    Parameters
    ----------
    found : (k, k) or (k,) array
        Of :func:`information` [1/F2].
    prior_f : (k,) array
        Standard deviation before [F].
    """
    before = 1 / prior_f**2
    return np.asarray(1 / (found + before) if found.ndim == 1 else np.linalg.inv(found + np.diag(before)))


def crosstalk(read: CrossingReadings) -> Real:
    """Largest effect of another crossing on each reading, relative to that of its own, (m, n) [-]."""
    found = np.empty(read.siemens.shape)
    own = np.abs(read.own_slopes())
    for i, j in np.ndindex(*found.shape):
        others = np.abs(read.slopes(i, j))
        others[i, j] = 0.0
        found[i, j] = others.max() / own[i, j] if own[i, j] else np.inf
    return found


def faulty(tracks: Tracks, faults: Iterable[str], here: Mask) -> Tracks:
    """A network with faults: ``r3:5`` breaks row 3 behind column 5 (0: its lead), ``r2c4`` shorts that crossing.

    Raises
    ------
    BadInput
        A word that is none of these, a track that the array has not, or a place that its outline
        leaves out, ``here`` being its crossings.
    """
    for word in dict.fromkeys(faults):
        tracks = _with_fault(tracks, word, here)
    return tracks


def _with_fault(tracks: Tracks, word: str, here: Mask) -> Tracks:
    m, n = tracks.capacitance_f.shape
    if short := _SHORT.fullmatch(word):
        i, j = (int(number) - 1 for number in short.groups())
        if 0 <= i < m and 0 <= j < n:
            _refuse_outside(word, bool(here[i, j]))
            return tracks.shorted(i, j, SHORT_OHM)
    if cut := _BREAK.fullmatch(word):
        track, after = int(cut[2]) - 1, int(cut[3])
        count, length = (m, n) if cut[1] == "r" else (n, m)
        if 0 <= track < count and after < length:
            broken = tracks.broken("row" if cut[1] == "r" else "column", track, after - 1)
            _refuse_outside(word, _stretches(broken) < _stretches(tracks))
            return broken
    raise BadInput(
        f"fault {word!r:.40}: expected r3:5 (row 3 broken behind column 5; :0 its lead), c2:1, or r2c4 (a short), of "
        f"{m} rows and {n} columns"
    )


@dataclass(frozen=True, eq=False)
class _LooseEnd:
    """Crossings from some place to an end of a track, all dead: of ``side``, ``track``, broken after ``after``."""

    side: Literal["row", "column"]
    track: int
    after: int
    lost: Mask
    """(m, n): the crossings."""

    def rank(self, unexplained: Mask) -> tuple[bool, int]:
        """Number of dead crossings that it explains; whole tracks before parts of others."""
        count = int((self.lost & unexplained).sum())
        return (self.after < 0 and count >= _LOOSE), count


def broken_where_dead(tracks: Tracks, here: Mask, dead: Mask) -> Tracks:
    """A network whose tracks are broken where all crossings from some place to an end of a track are dead.

    The loose part still joins what crosses it: beside a short, crossings read each other's loads through it. Crossings
    that one break explains count for no other; of a single dead crossing nothing is joined.

    Parameters
    ----------
    tracks : Tracks
        Without breaks.
    here, dead : (m, n) array of bool
        Crossings of the array, and those that read nothing.
    """
    unexplained = here & dead
    while True:
        ends = [*_loose_ends(tracks, here, dead, unexplained)]
        most = max(ends, key=lambda end: end.rank(unexplained), default=None)
        if most is None or most.rank(unexplained)[1] < _LOOSE:
            return tracks
        tracks = tracks.broken(most.side, most.track, most.after)
        unexplained = unexplained & ~most.lost


def _loose_ends(tracks: Tracks, here: Mask, dead: Mask, unexplained: Mask) -> Iterator[_LooseEnd]:
    """Loose ends of all tracks, each from its first crossing on that nothing explains yet."""
    sides: tuple[tuple[Literal["row", "column"], Mask, Mask, Mask, Whole], ...] = (
        ("row", here, dead, unexplained, tracks.row_end),
        ("column", here.T, dead.T, unexplained.T, tracks.column_end),
    )
    for side, of, off, left, leads in sides:
        for track in np.flatnonzero(left.any(1)).tolist():
            at, lead = np.flatnonzero(of[track]), int(leads[track])
            if off[track, at].all():
                parts = [(at, -1)]
            else:
                parts = []
                for out, before in ((at[at > lead], 1), (at[at < lead][::-1], 0)):
                    alive = np.flatnonzero(~off[track, out])
                    tail = out[alive[-1] + 1 if alive.size else 0 :]
                    if left[track, tail].any():
                        tail = tail[left[track, tail].argmax() :]
                        parts.append((tail, int(tail[0]) - before))
            for crossings, after in parts:
                lost = np.zeros(of.shape, bool)
                lost[track, crossings] = True
                yield _LooseEnd(side, track, after, lost if side == "row" else lost.T)


def _stretches(tracks: Tracks) -> int:
    """Number of stretches and leads that conduct."""
    ohm = (tracks.row_ohm, tracks.column_ohm, tracks.row_lead_ohm, tracks.column_lead_ohm)
    return sum(int(np.isfinite(each).sum()) for each in ohm)


def _refuse_outside(word: str, is_there: bool) -> None:
    if not is_there:
        raise BadInput(f"fault {word}: the outline leaves this place out; expected a crossing or stretch of the array")
