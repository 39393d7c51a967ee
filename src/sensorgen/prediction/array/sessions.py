"""Calibration of an array over sessions: form by cross-validation, intervals that hold in a session to come.

All constants, the form of the law and the width of the intervals among them, are chosen inside the sessions that train.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Annotated
from zipfile import BadZipFile

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading
from sensorgen.prediction.array import elements
from sensorgen.prediction.inference import NORMAL_90

LEVEL = 0.9
TAUS_S = (10.0, 100.0)  # decades: sessions of minutes do not determine more
PLAYS = (0.01, 0.03, 0.1)
_EARNED = 0.03  # share of the error by which a memory or a drift has to lower it: they are of other times than steps
_FRAMES = 4000  # of a session, at most, by which the interval is set
_QUIET, _PATTERN = 4.0, 4.0  # standard deviations of noise, and of tares over sessions
_ODD = 0.02  # share of the elements that may be beyond
_WINDOW_S, _FEWEST = 1.0, 5  # of a second that is unloaded, and its frames at least
_SHOWN = 12  # elements that are named
_SURE = 3  # sessions of which tares are known, to recognise another


@dataclass(frozen=True, eq=False)
class ArrayCalibration:
    """Calibration of the elements of one array.

    Attributes
    ----------
    law : ElementLaw
        Of every element.
    floor_kpa, share : float
        Error besides that of the parameters: constant [kPa], and relative to the pressure [-].
    reach : float
        Half-width of the interval of ``LEVEL`` in that error [-].
    common : float
        Relative error of the pressures of all elements at once, from frame to frame: of the total force [-].
    tares : (sessions, n) array
        Of the sessions that trained.
    quiet : (n,) array
        Standard deviation of an unloaded reading.
    names : tuple of str
        Of the elements; none where they are numbered.
    readout : str
        By which the frames of an array were read; "" of elements by themselves.
    """

    law: elements.ElementLaw
    floor_kpa: float
    share: float
    reach: float
    common: float
    tares: Real
    quiet: Real
    names: tuple[str, ...] = ()
    readout: str = ""

    def pressures(self, session: elements.ArraySession, tare: "Real | None" = None) -> tuple[Real, Real]:
        """Pressures, and half-widths of their intervals, (k, n); nan of dead elements and missing readings [kPa]."""
        mean, by_law = self.law.pressures(session, tare)
        own = self.floor_kpa**2 + (self.share * mean) ** 2
        noise = (self.quiet * self.law.slopes(session, tare)) ** 2
        # One more session, by a scatter that so few tell; noise is the same in all, and known of many frames.
        of_session = np.maximum(own - noise, 0.0) / len(self.tares)
        return mean, self.reach * np.sqrt(by_law**2 + own + of_session)

    def of_ratio(
        self, ratio: Real, time_s: Real, day: float, past: "elements.Past | None" = None
    ) -> tuple[Real, Real]:  # fmt: skip
        """Pressures and half-widths by capacitance over that at rest of each crossing, (k, m, n) [kPa]."""
        names, (k, m, n) = tuple(f"r{i + 1}c{j + 1}" for i, j in np.ndindex(ratio.shape[1:])), ratio.shape
        if len(self.law.alive) != m * n or self.names not in ((), names):
            raise BadInput(
                f"a calibration of {len(self.law.alive)} elements, {', '.join(self.names[:2])} ...; expected "
                f"{m * n}, r1c1 to {names[-1]}, as of the array"
            )
        if self.law.form.tau_s and not np.isfinite(time_s).all():
            raise BadInput("no time_s of the frames; expected it: the calibration has a memory")
        nothing = np.full((k, m * n), np.nan)
        session = elements.ArraySession(
            "", day, time_s, ratio.reshape(k, -1) - 1, nothing[:, 0] < 0, nothing, nothing[:, 0], past=past
        )
        mean, half = self.pressures(session, np.zeros(m * n))
        return mean.reshape(ratio.shape), half.reshape(ratio.shape)

    def counted(self, day: float) -> float:
        """A day, or where none is known that of the calibration.

        Raises
        ------
        BadInput
            No day, though the calibration is of several: the gain may have drifted since.
        """
        if np.isfinite(day):
            return day
        if self.law.drift or self.law.unsure:
            raise BadInput("no 'day' of the readings; expected it, counted as in the sessions that calibrated")
        return self.law.day

    def recognised(self, session: elements.ArraySession) -> Mask:
        """Frames of the first unloaded second, by the readings alone.

        A second is unloaded where no element moves by more than noise, and all readings differ from the tares of the
        sessions that trained by what those differ by among each other, one part for all elements and one of each.

        Raises
        ------
        BadInput
            No such second, or fewer than three sessions: a standing load is never taken for rest.
        """
        alive = self.law.alive & np.isfinite(self.tares).all(0)
        expected = "mark unloaded frames in 'rest'; a standing load is never taken for rest"
        if len(self.tares) < _SURE:
            raise BadInput(
                f"{session.name}: tares of {len(self.tares)} sessions are known, {_SURE} recognise; {expected}"
            )
        middle, shift, own = _spread_of_tares(self.tares[:, alive])
        second = max(_FEWEST, int(np.searchsorted(session.time_s - session.time_s[0], _WINDOW_S)))
        for at in range(0, len(session.time_s) - second + 1, second):
            values = session.reading[at : at + second][:, alive]
            off = values.mean(0) - middle
            common = float(np.nanmedian(off))
            still = values.std(0, ddof=1) < _QUIET * self.quiet[alive]
            near = np.abs(off - common) < _PATTERN * np.hypot(own, self.quiet[alive])
            if abs(common) < _PATTERN * shift and min(still.mean(), near.mean()) > 1 - _ODD:
                return np.asarray(np.arange(len(session.time_s)) // second == at // second)
        raise BadInput(f"{session.name}: no unloaded second is recognised; {expected}")

    def npz(self) -> bytes:
        """The calibration as NPZ."""
        target, law = BytesIO(), self.law
        form = (law.form.powers, law.form.tau_s, law.form.drift, law.form.tared, law.form.play)
        error = (self.floor_kpa, self.share, self.reach, self.common)
        np.savez_compressed(
            target, form=np.array(form, float), scale=law.scale, at=law.at, spread=law.spread, alive=law.alive,
            numbers=np.array([law.day, law.drift, law.unsure, *error]), tares=self.tares,
            quiet=self.quiet, names=np.array(self.names, str), readout=np.array(self.readout),
        )  # fmt: skip
        return target.getvalue()


def stored(path: Path) -> ArrayCalibration:
    """Calibration of a file that ``sensorgen calibrate`` wrote.

    Raises
    ------
    BadInput
        It is none.
    """
    try:
        with reading(path), np.load(path, allow_pickle=False) as data:
            powers, tau_s, drift, tared, play = (*data["form"].tolist(), 0.0)[:5]
            day, rate, unsure, floor, share, reach, common = data["numbers"].tolist()
            law = elements.ElementLaw(
                elements.LawForm(int(powers), tau_s, bool(drift), bool(tared), play), float(data["scale"]), data["at"],
                data["spread"], day, rate, unsure, data["alive"],
            )  # fmt: skip
            names = tuple(data["names"].tolist()) if "names" in data else ()
            readout = str(data["readout"]) if "readout" in data else ""
            return ArrayCalibration(law, floor, share, reach, common, data["tares"], data["quiet"], names, readout)
    except (KeyError, TypeError, ValueError, EOFError, BadZipFile):
        raise BadInput(f"{path}: no calibration of an array; expected a file of 'calibrate --calibration'") from None


def _spread_of_tares(tares: Real) -> tuple[Real, float, Real]:
    """Mean of each element's tares, and standard deviations of their common part and of each own."""
    middle = tares.mean(0)
    common = np.median(tares - middle, 1)
    own = (tares - middle - common[:, None]).std(0, ddof=1)
    return middle, float(common.std(ddof=1)), np.hypot(own, np.median(own)) / np.sqrt(2)


