"""Where the sheet has a defined answer, and where it says why there is none."""

from dataclasses import replace

import numpy as np
import pytest

from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.models.sheet import impedance, solve
from sensorgen.solvers.sheet.parts import Contact, Sheet, SheetPatch

FILM = Sheet(0.1, 0.05, (450.0, 700.0), 7e-8)
PORT = (FILM.edge("top", "left"), FILM.edge("bottom", "left"))
ALONG = (FILM.edge("top", "right"), FILM.edge("top", "left"))


def test_no_frequency_and_no_leak():
    z = impedance(FILM, [PORT, ALONG], [0.0, 1e3], cells=10)
    assert z[0, 0, 0] == complex(np.inf, 0.0)
    assert z[0, 1, 1] == pytest.approx(900.0)
    assert z[0, 0, 1] == pytest.approx(0.0, abs=1e-9)
    assert np.isfinite(z[1]).all()
    assert solve(FILM, [PORT, ALONG], 0.0).error < 1e-9
    leaky = replace(FILM, leak_s_per_m2=1e-3)
    assert impedance(leaky, [PORT], 0.0, cells=20)[0, 0, 0].real == pytest.approx(
        1 / (1e-3 * 0.1 * 0.05) + 1150 * 2 / 3, rel=1e-5
    )
    with pytest.raises(OutOfRange, match="infinite"):
        solve(FILM, [PORT], [1e3, 0.0], SheetPatch(0, 0, 0.01, 0.01, 1.1), of=["x_m"], cells=10)


def test_the_resolution_it_asks_for_is_taken():
    with pytest.raises(OutOfRange, match=r"grid too coarse: at 1e\+08 Hz .* use \d+ cells or more") as said:
        impedance(FILM, [PORT], 1e8, cells=20)
    cells = int(str(said.value).split("use ")[1].split()[0])
    assert np.isfinite(impedance(FILM, [PORT], 1e8, cells=cells)).all()
    with pytest.raises(OutOfRange, match="too coarse"):
        impedance(FILM, [PORT], 1e8, cells=cells - 1)


def test_a_hundred_times_the_depth_chooses_a_finer_grid_and_beyond_that_says_so():
    assert solve(FILM, [PORT], 1e7, accuracy=0.05).cells > solve(FILM, [PORT], 1e5, accuracy=0.05).cells
    with pytest.raises(OutOfRange, match="coarse"):
        solve(FILM, [PORT], 1e13)
    with pytest.raises(OutOfRange, match="320 cells reach"):
        solve(Sheet(0.1, 0.01, (450.0, 700.0), 7e-8), [PORT_NARROW], 1e3, accuracy=1e-14)


def test_a_number_of_cells_that_nobody_has_is_no_advice():
    for cells in (20, None):
        with pytest.raises(OutOfRange, match=r"too coarse.* long: use a lower frequency$"):
            impedance(FILM, [PORT], 9e99, cells=cells)


PORT_NARROW = tuple(Contact(side, (0.0, 0.0), (0.0, 0.01)) for side in ("top", "bottom"))


@pytest.mark.parametrize("ratio", [1e-6, 1e6])
def test_very_unequal_sheets(ratio):
    film = replace(FILM, sheet_resistance_ohm=(450.0, 450.0 * ratio))
    z = impedance(film, [PORT], 1e-3, cells=20)[0, 0, 0]
    assert z.real == pytest.approx(450.0 * (1 + ratio) * 2 / 3, rel=2e-3)


@pytest.mark.parametrize(
    ("ports", "words"),
    [
        ([], "no contact"),
        ([(PORT[0], PORT[0])], "reads nothing"),
        ([(PORT[0], FILM.edge("top", "front"))], "shorted"),
        ([PORT, (Contact("top", (0.0, 0.02), (0.01, 0.02)), PORT[1])], "shorted"),
        ([(PORT[0], Contact("bottom", (0.0, 0.01), (-0.01, 0.01)))], "y = -10 to 10 mm"),
    ],
)
def test_contacts_that_make_no_sense(ports, words):
    with pytest.raises((OutOfRange, BadInput), match=words):
        impedance(FILM, ports, 1e3)


