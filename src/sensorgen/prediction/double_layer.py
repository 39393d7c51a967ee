"""Double sensors: information of a second film, and the effect of a touching body with and without isolation."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sensorgen.core.arrays import Complex, Real, finite
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import imported
from sensorgen.design.body import Body
from sensorgen.design.design import Design, make
from sensorgen.design.values import MaterialValue, material_value
from sensorgen.models.sensor import Sensor
from sensorgen.models.stack import Film, Press, Stack, StackResponse, Track, port
from sensorgen.prediction import bodies
from sensorgen.prediction.query import TIP_M, Query, Tip
from sensorgen.prediction.sensor_model import sensor_model
from sensorgen.solvers.multiline import GroundTie, Touch, standard_errors


@dataclass(frozen=True)
class Stacked:
    """Stacks of a design.

    Attributes
    ----------
    own, double : Stack
        As drawn; and with two films: the same for a double sensor, two equal films for any other.
    tip_m : float
        Length of the tip and of the touch [m].
    isolation_eps_r : float
        Relative permittivity of the isolation's material [-].
    taken : tuple of MaterialValue
        Material values used.
    doubts : tuple of str
        Why the numbers are uncertain.
    """

    own: Stack
    double: Stack
    tip_m: float
    isolation_eps_r: float
    taken: tuple[MaterialValue, ...]
    doubts: tuple[str, ...]


def stacked(
    design: Design, law: str = "", tip_m: float = TIP_M, body: Callable[[Design], Body] = bodies.default_body
) -> Stacked:
    """The stacks of a design.

    Parameters
    ----------
    design : Design
        Double, or any other.
    law, tip_m : str, float
        Law of compression, "" for the default; length of the tip and of the touch [m].
    body : callable
        The body of a design: as printed unless given, or :func:`sensorgen.prediction.bodies.drawn`.

    Raises
    ------
    SensorgenError
        As :func:`sensorgen.prediction.sensor_model.sensor_model`.
    """
    models = [sensor_model(body(half), Query(tip=Tip(tip_m), law=law))[0] for half in halves(design)]
    lower, upper = models[0], models[-1]
    double = stack_of([lower.sensor, upper.sensor])
    own = double if len(models) > 1 else stack_of([lower.sensor])
    material, source = design.slot("isolation")
    taken = {value for half in models for value in half.values}
    return Stacked(
        own, double, tip_m, material_value(material, source, "relative_permittivity").value,
        tuple(sorted(taken, key=lambda value: tuple(vars(value).values()))),
        tuple(dict.fromkeys(doubt for half in models for doubt in half.doubts)),
    )  # fmt: skip


def halves(design: Design) -> list[Design]:
    """A double sensor as the two sensors that share its middle electrode; any other design is its own only one."""
    if imported.middle(design.bodies):
        given = design.model_dump(exclude_defaults=True, mode="json")
        return [make(given | half) for half in imported.halves(design.geometry or "", design.bodies)]
    if design.shape == "double_tri":
        data = design.model_dump(include={"printer", "quality", "tools", "material_values", "own", "materials"})
        parameters = asdict(design.params) | {"isolation_mm": 0.0}
        lower = make(data | {"shape": "tri", "parameters": parameters})
        upper = data["materials"] | {"bottom_electrode": data["materials"]["top_electrode"]}
        return [lower, make(data | {"shape": "tri", "parameters": parameters, "materials": upper})]
    if design.shape != "double":
        return [design]
    p = design.params
    data = design.model_dump(include={"printer", "quality", "tools", "material_values", "own"}) | {"shape": "reference"}
    envelope = {f.name: getattr(p, f.name) for f in fields(p) if not f.name.endswith("dielectric_mm")}
    slots = design.model_dump(include={"materials"})["materials"]
    return [
        make(
            data
            | {
                "parameters": envelope | {"dielectric_mm": getattr(p, f"{half}_dielectric_mm"), "isolation_mm": 0.0},
                "materials": slots | {"dielectric": slots[part], "bottom_electrode": slots[below]},
            }
        )
        for half, part, below in (("lower", "film", "bottom_electrode"), ("upper", "dielectric", "top_electrode"))
    ]


def stack_of(sensors: Sequence[Sensor]) -> Stack:
    """Sensors on top of each other, from the bottom; each takes over the electrode below it from its neighbour.

    Parameters
    ----------
    sensors : sequence of Sensor
        Of one outline.
    """

    def track(sensor: Sensor, end: int) -> Track:
        section = sensor.electrode_m[end] * sensor.width_m
        return Track(sensor.resistivity_ohm_m[end] / section, sensor.piezoresistance_per_pa[end])

    first = sensors[0]
    films = [Film(s.capacitance_f_per_m, s.compression.capacitive_strain, s.tan_delta, s.leak_s_per_m) for s in sensors]
    tracks = (track(first, 1), *(track(sensor, 0) for sensor in sensors))
    return Stack(first.length_m, first.width_m, tracks, tuple(films))


def press_at(stacks: Stacked, force_n: float, position_m: float | None) -> Press:
    """The tip centred at a position, or in the middle; raises OutOfRange where it overhangs the sensor's end."""
    centre = stacks.own.length_m / 2 if position_m is None else position_m
    left = centre - stacks.tip_m / 2
    if not -1e-12 <= left <= stacks.own.length_m - stacks.tip_m + 1e-12:
        raise OutOfRange(
            f"a tip of {stacks.tip_m / M_PER_MM:g} mm at {centre / M_PER_MM:g} mm overhangs the sensor of "
            f"{stacks.own.length_m / M_PER_MM:g} mm: move it inwards"
        )
    return Press(force_n, max(left, 0.0), stacks.tip_m)