def training(sessions: Sequence[elements.ArraySession], held_out: int) -> list[elements.ArraySession]:
    """All sessions but one."""
    return [session for k, session in enumerate(sessions) if k != held_out]


def law_of(sessions: Sequence[elements.ArraySession], form: elements.LawForm) -> elements.ElementLaw:
    """Law of every element by sessions, of a given form."""
    scale = elements.scale_of(sessions, form)
    return _law([elements.sums_of(session, form, scale) for session in sessions], form, scale)


def _law(sums: Sequence[elements.Sums], form: elements.LawForm, scale: float) -> elements.ElementLaw:
    alive = elements.responding(sums)
    if not alive.any():
        raise BadInput("no element's reading follows its reference; expected half of its variance or more of one")
    return elements.learnt(sums, form, scale, alive)


def chosen(sessions: Sequence[elements.ArraySession]) -> elements.LawForm:
    """Form of the law that leaves the least error in sessions left out.

    Memory in time, which has to lower it by 3 %, and play, which is alike at all speeds, are chosen together: either is
    taken for the other where it comes first. Then the powers, then a drift of the gain, by 3 % too; of one session a
    cubic. Where noise is large a small play may be taken that is not there.
    """
    best = elements.LawForm()
    if len(sessions) < 2:
        return best
    least = float("inf")
    for change in ("past", "powers", "drift"):
        for form in _changed(best, change):
            terms = bool(form.tau_s) + form.drift
            cost = _left_out(sessions, form) * (1 + _EARNED * terms)
            if cost < least:
                best, least = form, cost
    return best


