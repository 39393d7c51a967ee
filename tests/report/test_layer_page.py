"""The print layer by layer, as a page in a real browser."""

import re

import numpy as np
import pytest
import shapely

from sensorgen.analysis.plots import layers, pages
from sensorgen.asprinted.printed import body
from sensorgen.core.findings import Finding
from sensorgen.design.design import make
from sensorgen.export.gcode.crossings import Stretches
from sensorgen.scene.layers import LayerRegions

SHOWN = "[...document.querySelectorAll('#plan g')].map(g => g.getAttribute('class'))"
AT = "document.getElementById('layer-at').textContent"
WAYS = "[...document.querySelectorAll('#plan .way')]"


def turn_to(browser, layer):
    choose = f"s.value = {layer}; s.dispatchEvent(new Event('input'));"
    browser.run(f"(() => {{ const s = document.getElementById('layer'); {choose} }})()")


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
    regions = [LayerRegions(0.1 * k, 0.1 * (k + 1), {"one": shapely.box(0, 0, 10, 5)}) for k in range(4)]
    finding = Finding("7-printed", "error", "one", "<s>", "<u>", layer=3, place_mm=(3.0, 1.0, 0.25))
    found = layers.placed([finding, Finding("5-width", "info", "one", "thin", "widen it")], regions)
    shown = [layers.BodyShown("<i>one</i>", "<em>m</em>", 1, "#336699", "#336699")]
    text = layers.page("<b>x</b>", (), shown, layers.stack(regions, ["one"], (10.0, 5.0), found), found)
    (tmp_path / "page.html").write_text(text, "utf-8")
    browser.size(1200)
    browser.open(tmp_path / "page.html")
    assert browser.run(SHOWN) == ["below", "now"]
    assert browser.run(AT) == "3 of 4: 0.2 to 0.3 mm"
    assert browser.run("document.querySelectorAll('header b, main em, main s, main u, span i').length") == 0
    assert browser.run("document.querySelector('#plan .mark').getAttribute('cy')") == "4"
    turn_to(browser, 0)
    assert browser.run("document.querySelectorAll('#plan .mark').length") == 0
    assert browser.run("document.querySelectorAll('[data-finding]').length") == 1
    browser.run("document.querySelector('[data-finding]').click()")
    assert browser.run(AT) == "3 of 4: 0.2 to 0.3 mm"
    assert browser.run("document.querySelectorAll('#plan .mark.now, .listed .now').length") == 2


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
    assert browser.run(SHOWN) == ["now"]
    browser.run("document.querySelectorAll('.travel').forEach(box => { if (!box.checked) box.click(); })")
    lengths = []
    for layer in range(len(printed.first)):
        turn_to(browser, layer)
        lengths.append(browser.run(f"{WAYS}.map(way => way.getTotalLength())"))
    assert [len(each) for each in lengths] == [1, 0, 0, 0, 0, 1, *[0] * (len(lengths) - 6)]
    assert (lengths[0], lengths[5]) == ([2.0], [pytest.approx(0.75, abs=1e-4)])
    words = browser.run("[...document.querySelectorAll('.travel')].map(b => b.parentNode.textContent.trim())")
    assert words[0].endswith("in contact with another tool's material, as sliced: 0.5 mm by tool 3, 0.2 mm by tool 4")
    assert words[3].endswith("as written: 0.0 mm")
    turn_to(browser, 5)
    assert browser.run(AT) == "6 of 13: 0.5 to 0.6 mm"
    corner = browser.run(f"{WAYS}[0].getAttribute('d')")
    width, depth = printed.design.printed.size_mm[:2]
    assert corner.startswith(f"M{width / 2 - 3:g} {depth / 2 - 1:g}L")
    browser.run("document.querySelector('.travel').click()")
    assert browser.run(f"{WAYS}.length") == 0
    assert browser.run("document.querySelector('.travel[value=\"2\"]').disabled") is True
    turn_to(browser, 0)  # of the lower electrode
    browser.run("document.querySelector('.body').click()")
    assert browser.run("document.querySelectorAll('#plan .now path:not(.way)').length") == 0
    assert (browser.complaints(), browser.asked()) == ([], [])
