"""Bodies of CAD files: read, taken apart, repaired or refused."""

import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding
from sensorgen.scene.geometry import cad, mesh_files, surfaces
from sensorgen.scene.geometry.mesh_files import FileBody
from sensorgen.scene.geometry.meshes import Mesh, joined

if TYPE_CHECKING:
    import manifold3d

CHORD_MM = 0.01  # from curved faces to the triangles that stand for them
_LEAST_MM, _MOST_MM = (1.0, 1.0, 0.05), 1000.0  # of a sensor's edges, in x, y and z
_MOST_BODIES = 300
_OVERLAP_MM = 1e-6  # mean depth up to which bodies overlap by rounding
_FORMATS = (".step", ".stp", ".3mf", ".stl")


@dataclass(frozen=True)
class ReadBody:
    """A body of a file.

    Attributes
    ----------
    name : str
        Unique, of letters, digits, ".", "-" and "_".
    shells : tuple of Mesh
        Closed surfaces, in the file's coordinates; none where it is refused.
    given : FileBody
        As the file has it.
    repairs : tuple of str
        What was put right.
    """

    name: str
    shells: tuple[Mesh, ...]
    given: FileBody
    repairs: tuple[str, ...] = ()

    @cached_property
    def box_mm(self) -> Real:
        """Lowest and highest corner (2, 3) [mm]."""
        points = self.given.vertices_mm[np.unique(self.given.triangles)]
        return np.asarray([points.min(0), points.max(0)], float)

    def volume_mm3(self) -> float:
        """Enclosed volume [mm3]."""
        return sum(shell.volume_mm3() for shell in self.shells)

    def solid(self) -> "manifold3d.Manifold":
        """All its shells as a solid."""
        return joined(self.shells).solid()


@dataclass(frozen=True)
class Assembly:
    """Bodies of files, before they are mapped.

    Attributes
    ----------
    source : str
        Names of the files.
    bodies : tuple of ReadBody
        All of them.
    findings : tuple of Finding
        Why they cannot be a sensor, and what was repaired.
    """

    source: str
    bodies: tuple[ReadBody, ...]
    findings: tuple[Finding, ...]

    @property
    def errors(self) -> list[Finding]:
        """Findings for which nothing is imported."""
        return [finding for finding in self.findings if finding.severity == "error"]


def read(paths: Sequence[Path], unit: str = "", chord_mm: float = CHORD_MM) -> Assembly:
    """Read bodies from files, repair them, and look what is wrong with them.

    Parameters
    ----------
    paths : sequence of Path
        STEP, 3MF or STL files, in one system of coordinates.
    unit : str
        Of the numbers in STL files, and in place of that of 3MF files.
    chord_mm : float
        How far triangles may lie from the curved faces of a STEP file [mm].

    Raises
    ------
    BadInput
        Not a file of that kind, too large, empty, or of an unknown unit.
    CadFailed
        The CAD process ended.
    """
    given: list[FileBody] = []
    with ExitStack() as stack:
        process = cache(lambda: stack.enter_context(cad.CadProcess()))
        for path in paths:
            given += _file(path, unit, lambda path: process().read_step(path, chord_mm))
    if len(given) > _MOST_BODIES:
        raise BadInput(f"{len(given)} bodies; expected at most {_MOST_BODIES}: join those that one tool prints in CAD")
    names = _names([body.name for body in given])
    findings, bodies = [], []
    for name, raw in zip(names, given, strict=True):
        body, own = _repaired(name, raw)
        bodies.append(body)
        findings += own
    findings += _sizes(bodies, unit)
    if not any(f.severity == "error" for f in findings):
        bodies, own = _apart(bodies)
        findings += own
    source = " ".join(path.name for path in paths)
    return Assembly(source, tuple(bodies), tuple(findings))


def _file(path: Path, unit: str, read_step: Callable[[Path], list[FileBody]]) -> list[FileBody]:
    kind = path.suffix.lower()
    if kind not in _FORMATS:
        raise BadInput(f"{path}: expected a file in {', '.join(_FORMATS)}; export the sensor as STEP")
    mesh_files.check_size(path)
    if kind == ".3mf":
        return mesh_files.read_3mf(path, unit)
    if kind == ".stl":
        if not unit:
            raise BadInput(f"{path}: an STL has no unit; expected --unit mm, cm, m, inch, foot or micron")
        return [part for solid in mesh_files.read_stl(path, unit) for part in _separate(solid)]
    if unit:
        raise BadInput(f"{path}: --unit {unit} beside a STEP file, which states its unit; expected it without --unit")
    return read_step(path)


def _separate(solid: FileBody) -> list[FileBody]:
    """A body for each shell of an STL that lies outside the others; the whole where it is open."""
    shells = surfaces.closed(solid.vertices_mm, solid.triangles, max(solid.rounding_mm, surfaces.WELD_MM)).shells
    if len(shells) < 2 or any(shell.volume_mm3() < 0 for shell in shells):
        return [solid]
    return [
        replace(
            solid, name=f"{solid.name}-{k}", vertices_mm=shell.vertices_mm, triangles=shell.triangles.astype(np.int64)
        )
        for k, shell in enumerate(shells, 1)
    ]


def _names(given: Sequence[str]) -> list[str]:
    """Names that files and slicers can have, each once."""
    names: list[str] = []
    for name in given:
        plain = re.sub("[^A-Za-z0-9._-]+", "_", name).strip("._-")[:60] or "body"
        numbered = (plain, *(f"{plain}-{k}" for k in range(2, len(given) + 2)))
        names.append(next(name for name in numbered if name not in names))
    return names


