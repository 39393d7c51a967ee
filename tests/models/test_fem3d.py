"""Boxes between two bounds: references, the cross-section's elements, voxels, ends amid a cell, bad input."""

import numpy as np
import pytest
from cell_scenes import CELLS, EPS, MM, close, cut_slabs, plates, rect_cell, tri_cell

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.design.shapes import rect
from sensorgen.models import columns, fem3d
from sensorgen.scene.scene import Body, Fill, Scene, box
from sensorgen.solvers.electrostatics.bounds import FieldStep
from sensorgen.solvers.electrostatics.boxes import grid, whole


@pytest.fixture(scope="module")
def rungs() -> dict[float, list[FieldStep]]:
    return {d: list(fem3d.steps(rect_cell(d), EPS, 1e-3)) for d in (0.1, 0.2)}


@pytest.mark.parametrize("case", CELLS["rect"], ids=lambda c: f"d={c['d']}")
def test_rect_lies_between_its_bounds(case, rungs):
    off = case["rel_error_halfwidth"]
    for step in rungs[case["d"]]:
        assert step.interval.lower < case["C_F"] * (1 + off)
        assert case["C_F"] * (1 - off) < step.interval.upper
    assert rungs[case["d"]][-1].interval.width() < 1e-3


def test_many_bricks_begin_without_layers(monkeypatch):
    """A cell of many takes the coarse meshes first: as wide as asked for, in a fifth of the unknowns."""
    case = CELLS["rect"][0]
    layered = next(fem3d.steps(rect_cell(case["d"]), EPS, 3e-2))
    monkeypatch.setattr(fem3d, "_MANY_BRICKS", 1)
    (step,) = fem3d.steps(rect_cell(case["d"]), EPS, 3e-2)
    assert step.interval.lower < case["C_F"] < step.interval.upper
    assert 3.4e-3 < step.interval.width() < 3e-2
    assert step.layers == 0
    assert step.unknowns < layered.unknowns / 5


def test_rungs_lie_within_each_other(rungs):
    for steps in rungs.values():
        bounds = [(s.interval.lower, s.interval.upper) for s in steps]
        assert sorted(bounds) == bounds
        assert [u for _, u in bounds] == sorted((u for _, u in bounds), reverse=True)


def test_slabs_that_the_sensors_end_cuts():
    scene, exact = cut_slabs()
    found = fem3d.capacitance(scene, EPS)
    assert (found.lower, found.upper) == close((exact, exact), 1e-6)  # the root of what doubles lose


