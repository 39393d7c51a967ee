"""Conductors beyond the line: two coupled films, a sheet between two contacts, a stepped electrode, printed lines.

Their truths are transfer matrices of 60 digits, conformal maps, resistors in a row, and another program's network.
Lines of a solid plate are laid without a slicer: walls around, infill to and fro within them, turned from layer to
layer.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from math import cos, log, pi, radians, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.units import M_PER_MM
from sensorgen.models import conduction, line, sheet, stack, traxels
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.network import StraightLines
from sensorgen.solvers.sheet.parts import Sheet
from sensorgen.verification.chart.results import DIGITS, Question, Step, of_line, of_scene, own

Values = NDArray[Any]


_TRACKS, _FILMS = (23e3, 67e3, 23e3), (7e-10, 3.5e-10)  # [ohm/m], [F/m]
_PRESSED = (1.3, 1.1)  # by how much each film has more capacitance under the press
_LENGTHS_M = (0.045, 0.01, 0.045)
_TONES_HZ = (1.1e3, 99.7e3)
_STACK = np.array([  # [ohm] by film and film, tone by tone
    [[3022.1409649083649 - 2006746.0822725504j, -2244.2493496187548 + 0.97652479818476318j],
     [-2244.2493496187548 + 0.97652479818476318j, 3007.4105466358274 - 4092965.8966650541j]],
    [[3017.1198405332813 - 22241.712333957895j, -2239.7750411322322 + 88.273088255219587j],
     [-2239.7750411322322 + 88.273088255219587j, 3003.384599793356 - 45241.32367848025j]],
])  # fmt: skip

_SHEET = Sheet(0.1, 0.07, (450.0, 700.0), 7e-8)
_STRETCHES_M = (0.02, 0.03, 0.035, 0.09)  # along the front edge
_SQUARES = 0.9443847944062356  # between them
_GRIDS = (20, 40, 80, 160)

_STEPS, _STEP_MM, _THICK_MM, _THIN_MM = 8, 5.0, 0.6, 0.3  # along an electrode 1 mm wide, of 1e-3 ohm m
_WIDTHS = (1e-2, 1e-4, 1e-6, 1e-8)

_RHO_OHM_M, _CONTACTS_OHM_M2 = 0.2, (1e-6, 1e-4, 1e-2)
_LINE_MM, _LAYER_MM, _ACROSS = 0.42, 0.1, 12


def two_films(name: str) -> Question:
    """Two films with a track in common, pressed in their middle; off the diagonal what one film shows of the other."""
    tracks, films = _sections()
    together = partial(stack.impedance, tracks, [list(section.T) for section in films], _LENGTHS_M)
    return _question(name, _STACK, DIGITS, {"stack": [("", together)], "line: each film alone": [("", _alone)]})


def front_edge(name: str) -> Question:
    """A sheet of 100 x 70 mm between two stretches of one edge: its rectangle as a half plane."""
    port: list[Any] = [tuple(_SHEET.edge("top", "front", *_STRETCHES_M[k : k + 2]) for k in (0, 2))]

    def between(cells: int) -> Values:
        z = sheet.impedance(_SHEET, port, 0.0, cells=cells)[0, 0, 0]
        return np.array([z.real / _SHEET.sheet_resistance_ohm[0]])

    levels: list[Step] = [(f"{n} cells", partial(between, n)) for n in _GRIDS]
    return _question(name, [_SQUARES], 1e-15, {"sheet": levels})


def stepped(name: str) -> Question:
    """An electrode of 0.6 and 0.3 mm in turn: squares, and for each step what its corner adds, by a conformal map."""
    k = _THIN_MM / _THICK_MM
    step = ((k * k + 1) / k * log((1 + k) / (1 - k)) - 2 * log(4 * k / (1 - k * k))) / pi
    known = _STEPS * (_STEP_MM * (1 / _THIN_MM + 1 / _THICK_MM) / 2 + step)
    works: list[Step] = [(f"width {width:g} asked", partial(_comb, width)) for width in _WIDTHS]
    return _question(name, [known], DIGITS, {"conduction": works})


def lines_across(name: str) -> Question:
    """Twelve lines side by side across the current: n lines and n - 1 contacts in a row."""
    share = (_ACROSS - 1) / _ACROSS / (_RHO_OHM_M * _LINE_MM * 1e-3)
    known = 1 + share * np.array(_CONTACTS_OHM_M2)
    works: dict[str, list[Step]] = {"traxels": [("", _across)], "traxels: as a solid": [("", lambda: np.ones(3))]}
    return _question(name, known, DIGITS, works)


def electrode(name: str) -> Question:
    """Three layers of 100 x 10 mm, across, along and across, in two walls; contacts of 1e-4 ohm m2."""

    def printed() -> Values:
        lines = plate(100.0, 10.0, _LINE_MM, _LAYER_MM, (90, 180, 90))
        return np.array([traxels.resistance(lines, _RHO_OHM_M, 1e-4, (-48.9e-3, 48.9e-3), 3e-6).ratio])

    works: dict[str, list[Step]] = {"traxels": [("", printed)], "traxels: as a solid": [("", lambda: np.ones(1))]}
    return _question(name, [1.422], 0.05, works)


STANDARD: dict[str, Callable[[str], Question]] = {
    "two films, one track shared": two_films,
    "sheet, contacts on one edge": front_edge,
    "electrode, steps across the current": stepped,
    "printed lines across the current": lines_across,
    "printed electrode, 1e-4 ohm m²": electrode,
}


def _question(name: str, known: ArrayLike, known_to: float, models: Mapping[str, Sequence[Step]]) -> Question:
    """Impedances of a network [ohm], or resistances over those of a solid [-], by its models from coarse to fine."""
    reasons = dict.fromkeys(("stack", "sheet", "conduction", "traxels", "line"), "this network is of another kind")
    series, asked = own(models.items(), reasons), "what a network of tracks, sheets or lines conducts"
    return of_scene(name, asked, series, known, known_to, of_line)


def _sections() -> tuple[list[list[float]], Values]:
    """Tracks of each section, and its films' admittances, tone by tone [S/m]."""
    free = 2j * np.pi * np.array(_TONES_HZ)[:, None] * np.array(_FILMS)
    return [list(_TRACKS)] * 3, np.stack([free, free * _PRESSED, free])


