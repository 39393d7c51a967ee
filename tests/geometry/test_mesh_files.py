"""STL and 3MF of other programs: units, names, places; and files that want to do harm."""

import struct
import zipfile

import lib3mf
import numpy as np
import pytest
import trimesh

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.scene.geometry import mesh_files

MODEL = "3D/3dmodel.model"
HEAD = (
    '<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
)


def spans(body):
    points = body.vertices_mm[body.triangles.ravel()]
    return points.min(0).tolist(), points.max(0).tolist()


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_stl_has_the_unit_that_it_is_given(tmp_path, kind):
    path = tmp_path / "plate.stl"
    path.write_bytes(_bytes(trimesh.creation.box(bounds=[(0, 0, 0), (30, 10, 0.3)]).export(file_type=kind)))
    (body,) = mesh_files.read_stl(path, "mm")
    assert spans(body) == ([0, 0, 0], [30, 10, 0.3])  # not 0.30000001192
    (body,) = mesh_files.read_stl(path, "inch")
    assert spans(body)[1] == pytest.approx([762, 254, 7.62])
    with pytest.raises(UnknownName, match="did you mean 'mm'"):
        mesh_files.read_stl(path, "mmm")


def _bytes(text):
    return text if isinstance(text, bytes) else text.encode()


def test_stl_of_several_solids_has_their_names(tmp_path):
    path = tmp_path / "both.stl"
    texts = [trimesh.creation.box((k, k, k)).export(file_type="stl_ascii") for k in (1, 2)]
    named = [text.replace("solid", f"solid part {k}", 1).replace("endsolid", "end") for k, text in enumerate(texts)]
    path.write_text("\n".join(named))
    assert [body.name for body in mesh_files.read_stl(path, "mm")] == ["part 0", "part 1"]


def test_3mf_of_lib3mf_keeps_names_units_places_and_colours(tmp_path):
    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.Inch)
    group = model.AddBaseMaterialGroup()
    dark = group.AddMaterial("etpu", wrapper.RGBAToColor(0x20, 0x24, 0x28, 0xFF))
    box = trimesh.creation.box(bounds=[(0, 0, 0), (2, 1, 0.1)])
    mesh = model.AddMeshObject()
    mesh.SetName("lower electrode")
    mesh.SetGeometry(
        [lib3mf.Position(tuple(map(float, v))) for v in box.vertices],
        [lib3mf.Triangle(tuple(map(int, f))) for f in box.faces],
    )
    mesh.SetObjectLevelProperty(group.GetResourceID(), dark)
    parts = model.AddComponentsObject()
    shift = wrapper.GetTranslationTransform(1.0, 0.0, 0.5)
    parts.AddComponent(mesh, shift)
    model.AddBuildItem(parts, wrapper.GetTranslationTransform(0.0, 2.0, 0.0))
    path = tmp_path / "part.3mf"
    model.QueryWriter("3mf").WriteToFile(str(path))
    (body,) = mesh_files.read_3mf(path)
    assert (body.name, body.colour) == ("lower electrode", "#202428")
    low, high = spans(body)
    assert low == pytest.approx([25.4, 50.8, 12.7], rel=1e-6)
    assert high == pytest.approx([76.2, 76.2, 15.24], rel=1e-6)


def package(path, model, name=MODEL):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, model)
    return path


TRIANGLE = (
    '<resources><object id="1" type="model"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>'
    '<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="{}"/></triangles></mesh></object>'
    '</resources><build><item objectid="{}"/></build></model>'
)


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (HEAD + TRIANGLE.format(7, 1), "a triangle of a vertex that it does not have"),
        (HEAD + TRIANGLE.format(2, 9), "object 9 is built, but not there"),
        (HEAD + "<resources/><build/></model>", "it builds nothing"),
        (HEAD.replace(">", '><!DOCTYPE m [<!ENTITY a "aaaa">]>', 1) + TRIANGLE.format(2, 1), "document type"),
        (HEAD + "<vertex", "not a 3MF"),
        (HEAD + TRIANGLE.format(2, 1).replace('x="0"', 'x="zero"', 1), "not a 3MF"),
        (HEAD.replace("millimeter", "parsec") + TRIANGLE.format(2, 1), "unknown unit 'parsec'"),
        (HEAD + '<resources><object id="1"><components><component objectid="1"/></components></object></resources>'
         '<build><item objectid="1"/></build></model>', "one that holds itself"),
    ],
)  # fmt: skip
def test_3mf_that_is_not_in_order_is_refused(tmp_path, model, message):
    with pytest.raises((BadInput, UnknownName), match=message):
        mesh_files.read_3mf(package(tmp_path / "a.3mf", model))


def test_a_zip_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_files, "MOST_UNPACKED", 10_000_000)
    path = package(tmp_path / "bomb.3mf", HEAD + " " * 20_000_000)
    assert path.stat().st_size < 100_000
    with pytest.raises(BadInput, match="unpacks to 20 MB; expected at most 10 MB"):
        mesh_files.read_3mf(path)
    data = bytearray(path.read_bytes())  # a bomb that lies about its size
    at = data.rfind(b"PK\x01\x02")
    struct.pack_into("<I", data, at + 24, 1000)
    struct.pack_into("<I", data, 22, 1000)
    path.write_bytes(data)
    with pytest.raises(BadInput):
        mesh_files.read_3mf(path)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", bytes(84), b"solid a\nvertex 1 2"])
def test_files_that_are_none_are_refused(tmp_path, data):
    for name, read in (("a.3mf", mesh_files.read_3mf), ("a.stl", lambda path: mesh_files.read_stl(path, "mm"))):
        path = tmp_path / name
        path.write_bytes(data)
        with pytest.raises(BadInput, match=r"a\.(3mf|stl)"):
            read(path)


def test_too_large_files_are_refused_before_they_are_read(tmp_path):
    path = tmp_path / "huge.stl"
    with path.open("wb") as file:
        file.truncate(500_000_000)  # takes no room on the disk
    with pytest.raises(BadInput, match="500 MB; expected at most 100 MB"):
        mesh_files.read_stl(path, "mm")
    many = tmp_path / "many.stl"
    many.write_bytes(bytes(80) + struct.pack("<I", 600_000) + bytes(50 * 600_000))
    with pytest.raises(BadInput, match="600000 triangles; expected at most 500000"):
        mesh_files.read_stl(many, "mm")
    assert np.isfinite(mesh_files.MOST_BYTES)