_ROUNDING = 1e-12  # relative difference of two readings or slopes below which it is rounding


def _difference(one: float, other: float) -> float:
    """Difference of two readings, without that of rounding [ohm]."""
    return 0.0 if abs(one - other) < _ROUNDING * (abs(one) + abs(other)) else one - other


@dataclass(frozen=True)
class DriftErrors:
    """Standard error with the permittivity known, and with it drifting; None where the readings have no information."""

    known: float | None
    drifting: float | None


@dataclass(frozen=True)
class ReadingErrors:
    """Standard errors of force [N] and position [m] of one way of reading."""

    reading: str
    force_n: DriftErrors
    position_m: DriftErrors


def bounds(stack: Stack, frequency_hz: Real, press: Press, noise: float, drift: float) -> tuple[ReadingErrors, ...]:
    """Cramer-Rao bounds from one film, from both readings, and from their difference alone.

    Parameters
    ----------
    stack : Stack
        With two films.
    frequency_hz : array
        Frequencies [Hz].
    press : Press
        Force and place.
    noise : float
        Standard deviation of real and imaginary part of each reading, relative to its modulus [-].
    drift : float
        Standard deviation of the drift of permittivity, the same in both films, relative [-].
    """
    response = stack.response(frequency_hz, press)
    upper, lower = port(2, 1, 2), port(1, 0, 2)
    size_upper, size_lower = (noise * np.abs(response.impedance_ohm @ p @ p) for p in (upper, lower))
    slopes = _slopes(response)
    by_upper, by_lower = slopes @ upper @ upper, slopes @ lower @ lower
    apart = by_upper - by_lower
    apart[np.abs(apart) < _ROUNDING * (np.abs(by_upper) + np.abs(by_lower))] = 0.0
    ways = {
        "lower film alone": _alone(stack, 0, frequency_hz, press, noise),
        "upper film alone": _alone(stack, 1, frequency_hz, press, noise),
        "both readings": (
            np.concatenate([by_upper, by_lower], axis=1), np.concatenate([size_upper, size_lower]),
        ),
        "difference alone": (apart, np.hypot(size_upper, size_lower)),
    }  # fmt: skip
    return tuple(ReadingErrors(name, *_errors(*way, drift)) for name, way in ways.items())


def _alone(stack: Stack, which: int, frequency_hz: Real, press: Press, noise: float) -> tuple[Complex, Real]:
    """Slopes and noise of one film between its two tracks, without the other film."""
    tracks, films = stack.tracks[which : which + 2], stack.films[which : which + 1]
    response = Stack(stack.length_m, stack.width_m, tracks, films).response(frequency_hz, press)
    return _slopes(response)[..., 0, 0], noise * np.abs(response.impedance_ohm[..., 0, 0])