def test_one_contact_may_serve_two_ports():
    far = FILM.edge("bottom", "right")
    z = impedance(FILM, [PORT, (PORT[0], far)], 1e5, cells=20)[0]
    assert z[0, 0] == pytest.approx(impedance(FILM, [PORT], 1e5, cells=20)[0, 0, 0], rel=0.1)
    assert abs(z[0, 1] - z[1, 0]) < 1e-9 * abs(z[0, 1])


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: Contact("middle", (0, 1), (0, 1)), UnknownName, "middle"),
        (lambda: Contact("top", (float("nan"), 0.01), (0, 1)), OutOfRange, "give the lower first"),
        (lambda: Contact("top", (0.01, 0.01), (0.02, 0.02)), OutOfRange, "infinite"),
        (lambda: FILM.edge("top", "north"), UnknownName, "north"),
        (lambda: replace(FILM, length_m=0.0), OutOfRange, "length_m has to be above 0"),
        (lambda: replace(FILM, width_m="10"), BadInput, "width_m takes a number"),
        (lambda: replace(FILM, sheet_resistance_ohm=(450.0, -1.0)), OutOfRange, "bottom sheet"),
        (lambda: replace(FILM, sheet_resistance_ohm=(450.0,)), BadInput, "two numbers"),
        (lambda: replace(FILM, capacitance_f_per_m2=np.array([[1e-8, -1e-8]])), OutOfRange, "capacitance"),
        (lambda: replace(FILM, capacitance_f_per_m2=np.array([1e-8, 1e-8])), BadInput, "array"),
        (lambda: SheetPatch(0, 0, 0.0, 0.01), OutOfRange, "length_m of the patch has to be above 0"),
        (lambda: impedance(FILM, [PORT], 1e3, SheetPatch(0.095, 0, 0.01, 0.01)), OutOfRange, "beyond the sheet"),
        (lambda: impedance(FILM, [PORT], [1e3, float("nan")]), OutOfRange, "not nan"),
        (lambda: impedance(FILM, [PORT], 1e100), OutOfRange, r"below 1e\+100"),
        (lambda: impedance(FILM, [PORT], "1kHz"), BadInput, "Hz"),
        (lambda: impedance(FILM, [PORT], 1e3, cells=0), OutOfRange, "one cell"),
        (lambda: solve(FILM, [PORT], 1e3, of=["x_m"]), OutOfRange, "needs a patch"),
        (lambda: solve(FILM, [PORT], 1e3, SheetPatch(0, 0, 0.01, 0.01), of=["x"]), UnknownName, "x_m"),
    ],
)
def test_bad_input_is_named(make, error, words):
    with pytest.raises(error, match=words):
        make()


@pytest.mark.parametrize("size", [(0.1, 0.05), (1e-7, 1e-7), (0.1, 1e-9)])
def test_patches_of_any_size(size):
    press = SheetPatch(0.1 - size[0], 0.05 - size[1], *size, 2.0, (3.0, 3.0))
    found = solve(FILM, [PORT], [1e3, 1e5], press, of=["x_m", "y_m", "capacitance_factor"], cells=10)
    loose = impedance(FILM, [PORT], [1e3, 1e5], cells=10)
    assert all(np.isfinite(value).all() for value in found.by.values())
    if size == (0.1, 0.05):
        all_over = Sheet(0.1, 0.05, (1350.0, 2100.0), 1.4e-7)
        assert found.impedance_ohm == pytest.approx(impedance(all_over, [PORT], [1e3, 1e5], cells=10), rel=1e-12)
    else:
        assert found.impedance_ohm == pytest.approx(loose, rel=1e-4)
