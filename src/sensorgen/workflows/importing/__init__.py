"""Sensors from other CAD programs: materials, tools and terminals as a user has typed, written as a design."""

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import yaml

from sensorgen.core import files
from sensorgen.core.arrays import Real
from sensorgen.core.document import Column, Facts, Part, Table, apart
from sensorgen.core.errors import BadInput, MissingValue, SensorgenError, UnknownName
from sensorgen.core.findings import Finding, listed
from sensorgen.core.lazy import by_key
from sensorgen.design import design as designs
from sensorgen.design import imported, packs
from sensorgen.prediction.bodies import drawn as drawn_body
from sensorgen.scene.connections import groups
from sensorgen.scene.geometry.meshes import Mesh
from sensorgen.scene.scene import Piece
from sensorgen.workflows.importing.reading import Assembly, ReadBody, shared_mm

_CONTACT_MM = 1e-4  # conductors nearer than this are one electrode
_BY_HEIGHT = ("bottom", "middle", "top")
_MATERIAL = re.compile(r"(?P<material>[^@]+?)(?:@(?P<source>[^@]*[^@0-9][^@]*))?(?:@(?P<tool>[0-9]+))?")
_ROLES = (("support", "bvoh"), ("electrode", "etpu"), ("conduct", "etpu"), ("dielectric", "x60"), ("film", "x60"))


@dataclass(frozen=True)
class Assigned:
    """Materials of the bodies of files, and their electrodes.

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
    materials, conducting, tools = _filling(names, maps, folder)
    if missing := [body for body in assembly.bodies if body.name not in materials]:
        raise MissingValue(f"no material for {', '.join(body.name for body in missing)}: give {_maps(missing, folder)}")
    conductors = {n for n in names if materials[n].partition("@")[0] in conducting}
    ends, shorts = _electrodes(assembly, conductors, terminals)
    filled = {n: imported.Filled.model_validate({"material": materials[n], "terminal": ends.get(n, "")}) for n in names}
    return Assigned(filled, tools, shorts)


def _maps(bodies: Sequence[ReadBody], folder: Path) -> str:
    """Options that give bodies the materials that their names and colours suggest."""
    materials = {body.name: suggested(body.name, body.given.colour, folder) or "MATERIAL" for body in bodies}
    return " ".join(f"--map {name}={material}" for name, material in materials.items())


def _filling(
    names: Sequence[str], maps: Sequence[str], folder: Path
) -> tuple[dict[str, str], set[str], dict[str, int]]:  # fmt: skip
    """Material with source of each body that ``--map`` names, the materials that conduct, and each material's tool."""
    conducting: set[str] = set()
    of_bodies: dict[str, re.Match[str]] = {}  # material, source and tool
    for pattern, value in _pairs(maps, "--map BODY=MATERIAL@TOOL"):
        parts = _MATERIAL.fullmatch(value)
        if not parts:
            raise BadInput(f"--map {pattern}={value}: expected BODY=MATERIAL@TOOL, as base=etpu@1")
        conducting |= {parts["material"]} if designs.material(parts["material"], folder).conductor else set()
        of_bodies |= dict.fromkeys(_matching(pattern, names), parts)
    tools: dict[str, int] = {}
    for material, tool in (parts.group("material", "tool") for parts in of_bodies.values() if parts["tool"]):
        if tools.setdefault(material, int(tool)) != int(tool):
            raise BadInput(
                f"--map: {material} is on tools {tools[material]} and {tool}; expected one tool for a material"
            )
    materials = {name: "@".join(filter(None, parts.group("material", "source"))) for name, parts in of_bodies.items()}
    return materials, conducting, tools


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
    matching = [pattern] if pattern in names else [name for name in names if fnmatchcase(name, pattern)]
    if not matching:
        raise UnknownName("body", pattern, names)
    return matching


def _terminals(
    assembly: Assembly, conductors: set[str], given: Mapping[str, str]
) -> tuple[dict[str, str], tuple[Finding, ...]]:
    """Terminals by height: conductors that touch are one electrode; the lowest is the bottom, the highest the top.

    Of conductors that touch and have two terminals, a finding says that they are a short.
    """
    bodies = sorted((b for b in assembly.bodies if b.name in conductors), key=lambda b: float(b.box_mm[:, 2].mean()))
    every = _touching(bodies)
    if len(every) == 1 and len(bodies) > 1:  # its lowest and its highest body are shorted
        ends = {**dict.fromkeys(every[0], ""), bodies[0].name: "bottom", bodies[-1].name: "top", **given}
    else:
        ends = _by_height(every, {body.name: float(body.box_mm[:, 2].mean()) for body in bodies}, given)
    return ends, tuple(_shorts(every, ends))