def _slopes(response: StackResponse) -> Complex:
    """By force, position, and the drift that all films share, along a first axis."""
    drift = np.sum(response.by_film_ohm, axis=0)
    return np.stack([response.by_force_ohm_per_n, response.by_position_ohm_per_m, drift])


def _errors(slopes: Complex, noise: Real, drift: float) -> tuple[DriftErrors, DriftErrors]:
    """Prior knowledge of the drift is one more reading, of the drift itself."""
    known = standard_errors(slopes[:2], noise)
    aware = np.concatenate([slopes, np.array([[0.0], [0.0], [1.0]])], axis=1)
    drifting = standard_errors(aware, np.append(noise, drift))
    force, position = (DriftErrors(*finite([known[k], drifting[k]])) for k in (0, 1))
    return force, position


THICKEST_MM = 10.0  # isolation that is tried: the most that a design may have
_THINNEST_MM = 1e-4
ISOLATIONS_MM = (0.0, 0.1, 0.2, 0.5, 1.0)  # 0.1 is what the thesis proposes (7.2.7)


class Wiring(NamedTuple):
    """Connection of the instrument to the two electrodes of the uppermost film."""

    words: str
    top_at_ground: bool
    bridge: bool


WIRINGS = (
    Wiring("top driven", top_at_ground=False, bridge=False),
    Wiring("top at ground", top_at_ground=True, bridge=False),
    Wiring("bridge, either way round", top_at_ground=True, bridge=True),  # by reciprocity
)


@dataclass(frozen=True)
class TouchEffect:
    """Behind an isolation [mm]: largest relative shift of the reading [-], and the force it is mistaken for [N]."""

    isolation_mm: float
    largest_shift: float
    mistaken_for_n: float


@dataclass(frozen=True)
class TouchResult:
    """Effect of a touch by one wiring, and the isolation that is needed [mm]; None where 10 mm are not enough."""

    wiring: str
    by_isolation: tuple[TouchEffect, ...]
    needed_mm: float | None


