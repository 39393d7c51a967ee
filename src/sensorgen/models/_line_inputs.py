"""What every line model is told: read, checked once, and turned into three sections."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.units import EPS0_F_PER_M

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Slices = tuple[slice, ...]

NAN = float("nan")  # stands for "no default": the value must be given
DEFAULTS = {
    "L_m": NAN, "W_m": NAN, "H_top_m": NAN, "H_bottom_m": NAN, "rho_top_ohm_m": NAN, "rho_bottom_ohm_m": NAN,
    "d_m": NAN, "eps_r": NAN, "f_Hz": NAN, "tan_delta": 0.0, "G_S_per_m": 0.0, "F_N": 0.0, "x_p_left_edge_m": 0.0,
    "L_p_m": 0.0, "E_Pa": NAN, "S_n_top_per_N": 0.0, "S_n_bottom_per_N": 0.0, "eps0_F_per_m": EPS0_F_PER_M,
}  # fmt: skip
FREE = {"F_N", "S_n_top_per_N", "S_n_bottom_per_N"}  # of either sign
ABOVE_0 = {"W_m", "H_top_m", "H_bottom_m", "d_m", "eps_r", "E_Pa", "eps0_F_per_m"}  # the others may be 0
ROUNDING = 1e-12  # of L: how far x + L_p may pass the end, since decimals do not add up exactly in binary

BLOCK = 1 << 16  # impedances at a time: temporaries stay in the cache and memory stays that of the answer


class Sections(NamedTuple):
    """A pressed line from the contacts to its far end: left of the patch, the patch, right of it."""

    r_ohm_per_m: tuple[Real, Real, Real]
    y_s_per_m: tuple[Complex, Complex, Complex]
    length_m: tuple[Real, Real, Real]


@dataclass(frozen=True)
class Inputs:
    """Checked inputs, not yet broadcast against each other.

    Attributes
    ----------
    values : dict of str to array
        By the names of ``DEFAULTS``, in SI units.
    load_ohm : array or None
        Resistor between the tracks at the far end [ohm]; None where it is open.
    """

    values: dict[str, Real]
    load_ohm: Real | None

    def __getitem__(self, name: str) -> Real:
        return self.values[name]

    def shape(self) -> tuple[int, ...]:
        """Shape that the inputs broadcast to."""
        return np.broadcast_shapes(*(v.shape for v in self._arrays()))

    def _arrays(self) -> Iterator[Real]:
        yield from self.values.values()
        if self.load_ohm is not None:
            yield self.load_ohm

    def block(self, slices: Slices) -> "Inputs":
        """The part of every input that makes one block of the answer."""
        load = None if self.load_ohm is None else _cut(self.load_ohm, slices)
        return Inputs({name: _cut(v, slices) for name, v in self.values.items()}, load)

    def strain(self) -> Real:
        """Share by which the film under the patch is thinner, F / (W L_p E) [-]; 0 where nothing presses."""
        force = self["F_N"]
        if not force.any():
            return np.asarray(0.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            strain = force / (self["W_m"] * self["L_p_m"] * self["E_Pa"])
        return np.where(force == 0, 0.0, strain) if np.isnan(strain).any() else strain

    def tracks(self) -> tuple[Real, Real]:
        """Resistance per length of both tracks together, away from the patch and under it [ohm/m]."""
        ends = [self[f"rho_{end}_ohm_m"] / (self[f"H_{end}_m"] * self["W_m"]) for end in ("top", "bottom")]
        away = ends[0] + ends[1]
        return away, away + self.track_change()

    def track_change(self) -> Real:
        """What pressing adds to the resistance per length [ohm/m], exactly 0 without force."""
        return self["F_N"] * self.track_change_per_newton()

    def track_change_per_newton(self) -> Real:
        """The same per force [ohm/m/N]."""
        top, bottom = (
            self[f"rho_{end}_ohm_m"] * self[f"S_n_{end}_per_N"] / (self[f"H_{end}_m"] * self["W_m"])
            for end in ("top", "bottom")
        )
        return top + bottom

    def susceptance(self) -> Real:
        """Omega C' away from the patch [S/m]."""
        return 2 * np.pi * self["f_Hz"] * self["eps0_F_per_m"] * self["eps_r"] * self["W_m"] / self["d_m"]

    def sections(self) -> Sections:
        """Resistance and shunt admittance per length, and length, of the three sections."""
        away, pressed = self.tracks()
        turned = self["tan_delta"] + 1j
        loose = self.susceptance()
        y = self["G_S_per_m"] + turned * loose
        y_pressed = self["G_S_per_m"] + turned * (loose / (1 - self.strain()))
        right = np.maximum(self["L_m"] - self["x_p_left_edge_m"] - self["L_p_m"], 0.0)
        lengths = (self["x_p_left_edge_m"], self["L_p_m"], right)
        return Sections((away, pressed, away), (y, y_pressed, y), lengths)


