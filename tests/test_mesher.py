"""The mesher's own process: one that ends is a message, and thin electrodes end none."""

from importlib.util import find_spec

import numpy as np
import pytest
import shapely

from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.mesh_ladder import drawn
from sensorgen.prediction.sensor_model import piece
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.contact import mesher
from sensorgen.solvers.contact.cell import cell_of, joined
from sensorgen.solvers.contact.mesh import Fineness, mesh_of, pinches

pytestmark = pytest.mark.skipif(find_spec("netgen") is None, reason="needs NGSolve")
CORNERS = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
SQUARE = [((a, b), (1, 0)) for a, b in zip(CORNERS, [*CORNERS[1:], CORNERS[0]], strict=True)]


def square():
    return mesher.mesh(SQUARE, 0.5, 0.3, {}, quick=True)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import os; os.kill(os.getpid(), 11)", "was ended by SIGSEGV"),
        ("raise SystemExit(139)", "ended with exit code 139"),
    ],
)
def test_a_mesher_that_dies_is_a_message_and_the_next_one_meshes(monkeypatch, program, said):
    mesher._stop()
    with monkeypatch.context() as planted:
        planted.setattr(mesher, "_WORKER", ("-c", program))
        with pytest.raises(mesher.Unmeshed, match=f"the mesher {said}"):
            square()
    assert len(square().corners) >= 2


def random_designs(count, seed=3):
    """Designs of tri with electrodes of 0.06 to 0.2 mm under periods of 2 to 8 mm, as an optimiser tries them."""
    rng = np.random.default_rng(seed)
    while count:
        sizes = {
            "period_mm": rng.uniform(2.0, 8.0), "hang_height_mm": rng.uniform(0.1, 0.6),
            "lower_height_mm": rng.uniform(0.06, 0.4), "dielectric_mm": rng.uniform(0.06, 0.3),
            "electrode_mm": rng.uniform(0.06, 0.2),
        }  # fmt: skip
        try:
            design = make({"shape": "tri", "parameters": {k: round(float(v), 2) for k, v in sizes.items()}})
            yield design
            count -= 1
        except SensorgenError:  # no such cell
            continue


def meshed(count):
    sizes = []
    for design in random_designs(count):
        piece = drawn(design)
        try:
            sizes.append(len(mesh_of(cell_of(piece.scene, piece.period_mm), Fineness()).points_m))
        except mesher.Unmeshed as error:
            sizes.append(str(error))
    return sizes


def test_thin_electrodes_end_no_process():
    assert len(meshed(6)) == 6


def test_straight_edges_become_one_and_nothing_moves():
    """Outlines by shapely: the printed cell's regions stay, its cuts in straight edges go."""
    printed = piece(bodies.estimated(make({"shape": "tri", "parameters": {"length_mm": 8.0}})))
    cut = cell_of(printed.scene, printed.period_mm)
    whole = joined(cut.edges)
    assert len(whole) < 0.7 * len(cut.edges)
    for region in range(1, len(cut.regions) + 1):
        of = ([edge for edge, sides in edges.items() if region in sides] for edges in (cut.edges, whole))
        before, after = map(shapely.MultiLineString, of)
        assert after.length == pytest.approx(before.length)
        assert after.hausdorff_distance(before) < 1e-9
        assert shapely.polygonize([after]).area == pytest.approx(shapely.polygonize([before]).area)


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_steps_that_touch_in_a_corner_are_parted(gap):
    """The solids' area by shapely: touching steps lose 2 um over half of their height each, others nothing."""
    boxes = {"bottom": [(0, 2, 0, 0.1)], "top": [(0, 2, 0.4, 0.5)], "": [
        (0.5 + gap, 1.5 - gap, 0.1, 0.25), (0, 0.5, 0.25, 0.4), (1.5, 2, 0.25, 0.4)
    ]}  # fmt: skip
    pieces = {end: tuple(box(a, b, 0, 1, *z) for a, b, *z in spans) for end, spans in boxes.items()}
    solids = [Body(end or "film", "etpu" if end else "x60", of, end) for end, of in pieces.items()]
    cell = cell_of(Scene(tuple(solids), (2.0, 1.0, 0.5)), 2.0)
    drawn_mm2 = sum((b - a) * (high - low) for spans in boxes.values() for a, b, low, high in spans)
    mesh = mesh_of(cell, Fineness())
    outline = shapely.union_all(shapely.polygons(mesh.points_m[mesh.outer[:, :3]] * 1e3))
    lost_mm2 = (2e-3 * 0.15 / 2) * (1 if cell.mirrored else 2) * (gap == 0)
    assert not pinches(cell)
    assert outline.area == pytest.approx(drawn_mm2 * cell.width_mm() / 2 - lost_mm2, abs=1e-9)