@dataclass(frozen=True)
class Touching:
    """A body that lies on the sensor without pressing, and the reading with it.

    Attributes
    ----------
    stack : Stack
        As drawn; the reading is that of its uppermost film.
    eps_r : float
        Relative permittivity of the isolation [-].
    frequency_hz : array
        Frequencies [Hz].
    press : Press
        The press that a touch is mistaken for, at the same place.
    noise : float
        Relative noise, by which frequencies are weighted [-].
    body : GroundTie
        Its coupling to ground.
    """

    stack: Stack
    eps_r: float
    frequency_hz: Real
    press: Press
    noise: float
    body: GroundTie

    @cached_property
    def _pressed_ohm(self) -> Complex:
        return self.stack.impedance(self.frequency_hz, self.press)[..., -1, -1]

    @cached_property
    def _slope_ohm_per_n(self) -> Complex:
        return self.stack.response(self.frequency_hz, self.press).by_force_ohm_per_n[..., -1, -1]

    def unloaded_ohm(self) -> Complex:
        """The reading without touch or press, per frequency [ohm]."""
        return self.stack.impedance(self.frequency_hz)[..., -1, -1]

    def press_shift(self) -> float:
        """Largest relative change of the reading by the press alone, over all frequencies [-]."""
        unloaded = self.unloaded_ohm()
        return float(np.max(np.abs(self._pressed_ohm - unloaded) / np.abs(unloaded)))

    def shift_ohm(self, isolation_mm: float, wiring: Wiring) -> Complex:
        """Change of the pressed sensor's reading by a touch without force, per frequency [ohm]."""
        n, isolation_f_per_m = len(self.stack.films), np.inf
        if isolation_mm:
            isolation_f_per_m = EPS0_F_PER_M * self.eps_r * self.stack.width_m / (isolation_mm * M_PER_MM)
        touch = Touch(self.press.left_m, self.press.length_m, isolation_f_per_m, self.press.force_n)
        driven, low = (n - 1, n) if wiring.top_at_ground else (n, n - 1)
        touched = self.stack.touched(self.frequency_hz, touch, self.body, driven, low, wiring.bridge)
        return touched - self._pressed_ohm

    def force_n(self, isolation_mm: float, wiring: Wiring) -> float:
        """The force that a touch is mistaken for, its place being known: least squares over all frequencies [N]."""
        slope, modulus = self._slope_ohm_per_n, np.abs(self._pressed_ohm)
        weighted, shift = slope / modulus, self.shift_ohm(isolation_mm, wiring) / modulus
        return float(np.vdot(weighted, shift).real / np.vdot(weighted, weighted).real)

    def thickness_mm(self, within_n: float, wiring: Wiring) -> float | None:
        """Isolation from which on the mistaken force stays within a limit; None where 10 mm are not enough [mm].

        Searched from thick to thin: the error changes its sign on the way, and is small there by accident only.
        """

        def wrong(isolation_mm: float) -> bool:
            return abs(self.force_n(isolation_mm, wiring)) > within_n

        tried = [0.0, *np.geomspace(_THINNEST_MM, THICKEST_MM, 21).tolist()]
        last = max((k for k, t in enumerate(tried) if wrong(t)), default=None)
        if last is None:
            return 0.0
        if last == len(tried) - 1:
            return None
        low, high = tried[last : last + 2]
        while high - low > 2e-3 * high:
            middle = (low + high) / 2
            low, high = (middle, high) if wrong(middle) else (low, middle)
        return float(high)

    def result(self, wiring: Wiring, within_n: float, own_mm: float) -> TouchResult:
        """Effect of a touch behind isolations of several thicknesses, the design's own among them."""
        modulus = np.abs(self.unloaded_ohm())
        effects = tuple(
            TouchEffect(t, float(np.max(np.abs(self.shift_ohm(t, wiring)) / modulus)), self.force_n(t, wiring))
            for t in sorted({*ISOLATIONS_MM, own_mm})
        )
        return TouchResult(wiring.words, effects, self.thickness_mm(within_n, wiring))


_ASSUMPTIONS = (
    "both films carry the same force, the lower one spread no wider; bending is neglected",
    "double: the third electrode floats while the other two are read",
    "touch: 1.5 kohm of skin and 100 pF to ground (human body model, ANSI/ESDA/JEDEC JS-001)",
    "touch: the isolation has its full thickness under the body, without fringe",
)


@dataclass(frozen=True)
class FilmReadings:
    """Impedances of the lower and the upper film at one frequency [Hz], real and imaginary parts [ohm]."""

    frequency_hz: float
    lower_re: float
    lower_im: float
    upper_re: float
    upper_im: float


