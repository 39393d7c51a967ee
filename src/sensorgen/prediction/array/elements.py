r"""Calibration of an array's elements over sessions: pressure by reading, with one prior over the print.

With x the reading of element e less that of its unloaded seconds (tare of the session), and z its exponentially
weighted past:

.. math:: p_e = e^{d t} (\theta_{e1} x + \theta_{e2} x^2 + \theta_{e3} x^3 + \theta_{e4} z), \quad
          \theta_e \sim N(\mu, \Sigma)

d is a slow drift of the gain, t the day. mu, Sigma and the noise follow by EM (empirical Bayes), so that elements with
few data take the print's law. A total force is a sum over elements, and so linear in the same parameters. Presses of
a line's specimen are nonlinear in a few parameters of one body (:mod:`sensorgen.prediction.calibration`); here some
thousand parameters are linear, and exchangeable between elements.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import BadInput

TARE_S = 20.0  # unloaded seconds of a session that are its tare
UNLOADED = 0.01  # of the largest reference: less is no load
_SHAPES = 3  # powers of x
_EM = 25
_RATE, _GAIN = 0.005, 0.01  # standard deviation of drifts before any data [1/d], least of gains between sessions
_ROUNDS = 2  # of laws and drift in turn
_EFFECTIVE = 20.0  # at least, samples of a session
_RESPONDS = 0.5  # share of the variance of a reference that a live element's reading explains
_N_PER_KPA_MM2 = 1e-3
_PART = 0.9  # of what an element's readings tell, at most, that is taken for noise
_LONG_S = 5.0  # from a frame to the next: longer is doubtful
_RECOVERY_S, _FACTOR = 100.0, 3.0  # of the decay of what an earlier load left, and what it may be off
_TIMES_S = np.geomspace(1.0, 400.0, 25)  # that are tried
_COMMON = 4.0  # square of what is common to elements and lasts, over what the best of these times leaves
_FALLS, _RESTS_S, _TELL = 4.0, 5.0, 6  # standard errors, seconds of rest, and elements, that tell of a fall at rest
_JUMP_S, _NEAR, _SAMPLES = 0.1, 2, 11  # of a window, its frames on either side at least, and those that are looked at
_JUMP, _JUMPS, _FEW = 0.15, 0.01, 4  # of what elements span; share of the frames, and frames, that may jump by it
_ALIKE = 1 / 3  # of the elements with a load, that jump at once: more is the load
_MOST_FRAMES, _LOT = 10_000, 64  # in the middle of a recording, and elements, that are looked at together
_MEDIAN = 1.858  # standard error of a Gaussian sample's median, over its median deviation and root of its size
_NOISES, _STEPS = 6.0, 1.5  # standard deviations of noise, and steps of whole counts, that are no jump


@dataclass
class Past:
    """State of the memory after earlier frames of a recording; further frames go on from it, and change it.

    Attributes
    ----------
    time_s : float
        Of the last frame; nan before the first [s].
    reading, lagged : (n,) array
        Last reading of each element that is known, and weighted past.
    most, play : (n,) array
        Largest reading before, and the reading with a play, of :func:`behind`.
    """

    time_s: float = np.nan
    reading: "Real | float" = np.nan
    lagged: "Real | float" = 0.0
    most: "Real | float" = 0.0
    play: "Real | float" = 0.0


@dataclass(frozen=True, eq=False)
class ArraySession:
    """Recording of one session.

    Attributes
    ----------
    name : str
        For messages.
    day : float
        Since any day on [d].
    time_s : (k,) array
        Of each frame [s].
    reading : (k, n) array
        Of each element, in any unit; nan where one is missing or saturated.
    rest : (k,) array of bool
        Frames with nothing on the array, as marked.
    pressure_kpa : (k, n) array
        Reference of each element; nan where none is known [kPa].
    force_n : (k,) array
        Reference of the total force; nan where none is known [N].
    area_mm2 : float
        Of an element [mm2].
    names : tuple of str
        Of the elements; none where they are numbered.
    past : Past, optional
        Of the frames before these.
    """

    name: str
    day: float
    time_s: Real
    reading: Real
    rest: Mask
    pressure_kpa: Real
    force_n: Real
    area_mm2: float = 100.0
    names: tuple[str, ...] = ()
    past: "Past | None" = None

    def matched(self, names: Sequence[str]) -> "ArraySession":
        """The session with its elements in an order of names; as it is where either has none.

        Raises
        ------
        BadInput
            Other elements.
        """
        if not (names and self.names) or tuple(names) == self.names:
            return self
        if odd := [*sorted({*names} - {*self.names}), *sorted({*self.names} - {*names})]:
            raise BadInput(
                f"{self.name}: {odd[0]} is an element here or in the calibration alone; expected {len(names)}, "
                f"{names[0]} to {names[-1]}"
            )
        order = [self.names.index(name) for name in names]
        return replace(
            self, names=tuple(names), reading=self.reading[:, order], pressure_kpa=self.pressure_kpa[:, order]
        )

    @cached_property
    def unloaded(self) -> Mask:
        """First unloaded seconds: as marked, else where the reference is nothing.

        Raises
        ------
        BadInput
            Neither is known.
        """
        free = self.rest
        if not free.any():
            free = _nothing(self.force_n)
        if not free.any():
            known = np.isfinite(self.pressure_kpa).all(1)
            free = known & _nothing(np.where(known, np.abs(np.nan_to_num(self.pressure_kpa)).max(1), np.nan))
        if not free.any():
            raise BadInput(
                f"{self.name}: no unloaded second; expected 'rest' with 1 in some, or a reference of 0: a standing "
                "load is never taken for rest"
            )
        first = self.time_s[free.argmax()]
        return np.asarray(free & (self.time_s <= first + TARE_S))

    @cached_property
    def tare(self) -> Real:
        """Mean unloaded reading of each element, (n,); nan of one without any."""
        return _mean(self.reading[self.unloaded])

    @cached_property
    def flickers(self) -> Mask:
        """Elements that flicker, (n,)."""
        return flickering(self.time_s, self.reading)

    def steady(self) -> "ArraySession":
        """The session without the readings of elements that flicker; itself where none does.

        Raises
        ------
        BadInput
            All do.
        """
        if not self.flickers.any():
            return self
        if self.flickers[np.isfinite(self.reading).any(0)].all():
            raise BadInput(
                f"{self.name}: all elements jump and come back within {_JUMP_S:g} s; expected time_s in seconds"
            )
        return replace(self, reading=np.where(self.flickers, np.nan, self.reading))

    @cached_property
    def _at_rest(self) -> Whole:
        """Numbers of the frames of the first unloaded stretch."""
        of = np.flatnonzero(self.unloaded)
        return np.split(of, np.flatnonzero(np.diff(of) > 1) + 1)[0]

    @cached_property
    def falls(self) -> float:
        """Rate at which all readings fall at rest towards those without load [1/s]; 0 where they do not.

        A rest that begins the recording, and whose readings fall together, follows an earlier load on all of them.
        """
        time_s = self.time_s[self._at_rest]
        if time_s[0] > self.time_s[0] + _RESTS_S or np.ptp(time_s) < _RESTS_S:
            return 0.0
        away = time_s - time_s.mean()
        x = (self.reading - self.tare)[self._at_rest]
        x = x[:, np.isfinite(x).all(0)]
        if x.shape[1] < _TELL:
            return 0.0
        slopes = away @ x / (away @ away)
        rate = float(np.median(slopes))
        own = float(np.median(np.abs(slopes - rate))) * _MEDIAN / np.sqrt(slopes.size)
        common = float(np.std(np.median(x, 1) - rate * away)) / np.sqrt(away @ away)
        above = _mean(self.reading - self.tare)
        loaded = above[np.nanargmax(np.abs(above))]
        return rate if abs(rate) > _FALLS * np.hypot(own, common) and rate * loaded < 0 else 0.0

    @cached_property
    def recovery(self) -> tuple[Real, Real]:
        """Reading above the tare that an earlier load left, and its error, (k, 1): as it decays, and is below after.

        The median over elements at rest tells the time of the decay, which before is 100 s up to a factor of 3; what
        both leave open is in the error.
        """
        nothing = np.zeros((len(self.time_s), 1))
        if not self.falls:
            return nothing, nothing
        rest = (self.reading - self.tare)[self._at_rest]
        y = np.median(rest[:, np.isfinite(rest).all(0)], 1)
        decays = np.exp(-(self.time_s - self.time_s[0]) / _TIMES_S[:, None])
        decays -= decays[:, self.unloaded].mean(1, keepdims=True)
        at_rest = decays[:, self._at_rest]
        sizes = (at_rest @ y) / (at_rest**2).sum(1)
        cost = ((y - sizes[:, None] * at_rest) ** 2).sum(1)
        off = np.log(_TIMES_S / _RECOVERY_S) / np.log(_FACTOR)
        noise = _COMMON * cost.min() / max(len(y) - 2, 1) + 1e-30
        weight = np.exp(-(cost - cost.min()) / (2 * noise) - off**2 / 2)
        weight /= weight.sum()
        curves = sizes[:, None] * decays
        mean = weight @ curves
        return mean[:, None], np.sqrt(weight @ (curves - mean) ** 2)[:, None]

    @cached_property
    def noise(self) -> Real:
        """Standard deviation of white noise, by differences of successive unloaded readings, (n,); 0 of one alone."""
        return np.asarray(np.sqrt(np.nan_to_num(_mean(np.diff(self.reading[self.unloaded], axis=0) ** 2)) / 2))

    @cached_property
    def weight(self) -> float:
        """Share of the frames that are independent, by the correlation of one reference with the next [-]."""
        known = self.force_n if np.isfinite(self.force_n).any() else _mean(self.pressure_kpa.T)
        known = known[np.isfinite(known)]
        if len(known) < 3 or not known.std():
            return 1.0
        off = known - known.mean()
        rho = float(np.clip((off[1:] @ off[:-1]) / (off @ off), 0.0, 1.0))
        return min(max((1 - rho) / (1 + rho), _EFFECTIVE / len(known)), 1.0)


def _nothing(reference: Real) -> Mask:
    """Frames of which the reference is known, and nothing; none where it is known nowhere."""
    if not np.isfinite(reference).any():
        return np.zeros(len(reference), bool)
    size = np.abs(reference)
    with np.errstate(invalid="ignore"):
        return np.asarray(size <= UNLOADED * np.nanmax(size), bool)


def _mean(values: Real) -> Real:
    """Mean of each column's finite values; nan of none."""
    finite = np.isfinite(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(finite, values, 0.0).sum(0) / finite.sum(0))