def _touching(bodies: Sequence[ReadBody]) -> list[list[str]]:
    """Names of bodies in groups of those that touch."""
    solids = [body.solid() for body in bodies]
    pairs = [
        (a, b) for a, b in combinations(range(len(bodies)), 2)
        if (shared_mm(bodies[a].box_mm, bodies[b].box_mm) > -_CONTACT_MM).all()
        and solids[a].min_gap(solids[b], 1.0) < _CONTACT_MM
    ]  # fmt: skip
    labels = groups(len(bodies), *np.array(pairs, np.int64).reshape(-1, 2).T).tolist()
    return list(by_key(zip(labels, (body.name for body in bodies), strict=True)).values())


def _by_height(
    every: Sequence[Sequence[str]], middle_mm: Mapping[str, float], given: Mapping[str, str]
) -> dict[str, str]:
    """Terminal of each conductor: as given, else by the height of its group."""
    ends = _as_given(every, given)
    left = [group for group in every if group[0] not in ends]
    electrodes = [group for group in every if any(ends.get(name) != "" for name in group)]
    _refuse_undecided(electrodes, left)
    electrodes.sort(key=lambda group: sum(middle_mm[name] for name in group) / len(group))
    places = _BY_HEIGHT if len(electrodes) == len(_BY_HEIGHT) else ("bottom", "top")
    for group, end in zip(electrodes, places, strict=False):
        ends = dict.fromkeys(group, end) | ends
    return ends


def _refuse_undecided(electrodes: Sequence[Sequence[str]], left: Sequence[Sequence[str]]) -> None:
    """Refuse more electrodes than terminals, where some of them have none given."""
    if not left or len(electrodes) <= len(_BY_HEIGHT):
        return
    apart = ", ".join(sorted(group[0] for group in electrodes))
    words = " ".join(f"--terminal {group[0]}=END" for group in left)
    raise MissingValue(
        f"{len(electrodes)} electrodes that do not touch: {apart}; give {words}, END top, middle, bottom or none"
    )


def _as_given(every: Sequence[Sequence[str]], given: Mapping[str, str]) -> dict[str, str]:
    """Terminal of each conductor of a group in which one has a terminal given."""
    ends: dict[str, str] = {}
    for group in every:
        for end in {given[name] for name in group if name in given}:
            ends |= dict.fromkeys(group, end)
    return ends | dict(given)


def _shorts(groups: Sequence[Sequence[str]], ends: Mapping[str, str]) -> Iterator[Finding]:
    """A finding for each group of touching conductors with several terminals."""
    for group in groups:
        if len({ends.get(name, "") for name in group} - {""}) > 1:
            yield Finding(
                "1-short", "error", " / ".join(group), "conductors that touch are both electrodes: a short",
                "draw them apart in CAD, or map one to a material that does not conduct",
            )  # fmt: skip


def suggested(name: str, colour: str, folder: Path) -> str:
    """A material whose name, colour or usual part a body's name or colour shows; "" for none."""
    known, word = packs.names("materials", folder), name.lower()
    words = set(re.split("[._-]", word))
    named = [material for material in known if material in words or ("-" in material and material in word)]
    painted = [material for material in known if _has_colour(material, colour, folder)]
    by_role = [material for role, material in _ROLES if role in word and material in known]
    return next(iter((*named, *painted, *by_role)), "")


