"""What every line model is told: read, checked once, and turned into three sections."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.core.units import EPS0_F_PER_M

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Slices = tuple[slice, ...]

NEEDED = ("L_m", "W_m", "H_top_m", "H_bottom_m", "rho_top_ohm_m", "rho_bottom_ohm_m", "d_m", "eps_r", "f_Hz", "E_Pa")
OPTIONAL = {
    "tan_delta": 0.0, "G_S_per_m": 0.0, "F_N": 0.0, "x_p_left_edge_m": 0.0, "L_p_m": 0.0, "S_n_top_per_N": 0.0,
    "S_n_bottom_per_N": 0.0, "eps0_F_per_m": EPS0_F_PER_M,
}  # fmt: skip
NAMES = (*NEEDED, *OPTIONAL)
_OPTIONAL: dict[str, Real] = {name: np.asarray(value)[()] for name, value in OPTIONAL.items()}
FREE = {"F_N", "S_n_top_per_N", "S_n_bottom_per_N"}  # of either sign
ABOVE_0 = {"W_m", "H_top_m", "H_bottom_m", "d_m", "eps_r", "E_Pa", "eps0_F_per_m"}  # the others may be 0
ROUNDING = 1e-12  # of L: how far x + L_p may pass the end, since decimals do not add up exactly in binary
HIGHEST_OHM = 1e150  # above, the square of the admittance, from which Re Z comes, is no number any more

BLOCK = 1 << 16  # numbers at a time: temporaries stay in the cache and memory stays that of the answer

# What the C library has once given back at this size it keeps from then on (glibc's mmap and trim thresholds move up):
# asking the system for the same few hundred kB in every call takes longer than to compute what fills them.
np.empty(31 << 20, np.uint8)


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
        By ``NAMES``, in SI units.
    load_ohm : array or None
        Resistor between the tracks at the far end [ohm]; None where it is open.
    """

    values: dict[str, Real]
    load_ohm: Real | None

    def __getitem__(self, name: str) -> Real:
        return self.values[name]

    def shape(self) -> tuple[int, ...]:
        """Shape that the inputs broadcast to."""
        return np.broadcast_shapes(*{v.shape for v in self.arrays()})

    def arrays(self) -> list[Real]:
        """The inputs that are more than one number."""
        known = [*self.values.values(), *([] if self.load_ohm is None else [self.load_ohm])]
        return [v for v in known if v.ndim]

    def block(self, slices: Slices) -> "Inputs":
        """The part of every input that makes one block of the answer."""
        load = None if self.load_ohm is None else _cut(self.load_ohm, slices)
        return Inputs({name: _cut(v, slices) for name, v in self.values.items()}, load)

    def strain(self) -> Real:
        """Share by which the film under the patch is thinner, F / (W L_p E) [-]; 0 where nothing presses."""
        force, yields_at = self["F_N"], self["W_m"] * self["L_p_m"] * self["E_Pa"]
        if yields_at.all():
            return force / yields_at
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(force == 0, 0.0, force / yields_at)

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
        return self["f_Hz"] * self.susceptance_per_hertz()

    def susceptance_per_hertz(self) -> Real:
        """2 pi C' away from the patch [F/m]."""
        return 2 * np.pi * self["eps0_F_per_m"] * self["eps_r"] * self["W_m"] / self["d_m"]

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
    """Check inputs by ``NAMES``, and ``far_end``.

    Raises
    ------
    UnknownName, MissingValue, BadInput, OutOfRange
        A name that no input has; a value that is not given; no number; a number that means nothing.
    """
    given = dict(given)
    far_end = given.pop("far_end", "open")
    for name in given:
        if name not in NAMES:
            raise UnknownName("input of the line", name, [*NAMES, "far_end"])
    found = Inputs(_values(given), far_load(far_end))
    try:
        found.shape()
    except ValueError:
        shapes = ", ".join(f"{k} {v.shape}" for k, v in found.values.items() if v.ndim)
        raise BadInput(f"the line's inputs do not broadcast together: {shapes}") from None
    with np.errstate(all="ignore"):
        _check_place(found)
        _check_press(found)
        _check_tracks(found)
    return found


def numbers(name: str, given: Any) -> Real:
    """Real numbers of any shape, or BadInput with the name."""
    return _numbers(name, given, "biuf").astype(np.float64, copy=False)


def _numbers(name: str, given: Any, kinds: str) -> NDArray[Any]:
    try:
        found = np.asarray(given)
    except ValueError:  # rows of unequal length
        found = np.asarray("")
    if found.dtype.kind not in kinds:
        raise BadInput(f"{name} takes numbers in SI units, not {str(given)[:60]!r}")
    return found


def passive(name: str, given: Any) -> NDArray[Any]:
    """A quantity of a section of which no part may be below 0, complex if it is an admittance; errors name it."""
    value = _numbers(name, given, "biufc").astype(np.complex128) if name == "admittance" else numbers(name, given)
    if not (np.isfinite(value).all() and (value.real >= 0).all() and (value.imag >= 0).all()):
        raise OutOfRange(f"{name} is negative or not finite; expected 0 or more")
    return value


def check_fit(what: str, values: Sequence[NDArray[Any]]) -> None:
    """Raise BadInput where arrays do not broadcast together."""
    shapes = {v.shape for v in values if v.ndim}
    try:
        np.broadcast_shapes(*shapes)
    except ValueError:
        raise BadInput(f"{what} do not broadcast together: {', '.join(map(str, sorted(shapes)))}") from None


