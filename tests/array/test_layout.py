"""Arrays of crossing tracks: layout, bodies, outlines, wires, and what is refused."""

import csv
import io
from itertools import pairwise

import numpy as np
import pytest
import shapely

from sensorgen.checks.review import review
from sensorgen.core.errors import SensorgenError
from sensorgen.core.findings import Finding
from sensorgen.design.design import make
from sensorgen.design.values import resistivities
from sensorgen.prediction.array.model import array_model, wire_table
from sensorgen.prediction.slices import combined
from sensorgen.scene.geometry import meshes
from sensorgen.scene.geometry.meshes import mesh

TRI = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}}


def array(cell=None, **parameters):
    own = {"length_mm": 40, "width_mm": 30, **parameters}
    return make({"shape": "array", "parameters": own, "cell": cell or {"parameters": {"dielectric_mm": 0.4}}})


def outlined(polygon, **parameters):
    cell = {"parameters": {"dielectric_mm": 0.4}}
    return make({"shape": "array", "border": polygon.wkt, "parameters": parameters, "cell": cell})


STEP = shapely.Polygon([(0, 0), (30, 0), (30, 10), (40, 10), (40, 40), (10, 40), (10, 20), (0, 20)])


@pytest.mark.parametrize("cell", [None, TRI])
def test_bodies_fill_the_print_and_do_not_overlap(cell):
    design = array(cell)
    scene = design.drawn
    meshed = {body.name: mesh(body) for body in scene.bodies}
    assert not list(meshes.faults(scene, meshed))
    assert {body.terminal for body in scene.bodies} == {"", "top", "bottom"}
    assert meshes.electrode_gap_mm(scene, meshed) == pytest.approx(design.crossing.params.dielectric_mm)
    if cell is None:  # of plates: the whole box but the pads, which are open from above
        p, size = design.params, scene.size_mm
        pads = p.lead_mm * p.pad_mm * (3 * (size[2] - p.base_mm - p.electrode_mm) + 4 * p.isolation_mm)
        assert sum(b.volume_mm3() for b in scene.bodies) == pytest.approx(size[0] * size[1] * size[2] - pads)


def test_the_cells_are_those_of_the_shape():
    """A column of tri has as much of the cells' bodies as the shape alone on the column's size.

    All dielectric is one body: slicers print touching parts of one tool as one. Beside the columns it is plates.
    """
    whole, alone = array(TRI).drawn, array(TRI).crossing
    strip = make({"shape": "tri", "parameters": alone.parameters | {"width_mm": 28}}).drawn
    columns = [piece for piece in whole.body("film_and_lower").pieces if piece.axis == "y"]
    own = [strip.body(name).volume_mm3() for name in ("film_and_lower", "hanging_dielectric")]
    assert sum(piece.volume_mm3() for piece in columns) == pytest.approx(4 * sum(own))
    materials = [body.material for body in whole.bodies if not body.terminal]
    assert materials == ["x60"] * 3  # base, dielectric, isolation


@pytest.mark.parametrize(
    "design",
    [array(connector_mm=9.0), outlined(STEP, pitch_x_mm=5, pitch_y_mm=5, row_mm=4, column_mm=4)],
)
def test_tracks_of_a_layer_do_not_touch_and_end_in_a_row_of_pads(design):
    layout = design.layout
    for tracks in (layout.rows, layout.columns):
        plans = [layout.plan(t) for t in tracks]
        assert shapely.STRtree(plans).query(plans, "dwithin", 0.2).shape[1] == len(plans)
        assert all(plan.geom_type == "Polygon" for plan in plans)  # in one piece
    pads = sorted(t.pad for t in (*layout.rows, *layout.columns))
    assert all(b[0] - a[1] > 0.5 for a, b in pairwise(pads))
    assert {pad[2] for pad in pads} == {0.0}
    assert shapely.covers(layout.footprint.buffer(1e-6), shapely.union_all(layout.regions))
    assert layout.footprint.bounds == pytest.approx((0, 0, *layout.size_mm))


def test_an_outline_cuts_on_the_lines_of_crossings():
    layout = outlined(STEP).layout
    assert np.array(layout.here).tolist() == [
        [True, True, True, False], [True, True, True, True], [False, True, True, True], [False, True, True, True],
    ]  # fmt: skip
    slivers = [p for body in outlined(STEP).drawn.bodies for p in body.pieces if min(np.ptp(p.outline, axis=0)) < 0.2]
    assert not slivers
    assert layout.crossing(layout.x_mm[3], layout.y_mm[0]) == ""
    assert layout.crossing(layout.x_mm[2] + 4.9, layout.y_mm[1]) == "r2c3"


def test_air_between_columns_is_closed_at_their_ends():
    """No roof spans more than the space between two columns: grooves do not cross."""
    design = array(TRI, between="air")
    grooves = shapely.difference(
        design.layout.open_air,
        shapely.union_all([shapely.box(*np.array(t.body)[[0, 2, 1, 3]]) for t in design.layout.columns]),
    )
    widths = [min(np.ptp(np.array(part.exterior.coords), axis=0)) for part in shapely.get_parts(grooves)]
    assert sorted(widths) == pytest.approx([1, 1, 2, 2, 2])
    findings = [f for f in review(design).findings if f.rule == "9-bridge" and f.body == "isolation"]
    assert [f.value_mm for f in findings] == pytest.approx([2.0])  # 28 mm where they crossed