def _alone() -> Values:
    """As if no track were shared: nothing off the diagonal."""
    tracks, films = _sections()
    impedance = np.zeros_like(_STACK)
    for k in (0, 1):
        loop = [np.asarray(section[k] + section[k + 1]) for section in tracks]
        lengths = [np.asarray(length) for length in _LENGTHS_M]
        impedance[:, k, k] = line.cascade(loop, list(films[:, :, k]), lengths, "open")
    return impedance


def _comb(width: float) -> Values:
    """In the middle of its bounds; what is kept of the last run would be no time."""
    length = _STEPS * _STEP_MM
    back = box(0, length, 0, 1, _THIN_MM, _THICK_MM)
    teeth = [box(x, x + _STEP_MM, 0, 1, 0, _THIN_MM) for x in np.arange(_STEP_MM, length, 2 * _STEP_MM).tolist()]
    scene = Scene((Body("electrode", "etpu", (back, *teeth), "top"),), (length, 1.0, _THICK_MM))
    conduction._per_resistivity.cache_clear()
    return np.array([conduction.electrode_resistance(scene, "top", 1e-3, width=width).middle()])


def _across() -> Values:
    """Between the middles of the first and the last line; half a line more at each end."""
    pitch, high, reach = _LINE_MM * 1e-3, _LAYER_MM * 1e-3, 5e-3
    x, full = pitch * np.arange(_ACROSS), np.ones(_ACROSS)
    start, end = (np.column_stack([x, side * reach * full]) for side in (-1, 1))
    lines = StraightLines(start, end, full * pitch, full * high, np.zeros(_ACROSS, np.int64), np.zeros(_ACROSS, bool))
    span, area = (0.0, float(x[-1])), high * 2 * reach
    ratios = [traxels.resistance(lines, _RHO_OHM_M, contact, span, area).ratio for contact in _CONTACTS_OHM_M2]
    return (1 + (_ACROSS - 1) * np.array(ratios)) / _ACROSS


WALLS = 2
OVERLAP = 0.25  # of a line's width, by which infill reaches into the walls (PrusaSlicer's own)

Path = list[NDArray[np.float64]]


def plate(
    length_mm: float, width_mm: float, line_mm: float, layer_mm: float, degrees: Sequence[float], walls: int = WALLS
) -> StraightLines:
    """All lines of a plate around the origin.

    Parameters
    ----------
    length_mm, width_mm : float
        Along x and y [mm].
    line_mm, layer_mm : float
        Width of a line and height of a layer [mm].
    degrees : sequence of float
        Direction of each layer's infill, from x, from below [deg].
    walls : int
        How many lines run around it [-].
    """
    pieces = []
    for layer, angle in enumerate(degrees):
        for path in _paths(np.array([length_mm, width_mm]), line_mm, angle, walls):
            steps = ((a, b, k > 0) for k, (a, b) in enumerate(pairwise(path)))
            pieces += [(*a, *b, layer, joined) for a, b, joined in steps]
    ends = np.array(pieces)
    full = np.full(len(ends), M_PER_MM)
    return StraightLines(
        ends[:, :2] * M_PER_MM, ends[:, 2:4] * M_PER_MM, full * line_mm, full * layer_mm,
        ends[:, 4].astype(np.int64), ends[:, 5].astype(bool),
    )  # fmt: skip


def _paths(size: NDArray[np.float64], line: float, degrees: float, walls: int) -> Iterator[Path]:
    """Walls, and lines a width apart within them, joined along a side where two ends lie on the same one."""
    for k in range(walls):
        x, y = size / 2 - (k + 0.5) * line
        yield [np.array(p) for p in ((x, y), (-x, y), (-x, -y), (x, -y), (x, y))]
    half = size / 2 - ((walls + 0.5 - OVERLAP) * line if walls else line / 2)
    angle = radians(degrees)
    way, across = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
    reach = float(np.abs(across) @ half)
    count = int(2 * reach / line + 1 + 1e-9)
    path: Path = []
    for k in range(count):
        at = across * ((k - (count - 1) / 2) * line)
        with np.errstate(divide="ignore"):  # along a side
            ends = np.sort([(-half - at) / way, (half - at) / way], axis=0)[:, np.abs(way) > 1e-12]
        low, high = ends[0].max(), ends[1].min()
        if high - low <= 1e-6:  # it only touches a corner
            continue
        first, last = (at + low * way, at + high * way) if k % 2 == 0 else (at + high * way, at + low * way)
        if path and not (np.isclose(np.abs(first), half, atol=1e-9) & np.isclose(path[-1], first, atol=1e-9)).any():
            yield path
            path = []
        path += [first, last]
    if path:
        yield path