def _changed(base: elements.LawForm, change: str) -> list[elements.LawForm]:
    """Forms that differ from one by their past, powers or drift."""
    if change == "past":
        return [replace(base, tau_s=tau, play=play) for tau in (0.0, *TAUS_S) for play in (0.0, *PLAYS)]
    if change == "powers":
        return [replace(base, powers=power) for power in (1, 2)]
    return [replace(base, drift=True)]


def _left_out(sessions: Sequence[elements.ArraySession], form: elements.LawForm) -> float:
    """Mean over sessions of the median error of an element in a session left out [kPa]; by totals where alone [N]."""
    scale = elements.scale_of(sessions, form)
    sums = [elements.sums_of(session, form, scale) for session in sessions]
    return float(np.mean([_error(own, _law(sums[:k] + sums[k + 1 :], form, scale)) for k, own in enumerate(sums)]))


def _error(own: elements.Sums, law: elements.ElementLaw) -> float:
    at = np.exp(law.drift * (own.day - law.day)) * law.at
    if own.count.any():
        net = own.gram - own.noise
        left = own.square - 2 * np.einsum("nq,nq->n", at, own.cross) + np.einsum("nq,nqr,nr->n", at, net, at)
        use = law.alive & (own.count > 0)
        return float(np.median(np.sqrt(np.maximum(left[use], 0.0) / own.count[use])))
    return float(np.sqrt(np.mean((own.force - own.total(at * law.alive[:, None])) ** 2)))


def calibrated(sessions: Sequence[elements.ArraySession], form: "elements.LawForm | None" = None) -> ArrayCalibration:
    """Calibration by sessions, its form chosen among them if none is given.

    The intervals' width is set by errors in each of them left out in turn; of one session by its own residuals.
    """
    from scipy.special import stdtrit

    form = form or chosen(sessions)
    tares = np.stack([session.tare for session in sessions])
    quiet = _median([session.reading[session.unloaded].std(0) for session in sessions])
    law = law_of(sessions, form)
    law = replace(law, alive=law.alive & np.isfinite(tares).any(0))  # one that never reads takes no other's law
    several = len(sessions) > 1
    errors = [
        _residuals(session, law_of(training(sessions, k), form) if several else law)
        for k, session in enumerate(sessions)
    ]
    off_pairs, mean_pairs = np.sum([pairs for *_, pairs in errors], 0).tolist()
    share = off_pairs / mean_pairs if mean_pairs > 0 else 0.0
    few = float(stdtrit(len(sessions), (1 + LEVEL) / 2)) / NORMAL_90  # Student's t: by so many sessions
    common = few * float(np.sqrt(max(share, 0.0) * (1 + 1 / len(sessions))))  # of one session more
    offs, means, sigmas, _ = zip(*errors, strict=True)
    off, mean, sigma = np.concatenate(offs), np.concatenate(means), np.concatenate(sigmas)
    counts = [len(each) for each in offs]
    alike = np.repeat(1 / np.maximum(counts, 1), counts)  # a long session counts no more than others
    names = sessions[0].names
    if not off.size:  # total forces alone: the parameters' covariance is what is known
        return ArrayCalibration(law, 0.0, 0.0, NORMAL_90, common, tares, quiet, names)
    floor, share = _scale(np.maximum(off**2 - sigma**2, 0.1 * off**2), mean)
    size = np.abs(off) / np.sqrt(sigma**2 + floor**2 + (share * mean) ** 2)
    reach = float(np.quantile(size, LEVEL, weights=alike, method="inverted_cdf"))
    return ArrayCalibration(law, floor, share, reach, common, tares, quiet, names)


