"""The drawing shows the scene that it was given, says where the findings are, and stays on its page."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations, pairwise, product
from math import cos, pi, sin

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensorgen.core import lazy as registry
from sensorgen.core.findings import Finding
from sensorgen.design import shapes
from sensorgen.design.design import make
from sensorgen.scene import drawing
from sensorgen.scene.drawing import svg
from sensorgen.scene.drawing.panels import beside
from sensorgen.scene.drawing.paper import ViewFrame, width
from sensorgen.scene.drawing.view import Measure, nearest, period, views
from sensorgen.scene.layers import faces_mm
from sensorgen.scene.polyhedra import Polyhedron
from sensorgen.scene.scene import Body, Fill, Point, Scene, area_mm2, box
from sensorgen.scene.sections import Section, SectionColumn, columns

SHAPES = registry.names(shapes)
NIGHTLY = pytest.mark.nightly
MANY = ("bump", "cone", "pyramid")  # bodies, which take long
COLOURS = {"etpu": ("PI-eTPU 85-700+", "#303436"), "x60": ("Flexion X60", "#f2c14e"), "bvoh": ("BVOH", "#7fc8f8")}
NS = {"s": "http://www.w3.org/2000/svg"}


def scene_of(shape: str, fill: Fill | None = None, **parameters: object) -> Scene:
    module = registry.load(shapes, shape)
    made = module.scene(module.Params(**parameters), fill or Fill())
    assert isinstance(made, Scene)
    return made


def layers_of(scene: Scene, layer_mm: float = 0.1, first_mm: float | None = None) -> list[float]:
    grid = [0.0]
    while grid[-1] < scene.size_mm[2] - 1e-9:
        grid.append(round((first_mm or layer_mm) + (len(grid) - 1) * layer_mm, 9))
    return grid


def drawn(scene: Scene, *findings: Finding, title: str = "a sensor", grid: list[float] | None = None) -> ET.Element:
    return ET.fromstring(svg(scene, title, layers_of(scene) if grid is None else grid, findings, COLOURS))


def finding(number: int = 1, **fields: object) -> Finding:
    told = {"rule": f"{number}-rule", "severity": "error", "body": "film"}
    told |= {"message": "It will not print.", "advice": "Widen it."}
    return Finding(**(told | fields))  # type: ignore[arg-type]


def polygons(path: str) -> list[list[Point]]:
    """The closed outlines of a path, in millimetres on paper with z upwards."""
    return [
        [(float(x), -float(y)) for x, y in (corner.split() for corner in part.strip("MZ").split("L"))]
        for part in re.findall(r"M[^Z]*Z", path)
    ]


def heights(element: ET.Element, kind: str) -> list[float]:
    """Where the layer lines of a class run on the page [mm]."""
    paths = [p.get("d", "") for p in element.iterfind(".//s:path", NS) if (p.get("class") or "").split()[:1] == [kind]]
    return [float(y) for path in paths for y in re.findall(r"M\S+ (\S+?)H", path)]


def spots(page: ET.Element) -> dict[int, list[Point]]:
    """Where each finding's markers point at, by its number."""
    found: dict[int, list[Point]] = {}
    for group in page.iterfind(".//s:g[@class='marker']", NS):
        circle = group.find("s:circle", NS)
        assert circle is not None
        at = float(circle.get("cx", "")), float(circle.get("cy", ""))
        found.setdefault(int(group.get("data-number", "")), []).append(at)
    return found


def words(page: ET.Element) -> list[str]:
    return [element.text or "" for element in page.iterfind(".//s:text", NS)]


def area_until(row: list[SectionColumn], end_mm: float) -> dict[str, float]:
    """Area of each material from 0 to ``end_mm``, by columns: without any clipping of outlines [mm2]."""
    total: dict[str, float] = {}
    for column in row:
        full = column.right_mm - column.left_mm
        share = min(max(end_mm - column.left_mm, 0.0) / full, 1.0)
        for layer in column.layers:
            left, right = (layer.top_mm[k] - layer.bottom_mm[k] for k in (0, 1))
            mean = left + (right - left) * share / 2
            total[layer.body.material] = total.get(layer.body.material, 0.0) + mean * share * full
    return total


