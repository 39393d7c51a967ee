"""Sensors from other CAD programs: read, repaired or refused, mapped to materials, written as a design."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache, cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import yaml

from sensorgen.core import files
from sensorgen.core.arrays import Real
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.errors import BadInput, MissingValue, SensorgenError, UnknownName
from sensorgen.core.findings import Finding, listed
from sensorgen.design import design as designs
from sensorgen.design import imported, packs
from sensorgen.prediction.bodies import drawn as drawn_body
from sensorgen.scene.geometry import cad, mesh_files, surfaces
from sensorgen.scene.geometry.mesh_files import FileBody
from sensorgen.scene.geometry.meshes import Mesh
from sensorgen.scene.scene import Piece

if TYPE_CHECKING:
    import manifold3d

CHORD_MM = 0.01  # from curved faces to the triangles that stand for them
_LEAST_MM, _MOST_MM = (1.0, 1.0, 0.05), 1000.0  # of a sensor's edges, in x, y and z
_MOST_BODIES = 300
_CONTACT_MM = 1e-4  # conductors nearer than this are one electrode
_OVERLAP_MM = 1e-6  # mean depth up to which bodies overlap by rounding
_BY_HEIGHT = ("bottom", "middle", "top")
_FORMATS = (".step", ".stp", ".3mf", ".stl")
_MATERIAL = re.compile(r"(?P<material>[^@]+?)(?:@(?P<source>[^@]*[^@0-9][^@]*))?(?:@(?P<tool>[0-9]+))?")
_ROLES = (("support", "bvoh"), ("electrode", "etpu"), ("conduct", "etpu"), ("dielectric", "x60"), ("film", "x60"))


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
        return surfaces.solid(self.shells)


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


@dataclass(frozen=True)
class ListedBody:
    """A body of a file, as ``--list`` shows it."""

    name: Annotated[str, Column("body")]
    volume_mm3: Annotated[float, Column("volume", "mm3")]
    x_mm: Annotated[str, Column("x", "mm", right=True)]
    y_mm: Annotated[str, Column("y", "mm", right=True)]
    z_mm: Annotated[str, Column("z", "mm", right=True)]
    colour: Annotated[str, Column("colour")]
    faces: Annotated[str, Column("faces")]
    material: Annotated[str, Column("material")]


@dataclass(frozen=True)
class Listing:
    """Bodies of files, what was repaired or is wrong, and a map to start from.

    Attributes
    ----------
    source : str
        Names of the files.
    bodies : tuple of ListedBody
        All of them, with a suggested material; "?" where nothing suggests one.
    findings : tuple of Finding
        As of :class:`Assembly`.
    """

    source: str
    bodies: tuple[ListedBody, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, assembly: Assembly, folder: Path) -> "Listing":
        """The listing of an assembly, with materials that ship, are beside a folder, or the user's."""
        rows = []
        for body in assembly.bodies:
            x, y, z = (f"{low:g} to {high:g}" for low, high in (body.box_mm.round(6) + 0.0).T.tolist())
            chord = body.given.chord_mm
            faces = f"curved, met to {chord:g} mm" if chord else "flat"
            material = _suggested(body.name, body.given.colour, folder) or "?"
            rows.append(ListedBody(body.name, body.volume_mm3(), x, y, z, body.given.colour, faces, material))
        return cls(assembly.source, tuple(rows), assembly.findings)

    def document(self) -> Iterator[Part]:
        """All of it."""
        yield Table.of("bodies", "", self.bodies)
        if self.findings:
            yield ""
            yield from listed(self.findings)
        yield ""
        yield f"To import it: {self.words()}"

    def words(self) -> str:
        """What to type to import it."""
        maps = " ".join(f"--map {body.name}={body.material.replace('?', 'MATERIAL')}" for body in self.bodies)
        return f"sensorgen import {self.source} {maps}"


