"""Pictures: what they are drawn from, the same bytes every time, and the page in a real browser."""

import base64
import html as entities
import json
import os
import re
import struct
import subprocess

import numpy as np
import pytest
from drawn_sensor import sensor_of

from sensorgen.analysis import plots
from sensorgen.analysis.plots import inverse, libraries, maps, page, panels
from sensorgen.analysis.plots.field import LARGEST, MOST_TONES, QUANTITIES, field, scale, tone
from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.design.design import make
from sensorgen.models import line
from sensorgen.models.compression import unconfined
from sensorgen.models.sensor import Sensor

PLATE = {
    "length_m": 0.1,
    "width_m": 0.01,
    "top_thickness_m": 3e-4,
    "bottom_thickness_m": 3e-4,
    "top_resistivity_ohm_m": 0.07,
    "bottom_resistivity_ohm_m": 0.2,
    "film_m": 6e-4,
    "eps_r": 4.68,
    "modulus_pa": 6e6,
    "tip_m": 0.01,
}
TONES, FORCES, AT = (10.1e3, 99.7e3), (0.0, 2.0, 4.0, 6.0), (0.0, 20.0, 40.0, 60.0, 100.0)


@pytest.fixture(scope="module")
def sensor():
    return sensor_of(make({"shape": "reference"})).sensor


@pytest.fixture(scope="module")
def answer(sensor):
    return field(sensor, TONES, FORCES, AT)


def at_point(f, force, x_mm):
    """The plate of the reference design, pressed with the whole tip on it, straight from the line."""
    return complex(line.impedance(line.PressedLine(**PLATE, frequency_hz=f, force_n=force, left_m=x_mm / 1e3 - 0.005)))


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
    assert field(sensor, TONES, FORCES, (0, 5, 5.1, 50, 94.9, 95, 100)).on_sensor().tolist() == [
        False, False, True, True, True, False, False,
    ]  # fmt: skip
    assert field(sensor, TONES, FORCES, (0, 4)).on_sensor().all()


