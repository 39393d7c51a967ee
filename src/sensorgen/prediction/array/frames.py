"""Frames of an array to pressure maps: by C/C0 where that suffices, else with the network of the tracks."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from io import BytesIO
from math import nan
from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real, Whole, finite
from sensorgen.core.document import Column, Facts, Part, Table, comma_separated, to_json
from sensorgen.core.errors import BadInput
from sensorgen.core.units import si
from sensorgen.prediction.array.elements import Past, doubtful_time, flickering
from sensorgen.prediction.array.model import PA_PER_KPA, ArrayModel
from sensorgen.prediction.array.readout import FULL_SCALE_PA, MOST_DENSE, ArrayReadout, broken_where_dead
from sensorgen.prediction.array.sessions import ArrayCalibration
from sensorgen.prediction.array.study import DETECTED, DETERMINED
from sensorgen.prediction.inference import NORMAL_90
from sensorgen.solvers.tracks import CrossingReadings, Tracks, readings

SCATTER = 0.05  # of gain, from cell to cell of one print, before a calibration of each
_STEPS, _RENEWED = 25, 5  # of Gauss-Newton, and after how many the slopes are renewed
_DONE, _FAR = 0.02, 1.0  # of a standard error: a smaller step ends it, a larger one needs other slopes
_HEAVIER = 1.1  # times the heaviest frame so far: a later one is compared with the network too
_SUFFICES = 0.5  # standard error by which C/C0 may differ from the network
_ALIVE = 3.0  # factor of a reading at rest to the predicted one; prints differ by less
_LEAST_PHASE = 50.0  # degrees that capacitances alone need
_MIXED = 10.0  # error with all others open over that of a crossing alone; 55 to 183 were seen, else 1.0 to 1.3
_SHORTED = 10.0  # real part at rest over the predicted magnitude
_LEAKS = 6  # steps to the conductance of shorts
_SHOWN = 6  # crossings that are named
_AROUND = 5  # squares within which crossings tell of a lost one
_LENGTHS = (1.0, 1.5, 2.0, 3.0, 4.5, 7.0)  # of the correlation of pressures, in pitches
_RATIOS = np.geomspace(1e-10, 1.0, 41)  # of noise to what pressures vary by, squares
_CI = 1.96  # standard errors of 95 %


_REGION = (
    Column("force", "N", key="force_n"), Column("mean", "kPa", key="mean_kpa"), Column("peak", "kPa", key="peak_kpa"),
    Column("contact", "mm2", key="area_mm2"), Column("not determined", key="undetermined"),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class PressureMaps:
    """Pressure maps of a recording.

    Attributes
    ----------
    model : ArrayModel
        The array.
    by : str
        Model that inverted the readings, and why.
    time_s : (k,) array
        Of each frame; nan where it is not known [s].
    pressure_kpa, sigma_kpa : (k, m, n) array
        Pressure on the surface, or that cells carry, and its standard error of noise and scatter alone; nan where it is
        not determined [kPa].
    calibration : ArrayCalibration or None
        That gave the pressures; its errors are in the standard errors.
    faults : tuple of str
        Breaks and shorts that the readings at rest show, as in :func:`readout.faulty`.
    noise : (k, m, n) array
        Part of each standard error that noise is [-].
    correlation : (m n, m n) array or None
        Of errors by noise between crossings, 0 of each with itself; none where each is by its own reading [-].
    """

    model: ArrayModel
    by: str
    time_s: Real
    pressure_kpa: Real
    sigma_kpa: Real
    calibration: "ArrayCalibration | None" = None
    faults: tuple[str, ...] = ()
    noise: "Real | float" = 1.0
    correlation: "Real | None" = None

    def _copied(self) -> tuple[Real, Real]:
        """Pressures and standard errors, a row for each frame."""
        rows = len(self.pressure_kpa), -1
        return self.pressure_kpa.reshape(rows).copy(), self.sigma_kpa.reshape(rows).copy()

    def _alike(self) -> Iterator[tuple[Mask, Mask]]:
        """Frames whose pressures are known of the same crossings, and these crossings."""
        masks, which = np.unique(np.isfinite(self._copied()[0]), axis=0, return_inverse=True)
        return ((which.ravel() == k, known) for k, known in enumerate(masks))

    def on_surface(self) -> "PressureMaps":
        """Maps of the pressure on the cover, its spread undone; what is not determined is as what lies around it.

        Standard errors of more crossings than one matrix takes grow as those of an array without ends.
        """
        shape, (pressure, sigma) = self.pressure_kpa.shape, self._copied()
        for frames, known in self._alike():
            at, (back, squares) = np.ix_(frames, known), _back(self.model, known.tobytes())
            pressure[at] = back(pressure[at].T).T
            sigma[at] = sigma[at] * self.model.undone if squares is None else np.sqrt(sigma[at] ** 2 @ squares)
        lost = ~_known(sigma * PA_PER_KPA)
        pressure[lost] = sigma[lost] = nan
        return replace(self, pressure_kpa=pressure.reshape(shape), sigma_kpa=sigma.reshape(shape))

    @cached_property
    def interval_kpa(self) -> tuple[Real, Real]:
        """Lower and upper end of 95 %, of 90 % with a calibration [kPa]."""
        half = (NORMAL_90 if self.calibration else _CI) * self.sigma_kpa
        return self.pressure_kpa - half, self.pressure_kpa + half

    @cached_property
    def filled(self) -> tuple[Real, Real]:
        """Pressures with lost crossings as a Gaussian field by those around, and errors; nan of none around [kPa].

        The squares of the errors of lost ones add up to that of their sum.
        """
        shape, (pressure, sigma) = self.pressure_kpa.shape, self._copied()
        for frames, known in self._alike():
            if known.any() and (self.model.here.ravel() & ~known).any():
                field = _field(self.model, known.tobytes())
                near, lost = (np.ix_(frames, at) for at in (field.near, field.lost))
                pressure[lost], sigma[lost] = field.at_lost(pressure[near], sigma[near])
        return pressure.reshape(shape), sigma.reshape(shape)

    @property
    def _newtons(self) -> tuple[Real, Real]:
        per_kpa = PA_PER_KPA * self.model.pitch_area_m2
        return per_kpa * self.filled[0], per_kpa * self.filled[1]

    def _summed(self, sigma: Real) -> Real:
        """Standard error of a sum over crossings by those of its terms, with their signs, (k, m, n).

        What a calibration leaves is no noise: there correlations make no error less.
        """
        square = (sigma**2).sum((1, 2))
        if self.correlation is not None:
            noise = np.where(np.isfinite(self.pressure_kpa), self.noise * sigma, 0.0).reshape(len(sigma), -1)
            square += np.maximum(((noise @ self.correlation) * noise).sum(1), 0.0 if self.calibration else -square)
        return np.asarray(np.sqrt(square))

    @cached_property
    def force_n(self) -> tuple[Real, Real]:
        """Total force of each frame and its standard error, lost crossings filled; nan without any [N]."""
        (newtons, sigma), read = self._newtons, np.isfinite(self.pressure_kpa).any((1, 2))
        force, error = np.nansum(newtons, (1, 2)), self._summed(np.nan_to_num(sigma))
        if self.calibration:
            error = np.hypot(error, self.calibration.common * force)
        return np.where(read, force, np.nan), np.where(read, error, np.nan)

    @cached_property
    def touched(self) -> Mask:
        """Crossings with a pressure above three standard errors, (k, m, n)."""
        return np.asarray(self.pressure_kpa > DETECTED * self.sigma_kpa)

    @cached_property
    def centre_mm(self) -> tuple[Real, Real, Real, Real]:
        """Centre of pressure from the print's corner along x and y, and standard errors; nan of no contact [mm].

        Of crossings that are above three standard errors, alone or 5 x 5 together: light loads count beside each other;
        farther off there is noise, with a long arm. Lost crossings are filled. The load of each row or column is as
        likely anywhere across it.
        """
        from scipy import ndimage

        newtons, sigma = (np.nan_to_num(of) for of in self._newtons)
        of, errors = (ndimage.uniform_filter(each, (1, 5, 5), mode="constant") for each in (newtons, sigma**2))
        near = (of > DETECTED / 5 * np.sqrt(np.maximum(errors, 0.0))) | self.touched
        weight, found = np.where(near, newtons, 0.0), list[Real]()
        total = weight.sum((1, 2))
        total = np.where(self.touched.any((1, 2)) & (total > 0), total, np.nan)
        with np.errstate(invalid="ignore", divide="ignore"):
            for axis, at in ((1, self.model.layout.x_mm), (2, self.model.layout.y_mm)):
                line = weight.sum(axis)
                found.append((line @ at) / total)
                arms = np.expand_dims(np.array(at) - found[-1][:, None], axis)
                across = self.model.layout.params.pitch[axis - 1] * np.sqrt((line**2).sum(1) / 12)
                found.append(np.hypot(self._summed(near * sigma * np.nan_to_num(arms)), across) / total)
        return found[0], found[2], found[1], found[3]

    @property
    def area_mm2(self) -> Real:
        """Area of contact of each frame [mm2]."""
        return np.asarray(self.touched.sum((1, 2)) * self.model.pitch_area_m2 * 1e6)

    @cached_property
    def peak_kpa(self) -> Real:
        """Largest pressure of each frame; nan without any [kPa]."""
        peak = np.where(np.isnan(self.pressure_kpa), -np.inf, self.pressure_kpa).max((1, 2))
        return np.where(np.isfinite(peak), peak, np.nan)

    @cached_property
    def regions(self) -> dict[str, Real]:
        """Values of each region by frame, (k,), named as in CSV; nan without a determined crossing."""
        found = dict[str, Real]()
        for name, inside in self.model.regions.items():
            kpa = self.pressure_kpa[:, inside]
            count = np.isfinite(kpa).sum(1)
            newtons = self._newtons[0][:, inside]
            force, filled = np.where(count, np.nansum(newtons, 1), np.nan), np.isfinite(newtons).sum(1)
            peak = np.where(np.isnan(kpa), -np.inf, kpa).max(1)
            mean = force / (np.maximum(filled, 1) * self.model.pitch_area_m2 * PA_PER_KPA)
            area = self.touched[:, inside].sum(1) * self.model.pitch_area_m2 * 1e6
            values = (force, mean, np.where(count, peak, np.nan), area, inside.sum() - count)
            found |= {f"{name}_{column.key}": of for column, of in zip(_REGION, values, strict=True)}
        return found

    def regional(self, k: int) -> Table:
        """Force, mean and peak pressure and area of contact of each region in a frame."""
        rows = (
            (name, *finite([float(f"{self.regions[f'{name}_{c.key}'][k]:.4g}") for c in _REGION]))
            for name in self.model.regions
        )
        return Table("regions", "", (Column("region"), *_REGION), tuple(rows))

    def table(self) -> Table:
        """Force, centre of pressure, area and peak of each frame, and for programs those of each region."""
        (force, sigma), (x, y, *errors) = self.force_n, self.centre_mm
        columns = (
            Column("time", "s", key="time_s"), Column("force", "N", key="force_n"),
            Column("sigma F", "N", key="sigma_force_n"), Column("x", "mm", key="x_mm"), Column("y", "mm", key="y_mm"),
            Column("contact", "mm2", key="area_mm2"), Column("peak", "kPa", key="peak_kpa"),
            Column("not determined", key="undetermined"), Column("sigma x", "mm", key="sigma_x_mm"),
            Column("sigma y", "mm", key="sigma_y_mm"), *(Column(key, key=key, hidden=True) for key in self.regions),
        )  # fmt: skip
        dark = (np.isnan(self.pressure_kpa) & self.model.here).sum((1, 2))
        found = (self.time_s, force, sigma, x, y, self.area_mm2, self.peak_kpa, dark, *errors, *self.regions.values())
        return Table("frames", "", columns, tuple(map(tuple, finite(np.stack(found, 1)))))

    def heaviest(self) -> int:
        """Number of the frame with the largest force."""
        return int(np.nan_to_num(self.force_n[0], nan=-np.inf).argmax())

    def document(self) -> Iterator[Part]:
        """Summary and the heaviest frame; CSV has all frames."""
        table, k, count = self.table(), self.heaviest(), int(self.model.here.sum())
        dark = int(np.isnan(self.pressure_kpa[k])[self.model.here].sum())
        sigma = self.sigma_kpa[k][np.isfinite(self.sigma_kpa[k])]
        errors = "none is determined: readings are missing, of the other sign, or less than noise"
        if sigma.size:
            low, high = float(sigma.min()), float(sigma.max())
            of = "by the calibration" if self.calibration else "of noise and scatter alone"
            errors = f"standard errors {low:.3g} to {high:.3g} kPa in the heaviest frame, {of}"
        yield Facts((
            ("frames", f"{len(self.time_s)}, inverted by {self.by}"),
            ("pressures", errors),
            *((("not determined", f"{dark} of {count} crossings: {self._names(k)}"),) if dark else ()),
            *((("faults at rest", f"{', '.join(self.faults)} (r3:5: row 3 broken behind column 5; r2c4: a short)"),)
              if self.faults else ()),
        ))  # fmt: skip
        yield ""
        shown = tuple(float(f"{v:.4g}") if isinstance(v, float) else v for v in table.cells[k])
        yield Table("heaviest", "the heaviest frame", table.columns, (shown,))
        if self.model.regions:
            yield self.regional(k)
        if not self.calibration:
            yield from self.model.shared()
            yield from self.model.beyond(self.peak_kpa)
        yield from (f"doubtful: {doubt}" for doubt in self.model.crossing.doubts)
        if np.isnan(self.time_s).any():
            yield "no time_s: times of the frames are not known"
        yield from doubtful_time(self.time_s)

    def _names(self, k: int) -> str:
        """First crossings that a frame does not determine."""
        return _named(np.isnan(self.pressure_kpa[k]) & self.model.here)

    def csv(self) -> Iterator[str]:
        """All frames, a row each."""
        yield comma_separated(self.table())

    def npz(self) -> bytes:
        """Maps and numbers of every frame as NPZ."""
        target, (force, sigma), (x, y, x_error, y_error) = BytesIO(), self.force_n, self.centre_mm
        regions: dict[str, Any] = {**self.regions}
        np.savez_compressed(
            target, time_s=self.time_s, pressure_kpa=self.pressure_kpa, sigma_kpa=self.sigma_kpa, force_n=force,
            sigma_force_n=sigma, centre_x_mm=x, centre_y_mm=y, sigma_x_mm=x_error, sigma_y_mm=y_error,
            area_mm2=self.area_mm2, **regions,
        )  # fmt: skip
        return target.getvalue()

    def to_json(self) -> str:
        """Numbers of every frame as indented JSON."""
        table = self.table()
        keys = [column.key for column in table.columns]
        frames = [dict(zip(keys, row, strict=True)) for row in table.cells]
        found: dict[str, Any] = {
            "array": self.model.design.name,
            "by": self.by,
            "shared_factor": self.model.shared_factor,
            "frames": frames,
        }
        return to_json(found)


@dataclass
class MapPlan:
    """Choice between C/C0 and the network, by the heaviest frame so far; changed by further frames of a recording.

    Attributes
    ----------
    load : float
        Sum over crossings of C/C0 - 1 in that frame [-].
    worst : float
        Largest difference of both, in standard errors; infinite where the network did not settle.
    """

    load: float = -np.inf
    worst: float = 0.0

    @property
    def network(self) -> bool:
        """True where C/C0 does not suffice."""
        return not self.worst < _SUFFICES

    def words(self) -> str:
        """Model, and why."""
        if self.network:
            return f"the network of the tracks: C/C0 differs by {self.worst:.2g} standard errors in the heaviest frame"
        return f"C/C0: the network differs by at most {self.worst:.2g} standard errors in the heaviest frame"


@dataclass(frozen=True, eq=False)
class MapInverter:
    """Readings of one array to pressures, after its readings at rest.

    Attributes
    ----------
    model, readout : ArrayModel, ArrayReadout
        The array, and how it is read, at one frequency.
    rest_s : (m, n) array
        Mean of the readings at rest [S]; nan where one is missing, and the real part of capacitances alone.
    rest_count : int
        Frames in that mean.
    scatter : float
        Standard deviation of the gain from cell to cell [-].
    """

    model: ArrayModel
    readout: ArrayReadout
    rest_s: Complex
    rest_count: int
    scatter: float = SCATTER

    def __post_init__(self) -> None:
        """Refuse arrays too large for two terminals, of which no reading is its own crossing's alone."""
        if self.readout.kind == "two-terminal" and self.model.here.size > MOST_DENSE:
            raise BadInput(
                f"{self.model.here.size} crossings by two terminals; expected at most {MOST_DENSE}: read it guarded"
            )

    def read(self, capacitance_f: Real) -> CrossingReadings:
        """Readings of the network, with the breaks and shorts that the readings at rest show."""
        return self._network(self._tracks, capacitance_f, self.leaks_s)

    def _network(self, tracks: Tracks, capacitance_f: Real, leaks_s: Real) -> CrossingReadings:
        return readings(
            replace(tracks, capacitance_f=capacitance_f, leak_s=leaks_s), self.readout.frequency_hz[0],
            readout=self.readout.kind, input_ohm=self.readout.input_ohm,
        )  # fmt: skip

    @cached_property
    def _tracks(self) -> Tracks:
        tracks = self.model.tracks()
        if self.readout.kind != "guarded":  # by two terminals a loose track mixes all readings: none would be left
            return tracks
        return broken_where_dead(tracks, self.model.here, self._over_nominal < 1 / _ALIVE)

    @cached_property
    def _over_nominal(self) -> Real:
        """Size of the readings at rest over the predicted one, (m, n); nan where there is none [-]."""
        real, nominal = np.isfinite(self.rest_s.real), self.nominal.siemens
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.where(real, np.abs(self.rest_s), np.abs(self.rest_s.imag))
            return np.asarray(size / np.where(real, np.abs(nominal), np.abs(nominal.imag)))

    @cached_property
    def leaks_s(self) -> Real:
        """Conductance of shorted crossings, (m, n): those whose real part at rest is beyond what a crossing has [S]."""
        leaks: Real = np.zeros(self.model.here.shape)
        with np.errstate(invalid="ignore"):
            shorted = self.model.here & (self.rest_s.real > _SHORTED * np.abs(self.nominal.siemens))
        leaks[shorted] = self.rest_s.real[shorted]
        for _ in range(_LEAKS if shorted.any() else 0):
            read = self._network(self._tracks, self.model.capacitances(), leaks).siemens.real[shorted]
            ohm = 1 / leaks[shorted] + 1 / self.rest_s.real[shorted] - 1 / read
            leaks[shorted] = 1 / np.maximum(ohm, 1e-3 / leaks[shorted])
        return leaks

    @cached_property
    def faults(self) -> tuple[str, ...]:
        """Breaks, if guarded, and shorts that the readings at rest show, as in :func:`readout.faulty`."""
        whole, read = self.model.tracks(), self._tracks
        words = [f"r{i + 1}c{j + 1}" for i, j in np.argwhere(self.leaks_s > 0).tolist()]
        for letter, side in (("r", "row"), ("c", "column")):
            stretches, leads = (
                np.isinf(getattr(read, f"{side}_{part}")) & np.isfinite(getattr(whole, f"{side}_{part}"))
                for part in ("ohm", "lead_ohm")
            )
            stretches = stretches if side == "row" else stretches.T
            words += [f"{letter}{track + 1}:{after + 1}" for track, after in np.argwhere(stretches).tolist()]
            words += [f"{letter}{track + 1}:0" for track in np.flatnonzero(leads).tolist()]
        return tuple(words)

    @cached_property
    def parts(self) -> tuple[Mask, Mask]:
        """Parts of the readings that count, real and imaginary, (m, n) each: of crossings that read their own."""
        return np.isfinite(self.rest_s.real) & self.own, self.own

    @cached_property
    def nominal(self) -> CrossingReadings:
        """Readings of the array as predicted, at rest."""
        return self._network(self.model.tracks(), self.model.capacitances(), np.zeros(self.model.here.shape))

    @cached_property
    def alive(self) -> Mask:
        """Crossings that read at rest within a factor of what is predicted, and of its sign, (m, n): no others."""
        ratio = self._over_nominal
        with np.errstate(invalid="ignore"):
            near = (ratio > 1 / _ALIVE) & (ratio < _ALIVE) & self._same_sign(self.rest_s)
        return np.asarray(np.isfinite(self.rest_s.imag) & self.model.here & near)

    def _same_sign(self, siemens: Complex) -> Mask:
        """Readings with an imaginary part of the predicted one's sign: others are of no capacitance."""
        with np.errstate(invalid="ignore"):
            return np.asarray(siemens.imag * self.nominal.siemens.imag > 0)

    def refuse_dead(self) -> None:
        """BadInput where no crossing is alive, or where two capacitances give one reading."""
        if self.alive.any():
            self._refuse_ambiguous()
            return
        read, predicted = (self._median(each[self.model.here]) for each in (self.rest_s, self.nominal.siemens))
        raise BadInput(
            f"no crossing reads at rest within a factor of {_ALIVE:g} of what is predicted: the median imaginary part "
            f"is {read}, predicted {predicted}; expected siemens, or capacitance_f in farad, of this array"
        )

    def _refuse_ambiguous(self) -> None:
        """Refuse capacitances alone near 45 degrees: there the imaginary part is largest, and on both sides alike."""
        nominal = self.nominal.siemens[self.alive]
        phase = float(np.degrees(np.arctan2(np.abs(nominal.imag), np.abs(nominal.real)).min()))
        if not self.parts[0].any() and phase < _LEAST_PHASE:
            raise BadInput(
                f"capacitances alone at {si(self.readout.frequency_hz[0], 'Hz')}: the tracks turn the "
                f"phase to {phase:.0f} degrees, where two give one reading; expected siemens, or a lower frequency"
            )

    def _median(self, siemens: Complex) -> str:
        """Median of the imaginary parts, and the capacitance that it is, in words."""
        values = siemens.imag[np.isfinite(siemens.imag)]
        if not values.size:
            return "none"
        middle, hertz = float(np.median(values)), self.readout.frequency_hz[0]
        return f"{si(middle, 'S', 3)} ({si(middle / (2 * np.pi * hertz), 'F', 3)})"

    @cached_property
    def prior_f(self) -> Real:
        """Standard deviation of the capacitances before any reading, (m, n) [F]."""
        _, slope = self.model.under(np.zeros(1))
        c = self.model.capacitance.value
        return np.where(self.model.here, c * (float(slope[0]) * FULL_SCALE_PA + 1.0), 1e-6 * c)

    @cached_property
    def gain(self) -> tuple[Real, Real]:
        """Capacitances by weighed readings, (m n, 2 m n) or of each crossing alone, and their variances [F2]."""
        return self._open if (self.own == self.alive).all() else self._gain(self.own)

    @cached_property
    def _open(self) -> tuple[Real, Real]:
        """Gain by the readings of all crossings that are alive."""
        return self._gain(self.alive)

    def _gain(self, counted: Mask, at_f: "Real | None" = None) -> tuple[Real, Real]:
        """Gain by some readings, with slopes at some capacitances, or at those predicted."""
        real, imaginary = np.isfinite(self.rest_s.real) & counted, counted
        weight = np.concatenate([part.ravel() for part in self._weights(real, imaginary)])
        working = self.read(self.model.capacitances() if at_f is None else at_f)
        if self.model.here.size > MOST_DENSE:
            slopes = working.own_slopes()
            by = np.stack([slopes.real.ravel(), slopes.imag.ravel()]) * weight.reshape(2, -1)
            variance = 1 / ((by**2).sum(0) + 1 / self.prior_f.ravel() ** 2)
            return by * variance, variance
        matrix = working.matrix()
        slopes_all = np.vstack([matrix.real, matrix.imag]) * weight[:, None]
        spread = np.linalg.inv(slopes_all.T @ slopes_all + np.diag(1 / self.prior_f.ravel() ** 2))
        return spread @ slopes_all.T, np.diag(spread)

    def _weights(self, real: Mask, imaginary: Mask) -> tuple[Real, Real]:
        sigma = self.readout.sigma_s(self.nominal.siemens)
        return np.where(real, 1 / sigma, 0.0), np.where(imaginary, 1 / sigma, 0.0)

    def capacitances(self, siemens: Complex, start: Real) -> tuple[Real, Mask]:
        """Capacitances behind one frame, with the network, and which of them settled, (m, n) [F].

        Gauss-Newton with the slopes at rest, renewed where some steps do not end it: beside a loose track they change.
        The prior, as wide as full scale, keeps what no reading tells.
        """
        weights, (gain, variance) = self._weights(*self.parts), self.gain
        c, spread = start, np.sqrt(variance).reshape(start.shape)
        for number in range(1, _STEPS + 1):
            left = siemens - self.read(c).siemens
            off = np.stack([np.nan_to_num(left.real) * weights[0], np.nan_to_num(left.imag) * weights[1]])
            if self.model.here.size > MOST_DENSE:
                step = (gain * off.reshape(2, -1)).sum(0)
            else:
                step = gain @ off.ravel() - variance * ((c - start) / self.prior_f**2).ravel()
            before, c = c, np.maximum(c + step.reshape(c.shape), 1e-3 * start)
            worst = float((np.abs(c - before) / spread)[self.own].max(initial=0.0))
            if worst < _DONE:  # of a dead one the step goes on at the bound
                break
            if worst > _FAR and number % _RENEWED == 0:
                gain, variance = self._gain(self.own, c)
        return c, np.abs(c - before) < spread

    @cached_property
    def _rest(self) -> tuple[Real, Mask]:
        """Capacitances at rest of this print, with the network, and which of them settled, (m, n) [F]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.nan_to_num(self.rest_s.imag / self.nominal.siemens.imag, nan=1.0, posinf=1.0, neginf=1.0)
        start = self.model.capacitances() * np.where(self.model.here, np.clip(ratio, 0.1, 10.0), 1.0)
        return self.capacitances(self.rest_s, start)

    @cached_property
    def own(self) -> Mask:
        """Crossings that are alive, and whose readings are not those of others that nothing else tells, (m, n).

        Beside a short, the loose part of a broken track mixes what crosses it.
        """
        if self.model.here.size > MOST_DENSE or self.readout.kind != "guarded":
            return self.alive
        slopes = self.read(self.model.capacitances()).own_slopes()
        alone = self.readout.sigma_s(self.nominal.siemens) / np.maximum(np.abs(slopes), 1e-30)
        return self.alive & (self._open[1].reshape(alone.shape) < (_MIXED * alone) ** 2)

    def by_ratio(self, siemens: Complex) -> Real:
        """Capacitance over that at rest, of each crossing by its own reading alone [-]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.own, siemens.imag / self.rest_s.imag, np.nan)

    def by_network(self, siemens: Complex) -> Real:
        """Capacitance over that at rest with the network, frame by frame; nan where Gauss-Newton did not settle [-]."""
        start = np.nan_to_num(self.by_ratio(siemens), nan=1.0, posinf=1.0, neginf=1.0)
        rest, sure = self._rest
        each = (self.capacitances(one, rest * np.clip(own, 0.5, 5.0)) for one, own in zip(siemens, start, strict=True))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.stack([np.where(sure & settled, c / rest, np.nan) for c, settled in each])

    @cached_property
    def error(self) -> Real:
        """Error of C/C0 by noise, (m, n) [-]."""
        variance = self.gain[1].reshape(self.model.here.shape)
        return np.asarray(np.sqrt(variance) / np.where(self.model.here, self._rest[0], 1.0))

    @cached_property
    def correlation(self) -> "Real | None":
        """Of errors of capacitances by noise, (m n, m n), 0 of each with itself; none of large arrays [-]."""
        gain, variance = self.gain
        if self.model.here.size > MOST_DENSE:
            return None
        found = gain @ gain.T / np.sqrt(np.outer(variance, variance))
        np.fill_diagonal(found, 0.0)
        return np.asarray(found)

    def _compared(self, siemens: Complex, ratio: Real) -> float:
        """Largest difference of C/C0 from the network in a frame, in standard errors."""
        network = self.by_network(siemens[None])[0]
        counted = _known(self.error * self.model.pressures(np.ones(1))[1]) & self.own & np.isfinite(ratio)
        off = (np.abs(network - ratio) / self.error)[counted]
        return float(np.where(np.isnan(off), np.inf, off).max(initial=0.0))

    def planned(self, siemens: Complex, plan: "MapPlan | None" = None) -> tuple[Real, Real, str]:
        """Capacitance over that at rest (k, m, n), its error by noise (m, n), and by which model, and why.

        C/C0 up to the first frame in which it differs from the network, from there on the network. Frames are compared
        that are heavier by a tenth than all before, so that a frame has one answer, alone, in a lot or in a recording.
        """
        ratio, error, plan = self.by_ratio(siemens), self.error, plan or MapPlan()
        loads, light = np.nansum(np.where(self.own, ratio - 1, 0), (1, 2)), 0
        while light < len(loads) and not plan.network:
            if loads[light] > _HEAVIER * plan.load:
                plan.worst = max(plan.worst, self._compared(siemens[light], ratio[light]))
                plan.load = max(float(loads[light]), 0.0)
            light += not plan.network
        by, solved = plan.words(), siemens[light:]
        if not len(solved):
            return ratio, error, by
        ratio[light:] = np.where(np.isfinite(solved.imag) & self.own, self.by_network(solved), np.nan)
        if lost := int((np.isnan(ratio) & np.isfinite(siemens.imag) & self.own).sum()):
            by += f"; {lost} values left out that {_STEPS} steps of Gauss-Newton did not settle"
        return ratio, error, by

    def maps(
        self, siemens: Complex, time_s: Real, calibration: "ArrayCalibration | None" = None, day: float = nan,
        plan: "MapPlan | None" = None, past: "Past | None" = None,
    ) -> PressureMaps:  # fmt: skip
        """Pressure maps of frames, by the law of the cell, or of each element where they are calibrated."""
        plan = plan or MapPlan()
        ratio, error, by = self.planned(siemens, plan)
        pressure, per = self.model.pressures(np.nan_to_num(ratio, nan=1.0, posinf=1.0, neginf=1.0))
        noise = error * per * np.sqrt(1 + 1 / self.rest_count)
        sigma = np.hypot(noise, self.scatter * pressure)
        given = _known(sigma) & self.own & np.isfinite(ratio) & self._same_sign(siemens)
        if calibration:
            if calibration.readout not in ("", self.readout.kind):
                raise BadInput(f"a calibration of {calibration.readout} frames; expected no {self.readout.kind} ones")
            by += f"; {calibration.law.form.words()} of each element, calibrated"
            mean, half = calibration.of_ratio(ratio, time_s, calibration.counted(day), past)
            pressure, sigma = PA_PER_KPA * mean, PA_PER_KPA / NORMAL_90 * half
        shown, error_kpa = (np.where(given, each / PA_PER_KPA, np.nan) for each in (pressure, sigma))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.nan_to_num(np.minimum(noise / sigma, 1.0))
        correlation = self.correlation if plan.network else None
        return PressureMaps(self.model, by, time_s, shown, error_kpa, calibration, self.faults, share, correlation)