def test_leads_that_cross_tracks_outside_the_outline_count():
    """Row 3 leads over column 1 below whose end it lies: 1.8 mm of lead on the column's lead."""
    notch = shapely.Polygon([(20, 0), (40, 0), (40, 40), (0, 40), (0, 20), (20, 20)])
    model = array_model(outlined(notch))
    extra, whole = model.capacitances()[0, 0], model.capacitance.value
    assert extra == pytest.approx(whole * 1.8**2 / 64)
    assert model.capacitances()[2, 0] == whole


def test_wires_have_the_resistance_of_flat_tracks():
    design = array()
    text = wire_table(design)
    rows = list(csv.DictReader(io.StringIO("\n".join(
        [",".join(c.key for c in text.columns), *(",".join(map(str, row)) for row in text.cells)]
    ))))  # fmt: skip
    assert [row["track"] for row in rows] == ["r3", "r2", "r1", "c1", "c2", "c3", "c4"]
    rho, p = resistivities(design.crossing)["top"].value * 1e3, design.params  # ohm mm
    one = rows[0]  # down from its middle, 3 connector pitches to the left
    level, left = design.layout.y_mm[2], design.layout.x_mm[0] - 4
    length = left - float(one["pad_x_mm"]) + level - p.pad_mm / 2
    assert float(one["lead_mm"]) == pytest.approx(length)
    assert float(one["lead_ohm"]) == pytest.approx(rho * length / (p.lead_mm * p.electrode_mm), rel=1e-3)
    track = rho * 38 / (8 * p.electrode_mm)
    assert float(one["end_ohm"]) == pytest.approx(float(one["lead_ohm"]) + track, rel=1e-3)
    assert float(one["least_ohm"]) < float(one["end_ohm"]) < float(one["most_ohm"])


def test_stretches_add_up_to_the_wire():
    """From the pad through the lead to the last crossing; the rest of the track beyond it is half a crossing."""
    model = array_model(outlined(STEP))
    tracks = model.tracks()
    for wire in model.wires():
        k, is_row = int(wire.track[1:]) - 1, wire.track[0] == "r"
        between = (tracks.row_ohm if is_row else tracks.column_ohm.T)[k]
        lead = (tracks.row_lead_ohm if is_row else tracks.column_lead_ohm)[k]
        per_mm = (wire.end_ohm - wire.lead_ohm) / wire.track_mm
        assert lead + between[np.isfinite(between)].sum() == pytest.approx(wire.end_ohm - 4 * per_mm)


def test_findings_name_the_crossing():
    design = array()
    x, y = design.layout.x_mm[2], design.layout.y_mm[1]
    found = Finding("9-bridge", "warning", "isolation", "a bridge", "fill it", place_mm=(x + 3, y - 3, 1.0))
    held = combined(design, review(design), "sliced by a test", [found])
    assert any(f.message == "a bridge (r2c3)" for f in held.findings)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"parameters": {"length_mm": 5}}, "room for 6 rows and 0 columns"),
        ({"parameters": {"lead_mm": 3}}, "lead_mm 3 leaves no space between leads"),
        ({"parameters": {"length_mm": 600, "width_mm": 600, "pitch_x_mm": 5, "pitch_y_mm": 5, "row_mm": 4,
                         "column_mm": 4}}, "120 x 120 crossings; expected at most 10000"),
        ({"cell": {"shape": "trj"}}, "unknown shape 'trj'"),
        ({"cell": {"shape": "array"}}, "cell.shape: array; expected the shape of one crossing"),
        ({"cell": {"parameters": {"length_mm": 5}}}, "the array gives it"),
        ({"cell": {"shape": "tri", "parameters": {"period_mm": 3}}}, "column_mm 8 is 2.667 periods"),
        ({"cell": {"shape": "pillar", "parameters": {"period_mm": 2}}, "parameters": {"pitch_y_mm": 9}},
         "pitch_y 9 is 4.5 periods"),
        ({"border": shapely.Polygon([(0, 0), (19, 0), (0, 19)]).wkt}, "the outline has no room for one crossing"),
        ({"shape": "tri", "cell": {}}, "tri has no crossings"),
    ],
)  # fmt: skip
def test_no_array_is_an_error(data, words):
    with pytest.raises(SensorgenError, match=words):
        _ = make({"shape": "array"} | data).drawn


def test_lines_that_are_spread_evenly_need_no_whole_periods():
    cell = {"shape": "porous", "parameters": {"dielectric_mm": 0.6, "space_mm": 0.35}}
    design = array(cell, column_mm=8.15, row_mm=8.15)
    scene = design.drawn
    assert not list(meshes.faults(scene, {body.name: mesh(body) for body in scene.bodies}))
    assert design.crossing.params.cells() == pytest.approx((8.15 / 0.85) ** 2)


@pytest.mark.parametrize(("pitch", "track"), [(8, 6.0), (2, 1.6)])
def test_tracks_without_a_width_leave_a_fifth_of_the_pitch_and_hold_whole_cells(pitch, track):
    design = array(TRI if pitch > 2 else None, pitch_x_mm=pitch, pitch_y_mm=pitch)
    assert (design.params.column_mm, design.params.row_mm) == (track, track)
    assert array(pitch_x_mm=10).id() == array(pitch_x_mm=10, column_mm=8, row_mm=8).id()
