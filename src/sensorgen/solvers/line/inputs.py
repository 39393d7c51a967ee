"""Inputs of the line models: checked once, divided into three sections, evaluated block by block."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.core.units import EPS0_F_PER_M

Slices = tuple[slice, ...]


@dataclass(frozen=True, kw_only=True)
class PressedLine:
    """Two resistive tracks with a film between them, one patch of it pressed, read at a frequency. SI units.

    Each quantity is a number or an array; arrays broadcast. To compute a grid fast, give each quantity its own axis.

    Attributes
    ----------
    length_m, width_m : float or array
        Of the sensor [m].
    top_thickness_m, bottom_thickness_m : float or array
        Of the electrodes [m].
    top_resistivity_ohm_m, bottom_resistivity_ohm_m : float or array
        Of the electrodes [ohm m]; 0 is a perfect conductor.
    film_m : float or array
        Thickness of the film [m].
    eps_r : float or array
        Relative permittivity of the film [-].
    frequency_hz : float or array
        0 or more [Hz].
    force_n : float or array
        Force [N]; below 0 it pulls, and the same linear law thickens the film.
    modulus_pa : float or array, optional
        Young's modulus of the film [Pa]; needed with a force.
    left_m, tip_m : float or array
        Left edge and length of the pressed patch [m].
    top_piezoresistance_per_n, bottom_piezoresistance_per_n : float or array
        Relative rise of resistivity per force, S_n of the thesis [1/N].
    tan_delta : float or array
        Loss tangent of the film [-].
    leak_s_per_m : float or array
        Leakage conductance of the film per length, the same under the patch [S/m].
    far_end : str, float or array
        "open", "short", or a resistor [ohm].
    eps0_f_per_m : float
        Electric constant, CODATA 2018 [F/m].
    """

    length_m: ArrayLike
    width_m: ArrayLike
    top_thickness_m: ArrayLike
    bottom_thickness_m: ArrayLike
    top_resistivity_ohm_m: ArrayLike
    bottom_resistivity_ohm_m: ArrayLike
    film_m: ArrayLike
    eps_r: ArrayLike
    frequency_hz: ArrayLike
    force_n: ArrayLike = 0.0
    modulus_pa: ArrayLike | None = None
    left_m: ArrayLike = 0.0
    tip_m: ArrayLike = 0.0
    top_piezoresistance_per_n: ArrayLike = 0.0
    bottom_piezoresistance_per_n: ArrayLike = 0.0
    tan_delta: ArrayLike = 0.0
    leak_s_per_m: ArrayLike = 0.0
    far_end: ArrayLike = "open"
    eps0_f_per_m: ArrayLike = EPS0_F_PER_M


NAMES = tuple(field.name for field in fields(PressedLine) if field.name != "far_end")
_DEFAULTS = {field.name: field.default for field in fields(PressedLine)}
FREE = {"force_n", "top_piezoresistance_per_n", "bottom_piezoresistance_per_n"}  # of either sign
ABOVE_0 = {"width_m", "top_thickness_m", "bottom_thickness_m", "film_m", "eps_r", "modulus_pa", "eps0_f_per_m"}
ROUNDING = 1e-12  # of the length: left_m + tip_m may exceed it by that much, since decimals are inexact in binary
HIGHEST_OHM = 1e150  # above, the square of the admittance, from which Re Z comes, overflows

BLOCK = 1 << 16  # numbers at a time: temporaries stay in the cache and memory stays that of the result

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
    """Checked quantities of a line as arrays, not yet broadcast against each other.

    Attributes
    ----------
    values : dict of str to array
        By ``NAMES``, SI units.
    load_ohm : array or None
        Resistor between the tracks at the far end [ohm]; None where it is open.
    """

    values: dict[str, Real]
    load_ohm: Real | None

    def __getitem__(self, name: str) -> Real:
        return self.values[name]

    def arrays(self) -> list[Real]:
        """All quantities, the load last if there is one."""
        return [*self.values.values(), *([] if self.load_ohm is None else [self.load_ohm])]

    def evaluate(self, work: Callable[["Inputs"], list[Complex]], count: int = 1) -> list[Complex]:
        """Broadcast results of ``work``, ``count`` of them; see :func:`in_blocks`."""

        def part(arrays: list[Real]) -> list[Complex]:
            load = None if self.load_ohm is None else arrays[-1]
            return work(Inputs(dict(zip(self.values, arrays, strict=False)), load))

        return in_blocks(self.arrays(), part, count)

    def strain(self) -> Real:
        """Strain of the film under the patch, F / (W L_p E) [-]; 0 without force."""
        force, touches_at = self["force_n"], self["width_m"] * self["tip_m"] * self["modulus_pa"]
        if touches_at.all():
            return force / touches_at
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(force == 0, 0.0, force / touches_at)

    def section(self, end: str) -> Real:
        """Cross-section of an electrode [m2]."""
        return self[f"{end}_thickness_m"] * self["width_m"]

    def tracks(self) -> tuple[Real, Real]:
        """Resistance per length of both tracks together, away from the patch and under it [ohm/m]."""
        top, bottom = (self[f"{end}_resistivity_ohm_m"] / self.section(end) for end in ("top", "bottom"))
        away = top + bottom
        return away, away + self.track_change()

    def track_change(self) -> Real:
        """Resistance per length that pressing adds [ohm/m], exactly 0 without force."""
        return self["force_n"] * self.track_change_per_newton()

    def track_change_per_newton(self) -> Real:
        """Change of resistance per length and force [ohm/m/N]."""
        top, bottom = (
            self[f"{end}_resistivity_ohm_m"] * self[f"{end}_piezoresistance_per_n"] / self.section(end)
            for end in ("top", "bottom")
        )
        return top + bottom

    def susceptance(self) -> Real:
        """Omega C' away from the patch [S/m]."""
        return self["frequency_hz"] * self.susceptance_per_hertz()

    def susceptance_per_hertz(self) -> Real:
        """2 pi C' away from the patch [F/m]."""
        return 2 * np.pi * self["eps0_f_per_m"] * self["eps_r"] * self["width_m"] / self["film_m"]

    def sections(self) -> Sections:
        """Resistance and shunt admittance per length, and length, of the three sections."""
        away, pressed = self.tracks()
        turned, susceptance = self["tan_delta"] + 1j, self.susceptance()
        y = self["leak_s_per_m"] + turned * susceptance
        y_pressed = self["leak_s_per_m"] + turned * (susceptance / (1 - self.strain()))
        right = np.maximum(self["length_m"] - self["left_m"] - self["tip_m"], 0.0)
        return Sections((away, pressed, away), (y, y_pressed, y), (self["left_m"], self["tip_m"], right))


