"""Pictures: what they are drawn from, the same bytes every time, and the page in a real browser."""

import base64
import gzip
import json
import re
import struct
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from drawn_sensor import sensor_of
from line_cases import PLATE

from sensorgen.analysis.plots import figure as figure_data
from sensorgen.analysis.plots import pages, static
from sensorgen.analysis.plots import results as plots
from sensorgen.analysis.plots.figure import Map, frequency, scale
from sensorgen.analysis.plots.results import (
    LARGEST,
    MOST_FREQUENCIES,
    QUANTITIES,
    figures,
    identifiability_figure,
    inverse,
    quantity,
    response,
)  # fmt: skip
from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.design.design import make
from sensorgen.models import line
from sensorgen.models.compression import unconfined
from sensorgen.models.sensor import Response, Sensor

TONES, FORCES, AT = (10.1e3, 99.7e3), (0.0, 2.0, 4.0, 6.0), (0.0, 20.0, 40.0, 60.0, 100.0)


@pytest.fixture(scope="module")
def sensor():
    slots = {"top_electrode": "etpu@thesis-c.1-top", "bottom_electrode": "etpu@thesis-c.1-bottom"}
    return sensor_of(make({"shape": "reference", "materials": slots}), "unconfined").sensor


@pytest.fixture(scope="module")
def answer(sensor):
    return response(sensor, TONES, FORCES, AT)


def at_point(f, force, x_mm):
    """The plate of the reference design, pressed with the whole tip on it, straight from the line."""
    press = {"frequency_hz": f, "force_n": force, "left_m": x_mm / 1e3 - 0.005}
    return complex(line.impedance(line.PressedLine(**PLATE | press)))


def test_values_are_those_of_the_line(answer):
    for k, f in enumerate(TONES):
        for j, force in enumerate(FORCES):
            for i in (1, 2, 3):
                z = at_point(f, force, AT[i])
                assert answer.values("resistance")[k, j, i] == pytest.approx(z.real, rel=1e-12)
                assert answer.values("reactance")[k, j, i] == pytest.approx(z.imag, rel=1e-12)


def test_slopes_are_differences_of_the_line_per_newton_and_per_millimetre(answer):
    def slope(f, force, x, by_force, by_position):
        ahead, behind = (at_point(f, force + s * by_force, x + s * by_position) for s in (1, -1))
        return (ahead - behind) / 2 / (by_force + by_position)

    k, j, i = 1, 2, 2
    by_force, by_position = slope(TONES[k], FORCES[j], AT[i], 1e-2, 0), slope(TONES[k], FORCES[j], AT[i], 0, 1e-2)
    for name, expected in (
        ("resistance-by-force", by_force.real),
        ("reactance-by-force", by_force.imag),
        ("resistance-by-position", by_position.real),
        ("reactance-by-position", by_position.imag),
    ):
        assert answer.values(name)[k, j, i] == pytest.approx(expected, rel=1e-5, abs=0), name


def test_where_the_whole_tip_rests_on_the_sensor(sensor):
    """Where it just reaches the end, the slope by position is that of neither side."""
    assert response(sensor, TONES, FORCES, (0, 5, 5.1, 50, 94.9, 95, 100)).on_sensor().tolist() == [
        False, False, True, True, True, False, False,
    ]  # fmt: skip
    assert response(sensor, TONES, FORCES, (0, 4)).on_sensor().all()


