"""Materials, tools and terminals of the bodies of files, from what a user has typed; and the list to start from."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import combinations
from pathlib import Path
from typing import Annotated

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput, MissingValue, SensorgenError, UnknownName
from sensorgen.core.findings import Finding, listed
from sensorgen.design import design as designs
from sensorgen.design import imported, packs
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
    if missing := [name for name in names if name not in materials]:
        colours = {body.name: body.given.colour for body in assembly.bodies}
        words = " ".join(f"--map {name}={suggested(name, colours[name], folder) or 'MATERIAL'}" for name in missing)
        raise MissingValue(f"no material for {', '.join(missing)}: give {words}")
    conductors = {n for n in names if materials[n].partition("@")[0] in conducting}
    ends, shorts = _electrodes(assembly, conductors, terminals)
    filled = {n: imported.Filled.model_validate({"material": materials[n], "terminal": ends.get(n, "")}) for n in names}
    return Assigned(filled, tools, shorts)


def _filling(
    names: Sequence[str], maps: Sequence[str], folder: Path
) -> tuple[dict[str, str], set[str], dict[str, int]]:  # fmt: skip
    """Material with source of each body that ``--map`` names, the materials that conduct, and each material's tool."""
    materials: dict[str, str] = {}
    conducting: set[str] = set()
    of_bodies: dict[str, tuple[str, str]] = {}  # material and tool
    for pattern, value in _pairs(maps, "--map BODY=MATERIAL@TOOL"):
        parts = _MATERIAL.fullmatch(value)
        if not parts:
            raise BadInput(f"--map {pattern}={value}: expected BODY=MATERIAL@TOOL, as base=etpu@1")
        material, tool = parts["material"], parts["tool"]
        conducting |= {material} if designs.material(material, folder).conductor else set()
        for name in _matching(pattern, names):
            materials[name] = material + (f"@{parts['source']}" if parts["source"] else "")
            of_bodies[name] = material, tool or ""
    tools: dict[str, int] = {}
    for material, tool in (of_body for of_body in of_bodies.values() if of_body[1]):
        if tools.setdefault(material, int(tool)) != int(tool):
            raise BadInput(
                f"--map: {material} is on tools {tools[material]} and {tool}; expected one tool for a material"
            )
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
        return ends, tuple(_shorts(every, ends))
    ends = _by_height(every, {body.name: float(body.box_mm[:, 2].mean()) for body in bodies}, given)
    return ends, tuple(_shorts(every, ends))


def _touching(bodies: Sequence[ReadBody]) -> list[list[str]]:
    """Names of bodies in groups of those that touch."""
    solids, boxes = {body.name: body.solid() for body in bodies}, {body.name: body.box_mm for body in bodies}
    groups = {body.name: frozenset([body.name]) for body in bodies}
    for a, b in combinations(groups, 2):
        if (shared_mm(boxes[a], boxes[b]) > -_CONTACT_MM).all() and solids[a].min_gap(solids[b], 1.0) < _CONTACT_MM:
            joined = groups[a] | groups[b]
            groups |= dict.fromkeys(joined, joined)
    return [[name for name in groups if groups[name] == own] for own in dict.fromkeys(groups.values())]


def _by_height(
    every: Sequence[Sequence[str]], middle_mm: Mapping[str, float], given: Mapping[str, str]
) -> dict[str, str]:
    """Terminal of each conductor: as given, else by the height of its group."""
    decided = {k: {given[name] for name in group if name in given} for k, group in enumerate(every)}
    ends = {name: end for k, group in enumerate(every) for name in group for end in decided[k]}
    ends.update(given)
    left = [k for k, named in decided.items() if not named]
    by_height = sorted(
        (k for k, named in decided.items() if named != {""}),
        key=lambda k: sum(middle_mm[name] for name in every[k]) / len(every[k]),
    )
    if left and len(by_height) > len(_BY_HEIGHT):
        apart = ", ".join(sorted(every[k][0] for k in by_height))
        words = " ".join(f"--terminal {every[k][0]}=END" for k in left)
        raise MissingValue(
            f"{len(by_height)} electrodes that do not touch: {apart}; give {words}, END top, middle, bottom or none"
        )
    places = _BY_HEIGHT if len(by_height) == len(_BY_HEIGHT) else ("bottom", "top")
    ends |= {name: end for k, end in zip(by_height, places, strict=False) if k in left for name in every[k]}
    return ends


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
    painted = []
    for material in known if colour else ():
        with suppress(SensorgenError):  # a material that is damaged is no suggestion
            painted += [material] if designs.material(material, folder).colour.lower() == colour else []
    by_role = [material for role, material in _ROLES if role in word and material in known]
    return next(iter((*named, *painted, *by_role)), "")


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
    bodies : tuple of ListedBody
        All of them, with a suggested material; "?" where nothing suggests one.
    findings : tuple of Finding
        As of :class:`Assembly`.
    """

    source: str
    bodies: tuple[ListedBody, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, assembly: Assembly, folder: Path) -> "BodyListing":
        """The listing of an assembly, with materials that ship, are beside a folder, or the user's."""
        rows = []
        for body in assembly.bodies:
            x, y, z = (f"{low:g} to {high:g}" for low, high in (body.box_mm.round(6) + 0.0).T.tolist())
            chord = body.given.chord_mm
            faces = f"curved, met to {chord:g} mm" if chord else "flat"
            material = suggested(body.name, body.given.colour, folder) or "?"
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
        """Words to type to import it."""
        maps = " ".join(f"--map {body.name}={body.material.replace('?', 'MATERIAL')}" for body in self.bodies)
        return f"sensorgen import {self.source} {maps}"