def test_a_map_that_folds_and_one_that_does_not(answer):
    """The determinant of (F, x) -> (R, X) by hand: R falls and rises again with position while X rises with force."""
    assert not answer.folds().any()
    x = np.linspace(-1, 1, 21)
    z = np.broadcast_to(x**2 + 0j, (1, 2, 21))
    bent = type(answer)(
        np.array([1.0]), np.array([1.0, 2.0]), x, z, np.full((1, 2, 21), 1j), np.broadcast_to(2 * x + 0j, (1, 2, 21)),
        10.0, 100.0,
    )  # fmt: skip
    shifted = type(answer)(**{**vars(bent), "by_position_ohm_per_mm": bent.by_position_ohm_per_mm + 0.05})
    assert not shifted.folds()[:, :, :9].any()
    assert shifted.folds()[0, :, 9].all()
    assert shifted.folds().sum() == 2


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ((TONES, (3.0,), AT), "1 force.s. and 5 position.s. make no map; expected two or more of each"),
        ((TONES, FORCES, (3.0,)), "4 force.s. and 1 position.s. make no map"),
        ((range(1, MOST_TONES + 2), FORCES, AT), f"{MOST_TONES + 1} tones, 4 forces and 5 positions are too much"),
        (((1e3,), range(1000), np.linspace(0, 100, LARGEST // 1000 + 1)), f"expected up to {MOST_TONES} tones"),
        ((TONES, FORCES, (0.0, 100.5)), "position 100.5 mm is outside the sensor"),
        ((TONES, (0.0, 500.0), AT), "the stress thins the film by 1.67: at 1 its electrodes touch"),
    ],
)
def test_what_makes_no_picture(sensor, axes, said):
    with pytest.raises(OutOfRange, match=said):
        field(sensor, *axes)


@pytest.mark.parametrize(
    ("largest", "divisor", "unit"),
    [(999.0, 1.0, "Ω"), (1000.0, 1e3, "kΩ"), (2e6, 1e6, "MΩ"), (0.5, 1e-3, "mΩ"), (0.0, 1.0, "Ω"), (1e-30, 1e-9, "nΩ")],
)
def test_scale(largest, divisor, unit):
    assert scale(np.array([0.0, -largest]), "Ω") == (divisor, unit)


def test_tone():
    assert [tone(f) for f in (0.5, 1e3, 99.7e3, 2.5e6)] == ["500 mHz", "1 kHz", "99.7 kHz", "2.5 MHz"]


def size_of(png):
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    return struct.unpack(">II", png[16:24])


def test_all_files_and_the_same_bytes_every_time(sensor):
    first, second = (dict(plots.files(sensor, TONES[:1], FORCES, AT)) for _ in range(2))
    assert tuple(first) == plots.STEPS
    assert len(plots.STEPS) == 10
    for name, content in first.items():
        assert content == second[name], name
        if name.endswith(".png"):
            assert b"Software" not in content
            assert b"tIME" not in content


def test_seven_tones_fit_in_1200_pixels(sensor):
    seven = field(sensor, [k * 1e4 for k in range(1, 8)], FORCES, AT)
    assert size_of(maps.png(seven, "resistance"))[0] == size_of(inverse.png(seven, "force"))[0] == 1200


def shown(monkeypatch, draw):
    """The figure that a picture is of."""
    figures = []
    monkeypatch.setattr(panels, "png", lambda figure: figures.append(figure) or b"")
    draw()
    return figures[0]


@pytest.mark.parametrize("name", QUANTITIES)
def test_maps_show_the_field_with_units(monkeypatch, answer, name):
    figure = shown(monkeypatch, lambda: maps.png(answer, name))
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
        assert panel.get_xlabel() == "position x [mm]"
        assert panel.get_ylabel() == ("force F [N]" if k == 0 else "")
        low, high = panel.collections[0].get_clim()
        signed = panel.collections[0].get_cmap().name == "PuOr"
        assert (low == -high) is signed


@pytest.mark.parametrize(("of", "values"), [("position", AT), ("force", FORCES)])
def test_inverse_maps_lie_over_r_and_x(monkeypatch, answer, of, values):
    figure = shown(monkeypatch, lambda: inverse.png(answer, of))
    panel = figure.axes[1]
    mesh = panel.collections[0]
    assert (mesh.get_clim()) == (min(values), max(values))
    corners = mesh.get_coordinates()
    assert np.allclose(corners[..., 0], answer.values("resistance")[1] / 1e3, rtol=1e-12, atol=0)
    assert np.allclose(corners[..., 1], answer.values("reactance")[1] / 1e3, rtol=1e-12, atol=0)
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("R [kΩ]", "X [kΩ]")
    assert "solid lines: 0, 2, 4, 6 N; dashed: 0, 20, 40, 60, 100 mm" in figure.get_suptitle()
    by_force, by_position = panel.lines[1], panel.lines[len(FORCES) + 1]
    assert np.allclose(by_force.get_xdata(), answer.values("resistance")[1, 1] / 1e3, rtol=1e-12, atol=0)
    assert np.allclose(by_position.get_ydata(), answer.values("reactance")[1, :, 1] / 1e3, rtol=1e-12, atol=0)


def test_a_sensor_that_a_press_does_not_move_is_drawn_too():
    """Bare conductors: R is 0 throughout, and no colour scale or contour may trip over it."""
    flat = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.0, 0.0), 7e-10, unconfined(6e6))
    for _, content in plots.files(flat, (1e3,), (0.0, 1.0), (20.0, 80.0)):
        assert content


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setattr(libraries.importlib.util, "find_spec", lambda name: None if name == "plotly" else name)
    with pytest.raises(MissingValue, match=r"plots need plotly: pip install plotly"):
        libraries.needed("matplotlib", "plotly")


def decoded(values):
    """Numbers of the page: a list, or Plotly's typed array."""
    if isinstance(values, list):
        return np.array(values, float)
    found = np.frombuffer(base64.b64decode(values["bdata"]), values["dtype"])
    return found.reshape([int(n) for n in str(values.get("shape", found.size)).split(",")])