def feet(window: tuple[float, float]) -> Scene:
    """Feet of an electrode over a film, 0.8 of 2 mm wide, 1 mm deep, seen through a window."""
    low, high = window
    ends = [(max(k + 0.6, low) - low, min(k + 1.4, high) - low) for k in range(-2, int(high) + 2, 2)]
    length, deep = high - low, 1.0
    posts = [box(a, b, 0, deep, 0.5, 0.8) for a, b in ends if b - a > 1e-9]
    whole = (0, length, 0, deep)
    bodies = (
        Body("low", "etpu", (box(*whole, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(*whole, 0.3, 0.4),)),
        Body("top", "etpu", (*posts, box(*whole, 0.8, 1.0)), "top"),
    )
    return Scene(bodies, (length, deep, 1.0))


@pytest.mark.parametrize("ends", [(0.0, 4.45), (0.8, 6.0)])
def test_a_sensor_that_ends_amid_a_cell_as_the_cross_section_has_it(ends):
    """An independent program on the same scene: where the end cuts a foot, and where it cuts the air beside it."""
    from sensorgen.models import fem2d

    flat, deep = fem2d.capacitance(feet(ends), EPS, 1e-5), next(fem3d.steps(feet(ends), EPS)).interval
    assert deep.lower < flat.lower < flat.upper < deep.upper
    assert deep.width() < 3e-3


def test_ends_that_lose_as_the_cross_section_has_them():
    from sensorgen.models import fem2d

    lossy = {"x60": 4.68 * (1 - 0.1j), "air": 1.00059}
    flat, deep = fem2d.lossy(feet((0.45, 6.0)), lossy, 1e-4), fem3d.lossy(feet((0.45, 6.0)), lossy, 4e-3)
    assert abs(flat.centre - deep.centre) < flat.radius + deep.radius
    assert deep.width() < 4e-3
    plain, bounds = (ask(feet((0.45, 6.0)), EPS, 4e-3) for ask in (fem3d.lossy, fem3d.capacitance))
    assert plain.centre.real + plain.radius == close(bounds.upper, 1e-7)


def test_ends_of_rect_cost_as_little_as_whole_cells(rungs):
    """4.3 x 4 mm: the energy of the part alone would be known to a few percent."""
    scene = rect.scene(rect.Params(length_mm=4.3, width_mm=4.0, dielectric_mm=0.2), Fill())
    cut = next(fem3d.steps(scene, EPS))
    assert cut.interval.width() < 1.5 * rungs[0.2][0].interval.width()
    found = columns.capacitance(scene, EPS)
    assert found.lower < cut.interval.lower < cut.interval.upper < found.upper


LONG = {"x60_width_mm": 0.9, "dielectric_mm": 0.2}  # of period 2.2 mm: neither 100 nor 10 mm is a multiple of it


def test_a_cell_that_the_end_cuts_is_one_period_and_not_half_the_sensor():
    from sensorgen.models import press3d

    scene = rect.scene(rect.Params(length_mm=100.0, width_mm=10.0, **LONG), Fill())
    cut, pressed = grid(scene), press3d.cell(scene)
    for planes in (cut.planes_mm[0], cut.planes_mm[1], pressed.planes_m[0] / MM, pressed.planes_m[1] / MM):
        assert np.ptp(planes) == close(1.1, 1e-9)
    assert (cut.fill > 1).sum() < 40
    assert [len(p) for p in pressed.planes_m[:2]] == [4, 4]  # the end of the sensor needs no plane
    halves = rect.scene(rect.Params(length_mm=5.0, width_mm=2.0), Fill())  # a piece that fits at little cost is kept
    assert np.ptp(grid(halves).shares) == 0


def occurrences(at_mm: np.ndarray, end_mm: float, period_mm: float) -> np.ndarray:
    """How often each place between the mirrors, or its image, lies within a sensor."""
    images = [sign * at_mm + 0.7 * (sign < 0) + k * period_mm for sign in (1, -1) for k in range(-1, 60)]
    return sum(((x > 0) & (x < end_mm)).astype(int) for x in images)


def test_a_sensor_that_the_end_cuts_in_both_directions_as_voxels_have_it():
    """A resistor network: its derivative by weights on the permittivity is the energy in the parts that they stand for.

    The share of a whole cell's capacitance depends little on the size of the voxels.
    """
    import voxels

    h, period, film, high = 0.05, 2.2, 0.2, 0.3
    n = round(period / 2 / h)
    at = 0.35 + (np.arange(n) + 0.5) * h
    eps, metal = np.full((n, n, 18), EPS["air"]), np.full((n, n, 18), -1)
    z = (np.arange(18) - 1 + 0.5) * h
    foot, post = at < 0.7, at > 1.0
    for strips, low in ((foot[:, None], film + high), (foot[None, :], film)):
        metal[np.broadcast_to(strips, (n, n))[..., None] & (z > low) & (z < low + high)] = 1
    for strips, low in ((post[:, None], film + high), (post[None, :], film)):
        eps[np.broadcast_to(strips, (n, n))[..., None] & (z > low) & (z < low + high)] = EPS["x60"]
    eps[..., (z > 0) & (z < film)] = EPS["x60"]
    metal[..., 0], metal[..., -1] = 0, 1
    along, across = (occurrences(at, end, period) for end in (100.0, 10.0))
    weight = 0.01 * np.outer(across, along)[..., None] / np.outer(across, along).max()
    more, less, cell = (voxels.upper(eps * (1 + s * weight), metal, h) for s in (1, -1, 0))
    ratio = (more - less) / 0.02 * np.outer(across, along).max() / cell
    scene = rect.scene(rect.Params(length_mm=100.0, width_mm=10.0, **LONG), Fill())
    whole = rect.scene(rect.Params(length_mm=2.2, width_mm=2.2, **LONG), Fill())
    all_of_it, one = (next(fem3d.steps(s, EPS)).interval.middle() for s in (scene, whole))
    assert all_of_it / one * 4 == close(ratio, 1e-3)
    assert all_of_it / one * 4 != close(1000 / 1.1**2, 3e-3)  # by area alone it would not be caught


@pytest.mark.parametrize(
    ("first", "width", "meshes"),
    [(2.0, 1e-3, [0, 3, 4]), (2.0, 1e-9, [0, 8])],
)
def test_meshes_that_are_not_expected_to_do_are_left_out(first, width, meshes, monkeypatch):
    """Widths as on rect times some factor; every second mesh does 20 % worse than expected."""
    used = []

    def bounds(_) -> Interval:
        mesh = fem3d.MESHES[meshes[len(used)]]
        used.append(mesh)
        reached = mesh.width * first * 1.2 ** ((len(used) - 1) % 2)
        return Interval(1 - reached / 2, 1 + reached / 2)

    coarse = grid(plates(Body("a", "a", (box(0, 2, 0, 1, 0.2, 1.2),))))
    found = [m for m, *_ in fem3d.narrowed(bounds, coarse, [0.0, 0.0, 1.0], width)]
    assert found == used == [fem3d.MESHES[k] for k in meshes]
    used.clear()
    monkeypatch.setattr(fem3d, "_MOST_UNKNOWNS", 1)
    assert [m for m, *_ in fem3d.narrowed(bounds, coarse, [0.0, 0.0, 1.0], width)] == [fem3d.MESHES[0]]


@pytest.mark.parametrize("least", [0.0, 1.0, 4.0])
def test_a_part_lies_where_any_flux_so_near_has_it(least):
    """Fluxes of a few numbers, without a second pair of fields: the worst is met."""
    rng = np.random.default_rng(1)
    shares, exact = np.array([least, least + 1, least + 3.0]), rng.normal(size=3)
    for off in (0.01, 0.3, 2.0):
        seen = []
        for way in (*rng.normal(size=(200, 3)), (shares - least) * exact, -(shares - least) * exact):
            missing = off * way / np.linalg.norm(way) * rng.uniform(0.9, 1)
            near = exact - missing
            cell = Interval(float(near @ near), float(near @ near) + off**2)
            unmet = float((((shares - least) * near) ** 2).sum())
            bounds = whole(cell, float((shares - least) @ near**2), unmet, shares)
            # the flux is the best of its kind: what it misses is at right angles to it
            truth = least * float(near @ near + missing @ missing) + float((shares - least) @ exact**2)
            assert bounds.lower <= truth <= bounds.upper
            seen.append(max(truth - bounds.lower, bounds.upper - truth) / (bounds.upper - bounds.lower))
        assert max(seen) > 0.8


def test_what_it_cannot_speak_of():
    touching = plates(Body("post", "etpu", (box(0, 1, 0, 1, 0.2, 1.2),), "top"))
    overlap = plates(Body("a", "x60", (box(0, 2, 0, 1, 0.2, 0.6),)), Body("b", "pva", (box(0, 2, 0, 1, 0.5, 0.8),)))
    middle = plates(Body("mid", "etpu", (box(0, 2, 0, 1, 0.5, 0.6),), "middle"))
    half = Scene((plates().bodies[0], Body("high", "etpu", (box(0, 1, 0, 1, 1.2, 1.4),), "top")), (2.0, 1.0, 1.4))
    for scene, words in (
        (touching, "touch"),
        (overlap, "overlaps"),
        (middle, "two electrodes"),
        (half, "does not cover"),
        (tri_cell(0.1), "boxes"),
        (rect_cell(0.0), "touch"),
    ):
        assert words in (fem3d.why_not_applicable(scene) or "")
    assert fem3d.why_not_applicable(rect_cell(0.1)) is None


def test_nonsense_is_refused():
    with pytest.raises(OutOfRange, match="x60"):
        fem3d.capacitance(rect_cell(0.1), EPS | {"x60": -1.0})
    with pytest.raises(KeyError, match="x60"):
        fem3d.capacitance(rect_cell(0.1), {"air": 1.0})
