"""Three families of 3MF: what lib3mf reads back, what each slicer's reader relies on, and what is refused."""

import io
import os
import pickle
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from itertools import chain
from pathlib import Path

import lib3mf
import numpy as np
import pytest

from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName
from sensorgen.export.threemf import FAMILIES, Part, content, core
from sensorgen.scene import scene
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import Body

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
HOSTILE = "top \"of\" 'it' <film> & Größe µ € 😀 %s %d {x}"
TITLE = 'tri <d = 0.2> & "more"'


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    """A closed box between two corners [mm]."""
    return mesh(Body("", "", (scene.box(*map(float, chain.from_iterable(zip(low, high, strict=True)))),)))


def parts() -> list[Part]:
    """Three bodies that touch, of two materials, the last name first."""
    third = 1 / 3
    return [
        Part(HOSTILE, "PI-eTPU 85-700+", "#202428", 2, box((0, 0, 1 + third), (20, 10, 2)), {"perimeters": "3"}),
        Part("film", 'X60 "ultra" & <soft>', "#f0e6d2", 3, box((0, 0, 1), (20, 10, 1 + third))),
        Part("bottom", "PI-eTPU 85-700+", "#202428", 2, box((0, 0, 0), (20, 10, 1)), {"fill_density": "80%"}),
    ]


