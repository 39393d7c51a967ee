"""The printed body for other programs: closed by lib3mf and trimesh, voxels by PyVista and scikit-fem."""

import numpy as np
import pytest
import shapely
import trimesh
from click.testing import CliRunner
from scipy.sparse.linalg import LinearOperator, cg

from sensorgen.asprinted.printed import body
from sensorgen.cli import cli
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import make
from sensorgen.export.layered import closed, voxels
from sensorgen.models import fem2d
from sensorgen.prediction.bodies import estimated
from sensorgen.scene.layers import LayerRegions
from sensorgen.workflows.export import export

EPS0 = 8.8541878128e-12
TRI = {"shape": "tri", "parameters": {"length_mm": 6.0, "width_mm": 4.0, "dielectric_mm": 0.2}}
CONE = {"shape": "cone", "parameters": {"length_mm": 2.5, "width_mm": 2.5}}


@pytest.fixture(scope="module")
def prints():
    return {name: body(make(data)) for name, data in {"tri": TRI, "cone": CONE}.items()}


def areas(printed):
    """Volume of each body by its layers [mm3]."""
    names = [b.name for b in printed.design.printed.bodies]
    return {n: sum(k.region(n).area * k.height_mm for k in printed.first) for n in names}


@pytest.mark.parametrize("shape", ["tri", "cone"])
def test_lib3mf_reads_closed_bodies_with_materials(prints, shape, tmp_path):
    lib3mf = pytest.importorskip("lib3mf")
    printed = prints[shape]
    (path,) = export(printed, tmp_path / "body.3mf")
    model = lib3mf.Wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    objects, found = model.GetMeshObjects(), {}
    while objects.MoveNext():
        mesh = objects.GetCurrentMeshObject()
        assert mesh.IsManifoldAndOriented()
        points = np.array([list(v.Coordinates) for v in mesh.GetVertices()])
        corners = np.array([list(t.Indices) for t in mesh.GetTriangleIndices()])
        other = trimesh.Trimesh(points, corners, process=False)
        assert other.is_watertight
        found[mesh.GetName()] = other.volume
    assert found == {name: pytest.approx(volume, rel=1e-3) for name, volume in areas(printed).items()}
    materials = model.GetBaseMaterialGroups()
    assert materials.MoveNext()
    assert materials.GetCurrentBaseMaterialGroup().GetCount() == 2


@pytest.mark.parametrize("shape", ["tri", "cone"])
def test_stl_is_closed_as_a_whole_and_by_material(prints, shape, tmp_path):
    printed = prints[shape]
    files = export(printed, tmp_path / "body.stl")
    assert [file.name for file in files] == ["body.stl", "body-etpu.stl", "body-x60.stl"]
    whole, *materials = (trimesh.load(file) for file in files)
    assert all(each.is_watertight for each in (whole, *materials))
    assert whole.volume == pytest.approx(sum(areas(printed).values()), rel=1e-3)
    assert sum(each.volume for each in materials) == pytest.approx(whole.volume, rel=1e-3)
    assert whole.bounds == pytest.approx(np.array([[0, 0, 0], printed.design.printed.size_mm]), abs=2e-3)


def capacitance(path):
    """Capacitance of the file's voxels by scikit-fem, with nothing but what is in the file [F]."""
    meshio, skfem = pytest.importorskip("meshio"), pytest.importorskip("skfem")
    from skfem.helpers import dot, grad
    from skfem.io.meshio import from_meshio

    read = meshio.read(path)
    data = {name: values[0] for name, values in read.cell_data.items()}
    read.points *= 1e-3
    mesh = from_meshio(read)
    basis = skfem.Basis(mesh, skfem.ElementHex1())
    nodes = [np.unique(basis.element_dofs[:, data["terminal"] == end]) for end in (1, 2)]
    piecewise = basis.with_element(skfem.ElementHex0())
    eps = np.zeros(piecewise.N)
    eps[piecewise.element_dofs[0]] = np.nan_to_num(data["relative_permittivity"], nan=1.0)

    @skfem.BilinearForm
    def energy(u, v, w):
        return w["eps"] * dot(grad(u), grad(v))

    matrix = energy.assemble(basis, eps=piecewise.interpolate(eps))
    u = basis.zeros()
    u[nodes[1]] = 1.0
    free = np.setdiff1d(np.arange(len(u)), np.concatenate(nodes))
    inner = matrix[free][:, free]
    diagonal = inner.diagonal()
    found, failed = cg(inner, -(matrix @ u)[free], rtol=1e-8, M=LinearOperator(inner.shape, lambda v: v / diagonal))
    assert not failed
    u[free] = found
    return EPS0 * float(u @ (matrix @ u))