@pytest.mark.parametrize(("shape", "support", "turned"), [
    pytest.param(shape, support, turned,
                 marks=() if (support == "bvoh") == turned == (k % 2 == 0) and shape not in MANY else NIGHTLY)
    for k, shape in enumerate(SHAPES) for support in ("", "bvoh") for turned in (False, True)
])  # fmt: skip
def test_areas_are_those_of_the_scene(shape: str, support: str, turned: bool) -> None:
    scene = scene_of(shape, Fill(support=support), width_mm=9.0, isolation_mm=0.1)
    scene = scene.turned_over() if turned else scene
    page = drawn(scene)
    details = page.findall(".//s:g[@class='view']", NS)
    assert [d.get("data-across") for d in details] == [v.section.across for v in views(scene)]
    for detail, view in zip(details, views(scene), strict=True):
        scale = float(detail.get("data-scale", ""))
        paths = {p.get("data-body"): polygons(p.get("d", "")) for p in detail.iterfind("s:path", NS)}
        corners = [corner for outlines in paths.values() for outline in outlines for corner in outline]
        end = (max(x for x, _ in corners) - min(x for x, _ in corners)) / scale
        tall = (max(y for _, y in corners) - min(y for _, y in corners)) / scale
        assert tall == pytest.approx(scene.size_mm[2], abs=0.001 / scale)
        found: dict[str, float] = {}
        for path in detail.iterfind("s:path", NS):
            inside = sum(area_mm2(outline) for outline in polygons(path.get("d", ""))) / scale**2
            material = path.get("data-material", "")
            found[material] = found.get(material, 0.0) + inside
        exact = area_until(columns(view.section), end)
        assert found == pytest.approx(exact, abs=0.0005 * 4000 / scale**2)


def test_areas_of_two_periods_of_triangles_are_those_of_the_thesis() -> None:
    """Per period: cog 0.25, hanging X60 0.25, lower X60 0.24 mm2; film 0.2, electrodes 0.3 mm."""
    detail = drawn(scene_of("tri")).find(".//s:g[@class='view']", NS)
    assert detail is not None
    scale = float(detail.get("data-scale", ""))
    paths = {p.get("data-body"): polygons(p.get("d", "")) for p in detail.iterfind("s:path", NS)}
    area = {name: sum(map(area_mm2, outlines)) / scale**2 for name, outlines in paths.items()}
    dielectric = {"film_and_lower": 4 * 0.2 + 2 * 0.24, "hanging_dielectric": 2 * 0.25}
    electrodes = {"bottom_electrode": 4 * 0.3, "top_electrode_with_cogs": 4 * 0.3 + 2 * 0.25}
    assert area == pytest.approx(dielectric | electrodes, abs=1e-4)


def test_both_directions_of_crossed_strips_are_drawn_through_the_conductor() -> None:
    strips = {view.section.across: view for view in views(scene_of("rect"))}
    assert {across: view.section.at_mm for across, view in strips.items()} == {"x": 0.35, "y": 0.35}
    assert [view.section.across for view in views(scene_of("tri", along="y"))] == ["y"]
    assert [view.section.across for view in views(scene_of("reference"))] == ["x"]


@pytest.mark.parametrize(("shape", "layer_mm", "first_mm"), [("tri", 0.06, None), ("rect", 0.1, 0.2)])
def test_layer_lines_respect_the_first_layer(shape: str, layer_mm: float, first_mm: float | None) -> None:
    scene = scene_of(shape)
    grid = layers_of(scene, layer_mm, first_mm)
    page = drawn(scene, grid=grid)
    lines, mids = heights(page, "grid"), heights(page, "mid")
    assert len(lines) == len(grid)
    assert mids == pytest.approx([(a + b) / 2 for a, b in pairwise(lines)], abs=0.002)
    scale = float(page.find(".//s:g[@class='view']", NS).get("data-scale"))  # type: ignore[union-attr, arg-type]
    assert [lines[0] - y for y in lines] == pytest.approx([z * scale for z in grid], abs=0.002)


