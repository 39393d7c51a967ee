"""Resolution of an array: pressure and force of every crossing, crosstalk, the smallest press, two presses apart."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from sensorgen.core.arrays import Mask, Real, finite
from sensorgen.core.document import Cell, Column, Facts, Part, Table, to_json
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM, si
from sensorgen.prediction.array import readout as readouts
from sensorgen.prediction.array.model import PA_PER_KPA, ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout

PRESS_N, PRESS_MM = 6.0, 10.0  # force of a press, and side of the square that it is on
APART = 3.0  # standard errors
_PHASES = (0.0, 0.125, 0.25, 0.375, 0.5)  # of a pitch, off the middle of a crossing
_PER_PITCH, _MOST = 8, 6  # distances to a pitch, and pitches
_STEP = 1e-3  # of a pitch


def pressures(model: ArrayModel, presses: Real) -> Real:
    """Mean pressure on the square of each crossing by presses of force [N], x and y [mm] in rows, (m, n) [Pa]."""
    found = np.zeros(model.here.shape)
    for force_n, x, y in presses:
        of = [
            np.clip(np.minimum(np.array(at) + pitch / 2, to + PRESS_MM / 2)
                    - np.maximum(np.array(at) - pitch / 2, to - PRESS_MM / 2), 0.0, None) / PRESS_MM
            for at, pitch, to in zip((model.layout.y_mm, model.layout.x_mm), model.layout.params.pitch[::-1], (y, x),
                                     strict=True)
        ]  # fmt: skip
        found += force_n / model.pitch_area_m2 * np.outer(*of)
    return found


def distance_mm(model: ArrayModel, information: Real) -> float:
    """Distance from which two equal presses are seen as two, wherever they lie; infinite if none that is tried does.

    Presses of unknown force and place, along rows and along columns: the difference of their places is above
    ``APART`` standard errors, by the Cramer-Rao bound with priors of a press's own force and of the array's size.

    Parameters
    ----------
    information : (k, k) or (k,) array
        On the pressures on the surface [1/Pa2].
    """
    from scipy.sparse import diags_array

    matrix = diags_array(information) if information.ndim == 1 else information
    step = max(model.layout.params.pitch) / _PER_PITCH
    most = _PER_PITCH * _pitches(model)
    for k in range(most, 0, -1):
        ways = product((0, 1), _PHASES, _PHASES)
        if not all(_are_apart(model, matrix, k * step, *way) for way in ways):
            return (k + 1) * step if k < most else float("inf")
    return step


def _pitches(model: ArrayModel) -> int:
    """Pitches up to which presses are tried: beyond, one of them may lie off the array."""
    return max(1, min(_MOST, int(min(model.here.any(1).sum(), model.here.any(0).sum())) - 2))


def _are_apart(model: ArrayModel, information: Real, distance: float, axis: int, dx: float, dy: float) -> bool:
    """Two presses along x or y, around the middle crossing and off it by a share of the pitch."""
    of, pitch = model.layout, model.layout.params.pitch
    crossings = np.argwhere(model.here)
    i, j = crossings[np.abs(crossings - crossings.mean(0)).sum(1).argmin()]
    middle = np.array([of.x_mm[j] + dx * pitch[0], of.y_mm[i] + dy * pitch[1]])
    half = np.eye(2)[axis] * distance / 2
    presses = np.array([[PRESS_N, *(middle - half)], [PRESS_N, *(middle + half)]])
    steps = np.diag([_STEP * PRESS_N, *(_STEP * np.array(pitch))] * 2).reshape(6, 2, 3)
    rises = [pressures(model, presses + step) - pressures(model, presses - step) for step in steps]
    slopes = np.stack([rise.ravel() / (2 * step.max()) for rise, step in zip(rises, steps, strict=True)], 1)
    prior = [PRESS_N, *(side / 12**0.5 for side in of.size_mm)] * 2
    spread = np.linalg.inv(slopes.T @ (information @ slopes) + np.diag(np.array(prior) ** -2.0))
    one, other = 1 + axis, 4 + axis
    return bool(APART**2 * (spread[one, one] + spread[other, other] - 2 * spread[one, other]) < distance**2)


def count(model: ArrayModel, distance: float) -> int:
    """Number of presses so far apart on the sensing area; 1 at least."""
    return max(1, int(model.here.sum() * model.pitch_area_m2 / (distance * M_PER_MM) ** 2))


DETECTED = 3.0  # standard errors
DETERMINED = 0.5  # of the prior's standard deviation: a pressure known no better is not determined
LOADS_KPA = (100.0, 200.0, 357.0)  # 357: the peak of a foot's map


@dataclass(frozen=True, eq=False)
class ArrayStudy:
    """An array under an even pressure, read in one way.

    Attributes
    ----------
    model : ArrayModel
        The array.
    readout : ArrayReadout
        How it is read.
    pressure_kpa : float
        Even on the surface [kPa].
    sigma_kpa : (m, n) array
        Standard error of each pressure from one frame; nan outside the outline [kPa].
    crosstalk : (m, n) array or None
        Largest effect of another crossing at the lowest frequency [-]; None of large arrays.
    faults : tuple of str
        That the network has.
    apart_mm : float
        Distance from which two presses are seen as two; infinite of none [mm].
    short : float
        Probability that a crossing is shorted, P(short) of its print [-].
    notes : tuple of str
        What is said of its print.
    """

    model: ArrayModel
    readout: ArrayReadout
    pressure_kpa: float
    sigma_kpa: Real
    crosstalk: "Real | None"
    faults: tuple[str, ...] = ()
    apart_mm: float = np.inf
    short: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def determined(self) -> Mask:
        """Crossings whose pressure a frame determines, (m, n) of bool."""
        return np.asarray(self.sigma_kpa < DETERMINED * readouts.FULL_SCALE_PA / PA_PER_KPA)

    @property
    def sigma_n(self) -> Real:
        """Standard error of the force on the square of each crossing, (m, n) [N]."""
        return self.sigma_kpa * PA_PER_KPA * self.model.pitch_area_m2

    def _facts(self) -> Iterator[tuple[str, str]]:
        model, readout = self.model, self.readout
        (m, n), p, count = model.here.shape, model.layout.params, int(model.here.sum())
        yield (
            "array",
            (
                f"{m} rows x {n} columns, {count} crossings of {p.column_mm:g} x {p.row_mm:g} mm, pitch "
                f"{p.pitch[0]:.4g} x {p.pitch[1]:.4g} mm, {len(model.wires())} wires; {model.crossing.body.provenance}"
            ),
        )
        yield "crossing", f"{model.capacitance.words()} at rest, {self._rises()}"
        edges = model.fringe
        words = (
            f"edges of the tracks are {100 * edges.share:.3g} % of its own area's capacitance "
            f"({100 * edges.least:.2g} to {100 * edges.most:.2g} %); the rise is {edges.gain:.2f} of the cell's"
        )
        yield "fringe", words
        if model.load_factor != 1:
            yield "load", f"a cell carries {model.load_factor:.2f} times the pressure on the surface"
        sheet, of = f" and {p.cover_mm:g} mm of {p.cover_mpa:g} MPa" if p.cover_mm else "", 100 * model.kernel
        words = (
            f"of a press on one square its cell feels {of[0, 0]:.3g} %, each neighbour of the row {of[0, 1]:.2g} % "
            f"and of the column {of[1, 0]:.2g} %, through columns, isolation{sheet} (loose layers on springs)"
        )
        yield "cover", words
        ends = [wire.end_ohm for wire in model.wires()]
        yield (
            "tracks",
            (
                f"rows {model.row_ohm.words()}, columns {model.column_ohm.words()} per square; "
                f"{si(min(ends), 'ohm', 3)} to {si(max(ends), 'ohm', 3)} from pad to far end"
            ),
        )
        tones = ", ".join(si(f, "Hz") for f in readout.frequency_hz)
        by = f"through {readout.input_ohm:g} ohm" if readout.kind == "guarded" else "the rest floating"
        noise = " and ".join([*([f"{readout.noise:.2g} of a reading"] if readout.noise else []),
                              *([si(readout.noise_s, "S")] if readout.noise_s else [])])  # fmt: skip
        yield "readout", f"{readout.kind}, {by}, {tones}, noise {noise}; {1 / readout.frame_s(model):.3g} frames/s"
        if self.short:
            words = (
                f"{100 * self.whole:.3g} % of prints have no short at P(short) {self.short:g} of a crossing; "
                f"{count * self.short:.3g} are shorted on average"
            )
            yield "yield", words
        if self.faults:
            yield "faults", f"{', '.join(self.faults)}: {self._lost()}"

    @property
    def whole(self) -> float:
        """Probability that a print has no short, crossings by themselves [-]."""
        return float((1 - self.short) ** self.model.here.sum())

    def _lost(self) -> str:
        dark = int((self.model.here & ~self.determined).sum())
        return f"{dark} of {int(self.model.here.sum())} crossings are not determined"

    def _rises(self) -> str:
        model = self.model
        ratio, _ = model.under(np.array(LOADS_KPA) * PA_PER_KPA)
        words = (f"{100 * (r - 1):+.3g} % at {p:g} kPa" for r, p in zip(ratio.tolist(), LOADS_KPA, strict=True))
        known = model.known_pa / PA_PER_KPA
        return ", ".join(words) + (f" (law known to {known:.0f} kPa, then straight)" if known < LOADS_KPA[-1] else "")

    def document(self) -> Iterator[Part]:
        """Cell, tracks, readout, and a table of what is resolved."""
        yield Facts((*self._facts(), *(("print", note) for note in self.notes)))
        yield ""
        sigma, force = (each[self.model.here & self.determined] for each in (self.sigma_kpa, self.sigma_n))
        if not sigma.size:
            yield f"no pressure is determined at {self.pressure_kpa:g} kPa: a standard error is the prior's"
            return
        rows: list[tuple[Cell, ...]] = [
            (name, *(float(f"{value:.4g}") for value in (of(sigma), of(force), DETECTED * of(force))))
            for name, of in (("best crossing", np.min), ("median", np.median), ("worst", np.max))
        ]
        columns = (
            Column("", key="crossing"), Column("sigma p", "kPa", key="sigma_kpa"),
            Column("sigma F", "N", key="sigma_n"), Column("smallest press", "N", key="least_n"),
        )  # fmt: skip
        yield Table("resolution", "", columns, tuple(rows))
        yield (
            f"(standard errors of one frame at {self.pressure_kpa:g} kPa, of noise alone; smallest press: "
            f"{DETECTED:g} sigma on one crossing)"
        )
        press = f"of {PRESS_N:g} N on {PRESS_MM:g} x {PRESS_MM:g} mm"
        yield (
            f"two presses {press} are seen as two from {self.apart_mm:.3g} mm on, wherever they lie: "
            f"{count(self.model, self.apart_mm)} at once"
            if np.isfinite(self.apart_mm)
            else f"two presses {press} are not seen as two at every place up to "
            f"{_pitches(self.model) * max(self.model.layout.params.pitch):.3g} mm apart: farther ones were not tried"
        )
        yield from self.model.shared()
        yield from self.model.beyond(np.array([self.pressure_kpa]))
        if self.crosstalk is not None:
            shares = self.crosstalk[self.determined]
            yield (
                f"crosstalk: another crossing changes a reading by at most {shares.max():.2g} of what its own does "
                f"(median {np.median(shares):.2g})"
            )
        if self.model.here.size > readouts.MOST_DENSE:
            most = readouts.MOST_DENSE
            yield f"above {most} crossings each standard error is as if all other capacitances were known"
        yield from (f"doubtful: {doubt}" for doubt in self.model.crossing.doubts)
        yield "left out: strays of the cable, contact resistance"

    def record(self) -> dict[str, Any]:
        """Numbers by crossing, null outside the outline and where nothing is determined."""
        return {
            "rows": self.model.here.shape[0],
            "columns": self.model.here.shape[1],
            "capacitance_f": self.model.capacitance,
            "row_ohm_per_square": self.model.row_ohm,
            "column_ohm_per_square": self.model.column_ohm,
            "load_factor": self.model.load_factor,
            "pressure_kpa": self.pressure_kpa,
            "shared_factor": self.model.shared_factor,
            "sigma_kpa": finite(np.where(self.determined, self.sigma_kpa, np.nan)),
            "sigma_n": finite(np.where(self.determined, self.sigma_n, np.nan)),
            "crosstalk": None if self.crosstalk is None else finite(self.crosstalk),
            "apart_mm": finite(self.apart_mm),
            "frames_per_s": 1 / self.readout.frame_s(self.model),
            "faults": self.faults,
            "notes": self.notes,
            "yield": self.whole if self.short else None,
        }

    def to_json(self) -> str:
        """The record as indented JSON."""
        return to_json(self.record())


def study(
    model: ArrayModel, readout: ArrayReadout, pressure_kpa: float = 100.0, faults: Sequence[str] = (),
    short: float = 0.0,
) -> ArrayStudy:  # fmt: skip
    """Resolution of an array under an even pressure.

    Parameters
    ----------
    model, readout : ArrayModel, ArrayReadout
        The array, and how it is read.
    pressure_kpa : float
        On the surface [kPa].
    faults : sequence of str
        As of :func:`sensorgen.prediction.array.readout.faulty`.
    short : float
        Probability that a crossing is shorted [-].

    Raises
    ------
    OutOfRange
        A pressure below 0.
    """
    if not 0 <= pressure_kpa < np.inf:
        raise OutOfRange(f"a pressure of {pressure_kpa:g} kPa; expected 0 or more")
    ratio, slope = model.under(np.array(pressure_kpa * PA_PER_KPA))
    per_pa = model.capacitance.value * float(slope)
    whole = model.tracks(model.capacitances(float(ratio)))
    read = readout.read(readouts.faulty(whole, faults, model.here))
    prior = np.where(model.here, per_pa * readouts.FULL_SCALE_PA, 1e-6 * model.capacitance.value).ravel()
    found = readouts.information(read, readout, model.here, readout.read(whole) if faults else None)
    known = (found / model.undone**2) if found.ndim == 1 else (np.asarray(model.spread.T @ found @ model.spread))
    spread = readouts.covariance(known, prior)
    variance = spread if spread.ndim == 1 else np.diag(spread)
    sigma = np.sqrt(variance).reshape(model.here.shape) / per_pa / PA_PER_KPA
    small = model.here.size <= readouts.MOST_DENSE
    return ArrayStudy(
        model, readout, pressure_kpa, np.where(model.here, sigma, np.nan),
        readouts.crosstalk(read[0]) if small else None, tuple(faults), distance_mm(model, known * per_pa**2), short,
    )  # fmt: skip