def test_voxels_carry_the_capacitance_of_the_print(prints, tmp_path):
    """Linear elements lie above the exact value, 2.8 % here, 1.8 % with half the pitch; the cell's is certified."""
    pytest.importorskip("meshio")
    printed = prints["tri"]
    (path,) = export(printed, tmp_path / "body.vtu")
    cells = estimated(printed.design, "arachne").cells
    ours = fem2d.capacitance(cells.first(), {"x60": 4.68, "air": 1.00059}, 1e-3).middle() * cells.count
    assert capacitance(path) == pytest.approx(ours, rel=0.03)


def test_pyvista_reads_the_volumes_of_the_bodies(prints, tmp_path):
    pytest.importorskip("meshio")
    pyvista = pytest.importorskip("pyvista")
    printed = prints["tri"]
    (path,) = export(printed, tmp_path / "body.vtu")
    grid = pyvista.read(path)
    assert grid.bounds == pytest.approx([v for size in printed.design.printed.size_mm for v in (0.0, size)], abs=1e-6)
    sizes = grid.compute_cell_sizes()["Volume"]
    assert sizes.min() > 0
    for number, (name, volume) in enumerate(areas(printed).items(), 1):
        assert sizes[grid["body"] == number].sum() == pytest.approx(volume, rel=1e-3), name
    etpu = [b.material == "etpu" for b in printed.design.printed.bodies]
    assert (grid["material"] == 1).sum() == sum((grid["body"] == n).sum() for n, e in enumerate(etpu, 1) if e)


def test_round_bodies_are_squares_of_the_pitch(prints):
    printed = prints["cone"]
    names = [b.name for b in printed.design.printed.bodies]
    made = voxels(printed.first, names, printed.design.printed.size_mm, 0.05)
    assert made.body.shape == (50, 50, 24)
    for number, (name, volume) in enumerate(areas(printed).items()):
        assert (made.body == number).sum() * 0.05**3 == pytest.approx(volume, rel=0.02), name


def test_a_hole_stays_open_and_an_absent_body_is_empty():
    ring = shapely.box(0, 0, 3, 3).difference(shapely.box(1, 1, 2, 2))
    layers = [LayerRegions(0.0, 0.1, {"a": ring}), LayerRegions(0.1, 0.2, {"a": shapely.box(0, 0, 3, 3)})]
    made = closed(layers, ["a"])
    assert made.volume_mm3() == pytest.approx(0.8 + 0.9)
    assert trimesh.Trimesh(made.vertices_mm, made.triangles).euler_number == 2  # a pot
    assert len(closed(layers, ["b"]).triangles) == 0


def test_what_is_refused(prints, tmp_path):
    wrong = (("body.obj", BadInput, r"expected a name in \.3mf"), ("body", BadInput, "expected a name"))
    for name, error, message in wrong:
        with pytest.raises(error, match=message):
            export(prints["tri"], tmp_path / name)
    for pitch, message in ((0.0, "above 0"), (0.001, r"million; expected at most 4 million: take --voxel 0\.0")):
        with pytest.raises(OutOfRange, match=message):
            export(prints["cone"], tmp_path / "body.vtu", pitch)
    assert not list(tmp_path.iterdir())


def test_the_command_names_its_source_and_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli, ["export", "tri", "--length", "6", "--width", "4", "--printed", "-o", "body.3mf"])
    assert done.exit_code == 0, done.output
    assert done.output == "printed, estimated (PrusaSlicer, Arachne walls)\nbody.3mf\n"