@dataclass(frozen=True, eq=False)
class _Field:
    """Gaussian field of mean 0 on some crossings, by its correlation of several lengths (Rasmussen and Williams 2006).

    Attributes
    ----------
    near, lost : array of int
        Determined crossings, and those that are not.
    forms : tuple of (values, vectors, across, own)
        Of each length: eigenvalues and vectors of the correlation of those near, correlation of lost ones with these
        vectors, and with each other.
    """

    near: Whole
    lost: Whole
    forms: tuple[tuple[Real, Real, Real, Real], ...]

    def at_lost(self, kpa: Real, sigma: Real) -> tuple[Real, Real]:
        """Conditional means and errors of lost crossings, (k, l), by pressures near, (k, n), and their errors.

        Length and size are the likeliest of each frame (eq. 5.8), the noise alike at all that are near.
        """
        noise = np.mean(sigma**2, 1)[:, None] + 1e-30
        lost, most = np.zeros((2, len(kpa), len(self.lost))), np.full(len(kpa), -np.inf)
        for values, vectors, across, own in self.forms:
            along, some = kpa @ vectors, 1 / (values + _RATIOS[:, None])  # noise over the field's variance
            likely = np.log(some * _RATIOS[:, None]).sum(1) - _RATIOS / noise * (along**2 @ some.T)
            likely -= values.size * np.log(noise)
            best = likely.argmax(1)
            better, most = likely.max(1) > most, np.maximum(most, likely.max(1))
            gain, size = some[best], noise / _RATIOS[best][:, None]
            spread = own.sum(0) - (gain * across.sum(0)) @ across.T
            lost[:, better] = np.stack([(gain * along) @ across.T, np.sqrt(size * np.maximum(spread, 0.0))])[:, better]
        return lost[0], lost[1]