def test_a_map_that_folds_and_one_that_does_not(answer):
    """The determinant of (F, x) -> (R, X) by hand: R falls and rises again with position while X rises with force."""
    assert not answer.folds().any()
    x = np.linspace(-1, 1, 21)
    z = np.broadcast_to(x**2 + 0j, (1, 2, 21))
    slopes = Response(z, np.full((1, 2, 21), 1j), np.broadcast_to(2 * x + 0j, (1, 2, 21)))
    bent = type(answer)(np.array([1.0]), np.array([1.0, 2.0]), x, slopes, answer.sensor)
    shifted = replace(bent, response=slopes._replace(by_position_ohm_per_m=slopes.by_position_ohm_per_m + 0.05))
    assert not shifted.folds()[:, :, :9].any()
    assert shifted.folds()[0, :, 9].all()
    assert shifted.folds().sum() == 2


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ((TONES, (3.0,), AT), "1 force.s. and 5 position.s. make no map; expected two or more of each"),
        ((TONES, FORCES, (3.0,)), "4 force.s. and 1 position.s. make no map"),
        ((range(1, MOST_FREQUENCIES + 2), FORCES, AT), "frequencies, 4 forces and 5 positions are too much"),
        (((1e3,), range(1000), np.linspace(0, 100, LARGEST // 1000 + 1)), f"expected up to {MOST_FREQUENCIES} freq"),
        ((TONES, FORCES, (0.0, 100.5)), "position 100.5 mm is outside the sensor"),
        ((TONES, (0.0, 500.0), AT), "the stress thins the film by 1.67: at 1 its electrodes touch"),
    ],
)
def test_what_makes_no_picture(sensor, axes, said):
    with pytest.raises(OutOfRange, match=said):
        response(sensor, *axes)


def test_scale_and_frequency():
    expected = {999.0: (1.0, "Ω"), 1000.0: (1e3, "kΩ"), 0.5: (1e-3, "mΩ"), 0.0: (1.0, "Ω"), 1e-30: (1e-15, "fΩ")}
    assert {largest: scale(np.array([0.0, -largest]), "Ω") for largest in expected} == expected
    assert [frequency(f) for f in (0.5, 99.7e3)] == ["500 mHz", "99.7 kHz"]


def size_of(png):
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    return struct.unpack(">II", png[16:24])


@pytest.mark.parametrize("again", [3, pytest.param(None, marks=pytest.mark.nightly)])
def test_all_files_and_the_same_bytes_every_time(sensor, again):
    first, second = (dict(islice(plots.files(sensor, TONES[:1], FORCES, AT), most)) for most in (None, again))
    assert tuple(first) == plots.STEPS
    assert len(plots.STEPS) == 10
    for name, content in first.items():
        assert content == second.get(name, content), name
        if name.endswith(".png"):
            assert b"Software" not in content
            assert b"tIME" not in content
    figure = shown(quantity(response(sensor, TONES[:1], FORCES, AT), "resistance"))
    assert size_of(first["resistance.png"])[0] == round(figure.get_figwidth() * figure.dpi)


def shown(figure):
    """All panels of a figure as matplotlib has them."""
    return static.drawn(figure, [p for panels in figure.choices.values() for p in panels], figure.title)


@pytest.mark.parametrize("name", ["resistance", "reactance-by-position", "reactance-by-force"])
def test_maps_show_the_response_with_units(answer, name):
    figure = shown(quantity(answer, name))
    assert figure.get_suptitle() == QUANTITIES[name].title
    divisors = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
    assert len(figure.axes) == 4  # two tones, two scales
    for k, panel in enumerate(figure.axes[:2]):
        symbol, unit = re.fullmatch(r"(\S+) \[(\S+)\] at .*kHz", panel.get_title()).groups()
        assert symbol == QUANTITIES[name].symbol
        assert unit.endswith(QUANTITIES[name].unit)
        drawn = panel.collections[0].get_array() * divisors[unit.removesuffix(QUANTITIES[name].unit)]
        assert np.allclose(drawn, answer.values(name)[k], rtol=1e-12, atol=0)
        assert 1 <= np.abs(panel.collections[0].get_array()[:, answer.on_sensor()]).max() < 1000
        assert panel.get_xlabel() == "position [mm]"
        assert panel.get_ylabel() == ("force [N]" if k == 0 else "")
        low, high = panel.collections[0].get_clim()
        signed = panel.collections[0].get_cmap().name == "PuOr"
        assert (low == -high) is signed


@pytest.mark.parametrize(("of", "values"), [("position", AT), ("force", FORCES)])
def test_inverse_maps_lie_over_r_and_x(answer, of, values):
    figure = shown(inverse(answer, of))
    panel = figure.axes[1]
    mesh = panel.collections[0]
    assert (mesh.get_clim()) == (min(values), max(values))
    corners = mesh.get_coordinates()
    assert np.allclose(corners[..., 0], answer.values("resistance")[1] / 1e3, rtol=1e-12, atol=0)
    assert np.allclose(corners[..., 1], answer.values("reactance")[1] / 1e3, rtol=1e-12, atol=0)
    assert (panel.get_xlabel(), figure.axes[0].get_ylabel()) == ("R [kΩ]", "X [kΩ]")
    assert "solid lines: 0, 2, 4, 6 N; dashed: 0, 20, 40, 60, 100 mm" in figure.get_suptitle()
    by_force, by_position = panel.lines[1], panel.lines[len(FORCES) + 1]
    assert np.allclose(by_force.get_xdata(), answer.values("resistance")[1, 1] / 1e3, rtol=1e-12, atol=0)
    assert np.allclose(by_position.get_ydata(), answer.values("reactance")[1, :, 1] / 1e3, rtol=1e-12, atol=0)


def test_a_sensor_that_a_press_does_not_move_is_drawn_too():
    """Bare conductors: R is 0 throughout, and no colour scale or contour may trip over it."""
    flat = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.0, 0.0), 7e-10, unconfined(6e6))
    of = response(flat, (1e3,), (0.0, 1.0), (20.0, 80.0))
    assert static.png(identifiability_figure(flat, (1e3,), force_n=1.0))
    for figure in figures(of):
        assert figure.key not in ("resistance", "inverse-force") or static.png(figure)
        assert shown(figure).axes
    assert written(of)


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setattr(figure_data.importlib.util, "find_spec", lambda name: None if name == "plotly" else name)
    with pytest.raises(MissingValue, match=r"plots need plotly: pip install plotly"):
        figure_data.needed("matplotlib", "plotly")