@dataclass(frozen=True)
class Imported:
    """A sensor that was imported.

    Attributes
    ----------
    design : str
        Name of the design file.
    geometry : str
        Name of the file of its bodies.
    size_mm : (float, float, float)
        Edges of the box around it.
    moved_mm : (float, float, float)
        What its coordinates were moved by, so that its corner is the origin.
    bodies : mapping of str to str
        Of each body, material, terminal, tool and pieces, in words.
    findings : tuple of Finding
        Electrodes that touch, and what was put right.
    models : mapping of str to str
        Of each model of capacitance, "" where it applies to the sensor as drawn, or why not.
    """

    design: str
    geometry: str
    size_mm: tuple[float, float, float]
    moved_mm: tuple[float, float, float]
    bodies: Mapping[str, str]
    findings: tuple[Finding, ...] = ()
    models: Mapping[str, str] = field(default_factory=dict)

    def document(self) -> Iterator[Part]:
        """What was written, and what applies to it."""
        size = " x ".join(f"{edge:g}" for edge in self.size_mm)
        moved = ", ".join(f"{way:g}" for way in self.moved_mm)
        able = [name for name, reason in self.models.items() if not reason]
        reasons = "; ".join(f"{name}: {reason}" for name, reason in self.models.items() if reason)
        as_drawn = ", ".join(able) or f"no model applies, only as printed ({reasons})"
        rows = [
            ("size", f"{size} mm" + (f"; moved by {moved} mm, its corner to 0, 0, 0" if any(self.moved_mm) else "")),
            *self.bodies.items(),
            ("capacitance as drawn", as_drawn),
            ("written", f"{self.design} and {self.geometry}"),
            ("next", f"sensorgen check {self.design}"),
        ]
        yield Facts(tuple(rows))
        if self.findings:
            yield ""
            yield from listed(self.findings)


@dataclass(frozen=True)
class Assigned:
    """What the bodies of files are printed of, and which are electrodes.

    Attributes
    ----------
    filled : mapping of str to Filled
        Material and terminal of each body.
    tools : mapping of str to int
        Tool of each material that one was given for.
    shorts : tuple of Finding
        Conductors that touch and are both electrodes.
    """

    filled: Mapping[str, imported.Filled]
    tools: Mapping[str, int]
    shorts: tuple[Finding, ...] = ()


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
        found, own = _repaired(name, raw)
        bodies.append(found)
        findings += own
    findings += _sizes(bodies)
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
    found: list[str] = []
    for name in given:
        plain = re.sub("[^A-Za-z0-9._-]+", "_", name).strip("._-")[:60] or "body"
        numbered = (plain, *(f"{plain}-{k}" for k in range(2, len(given) + 2)))
        found.append(next(name for name in numbered if name not in found))
    return found


def _repaired(name: str, raw: FileBody) -> tuple[ReadBody, list[Finding]]:
    """A body with its surfaces closed, and what was repaired or is wrong."""
    made = surfaces.closed(raw.vertices_mm, raw.triangles, max(raw.rounding_mm, surfaces.WELD_MM))
    findings = [Finding("11-surface", "error", name, f.message, f.advice, place_mm=f.place_mm) for f in made.faults]
    findings += [Finding("11-repaired", "info", name, text, "look whether this is meant") for text in made.repairs]
    for shell in made.shells:
        place = surfaces.crossing(shell)
        if place:
            findings.append(
                Finding("11-crossing", "error", name, "faces pass through each other", "make one solid of it in CAD",
                        place_mm=place)
            )  # fmt: skip
    body = ReadBody(name, made.shells, raw, made.repairs)
    if len(made.shells) > 1 and not any(f.severity == "error" for f in findings):
        united = surfaces.united(made.shells)
        twice = body.volume_mm3() - sum(shell.volume_mm3() for shell in united)
        if twice > _OVERLAP_MM * float(np.ptp(body.box_mm, axis=0).max()) ** 2:
            body = replace(body, shells=united, given=replace(raw, revolved=None))
            text = f"parts that overlap by {twice:.3g} mm3 joined"
            findings.append(Finding("11-repaired", "info", name, text, "look whether this is meant"))
    return body, findings