def _has_colour(material: str, colour: str, folder: Path) -> bool:
    with suppress(SensorgenError):  # a material that is damaged is no suggestion
        return bool(colour) and designs.material(material, folder).colour.lower() == colour
    return False


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
class BodyListing:
    """Bodies of files, what was repaired or is wrong, and a map to start from.

    Attributes
    ----------
    source : str
        Names of the files.
    typed : tuple of str
        Words of the command: the files, and how they are read.
    bodies : tuple of ListedBody
        All of them, with a suggested material; "?" where nothing suggests one.
    findings : tuple of Finding
        As of :class:`Assembly`.
    """

    source: str
    typed: tuple[str, ...]
    bodies: tuple[ListedBody, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, assembly: Assembly, folder: Path, typed: Sequence[str]) -> "BodyListing":
        """The listing of an assembly, with materials that ship, are beside a folder, or the user's."""
        rows = []
        for body in assembly.bodies:
            x, y, z = (f"{low:g} to {high:g}" for low, high in (body.box_mm.round(6) + 0.0).T.tolist())
            chord = body.given.chord_mm
            faces = f"curved, met to {chord:g} mm" if chord else "flat"
            material = suggested(body.name, body.given.colour, folder) or "?"
            rows.append(ListedBody(body.name, body.volume_mm3(), x, y, z, body.given.colour, faces, material))
        return cls(assembly.source, tuple(typed), tuple(rows), assembly.findings)

    def document(self) -> Iterator[Part]:
        """All of it."""
        yield Table.of("bodies", "", self.bodies)
        yield from apart(listed(self.findings), ["To import it:", *" \\\n  --map ".join(self._words()).split("\n")])

    def words(self) -> str:
        """Words to type to import it."""
        return " --map ".join(self._words())

    def _words(self) -> list[str]:
        """Command, and the map of each body, as a shell reads them."""
        maps = [shlex.quote(f"{body.name}={body.material.replace('?', 'MATERIAL')}") for body in self.bodies]
        return [f"sensorgen import {shlex.join(self.typed)}", *maps]


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

    @property
    def errors(self) -> list[Finding]:
        """Findings with which it cannot be a sensor."""
        return [finding for finding in self.findings if finding.severity == "error"]

    def document(self) -> Iterator[Part]:
        """Files written, and what applies to them."""
        size = " x ".join(f"{edge:g}" for edge in self.size_mm)
        moved = ", ".join(f"{way:g}" for way in self.moved_mm)
        reasons = by_key((reason, name) for name, reason in self.models.items())
        why = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items())
        rows = [
            ("size", f"{size} mm" + (f"; moved by {moved} mm, its corner to 0, 0, 0" if any(self.moved_mm) else "")),
            *self.bodies.items(),
            ("capacitance as drawn", (", ".join(reasons.get("", ())) or f"no model applies, only as printed ({why})")),
            ("written", f"{self.design} and {self.geometry}"),
            (
                "next",
                "correct what is found below, then import again with --force"
                if self.errors
                else f"sensorgen check {self.design}",
            ),
        ]
        yield Facts(tuple(rows))
        yield from apart(listed(self.findings))


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

    bodies, low = _placed(assembly)
    content = imported.text(bodies)
    data = {
        "name": name, "shape": imported.SHAPE, **more,
        "bodies": {n: assigned.filled[n].model_dump(exclude_defaults=True) for n in bodies.pieces},
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
    if old:
        _remove_unused(old)
    return Imported(
        str(path), str(beside), bodies.size_mm, tuple((-low.round(9) + 0.0).tolist()),
        {n: _words(design, n, own) for n, own in bodies.pieces.items()},
        (*assigned.shorts, *(f for f in assembly.findings if f.severity != "error")),
        {key: model.why_not_applicable(drawn) or "" for key, model in capacitance_models().items()},
    )  # fmt: skip


def _placed(assembly: Assembly) -> tuple[imported.Bodies, Real]:
    """Bodies with the sensor's corner at 0, and where that corner was [mm]."""
    boxes = np.array([body.box_mm for body in assembly.bodies])
    low, high = boxes[:, 0].min(0), boxes[:, 1].max(0)
    by_height = sorted(assembly.bodies, key=lambda body: body.box_mm[::-1, 2].tolist())
    pieces = {body.name: _exact(body, low, high) or _flat(body, low) for body in by_height}
    length, width, height = (high - low).round(9).tolist()
    chord = max(body.given.chord_mm for body in assembly.bodies)
    return imported.Bodies(pieces, (length, width, height), chord, assembly.source), low


def _remove_unused(old: Path) -> None:
    """Remove a file of bodies that no design beside it names any more."""
    if not any(old.name in other.read_text("utf-8", "replace") for other in old.parent.glob("*.yaml")):
        old.unlink(missing_ok=True)


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
    revolved = body.given.revolved
    if revolved is None:
        return ()
    spans = np.array([revolved.span(axis) for axis in "xyz"])
    if (spans[:, 0] < low - 1e-9).any() or (spans[:, 1] > high + 1e-9).any():
        return ()
    x, y, z = low.tolist()
    outline = tuple((r, round(height - z, 9)) for r, height in revolved.outline)
    return (replace(revolved, x_mm=round(revolved.x_mm - x, 9), y_mm=round(revolved.y_mm - y, 9), outline=outline),)


def _flat(body: ReadBody, low: Real) -> tuple[Piece, ...]:
    """A body as prisms or polyhedra in the sensor's coordinates."""
    from sensorgen.scene.geometry.surfaces import pieces

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
