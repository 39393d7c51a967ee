"""Response of a sensor to a load: R, X and their slopes over force and position, and the inverse map (thesis Ch. 6)."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.analysis.plots.figure import Axis, Curve, Figure, Map, Panel, frequency, look, scale
from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.models.sensor import Sensor

LARGEST = 500_000  # points that a page in a browser still draws at once
MOST_FREQUENCIES = 24  # panels that a picture still shows
LINES = 7  # of constant force, and of constant position
POSITION, FORCE = Axis("position [mm]"), Axis("force [N]")


@dataclass(frozen=True)
class RealQuantity:
    """A real quantity over force and position."""

    symbol: str
    title: str
    unit: str


QUANTITIES = {
    "resistance": RealQuantity("R", "Resistance R, real part of the impedance", "Ω"),
    "reactance": RealQuantity("X", "Reactance X, imaginary part of the impedance", "Ω"),
    "resistance-by-position": RealQuantity("dR/dx", "Change of resistance per position, dR/dx", "Ω/mm"),
    "resistance-by-force": RealQuantity("dR/dF", "Change of resistance per force, dR/dF", "Ω/N"),
    "reactance-by-position": RealQuantity("dX/dx", "Change of reactance per position, dX/dx", "Ω/mm"),
    "reactance-by-force": RealQuantity("dX/dF", "Change of reactance per force, dX/dF", "Ω/N"),
}


@dataclass(frozen=True)
class ResponseMap:
    """Impedance and its slopes; the axes of the arrays are frequency, force and position.

    Attributes
    ----------
    frequency_hz, force_n, position_mm : (n,) array
        Frequencies [Hz], forces [N], centres of the tip [mm].
    impedance_ohm : complex array
        Impedance [ohm].
    by_force_ohm_per_n, by_position_ohm_per_mm : complex array
        Its exact derivatives [ohm/N], [ohm/mm].
    tip_mm, length_mm : float
        Of the tip and of the sensor [mm].
    """

    frequency_hz: Real
    force_n: Real
    position_mm: Real
    impedance_ohm: Complex
    by_force_ohm_per_n: Complex
    by_position_ohm_per_mm: Complex
    tip_mm: float
    length_mm: float

    def values(self, name: str) -> Real:
        """One of ``QUANTITIES``, over frequency, force and position, in the unit named there."""
        slopes = {"position": self.by_position_ohm_per_mm, "force": self.by_force_ohm_per_n}
        part, _, by = name.partition("-by-")
        source = slopes.get(by, self.impedance_ohm)
        return np.asarray(source.real if part == "resistance" else source.imag)

    def on_sensor(self) -> Mask:
        """Positions where the whole tip rests on the sensor; all, where it does at none."""
        half = self.tip_mm / 2 * (1 + 1e-9)  # where the tip just reaches an end, the slopes jump
        inside = (self.position_mm > half) & (self.position_mm < self.length_mm - half)
        return inside if inside.any() else ~inside

    def folds(self) -> Mask:
        """Loads beyond which (F, x) -> (R, X) turns over: the sign of its determinant changes towards the next."""
        turning = (np.conj(self.by_force_ohm_per_n) * self.by_position_ohm_per_mm).imag
        turning = np.sign(np.where(np.abs(turning) > 1e-12 * np.abs(turning).max(initial=0), turning, 0))
        folded = np.zeros(turning.shape, bool)
        folded[:, :-1] |= turning[:, :-1] * turning[:, 1:] < 0
        folded[:, :, :-1] |= turning[:, :, :-1] * turning[:, :, 1:] < 0
        return folded


def response(
    sensor: Sensor, frequency_hz: Sequence[float], force_n: Sequence[float], position_mm: Sequence[float]
) -> ResponseMap:
    """Work out what is drawn.

    Parameters
    ----------
    sensor : Sensor
        Under load.
    frequency_hz, force_n, position_mm : sequence of float
        Frequencies [Hz], forces [N] and centres of the tip [mm], each rising.

    Raises
    ------
    OutOfRange
        Too little or too much to draw; a position or a force beyond the sensor's range.
    """
    f, force, at = (np.asarray(values, float) for values in (frequency_hz, force_n, position_mm))
    if min(len(force), len(at)) < 2:
        raise OutOfRange(f"{len(force)} force(s) and {len(at)} position(s) make no map; expected two or more of each")
    if len(f) > MOST_FREQUENCIES or math.prod(map(len, (f, force, at))) > LARGEST:
        raise OutOfRange(
            f"{len(f)} frequencies, {len(force)} forces and {len(at)} positions are too much to draw; "
            f"expected up to {MOST_FREQUENCIES} frequencies and {LARGEST} points in all: use larger steps"
        )
    result = sensor.response(f[:, None, None], force[:, None], at * M_PER_MM)
    by_mm = result.by_position_ohm_per_m * M_PER_MM
    size = (sensor.tip_m / M_PER_MM, sensor.length_m / M_PER_MM)
    return ResponseMap(f, force, at, result.impedance_ohm, result.by_force_ohm_per_n, by_mm, *size)


def lines(frequency_hz: Sequence[float], force_n: Real, position_mm: Real, impedance_ohm: Complex, name: str) -> Figure:
    """R and X as lines over the longer of force and position, for some values of the other, at two frequencies.

    Parameters
    ----------
    frequency_hz, force_n, position_mm : (f,), (n,), (m,) array
        Axes [Hz], [N], [mm].
    impedance_ohm : (f, n, m) complex array
        Over them [ohm].
    name : str
        Of the design.
    """
    over_force = len(force_n) > len(position_mm)
    x, others, unit = (force_n, position_mm, "mm") if over_force else (position_mm, force_n, "N")
    z = impedance_ohm.swapaxes(1, 2) if over_force else impedance_ohm  # the longer axis last
    which = np.unique(np.linspace(0, len(others) - 1, min(LINES, len(others))).round().astype(int)).tolist()
    panels = []
    for k in sorted({0, len(frequency_hz) - 1}):
        at = frequency(frequency_hz[k])
        for symbol, part in (("R", z[k].real), ("X", z[k].imag)):
            divisor, ohm = scale(part, "Ω")
            curves = tuple(
                Curve(kind, f"{others[j]:g} {unit}" if kind == "line" else "", x, part[j] / divisor, **look(n))
                for n, j in enumerate(which) for kind in ("line", "points")
            )  # fmt: skip
            panels.append(Panel(curves, FORCE if over_force else POSITION, Axis(f"{symbol} [{ohm}] at {at}")))
    along = "force" if over_force else "position"
    return Figure("response", f"{name} under load", f"R and X over {along}.", {"": tuple(panels)}, columns=2)


def quantity(of: ResponseMap, name: str) -> Figure:
    """One of ``QUANTITIES`` over force and position, at each frequency.

    The colours span the positions where the whole tip rests on the sensor, of slopes without the extreme 4 %, mostly
    those of the first touch: they are so large that they would hide all others.
    """
    about, values = QUANTITIES[name], of.values(name)
    loaded = np.ix_(of.force_n >= 0, of.on_sensor())
    choices = {}
    for k, f in enumerate(of.frequency_hz):
        divisor, unit = scale(values[k][loaded], about.unit)
        shown = values[k] / divisor
        low, high = np.percentile(shown[loaded], (2, 98) if "-by-" in name else (0, 100)).tolist()
        label = f"{about.symbol} [{unit}]"
        plain = Map(of.position_mm, of.force_n, shown, label, low, high)
        content = (replace(plain, levels=_levels(*plain.span)),)
        choices[frequency(f)] = (Panel(content, POSITION, FORCE, title=f"{label} at {frequency(f)}"),)
    alt = f"{about.title}, over force and position; the colours span positions where the whole tip rests on the sensor."
    return Figure(name, about.title, alt, choices, "frequency", columns=4)


def _levels(low: float, high: float, count: int = 7) -> tuple[float, ...]:
    """Round numbers strictly between two others."""
    if not high > low:
        return ()
    step = 10.0 ** math.floor(math.log10((high - low) / count))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= count)
    return tuple(k * step for k in range(math.floor(low / step) + 1, math.ceil(high / step)))


def inverse(of: ResponseMap, which: str) -> Figure:
    """Inverse map: "position" or "force" over the plane of R and X, at each frequency (thesis Fig. 6.4).

    The plane is coloured where a load can lie. Where lines of constant force and of constant position run together,
    R and X do not determine both; where the map folds, two loads give the same R and X.
    """
    unit = {"position": "mm", "force": "N"}[which]
    colour = np.broadcast_to(of.position_mm if which == "position" else of.force_n[:, None], of.folds().shape[1:])
    forces, positions = (
        np.unique(np.linspace(0, len(v) - 1, min(LINES, len(v))).round().astype(int))
        for v in (of.force_n, of.position_mm)
    )
    choices = {}
    for k, f in enumerate(of.frequency_hz):
        r, x = of.values("resistance")[k], of.values("reactance")[k]
        (r_divisor, r_unit), (x_divisor, x_unit) = scale(r, "Ω"), scale(x, "Ω")
        r, x = r / r_divisor, x / x_divisor
        folded = of.folds()[k]
        content: tuple[Curve | Map, ...] = (
            Map(r, x, colour, f"{which} [{unit}]"),
            *(Curve("line", "", r[j], x[j], colour="#000000") for j in forces),
            *(Curve("line", "", r[:, i], x[:, i], colour="#000000", dash="dash") for i in positions),
            *([Curve("points", "", r[folded], x[folded], colour="#ff0000")] if folded.any() else []),
        )
        choices[frequency(f)] = (
            Panel(content, Axis(f"R [{r_unit}]"), Axis(f"X [{x_unit}]"), title=frequency(f)),
        )  # fmt: skip
    folds = "; red: folds" if of.folds().any() else ""
    solid, dashed = (
        ", ".join(f"{v:.3g}" for v in values) for values in (of.force_n[forces], of.position_mm[positions])
    )
    title = f"{which.capitalize()} from R and X\nsolid lines: {solid} N; dashed: {dashed} mm{folds}"
    alt = (
        f"{which.capitalize()} in colours over R and X. Lines of constant force are solid, of constant position dashed."
    )
    return Figure(f"inverse-{which}", title, alt, choices, "frequency", columns=4)


def figures(of: ResponseMap) -> Iterator[Figure]:
    """All of them: quantities, then the inverse maps."""
    yield from (quantity(of, name) for name in QUANTITIES)
    yield from (inverse(of, which) for which in ("position", "force"))