def test_many_layers_get_every_tenth_number_and_few_lines() -> None:
    scene = scene_of("reference", dielectric_mm=10.0, electrode_mm=10.0)
    grid = layers_of(scene, 0.06)
    page = drawn(scene, grid=grid)
    assert len(grid) == 501
    assert len(heights(page, "grid")) < 220
    bold = [t.text for t in page.iterfind(".//s:text[@class='small bold middle']", NS)]
    assert bold
    assert all(int(number or "") % 10 == 0 for number in bold)


@pytest.mark.parametrize("layer", [1, 13])
def test_a_finding_without_a_place_stands_at_the_middle_of_its_layer(layer: int) -> None:
    page = drawn(scene_of("tri"), finding(layer=layer))
    mids = heights(page, "mid")
    [(_, y)] = spots(page)[1]
    off = [abs(y - mid) for mid in mids]
    assert off.index(min(off)) + 1 == layer  # a marker planted one layer off would be nearest to another
    assert min(off) < 0.002


def test_a_finding_with_a_place_is_marked_there() -> None:
    scene = scene_of("tri")
    page = drawn(scene, finding(place_mm=(2.5, 5.0, 0.55), layer=6))
    [(x, y)] = spots(page)[1]
    cog = next(p for p in page.iterfind(".//s:g[@class='view']/s:path", NS) if p.get("data-body", "").startswith("top"))
    corners = {corner for outline in polygons(cog.get("d", "")) for corner in outline}
    apexes = sorted(corners, key=lambda c: (c[1], c[0]))
    bed = max(heights(page, "grid"))
    assert x == pytest.approx(apexes[1][0], abs=0.002)
    assert bed - y == pytest.approx((bed + apexes[1][1]) * 0.55 / 0.5, abs=0.01)


def test_a_finding_beyond_the_detail_is_marked_at_its_edge_and_in_the_overview() -> None:
    page = drawn(scene_of("tri"), finding(place_mm=(99.0, 5.0, 0.65)))
    detail, overview = spots(page)[1]
    mids = heights(page, "mid")
    assert detail[1] == pytest.approx(mids[6], abs=0.002)
    assert overview[0] > 280
    assert overview[1] > mids[0]


def test_findings_are_ranked_and_the_rest_is_counted() -> None:
    severities = ["info", "warning", "error"] * 4
    found = [finding(k, severity=s, layer=1 + k, waiver="known" if k == 2 else "") for k, s in enumerate(severities)]
    ranked = drawing.ranked(found)
    assert [mark.kind for mark in ranked] == ["error"] * 3 + ["warning"] * 4 + ["info"] * 4 + ["waived"]
    page = drawn(scene_of("tri"), *found)
    assert set(spots(page)) == set(range(1, 13))
    more = [finding(k, layer=1 + k % 13) for k in range(40)]
    said = words(drawn(scene_of("tri"), *more))
    shown = sum("It will not print." in line for line in said)
    assert shown >= 12
    assert any(f"40 errors; {40 - shown} not shown: sensorgen check lists all" in line for line in said)


def test_a_finding_of_many_layers_stands_once_with_its_count() -> None:
    found = [finding(layer=k, message=f"a strip of {k / 10:g} mm is narrower than a line") for k in (3, 5, 4)]
    (mark,) = drawing.ranked([*found])
    assert (mark.finding.count, mark.finding.layer, mark.finding.last_layer) == (3, 3, 5)
    said = " ".join(words(drawn(scene_of("tri"), *found)))
    assert "layers 3 to 5, 3 places" in said
    assert said.count("narrower than a line") == 1
    assert len(drawing.ranked([*found, finding(body="top")])) == 2


def test_the_text_of_a_finding_is_whole() -> None:
    message = " ".join(f"word{k}" for k in range(60))
    said = " ".join(words(drawn(scene_of("tri"), finding(message=message, advice=message[::-1]))))
    assert message in said
    assert message[::-1] in said


