"""Resistivity that moves with pressure: from a design to Z, against the line by hand and moments of the pressure."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from drawn_sensor import sensor_of
from line_cases import PLATE as LINE_PLATE
from line_cases import TONES, exact

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design import materials
from sensorgen.design.design import make
from sensorgen.design.materials import source_folder, source_path
from sensorgen.design.values import piezoresistance
from sensorgen.models import compression, line
from sensorgen.models.pressure import bed, hertz
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.bodies import drawn as drawn_body
from sensorgen.prediction.double_layer import stack_of
from sensorgen.prediction.error_budget import error_budget
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.loaded import check_presses
from sensorgen.prediction.query import Load, Query
from sensorgen.prediction.sheet_study import _press

K = 2e-6  # 1/Pa: 12 % at 60 kPa
PLATE = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.07, 0.2), EPS0_F_PER_M * 4.68 * 0.01 / 6e-4, compression.unconfined(6e6))
TONE = np.array(TONES)


def by_hand(force, position, top, bottom, hertz=TONE):
    """Inputs of the line, the tip clipped and S_n = k / (W L_p); numbers may be mpmath's."""
    left, right = max(position - 0.005, 0), min(position + 0.005, 0.1)
    area = (right - left) / 100
    return LINE_PLATE | {
        "force_n": force, "left_m": left, "tip_m": right - left, "frequency_hz": hertz,
        "top_piezoresistance_per_n": top / area, "bottom_piezoresistance_per_n": bottom / area,
    }  # fmt: skip


@pytest.mark.parametrize("position", [0.0, 0.05, 0.0976])
def test_one_patch_is_the_lines_own(position):
    found = replace(PLATE, piezoresistance_per_pa=(K, -K / 4)).impedance(TONE, 3.0, position)
    expected = line.impedance(line.PressedLine(**by_hand(3.0, position, K, -K / 4)))
    assert found.real == pytest.approx(expected.real, rel=1e-11)
    assert found.imag == pytest.approx(expected.imag, rel=1e-13)
    away = PLATE.impedance(TONE, 3.0, position)
    assert (abs(found.real / away.real - 1) > (1e-4 if position < 0.09 else 0)).all()


@pytest.mark.parametrize(("force", "position"), [(-2.0, 0.002), (0.0, 0.05), (6.0, 0.0976)])
def test_slopes_against_mpmath(force, position):
    """Also where the tip overhangs: there the pressure, and the resistivity with it, moves with the place."""
    found = replace(PLATE, piezoresistance_per_pa=(K, -K / 4)).response(99.7e3, force, position)

    def z(f, x):
        return exact(digits=200, **by_hand(f, x, K, -K / 4, 99.7e3))

    with mpmath.workdps(50):
        by_force = complex(mpmath.diff(lambda f: z(f, mpmath.mpf(position)), force))
        by_position = complex(mpmath.diff(lambda x: z(force, x), mpmath.mpf(position)))
    for part in (np.real, np.imag):
        assert part(found.by_force_ohm_per_n) == pytest.approx(part(by_force), rel=1e-7, abs=1e-9)
        assert part(found.by_position_ohm_per_m) == pytest.approx(part(by_position), rel=1e-7, abs=1e-6)


STIFF = replace(PLATE, compression=compression.unconfined(1e18), piezoresistance_per_pa=(K, K))
MEAN, SQUARE = 4 / (3 * np.pi), 1 / 4  # of the distance from the middle of half an ellipse, over its half length