def _values(given: Mapping[str, Any]) -> dict[str, Real]:
    values: dict[str, Real] = _OPTIONAL | {name: _in_range(name, numbers(name, value)) for name, value in given.items()}
    if "E_Pa" not in given and not values["F_N"].any():
        values["E_Pa"] = np.asarray(1.0)  # nothing presses
    for name in NEEDED:
        if name not in values:
            because = "; a force needs it" if name == "E_Pa" else ""
            raise MissingValue(f"the line needs {name}{because}")
    return values


def _in_range(name: str, given: Real) -> Real:
    value: Real = given[()]  # a single number as a scalar, which computes in half the time
    least = -math.inf if name in FREE else 0.0
    low, high = _lowest(value), _highest(value)
    if low > high or (least <= low and high < math.inf and low > -math.inf and not (low == 0 and name in ABOVE_0)):
        return value  # there is none, or NaN, which passes through min and max, would fail each comparison
    want = "above 0" if name in ABOVE_0 else "a number" if name in FREE else "0 or more"
    bad = np.asarray(~((value > least) & (value < math.inf)))
    if name not in FREE | ABOVE_0:
        bad &= value != 0
    raise OutOfRange(f"{name} has to be {want} and finite, not {np.asarray(value)[bad].flat[0]:g}")


def _lowest(value: Real) -> float:
    return float(value.min(initial=math.inf)) if value.ndim else float(value)


def _highest(value: Real) -> float:
    return float(value.max(initial=-math.inf)) if value.ndim else float(value)


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
    left, patch, length = found["x_p_left_edge_m"], found["L_p_m"], found["L_m"]
    if _highest(left) + _highest(patch) <= _lowest(length):
        return  # three numbers tell it of a million samples
    end = left + patch
    bad = np.asarray(end > length * (1 + ROUNDING))
    if bad.any():
        far, size = (float(np.broadcast_to(v, bad.shape)[bad].flat[0]) for v in (end, length))
        raise OutOfRange(f"the pressed patch ends at {far:g} m, beyond the sensor's {size:g} m")


def _check_press(found: Inputs) -> None:
    force = found["F_N"]
    touches_at = _lowest(found["W_m"]) * _lowest(found["L_p_m"]) * _lowest(found["E_Pa"])
    if touches_at > 0 and _highest(force) < touches_at * (1 - ROUNDING):
        return
    strain = found.strain()
    if np.isinf(strain).any():
        raise OutOfRange("a force presses on a patch without area: L_p_m has to be above 0 where F_N is not 0")
    if (strain >= 1).any():
        raise OutOfRange(f"the force strains the film by {strain.max():.3g}: at 1 its electrodes touch (Eq. B.49)")


def _check_tracks(found: Inputs) -> None:
    for end in ("top", "bottom"):
        softening = found[f"S_n_{end}_per_N"]
        if not softening.any():
            continue
        factor = 1 + softening * found["F_N"]
        if (factor < 0).any():
            raise OutOfRange(f"S_n_{end}_per_N times F_N is {factor.min() - 1:.3g}: below -1 resistivity is negative")


def in_blocks(inputs: Inputs, work: Callable[[Inputs], list[Complex]], count: int = 1) -> list[Complex]:
    """Broadcast answers, ``count`` of them, worked out block by block so that temporaries stay small."""
    shape = inputs.shape()
    first, *more = blocks(tuple(slice(0, n) for n in shape), [v.shape for v in inputs.arrays()])
    if not more:
        return [np.array(np.broadcast_to(v, shape))[()] if np.shape(v) != shape else v[()] for v in work(inputs)]
    answers = [np.empty(shape, np.complex128) for _ in range(count)]
    for slices in (first, *more):
        for answer, value in zip(answers, work(inputs.block(slices)), strict=True):
            answer[slices] = value
    return answers


def blocks(slices: Slices, shapes: Sequence[tuple[int, ...]]) -> Iterator[Slices]:
    """Halve the slowest axis until a block is small enough for inputs of these shapes.

    Inputs on axes of their own cost nothing beside the answer; one that is as large as the answer makes several
    temporaries of its size.

    >>> next(blocks((slice(0, BLOCK // 4), slice(0, 9)), [(BLOCK // 4, 1), (9,)]))
    (slice(0, 4096, None), slice(0, 9, None))
    >>> next(blocks((slice(0, BLOCK // 4), slice(0, 9)), [(BLOCK // 4, 9)]))
    (slice(0, 1024, None), slice(0, 9, None))
    """
    sizes = [s.stop - s.start for s in slices]
    largest = max((_size(sizes, shape) for shape in shapes), default=0)
    if math.prod(sizes) + 3 * largest <= BLOCK or max(sizes) == 1:
        yield slices
        return
    axis = next(k for k, size in enumerate(sizes) if size > 1)
    start, stop = slices[axis].start, slices[axis].stop
    middle = (start + stop) // 2
    for half in (slice(start, middle), slice(middle, stop)):
        yield from blocks((*slices[:axis], half, *slices[axis + 1 :]), shapes)


def _size(sizes: Sequence[int], shape: tuple[int, ...]) -> int:
    """Numbers of an input within a block."""
    return math.prod(size for size, n in zip(reversed(sizes), reversed(shape), strict=False) if n > 1)


def _cut(array: NDArray[Any], slices: Slices) -> NDArray[Any]:
    if not array.ndim:
        return array
    own = slices[len(slices) - array.ndim :]
    return array[tuple(s if n > 1 else slice(None) for s, n in zip(own, array.shape, strict=True))]
