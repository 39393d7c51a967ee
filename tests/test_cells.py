"""The repeating cell: it holds the whole section, mirrors stand where the pattern has them, and nowhere else."""

from collections import defaultdict

import pytest

from sensorgen.design.shapes import reference, tri
from sensorgen.scene.repetition import SectionCell, cell
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box
from sensorgen.scene.sections import ROUNDING_MM, sections

HEIGHT_MM = 1.4


def found(scene: Scene) -> SectionCell:
    return cell(sections(scene)[0], scene.size_mm[2])


def ridges(length_mm: float, *places: tuple[float, float, float, str]) -> Scene:
    """Boxes on a flat electrode, each with its left and right side, its height and its material; 1 mm deep."""
    solid = [Body(f"r{k}", m, (box(a, b, 0, 1, 0.2, 0.2 + h),)) for k, (a, b, h, m) in enumerate(places)]
    low = Body("low", "etpu", (box(0, length_mm, 0, 1, 0, 0.2),), "bottom")
    high = Body("high", "etpu", (box(0, length_mm, 0, 1, 1.2, HEIGHT_MM),), "top")
    return Scene((low, *solid, high), (length_mm, 1.0, HEIGHT_MM))


def areas(cell_found: SectionCell) -> dict[str, float]:
    """Of each material over the whole sensor, by the shares [mm2]."""
    total: dict[str, float] = defaultdict(float)
    for here, share in zip(cell_found.slices, cell_found.shares, strict=True):
        for band in here.bands:
            heights = [t - b for b, t in zip(band.bottom_mm, band.top_mm, strict=True)]
            total[band.terminal or band.material] += share * (here.right_mm - here.left_mm) * sum(heights) / 2
    return total


def drawn(scene: Scene) -> dict[str, float]:
    """Areas of the outlines themselves, 1 mm deep, air being the rest [mm2]."""
    total = {"air": scene.size_mm[0] * scene.size_mm[2]}
    for body in scene.bodies:
        area = sum(abs(_shoelace(outline)) for part in body.pieces for outline in part.cut("y", 0.5))
        total[body.terminal or body.material] = total.get(body.terminal or body.material, 0.0) + area
        total["air"] -= area
    return total


def _shoelace(outline) -> float:
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, (*outline[1:], outline[0]), strict=True)) / 2


def width_mm(cell_found: SectionCell) -> float:
    return cell_found.slices[-1].right_mm - cell_found.slices[0].left_mm


def comb(periods: float, first_mm: float, material: str = "x60") -> Scene:
    """Ridges 0.4 mm wide each millimetre, the first one's middle at a place; cut at the sensor's end."""
    spans = ((first_mm - 0.2 + k, first_mm + 0.2 + k) for k in range(int(periods) + 1))
    return ridges(periods, *((max(a, 0.0), min(b, periods), 0.5, material) for a, b in spans if a < periods))