def test_hostile_words_stay_words() -> None:
    hostile = "Größe \"<script>alert(1)</script>\" & 'x' ]]> \x00\x08\ud800\u202e " + "W" * 400
    scene = scene_of("tri")
    body = replace(scene.bodies[0], name="<b>&", material='"/><x')
    scene = Scene((body, *scene.bodies[1:]), scene.size_mm)
    page = drawn(scene, finding(message=hostile, advice=hostile, rule=hostile, waiver=hostile), title=hostile)
    assert {element.tag.rpartition("}")[2] for element in page.iter()} <= {
        *("svg", "title", "style", "defs", "marker", "path", "rect", "line", "circle", "text", "g")
    }
    title = page.findtext("s:title", None, NS) or ""
    assert "".join(title.split()).startswith("Größe\"<script>alert(1)</script>\"&'x']]>")
    stays_on_page(page)


@pytest.mark.parametrize(
    ("shape", "parameters"),
    [
        ("rect", {"length_mm": 330.0, "width_mm": 330.0}),
        ("tri", {"electrode_mm": 10.0, "hang_height_mm": 10.0, "period_mm": 0.5}),
    ],
)
def test_size_is_limited(shape: str, parameters: dict[str, float]) -> None:
    scene = scene_of(shape, Fill(support="bvoh"), **parameters)
    text = svg(scene, "t", layers_of(scene, 0.06), [finding(k, layer=k) for k in range(1, 40)], COLOURS)
    assert text.count("<") < 2000
    assert len(text) < 300_000


def size_of(text: ET.Element) -> float:
    sizes = {"title": 4.4, "heading": 3.0, "small": 2.3, "count": 2.4}
    return next((sizes[kind] for kind in (text.get("class") or "").split() if kind in sizes), 2.5)


def boxes(page: ET.Element) -> list[tuple[float, float, float, float, str]]:
    """Left, top, right, bottom and words of every text, at its usual width [mm]."""
    found = []
    for text in page.iterfind(".//s:text", NS):
        kinds, size, said = (text.get("class") or "").split(), size_of(text), text.text or ""
        long = width(said, size) * 0.93  # the estimate is for the widest of fonts
        x, y = float(text.get("x", "")), float(text.get("y", ""))
        x -= long / 2 if {"middle", "count"} & set(kinds) else long if "end" in kinds else 0.0
        found.append((x, y - 0.75 * size, x + long, y, said))
    return found


def stays_on_page(page: ET.Element) -> None:
    for left, top, right, bottom, said in boxes(page):
        assert 6 <= left <= right <= 291, said
        assert 6 <= top <= bottom <= 204, said
    for circle in page.iterfind(".//s:circle", NS):
        assert 8 <= float(circle.get("cx", "")) <= 289
        assert 8 <= float(circle.get("cy", "")) <= 202


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("layer_mm", "count"), [(0.06, 12), pytest.param(0.1, 3, marks=NIGHTLY)])
def test_no_text_runs_into_another(shape: str, layer_mm: float, count: int) -> None:
    size = {"length_mm": 12.5, "width_mm": 5.0} if shape in MANY else {}
    scene = scene_of(shape, Fill(support="bvoh"), isolation_mm=0.1, **size)
    long = "The interface at 0.74 mm is off the layer grid and prints as 0.7 mm; " * 4
    places = {k: (0.3 * k, 0.4, 0.1 * k) if k % 3 else None for k in range(1, count + 1)}
    found = [finding(k, layer=k, message=long, place_mm=place) for k, place in places.items()]
    page = drawn(scene, *found, grid=layers_of(scene, layer_mm))
    stays_on_page(page)
    for a, b in combinations(boxes(page), 2):
        apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        assert apart, (a, b)


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=2, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_any_size_gives_a_page(shape: str, data: st.DataObject) -> None:
    envelope = {"length_mm": (1.0, 1000.0), "width_mm": (1.0, 100.0)}
    envelope |= {"electrode_mm": (0.01, 10.0), "isolation_mm": (0.0, 10.0)}
    own = {
        "tri": {"period_mm": (0.5, 100.0), "hang_height_mm": (0.02, 10.0), "dielectric_mm": (0.0, 10.0)},
        "rect": {"etpu_width_mm": (0.3, 50.0), "air_width_mm": (0.02, 50.0), "upper_height_mm": (0.01, 10.0)},
    }.get(shape, {})
    if shape in ("bump", "cone", "pyramid", "pillar", "porous"):  # arrays of many pieces
        own = {"length_mm": (1.25, 25.0), "width_mm": (1.25, 10.0)}
    chosen = {name: data.draw(st.floats(low, high), name) for name, (low, high) in (envelope | own).items()}
    if shape == "tri":
        chosen["lower_height_mm"] = min(data.draw(st.floats(0.01, 9.0)), 0.9 * chosen["hang_height_mm"])
    scene = scene_of(shape, None, **chosen)
    scene = scene.turned_over() if data.draw(st.booleans()) else scene
    grid = layers_of(scene, data.draw(st.floats(0.05, 0.3)), data.draw(st.floats(0.05, 0.5)))
    place = st.none() | st.tuples(*(st.floats(0.0, size) for size in scene.size_mm))
    layer = st.none() | st.integers(1, len(grid))
    count = data.draw(st.integers(0, 12))
    found = [finding(k, place_mm=data.draw(place), layer=data.draw(layer)) for k in range(count)]
    text = svg(scene, "t", grid, found, COLOURS)
    assert len(text) < 500_000
    page = ET.fromstring(text)
    stays_on_page(page)
    assert page.findall(".//s:g[@class='view']/s:path", NS)