def _repaired(name: str, raw: FileBody) -> tuple[ReadBody, list[Finding]]:
    """A body with its surfaces closed, and what was repaired or is wrong."""
    surface = surfaces.closed(raw.vertices_mm, raw.triangles, max(raw.rounding_mm, surfaces.WELD_MM))
    findings = [Finding("11-surface", "error", name, f.message, f.advice, place_mm=f.place_mm) for f in surface.faults]
    findings += [Finding("11-repaired", "info", name, text, "look whether this is meant") for text in surface.repairs]
    for shell in surface.shells:
        place = surfaces.crossing(shell)
        if place:
            findings.append(
                Finding("11-crossing", "error", name, "faces pass through each other", "make one solid of it in CAD",
                        place_mm=place)
            )  # fmt: skip
    body = ReadBody(name, surface.shells, raw, surface.repairs)
    if len(surface.shells) > 1 and not any(f.severity == "error" for f in findings):
        united = surfaces.united(surface.shells)
        twice = body.volume_mm3() - sum(shell.volume_mm3() for shell in united)
        if twice > _OVERLAP_MM * float(np.ptp(body.box_mm, axis=0).max()) ** 2:
            body = replace(body, shells=united, given=replace(raw, revolved=None))
            text = f"parts that overlap by {twice:.3g} mm3 joined"
            findings.append(Finding("11-repaired", "info", name, text, "look whether this is meant"))
    return body, findings


def _is_sensor(edges_mm: Real) -> bool:
    return bool((edges_mm >= _LEAST_MM).all() and (edges_mm <= _MOST_MM).all())


def _edges(edges_mm: Real) -> str:
    return " x ".join(f"{edge:.6g}" for edge in edges_mm)


def _likely_units(size_mm: Real, unit: str) -> str:
    """Units, and the sizes in them, with which it is as large as a sensor can be; "" for none."""
    scales = mesh_files.UNITS_MM
    sizes = [(name, size_mm * scale / scales[unit or "mm"]) for name, scale in scales.items()]
    sizes += [("mm", size_mm / scale) for scale in scales.values()] if not unit else []
    likely = {name: _edges(edges) for name, edges in reversed(sizes) if _is_sensor(edges)}
    return " or ".join(f"{name} ({likely[name]} mm)" for name in scales if name in likely)


def _sizes(bodies: Sequence[ReadBody], unit: str) -> list[Finding]:
    """A finding where the sensor is larger or smaller than one can be: its unit, given or the file's own, is wrong."""
    box = np.array([body.box_mm for body in bodies])
    low, high = box[:, 0].min(0), box[:, 1].max(0)
    size = high - low
    if _is_sensor(size):
        return []
    words = _likely_units(size, unit)
    hint = f"its numbers may be in {words}" if words else "no unit makes a sensor of it: look at its dimensions"
    return [
        Finding("11-size", "error", "sensor",
                f"it is {_edges(size)} mm; expected 1 to 1000 mm in x and y, from 0.05 in z",
                f"{hint}: export it in mm, or give --unit for STL and 3MF", place_mm=tuple(low.round(6).tolist()))
    ]  # fmt: skip


def _apart(bodies: Sequence[ReadBody]) -> tuple[list[ReadBody], list[Finding]]:
    """Bodies that do not overlap, and findings where they do; what triangles of curved faces share goes to one."""
    by_name = {body.name: body for body in bodies}
    solids = {body.name: body.solid() for body in bodies}
    findings = []
    for a, b in combinations(by_name, 2):
        one, other = by_name[a], by_name[b]
        if (shared_mm(one.box_mm, other.box_mm) <= 1e-9).any():
            continue
        common = solids[a] ^ solids[b]
        area = common.surface_area()
        depth = 2 * common.volume() / area if area > 0 else 0.0
        rough = 2 * (one.given.chord_mm + other.given.chord_mm) + one.given.rounding_mm + other.given.rounding_mm
        if depth <= 1e-9:
            continue
        place = np.array(common.bounding_box()).reshape(2, 3).mean(0).round(6).tolist()
        at = (place[0], place[1], place[2])
        words = f"overlap by {common.volume():.3g} mm3, {depth:.3g} mm deep"
        if depth > max(rough, _OVERLAP_MM):
            findings.append(
                Finding("11-overlap", "error", f"{a} / {b}", words, "subtract one from the other in CAD: each place "
                        "belongs to one body", value_mm=round(depth, 6), limit_mm=0.0, place_mm=at)
            )  # fmt: skip
            continue
        large, small = sorted((a, b), key=lambda name: -by_name[name].volume_mm3())
        solids[large] = solids[large] - solids[small]
        cut = replace(by_name[large].given, revolved=None)
        by_name[large] = replace(by_name[large], shells=surfaces.shells_of(solids[large]), given=cut)
        text = f"{words}, as the triangles of curved faces do: {small} has it"
        findings.append(Finding("11-repaired", "info", f"{a} / {b}", text, "nothing", place_mm=at))
    return list(by_name.values()), findings


def shared_mm(one: Real, other: Real) -> Real:
    """Sides of what two boxes share; negative where they are apart [mm]."""
    return np.asarray(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]))


def picture(assembly: Assembly) -> str:
    """The places of the errors in three views, as SVG."""
    from sensorgen.scene.drawing import places

    meshes = {b.name: Mesh(b.given.vertices_mm, b.given.triangles.astype(np.int32)) for b in assembly.bodies}
    return places.svg(meshes, [(f.place_mm, f"{f.body}: {f.message}") for f in assembly.errors if f.place_mm])