def unzipped(packed: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def model(packed: bytes) -> ET.Element:
    return ET.fromstring(unzipped(packed)["3D/3dmodel.model"])


def read_back(packed: bytes):  # lib3mf ships no types
    """The model as lib3mf reads it, strictly, and its warnings."""
    read = lib3mf.get_wrapper().CreateModel()
    reader = read.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromBuffer(packed)
    return read, [reader.GetWarning(i) for i in range(reader.GetWarningCount())]


def every(iterator, current: str):
    while iterator.MoveNext():
        yield getattr(iterator, current)()


def volume_mm3(read_mesh) -> float:
    corners = [list(v.Coordinates) for v in read_mesh.GetVertices()]
    triangles = [list(t.Indices) for t in read_mesh.GetTriangleIndices()]
    return Mesh(np.array(corners, dtype=float), np.array(triangles, dtype=np.int32)).volume_mm3()


@pytest.fixture(scope="module")
def from_another_process():
    code = (
        "import pickle, sys; sys.path.insert(0, sys.argv[1]); from test_threemf import *;"
        "pickle.dump({of: content(of, TITLE, parts(), (1.5, -2.0)) for of in FAMILIES}, sys.stdout.buffer)"
    )
    words = [sys.executable, "-c", code, str(Path(__file__).parent)]
    run = subprocess.run(words, capture_output=True, check=True, env=os.environ | {"PYTHONHASHSEED": "7"})
    return pickle.loads(run.stdout)


@pytest.mark.parametrize("family", FAMILIES)
class TestEveryFamily:
    def test_same_bytes_in_any_order_and_in_another_process(self, family, from_another_process):
        """Another hash seed, clock and process: nothing of these may be in the file."""
        once = content(family, TITLE, parts(), (1.5, -2.0))
        assert content(family, TITLE, parts()[::-1], (1.5, -2.0)) == once == from_another_process[family]

    def test_no_clock_and_no_system_in_the_zip(self, family):
        with zipfile.ZipFile(io.BytesIO(content(family, TITLE, parts(), (0, 0)))) as archive:
            assert archive.testzip() is None
            assert archive.namelist()[0] == "[Content_Types].xml"
            assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
            assert {entry.create_system for entry in archive.infolist()} == {3}

    def test_lib3mf_reads_names_materials_and_volume(self, family):
        read, warnings = read_back(content(family, TITLE, parts(), (0, 0)))
        assert warnings == []
        meshes = list(every(read.GetMeshObjects(), "GetCurrentMeshObject"))
        assert all(m.IsValid() and m.IsManifoldAndOriented() for m in meshes)
        expected = [TITLE] if family == "prusa" else [p.name for p in sorted(parts(), key=lambda p: p.name)]
        assert [m.GetName() for m in meshes] == expected
        assert sum(m.GetTriangleCount() for m in meshes) == 36
        assert sum(m.GetVertexCount() for m in meshes) == 24  # nothing welded
        assert sum(volume_mm3(m) for m in meshes) == pytest.approx(400.0, rel=1e-6)
        (group,) = every(read.GetBaseMaterialGroups(), "GetCurrentBaseMaterialGroup")
        colours = [group.GetDisplayColor(i) for i in group.GetAllPropertyIDs()]
        assert [group.GetName(i) for i in group.GetAllPropertyIDs()] == ["PI-eTPU 85-700+", 'X60 "ultra" & <soft>']
        assert [(c.Red, c.Green, c.Blue) for c in colours] == [(0x20, 0x24, 0x28), (0xF0, 0xE6, 0xD2)]

    def test_lib3mf_gives_every_triangle_its_material(self, family):
        read, _ = read_back(content(family, TITLE, parts(), (0, 0)))
        (group,) = every(read.GetBaseMaterialGroups(), "GetCurrentBaseMaterialGroup")
        for one in every(read.GetMeshObjects(), "GetCurrentMeshObject"):
            heights = [v.Coordinates[2] for v in one.GetVertices()]
            for i in range(one.GetTriangleCount()):
                middle = np.mean([heights[k] for k in one.GetTriangle(i).Indices])
                own = one.GetTriangleProperties(i)
                name = group.GetName(own.PropertyIDs[0])
                flat = len({heights[k] for k in one.GetTriangle(i).Indices}) == 1
                if not flat:  # a flat one may be the floor of one body or the roof of another
                    assert name.startswith("X60") == (1 < middle < 4 / 3)

    def test_the_middle_stands_where_it_was_asked_to(self, family):
        moved = [replace(p, mesh=Mesh(p.mesh.vertices_mm + np.array([5, 6, 7]), p.mesh.triangles)) for p in parts()]
        read, _ = read_back(content(family, TITLE, moved, (195.25, -85.5)))
        (item,) = every(read.GetBuildItems(), "GetCurrent")
        where = np.array([list(row) for row in item.GetObjectTransform().Fields])
        assert where[:3].tolist() == np.eye(3).tolist()
        meshes = every(read.GetMeshObjects(), "GetCurrentMeshObject")
        corners = [list(v.Coordinates) for m in meshes for v in m.GetVertices()]
        low, high = np.min(corners, axis=0) + where[3], np.max(corners, axis=0) + where[3]
        assert (low + high)[:2] / 2 == pytest.approx([195.25, -85.5], abs=1e-4)
        assert low[2] == pytest.approx(0, abs=1e-6)

    def test_hostile_names_leave_every_file_well_formed(self, family):
        files = unzipped(content(family, TITLE, parts(), (0, 0)))
        for text in files.values():
            ET.fromstring(text)
        root = ET.fromstring(files["3D/3dmodel.model"])
        assert root.get("unit") == "millimeter"
        assert {m.get("name"): m.text for m in root.findall(f"{CORE}metadata")}["Title"] == TITLE

    def test_coordinates_are_finer_than_float32(self, family):
        mesh = box((0, 0, 0), (1, 1, 1))
        mesh = Mesh(mesh.vertices_mm * 99 + np.random.default_rng(4).random((8, 3)), mesh.triangles)
        root = model(content(family, "t", [Part("a", "m", "#000000", 0, mesh), parts()[0]], (0, 0)))
        read = np.array([[float(v.get(c)) for c in "xyz"] for v in root.iter(f"{CORE}vertex")][:8])
        assert (np.abs(read - mesh.vertices_mm) < np.spacing(np.abs(mesh.vertices_mm).astype(np.float32)) / 10).all()

    def test_short_numbers_and_no_negative_zero(self, family):
        noisy = box((-1e-17, 0.1 + 0.2, -0.0), (1, 2, 3))
        text = unzipped(content(family, "t", [Part("a", "m", "#000000", 0, noisy), parts()[0]], (0, 0)))
        assert b'<vertex x="0" y="0.3" z="0"/>' in text["3D/3dmodel.model"]


def test_more_rows_than_are_written_at_once(monkeypatch):
    monkeypatch.setattr(core, "_ROWS", 1 << 10)
    mesh, copies = box((0, 0, 0), (1, 1, 1)), 300  # 3600 triangles, over three chunks
    offsets = (8 * np.arange(copies, dtype=np.int32)).repeat(12)[:, None]
    far = np.repeat(np.arange(copies), 8)[:, None] * [2.0, 0, 0]
    many = Mesh(np.tile(mesh.vertices_mm, (copies, 1)) + far, np.tile(mesh.triangles, (copies, 1)) + offsets)
    read, warnings = read_back(content("cura", "t", [Part("a", "m", "#000000", 0, many)], (0, 0)))
    (one,) = every(read.GetMeshObjects(), "GetCurrentMeshObject")
    assert (warnings, one.GetTriangleCount()) == ([], 12 * copies)
    assert volume_mm3(one) == pytest.approx(copies, rel=1e-6)


def broken(**changes) -> list[Part]:
    return [replace(parts()[0], **changes), parts()[1]]


def spoilt(value: float) -> Mesh:
    vertices = box((0, 0, 0), (1, 1, 1)).vertices_mm.copy()
    vertices[3, 1] = value
    return Mesh(vertices, box((0, 0, 0), (1, 1, 1)).triangles)


@pytest.mark.parametrize(
    ("bodies", "error", "words"),
    [
        ([], BadInput, "no bodies"),
        (broken(mesh=Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32))), BadInput, "no triangles"),
        (broken(mesh=spoilt(float("nan"))), OutOfRange, "not finite"),
        (broken(mesh=Mesh(np.zeros((3, 3)), np.array([[0, 1, 3]], np.int32))), BadInput, "a vertex that it lacks"),
        (broken(mesh=Mesh(np.zeros((3, 3)), np.array([[0, 1, -1]], np.int32))), BadInput, "a vertex that it lacks"),
        (broken(mesh=Mesh(np.zeros((3, 3)), np.array([[0, 1, 1]], np.int32))), BadInput, "one corner twice"),
        (broken(extruder=-1), OutOfRange, "below 0"),
        (broken(colour="red"), BadInput, "#rrggbb"),
        (broken(name="a\x00b"), BadInput, "cannot hold"),
        (broken(material="\ud800"), BadInput, "cannot hold"),
        (broken(settings={"a": "\x0b"}), BadInput, "cannot hold"),
        (broken(name="film"), BadInput, "two bodies"),
    ],
)
def test_what_is_refused(bodies, error, words):
    with pytest.raises(error, match=words):
        content("cura", "t", bodies, (0, 0))