def written(answer):
    return pages.page("A <b>sensor</b> & more", ["some words"], [pages.PageSection(figures=tuple(figures(answer)))])


def test_the_page_holds_the_response_and_its_script_once(answer):
    text = written(answer)
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=\"(?!data:)", text)
    packed = {name: re.search(f'id="{name}">(.*?)</script>', text)[1] for name in ("plotly", "content")}
    script, content = (gzip.decompress(base64.b64decode(block)).decode() for block in packed.values())
    assert len(re.findall(r"plotly\.js v[0-9.]+", script)) == 1
    assert len(text) < 3_000_000
    assert "<h1>A &lt;b&gt;sensor&lt;/b&gt; &amp; more</h1>" in text
    held = {f["key"]: [choice["name"] for choice in f["choices"]] for f in json.loads(content)["figures"]}
    assert held == {key: ["10.1 kHz", "99.7 kHz"] for key in (*QUANTITIES, "inverse-position", "inverse-force")}


def test_the_page_in_a_browser(answer, tmp_path, browser):
    """All figures are drawn, a frequency chosen at one holds for all, nothing is complained of or fetched."""

    def shown(k):
        return np.array(browser.run(f"Array.from({plots}[{k}]._fullData[0].z, row => Array.from(row))"))

    (tmp_path / "page.html").write_text(written(answer), "utf-8")
    plots, marks = "[...document.querySelectorAll('.plot')]", ".heatmaplayer image, path.point"
    drawn = f"{plots}.filter(p => p.querySelector('{marks}')).length"
    browser.open(tmp_path / "page.html", ready=f"{plots}.length === 8 && {drawn} === 8")
    titles = f"{plots}.map(p => (p._fullData[0].colorbar ?? p._fullData[0].marker.colorbar).title.text)"
    assert browser.run(titles)[:2] == ["R [kΩ]", "X [kΩ]"]
    labels = "Array.from(document.querySelector('select').options, e => e.textContent)"
    assert browser.run(labels) == ["10.1 kHz", "99.7 kHz"]
    assert shown(0) * 1e3 == pytest.approx(answer.values("resistance")[0], rel=1e-6)
    second = f"JSON.stringify(Array.from({plots}[1]._fullData[0].z, row => Array.from(row)))"
    browser.run(f"window.before = {second}")
    browser.run("const s = document.querySelector('select'); s.selectedIndex = 1; s.dispatchEvent(new Event('change'))")
    browser.until(f"{second} !== window.before")
    assert browser.run("[...document.querySelectorAll('select')].map(s => s.selectedIndex)") == [1] * 8
    assert shown(1) * 1e3 == pytest.approx(answer.values("reactance")[1], rel=1e-6)
    assert (browser.complaints(), browser.asked()) == ([], [])


@pytest.mark.parametrize(
    ("values", "ends", "span"),
    [
        ((-1.0, 3.0), (), (-3.0, 3.0)),
        ((-5.0, 2.0, np.nan), (), (-5.0, 5.0)),
        ((1.0, 3.0), (), (1.0, 3.0)),
        ((-3.0, -1.0), (), (-3.0, -1.0)),
        ((-1.0, 3.0), (-2.0, 1.0), (-2.0, 2.0)),
        ((np.nan,), (), (0.0, 1.0)),
    ],
)
def test_a_colour_scale_of_both_signs_is_even_about_0_and_holds_all_values(values, ends, span):
    found = Map(np.arange(len(values)), np.arange(1), np.array([values]), "", *ends)
    assert (found.span, found.signed) == (span, span[0] < 0 < span[1])