def _sizes(bodies: Sequence[ReadBody]) -> list[Finding]:
    """A finding where the sensor is larger or smaller than one can be: its unit is wrong."""
    box = np.array([body.box_mm for body in bodies])
    low, high = box[:, 0].min(0), box[:, 1].max(0)
    size = high - low
    if (size >= _LEAST_MM).all() and (size <= _MOST_MM).all():
        return []
    shown = " x ".join(f"{edge:.6g}" for edge in size)
    fits = [
        unit for unit, scale in mesh_files.UNITS_MM.items() for factor in (scale, 1 / scale)
        if scale != 1 and (size * factor >= _LEAST_MM).all() and (size * factor <= _MOST_MM / 2).all()
    ]  # fmt: skip
    hint = f"its numbers may be in {' or '.join(dict.fromkeys(fits))}" if fits else "look at its unit"
    return [
        Finding("11-size", "error", "sensor", f"it is {shown} mm; expected 1 to 1000 mm in x and y, from 0.05 in z",
                f"{hint}: export it in mm, or give --unit for STL and 3MF", place_mm=tuple(low.round(6).tolist()))
    ]  # fmt: skip


def _apart(bodies: Sequence[ReadBody]) -> tuple[list[ReadBody], list[Finding]]:
    """Bodies that do not overlap, and findings where they do; what triangles of curved faces share goes to one."""
    made = {body.name: body for body in bodies}
    solids = {body.name: body.solid() for body in bodies}
    findings = []
    for a, b in combinations(made, 2):
        one, other = made[a], made[b]
        if (_shared_mm(one.box_mm, other.box_mm) <= 1e-9).any():
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
        large, small = sorted((a, b), key=lambda name: -made[name].volume_mm3())
        solids[large] = solids[large] - solids[small]
        cut = replace(made[large].given, revolved=None)
        made[large] = replace(made[large], shells=surfaces.shells_of(solids[large]), given=cut)
        text = f"{words}, as the triangles of curved faces do: {small} has it"
        findings.append(Finding("11-repaired", "info", f"{a} / {b}", text, "nothing", place_mm=at))
    return list(made.values()), findings


def _shared_mm(one: Real, other: Real) -> Real:
    """Sides of what two boxes share; negative where they are apart [mm]."""
    return np.asarray(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]))


def _suggested(name: str, colour: str, folder: Path) -> str:
    """A material whose name, colour or usual part a body's name or colour shows; "" for none."""
    known, word = packs.names("materials", folder), name.lower()
    words = set(re.split("[._-]", word))
    named = [material for material in known if material in words or ("-" in material and material in word)]
    painted = []
    for material in known if colour else ():
        with suppress(SensorgenError):  # a material that is damaged is no suggestion
            painted += [material] if designs.material(material, folder).colour.lower() == colour else []
    by_role = [material for role, material in _ROLES if role in word and material in known]
    return next(iter((*named, *painted, *by_role)), "")


def picture(assembly: Assembly) -> str:
    """The places of the errors in three views, as SVG."""
    from sensorgen.scene.drawing import places

    meshes = {b.name: Mesh(b.given.vertices_mm, b.given.triangles.astype(np.int32)) for b in assembly.bodies}
    return places.svg(meshes, [(f.place_mm, f"{f.body}: {f.message}") for f in assembly.errors if f.place_mm])