def read(line: PressedLine) -> Inputs:
    """Check the quantities of a line.

    Raises
    ------
    MissingValue
        A force without a modulus.
    BadInput
        Not a number; shapes that do not broadcast.
    OutOfRange
        NaN, infinite or negative values; a patch beyond the sensor; electrodes that touch; a negative resistivity.
    UnknownName
        No such far end.
    """
    values: dict[str, Real] = {}
    for name in NAMES:
        given = getattr(line, name)
        if given is not None:
            values[name] = _CHECKED[name] if given is _DEFAULTS[name] else in_range(name, given)
    if line.modulus_pa is None:
        if values["force_n"].any():
            raise MissingValue("the line needs modulus_pa: a force strains the film")
        values["modulus_pa"] = np.float64(1.0)  # type: ignore[assignment]
    inputs = Inputs(values, far_load(line.far_end))
    try:
        np.broadcast_shapes(*{v.shape for v in inputs.arrays()})
    except ValueError:
        shapes = ", ".join(f"{k} {v.shape}" for k, v in values.items() if v.ndim)
        raise BadInput(f"the line's inputs do not broadcast together: {shapes}") from None
    with np.errstate(all="ignore"):
        _check(inputs)
    return inputs


def numbers(name: str, given: Any, kinds: str = "biuf") -> Real:
    """Numbers of any shape, real unless ``kinds`` (of NumPy's dtypes) allows more; BadInput names what is none."""
    try:
        array = np.asarray(given)
    except ValueError:  # rows of unequal length
        array = np.asarray("")
    if array.dtype.kind not in kinds:
        raise BadInput(f"{name} takes numbers in SI units, not {str(given)[:60]!r}")
    return array.astype(np.complex128 if "c" in kinds else np.float64, copy=False)


def passive(name: str, given: Any) -> NDArray[Any]:
    """A quantity of a section, complex if it is an admittance; OutOfRange where a part is below 0 or not finite."""
    value = numbers(name, given, "biufc" if name == "admittance" else "biuf")
    sides = (value.real, value.imag) if value.dtype.kind == "c" else (value,)
    if not all(_lowest(side) >= 0 and _highest(side) < math.inf for side in sides):  # nor NaN
        raise OutOfRange(f"{name} is negative or not finite; expected 0 or more")
    return value


def check_fit(what: str, values: Sequence[NDArray[Any]]) -> None:
    """Raise BadInput where arrays do not broadcast together."""
    shapes = {v.shape for v in values if v.ndim}
    try:
        np.broadcast_shapes(*shapes)
    except ValueError:
        raise BadInput(f"{what} do not broadcast together: {', '.join(map(str, sorted(shapes)))}") from None


def in_range(name: str, given: ArrayLike) -> Real:
    """A quantity of the line by its name in :class:`PressedLine`, or OutOfRange."""
    value: Real = numbers(name, given)[()]  # a single number as a scalar, which computes in half the time
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


_CHECKED: dict[str, Real] = {
    name: in_range(name, default) for name, default in _DEFAULTS.items() if isinstance(default, float)
}


