"""The printed body of a design as a file for other programs."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sensorgen.asprinted.printed import Printed
from sensorgen.core import files as store
from sensorgen.core.errors import BadInput
from sensorgen.export.layered import closed
from sensorgen.scene.geometry.meshes import Mesh

KINDS = (".3mf", ".stl", ".vtu", ".step")


def export(printed: Printed, path: Path, voxel_mm: float | None = None) -> list[Path]:
    """Write a printed body, in the way that the end of a file's name says.

    Parameters
    ----------
    printed : Printed
        The print.
    path : Path
        ``.3mf`` and ``.step``: each body closed, with name and material. ``.stl``: all bodies as one, beside it a file
        for each material. ``.vtu``: voxels with body, material, terminal and permittivity.
    voxel_mm : float, optional
        Longest side of a voxel; half a layer if not given [mm].

    Returns
    -------
    list of Path
        Files that were written.

    Raises
    ------
    BadInput
        Another end.
    OutOfRange
        Too many voxels.
    MissingValue
        VTU without meshio, or a dielectric without a permittivity.
    CadFailed
        STEP that the CAD kernel cannot make.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise BadInput(f"--output {path}: expected a name in {', '.join(KINDS)}")
    if kind == ".stl":
        files = _stl(printed, path)
    else:
        files = {
            path: _step(printed) if kind == ".step" else _3mf(printed) if kind == ".3mf" else _vtu(printed, voxel_mm)
        }
    for file, content in files.items():
        store.replace(file, content)
    return [*files]


def _closed(printed: Printed, groups: Mapping[str, Sequence[str]]) -> dict[str, Mesh]:
    """Closed surfaces of groups of bodies; groups of which nothing is printed are left out."""
    meshes = {name: closed(printed.first, bodies) for name, bodies in groups.items()}
    return {name: mesh for name, mesh in meshes.items() if len(mesh.triangles)}


def _stl(printed: Printed, path: Path) -> dict[Path, bytes]:
    from sensorgen.export.slicers import run

    bodies = printed.design.printed.bodies
    groups = {"": [body.name for body in bodies]}
    groups |= {f"-{m}": [body.name for body in bodies if body.material == m] for m in {b.material for b in bodies}}
    meshes = _closed(printed, groups)
    return {path.with_stem(path.stem + name): run.content(meshes[name], np.zeros(3)) for name in sorted(meshes)}


def _3mf(printed: Printed) -> bytes:
    from sensorgen.export import threemf
    from sensorgen.export.threemf.core import part_of

    design = printed.design
    material = {body.name: body.material for body in design.printed.bodies}
    meshes = _closed(printed, {name: [name] for name in material})
    parts = [part_of(design, name, material[name], mesh) for name, mesh in meshes.items()]
    return threemf.content("orca", design.name, parts, design.machine.bed_centre_mm())


def _vtu(printed: Printed, voxel_mm: float | None) -> bytes:
    from sensorgen.design.values import permittivities
    from sensorgen.export import layered
    from sensorgen.export.layered import voxels

    design, bodies = printed.design, printed.design.printed.bodies
    known = {value.material: value.value for value in permittivities(design)}
    pitch_mm = design.layers.layer_mm / 2 if voxel_mm is None else voxel_mm
    grid = voxels(printed.first, [body.name for body in bodies], design.printed.size_mm, pitch_mm)
    return layered.content(grid, bodies, known)


def _step(printed: Printed) -> bytes:
    from sensorgen.scene.geometry.cad import CadProcess

    scene, design = printed.scene, printed.design
    full = tuple(body for body in scene.bodies if body.pieces)
    colours = {body.name: design.material(body.material).colour for body in full}
    with tempfile.TemporaryDirectory() as folder, CadProcess() as cad:
        path = Path(folder) / "body.step"
        cad.write_step(replace(scene, bodies=full), colours, design.name, path)
        return path.read_bytes()