def test_more_that_is_refused():
    with pytest.raises(UnknownName, match="did you mean 'prusa'"):
        content("prusia", "t", parts(), (0, 0))
    with pytest.raises(OutOfRange, match="not finite"):
        content("orca", "t", parts(), (0, float("nan")))
    with pytest.raises(SensorgenError, match="title"):
        content("orca", "\x01", parts(), (0, 0))


def test_prusa_config_divides_the_triangles():
    # prusa3d/PrusaSlicer, src/libslic3r/Format/3mf.cpp: volumes are triangle ranges, firstid to lastid
    # inclusive, of the object with the same id; "extruder" counts from 1.
    packed = content("prusa", TITLE, parts(), (0, 0))
    root, config = model(packed), ET.fromstring(unzipped(packed)["Metadata/Slic3r_PE_model.config"])
    (one,) = root.iter(f"{CORE}object")
    (settings,) = config.findall("object")
    assert settings.get("id") == one.get("id") == root.find(f"{CORE}build/{CORE}item").get("objectid")
    volumes = settings.findall("volume")
    assert [(v.get("firstid"), v.get("lastid")) for v in volumes] == [("0", "11"), ("12", "23"), ("24", "35")]
    found = [{m.get("key"): m.get("value") for m in v} for v in volumes]
    assert [f["name"] for f in found] == ["bottom", "film", HOSTILE]
    assert [f["extruder"] for f in found] == ["3", "4", "3"]
    assert (found[0]["fill_density"], found[2]["perimeters"]) == ("80%", "3")
    assert {m.get("name"): m.text for m in root.findall(f"{CORE}metadata")}["slic3rpe:Version3mf"] == "1"


def test_prusa_settings_cannot_choose_the_tool():
    packed = content("prusa", "t", [replace(parts()[1], settings={"extruder": "1"})], (0, 0))
    assert unzipped(packed)["Metadata/Slic3r_PE_model.config"].count(b'key="extruder" value="4"') == 1