def read(given: Mapping[str, Any]) -> Inputs:
    """Check inputs by the names of ``DEFAULTS``, and ``far_end``.

    Raises
    ------
    UnknownName, MissingValue, BadInput, OutOfRange
        A name that no input has; a value that is not given; no number; a number that means nothing.
    """
    given = dict(given)
    far_end = given.pop("far_end", "open")
    for name in given:
        if name not in DEFAULTS:
            raise UnknownName("input of the line", name, [*DEFAULTS, "far_end"])
    needless = {"E_Pa"} if not np.any(given.get("F_N", 0.0)) else set()
    values = {name: _number(name, given.get(name, default), needless) for name, default in DEFAULTS.items()}
    found = Inputs(values, far_load(far_end))
    try:
        found.shape()
    except ValueError:
        shapes = ", ".join(f"{k} {v.shape}" for k, v in values.items() if v.ndim)
        raise BadInput(f"the line's inputs do not broadcast together: {shapes}") from None
    _check_place(found)
    _check_press(found)
    return found


def numbers(name: str, given: Any) -> Real:
    """Real numbers of any shape, or BadInput with the name."""
    found = np.asarray(given)
    if found.dtype.kind not in "biuf":
        raise BadInput(f"{name} takes numbers in SI units, not {str(given)[:60]!r}")
    return found.astype(np.float64, copy=False)


def _number(name: str, given: Any, needless: set[str]) -> Real:
    if name in needless:  # what is not used is taken as it comes, but has to be a number
        return np.asarray(1.0) if given is DEFAULTS[name] else _in_range(name, numbers(name, given))
    if given is NAN:
        because = "; a force needs it" if name == "E_Pa" else ""
        raise MissingValue(f"the line needs {name}{because}")
    return _in_range(name, numbers(name, given))


def _in_range(name: str, value: Real) -> Real:
    least = -math.inf if name in FREE else 0.0
    low, high = (float(value.min(initial=1.0)), float(value.max(initial=1.0))) if value.ndim else 2 * (float(value),)
    if least <= low and high < math.inf and low > -math.inf and not (low == 0 and name in ABOVE_0):
        return value  # NaN passes through min and fails each comparison
    want = "above 0" if name in ABOVE_0 else "a number" if name in FREE else "0 or more"
    bad = ~((value > least) & (value < math.inf))
    if name not in FREE | ABOVE_0:
        bad &= value != 0
    raise OutOfRange(f"{name} has to be {want} and finite, not {value[bad].flat[0]:g}")


def far_load(far_end: Any) -> Real | None:
    """Resistor at the far end [ohm], None for an open end; "open", "short" or ohms."""
    if isinstance(far_end, str):
        if far_end not in ("open", "short"):
            raise UnknownName("far end", far_end, ["open", "short"])
        return None if far_end == "open" else np.asarray(0.0)
    load = numbers("far_end", far_end)
    if load.size and np.isposinf(load).all():
        return None
    return _in_range("far_end", load)


def _check_place(found: Inputs) -> None:
    end, length = found["x_p_left_edge_m"] + found["L_p_m"], found["L_m"]
    bad = end > length * (1 + ROUNDING)
    if bad.any():
        far, size = (float(np.broadcast_to(v, bad.shape)[bad].flat[0]) for v in (end, length))
        raise OutOfRange(f"the pressed patch ends at {far:g} m, beyond the sensor's {size:g} m")


def _check_press(found: Inputs) -> None:
    strain = found.strain()
    if np.isinf(strain).any():
        raise OutOfRange("a force presses on a patch without area: L_p_m has to be above 0 where F_N is not 0")
    if (strain >= 1).any():
        raise OutOfRange(f"the force strains the film by {strain.max():.3g}: at 1 its electrodes touch (Eq. B.49)")
    for end in ("top", "bottom"):
        factor = 1 + found[f"S_n_{end}_per_N"] * found["F_N"]
        if (factor < 0).any():
            raise OutOfRange(f"S_n_{end}_per_N times F_N is {factor.min() - 1:.3g}: below -1 resistivity is negative")


def in_blocks(inputs: Inputs, work: Callable[[Inputs], list[Complex]], count: int = 1) -> list[Complex]:
    """Broadcast answers, ``count`` of them, worked out block by block so that temporaries stay small."""
    shape = inputs.shape()
    if math.prod(shape) <= BLOCK:
        return [np.array(np.broadcast_to(v, shape))[()] if np.shape(v) != shape else v[()] for v in work(inputs)]
    answers = [np.empty(shape, np.complex128) for _ in range(count)]
    for slices in blocks(tuple(slice(0, n) for n in shape)):
        for answer, value in zip(answers, work(inputs.block(slices)), strict=True):
            answer[slices] = value
    return answers


def blocks(slices: Slices) -> Iterator[Slices]:
    """Halve the longest axis until a block is small enough.

    >>> [b[0] for b in blocks((slice(0, 3 * BLOCK),))][0]
    slice(0, 49152, None)
    """
    sizes = [s.stop - s.start for s in slices]
    if math.prod(sizes) <= BLOCK:
        yield slices
        return
    axis = int(np.argmax(sizes))
    start, stop = slices[axis].start, slices[axis].stop
    middle = (start + stop) // 2
    for half in (slice(start, middle), slice(middle, stop)):
        yield from blocks((*slices[:axis], half, *slices[axis + 1 :]))


def _cut(array: Real, slices: Slices) -> Real:
    own = slices[len(slices) - array.ndim :]
    return array[tuple(s if n > 1 else slice(None) for s, n in zip(own, array.shape, strict=True))]