def test_dimensions_are_the_parameters() -> None:
    page = drawn(scene_of("tri", period_mm=1.7, dielectric_mm=0.15, electrode_mm=0.35, hang_height_mm=0.55))
    said = words(page)
    for value in ("0.35", "0.15", "0.24", "0.55", "0.85", "1.7", "1.4", "100", "gap 0.15"):
        assert value in said
    said = words(drawn(scene_of("rect", etpu_width_mm=0.8, air_width_mm=0.25, x60_width_mm=0.6)))
    for value in ("0.8", "0.25", "0.6", "1.9", "gap 0.2", "100", "10"):
        assert value in said


def banded(x: float, y: float, *rings: Point) -> Polyhedron:
    """A body of revolution as CAD programs export it: rings of 32 corners by radius and height, from below [mm]."""
    turns = [2 * pi * k / 32 for k in range(32)]
    corners = [(x + r * cos(t), y + r * sin(t), z) for r, z in rings for t in turns]
    ends = ((x, y, rings[0][1]), (x, y, rings[-1][1]))
    low, high = len(corners), len(corners) + 1
    around = [(k, (k + 1) % 32) for k in range(32)]
    flank = [
        face
        for up in range(0, len(corners) - 32, 32)
        for a, b in around
        for face in ((up + a, up + b, up + 32 + b), (up + a, up + 32 + b, up + 32 + a))
    ]
    lids = [face for a, b in around for face in ((low, b, a), (high, low - 32 + a, low - 32 + b))]
    return Polyhedron((*corners, *ends), (*flank, *lids))


def test_bands_of_a_curved_face_are_no_faces_and_have_no_dimensions() -> None:
    """Flanks of cones bulge by less than the chord of an import; each band was a face and dimensioned."""
    rings = ((0.33, 0.5), (0.392, 0.5 + 0.4 / 3), (0.447, 0.5 + 0.8 / 3), (0.5, 0.9))
    cones = [banded(0.625 + 1.25 * i, 0.625 + 1.25 * j, *rings) for i in range(4) for j in range(4)]
    top = Body("top", "etpu", (*cones, box(0, 5, 0, 5, 0.9, 1.2)), "top")
    bottom = Body("bottom", "etpu", (box(0, 5, 0, 5, 0, 0.3),), "bottom")
    scene = Scene((bottom, Body("film", "x60", (box(0, 5, 0, 5, 0.3, 0.5),)), top), (5.0, 5.0, 1.2))
    assert faces_mm(top) == {0.5, 0.9, 1.2}
    assert cones[0].levels_mm() == {round(z, 9) for _, z in rings}  # all of its bends, which models cut it at
    said = words(drawn(scene))
    assert {"0.17", "0.66", "0.25", "1.25"} <= set(said)
    assert not [word for word in said if re.fullmatch(r"0\.0[56]\d*", word)]
    step = banded(0.0, 0.0, (0.5, 0.0), (0.5, 0.35), (0.3, 0.35), (0.3, 0.6))
    tip = Polyhedron(((0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, 1.05)), ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)))
    assert (step.faces_mm(), tip.faces_mm()) == ({0.0, 0.35, 0.6}, {0.0, 1.05})