def test_cura_metadata_as_its_reader_takes_it():
    # Ultimaker/libSavitar, SceneNode.cpp and Scene.cpp: an object's <metadatagroup>, whose names begin with
    # the prefix bound to Cura's namespace; children by <component>, found by id among the resources.
    # Ultimaker/Cura, ThreeMFReader.py: int(extruder_nr), from 0; other keys are settings of the node.
    text = unzipped(content("cura", TITLE, parts(), (195, 85)))["3D/3dmodel.model"]
    assert b'xmlns:cura="http://software.ultimaker.com/xml/cura/3mf/2015/10"' in text
    root = ET.fromstring(text)
    objects = {o.get("id"): o for o in root.iter(f"{CORE}object")}
    group = objects[root.find(f"{CORE}build/{CORE}item").get("objectid")]
    children = [objects[c.get("objectid")] for c in group.iter(f"{CORE}component")]
    assert [c.get("name") for c in children] == ["bottom", "film", HOSTILE]
    found = [{m.get("name"): m.text for m in c.iter(f"{CORE}metadata")} for c in children]
    assert found[0] == {"cura:extruder_nr": "2", "cura:infill_sparse_density": "80"}
    assert found[1] == {"cura:extruder_nr": "3"}
    assert found[2] == {"cura:extruder_nr": "2", "cura:wall_line_count": "3"}
    assert list(objects).index(group.get("id")) == 3  # the core spec: an object stands before its use


def test_cura_gets_a_lone_body_about_the_origin():
    # ThreeMFReader.py, _read: a mesh without group is shifted by the middle of its own box.
    root = model(content("cura", "t", [parts()[0]], (195, 85)))
    (one,) = root.iter(f"{CORE}object")
    corners = np.array([[float(v.get(c)) for c in "xyz"] for v in one.iter(f"{CORE}vertex")])
    assert corners.min(axis=0) + corners.max(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    where = [float(w) for w in root.find(f"{CORE}build/{CORE}item").get("transform").split()[9:]]
    assert where == pytest.approx([195, 85, 1 / 3])
    assert one.find(f"{CORE}metadatagroup/{CORE}metadata").text == "2"


def test_orca_parts_as_its_reader_takes_them():
    # SoftFever/OrcaSlicer, src/libslic3r/Format/bbs_3mf.cpp: _handle_start_config_object and _volume (ids of
    # the built object and of its components' objects, subtype), _generate_volumes_new (part by that id; name;
    # any other key is set as the part's option), and _load_model_from_file (extruder from 1; of a single
    # part it is erased, so that the object's counts).
    packed = content("orca", TITLE, parts(), (0, 0))
    root, config = model(packed), ET.fromstring(unzipped(packed)["Metadata/model_settings.config"])
    objects = {o.get("id"): o for o in root.iter(f"{CORE}object")}
    (settings,) = config.findall("object")
    assert settings.get("id") == root.find(f"{CORE}build/{CORE}item").get("objectid")
    components = [c.get("objectid") for c in objects[settings.get("id")].iter(f"{CORE}component")]
    found = {p.get("id"): {m.get("key"): m.get("value") for m in p} for p in settings.findall("part")}
    assert list(found) == components
    assert [objects[i].get("name") for i in found] == [f["name"] for f in found.values()] == ["bottom", "film", HOSTILE]
    assert [f["extruder"] for f in found.values()] == ["3", "4", "3"]
    assert {p.get("subtype") for p in settings.findall("part")} == {"normal_part"}
    own = {m.get("key"): m.get("value") for m in settings.findall("metadata")}
    assert own == {"name": TITLE, "extruder": "3"}
    assert {m.get("name"): m.text for m in root.findall(f"{CORE}metadata")}["BambuStudio:3mfVersion"] == "1"


def test_orca_start_part_is_found_by_its_relationship():
    # bbs_3mf.cpp, _handle_start_relationship: the type must begin and end like this.
    (start,) = ET.fromstring(unzipped(content("orca", "t", parts(), (0, 0)))["_rels/.rels"])
    assert start.get("Type").startswith("http://schemas.microsoft.com/3dmanufacturing/")
    assert start.get("Type").endswith("3dmodel")
    assert start.get("Target") == "/3D/3dmodel.model"
