"""What every shape must do; a new file in ``shapes/`` is tested here before it has a test of its own.

A new shape has no stored scene yet: ``STORE_SCENES=1 pytest tests/shapes`` writes the missing ones.
"""

import json
import os
import subprocess
import sys
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pytest

from sensorgen.checks.review import review
from sensorgen.core import lazy as registry
from sensorgen.core.errors import OutOfRange
from sensorgen.design import shapes
from sensorgen.design.design import make
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Fill, Scene, area_mm2

STORED = Path(__file__).parents[1] / "reference" / "scenes"
SMALL = {"length_mm": 3.0, "width_mm": 2.5}  # one and a half periods: the edge is clipped


@pytest.fixture(params=registry.names(shapes))
def name(request) -> str:
    return request.param


@pytest.fixture
def shape(name):
    return registry.load(shapes, name)


def small(shape, fill: Fill | None = None) -> Scene:
    return shape.scene(shape.Params(**SMALL), fill or Fill())


def test_every_parameter_has_help_and_a_range_that_holds_its_default(shape):
    for field in fields(shape.Params):
        assert field.metadata["help"].endswith("."), field.name
        if "choices" in field.metadata:
            assert field.default in field.metadata["choices"], field.name
        else:
            low, high = field.metadata["range"]
            assert low <= field.default <= high, field.name


def test_it_imports_the_scene_and_the_standard_library_only(name):
    code = (
        "import json, sys; before = set(sys.modules); "
        f"import sensorgen.design.shapes.{name}; print(json.dumps(sorted(set(sys.modules) - before)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    loaded = set(json.loads(done.stdout))
    ours = {m for m in loaded if m.partition(".")[0] == "sensorgen"}
    assert ours <= {
        "sensorgen",
        "sensorgen.core",
        "sensorgen.core.errors",
        "sensorgen.core.version",
        "sensorgen.scene",
        *(f"sensorgen.scene.{part}" for part in ("patterns", "polyhedra", "revolved", "scene")),
        "sensorgen.design",
        "sensorgen.design.shapes",
        f"sensorgen.design.shapes.{name}",
    }
    assert {m.partition(".")[0] for m in loaded - ours} <= set(sys.stdlib_module_names)


def test_its_defaults_pass_the_checks(name):
    shorter = {"length_mm": 10.0} if name in ("bump", "cone", "pyramid") else {}  # 640 round bodies take ten seconds
    design = make({"shape": name, "printer": "diabase-h5", "quality": "fine", "parameters": shorter})
    assert review(design).errors() == []


@pytest.mark.parametrize("tip_mm", [0.0, 0.3, 0.58])
def test_a_bump_is_a_zone_of_a_sphere(tip_mm):
    """Volume by the closed form for a zone between two parallel planes."""
    params = {"length_mm": 1.25, "width_mm": 1.25, "root_mm": 1.0, "height_mm": 0.4, "tip_mm": tip_mm}
    scene = make({"shape": "bump", "parameters": params}).drawn
    (bump,) = (piece for body in scene.bodies for piece in body.pieces if piece.is_round())
    assert bump.volume_mm3() == pytest.approx(np.pi * 0.4 / 6 * (3 * 0.5**2 + 3 * (tip_mm / 2) ** 2 + 0.4**2))


@pytest.mark.parametrize(("tip_mm", "height_mm"), [(1.0, 0.1), (0.6, 0.41)])
def test_no_bump_is_more_than_half_a_sphere(tip_mm, height_mm):
    with pytest.raises(OutOfRange, match="expected"):
        make({"shape": "bump", "parameters": {"root_mm": 1.0, "tip_mm": tip_mm, "height_mm": height_mm}})


def test_with_support_its_volumes_add_up_to_the_envelope(shape):
    scene = small(shape, Fill(support="bvoh"))
    is_round = any(p.is_round() for body in scene.bodies for p in body.pieces)  # beside a circle, support has chords
    total = sum(b.volume_mm3() for b in scene.bodies)
    assert total == pytest.approx(np.prod(scene.size_mm), rel=1e-3 if is_round else 1e-12)


@pytest.mark.parametrize(("fill", "turned"), [(Fill(support="bvoh"), True), (Fill(film="pla"), False)])
def test_its_bodies_are_closed_and_apart(shape, fill, turned):
    scene = small(shape, fill)
    scene = scene.turned_over() if turned else scene
    made = {body.name: meshes.mesh(body) for body in scene.bodies}
    assert meshes.faults(scene, made) == []


def test_its_outlines_turn_left_and_stay_in_the_envelope(shape):
    scene = small(shape)
    for piece in (p for body in scene.bodies for p in body.pieces):
        low, high = piece.span("z")
        assert all(area_mm2(outline) > 0 for outline in piece.cut("z", (low + high) / 2))
        for axis, size in zip("xyz", scene.size_mm, strict=True):
            low, high = piece.span(axis)
            assert 0 <= low < high <= size + 1e-12


def test_both_terminals_are_there_and_names_are_unique(shape):
    bodies = small(shape, Fill(support="bvoh")).bodies
    assert sorted(b.terminal for b in bodies if b.terminal) in (["bottom", "top"], ["bottom", "middle", "top"])
    assert len({b.name for b in bodies}) == len(bodies)


def test_its_scene_is_the_stored_one(name, shape):
    scene = json.loads(json.dumps(asdict(small(shape))))
    path = STORED / f"{name}.json"
    if os.environ.get("STORE_SCENES") and not path.exists():
        path.write_text(json.dumps(scene, indent=1) + "\n", "utf-8")
    assert path.exists(), "no stored scene yet: see the top of this file"
    assert scene == json.loads(path.read_text("utf-8")), "if the change is meant, delete the file and store it anew"
