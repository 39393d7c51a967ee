"""Are the meshes closed, oriented, apart from one another, and the electrodes apart?"""

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.arrays import Whole
from sensorgen.scene.geometry.meshes import CHORD_MM, Mesh
from sensorgen.scene.scene import AXES, Body, Scene
from sensorgen.scene.sections import overlap, sections

if TYPE_CHECKING:
    import manifold3d

# Where bodies share a face, rounding leaves a film of some 1e-13 mm; a real overlap is far above this.
OVERLAP_MM = 1e-9
_MANY = 10_000  # triangles, from which on taking a mesh apart takes seconds


def faults(scene: Scene, meshes: Mapping[str, Mesh]) -> list[tuple[str, str]]:
    """Bodies, and what is wrong with them; empty when all are valid.

    Parameters
    ----------
    scene : Scene
        For the volumes that the meshes must have.
    meshes : mapping of str to Mesh
        One for each body, by its name.
    """
    broken = [(body.name, fault) for body in scene.bodies if (fault := _fault(body, meshes[body.name]))]
    if broken or _are_apart(scene):
        return broken
    solids = {name: mesh.solid() for name, mesh in meshes.items()}
    return _overlaps(solids, {body.name: _off_mm(body) for body in scene.bodies})


def _fault(body: Body, mesh: Mesh) -> str:
    """Fault of one body; "" if none.

    A solid of many triangles takes a gigabyte: where boxes show that shells are apart, edges tell whether they close.
    """
    import manifold3d

    exact, got, off = body.volume_mm3(), mesh.volume_mm3(), _off_mm(body)
    is_sound = _two_manifold(mesh)
    near = _near(mesh)
    are_apart = is_sound and len(mesh.triangles) > _MANY and not len(near.triangles)
    status = manifold3d.Error.NoError if are_apart else mesh.solid().status()
    if status != manifold3d.Error.NoError:
        return f"not a closed oriented surface ({status.name})"
    if not is_sound:
        return "shells are welded along an edge: programs that read 3MF refuse that"
    area = mesh.area_mm2()
    if abs(got - exact) > 1e-9 * exact + off * area:  # rounding, and chords in place of arcs
        return f"encloses {got:.9g} mm3, not {exact:.9g} mm3"
    if (twice := _self_overlap_mm3(near.solid())) > (OVERLAP_MM + off) * area:
        return f"overlaps itself by {twice:.3g} mm3"
    box = [*mesh.vertices_mm.min(0), *mesh.vertices_mm.max(0)]
    return "" if np.allclose(box, _box_mm(body), rtol=0.0, atol=OVERLAP_MM + off) else "is not where it is drawn"


def _box_mm(body: Body) -> list[float]:
    """Enclosing box: the lowest x, y and z, then the highest [mm]."""
    spans = np.array([[p.span(axis) for axis in AXES] for p in body.pieces])
    return [*spans[..., 0].min(axis=0), *spans[..., 1].max(axis=0)]


def _off_mm(body: Body) -> float:
    """Largest distance of a mesh from the surface [mm]."""
    return CHORD_MM if any(p.is_round() for p in body.pieces) else 0.0


def _are_apart(scene: Scene) -> bool:
    """True where cross-sections show that no bodies overlap; solids take ten times longer to intersect."""
    try:
        sections(scene)
    except ValueError:
        return False
    return overlap(scene) is None


def _two_manifold(mesh: Mesh) -> bool:
    """True where every edge has one triangle on each side; manifold3d takes a seam with four and parts it."""
    there, back = (_keys(way, len(mesh.vertices_mm)) for way in (mesh.triangles, mesh.triangles[:, ::-1]))
    return bool(np.all(np.diff(there) > 0) and np.array_equal(there, back))


def _keys(triangles: NDArray[np.int32], count: int) -> Whole:
    """Number of each directed edge of triangles of ``count`` corners, sorted."""
    keys: Whole = np.empty(3 * len(triangles), np.int64)
    for key, start, end in zip(np.split(keys, 3), (0, 1, 2), (1, 2, 0), strict=True):
        np.multiply(triangles[:, end], count, out=key, dtype=np.int64)
        key += triangles[:, start]
    keys.sort()
    return keys


def _self_overlap_mm3(solid: "manifold3d.Manifold") -> float:
    """Volume that the shells of one body enclose more than once [mm3]."""
    import manifold3d

    shells = solid.decompose()
    united = manifold3d.Manifold.batch_boolean(shells, manifold3d.OpType.Add) if len(shells) > 1 else solid
    return float(solid.volume() - united.volume())


def _near(mesh: Mesh) -> Mesh:
    """Shells whose boxes share more than a face with another's: of others no two overlap."""
    from sensorgen.scene.connections import groups

    label = groups(len(mesh.vertices_mm), *mesh.triangles[:, [0, 1, 1, 2]].reshape(-1, 2).T)
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.diff(label[order], prepend=-1))
    places = mesh.vertices_mm[order]
    low, high = (end.reduceat(places, starts) for end in (np.minimum, np.maximum))
    plans = shapely.box(*low[:, :2].T, *high[:, :2].T)
    one, other = shapely.STRtree(plans).query(plans)
    shared = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
    near = np.isin(label, label[order][starts][one[(shared > OVERLAP_MM).all(1) & (one != other)]])
    triangles = (np.cumsum(near) - 1)[mesh.triangles[near[mesh.triangles[:, 0]]]]
    return Mesh(mesh.vertices_mm[near], triangles.astype(np.int32))


def _overlaps(solids: Mapping[str, "manifold3d.Manifold"], off_mm: Mapping[str, float]) -> list[tuple[str, str]]:
    overlaps = []
    for a, b in combinations(solids, 2):
        one, other = solids[a], solids[b]
        boxes = np.array([one.bounding_box(), other.bounding_box()])
        if (boxes[:, 3:].min(axis=0) - boxes[:, :3].max(axis=0) > OVERLAP_MM).all():  # they share more than a face
            volume = (one ^ other).volume()
            depth = OVERLAP_MM + off_mm[a] + off_mm[b]
            if volume > depth * min(one.surface_area(), other.surface_area()):
                overlaps.append((f"{a} / {b}", f"overlap by {volume:.3g} mm3"))
    return overlaps


def electrode_gap_mm(scene: Scene, meshes: Mapping[str, Mesh]) -> float:
    """Smallest distance between bodies at different terminals, exact; infinite where there are no two [mm]."""
    ends = [(b.terminal, meshes[b.name].solid()) for b in scene.bodies if b.terminal]
    for reach in (scene.size_mm[2], sum(scene.size_mm)):  # of an array a long reach takes a hundred times longer
        gap = min((float(a.min_gap(b, reach)) for (s, a), (t, b) in combinations(ends, 2) if s != t), default=np.inf)
        if gap < reach:
            break
    return gap
