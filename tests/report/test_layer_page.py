"""The print layer by layer, as a page in a real browser."""

import re

import numpy as np
import pytest
import shapely

from sensorgen.analysis.plots import layers, pages
from sensorgen.asprinted.printed import body
from sensorgen.design.design import make
from sensorgen.export.gcode.crossings import Stretches
from sensorgen.scene.layers import LayerRegions

SHOWN = "[...document.querySelectorAll('#stack g')].map(g => g.getAttribute('class'))"


def test_a_path_is_the_region():
    """Area by the shoelace rule of what is written, holes taken off, y turned over."""
    region = shapely.box(0, 0, 10, 4).difference(shapely.box(2, 1, 3, 2)).union(shapely.box(12, 0, 13, 4))
    data = pages.path(region, 4.0)
    areas = []
    for ring in re.findall(r"M([^Z]+)Z", data):
        xy = [tuple(map(float, corner.split())) for corner in ring.split("L")]
        turned = zip(xy, xy[1:] + xy[:1], strict=True)
        areas.append(abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in turned)) / 2)
    assert sorted(areas) == [1.0, 4.0, 40.0]
    assert "2 2" in data  # the hole's top edge at y 2 is 2 below the top


def test_marks_open_their_layer_and_names_stay_text(browser, tmp_path):
    stack = [LayerRegions(0.1 * k, 0.1 * (k + 1), {"one": shapely.box(0, 0, 10, 5)}) for k in range(4)]
    text = layers.page("<b>x</b>", stack, {"one": ("<i>one</i>", "#336699")}, marks=[layers.Mark(2, (3.0, 1.0), "<s>")])
    (tmp_path / "page.html").write_text(text, "utf-8")
    browser.size(1200)
    browser.open(tmp_path / "page.html")
    assert browser.run(SHOWN) == ["", "below", "now", ""]
    assert browser.run("document.querySelectorAll('header b, #main i + i, s').length") == 0
    assert browser.run("document.querySelector('#stack .mark').getAttribute('cy')") == "4.0"


def test_travel_is_drawn_at_its_layer_and_toggled(browser, tmp_path):
    printed = body(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 12.0}}))
    place = np.array([[-3.0, 1.0, 0.6], [-2.0, 1.0, 0.6], [2.0, -1.0, 0.1]])  # from the middle of the bed
    step = np.array([[0.5, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 2.0, 0.0]])
    sliced = Stretches(
        place, place + step, np.array([0.5, 0.25, 2.0]), np.array([True, True, False]), np.array([3, 4, 3])
    )
    written = Stretches(*(column[:0] for column in vars(sliced).values()))
    text = layers.of_print(printed, (), {"as sliced": sliced, "as written": written})
    (tmp_path / "page.html").write_text(text, "utf-8")
    browser.open(tmp_path / "page.html")
    ways = "[...document.querySelectorAll('#stack g')].map(g => [...g.querySelectorAll('.way')].map(w => "
    lengths = browser.run(f"{ways}w.getTotalLength()))")
    assert [len(each) for each in lengths] == [1, 0, 0, 0, 0, 1, *[0] * (len(lengths) - 6)]
    assert (lengths[0], lengths[5]) == ([2.0], [pytest.approx(0.75, abs=1e-4)])
    words = browser.run("[...document.querySelectorAll('[value^=t]')].map(b => b.parentNode.textContent.trim())")
    assert words[0].endswith("in contact with another tool's material, as sliced: 0.5 mm by tool 3, 0.2 mm by tool 4")
    assert words[3].endswith("as written: 0.0 mm")
    shown = "document.querySelectorAll('#stack .way')[1].checkVisibility()"
    browser.run("show(5)")
    assert browser.run(shown) is False
    browser.run("document.querySelector('[value=t0]').click()")
    assert browser.run(shown) is True
    assert browser.run("document.querySelector('[value=t2]').disabled") is True
    corner = browser.run("document.querySelectorAll('#stack .way')[1].getAttribute('d')")
    width, depth = printed.design.printed.size_mm[:2]
    assert corner.startswith(f"M{width / 2 - 3:g} {depth / 2 - 1:g}L")


def test_a_print_layer_by_layer(browser, tmp_path):
    printed = body(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 12.0}}))
    (tmp_path / "page.html").write_text(layers.of_print(printed), "utf-8")
    browser.size(1200)
    browser.open(tmp_path / "page.html")
    assert browser.run(SHOWN) == ["now", *[""] * (len(printed.first) - 1)]
    browser.run(
        "(() => { const s = document.getElementById('layer'); s.value = 5; s.dispatchEvent(new Event('input')); })()"
    )
    assert browser.run(SHOWN)[4:6] == ["below", "now"]
    assert browser.run("document.getElementById('said').textContent").startswith("layer 6 of 13, 0.5 to 0.6 mm")
    assert browser.complaints() == []
    assert browser.asked() == []