@pytest.mark.parametrize(
    ("sensor", "spread"),
    [
        (STIFF, 1 / 12),
        (replace(STIFF, profile="hertz", contact=hertz(0.2, 8e6)), 1 / 16),
        (replace(STIFF, profile="parabola", contact=bed(0.1, 1e10)), 1 / 20),
    ],
)
@pytest.mark.parametrize("position", [0.03, 0.09])
def test_re_z_of_a_short_line_is_a_moment_of_the_pressure(sensor, spread, position):
    """Far below the corner Re Z is the integral of r (1 - x/L)^2: each pascal counts where it presses."""
    sensor, force = replace(sensor, pieces=64), 2.0
    length = float(sensor.contact_m(force)[0])
    rise = replace(sensor, piezoresistance_per_pa=(0.0, 0.0)).track_ohm_per_m()[0] * K * force / sensor.width_m
    expected = rise * ((1 - position / 0.1) ** 2 + spread * (length / 0.1) ** 2)
    z = sensor.impedance(1.0, force, position) - sensor.impedance(1.0, 0.0, position)
    assert z.real == pytest.approx(expected, rel=2e-4)
    assert sensor.response(1.0, force, 0.03).by_force_ohm_per_n.real > 0


@pytest.mark.parametrize(
    ("profile", "mean", "square"), [("uniform", 1 / 2, 1 / 3), ("hertz", MEAN, SQUARE), ("parabola", 3 / 8, 1 / 5)]
)
def test_over_an_end_all_of_the_force_raises_what_is_left(profile, mean, square):
    sensor = replace(STIFF, profile=profile, pieces=64)
    rise = 9e4 * K * 2.0 / 0.01  # r of 0.27 ohm m over 0.3 mm and 10 mm
    for position, expected in ((0.0, 1 - 2 * mean * 0.05 + square * 0.05**2), (0.1, square * 0.05**2)):
        z = sensor.impedance(1.0, 2.0, position) - sensor.impedance(1.0, 0.0, position)
        assert z.real == pytest.approx(rise * expected, rel=1e-3)


def test_all_that_presses_says_the_same():
    """A stack of one film, and a sheet's patch."""
    sensor = replace(PLATE, piezoresistance_per_pa=(K, -K / 4))
    pressed = stack_of([sensor]).tracks
    assert [track.piezoresistance_per_pa for track in pressed] == [-K / 4, K]  # from the bottom
    patch, per_newton = _press(sensor, 0.005, 2.0)
    assert patch.resistance_factor == pytest.approx((1.16, 0.96))
    assert (per_newton["top_resistance_factor"], per_newton["bottom_resistance_factor"]) == pytest.approx((0.08, -0.02))


def design(rise=None, **rest):
    own_values = {} if rise is None else {"material_values": {"etpu": {"piezoresistance_per_pa": rise}}}
    return make({"shape": "reference"} | own_values | rest)


def source(name, rise):
    source_folder().mkdir(exist_ok=True)
    text = f"about: a lab\nmaterials: {{etpu: {{piezoresistance_per_pa: {{value: {rise}}}}}}}"
    source_path(name).write_text(text, "utf-8")
    return f"etpu@{name}"


def prediction(of):
    return evaluate(drawn_body(of), Query(law="unconfined"))


def test_no_source_that_ships_gives_one():
    assert piezoresistance(design()) == {}
    assert sensor_of(design()).sensor.piezoresistance_per_pa == (0.0, 0.0)
    told = "resistivity under the tip as elsewhere: no source says how it changes with pressure"
    assert told in prediction(design()).assumptions
    assert all(materials.load(name).properties.get("piezoresistance_per_pa", []) == [] for name in materials.names())


def test_a_design_sets_it_and_the_prediction_says_so():
    sensed = sensor_of(design(K))
    assert sensed.sensor.piezoresistance_per_pa == (K, K)
    assert [t.value for t in sensed.values if t.quantity == "piezoresistance_per_pa"] == [K]  # of one material, once
    found = prediction(design(K))
    said = "electrode rises with pressure by 2e-06 1/Pa (etpu, set by the user)"
    of = [text for text in found.assumptions if "rises with pressure" in text]
    assert of == [f"resistivity of the {end} {said}" for end in ("top", "bottom")]
    assert [v.value for v in found.values if v.quantity == "piezoresistance_per_pa"] == [K]
    assert "piezoresistance" not in {term.name for term in found.budget.terms}
    assert found.impedance == prediction(design()).impedance