@lru_cache(maxsize=4)
def _field(model: ArrayModel, known: bytes) -> _Field:
    """Field on the crossings that are not known, and those within some squares of them."""
    from scipy import ndimage

    here, read = model.here, np.frombuffer(known, bool).reshape(model.here.shape)
    lost = here & ~read
    near = here & read & ndimage.binary_dilation(lost, np.ones((3, 3)), iterations=_AROUND)
    place, forms = np.stack(np.meshgrid(model.layout.x_mm, model.layout.y_mm), -1), []
    (a, b), pitch = (place[near], place[lost]), float(np.sqrt(np.prod(model.layout.params.pitch)))
    for length in _LENGTHS:
        among, across, own = (
            _matern(np.hypot(*(one[:, None] - other).T).T / (length * pitch)) for one, other in ((a, a), (b, a), (b, b))
        )
        values, vectors = np.linalg.eigh(among)
        forms.append((np.maximum(values, 0.0), vectors, across @ vectors, own))
    return _Field(np.flatnonzero(near), np.flatnonzero(lost), tuple(forms))


def _matern(of: Real) -> Real:
    """Correlation of Matern, twice differentiable, by distances over the length."""
    root = np.sqrt(5.0) * of
    return np.asarray((1 + root + root**2 / 3) * np.exp(-root))