def far_load(far_end: ArrayLike) -> Real | None:
    """Resistor at the far end [ohm], None for an open end; "open", "short" or ohms."""
    if isinstance(far_end, str):
        if far_end not in ("open", "short"):
            raise UnknownName("far end", far_end, ["open", "short"])
        return None if far_end == "open" else np.asarray(0.0)
    load = numbers("far_end", far_end)
    return None if load.size and np.isposinf(load).all() else in_range("far_end", load)


def _check(inputs: Inputs) -> None:
    """Refuse a patch beyond the sensor, electrodes that touch, and a negative resistivity.

    Extremes of each quantity decide for a million samples, where they can.
    """
    _check_patch(inputs)
    _check_strain(inputs)
    for name in ("top_piezoresistance_per_n", "bottom_piezoresistance_per_n"):
        if inputs[name].any() and (rise := inputs[name] * inputs["force_n"]).min(initial=0.0) < -1:
            raise OutOfRange(f"{name} times force_n is {rise.min():.3g}: below -1 resistivity is negative")


def _check_patch(inputs: Inputs) -> None:
    """Refuse a patch beyond the sensor."""
    left, patch, length = (inputs[name] for name in ("left_m", "tip_m", "length_m"))
    if _highest(left) + _highest(patch) > _lowest(length):
        end = left + patch
        bad = np.asarray(end > length * (1 + ROUNDING))
        if bad.any():
            far, size = (float(np.broadcast_to(v, bad.shape)[bad].flat[0]) for v in (end, length))
            raise OutOfRange(f"the pressed patch ends at {far:g} m, beyond the sensor's {size:g} m")


def _check_strain(inputs: Inputs) -> None:
    """Refuse electrodes that touch, and a force without an area."""
    touches_at = _lowest(inputs["width_m"]) * _lowest(inputs["tip_m"]) * _lowest(inputs["modulus_pa"])
    if not (touches_at > 0 and _highest(inputs["force_n"]) < touches_at * (1 - ROUNDING)):
        strain = inputs.strain()
        if np.isinf(strain).any():
            raise OutOfRange("a force presses on a patch without area: tip_m has to be above 0 where force_n is not 0")
        if (strain >= 1).any():
            raise OutOfRange(f"the force strains the film by {strain.max():.3g}: at 1 its electrodes touch (Eq. B.49)")


def in_blocks(
    arrays: Sequence[NDArray[Any]], work: Callable[[list[NDArray[Any]]], list[Complex]], count: int = 1
) -> list[Complex]:
    """Broadcast results, ``count`` of them, evaluated block by block so that temporaries stay small."""
    shapes = [v.shape for v in arrays if v.ndim]
    shape = np.broadcast_shapes(*set(shapes))
    first, *more = blocks(tuple(slice(0, n) for n in shape), shapes)
    if not more:
        results_of = work(list(arrays))
        return [np.array(np.broadcast_to(v, shape))[()] if np.shape(v) != shape else v[()] for v in results_of]
    results = [np.empty(shape, np.complex128) for _ in range(count)]
    for slices in (first, *more):
        for result, value in zip(results, work([_cut(v, slices) for v in arrays]), strict=True):
            result[slices] = value
    return results


def blocks(slices: Slices, shapes: Sequence[tuple[int, ...]]) -> Iterator[Slices]:
    """Halve the slowest axis until a block is small enough for inputs of these shapes.

    Inputs on axes of their own cost nothing beside the result; one that is as large as the result makes several
    temporaries of its size.

    >>> next(blocks((slice(0, BLOCK // 4), slice(0, 9)), [(BLOCK // 4, 1), (9,)]))
    (slice(0, 4096, None), slice(0, 9, None))
    >>> next(blocks((slice(0, BLOCK // 4), slice(0, 9)), [(BLOCK // 4, 9)]))
    (slice(0, 1024, None), slice(0, 9, None))
    """
    sizes = [s.stop - s.start for s in slices]
    largest = max(
        (math.prod(z for z, n in zip(reversed(sizes), reversed(shape), strict=False) if n > 1) for shape in shapes),
        default=0,
    )
    if math.prod(sizes) + 3 * largest <= BLOCK or max(sizes) == 1:
        yield slices
        return
    axis = next(k for k, size in enumerate(sizes) if size > 1)
    start, stop = slices[axis].start, slices[axis].stop
    for half in (slice(start, (start + stop) // 2), slice((start + stop) // 2, stop)):
        yield from blocks((*slices[:axis], half, *slices[axis + 1 :]), shapes)


def _cut(array: NDArray[Any], slices: Slices) -> NDArray[Any]:
    if not array.ndim:
        return array
    own = slices[len(slices) - array.ndim :]
    return array[tuple(s if n > 1 else slice(None) for s, n in zip(own, array.shape, strict=True))]
