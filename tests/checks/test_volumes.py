"""Rule 7's table: strips that are lost, and strips that run into one another."""

import pytest
import shapely

from sensorgen.checks.volumes import findings, rows
from sensorgen.core.findings import LayerVolume
from sensorgen.design.design import make
from sensorgen.scene.layers import drawn
from sensorgen.scene.scene import Body, Scene, box

DESIGN = make({"shape": "tri", "parameters": {"length_mm": 12.0, "width_mm": 8.0}})
BODY, LAYER = "top_electrode_with_cogs", 8  # cogs of six periods, from 0.8 to 0.9 mm
SCENE = DESIGN.printed
PLAN = list(drawn(SCENE, DESIGN.layers.boundaries_mm(SCENE.size_mm[2])))
RUNS = tuple(sorted(part.bounds[0::2] for part in shapely.get_parts(PLAN[LAYER].region(BODY))))


def row_of(runs):
    strips = shapely.union_all([shapely.box(a, 0.0, b, 8.0) for a, b in runs])
    layer = PLAN[LAYER].mapped({**PLAN[LAYER].regions, BODY: strips})
    printed = [*PLAN[:LAYER], layer, *PLAN[LAYER + 1 :]]
    (row,) = (row for row in rows(SCENE, printed) if (row.body, row.layer) == (BODY, LAYER + 1))
    return row


@pytest.mark.parametrize(
    ("runs", "vanished", "fused"),
    [
        (RUNS, 0, 0),
        (RUNS[1:], 1, 0),
        ((), 6, 0),
        (((RUNS[0][0], RUNS[1][1]), *RUNS[2:]), 0, 1),
        (((RUNS[0][0], RUNS[-1][1]),), 0, 5),
        (tuple((a, a + 0.05 * (b - a)) for a, b in RUNS), 6, 0),
        (tuple((a, a + 0.2 * (b - a)) for a, b in RUNS), 0, 0),
        (((RUNS[0][1] + 0.1, RUNS[1][0] - 0.1), *RUNS), 0, 0),  # beside them all: extra, and nobody's
    ],
)
def test_strips_that_are_lost_or_fused_are_counted(runs, vanished, fused):
    row = row_of(runs)
    assert (row.strips, row.vanished, row.fused) == (6, vanished, fused)


def test_the_first_lost_strip_has_its_place():
    def middle(k):
        return (sum(RUNS[k]) / 2, 0.0)

    assert row_of(RUNS).place_mm == middle(0)
    assert row_of((*RUNS[:2], *RUNS[3:])).place_mm == middle(2)
    assert findings([row_of((*RUNS[:2], *RUNS[3:]))], SCENE)[0].place_mm == (*middle(2), 0.85)


def test_they_are_told_in_the_finding():
    lost, fused = (findings([row_of(runs)], SCENE)[0].message for runs in (RUNS[2:], ((0.0, 12.0),)))
    assert "2 of 6 strips vanish" in lost
    assert "5 fuse" in fused


@pytest.mark.parametrize(("material", "severity"), [("bvoh", "warning"), ("x60", "error")])
def test_lost_support_is_no_error(material, severity):
    """It is washed out in the end: what it would have held up is another rule's."""
    name = "support" if material == "bvoh" else "film"
    scene = Scene((Body(name, material, (box(0, 1, 0, 1, 0, 0.1),)),), (1.0, 1.0, 0.1))
    row = LayerVolume(name, 1, 0.0, 0.1, 0.1, 0.0, 1, 1, 0, (0.0, 0.0))
    assert [f.severity for f in findings([row], scene)] == [severity]
