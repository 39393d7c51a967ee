"""Electrodes with cogs: closed forms, bricks beside triangles, planted faults, bad input."""

import subprocess
import sys
from math import log, pi

import numpy as np
import pytest
from cell_scenes import close

from sensorgen.core.errors import OutOfRange
from sensorgen.design.shapes import double, rect, reference, tri
from sensorgen.models import conduction, fem2d
from sensorgen.models.conduction import electrode_resistance
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box
from sensorgen.solvers.electrostatics import bounds

COMB = 0.845676971  # by scikit-fem, P2 refined towards the corner, and by an independent program at orders 6 and 8


def ratio(scene: Scene, terminal: str = "top", plate_mm: float = 0.3, axis: str = "x", width: float = 1e-3):
    """Resistance as a share of the plate's alone."""
    along, across = scene.size_mm[:2] if axis == "x" else scene.size_mm[1::-1]
    plate = 0.07 * along / (plate_mm * across) * 1e3
    return electrode_resistance(scene, terminal, 0.07, axis, width).times(1 / plate)


def tri_scene(**options) -> Scene:
    return tri.scene(tri.Params(**options), Fill())


def rect_scene(**options) -> Scene:
    return rect.scene(rect.Params(**options), Fill())


def metal(*prisms: Prism, size_mm=(10.0, 1.0, 3.0)) -> Scene:
    return Scene((Body("electrode", "etpu", prisms, "top"),), size_mm)


def holds(found, value: float) -> bool:
    return found.lower <= value * (1 + 1e-12) and value * (1 - 1e-12) <= found.upper


def test_cogs_along_the_current_carry_it_in_parallel():
    found = ratio(tri_scene(along="y"))
    assert (found.lower, found.upper) == close((1 / (1 + 0.125 / 0.3),) * 2, 1e-12)


@pytest.mark.parametrize("width", [1e-2, 1e-7])
def test_cogs_across_the_current_as_the_independent_program_has_them(width):
    found = ratio(tri_scene(), width=width)
    assert found.width() <= width
    assert holds(found, COMB)
    assert found.middle() == close(COMB, max(width / 20, 1e-8))


def test_a_step_in_thickness_as_conformal_mapping_has_it():
    """Plates of 0.3 and 0.6 mm in turn, 5 mm each: squares, and for each step what its corner adds."""
    k = 0.5
    step = ((k * k + 1) / k * log((1 + k) / (1 - k)) - 2 * log(4 * k / (1 - k * k))) / pi
    teeth = [box(10 * n + 5, 10 * n + 10, 0, 1, 0.0, 0.3) for n in range(4)]
    scene = metal(box(0, 40, 0, 1, 0.3, 0.6), *teeth, size_mm=(40.0, 1.0, 0.6))
    exact = 20 / 0.3 + 20 / 0.6 + 8 * step
    found = electrode_resistance(scene, "top", 1e-3, width=1e-8)
    assert found.width() < 1e-8
    assert found.middle() == close(exact, 1e-8)


@pytest.mark.parametrize(("shape", "end"), [(reference, "top"), (double, "middle"), (tri, "bottom"), (rect, "bottom")])
def test_a_plate_without_cogs_is_exact(shape, end):
    found = ratio(shape.scene(shape.Params(), Fill()), end)
    assert (found.lower, found.upper) == close((1.0, 1.0), 1e-12)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("along", ["xy", "yx"])
def test_crossed_strips_lie_between_rayleighs_bounds(along, axis):
    found = ratio(rect_scene(along=along), axis=axis)
    if axis == along[0]:  # the upper strips run along the current, 0.35 of the width, the lower ones across
        slices, tubes = 0.3 * (0.65 / 0.405 + 0.35 / 0.705), 0.3 / 0.405
    else:  # equal layers, so that only the order along z differs
        slices, tubes = 0.3 * (0.65 / 0.405 + 0.35 / 0.705), 1.0
    assert found.width() < 1e-3
    assert slices < found.lower < found.upper < tubes


@pytest.mark.parametrize("channels", [False, True])
def test_bricks_and_triangles_agree(channels):
    """Of bars under a plate; with channels that no current enters, around which a stream function must not jump."""
    parts = [box(0, 10, 0, 1, 0.5, 0.8), box(0, 10, 0, 1, 0.3, 0.4)]
    for k in range(10):
        parts += [box(k + a, k + b, 0, 1, 0.4, 0.5) for a, b in ((0, 0.1), (0.3, 0.7), (0.9, 1))]
        parts += [box(k + 0.3, k + 0.7, 0, 1, 0.0, 0.3)]
    scene = metal(*(parts if channels else [parts[0], *parts[3::4], *parts[5::4]]), size_mm=(10.0, 1.0, 0.8))
    flat = ratio(scene, width=1e-5)
    alone = Scene((Body("electrode", "electrode", scene.bodies[0].pieces),), scene.size_mm)
    (*_, deep) = conduction._in_space(alone, "x", 1e-3)
    plate = 10 / 0.3
    assert flat.width() < 1e-5
    assert deep.lower / plate <= flat.lower <= flat.upper <= deep.upper / plate
    assert deep.width() < 1e-3