WEDGE = Body("wedge", "x60", (Prism("y", ((0.3, 0.2), (1.1, 0.2), (0.9, 0.8)), 0.0, 1.0),))
LONELY = ridges(2.0)
SCENES = {
    "tri": tri.scene(tri.Params(length_mm=14.0, width_mm=1.0, dielectric_mm=0.1), Fill()),
    "tri, cut": tri.scene(tri.Params(length_mm=7.3, width_mm=1.0, dielectric_mm=0.1), Fill()),
    "plate": reference.scene(reference.Params(length_mm=2.0, width_mm=1.0), Fill()),
    "comb": comb(4, 0.5),
    "comb, from amid a ridge": comb(4, 0.0),
    "comb, cut anywhere": comb(3.7, 0.3),
    "comb, whole periods from anywhere": comb(3, 0.75),
    "one wedge": Scene((LONELY.bodies[0], WEDGE, LONELY.bodies[-1]), LONELY.size_mm),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_cell_times_its_shares_holds_all_that_is_drawn(name):
    scene = SCENES[name]
    mine, exact = areas(found(scene)), drawn(scene)
    for material, area in exact.items():
        assert mine.get(material, 0.0) == pytest.approx(area, abs=1e-7)


@pytest.mark.parametrize(
    ("name", "width", "times"),
    [("tri", 1.0, 14), ("comb", 0.5, 8), ("comb, whole periods from anywhere", 1.5, 2), ("one wedge", 2.0, 1)],
)
def test_the_smallest_piece_is_found(name, width, times):
    """Half a period between mirrors, or more of which each part occurs equally often; all of a section without."""
    piece = found(SCENES[name])
    assert width_mm(piece) == pytest.approx(width)
    assert set(piece.shares) == {times}


@pytest.mark.parametrize("material", ["x60", "pva"])
def test_one_ridge_that_differs_makes_the_piece_longer(material):
    """The last of four is of another material, or higher by a micrometre: mirrors stand at it and opposite of it."""
    first = [(k + 0.3, k + 0.7, 0.5, "x60") for k in range(3)]
    scene = ridges(4.0, *first, (3.3, 3.7, 0.501 if material == "x60" else 0.5, material))
    piece = found(scene)
    assert width_mm(piece) == pytest.approx(2.0)
    assert set(piece.shares) == {2.0}
    assert dict(areas(piece)) == pytest.approx(drawn(scene), abs=1e-7)


def test_one_piece_alone_does_not_show_that_it_repeats():
    """Mirrors at 1.5 and 3.5 mm fold all of 5 mm into one piece, of which no second follows."""
    piece = found(ridges(5.0, (1.3, 1.7, 0.5, "x60"), (3.3, 3.7, 0.6, "x60")))
    assert width_mm(piece) == pytest.approx(5.0)
    assert set(piece.shares) == {1.0}


def test_cut_ends_count_what_is_left_of_them():
    """2.5 periods from amid a ridge, a mirror each half: five halves, alike; 2.25 leave one part out once."""
    even, cut = found(comb(2.5, 0.0)), found(comb(2.25, 0.0))
    assert set(even.shares) == {5.0}
    assert sorted(set(cut.shares)) == [4.0, 5.0]
    assert sum(s * (p.right_mm - p.left_mm) for p, s in zip(cut.slices, cut.shares, strict=True)) == pytest.approx(2.25)


def test_slices_are_as_wide_as_lines_are_straight():
    """A slope of 1 in 1000 still bends; boxes of one material side by side and on each other are one."""
    bent = Prism("y", ((0.0, 0.2), (2.0, 0.2), (2.0, 0.7), (1.0, 0.701), (0.0, 0.7)), 0.0, 1.0)
    one = found(Scene((LONELY.bodies[0], Body("b", "x60", (bent,)), LONELY.bodies[-1]), LONELY.size_mm))
    beside = ridges(2.0, (0.0, 0.9, 0.5, "x60"), (0.9, 2.0, 0.5, "x60"))
    upon = Body("upon", "x60", (box(0, 2, 0, 1, 0.7, 0.9),))
    flat = found(Scene((*beside.bodies[:-1], upon, beside.bodies[-1]), beside.size_mm))
    assert width_mm(one) == pytest.approx(1.0)
    assert len(flat.slices) == 1
    assert [band.material or band.terminal for band in flat.slices[0].bands] == ["bottom", "x60", "air", "top"]


@pytest.mark.parametrize("depth_mm", [1e-6, 1e-3])
def test_outlines_that_overlap_are_refused(depth_mm):
    """However little, as long as it is more than rounding."""
    over = ridges(2.0, (0.0, 2.0, 0.5, "x60"))
    lid = Body("lid", "pva", (box(0, 2, 0, 1, 0.7 - depth_mm, 0.9),))
    assert depth_mm > ROUNDING_MM
    with pytest.raises(ValueError, match="overlap"):
        found(Scene((*over.bodies[:2], lid, over.bodies[-1]), over.size_mm))


def steps(periods: int) -> Scene:
    """Three steps a period, which look another way from the other side: no place of the row is a mirror."""
    heights = ((0.0, 0.2, 0.3), (0.2, 0.5, 0.5), (0.5, 0.8, 0.7))
    return ridges(periods, *((k + a, k + b, h, "x60") for k in range(periods) for a, b, h in heights))


def test_a_row_without_mirrors_is_solved_as_a_whole():
    found_here = found(steps(6))
    assert width_mm(found_here) == pytest.approx(6.0)
    assert set(found_here.shares) == {1.0}
