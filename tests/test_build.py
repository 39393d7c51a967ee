"""The whole way of a design: every file there, right, and the same each time."""

import hashlib
import json
import multiprocessing
import os
import signal
from functools import partial
from pathlib import Path

import pytest

from sensorgen.core import lazy as registry
from sensorgen.core import parallel
from sensorgen.core.cache import only_known
from sensorgen.core.errors import Unprintable
from sensorgen.core.parallel import cores
from sensorgen.design import design, shapes
from sensorgen.export.threemf import FAMILIES
from sensorgen.prediction import bodies
from sensorgen.prediction import evaluate as evaluating
from sensorgen.prediction.evaluate import ahead, evaluate
from sensorgen.prediction.results import timeless
from sensorgen.workflows import build as workflow
from sensorgen.workflows.build import build

DESIGNS = Path(__file__).parents[1] / "designs"

TRI = {"shape": "tri", "name": "trix-d0.2", "parameters": {"length_mm": 20.0}}


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A full build of ten periods of the README's sensor, STEP included."""
    return build(design.make(TRI), tmp_path_factory.mktemp("whole"))


def test_every_promised_file_is_there(whole):
    files = set(contents(whole.folder))
    promised = {f"trix-d0.2.{end}" for end in ("prusa.3mf", "cura.3mf", "orca.3mf", "step", "svg")}
    promised |= {"check.json", "prediction.json", "design.json", "manifest.json"}
    promised |= {f"profiles/prusa/diabase-h5-{quality}.ini" for quality in ("fine", "extrafine")}
    assert promised <= files
    assert {name.split("/")[2] for name in files if name.startswith("profiles/cura/")} == {
        "definitions", "extruders", "materials", "quality",
    }  # fmt: skip
    assert len([n for n in files if n.startswith("profiles/cura/extruders/")]) == 5


def test_rebuilt_it_is_the_same_to_the_byte(whole, tmp_path):
    """Without STEP, which tests/geometry/test_cad.py writes in two processes."""
    again, first = (contents(built.folder) for built in (build(design.make(TRI), tmp_path, cad=False), whole))
    del first["trix-d0.2.step"]
    sealed = [json.loads(files.pop("manifest.json")) for files in (again, first)]
    for kept in sealed:
        kept["files"].pop("trix-d0.2.step", None)
        del kept["sha256"]
        kept["versions"].pop("build123d", None)
    assert again == first
    assert sealed[0] == sealed[1]


def test_manifest_has_the_hash_of_every_other_file(whole):
    manifest = json.loads((whole.folder / "manifest.json").read_text("utf-8"))
    files = {k: hashlib.sha256(v).hexdigest() for k, v in contents(whole.folder).items() if k != "manifest.json"}
    assert manifest["files"] == files
    assert manifest["design"] == json.loads((whole.folder / "check.json").read_text("utf-8"))["design"]
    assert set(manifest["versions"]) >= {"sensorgen", "python", "build123d", "manifold3d", "numpy"}


def test_the_design_file_beside_the_results_builds_the_same_design(whole):
    data = json.loads((whole.folder / "design.json").read_text("utf-8"))
    assert design.make(data).id() == design.make(TRI).id()


@pytest.mark.parametrize("family", FAMILIES)
def test_lib3mf_reads_every_3mf_back(whole, family):
    import lib3mf

    variant, folder = design.make(TRI), whole.folder
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(folder / f"{variant.name}.{family}.3mf"))
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    volumes = {}
    while objects.MoveNext():
        mesh = objects.GetCurrentMeshObject()
        volumes[mesh.GetName()] = volume_mm3(mesh.GetVertices(), mesh.GetTriangleIndices())
    exact = {body.name: body.volume_mm3() for body in variant.printed.bodies}
    if family == "prusa":  # PrusaSlicer wants one mesh; its own config names the bodies within
        assert sum(volumes.values()) == pytest.approx(sum(exact.values()), rel=1e-6)
    else:
        # lib3mf keeps float32, whose steps of 7.6e-6 mm at x = 100 mm are up to 1.1e-5 of a strip of 0.7 mm; over
        # the strips of a body they average out to about 1e-6.
        assert volumes == {body: pytest.approx(v, rel=2e-6) for body, v in exact.items()}