def test_an_end_amid_a_period_takes_the_patterns_resistance_per_length():
    whole, cut = (electrode_resistance(tri_scene(length_mm=length), "top", 0.07) for length in (100.0, 97.3))
    assert cut.times(100 / 97.3).lower <= whole.upper
    assert whole.lower <= cut.times(100 / 97.3).upper
    assert cut.width() < 1e-3
    strips = [ratio(rect_scene(**sides)) for sides in ({}, {"length_mm": 97.3}, {"width_mm": 8.7})]
    assert all(found.width() < 1e-3 for found in strips)
    assert strips[1].middle() == close(strips[0].middle(), 1e-3)
    assert strips[2].middle() < strips[0].middle()  # half a strip more at the edge


def test_a_tooth_that_hangs_free_carries_nothing():
    teeth = [box(2 * k, 2 * k + 1, 0, 1, 0.0, 0.49) for k in range(5)]
    found = ratio(metal(box(0, 10, 0, 1, 0.5, 0.8), *teeth, size_mm=(10.0, 1.0, 0.8)))
    assert holds(found, 1.0)
    assert found.width() < 1e-8


def test_round_cogs_have_rayleighs_bounds():
    ring = [(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * pi, 8, endpoint=False)]
    pins = [Prism("z", tuple((2 * k + 1 + 0.5 * c, 1 + 0.5 * s) for c, s in ring), 0.0, 0.5) for k in range(5)]
    scene = metal(box(0, 10, 0, 2, 0.5, 0.8), *pins, size_mm=(10.0, 2.0, 0.8))
    found = ratio(scene)
    volume = 10 * 2 * 0.3 + sum(p.volume_mm3() for p in pins)
    assert (found.lower, found.upper) == close((6.0 / volume, 1.0), 1e-12)


def test_no_field_solver_is_loaded_where_none_is_needed():
    code = (
        "import sys\nfrom sensorgen.design.design import make\n"
        "from sensorgen.models.conduction import electrode_resistance\n"
        "for parameters in ({'along': 'y'}, {}):\n"
        "    scene = make({'shape': 'tri', 'parameters': parameters}).in_use\n"
        "    electrode_resistance(scene, 'bottom', 0.2)\n"
        "    if parameters: electrode_resistance(scene, 'top', 0.07)\n"
        "print([m for m in sys.modules if '.solvers' in m or 'fem' in m or m == 'scipy'])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert found.stdout.strip() == "[]"


def test_a_solver_that_fails_is_seen(monkeypatch):
    """Planted: a flux of one part in a hundred too much."""
    right = fem2d._best_multiple
    monkeypatch.setattr(fem2d, "_best_multiple", lambda *given: 1.01 * right(*given))
    conduction._per_resistivity.cache_clear()
    with pytest.raises(bounds.CrossedBounds, match="lower bound"):
        ratio(tri_scene(), width=1.01e-3)


def test_a_slit_cog_is_seen():
    """Planted: a slit of 1 um across each foot leaves the plate alone, which the reference excludes."""
    k = np.arange(50)
    teeth = [Prism("y", ((2 * n, 0.499), (2 * n + 0.5, 0.0), (2 * n + 1, 0.499)), 0.0, 10.0) for n in k]
    found = ratio(metal(box(0, 100, 0, 10, 0.5, 0.8), *teeth, size_mm=(100.0, 10.0, 0.8)))
    assert not holds(found, COMB)
    assert holds(found, 1.0)


@pytest.mark.parametrize(
    ("scene", "terminal", "options", "words"),
    [
        (metal(box(0, 10, 0, 1, 0, 1)), "bottom", {}, "no bottom electrode"),
        (metal(box(1, 10, 0, 1, 0, 1)), "top", {}, "runs from 1 to 10 mm along x; expected 0 to 10 mm"),
        (metal(box(0, 4, 0, 1, 0, 1), box(5, 10, 0, 0.5, 0, 1)), "top", {}, "does not conduct along x"),
        (metal(box(0, 10, 0, 1, 0, 1)), "top", {"resistivity_ohm_m": -1.0}, "resistivity of the top electrode is -1"),
        (metal(box(0, 10, 0, 1, 0, 1)), "top", {"width": 0.0}, "accuracy is 0"),
    ],
)
def test_what_has_no_resistance_is_refused(scene, terminal, options, words):
    with pytest.raises(OutOfRange, match=words):
        electrode_resistance(scene, terminal, **{"resistivity_ohm_m": 1.0} | options)