def assign(assembly: Assembly, maps: Sequence[str], terminals: Sequence[str], folder: Path) -> "Assigned":
    """Material and terminal of each body, and the tools, from what a user has typed.

    Parameters
    ----------
    assembly : Assembly
        The bodies.
    maps : sequence of str
        ``BODY=MATERIAL[@SOURCE][@TOOL]`` each; ``*`` in BODY stands for anything.
    terminals : sequence of str
        ``BODY=TERMINAL`` each: top, middle, bottom or none.
    folder : Path
        Of the design, whose packs may have its materials.

    Raises
    ------
    UnknownName
        No such body, material or terminal.
    BadInput
        Not of that form, or one material on two tools.
    MissingValue
        A body has no material.
    """
    names = [body.name for body in assembly.bodies]
    known: dict[str, bool] = {}  # whether each material conducts
    chosen: dict[str, tuple[str, str]] = {}  # of each body, material with source, and tool
    for pattern, value in _pairs(maps, "--map BODY=MATERIAL@TOOL"):
        parts = _MATERIAL.fullmatch(value)
        if not parts:
            raise BadInput(f"--map {pattern}={value}: expected BODY=MATERIAL@TOOL, as base=etpu@1")
        material, tool = parts["material"], parts["tool"]
        known[material] = designs.material(material, folder).conductor
        for name in _matching(pattern, names):
            chosen[name] = (material + (f"@{parts['source']}" if parts["source"] else ""), tool or "")
    tools: dict[str, int] = {}
    for material, tool in ((slot.partition("@")[0], tool) for slot, tool in chosen.values() if tool):
        if tools.setdefault(material, int(tool)) != int(tool):
            raise BadInput(
                f"--map: {material} is on tools {tools[material]} and {tool}; expected one tool for a material"
            )
    materials = {name: slot for name, (slot, _) in chosen.items()}
    if missing := [name for name in names if name not in materials]:
        colours = {body.name: body.given.colour for body in assembly.bodies}
        words = " ".join(f"--map {name}={_suggested(name, colours[name], folder) or 'MATERIAL'}" for name in missing)
        raise MissingValue(f"no material for {', '.join(missing)}: give {words}")
    conductors = {n for n in names if known[materials[n].partition("@")[0]]}
    ends, shorts = _electrodes(assembly, conductors, terminals)
    filled = {n: imported.Filled.model_validate({"material": materials[n], "terminal": ends.get(n, "")}) for n in names}
    return Assigned(filled, tools, shorts)


def _electrodes(
    assembly: Assembly, conductors: set[str], terminals: Sequence[str]
) -> tuple[dict[str, str], tuple[Finding, ...]]:
    """Terminal of each conductor, by its place unless ``--terminal`` names it, and where they touch."""
    given: dict[str, str] = {}
    for pattern, value in _pairs(terminals, "--terminal BODY=TERMINAL"):
        if value not in ("top", "middle", "bottom", "none"):
            raise UnknownName("terminal", value, ("top", "middle", "bottom", "none"))
        matching = _matching(pattern, [body.name for body in assembly.bodies])
        if idle := sorted(set(matching) - conductors):
            raise BadInput(f"--terminal {pattern}={value}: the material of {idle[0]} does not conduct")
        given |= dict.fromkeys(matching, "" if value == "none" else value)
    ends, shorts = _terminals(assembly, conductors, given)
    if missing := [end for end in ("bottom", "top") if end not in ends.values()]:
        raise BadInput(
            f"no {' and no '.join(missing)} electrode; conductors: {', '.join(sorted(conductors)) or 'none'}; expected "
            "two, by --map BODY=MATERIAL of one that conducts, or --terminal BODY=top"
        )
    return ends, shorts


def _pairs(words: Sequence[str], form: str) -> list[tuple[str, str]]:
    """Names and values, the most exact last, so that it decides: a body's own name goes before any pattern."""
    for word in words:
        if not all(word.partition("=")[::2]):
            raise BadInput(f"{word!r}: expected {form}")
    pairs = [(word.partition("=")[0].strip(), word.partition("=")[2].strip()) for word in words]
    return sorted(pairs, key=lambda pair: (not set("*?[") & set(pair[0]), len(pair[0].replace("*", ""))))


