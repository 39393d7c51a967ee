"""Places on the plate: apart from one another, inside the bed, off the tower; the same on every machine."""

from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import OutOfRange
from sensorgen.design.printer import load_printer, load_quality, tower
from sensorgen.workflows.batch.layout import Rect, Room, column, packed, room

FINE = load_quality("fine")
PRINTERS = ("diabase-h5", "prusa-xl5")
SENSOR = (100.0, 10.0)


def diabase(spacing=5.0, brim=0.0, tools=2):
    return room(load_printer("diabase-h5"), FINE, tools, spacing, brim)


def distance(a, b):
    """Between two rectangles, along the axis where they are further apart [mm]."""
    return max(a.x0 - b.x1, b.x0 - a.x1, a.y0 - b.y1, b.y0 - a.y1)


SIZES = st.lists(
    st.tuples(st.floats(1, 150), st.floats(1, 120)).map(lambda s: (round(s[0], 2), round(s[1], 2))),
    min_size=1, max_size=25,
)  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(
    SIZES, st.sampled_from(PRINTERS), st.integers(1, 5), st.sampled_from([0.0, 0.5, 5.0]), st.sampled_from([0.0, 3.0]),
    st.sampled_from([packed, column(1), column(5)]),
)  # fmt: skip
def test_every_specimen_has_a_place_of_its_own(sizes, name, tools, spacing, brim, layout):
    printer = load_printer(name)
    plates = layout(sizes, room(printer, FINE, tools, spacing, brim))
    assert sorted(n for plate in plates for n in plate) == list(range(len(sizes)))
    centre_x, centre_y = printer.bed_centre_mm()
    half_x, half_y = printer.bed_mm[0] / 2, printer.bed_mm[1] / 2
    at = tower(printer, FINE, tools)
    stands = Rect(at.x_mm, at.y_mm, at.x_mm + at.side_mm, at.y_mm + at.side_mm)
    for plate in plates:
        for number, place in plate.items():
            assert (place.x1 - place.x0, place.y1 - place.y0) == pytest.approx(sizes[number])
            assert min(place.x0 - centre_x + half_x, centre_x + half_x - place.x1) >= 5 + brim - 1e-5
            assert min(place.y0 - centre_y + half_y, centre_y + half_y - place.y1) >= 5 + brim - 1e-5
            assert tools == 1 or distance(place, stands) >= 2 + spacing + 2 * brim - 1e-5
        for a, b in combinations(plate.values(), 2):
            assert distance(a, b) >= spacing + 2 * brim - 1e-5


@pytest.mark.parametrize("gap", [0.0, 2.0, 3.0])
def test_a_full_plate_stays_clear_of_what_stands_in_its_middle(gap):
    kept = Rect(25.0, 15.0, 35.0, 25.0)
    here = Room(Rect(0.0, 0.0, 60.0, 40.0), (kept,), gap)
    for side in (4.0, 5.0, 6.5):
        first = packed([(side, side)] * 200, here)[0].values()
        assert min(distance(place, kept) for place in first) >= gap - 1e-9
        assert {(p.x0 > kept.x1, p.x1 < kept.x0, p.y0 > kept.y1, p.y1 < kept.y0) for p in first} >= {
            (True, False, False, False), (False, True, False, False), (False, False, True, False),
        }  # fmt: skip
        # At least half of what area and gaps allow.
        assert len(first) >= 0.5 * ((60 + gap) * (40 + gap) - (10 + gap) ** 2) / (side + gap) ** 2


def test_no_plate_holds_more_than_its_area_and_few_much_less():
    sizes = [SENSOR] * 200
    plates = packed(sizes, diabase())
    # 3 columns of 11 rows of 10 mm with 5 mm between lie on 380 x 160 mm; the tower is beside them.
    assert [len(plate) for plate in plates] == [33] * 6 + [2]


def test_large_ones_first_where_it_saves_a_plate():
    # In the order given, the small one takes so much of the left edge that the long one would meet the tower.
    sizes = [(10.0, 60.0), (380.0, 80.0)]
    assert len(packed(sizes, diabase())) == 1


def test_one_tool_needs_no_tower():
    big = (380.0, 160.0)
    assert len(packed([big], diabase(tools=1))) == 1
    with pytest.raises(OutOfRange, match="fits on no plate"):
        packed([big], diabase(tools=2))


def test_the_column_of_the_thesis():
    plate = column(5)([SENSOR] * 5, diabase())[0]
    assert [place.centre_mm for place in plate.values()] == [(0, -30), (0, -15), (0, 0), (0, 15), (0, 30)]


def test_columns_side_by_side_and_plates_after_them():
    plates = column(5)([SENSOR] * 20, diabase())
    assert [len(plate) for plate in plates] == [15, 5]  # a fourth column of 100 mm would leave the bed


def test_a_column_is_no_deeper_than_the_plate():
    assert [len(p) for p in column(5)([(300.0, 40.0)] * 5, diabase())] == [3, 2]


def test_what_is_too_large_is_said():
    with pytest.raises(OutOfRange, match=r"400 x 10 mm fits on no plate .* 380 x 160 mm are free"):
        packed([SENSOR, (400.0, 10.0)], diabase())
    with pytest.raises(OutOfRange, match="use the layout 'packed'"):
        column(5)([(340.0, 150.0)], diabase())
    assert len(packed([(340.0, 150.0)], diabase())) == 1


def test_the_block_lies_in_the_middle():
    plate = packed([SENSOR] * 3, diabase())[0]
    places = plate.values()
    assert min(p.x0 for p in places) == pytest.approx(-max(p.x1 for p in places))
    assert min(p.y0 for p in places) == pytest.approx(-max(p.y1 for p in places))