@lru_cache(maxsize=4)
def _back(model: ArrayModel, known: bytes) -> tuple[Callable[[Real], Real], "Real | None"]:
    """Pressures on the surface by those that some crossings carry, and squares of that matrix, transposed, if small."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import splu

    here = np.frombuffer(known, bool)
    own = csc_array(model.spread[here][:, here])
    back = splu(csc_array(diags_array(model.spread[here].sum(1) / own.sum(1)) @ own)).solve
    if own.shape[0] > MOST_DENSE:
        return back, None
    inverse = back(np.eye(own.shape[0]))
    return lambda pressure: inverse @ pressure, (inverse**2).T


def _named(which: Mask) -> str:
    """First crossings of some."""
    first = np.argwhere(which).tolist()
    return ", ".join(f"r{i + 1}c{j + 1}" for i, j in first[:_SHOWN]) + (", ..." if len(first) > _SHOWN else "")


def _known(sigma_pa: Real) -> Mask:
    """Pressures that a standard error determines, as in a study [Pa]."""
    return np.asarray(sigma_pa < DETERMINED * FULL_SCALE_PA)


def at_rest(
    model: ArrayModel, readout: ArrayReadout, frames: Complex, scatter: float = SCATTER, unused: Sequence[str] = ()
) -> MapInverter:  # fmt: skip
    """Inverter by frames at rest, (r, m, n) [S]; ``unused`` are columns that were not read.

    Raises
    ------
    BadInput
        No frame at rest, or no crossing that reads as predicted.
    """
    frames = missing(frames)
    if not len(frames):
        raise BadInput(
            "no frame at rest; expected 'rest' with 1 where nothing was on the array, or --rest FILE: what counts is "
            "the ratio to it, and a standing load is never taken for rest"
            + (f"; not read: {', '.join(unused[:_SHOWN])}" if unused else "")
        )
    inverter = MapInverter(model, readout, _mean(frames), len(frames), scatter)
    inverter.refuse_dead()
    return inverter


def inverted(
    model: ArrayModel, readout: ArrayReadout, siemens: Complex, rest: Mask, time_s: Real, scatter: float = SCATTER,
    apart: "Complex | None" = None, unused: Sequence[str] = (), calibration: "ArrayCalibration | None" = None,
    day: float = nan, surface: bool = True,
) -> PressureMaps:  # fmt: skip
    """Pressure maps of a recording.

    Parameters
    ----------
    model, readout : ArrayModel, ArrayReadout
        The array, and how it is read, at one frequency.
    siemens : (k, m, n) array
        Readings [S].
    rest : (k,) array of bool
        Frames with nothing on the array.
    time_s : (k,) array
        Of each frame [s].
    scatter : float
        Standard deviation of the gain from cell to cell [-].
    apart : (r, m, n) array, optional
        Readings at rest of another file, in place of those of this one [S].
    unused : sequence of str
        Samples that were not read, named where no frame is at rest.
    calibration : ArrayCalibration, optional
        Of each element.
    day : float
        Of the recording, as the calibration counts them [d].
    surface : bool
        Pressures on the cover; else those that cells carry under it.

    Raises
    ------
    BadInput
        No frame at rest, or none under load; no day, where the gain drifts.
    """
    inverter = at_rest(model, readout, siemens[rest] if apart is None else apart, scatter, unused)
    loaded = ~rest
    if not loaded.any():
        raise BadInput("all frames are at rest; expected some under load")
    frames = missing(siemens)[loaded]
    flicker = flickering(time_s[loaded], inverter.by_ratio(frames).reshape(len(frames), -1))
    flicker = flicker.reshape(model.here.shape)
    frames[:, flicker] = complex(nan, nan)
    maps = inverter.maps(frames, time_s[loaded], calibration, day)
    if flicker.any():
        maps = replace(maps, by=f"{maps.by}; left out, as they flicker: {_named(flicker)}")
    return maps.on_surface() if surface else maps


def missing(siemens: Complex) -> Complex:
    """Readings with both parts nan where one is missing: a complex nan may have an imaginary part of 0."""
    lost = np.isnan(siemens.real) & (siemens.imag == 0) | ~np.isfinite(siemens.imag)
    return np.asarray(np.where(lost, complex(np.nan, np.nan), siemens))


def _mean(frames: Complex) -> Complex:
    """Mean over frames; nan where a reading is missing in all of them."""
    count = np.isfinite(frames.imag).sum(0)
    real, imaginary = (np.nansum(part, 0) for part in (frames.real, frames.imag))
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.asarray(imaginary / count) * 1j
        mean.real = np.where(np.isfinite(frames.real).any(0), real / count, np.nan)
    return mean
