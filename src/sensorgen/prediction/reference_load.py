"""Response to a load, and by how much another sensor's differs: as readings, and as a press that is read from them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi, tan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability.fisher import bounds, relative
from sensorgen.prediction.identifiability.results import CANNOT_LOCATE, CANNOT_SENSE, GUESS
from sensorgen.prediction.inference import parts
from sensorgen.prediction.query import NOISE, Load
from sensorgen.prediction.rest_state import LOWEST_HZ
from sensorgen.prediction.results import Changes, Term

SOURCES = "sources"
_STEPS = 4  # of Gauss and Newton, to a press that is misread
_SETTLED = 1e-6  # relative step that is the last one, as the next would be about its square
_PARALLEL = 1e-9  # of the larger direction, below which another one does not tell; of a press, what is rounding
_MOST = 20.0  # force that a press is misread as, over its own [-]


class LoadedImpedance(NamedTuple):
    """Impedance under the load, its derivatives by force and position, and that at rest; a value per frequency."""

    pressed: Complex
    by_force: Complex
    by_position: Complex
    rest: Complex

    def shift(self) -> Real:
        """Logarithm of pressed over rest, by which a press is detected: its real parts before its imaginary ones."""
        return parts(np.log(self.pressed / self.rest))


@dataclass(frozen=True)
class Dispersed(Sensor):
    """A sensor whose permittivity and resistivity fall as powers of the frequency from ``LOWEST_HZ`` on.

    The permittivity has the loss that goes with its power by Kramers and Kronig, tan(n pi / 2) at every frequency.
    """

    permittivity_power: float = 0.0
    resistivity_power: float = 0.0

    def at(self, frequency_hz: float) -> Sensor:
        """The sensor at a frequency [Hz]."""
        over = frequency_hz / LOWEST_HZ
        top, bottom = (rho * over**-self.resistivity_power for rho in self.resistivity_ohm_m)
        return replace(
            self, tan_delta=self.tan_delta + tan(self.permittivity_power * pi / 2), resistivity_ohm_m=(top, bottom),
            capacitance_f_per_m=self.capacitance_f_per_m * over**-self.permittivity_power,
        )  # fmt: skip


class Assumption(NamedTuple):
    """Basis of a term of the error budget; the first three, ``source`` and ``at_least`` as of the term.

    ``sensors`` are those at the ends of its range, None where they are not known, and ``turns`` what it leads to beside
    their changes; ``factor`` and ``since_rest`` as of :meth:`ReferenceLoad.change`.
    """

    name: str
    what: str
    kind: Any
    sensors: Sequence[Sensor] | None
    source: str = SOURCES
    at_least: bool = False
    since_rest: bool = False
    turns: str = ""
    factor: float = 1.0


class ReferenceLoad:
    """The response to a load, to which responses of other sensors are compared.

    Raises
    ------
    OutOfRange
        A load that the sensor cannot take.
    """

    def __init__(
        self, sensor: Sensor, load: Load, noise: float = NOISE, on_bench: tuple[float, float] = (1.0, 1.0)
    ) -> None:
        self.sensor, self.force_n, self._noise, self._on_bench = sensor, load.force_n, noise, on_bench
        self.at = load.force_n, load.position_m
        self._frequency = np.asarray(load.frequency_hz, float)
        self._response = lru_cache(lambda other: other.response(self._frequency, *self.at))
        self._own = self._read(sensor)
        self._told = self._grades(sensor)

    def _read(self, sensor: Sensor) -> LoadedImpedance:
        """Values of a sensor; of one whose values depend on the frequency, by that of each tone."""
        if not isinstance(sensor, Dispersed):
            return LoadedImpedance(*(*self._response(sensor), sensor.impedance(self._frequency, 0.0, self.at[1])))
        tones = [(sensor.at(f), np.array([f])) for f in self._frequency.tolist()]
        read = [(*s.response(f, *self.at), s.impedance(f, 0.0, self.at[1])) for s, f in tones]
        return LoadedImpedance(*map(np.concatenate, zip(*read, strict=True)))

    def stress_pa(self) -> float:
        """Highest pressure under the tip [Pa]."""
        return float(np.max(self.sensor.stress_pa(*self.at)))

    def term(self, of: Assumption) -> Term:
        """An assumption by what it changes."""
        others = of.sensors or ()
        changes = None if of.sensors is None else self.change(*others, factor=of.factor, since_rest=of.since_rest)
        turned = ", ".join(filter(None, (of.turns, self.turns(changes, others))))
        return Term(of.name, of.what, of.kind, changes, of.at_least, of.source, turned)

    def change(self, *others: Sensor, factor: float = 1.0, since_rest: bool = False) -> Changes | None:
        """Largest changes over some other sensors, times a factor; None where one of them cannot take the load.

        ``since_rest`` if the sensor became another one after it was read at rest.
        """
        found = Changes()
        for other in others:
            try:
                read = self._read(other)
            except OutOfRange:
                return None
            z = [_difference(part(read.pressed), part(self._own.pressed)) for part in (np.abs, np.real, np.imag)]
            c = abs(other.capacitance_f_per_m / self.sensor.capacitance_f_per_m - 1)
            press = self._misread(read._replace(rest=self._own.rest) if since_rest else read)
            slope = _difference(read.by_force, self._own.by_force)
            found = found.max(Changes(*(factor * d for d in (*z, slope, c, *press))))
        return found

    def other_circuit(self) -> Changes:
        """Changes where values of one equivalent circuit are taken for those of the other.

        Cs = Cp (1 + D^2), Rp = Rs (1 + 1/D^2). A press is read from C and D: Z times 1 + D^2 or over it, as at rest.
        """
        own, changes = self._own, Changes()
        pressed, rest, slope = own.pressed, own.rest, own.by_force
        c_pressed, c = (_difference(np.abs(z) ** 2, z.imag**2) for z in (pressed, rest))
        r = _difference(np.abs(pressed) ** 2, pressed.real**2)
        for power in (2, -2):
            factor, at_rest = ((np.abs(z) / z.imag) ** power for z in (pressed, rest))
            grows = power * ((slope / pressed).real - slope.imag / pressed.imag)  # of the factor's logarithm, by force
            by_force = _difference(factor * (slope + grows * pressed), slope)
            press = self._misread(own._replace(pressed=factor * pressed, rest=at_rest * rest))
            changes = changes.max(Changes(c_pressed, r, c_pressed, by_force, c, *press))
        return changes

    def _misread(self, read: LoadedImpedance) -> tuple[float, float]:
        """By how much force and position [N], [m] are wrong that the sensor's own model finds in a reading.

        Least squares of the logarithms, by Gauss-Newton steps that stay on the sensor and within its law.
        """
        own, at, scale = self._own, np.array(self.at), np.array([self.force_n, self.sensor.length_m])
        sought = read.shift()
        for _ in range(_STEPS):
            by = np.column_stack([parts(own.by_force / own.pressed), parts(own.by_position / own.pressed)])
            step = np.linalg.lstsq(by * scale, sought - own.shift(), rcond=_PARALLEL)[0]
            after = np.clip(at + step * scale, 0.0, [_MOST * self.force_n, self.sensor.length_m])
            if np.abs(step).max() < _SETTLED:
                at = after
                break
            try:
                pressed = self.sensor.response(self._frequency, *after.tolist())
            except OutOfRange:
                break
            own, at = LoadedImpedance(*pressed, own.rest), after
        off = np.abs(at - np.array(self.at))
        off[off < _PARALLEL * scale] = 0.0
        return float(off[0]), float(off[1])

    def _grades(self, sensor: Sensor) -> tuple[float, float]:
        """Standard errors of force and position on a bench, over what a reading without information has."""
        found = bounds(relative(self._response(sensor), self.force_n), self._noise)
        guess = GUESS * self.force_n or 1.0, GUESS * sensor.length_m
        errors = np.nan_to_num((found.force_n, found.position_m), nan=np.inf) * self._on_bench / guess
        return float(errors[0]), float(errors[1])

    def turns(self, changes: Changes | None, others: Sequence[Sensor] = ()) -> str:
        """Verdict on a press that a change alone leads to: "cannot ..." of what the sensor does, or "" where none."""
        if changes is None or not self.force_n:
            return ""
        wrong = changes.force_n / (GUESS * self.force_n), changes.position_m / (GUESS * self.sensor.length_m)
        ends = [wrong, *map(self._grades, others)]
        words = zip((CANNOT_SENSE, CANNOT_LOCATE), self._told, zip(*ends, strict=True), strict=True)
        return ", ".join(cannot for cannot, own, of in words if own < 1 <= max(of))


def _difference(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Largest relative difference, 0 where both are 0 and inf where only the other is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.max(np.where(one == other, 0.0, np.abs(one - other) / np.abs(other)), initial=0.0))