def _matching(pattern: str, names: Sequence[str]) -> list[str]:
    found = [pattern] if pattern in names else [name for name in names if fnmatchcase(name, pattern)]
    if not found:
        raise UnknownName("body", pattern, names)
    return found


def _terminals(
    assembly: Assembly, conductors: set[str], given: Mapping[str, str]
) -> tuple[dict[str, str], tuple[Finding, ...]]:
    """Terminals by height: conductors that touch are one electrode; the lowest is the bottom, the highest the top.

    Of conductors that touch and have two terminals, a finding says that they are a short.
    """
    bodies = sorted((b for b in assembly.bodies if b.name in conductors), key=lambda b: float(b.box_mm[:, 2].mean()))
    solids, boxes = {body.name: body.solid() for body in bodies}, {body.name: body.box_mm for body in bodies}
    groups = {body.name: frozenset([body.name]) for body in bodies}
    for a, b in combinations(groups, 2):
        if (_shared_mm(boxes[a], boxes[b]) > -_CONTACT_MM).all() and solids[a].min_gap(solids[b], 1.0) < _CONTACT_MM:
            joined = groups[a] | groups[b]
            groups |= dict.fromkeys(joined, joined)
    every = [[name for name in groups if groups[name] == own] for own in dict.fromkeys(groups.values())]
    if len(every) == 1 and len(bodies) > 1:  # its lowest and its highest body are shorted
        ends = {**dict.fromkeys(groups, ""), bodies[0].name: "bottom", bodies[-1].name: "top", **given}
        return ends, tuple(_shorts(every, ends))
    decided = {k: {given[name] for name in group if name in given} for k, group in enumerate(every)}
    ends = {name: end for k, group in enumerate(every) for name in group for end in decided[k]}
    ends.update(given)
    left = [k for k, named in decided.items() if not named]
    by_height = sorted(
        (k for k, named in decided.items() if named != {""}),
        key=lambda k: sum(float(boxes[name][:, 2].mean()) for name in every[k]) / len(every[k]),
    )
    if left and len(by_height) > len(_BY_HEIGHT):
        apart = ", ".join(sorted(every[k][0] for k in by_height))
        words = " ".join(f"--terminal {every[k][0]}=END" for k in left)
        raise MissingValue(
            f"{len(by_height)} electrodes that do not touch: {apart}; give {words}, END top, middle, bottom or none"
        )
    places = _BY_HEIGHT if len(by_height) == len(_BY_HEIGHT) else ("bottom", "top")
    ends |= {name: end for k, end in zip(by_height, places, strict=False) if k in left for name in every[k]}
    return ends, tuple(_shorts(every, ends))


def _shorts(groups: Sequence[Sequence[str]], ends: Mapping[str, str]) -> Iterator[Finding]:
    """A finding for each group of touching conductors with several terminals."""
    for group in groups:
        if len({ends.get(name, "") for name in group} - {""}) > 1:
            yield Finding(
                "1-short", "error", " / ".join(group), "conductors that touch are both electrodes: a short",
                "draw them apart in CAD, or map one to a material that does not conduct",
            )  # fmt: skip