def test_the_page_holds_the_field_and_its_script_once(answer):
    text = page.html(answer)
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", text)
    assert len(re.findall(r"plotly\.js v[0-9.]+", text)) == 1
    start = text.index("[", text.index("Plotly.newPlot(", text.rindex("<script")))
    traces = json.JSONDecoder().raw_decode(text, start)[0]
    assert len(traces) == 8 * len(TONES)
    assert [t["visible"] for t in traces] == [True] * 8 + [False] * 8
    names = ["resistance", "resistance-by-force", "resistance-by-position"]
    names += [name.replace("resistance", "reactance") for name in names]
    for k in range(len(TONES)):
        for name, trace in zip(names, traces[8 * k :], strict=False):
            expected = answer.values(name)[k].copy()
            if name.endswith("position"):
                expected[:, [0, -1]] = np.nan
            assert np.array_equal(decoded(trace["z"]), expected, equal_nan=True), name
            assert QUANTITIES[name].unit in trace["hovertemplate"]
            assert decoded(trace["x"]).tolist() == list(AT)
            assert decoded(trace["y"]).tolist() == list(FORCES)
        for trace in traces[8 * k + 6 : 8 * k + 8]:
            assert np.array_equal(decoded(trace["x"]), answer.values("resistance")[k].ravel())
            assert np.array_equal(decoded(trace["y"]), answer.values("reactance")[k].ravel())
            assert decoded(trace["customdata"])[5].tolist() == [2.0, 0.0]


PROBE = """<head><script>
const said = [];
console.error = (...words) => said.push(words.join(" "));
addEventListener("error", e => said.push(String(e.message || e.target.src)), true);
addEventListener("securitypolicyviolation", e => said.push(e.blockedURI));
addEventListener("load", () => setTimeout(async () => {
  const page = document.getElementById("predict");
  const seen = () => page._fullData.map(t => t.visible === true);
  const report = {
    said, first: seen(), z: Array.from(page._fullData[0].z, row => Array.from(row)),
    scenes: page.querySelectorAll(".gl-container canvas").length,
    plots: page.querySelectorAll(".subplot.xy, .subplot.x2y2").length,
    resources: performance.getEntriesByType("resource").map(e => e.name),
    labels: Array.from(page.querySelectorAll(".slider-label"), e => e.textContent),
  };
  await Plotly.restyle(page, ...page.layout.sliders[0].steps[1].args);
  report.second = seen();
  const pre = document.createElement("pre");
  pre.id = "probe";
  pre.textContent = JSON.stringify(report);
  document.body.replaceChildren(pre);
}, 500));
</script>"""


@pytest.fixture
def chromium(program):
    return program("chromium", "chromium", "chromium-browser", "google-chrome")


def test_the_page_in_a_browser(chromium, answer, tmp_path):
    """Surfaces and planes are there, the slider changes the tone, nothing is complained of or fetched."""
    (tmp_path / "page.html").write_text(page.html(answer).replace("<head>", PROBE, 1), "utf-8")
    done = subprocess.run(
        [
            chromium, "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--virtual-time-budget=20000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom",
            (tmp_path / "page.html").as_uri(),
        ],
        capture_output=True, text=True, timeout=300, env={**os.environ, "HOME": str(tmp_path)},
    )  # fmt: skip
    found = re.search('<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found, done.stderr[-2000:]
    report = json.loads(entities.unescape(found[1]))
    assert report["said"] == []
    assert report["resources"] == []
    assert report["scenes"] >= 6
    assert report["plots"] == 2
    assert report["labels"] == ["tone: 10.1 kHz", "10.1 kHz", "99.7 kHz"]
    assert report["first"] == [True] * 8 + [False] * 8
    assert report["second"] == [False] * 8 + [True] * 8
    assert np.array_equal(report["z"], answer.values("resistance")[0])
