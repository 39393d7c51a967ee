"""A sheet solved on a given grid, or on the coarsest that is good enough, with the error that remains."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.solvers.sheet.fold import fold, folds
from sensorgen.solvers.sheet.grid import axes
from sensorgen.solvers.sheet.links import BY, links
from sensorgen.solvers.sheet.network import Complex, network
from sensorgen.solvers.sheet.parts import Patch, Port, Sheet, check_patch, contacts_of

COARSEST, FINEST = 10, 320  # cells between which a resolution is looked for
_HIGHEST_HZ = 1e100
_ANY_CELLS = 1e6  # along a side: more are no advice


@dataclass(frozen=True)
class Solution:
    """Impedances, and how far they can be trusted.

    Attributes
    ----------
    impedance_ohm : (frequencies, ports, ports) complex array
        Voltage at a port per current through another [ohm].
    by : dict of str to complex array
        Derivatives in the same shape [ohm per the unit of what it is by].
    cells : int
        Cells along the longer side [-].
    error : float
        Estimated relative error of resistance or reactance, whichever is worse [-]; NaN where the cells were given.
    """

    impedance_ohm: Complex
    by: dict[str, Complex]
    cells: int
    error: float


def solution(
    sheet: Sheet, ports: Sequence[Port], frequency_hz: ArrayLike, patch: Patch | None, of: Iterable[str],
    cells: int | None, accuracy: float,
) -> Solution:  # fmt: skip
    """See :func:`sensorgen.models.sheet.solve`."""
    names, tones = tuple(of), frequencies(frequency_hz)
    _check(sheet, ports, patch, names)
    if cells is not None:
        return _once(sheet, ports, tones, patch, names, cells)
    return _fine_enough(sheet, ports, tones, patch, names, accuracy)


def depth_m(sheet: Sheet, frequency_hz: float, patch: Patch | None = None) -> float:
    r"""Depth to which current reaches along the sheets before it has crossed the film, 1 / sqrt(\|(R_t + R_b) y\|) [m].

    Under a patch, where it is smaller. Infinite where nothing crosses, or nothing resists.

    >>> round(depth_m(Sheet(0.1, 0.1, (450.0, 450.0), 7e-8), 1e5), 3)
    0.159
    """
    largest = float(sheet.capacitances().max()) * max(1.0, patch.capacitance_factor if patch else 1.0)
    y = sheet.leak_s_per_m2 + (sheet.tan_delta + 1j) * 2 * np.pi * frequency_hz * largest
    rises = patch.resistance_factor if patch else (1.0, 1.0)
    ohm = sum(r * max(1.0, rise) for r, rise in zip(sheet.sheet_resistance_ohm, rises, strict=True))
    return float(1 / np.sqrt(abs(y) * ohm)) if abs(y) * ohm else float("inf")


def frequencies(given: ArrayLike) -> NDArray[np.float64]:
    """Tones as an array [Hz], or an error that names them."""
    found = np.atleast_1d(np.asarray(given))
    if found.dtype.kind not in "iuf" or found.ndim != 1 or not found.size:
        raise BadInput(f"frequency_hz takes numbers in Hz, not {str(given)[:60]!r}")
    bad = found[~((found >= 0) & (found < _HIGHEST_HZ))]
    if bad.size:
        raise OutOfRange(f"frequency_hz has to be 0 or more and below {_HIGHEST_HZ:g}, not {bad[0]:g}")
    return found.astype(float)


def _check(sheet: Sheet, ports: Sequence[Port], patch: Patch | None, names: tuple[str, ...]) -> None:
    contacts_of(sheet, ports)
    if patch:
        check_patch(sheet, patch)
    for name in names:
        if name not in BY:
            raise UnknownName("input of a sheet to differentiate by", name, BY)
    if names and not patch:
        raise OutOfRange("a derivative by a patch needs a patch")


def _once(
    sheet: Sheet, ports: Sequence[Port], tones: NDArray[Any], patch: Patch | None, names: tuple[str, ...], cells: int
) -> Solution:
    if cells < 1:
        raise OutOfRange(f"a sheet needs one cell or more, not {cells}")
    if not folds(ports, patch):
        return _unfolded(sheet, ports, tones, patch, names, cells)
    half, shares = fold(sheet)
    sources = {name: shares.get(name, (name, 1.0)) for name in names}
    of = tuple(dict.fromkeys(source for source, _ in sources.values()))
    found = _unfolded(half, ports, tones, patch, of, cells)
    by = {name: share * found.by[source] for name, (source, share) in sources.items()}
    return Solution(found.impedance_ohm, by, cells, found.error)


def _unfolded(
    sheet: Sheet, ports: Sequence[Port], tones: NDArray[Any], patch: Patch | None, names: tuple[str, ...], cells: int
) -> Solution:
    contacts = contacts_of(sheet, ports)
    grid = axes(sheet, contacts, cells)
    _check_depth(sheet, patch, tones, max(axis.steps_m.max() for axis in grid), cells)
    of = links(sheet, grid, patch)
    net = network(sheet, grid, contacts, ports, of)
    z = np.empty((len(tones), len(ports), len(ports)), complex)
    by = {name: np.empty_like(z) for name in names}
    for k, hertz in enumerate(tones):
        turned = (sheet.tan_delta + 1j) * 2 * np.pi * hertz
        z[k], along = net.solve(of.conductance_s + turned * of.capacitance_f)
        if names and not np.isfinite(z[k]).all():
            raise OutOfRange(f"no derivative at {hertz:g} Hz, where the impedance is infinite")
        for name in names:
            slope = of.slopes[name][0] + turned * of.slopes[name][1]
            by[name][k] = -(along * slope[:, None]).T @ along
    return Solution(z, by, cells, float("nan"))


def _check_depth(sheet: Sheet, patch: Patch | None, tones: NDArray[Any], longest_m: float, cells: int) -> None:
    depth = depth_m(sheet, float(tones.max()), patch)
    if longest_m > depth:
        need = float(cells * longest_m / depth) if depth else float("inf")
        finer = f"{int(np.ceil(need))} cells or more, or " if need < _ANY_CELLS else ""
        raise OutOfRange(
            f"grid too coarse: at {tones.max():g} Hz current reaches {depth:.3g} m and a cell is {longest_m:.3g} m "
            f"long: use {finer}a lower frequency"
        )


def _fine_enough(
    sheet: Sheet, ports: Sequence[Port], tones: NDArray[Any], patch: Patch | None, names: tuple[str, ...],
    accuracy: float,
) -> Solution:  # fmt: skip
    cells = COARSEST
    reach = 2 * max(sheet.length_m, sheet.width_m) / depth_m(sheet, float(tones.max()), patch)
    while cells < reach and cells < FINEST:
        cells *= 2
    before, error = None, float("inf")
    while cells <= FINEST:
        found = _once(sheet, ports, tones, patch, names, cells)
        if before is not None:
            error = _change(before.impedance_ohm, found.impedance_ohm) / 2
            if error <= accuracy:
                return Solution(found.impedance_ohm, found.by, cells, error)
        before, cells = found, 2 * cells
    raise OutOfRange(
        f"{FINEST} cells reach a relative error of {error:.1g}, not {accuracy:g}: ask for less, or give the cells"
    )


def _change(before: Complex, after: Complex) -> float:
    """Largest change of resistance or reactance, relative to those of the two ports that it couples."""
    finite = np.isfinite(after)
    worst = 0.0
    for part in (np.real, np.imag):
        new, old = (np.where(finite, part(z), 0.0) for z in (after, before))
        own = np.sqrt(np.abs(np.einsum("fpp->fp", new)))
        scale = own[:, :, None] * own[:, None, :]
        relative = np.divide(np.abs(new - old), scale, out=np.zeros_like(scale), where=scale > 0)
        worst = max(worst, float(relative.max()))
    return worst