def volume_mm3(vertices, triangles):
    import numpy as np

    points = np.array([list(v.Coordinates) for v in vertices], float)
    a, b, c = (points[np.array([list(t.Indices) for t in triangles])[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


@pytest.mark.parametrize("name", ["23/trix-d0.yaml", "23/sqyx-d0.yaml"])
@pytest.mark.usefixtures("roughly")
def test_a_film_of_nothing_is_refused_unless_forced(name, tmp_path):
    variant = design.load(DESIGNS / name)
    with pytest.raises(Unprintable) as caught:
        build(variant, tmp_path / "out", cad=False)
    assert "1-short" in {f.rule for f in caught.value.findings if f.severity == "error"} <= {"1-short", "7-printed"}
    assert not (tmp_path / "out").exists()
    forced = build(variant, tmp_path / "out", cad=False, force=True)
    assert (forced.prediction.drawn.status, forced.prediction.drawn.capacitance) == ("short", None)
    assert "touch" in forced.prediction.drawn.reason


@pytest.mark.parametrize("shape", registry.names(shapes))
def test_all_listed_shapes_build(shape, tmp_path, unpredicted):
    """Two periods each way; forced, as so few bumps and cones leave bridges at the edge, which larger ones do not."""
    size = dict.fromkeys(("length_mm", "width_mm"), 6.0 if shape == "porous" else 4.0)
    built = build(design.make({"shape": shape, "parameters": size}), tmp_path, cad=False, force=True)
    assert (built.folder / "manifest.json").exists()


def test_a_crossing_is_predicted_in_another_process_to_the_same_files(tmp_path, monkeypatch):
    """With an empty store each: the process leaves nothing to work out here, and changes nothing."""
    plan = {"length_mm": 10, "width_mm": 10, "pitch_x_mm": 5, "pitch_y_mm": 5, "column_mm": 4, "row_mm": 4}
    array = design.make({"shape": "array", "name": "a", "parameters": plan, "cell": {"shape": "reference"}})
    found = []
    for count, predict in ((2, known_only), (1, evaluate)):
        monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / f"cache-{count}"))
        monkeypatch.setattr(parallel, "cores", lambda count=count: count)
        monkeypatch.setattr(workflow, "evaluate", predict)
        build(array, tmp_path / f"{count}", cad=False, force=True)
        found.append(contents(tmp_path / f"{count}"))
    assert found[0] == found[1]
    assert found[0]["a/prediction.json"]


def known_only(body):
    with only_known():
        return evaluate(body)


def drawn_or_dead(parent, sensor):
    """Body of a drawing; in any other process than the parent the end of it."""
    if os.getpid() != parent:
        os._exit(1)
    return bodies.drawn(sensor)


@pytest.mark.own_cache
@pytest.mark.parametrize("dies", [False, True])
def test_a_drawing_is_predicted_in_another_process_to_the_same_numbers(monkeypatch, dies):
    """Or, where that process dies, in this one."""
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    sensor = design.make({"shape": "reference", "parameters": {"length_mm": 11.0}})
    alone, here, work = evaluate(bodies.estimated(sensor), keep=False), [], evaluating._computed
    monkeypatch.setattr(evaluating, "_computed", lambda body, query: here.append(body.is_drawn) or work(body, query))
    of = partial(drawn_or_dead, os.getpid(), sensor) if dies else partial(bodies.drawn, sensor)
    with ahead(of):
        both = evaluate(bodies.estimated(sensor))
    assert here == ([False, True] if dies else [False])
    assert timeless(both) == timeless(alone)
    here.clear()
    with ahead(of):
        assert evaluate(bodies.estimated(sensor)) == both
    assert here == []


def stuck(parent, sensor):
    """Body of a drawing; any other process than the parent never gets it."""
    if os.getpid() != parent:
        signal.pause()
    return bodies.drawn(sensor)


@pytest.mark.own_cache
def test_a_prediction_that_nobody_has_waited_for_is_ended(monkeypatch):
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    sensor = design.make({"shape": "reference", "parameters": {"length_mm": 11.0}})
    with ahead(partial(stuck, os.getpid(), sensor)):
        assert multiprocessing.active_children()
    assert not multiprocessing.active_children()


def test_a_daemon_starts_no_process(monkeypatch):
    """It may not: a build in a worker of a user's own pool."""
    assert cores() >= 1
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)
    assert cores() == 1


def test_the_file_of_a_cells_shape_decides_an_array():
    """Else a change of it would find the old findings and slices."""
    array = design.make({"shape": "array", "cell": {"shape": "reference"}})
    first, second = (array.model_copy(update={"own": {"shapes": {"mine": text}}}).id() for text in "ab")
    assert len({array.id(), first, second}) == 3


def test_interfaces_of_a_film_that_is_not_there_change_nothing():
    """A plain plate has no film of its own: the slot's material is nowhere in it."""
    plate = {"shape": "reference", "materials": {"film": "ninjaflex"}}
    gap = {"material_values": {"ninjaflex": {"interface_gap_m": 1e-5}}}
    without, with_gap = (evaluate(bodies.drawn(design.make(plate | more)), keep=False) for more in ({}, gap))
    assert with_gap.capacitance == without.capacitance