def _residuals(session: elements.ArraySession, law: elements.ElementLaw) -> tuple[Real, Real, Real, Real]:
    """Errors, pressures and standard errors by the parameters, of loaded frames evenly taken [kPa].

    And sums over frames of the products of two different elements' errors, and of their pressures, (2,) [kPa2]: what
    the first has is alike in all elements.
    """
    mean, sigma = law.pressures(session, doubt=False)
    size = np.abs(session.pressure_kpa)
    with np.errstate(invalid="ignore"):
        known = (size > elements.UNLOADED * np.nanmax(size, initial=0.0)) & np.isfinite(mean)
    step = max(1, len(mean) // _FRAMES)
    off = np.where(known, mean - session.pressure_kpa, 0.0)
    pairs = np.array([_pairs(of) for of in (off, np.where(known, mean, 0.0))])
    known = known[::step]
    return off[::step][known], mean[::step][known], sigma[::step][known], pairs


def _median(values: Sequence[Real]) -> Real:
    """Median of each column's finite values; 0 of none."""
    columns = (column[np.isfinite(column)] for column in np.stack(values).T)
    return np.array([float(np.median(column)) if column.size else 0.0 for column in columns])


def _pairs(values: Real) -> float:
    """Sum over rows of the products of two different columns."""
    return float((values.sum(1) ** 2).sum() - np.einsum("kn,kn->", values, values))


def _scale(squares: Real, mean: Real) -> tuple[float, float]:
    """Constant and relative part of errors, by their squares over the pressure."""
    from scipy.optimize import nnls

    order = np.argsort(np.abs(mean))
    parts = [part for part in np.array_split(order, 20) if part.size]
    y = np.array([np.mean(squares[part]) for part in parts])
    by = np.array([[1.0, np.mean(mean[part] ** 2)] for part in parts])
    size = np.maximum(by.max(0), 1e-30)
    floor, share = nnls(by / size, y)[0] / size
    return float(np.sqrt(max(floor, 1e-12))), float(np.sqrt(share))


@dataclass(frozen=True)
class SessionError:
    """Errors in one session that did not train."""

    session: Annotated[str, Column("session")]
    form: Annotated[str, Column("form chosen by the others")]
    static_kpa: Annotated[float, Column("cubic, no tare", "kPa", digits=3)]
    tared_kpa: Annotated[float, Column("cubic, tare", "kPa", digits=3)]
    error_kpa: Annotated[float, Column("chosen", "kPa", about="median over elements of the rms error", digits=3)]
    coverage: Annotated[float, Column("in the interval", about="of 90 %", digits=3)]


@dataclass(frozen=True, eq=False)
class CalibrationStudy:
    """A calibration, and its errors in sessions left out.

    Attributes
    ----------
    calibration : ArrayCalibration
        By all sessions.
    sessions : tuple of ArraySession
        That trained.
    errors : tuple of SessionError
        Of each session left out, or of each after the first.
    by_first : bool
        Errors of a calibration by the first session alone.
    """

    calibration: ArrayCalibration
    sessions: tuple[elements.ArraySession, ...]
    errors: tuple[SessionError, ...]
    by_first: bool = False

    def document(self) -> Iterator[Part]:
        """The law, and a row for each session."""
        yield Facts(tuple(self._facts()))
        yield from (f"{of.name}: {line}" for of in self.sessions for line in doubts(of))
        if not self.errors:
            yield "one session: its errors in another are not known; expected more, of several days"
            return
        yield ""
        how = "calibrated by the first session" if self.by_first else "each session by the calibration of all others"
        yield Table.of("sessions", how, self.errors)
        error, coverage = (float(np.mean([getattr(e, key) for e in self.errors])) for key in ("error_kpa", "coverage"))
        yield f"mean {error:.3g} kPa, in the interval {100 * coverage:.0f} %"

    def _facts(self) -> Iterator[tuple[str, str]]:
        known, law = self.calibration, self.calibration.law
        yield (
            "sessions",
            f"{len(self.sessions)}, {len(law.alive)} elements; tare: {elements.TARE_S:g} unloaded seconds of each",
        )
        drift = f", gain {100 * law.drift:+.2g} % a day" if law.form.drift else ""
        gains = law.at[law.alive, 0]
        scatter = 100 * gains.std() / abs(gains.mean())
        yield "law", f"{law.form.words()}{drift}; gain differs between elements by {scatter:.2g} %"
        own = (
            f"{known.floor_kpa:.3g} kPa and {100 * known.share:.2g} % of the pressure, interval of {LEVEL:.0%}: "
            f"{known.reach:.3g} times that, of what is no noise {np.sqrt(1 + 1 / len(self.sessions)):.3g} times more"
            if known.floor_kpa
            else "of one element not known, by total forces alone; expected a bladder or presses too"
        )
        yield "error", f"{own}; all at once {100 * known.common:.2g} %"
        if not law.alive.all():
            yield "dead", _numbered(~law.alive, known.names)


def doubts(of: elements.ArraySession) -> Iterator[str]:
    """Lines on what of a session may not be as it seems."""
    yield from elements.doubtful_time(of.time_s)
    if of.flickers.any():
        yield f"doubtful: left out, as their readings jump: {_numbered(of.flickers, of.names)}"
    if of.falls:
        yield (
            f"doubtful: readings at rest fall by {abs(of.falls):.2g} a second, as after a load on all; the tare is "
            "that to which they fall"
        )


def _numbered(which: Mask, names: Sequence[str]) -> str:
    """Some elements: how many, and the first of their names, or numbers."""
    numbers = np.flatnonzero(which)
    first = [names[k] if names else str(k + 1) for k in numbers[:_SHOWN].tolist()]
    count = f"{numbers.size} elements" if numbers.size > 1 else "1 element"
    return f"{count}{'' if names else ', from 1'}: {', '.join(first)}{', ...' if numbers.size > _SHOWN else ''}"


def study(sessions: Sequence[elements.ArraySession], *, by_first: bool = False) -> CalibrationStudy:
    """Calibrate by all sessions, and test on each by all others, or by the first alone.

    Raises
    ------
    BadInput
        Sessions of different elements, or without any reference.
    """
    sessions = [session.matched(sessions[0].names) for session in sessions]
    _refuse(sessions)
    steady = [session.steady() for session in sessions]
    first = 1 if by_first or len(steady) == 1 else 0
    tested = [k for k in range(first, len(steady)) if np.isfinite(steady[k].pressure_kpa).any()]
    errors = [_tested(steady, k, steady[:1] if by_first else training(steady, k)) for k in tested]
    return CalibrationStudy(calibrated(steady), tuple(sessions), tuple(errors), by_first)


def _refuse(sessions: Sequence[elements.ArraySession]) -> None:
    count = sessions[0].reading.shape[1]
    for k, session in enumerate(sessions):
        if any(np.array_equal(session.reading, other.reading, equal_nan=True) for other in sessions[:k]):
            raise BadInput(f"{session.name}: the readings of an earlier file again; expected each session once")
        if session.reading.shape[1] != count:
            raise BadInput(f"{session.name}: {session.reading.shape[1]} elements; expected {count}, as of the first")
        if not (np.isfinite(session.pressure_kpa).any() or np.isfinite(session.force_n).any()):
            raise BadInput(f"{session.name}: no reference; expected pressure_kpa, or force_n of a press or a plate")


def _tested(sessions: Sequence[elements.ArraySession], k: int, others: Sequence[elements.ArraySession]) -> SessionError:
    """Errors in one session of calibrations by others."""
    session, found = sessions[k], calibrated(others)
    mean, half = found.pressures(session)
    known = np.isfinite(session.pressure_kpa) & np.isfinite(mean)
    inside = (np.abs(mean - session.pressure_kpa) < half)[known]
    plain = (law_of(others, elements.LawForm(tared=tared)).pressures(session)[0] for tared in (False, True))
    static, tared, own = (median_error(each, session) for each in (*plain, mean))
    return SessionError(session.name, found.law.form.words(), static, tared, own, float(inside.mean()))


def median_error(mean: Real, session: elements.ArraySession) -> float:
    """Median over elements of the rms error in a session [kPa]."""
    off = mean - session.pressure_kpa
    with np.errstate(invalid="ignore"):
        return float(np.nanmedian(np.sqrt(np.nanmean(off[:, np.isfinite(off).any(0)] ** 2, 0))))