def test_a_source_of_ones_own_gives_it():
    electrodes = {f"{end}_electrode": source("lab", K) for end in ("top", "bottom")}
    assert sensor_of(design(materials=electrodes)).sensor.piezoresistance_per_pa == (K, K)
    one = design(materials={"top_electrode": electrodes["top_electrode"]})
    assert sensor_of(one).sensor.piezoresistance_per_pa == (K, 0.0)
    (said,) = [text for text in prediction(one).assumptions if "rises with pressure" in text]
    assert said == "resistivity of the top electrode rises with pressure by 2e-06 1/Pa (etpu, lab)"


@pytest.mark.parametrize(
    ("top", "bottom", "ends"),
    [("a", "b", [(-K, -K), (3 * K, 3 * K)]), ("b", "", [(3 * K, 0.0), (3 * K, 3 * K)])],
    ids=["two sources", "one that speaks of one end"],
)
def test_the_budget_has_what_sources_disagree_on(top, bottom, ends):
    values = {"a": -K, "b": 3 * K}
    named = {f"{end}_electrode": source(name, values[name]) for end, name in (("top", top), ("bottom", bottom)) if name}
    drawn = design(materials=named)
    sensed = sensor_of(drawn, "unconfined")
    load = Load(tuple(TONES), 6.0, 0.05)
    terms = {term.name: term for term in error_budget(sensed, load).terms}
    rho = dict(zip(("top_resistivity_ohm_m", "bottom_resistivity_ohm_m"), sensed.sensor.resistivity_ohm_m, strict=True))

    def z(rises):
        return line.impedance(line.PressedLine(**by_hand(6.0, 0.05, *rises) | rho))

    ref, found = z(sensed.sensor.piezoresistance_per_pa), terms["piezoresistance"].changes
    for measure, part in {"magnitude": np.abs, "re": np.real, "im": np.imag}.items():
        expected = max(abs(part(z(e)) / part(ref) - 1).max() for e in ends)
        assert getattr(found, measure) == pytest.approx(expected, rel=1e-8)
    assert "1/Pa" in terms["piezoresistance"].what
    sure = design(K, materials=named)  # the user's own value is not doubted
    assert "piezoresistance" not in {term.name for term in error_budget(sensor_of(sure), load).terms}


@pytest.mark.parametrize("value", [float("nan"), -float("inf")])
def test_it_is_a_finite_number_of_either_sign(value):
    with pytest.raises(OutOfRange, match=r"piezoresistance_per_pa of etpu is .*; expected a finite number"):
        design(value)
    with pytest.raises(OutOfRange, match="expected a finite number"):
        design(materials={"top_electrode": source("bad", str(value).replace("inf", ".inf").replace("nan", ".nan"))})
    assert [sensor_of(design(rise)).sensor.piezoresistance_per_pa[0] for rise in (-K, 0.0)] == [-K, 0.0]
    with pytest.raises(UnknownName, match="piezoresistance_per_pa"):
        make({"shape": "tri", "material_values": {"etpu": {"piezoresistance_per_p": K}}})


def test_a_press_that_would_leave_no_resistivity_is_refused_in_words():
    sensor = replace(PLATE, piezoresistance_per_pa=(-2e-5, 0.0))
    said = r"resistivity under the tip would be negative \(-2e-05 1/Pa at 60 kPa\): press less"
    for ask in (sensor.impedance, sensor.response):
        with pytest.raises(OutOfRange, match=said):
            ask(1e3, 6.0, 0.05)
        assert np.isfinite(ask(1e3, 4.99, 0.05)).all()
    with pytest.raises(OutOfRange, match="negative"):
        sensor.impedance(1e3, 4.0, 0.0)  # on half the tip
    with pytest.raises(OutOfRange, match=r"force 3 N at position 0 mm: .*expected up to 2 N there, or a longer tip"):
        check_presses(sensor, [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.05])