def flickering(time_s: Real, reading: Real) -> Mask:
    """Elements that in more than a hundredth of the frames jump and come back within a tenth of a second, (n,).

    A loose wire does, or a multiplexer that shows another element; a load that is as short moves its neighbours at
    once. Slower than some 40 frames/s none is recognised. Of a long recording its middle is looked at.

    Parameters
    ----------
    time_s : (k,) array
        Of each frame [s].
    reading : (k, n) array
        Of each element, in any unit; nan where one is missing.
    """
    from scipy.ndimage import median_filter

    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else np.nan
    near = int(_JUMP_S / step / 2 + 0.1) if step > 0 else 0
    if near < _NEAR or len(time_s) < 2 * near + 1:
        return np.zeros(reading.shape[1], bool)
    start = max(0, len(reading) - _MOST_FRAMES) // 2
    x = _last_known(reading[start : start + _MOST_FRAMES])
    window = np.zeros((2 * near + 1, 1), bool)
    window[np.unique(np.linspace(0, 2 * near, _SAMPLES).round().astype(int))] = True
    around = np.hstack([
        median_filter(x[:, k : k + _LOT], footprint=window) for k in range(0, x.shape[1], _LOT)
    ])  # fmt: skip
    low, high = np.quantile(around[:: max(1, len(x) // 2000)], (0.02, 0.98), axis=0)
    spans, change = high - low, np.abs(np.diff(x, axis=0))
    noise = np.maximum(_NOISES * np.median(change, 0), _STEPS * change[change > 0].min(initial=np.inf))
    noise = np.where(np.isfinite(noise), noise, 0.0)
    least = np.maximum(_JUMP * max(float(np.quantile(spans, 0.75)), 0.3 * float(spans.max())), noise)
    beside = np.pad(change > least, ((1, 1), (0, 0)))
    jump = (np.abs(x - around) > least) & (beside[1:] | beside[:-1])
    of_load = jump.sum(1) > _ALIKE * max(int((spans > least).sum()), 1 / _ALIKE)
    return np.asarray(jump[~of_load].sum(0) > max(_JUMPS * len(x), _FEW))


def _last_known(values: Real) -> Real:
    """Values, (k, n), with the last one before where one is missing, or the first one; 0 in columns without any."""
    known = np.isfinite(values)
    last = np.maximum.accumulate(np.where(known, np.arange(len(values))[:, None], 0), 0)
    return np.nan_to_num(np.take_along_axis(values, np.maximum(last, known.argmax(0)), 0))


def doubtful_time(time_s: Real) -> Iterator[str]:
    """A line where frames are so far from each other that their time may have another unit."""
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    if step > _LONG_S:
        yield f"doubtful: a frame every {step:.4g} s; expected time_s in seconds, not in ms"


def lagged(x: Real, time_s: Real, tau_s: float, past: "Past | None" = None) -> Real:
    """Exponentially weighted past of each column: dz/dt = (x - z) / tau, by steps over which x is even.

    Where x is missing, it is as before.

    >>> z = lagged(np.ones((3, 1)), np.array([0.0, 1.0, 3.0]), 2.0)
    >>> np.round(z[:, 0], 4).tolist()
    [0.0, 0.3935, 0.7769]
    """
    found, past = np.empty_like(x), past or Past()
    first = past.time_s if np.isfinite(past.time_s) else float(time_s[0])
    kept = -np.expm1(-np.diff(time_s, prepend=first) / tau_s)
    for k, (row, share) in enumerate(zip(x, kept.tolist(), strict=True)):
        past.reading = np.where(np.isfinite(row), row, past.reading)
        past.lagged = past.lagged + share * (np.nan_to_num(past.reading) - past.lagged)
        found[k] = past.lagged
    past.time_s = float(time_s[-1])
    return found


def behind(x: Real, share: float, past: "Past | None" = None) -> Real:
    """Lag of a play behind each column, half as wide as a share of the largest value before.

    Prandtl's operator of hysteresis: -w while x rises, w while it falls. Where x is missing, it is as before.

    >>> x = np.array([[0.0], [1.0], [0.95], [0.5], [0.0]])
    >>> np.round(behind(x, 0.1)[:, 0], 2).tolist()
    [0.0, -0.1, -0.05, 0.1, 0.1]
    """
    found, past = np.empty_like(x), past or Past()
    for k, row in enumerate(x):
        past.reading = np.where(np.isfinite(row), row, past.reading)
        known = np.nan_to_num(past.reading)
        past.most = np.maximum(past.most, known)
        past.play = np.clip(past.play, known - share * past.most, known + share * past.most)
        found[k] = past.play - known
    return found


@dataclass(frozen=True)
class LawForm:
    """Form of the law.

    Attributes
    ----------
    powers : int
        Of the reading, 1 to 3.
    tau_s : float
        Time constant of the memory; 0 without one [s].
    drift : bool
        With a slow drift of the gain.
    tared : bool
        With a tare of each session; without one a constant takes its place.
    play : float
        Half-width of a play by which unloading lags behind loading, over the largest reading before; 0 without [-].
    """

    powers: int = _SHAPES
    tau_s: float = 0.0
    drift: bool = False
    tared: bool = True
    play: float = 0.0

    def basis(self, x: Real, time_s: Real, past: "Past | None" = None) -> Real:
        """Terms of the law, (k, n, terms); powers are 0 where a reading is missing."""
        known = np.nan_to_num(x)
        terms = [known**power for power in range(0 if not self.tared else 1, self.powers + 1)]
        terms += [lagged(x, time_s, self.tau_s, past)] if self.tau_s else []
        return np.stack([*terms, *([behind(x, self.play, past)] if self.play else [])], -1)

    def derivatives(self, x: Real) -> Real:
        """First and second derivatives of the terms by the reading, those of the past 0, (2, k, n, terms)."""
        power, x = np.arange(1 if self.tared else 0, self.powers + 1), x[:, :, None]
        orders = np.stack([power * x ** np.maximum(power - 1, 0), power * (power - 1) * x ** np.maximum(power - 2, 0)])
        return np.pad(orders, [(0, 0)] * 3 + [(0, bool(self.tau_s) + bool(self.play))])

    def words(self) -> str:
        """The form in words."""
        parts = [f"{('', 'straight', 'square', 'cubic')[self.powers]}", *(["tare"] if self.tared else [])]
        parts += [f"state of {self.tau_s:g} s"] if self.tau_s else []
        parts += [f"play of {2 * self.play:.0%}"] if self.play else []
        return ", ".join([*parts, *(["gain drift"] if self.drift else [])])


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums of one session over its frames, for one form."""

    day: float
    gram: Real  # (n, q, q)
    noise: Real  # (n, q, q), part of it that is noise of the readings
    cross: Real  # (n, q)
    square: Real  # (n,)
    count: Real  # (n,)
    rows: Real  # (r, n, q), of total forces [N]
    force: Real  # (r,)

    def total(self, at: Real) -> Real:
        """Total forces by parameters, (r,) [N]."""
        return np.asarray(np.einsum("rnq,nq->r", self.rows, at))


def sums_of(session: ArraySession, form: LawForm, scale: float) -> Sums:
    """Sums of a session, its frames weighed as far as they are independent."""
    phi = features(session, form, scale)
    known = np.isfinite(session.pressure_kpa) & np.isfinite(session.reading)
    known &= np.isfinite(session.tare) | (not form.tared)
    w, y = session.weight, np.where(known, session.pressure_kpa, 0.0)
    x, sigma = above(session, form) / scale, session.noise[:, None] / scale
    slopes, bends = form.derivatives(np.nan_to_num(x))
    # Noise adds sigma^2 / 2 of its bend to a term, and the product of slopes to that of two (Fuller 1987, section 1.2)
    some, slopes = (known[:, :, None] * each for each in (phi - sigma**2 / 2 * bends, sigma * slopes))
    by_element = some.transpose(1, 2, 0)
    gram, cross = w * by_element @ some.transpose(1, 0, 2), w * (by_element @ y.T[:, :, None])[:, :, 0]
    noise = w * slopes.transpose(1, 2, 0) @ slopes.transpose(1, 0, 2)
    total = np.flatnonzero(np.isfinite(session.force_n))
    total = total[:: max(1, round(1 / w))]
    rows = phi[total] * session.area_mm2 * _N_PER_KPA_MM2
    return Sums(session.day, gram, noise, cross, w * (y**2).sum(0), w * known.sum(0), rows, session.force_n[total])


def features(session: ArraySession, form: LawForm, scale: float, tare: "Real | None" = None) -> Real:
    """Terms of the law of every frame and element, (k, n, terms)."""
    return form.basis(above(session, form, tare) / scale, session.time_s, session.past)


def above(session: ArraySession, form: LawForm, tare: "Real | None" = None) -> Real:
    """Readings less those without load, which a law without a tare does not take off, (k, n)."""
    if not form.tared:
        return session.reading
    return session.reading - (session.tare + session.recovery[0] if tare is None else tare)


@dataclass(frozen=True, eq=False)
class ElementLaw:
    """Law of every element, by the sessions that it was learnt of.

    Attributes
    ----------
    form : LawForm
        Its form.
    scale : float
        Unit of the readings.
    at, spread : (n, q), (n, q, q) array
        Mean and covariance of each element's parameters.
    day, drift, unsure : float
        Middle of the sessions [d], rate of the gain, and standard error of that rate [1/d].
    alive : (n,) array of bool
        Elements that respond.
    """

    form: LawForm
    scale: float
    at: Real
    spread: Real
    day: float
    drift: float
    unsure: float
    alive: Mask

    def pressures(
        self, session: ArraySession, tare: "Real | None" = None, *, doubt: bool = True
    ) -> tuple[Real, Real]:  # fmt: skip
        """Pressures of a session, and standard errors by the parameters, (k, n); nan of no reading [kPa].

        With ``doubt`` those of a rest that falls are among them.
        """
        phi = features(session, self.form, self.scale, tare)
        gain = np.exp(self.drift * (session.day - self.day))
        mean = gain * np.einsum("knq,nq->kn", phi, self.at)
        variance = gain**2 * np.einsum("knq,nqr,knr->kn", phi, self.spread, phi, optimize=True)
        variance += (self.unsure * (session.day - self.day) * mean) ** 2
        if doubt and tare is None and self.form.tared:
            variance += (self.slopes(session) * session.recovery[1]) ** 2
        zero = session.tare if tare is None else tare
        known = np.isfinite(session.reading) & self.alive & (np.isfinite(zero) | (not self.form.tared))
        return np.where(known, mean, np.nan), np.where(known, np.sqrt(np.maximum(variance, 0.0)), np.nan)

    def slopes(self, session: ArraySession, tare: "Real | None" = None) -> Real:
        """Slope of the pressure by the reading, past apart, (k, n); that at rest of a missing one [kPa per unit]."""
        rates = self.form.derivatives(np.nan_to_num(above(session, self.form, tare)) / self.scale)[0]
        gain = np.exp(self.drift * (session.day - self.day))
        return np.asarray(gain / self.scale * np.einsum("knq,nq->kn", rates, self.at))


def scale_of(sessions: Sequence[ArraySession], form: LawForm) -> float:
    """Median over elements of the span of their readings, so that the terms are near 1."""
    spans = [_span(s.reading - s.tare if form.tared else s.reading) for s in sessions]
    found = float(np.nanmedian(np.nanmax(spans, 0)))
    return found if found > 0 else 1.0


def _span(x: Real) -> Real:
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nanmax(np.where(np.isfinite(x), np.abs(x), 0.0), 0))


def responding(sums: Sequence[Sums]) -> Mask:
    """Elements whose readings explain half of their reference or more; all of those without a reference."""
    gram, noise, cross, square, count = (
        sum(getattr(s, name) for s in sums) for name in ("gram", "noise", "cross", "square", "count")
    )
    ridge = noise + (1e-9 * np.einsum("nqq->n", gram)[:, None, None] + 1e-12) * np.eye(gram.shape[1])
    explained = np.einsum("nq,nq->n", cross, np.linalg.solve(gram + ridge, cross[:, :, None])[:, :, 0])
    return np.asarray((count == 0) | (explained > _RESPONDS * square))


def learnt(sums: Sequence[Sums], form: LawForm, scale: float, alive: Mask) -> ElementLaw:
    """Law of every element by empirical Bayes: EM over the print's mean, covariance and noise; dead ones left out."""
    day = float(np.mean([s.day for s in sums]))
    days = np.array([s.day for s in sums]) - day
    at, spread = _expected(sums, np.ones(len(days)), alive)
    if not np.ptp(days):
        return ElementLaw(form, scale, at, spread, day, 0.0, 0.0, alive)
    rate, error = _drift(sums, days, at)
    if not form.drift:
        return ElementLaw(form, scale, at, spread, day, 0.0, float(np.hypot(rate, error)), alive)
    for _ in range(_ROUNDS):
        at, spread = _expected(sums, np.exp(rate * days), alive)
        rate, error = _drift(sums, days, at)
    return ElementLaw(form, scale, at, spread, day, rate, error, alive)


def _drift(sums: Sequence[Sums], days: Real, at: Real) -> tuple[float, float]:
    """Rate of ln of the gain by days, of the gains of each session, and its standard error [1/d]."""
    size = np.array([np.einsum("nq,nqr,nr->", at, s.gram - s.noise, at) + s.total(at) @ s.total(at) for s in sums])
    along = np.array([np.einsum("nq,nq->", at, s.cross) + s.total(at) @ s.force for s in sums])
    ln = np.log(np.maximum(along / np.maximum(size, 1e-30), 0.1))
    off, away = ln - ln.mean(), days - days.mean()
    scatter = max(float(off.std()), _GAIN)
    information = float(away @ away) / scatter**2 + 1 / _RATE**2
    return float(away @ off) / scatter**2 / information, float(information**-0.5)


def _expected(sums: Sequence[Sums], gains: Real, alive: Mask) -> tuple[Real, Real]:
    """Means and covariances of the parameters of each element."""
    gram, by_noise = (
        sum(g**2 * getattr(s, name) for g, s in zip(gains, sums, strict=True)) for name in ("gram", "noise")
    )
    cross = sum(g * s.cross for g, s in zip(gains, sums, strict=True))
    square, count = (sum(getattr(s, name) for s in sums) for name in ("square", "count"))
    rows = np.concatenate([g * s.rows for g, s in zip(gains, sums, strict=True)]) * alive[None, :, None]
    force = np.concatenate([s.force for s in sums])
    (n, q), use = cross.shape, alive & (count > 0)
    raw, cross, ridge = gram * use[:, None, None], cross * use[:, None], (1e-9 * gram.max() + 1e-12) * np.eye(q)
    share = np.linalg.eigvals(np.linalg.solve(raw + ridge, by_noise)).real.max(1)  # less than all, or none is left
    gram = raw - by_noise * (use * np.minimum(1.0, _PART / np.maximum(share, 1e-30)))[:, None, None]
    even = rows.sum(1)
    start = np.linalg.lstsq(gram.sum(0) + even.T @ even, cross.sum(0) + even.T @ force, rcond=None)[0]
    mean, prior = start, np.diag(start**2 + 1e-12) + 1e-9 * float(start @ start) * np.eye(q)
    samples, total = float((count * use).sum()), len(force)
    noise = max(float((square * use).sum()) / max(samples, 1.0), 1e-12) * 0.1
    noise_n = max(float(force @ force) / max(total, 1), 1e-12) * 0.1
    at, spread = np.tile(mean, (n, 1)), np.tile(prior, (n, 1, 1))
    for _ in range(_EM):
        inverse = np.linalg.inv(prior)
        spread = np.linalg.inv(inverse + gram / noise)
        at = np.einsum("nqr,nr->nq", spread, inverse @ mean + cross / noise)
        if total:
            at, spread, noise_n = _with_totals(at, spread, rows, force, noise_n)
        off = at[alive] - mean
        mean = at[alive].mean(0)
        prior = (spread[alive] + off[:, :, None] * off[:, None, :]).mean(0) + 1e-12 * np.eye(q)
        left = square - 2 * np.einsum("nq,nq->n", at, cross) + np.einsum("nq,nqr,nr->n", at, raw, at)
        left = (left + np.einsum("nqr,nrq->n", raw, spread)) * use
        noise = max(float(left.sum()) / max(samples, 1.0), 1e-12)
    return at, spread


def _with_totals(at: Real, spread: Real, rows: Real, force: Real, noise_n: float) -> tuple[Real, Real, float]:
    """Parameters after total forces too: by the matrix of the forces, not of all parameters."""
    by = np.einsum("nqr,tnr->tnq", spread, rows)
    flat, gain = rows.reshape(len(rows), -1), by.reshape(len(rows), -1)
    inverse = np.linalg.inv(flat @ gain.T + noise_n * np.eye(len(rows)))
    left = force - flat @ at.ravel()
    at = at + (gain.T @ (inverse @ left)).reshape(at.shape)
    spread = spread - np.einsum("tnq,tu,unr->nqr", by, inverse, by, optimize=True)
    left = force - flat @ at.ravel()
    explained = float(np.trace(inverse @ (flat @ gain.T)))
    return at, spread, max(float(left @ left) / max(len(rows) - explained, 1.0), 1e-12)
