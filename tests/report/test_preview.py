"""The page of a design in a real browser: content, keys, themes, widths, a section plane, and without WebGL."""

import json
import re

import numpy as np
import pytest

from sensorgen.analysis import preview
from sensorgen.analysis.plots import layers, pages
from sensorgen.design.design import make
from sensorgen.scene.geometry.meshes import mesh
from sensorgen.workflows.decision import page_of

HOSTILE = "</script><img src=x onerror=alert(1)> & 'quoted'"
TRI = {"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 12.0}}
PIXELS = """(() => { const c = document.getElementById('model'), gl = c.getContext('webgl2');
  const p = new Uint8Array(4 * c.width * c.height);
  gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
  const seen = new Map(); for (let k = 0; k < p.length; k += 4) { const n = p[k] << 16 | p[k + 1] << 8 | p[k + 2];
  seen.set(n, (seen.get(n) || 0) + 1); } return [...seen].sort((a, b) => b[1] - a[1]).slice(0, 12); })()"""
FRAME = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("preview")
    waiver = {"rule": "5-width", "reason": HOSTILE}
    (folder / "tri.html").write_text(page_of(make({**TRI, "waivers": [waiver]})), "utf-8")
    return folder / "tri.html"


def choose(browser, name, value):
    browser.run(f"(() => {{ const e = document.getElementById('{name}'); e.value = '{value}';"
                "e.dispatchEvent(new Event('input')); })()")  # fmt: skip
    browser.run(FRAME)


def covered(browser):
    """Pixels that are not ground, which is the colour of the corner."""
    browser.run(FRAME)
    seen = dict(map(tuple, browser.run(PIXELS)))
    band = browser.run("getComputedStyle(document.documentElement).getPropertyValue('--band').trim().slice(1)")
    ground = int(band, 16)
    return sum(count for colour, count in seen.items() if colour != ground), len(seen)


def test_fits_every_width_in_both_themes(browser, made):
    for width in (360, 1920):
        for scheme in ("light", "dark"):
            browser.size(width)
            browser.media(scheme)
            browser.open(made)
            assert browser.run("document.documentElement.scrollWidth") == width
            area, distinct = covered(browser)
            assert area > 2000
            assert distinct >= 4  # two materials, lit and cut
    assert browser.complaints() == []
    assert browser.asked() == []
    assert made.stat().st_size < 3_000_000


def test_heights_of_a_section_can_be_read(browser, tmp_path):
    """Of a thick sensor, whose sections are longer, they were 2 to 3 px high."""
    page = tmp_path / "thick.html"
    page.write_text(page_of(make({"shape": "reference", "parameters": {"dielectric_mm": 3.0}})), "utf-8")
    for width in (360, 1280):
        browser.size(width)
        browser.open(page)
        heights = browser.run(
            "[...document.querySelectorAll('.section text')].map(t => t.getBoundingClientRect().height)"
        )
        assert len(heights) > 4
        assert min(heights) >= 9
        assert max(heights) < 24


def test_electrodes_are_seen_on_a_dark_ground(browser, made):
    browser.media("light")
    browser.open(made)
    colour = "getComputedStyle(document.documentElement).getPropertyValue('{}').trim()"
    assert browser.run(colour.format("--c0")) == "#303436"
    browser.run("document.getElementById('theme').click(); document.getElementById('theme').click()")
    assert browser.run("document.documentElement.dataset.theme") == "dark"
    shown, ground = (browser.run(colour.format(name)) for name in ("--c0", "--ground"))
    rgb = [[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in (shown, ground)]
    assert layers.contrast(*rgb) > 3


def test_the_section_plane_removes_what_is_before_it(browser, made):
    browser.open(made)
    browser.run("document.querySelector('[data-view=top]').click()")
    choose(browser, "axis", "")
    whole, _ = covered(browser)
    choose(browser, "axis", "0")
    choose(browser, "cut", 500)
    half, _ = covered(browser)
    assert half == pytest.approx(whole / 2, rel=0.05)
    assert browser.run("document.getElementById('cut').getAttribute('aria-valuetext')") == "x = 6.00 mm"


def test_keys_choose_layers_and_turn_the_model(browser, made):
    browser.open(made)
    shapes = "[...document.querySelectorAll('#plan .now path')].map(p => p.getAttribute('d')).join()"
    browser.run("document.getElementById('layer').focus()")
    browser.key("Home", 36)
    first, said = browser.run(shapes), browser.run("document.getElementById('layer-at').textContent")
    assert said == "1 of 13: 0 to 0.1 mm"
    for _ in range(5):
        browser.key("ArrowRight", 39)
    assert browser.run("document.getElementById('layer-at').textContent") == "6 of 13: 0.5 to 0.6 mm"
    assert browser.run(shapes) != first
    browser.run("document.getElementById('model').focus()")
    assert browser.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    before = browser.run(PIXELS)
    browser.key("ArrowLeft", 37)
    browser.run(FRAME)
    assert browser.run(PIXELS) != before
    assert browser.complaints() == []


def test_everything_that_can_be_used_has_a_name_and_text_of_strangers_stays_text(browser, made):
    browser.open(made)
    nameless = browser.run("""[...document.querySelectorAll('button, input, select, canvas, svg[role]')].filter(e =>
      !(e.textContent.trim() || e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.closest('label'))
      || e.tabIndex < 0 && !e.matches('svg[role=img]')).map(e => e.outerHTML.slice(0, 90))""")
    assert nameless == []
    assert browser.run("document.querySelectorAll('img[src=x]').length") == 0
    assert HOSTILE in browser.run("document.getElementById('main').textContent")
    browser.media("dark", "print")
    assert browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.run("getComputedStyle(document.querySelector('.tools')).display") == "none"


def test_a_finding_is_shown_in_model_drawing_and_layers(browser, made):
    browser.open(made)
    button = "document.querySelector('[data-finding][data-to=sheet]')"
    browser.run(f"{button}.click()")
    browser.run(FRAME)
    number = browser.run(f"{button}.closest('li').querySelector('strong').textContent").split()[-1]
    chosen = "[...document.getElementById('sheet').shadowRoot.querySelectorAll('.now')].map(m => m.dataset.number)"
    assert set(browser.run(chosen)) == {number}
    assert browser.run("document.getElementById('sheet').parentNode.open") is True
    assert browser.run("document.querySelectorAll('#plan .mark.now').length") == 1
    spot, model = (
        browser.run(f"(b => [b.x + b.width / 2, b.y + b.height / 2, b.width, b.height])"
                    f"(document.getElementById('{name}').getBoundingClientRect())") for name in ("spot", "model")
    )  # fmt: skip
    assert spot[:2] == pytest.approx(model[:2], abs=2)  # the place is in the middle of the view
    cut = browser.run("document.getElementById('cut').getAttribute('aria-valuetext')")
    words = browser.run(f"{button}.closest('li').textContent")
    cut_mm, y_mm = (float(re.search(r"\by (?:= )?([\d.]+)", text)[1]) for text in (cut, words))
    assert cut_mm == pytest.approx(y_mm, abs=0.02)
    assert browser.complaints() == []


def test_without_webgl_there_is_a_plain_picture(browser, made):
    no_webgl = """const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind === 'webgl2' ? null : get.call(this, kind, ...more); };"""
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=no_webgl)
    browser.open(made)
    browser.run(FRAME)
    colours_ = browser.run("""(() => { const c = document.getElementById('model'), p = c.getContext('2d').getImageData(
      0, 0, c.width, c.height).data, seen = new Set(); for (let k = 0; k < p.length; k += 4)
      seen.add(p[k] << 16 | p[k + 1] << 8 | p[k + 2]); return seen.size; })()""")
    assert colours_ > 3
    assert "WebGL is not available" in browser.run("document.getElementById('flat').textContent")
    browser.run("document.querySelector('[data-finding]').click()")
    assert browser.complaints() == []


def test_the_packed_shells_are_the_meshes():
    """Unpacked by the format's description: every vertex to a micrometre, every triangle, volumes to the rounding."""
    scene = make(TRI).printed
    names = [body.name for body in scene.bodies]
    block = preview.block({}, {"drawn": scene}, names)
    size = int.from_bytes(block[:4], "little")
    counts = json.loads(block[4 : 4 + size])["counts"]["drawn"]
    rest = np.frombuffer(block[4 + size :], "<i4")
    for body, (vertices, triangles, edges) in zip(scene.bodies, counts, strict=True):
        parts = np.split(rest[: 3 * vertices + 3 * triangles + 2 * edges], [3 * vertices, 3 * (vertices + triangles)])
        rest = rest[sum(map(len, parts)) :]
        expected = mesh(body)
        places = np.cumsum(parts[0].reshape(-1, 3), axis=0) / 1e3
        assert np.abs(places - expected.vertices_mm).max() < 6e-4
        corners = np.cumsum(parts[1]).reshape(-1, 3)
        assert (corners == expected.triangles).all()
        a, b, c = (places[corners[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(body.volume_mm3(), rel=1e-3)
    assert len(rest) == 0


def test_edges_of_a_box_are_twelve():
    scene = make({"shape": "reference"}).printed
    ends = mesh(scene.bodies[0]).sharp_edges()
    assert len({tuple(pair) for pair in ends.tolist()}) == len(ends) == 12


def test_sections_have_the_area_of_the_drawing():
    """Of the plate, which is a stack of rectangles: widths times thicknesses."""
    design = make({"shape": "reference"})
    (figure,) = preview.figures(design.printed, design.printed, ["bottom_electrode", "dielectric", "top_electrode"], [])
    end = float(re.search(r"to ([\d.]+) of", figure.caption)[1])
    areas = []
    for _, d in figure.drawn:
        xy = np.array([list(map(float, p.split())) for p in d.strip("MZ").split("L")])
        areas.append(_area(xy))
    assert areas == pytest.approx([0.3 * end, 0.6 * end, 0.3 * end])


def _area(xy):
    x, y = xy.T
    return abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2


@pytest.mark.parametrize("colour", ["#000000", "#ffffff", "#303436", "#f2c14e"])
@pytest.mark.parametrize("number", [0, 2])
def test_no_body_is_lost_on_its_ground(colour, number):
    for shade, ground in zip(layers.shades(colour, number), (layers.LIGHT, layers.DARK), strict=True):
        rgb = [[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in (shade, ground)]
        assert layers.contrast(*rgb) >= (1.2 if number else 1.49)


def test_a_design_of_thousands_of_boxes_stays_small():
    scene = make({"shape": "rect", "parameters": {"length_mm": 200.0, "width_mm": 60.0}}).printed
    names = [body.name for body in scene.bodies]
    data = pages.packed(preview.block({}, {"drawn": scene, "printed": scene}, names))
    assert sum(len(mesh(b).triangles) for b in scene.bodies) > 90_000
    assert len(data) < 200_000