def test_the_period_survives_a_pattern_that_begins_within_one() -> None:
    strips = {view.section.across: view for view in views(scene_of("rect", width_mm=9.5).turned_over())}
    assert strips["y"].repeat_mm() == pytest.approx(2.0)
    assert period(Section("x", 1.0, 0.5, ())) == ()
    assert views(scene_of("reference"))[0].period_mm == ()


def test_details_of_an_array_show_a_crossing() -> None:
    """They showed the leads at the sensor's corner alone; letters lay below the outlines of the print."""
    parameters = {"length_mm": 30, "width_mm": 20, "pitch_x_mm": 9, "pitch_y_mm": 7, "column_mm": 6, "row_mm": 6}
    array = make({"shape": "array", "parameters": parameters, "cell": {"shape": "tri"}}).printed
    text = svg(array, "an array", layers_of(array), (), COLOURS, printed=array)
    page = ET.fromstring(text)
    stays_on_page(page)
    windows = re.findall(r"Section .: . = \S+ mm, . from (\S+) to (\S+) mm, \d", text)
    assert len(windows) == 2
    for view, (start, end) in zip(views(array), windows, strict=True):
        tracks: dict[str, list[Point]] = {"top": [], "bottom": []}
        for body, outline in view.section.regions:
            if body.terminal:
                tracks[body.terminal].append((min(u for u, _ in outline), max(u for u, _ in outline)))
        shared = [(max(a, c), min(b, d)) for (a, b), (c, d) in product(tracks["top"], tracks["bottom"])]
        assert max(min(high, float(end)) - max(low, float(start)) for low, high in shared) > 1.9  # a cog and more
        assert max(min(high, 10.0) - low for low, high in shared) < 0  # at the corner
    assert text[: text.index(">A</text>")].count('class="printed"') >= len(array.bodies) - 1


def test_the_gap_is_the_smallest_distance_even_aslant() -> None:
    low, high = box(0, 1, 0, 1, 0, 1), box(4, 5, 0, 1, 5, 6)
    scene = Scene((Body("a", "etpu", (low,), "bottom"), Body("b", "etpu", (high,), "top")), (5.0, 1.0, 6.0))
    gap = nearest(views(scene)[0])
    assert gap is not None
    assert gap.value_mm == pytest.approx(5.0)
    short = nearest(views(scene_of("tri", dielectric_mm=0.0))[0])
    assert short is not None
    assert short.value_mm == 0.0
    assert "gap 0: short" in words(drawn(scene_of("tri", dielectric_mm=0.0)))


def test_one_layer_no_layers_and_unknown_materials_are_drawn() -> None:
    scene = scene_of("reference", dielectric_mm=0.0)
    for grid in ([], [0.0], [0.0, 0.6]):
        assert ET.fromstring(svg(scene, "", grid, [finding(layer=3)], {})) is not None


@pytest.mark.parametrize(("high_mm", "leaders"), [((1.0, 2.0), 0), ((0.05, 0.1), 2)])
def test_a_value_that_fits_beside_its_dimension_has_no_leader(high_mm: Point, leaders: int) -> None:
    """By the only slanted lines there are: ends of dimensions run across, dimensions upright."""
    lane = [Measure(0.0, high_mm[0]), Measure(high_mm[0], high_mm[1])]
    svg = f"<g>{''.join(beside(ViewFrame(50.0, 100.0, 90.0, 20.0, 10.0, 10.0), [lane]))}</g>"
    lines = [{k: float(each.get(k, "")) for k in ("x1", "y1", "x2", "y2")} for each in ET.fromstring(svg).iter("line")]
    assert sum(each["x1"] - each["x2"] == pytest.approx(2.2) for each in lines) == leaders