@dataclass(frozen=True)
class StackStudy:
    """A design as a stack.

    Attributes
    ----------
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    noise, drift : float
        Of a reading, relative to its modulus; of the films' permittivity, relative [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    readings_ohm : tuple of FilmReadings
        Under the press, per frequency.
    bounds : tuple of ReadingErrors
        Standard errors of force and position per way of reading.
    press_shift : float
        Largest relative change of the reading by the press [-].
    touch : tuple of TouchResult
        Effect of a touch, per wiring.
    values : tuple of MaterialValue
        Material values used.
    doubts, assumptions : tuple of str
        Why the numbers are uncertain, and what they assume.
    """

    force_n: float
    position_m: float
    noise: float
    drift: float
    within_n: float
    readings_ohm: tuple[FilmReadings, ...]
    bounds: tuple[ReadingErrors, ...]
    press_shift: float
    touch: tuple[TouchResult, ...]
    values: tuple[MaterialValue, ...]
    doubts: tuple[str, ...]
    assumptions: tuple[str, ...] = _ASSUMPTIONS

    def document(self) -> Iterator[Part]:
        """Readings of both films, standard errors by way of reading, and the effect of a touch."""
        yield (
            f"{self.force_n:g} N at {self.position_m / M_PER_MM:g} mm, noise {self.noise * 100:g} %; "
            f"it moves a reading by {self.press_shift * 100:.3g} %"
        )
        yield from ("", self._readings(), "", self._errors(), "", self._touches())
        yield f"needed: isolation from which on it stays within {self.within_n:g} N"
        yield ""
        yield from (f"doubt: {doubt}" for doubt in self.doubts)
        yield f"assumptions: {'; '.join(self.assumptions)}"

    def _readings(self) -> Table:
        heads = ("lower R", "lower X", "upper R", "upper X", "delta R", "delta X")
        readings = (
            (r.frequency_hz, r.lower_re, r.lower_im, r.upper_re, r.upper_im, _difference(r.upper_re, r.lower_re),
             _difference(r.upper_im, r.lower_im))
            for r in self.readings_ohm
        )  # fmt: skip
        columns = (Column("frequency", "Hz", si=True), *(Column(head) for head in heads))
        caption = "two films that share the middle electrode; R and X, and upper - lower [ohm]"
        return Table("readings", caption, columns, tuple(readings))

    def _errors(self) -> Table:
        columns = (
            Column("reading"), Column("sigma F", "N", si=True), Column("sigma x", "m", si=True),
            Column("with drift, F", "N", si=True), Column("x", "m", si=True),
        )  # fmt: skip
        errors = (
            (e.reading, e.force_n.known, e.position_m.known, e.force_n.drifting, e.position_m.drifting)
            for e in self.bounds
        )
        caption = f"standard errors, permittivity known, and where it may drift by {self.drift * 100:g} %"
        return Table("errors", caption, columns, tuple(errors))

    def _touches(self) -> Table:
        effects = (
            (f"{rows[0].isolation_mm:.4g} mm" if rows[0].isolation_mm else "bare",
             *(f"{r.largest_shift * 100:.2g} % {r.mistaken_for_n:.3g} N" for r in rows))
            for rows in zip(*(row.by_isolation for row in self.touch), strict=True)
        )  # fmt: skip
        needed = ("needed", *(_needed(row.needed_mm) for row in self.touch))
        caption = (
            "A body that touches the top beside the press: shift of the reading, and the force that it is mistaken for"
        )
        columns = (Column("isolation"), *(Column(row.wiring) for row in self.touch))
        return Table("touch", caption, columns, (*effects, needed))


def _needed(thickness_mm: float | None) -> str:
    if thickness_mm is None:
        return f"not even {THICKEST_MM:g} mm"
    return "none" if thickness_mm == 0 else f"{thickness_mm:.3g} mm"


def study(
    design: Design, frequency_hz: Sequence[float], force_n: float, position_m: float | None, noise: float, drift: float,
    within_n: float, law: str = "", tip_m: float = TIP_M,
) -> StackStudy:  # fmt: skip
    """Evaluate a design as a stack.

    Parameters
    ----------
    design : Design
        Double, or any other: it is then stacked twice.
    frequency_hz : sequence of float
        Frequencies of the readings [Hz].
    force_n, position_m : float
        The press: force [N], centre of the tip [m]; the middle of the sensor where None.
    noise : float
        Relative noise of a reading [-].
    drift : float
        Relative drift of the films' permittivity [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    law, tip_m : str, float
        Law of compression; length of the tip and of the touch [m].

    Raises
    ------
    SensorgenError
        As :func:`stacked` and :func:`press_at`.
    """
    stacks = stacked(design, law, tip_m)
    press, frequency = press_at(stacks, force_n, position_m), np.asarray(frequency_hz, float)
    z = stacks.double.impedance(frequency, press)
    touching = Touching(stacks.own, stacks.isolation_eps_r, frequency, press, noise, GroundTie())
    return StackStudy(
        force_n, float(np.asarray(press.left_m)) + tip_m / 2, noise, drift, within_n,
        tuple(
            FilmReadings(float(f), *(float(part) for k in (0, 1) for part in (m[k, k].real, m[k, k].imag)))
            for f, m in zip(frequency, z, strict=True)
        ),
        bounds(stacks.double, frequency, press, noise, drift), touching.press_shift(),
        tuple(touching.result(wiring, within_n, design.params.isolation_mm) for wiring in WIRINGS),
        stacks.taken, stacks.doubts,
    )  # fmt: skip