def write(
    assembly: Assembly,
    assigned: Assigned,
    *,
    name: str,
    folder: Path,
    more: Mapping[str, Any],
    replace_existing: bool = False,
) -> Imported:
    """Write the design of bodies and the file that holds them, both or neither.

    Parameters
    ----------
    assembly : Assembly
        Bodies without errors.
    assigned : Assigned
        As of :func:`assign`.
    name : str
        Of the design.
    folder : Path
        Where to.
    more : mapping
        Other keys of the design file, as printer and quality.
    replace_existing : bool
        Whether a design of that name may be there.

    Raises
    ------
    SensorgenError
        The design is refused, or a file cannot be written.
    """
    from sensorgen.models import capacitance_models

    low = np.array([body.box_mm[0] for body in assembly.bodies]).min(0)
    high = np.array([body.box_mm[1] for body in assembly.bodies]).max(0)
    by_height = sorted(assembly.bodies, key=lambda body: body.box_mm[::-1, 2].tolist())
    found = {body.name: _exact(body, low, high) or _flat(body, low) for body in by_height}
    length, width, height = (high - low).round(9).tolist()
    chord = max(body.given.chord_mm for body in assembly.bodies)
    content = imported.text(imported.Bodies(found, (length, width, height), chord, assembly.source))
    data = {
        "name": name, "shape": imported.SHAPE, **more,
        "bodies": {n: assigned.filled[n].model_dump(exclude_defaults=True) for n in found},
        "tools": dict(assigned.tools),
    }  # fmt: skip
    path, beside = folder / f"{name}.yaml", folder / imported.file_name(name, content)
    design = designs.make({**data, "geometry": imported.packed(content)}, str(path))
    if path.exists() and not replace_existing:
        raise BadInput(f"{path} exists; expected --force to replace it, or another --name")
    head = f"# imported from {assembly.source}; bodies are changed in CAD, then: sensorgen import\n"
    text = head + yaml.safe_dump({**data, "geometry": beside.name}, sort_keys=False, allow_unicode=True)
    old, drawn = _bodies_of(path), drawn_body(design).cells.first()
    files.replace(beside, content.encode())
    files.replace(path, text.encode())
    if (
        old
        and old != beside
        and not any(old.name in other.read_text("utf-8", "replace") for other in folder.glob("*.yaml"))
    ):
        old.unlink(missing_ok=True)
    return Imported(
        str(path), str(beside), (length, width, height), tuple((-low.round(9) + 0.0).tolist()),
        {n: _words(design, n, own) for n, own in found.items()},
        (*assigned.shorts, *(f for f in assembly.findings if f.severity != "error")),
        {key: model.why_not_applicable(drawn) or "" for key, model in capacitance_models().items()},
    )  # fmt: skip


def _bodies_of(path: Path) -> Path | None:
    """The file of bodies that a design names which is there, and that an import of its name wrote; None for others."""
    try:
        named = yaml.safe_load(path.read_text("utf-8"))["geometry"]
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError):
        return None
    own = isinstance(named, str) and re.fullmatch(re.escape(path.stem) + imported.HASHED, named)
    return path.parent / named if own else None


def _exact(body: ReadBody, low: Real, high: Real) -> tuple[Piece, ...]:
    """A body of revolution in the sensor's coordinates; empty where it is none, or wider than the sensor's box."""
    found = body.given.revolved
    if found is None:
        return ()
    spans = np.array([found.span(axis) for axis in "xyz"])
    if (spans[:, 0] < low - 1e-9).any() or (spans[:, 1] > high + 1e-9).any():
        return ()
    x, y, z = low.tolist()
    outline = tuple((r, round(height - z, 9)) for r, height in found.outline)
    return (replace(found, x_mm=round(found.x_mm - x, 9), y_mm=round(found.y_mm - y, 9), outline=outline),)


def _flat(body: ReadBody, low: Real) -> tuple[Piece, ...]:
    """A body as prisms or polyhedra in the sensor's coordinates."""
    from sensorgen.scene.geometry.recognition import pieces

    return pieces([Mesh(shell.vertices_mm - low, shell.triangles) for shell in body.shells], body.given.rounding_mm)


def _words(design: designs.Design, name: str, own: Sequence[Any]) -> str:
    kinds = [type(piece).__name__.lower() for piece in own]
    shapes = ", ".join(
        f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''}" for kind in dict.fromkeys(kinds)
    )
    one = design.bodies[name]
    material = one.material.partition("@")[0]
    end = f", {one.terminal} electrode" if one.terminal else ""
    return f"{one.material} on tool {design.tool(material)}{end}: {shapes}"
