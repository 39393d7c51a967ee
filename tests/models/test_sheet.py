"""The sheet against closed forms, the one-dimensional line and its limits."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from line_cases import PLATE

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line
from sensorgen.models.sheet import impedance, solve
from sensorgen.solvers.sheet.parts import Contact, Sheet, SheetPatch
from sensorgen.solvers.sheet.solve import BY

TONES = np.array([1e-3, 1.1e3, 99.7e3, 1e6])
C = EPS0_F_PER_M * PLATE["eps_r"] / PLATE["film_m"]
STRIP = Sheet(
    PLATE["length_m"],
    PLATE["width_m"],
    (PLATE["top_resistivity_ohm_m"] / 3e-4, PLATE["bottom_resistivity_ohm_m"] / 3e-4),
    C,
)
PAIR = (STRIP.edge("top", "left"), STRIP.edge("bottom", "left"))
SQUARE = Sheet(0.1, 0.08, (450.0, 700.0), 7e-8, tan_delta=0.02, leak_s_per_m2=1e-6)
TIP = SheetPatch(0.0213, 0.0371, 0.015, 0.022, 1.3, (1.2, 1.1))


def pad(side, x, y, size=0.01):
    return Contact(side, (x, x + size), (y, y + size))


MIXED = [
    (pad("top", 0.0, 0.0), pad("bottom", 0.09, 0.07)),
    (SQUARE.edge("top", "right", 0.02, 0.05), SQUARE.edge("bottom", "front", 0.01, 0.04)),
    (pad("top", 0.03, 0.05), pad("top", 0.0, 0.0)),
]


def strip_press(x, factor, s_n):
    """A press across the whole strip, for the line and for the sheet."""
    strain = 1 - 1 / factor
    force = strain * PLATE["width_m"] * PLATE["tip_m"] * PLATE["modulus_pa"]
    piezo = dict.fromkeys(("top_piezoresistance_per_n", "bottom_piezoresistance_per_n"), s_n)
    inputs = PLATE | piezo | {"frequency_hz": TONES, "force_n": force, "left_m": x}
    return inputs, SheetPatch(x, 0.0, PLATE["tip_m"], PLATE["width_m"], factor, (1 + s_n * force,) * 2)


def rates(errors):
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize("s_n", [0.0, 0.005])
def test_with_edge_contacts_it_is_the_line_in_second_order(s_n):
    inputs, press = strip_press(0.043, 1.4, s_n)
    true = line.impedance(line.PressedLine(**inputs))
    off = [impedance(STRIP, [PAIR], TONES, press, cells=n)[:, 0, 0] - true for n in (20, 40, 80)]
    for part in (np.abs, np.real, np.imag):
        errors = [np.abs(part(one) / part(true)).max() for one in off]
        assert rates(errors) == pytest.approx(2, abs=0.15)
        assert errors[0] < 2e-3
        assert errors[2] < 2e-4


@pytest.mark.parametrize(("s_n", "least", "worst"), [(0.0, 1.7, 1e-3), (0.005, 0.7, 0.15)])
def test_the_derivative_by_place_converges_wherever_the_patch_lies(s_n, least, worst):
    """In second order; in first where the sheets change too, since current and voltage then bend under the edge."""
    errors = []
    for n in (20, 80):
        found = []
        for x in 0.04 + np.linspace(0, 0.005, 5):
            inputs, press = strip_press(x, 1.4, s_n)
            true = line.sensitivities(line.PressedLine(**inputs | {"frequency_hz": 99.7e3}), of=["left_m"])[1]["left_m"]
            got = solve(STRIP, [PAIR], 99.7e3, press, of=["x_m"], cells=n).by["x_m"][0, 0, 0]
            found.append(abs(got - true) / abs(true))
        errors.append(max(found))
    assert errors[0] < worst
    assert np.log2(errors[0] / errors[-1]) / 2 > least


def two_stretches(length, width, stretches):
    """Resistance in squares between two stretches of the front edge: conformal map onto the half plane."""
    k = mpmath.findroot(
        lambda m: mpmath.ellipk(1 - m) / (2 * mpmath.ellipk(m)) - width / length, (1e-6, 1 - 1e-6), solver="anderson"
    )
    quarter = mpmath.ellipk(k)
    a, b, c, d = (mpmath.ellipfun("sn", quarter * (2 * x / length - 1), m=k) for x in stretches)
    ratio = (b - a) * (d - c) / ((c - a) * (d - b))
    return float(mpmath.ellipk(1 - ratio) / mpmath.ellipk(ratio))


@pytest.mark.parametrize("stretches", [(0.0, 0.01, 0.08, 0.1), (0.01, 0.011, 0.05, 0.051)])
def test_stretches_of_an_edge_have_the_resistance_of_the_conformal_map(stretches):
    film = Sheet(0.1, 0.07, (450.0, 700.0), 7e-8)
    port = [tuple(film.edge("top", "front", *stretches[k : k + 2]) for k in (0, 2))]
    true = 450.0 * two_stretches(0.1, 0.07, stretches)
    errors = np.array([impedance(film, port, 0.0, cells=n)[0, 0, 0].real / true - 1 for n in (20, 40, 80)])
    assert (rates(np.abs(errors)) > 1.35).all()  # 1.8 to 2 in the end; without grading it is 1
    assert abs(4 * errors[2] - errors[1]) / 3 < 5e-3


def test_van_der_pauw_on_one_sheet():
    film, size = Sheet(0.1, 0.06, (450.0, 700.0), 7e-8), 1e-4
    places = [("front", 0.03), ("right", 0.02), ("back", 0.05), ("left", 0.01)]
    a, b, c, d = (film.edge("top", edge, at, at + size) for edge, at in places)
    z = impedance(film, [(a, b), (d, c), (b, c), (a, d)], 0.0, cells=80)[0].real
    assert np.exp(-np.pi * z[0, 1] / 450.0) + np.exp(-np.pi * z[2, 3] / 450.0) == pytest.approx(1, abs=1e-3)


def test_a_rectangle_between_opposite_edges_is_its_squares():
    port = [(SQUARE.edge("bottom", "left"), SQUARE.edge("bottom", "right"))]
    for n in (1, 7, 40):
        assert impedance(replace(SQUARE, leak_s_per_m2=0.0), port, 0.0, cells=n)[0, 0, 0] == pytest.approx(875.0)
    assert impedance(replace(SQUARE, sheet_resistance_ohm=(450.0, 0.0)), port, 1e4, cells=20)[0, 0, 0] == 0


@pytest.mark.parametrize("x", [0.0, 0.0213, 0.085])
def test_a_band_of_other_resistance_is_in_series(x):
    ends = SQUARE.edge("top", "left"), SQUARE.edge("top", "right")
    press = SheetPatch(x, 0.0, 0.015, 0.08, 1.0, (3.0, 1.0))
    squares = (0.1 + 2.0 * 0.015) / 0.08
    z = impedance(SQUARE, [ends], 0.0, press, cells=80)[0, 0, 0].real
    assert z == pytest.approx(450.0 * squares, rel=2e-3)
    beside = SheetPatch(0.0, x * 0.5, 0.1, 0.015, 1.0, (3.0, 1.0))  # along the current: in parallel
    z = impedance(SQUARE, [ends], 0.0, beside, cells=40)[0, 0, 0].real
    assert z == pytest.approx(450.0 * 0.1 / (0.065 + 0.015 / 3), rel=2e-4)


@pytest.mark.parametrize("contact", [PAIR, (pad("top", 0.09, 0.0, 0.01), pad("bottom", 0.09, 0.0, 0.01))])
def test_at_a_nanohertz_it_is_the_whole_capacitance(contact):
    film = replace(STRIP, tan_delta=0.0)
    z = impedance(film, [contact], [1e-9, 1.0], cells=40)[:, 0, 0]
    assert z.imag == pytest.approx(-1 / (2 * np.pi * np.array([1e-9, 1.0]) * C * 1e-3), rel=1e-9)
    assert z[0].real == pytest.approx(z[1].real, rel=1e-8)
    reach = 0.1 if contact is PAIR else 0.09  # a pad across the strip is an end of a shorter one
    third = sum(STRIP.sheet_resistance_ohm) * reach / 0.01 * (reach / 0.1) ** 2 / 3
    assert z[0].real == pytest.approx(third, rel=1e-3)


@pytest.mark.parametrize("ohm", [0.0, 1e-30])
def test_without_resistance_it_is_a_capacitor(ohm):
    film = replace(SQUARE, sheet_resistance_ohm=(ohm, ohm), leak_s_per_m2=0.0)
    z = impedance(film, MIXED[:2], 1e4, TIP, cells=20)[0]
    more = 0.3 * 0.015 * 0.022
    whole = 1 / ((1j + 0.02) * 2 * np.pi * 1e4 * 7e-8 * (0.1 * 0.08 + more))
    assert z == pytest.approx(np.full((2, 2), whole), rel=1e-6)


@pytest.mark.parametrize("side", [0, 1])
def test_one_perfect_sheet_leaves_the_other(side):
    ohm = (0.0, 900.0) if side else (900.0, 0.0)
    z = impedance(replace(STRIP, sheet_resistance_ohm=ohm), [PAIR], TONES, cells=20)
    assert z == pytest.approx(impedance(replace(STRIP, sheet_resistance_ohm=(450.0, 450.0)), [PAIR], TONES, cells=20))
    wired = Contact("top", (0.1, 0.1), (0.0, 0.01)), PAIR[1]  # the current now enters and leaves at opposite ends
    twin = impedance(replace(STRIP, sheet_resistance_ohm=ohm), [wired], TONES, cells=20)
    assert twin == pytest.approx(z) if not side else np.isfinite(twin).all()


def test_sheets_that_change_differently_are_not_folded():
    inputs, press = strip_press(0.043, 1.4, 0.005)
    press = replace(press, resistance_factor=(press.resistance_factor[0], 1.0))
    true = line.impedance(line.PressedLine(**inputs | {"bottom_piezoresistance_per_n": 0.0}))
    z = impedance(STRIP, [PAIR], TONES, press, cells=80)[:, 0, 0]
    assert z.real == pytest.approx(true.real, rel=1e-3)


@pytest.mark.parametrize("name", BY)
def test_derivatives_follow_the_impedance_in_two_dimensions(name):
    """Differences of fourth order, which see the same film; the hats are piecewise, so a small step inside a piece."""
    step = 1e-6 if name in ("x_m", "y_m") else 1e-3

    def moved(by):
        if name.endswith("resistance_factor"):
            top, bottom = TIP.resistance_factor
            return replace(TIP, resistance_factor=(top + by, bottom) if name[0] == "t" else (top, bottom + by))
        return replace(TIP, **{name: getattr(TIP, name) + by})

    def z(by):
        return impedance(SQUARE, MIXED, [1e4, 1e6], moved(by), cells=20)

    slope = (8 * (z(step) - z(-step)) - z(2 * step) + z(-2 * step)) / (12 * step)
    exact = solve(SQUARE, MIXED, [1e4, 1e6], TIP, of=[name], cells=20).by[name]
    assert exact / np.abs(exact).max() == pytest.approx(slope / np.abs(exact).max(), abs=1e-6)


@pytest.mark.parametrize("size", [(0.015, 0.004), (0.0007, 0.0003)])
def test_a_light_press_anywhere_reads_the_squared_voltage_of_the_film(size):
    """First order in the press: dZ/dk = -j omega C'' times the integral of u^2, which is one-dimensional."""
    x, y, hertz = 0.0213, 0.0031, 99.7e3
    got = solve(STRIP, [PAIR], hertz, SheetPatch(x, y, *size), of=["capacitance_factor"], cells=80)
    r = sum(STRIP.sheet_resistance_ohm) / STRIP.width_m
    gamma = mpmath.sqrt(r * 2j * mpmath.pi * hertz * C * STRIP.width_m)
    z = mpmath.sqrt(r / (2j * mpmath.pi * hertz * C * STRIP.width_m)) / mpmath.tanh(gamma * STRIP.length_m)
    far = STRIP.length_m

    def voltage_squared(at):
        return (z * mpmath.cosh(gamma * (far - at)) / mpmath.cosh(gamma * far)) ** 2

    true = -2j * mpmath.pi * hertz * C * size[1] * mpmath.quad(voltage_squared, [x, x + size[0]])
    assert got.by["capacitance_factor"][0, 0, 0] == pytest.approx(complex(true), rel=2e-4)


def test_an_array_of_capacitances_is_what_a_patch_on_its_steps_makes():
    cells = np.full((10, 8), 7e-8)
    cells[2:5, 3:4] *= 1.3
    patch = SheetPatch(0.02, 0.03, 0.03, 0.01, 1.3)
    z = impedance(replace(SQUARE, capacitance_f_per_m2=cells), MIXED, 1e5, cells=23)
    assert z == pytest.approx(impedance(SQUARE, MIXED, 1e5, patch, cells=23), rel=1e-12)
    lumpy = replace(SQUARE, capacitance_f_per_m2=np.outer(np.arange(1, 8), np.arange(2, 7)) * 1e-8)
    pressed = impedance(replace(lumpy, sheet_resistance_ohm=(0.0, 0.0)), MIXED[:1], 1e5, TIP, cells=17)[0, 0, 0]
    x, y = np.linspace(0, 0.1, 2801), np.linspace(0, 0.08, 2001)
    mid_x, mid_y = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2
    under = ((mid_x > 0.0213) & (mid_x < 0.0363))[:, None] & ((mid_y > 0.0371) & (mid_y < 0.0591))
    c = lumpy.capacitances()[(mid_x / 0.1 * 7).astype(int)][:, (mid_y / 0.08 * 5).astype(int)] * (1 + 0.3 * under)
    whole = (0.02 + 1j) * 2 * np.pi * 1e5 * c.mean() * 0.008 + 1e-6 * 0.008
    assert pressed == pytest.approx(1 / whole, rel=1e-4)


def test_the_estimated_error_covers_the_true_one():
    inputs, press = strip_press(0.043, 1.4, 0.005)
    true = line.impedance(line.PressedLine(**inputs))
    for accuracy in (1e-2, 1e-3):
        got = solve(STRIP, [PAIR], TONES, press, accuracy=accuracy)
        z = got.impedance_ohm[:, 0, 0]
        off = max(np.abs(part(z - true) / part(true)).max() for part in (np.real, np.imag))
        assert off <= got.error <= accuracy
    stretches = (0.02, 0.03, 0.035, 0.09)
    port = [tuple(SQUARE.edge("top", "front", *stretches[k : k + 2]) for k in (0, 2))]
    got = solve(replace(SQUARE, leak_s_per_m2=0.0), port, 0.0, accuracy=2e-2)
    assert abs(got.impedance_ohm[0, 0, 0] / (450.0 * two_stretches(0.1, 0.08, stretches)) - 1) < got.error
