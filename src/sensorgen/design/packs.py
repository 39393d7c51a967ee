"""Packs: where the name of a material, shape, printer, quality, instrument or source becomes a file.

A pack is a folder with any of the folders ``materials``, ``sources``, ``shapes``, ``printers``, ``qualities`` and
``instruments``, and perhaps a ``pack.yaml``. The folder of a design's own file is one. A name is looked up in what
ships with sensorgen, then beside the design, in the user's packs, and in installed packages; names that ship cannot be
given again, so that a design means the same everywhere.
"""

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from sensorgen.core import files as store
from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.records import Strict, checked
from sensorgen.core.version import __version__

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

PLACE = "SENSORGEN_PACKS"  # environment variable with another folder of the user's packs
SOURCES = "SENSORGEN_MATERIALS"  # environment variable with another folder of fitted sources
GROUP = "sensorgen.packs"  # of entry points of installed packages
MANIFEST = "pack.yaml"
BESIDE = "beside the design"

Kind = Literal["materials", "sources", "shapes", "printers", "qualities", "instruments"]
SINGULAR: Mapping[Kind, str] = {
    "materials": "material", "sources": "source", "shapes": "shape", "printers": "printer", "qualities": "quality",
    "instruments": "instrument",
}  # fmt: skip
NAME = re.compile(r"[a-z0-9]([a-z0-9-]{0,38}[a-z0-9])?")
_NAMES: Mapping[Kind, re.Pattern[str]] = {
    "sources": re.compile(r"[a-z0-9][a-z0-9.-]*"), "shapes": re.compile(r"[a-z0-9]([a-z0-9_-]{0,38}[a-z0-9])?"),
}  # fmt: skip
_PackName = Annotated[str, Field(pattern=f"^{NAME.pattern}$", examples=["lab-filaments"])]


class Manifest(Strict):
    """Content of ``pack.yaml``; all of it may be left out."""

    version: str = ""
    about: str = ""
    requires: Annotated[tuple[_PackName, ...], Field(strict=False, examples=["lab-filaments"])] = ()


@dataclass(frozen=True)
class Pack:
    """A pack.

    Attributes
    ----------
    name : str
        Of its folder or entry point.
    where : str
        "shipped", "beside the design", "own" or "installed".
    folder : Path
        That holds the folders of each kind.
    package : str
        Name and version of the package that installed it, or "".
    moved : mapping
        Folders of kinds that lie elsewhere.
    """

    name: str
    where: str
    folder: Path
    package: str = ""
    moved: tuple[tuple[Kind, Path], ...] = ()

    @cached_property
    def manifest(self) -> Manifest:
        """Content of ``pack.yaml``; raises BadInput where it is damaged."""
        path = self.folder / MANIFEST
        if not os.path.lexists(path):
            return Manifest()
        try:
            return checked(Manifest, yamlfile.parse(_text(path, self.folder), str(path)))
        except BadInput as error:
            raise error.within(str(path)) from None

    @property
    def version(self) -> str:
        """Version of the package, or as ``pack.yaml`` has it."""
        return __version__ if self.where == "shipped" else self.package.partition(" ")[2] or self.manifest.version

    def place(self, kind: Kind) -> Path:
        """Folder of one kind."""
        return dict(self.moved).get(kind) or self.folder / kind

    def path(self, kind: Kind, name: str) -> Path:
        """Where the file of a name would be."""
        return self.place(kind) / f"{name}{suffix(kind)}"

    def names(self, kind: Kind) -> list[str]:
        """Names of one kind; other files are no concern of ours."""
        try:
            files = [entry.name for entry in os.scandir(self.place(kind))]
        except OSError:
            return []
        stems = (file.removesuffix(suffix(kind)) for file in files if file.endswith(suffix(kind)))
        return sorted(stem for stem in stems if is_name(kind, stem) and stem not in _NO_NAMES)


_NO_NAMES = ("sources",)  # in the folder of shipped materials: what the sources' names mean


@dataclass(frozen=True)
class File:
    """A file of a pack that a name stands for."""

    kind: Kind
    name: str
    pack: Pack

    @property
    def path(self) -> Path:
        """Where it is."""
        return self.pack.path(self.kind, self.name)

    def text(self) -> str:
        """Content; raises BadInput where it cannot be read, is too large, or a link leads out of the pack."""
        return _text(self.path, dict(self.pack.moved).get(self.kind, self.pack.folder))

    @property
    def own_text(self) -> str | None:
        """Content of a file that does not ship."""
        return None if self.pack.where == "shipped" else self.text()


def suffix(kind: Kind) -> str:
    """Ending of the names of files of a kind."""
    return ".py" if kind == "shapes" else ".yaml"


def is_name(kind: Kind, name: str) -> bool:
    """Test whether something of that kind can have the name."""
    return bool(_NAMES.get(kind, NAME).fullmatch(name))


def is_path(kind: Kind, word: str) -> bool:
    """Test whether a word is meant as a file, not as a name."""
    return word.endswith((suffix(kind), ".yml")) or "/" in word or "\\" in word


def _text(path: Path, folder: Path) -> str:
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a link to itself
        inside = False
    if not inside:
        raise BadInput(f"{path}: a link that leads out of its pack; copy the file to its place")
    return yamlfile.text(path)


@cache
def profiles() -> Path:
    """Where printers, qualities and profile templates are: inside the wheel, or beside ``src``."""
    packed = Path(str(resources.files("sensorgen"))) / "slicer_profiles"
    return packed if packed.is_dir() else Path(__file__).parents[3] / "slicer_profiles"


@cache
def shipped() -> tuple[Pack, ...]:
    """Packs that ship with sensorgen."""
    here, package = Path(__file__).parent, Path(__file__).parents[1]
    thesis: tuple[tuple[Kind, Path], ...] = (
        ("printers", profiles() / "printers"), ("qualities", profiles() / "qualities"),
    )  # fmt: skip
    others: tuple[tuple[Kind, Path], ...] = (("instruments", package / "measure" / "accuracy"),)
    return (
        Pack("thesis", "shipped", here, moved=thesis), Pack("filaments", "shipped", here / "filaments"),
        Pack("others", "shipped", profiles() / "others", moved=others),
    )  # fmt: skip


@cache
def shipped_names(kind: Kind) -> dict[str, Pack]:
    """Names of one kind that ship, with their packs."""
    return {name: pack for pack in shipped() for name in pack.names(kind)}


def beside(folder: Path) -> Pack:
    """The folder of a design's file as a pack."""
    return Pack(folder.resolve().name or "here", BESIDE, folder)


def own() -> list[Pack]:
    """The user's packs, and the folder of fitted sources."""
    try:
        places = sorted(entry.path for entry in os.scandir(place()) if entry.is_dir())
    except OSError:
        places = []
    packs = [Pack(path.name, "own", path) for path in map(Path, places) if NAME.fullmatch(path.name)]
    fits = store.data(SOURCES, "materials")
    return [*packs, Pack("fits", "own", fits, moved=(("sources", fits),))]


def place() -> Path:
    """Folder of the user's packs: what SENSORGEN_PACKS says, or the system's place for configuration."""
    return store.config(PLACE, "packs")


def installed() -> list[Pack]:
    """Packs of installed packages, none of which is imported.

    Raises
    ------
    BadInput
        An entry point is damaged, or names a folder that is not there.
    """
    from importlib.metadata import entry_points

    try:
        points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    except Exception as error:  # whatever a damaged package makes of it
        raise BadInput(f"entry points of installed packages cannot be read ({error}); repair or uninstall it") from None
    return [_of_package(point) for point in points]


def _of_package(point: "EntryPoint") -> Pack:
    dist = point.dist
    package = f"{dist.metadata['Name'] or '?'} {dist.metadata['Version'] or '?'}" if dist else "? ?"
    parts = point.value.split(".")
    whose = f"pack {point.name!r} of the installed package {package.partition(' ')[0]!r}"
    if not NAME.fullmatch(point.name) or not all(part.isidentifier() for part in parts):
        raise BadInput(f"{whose}: entry point {point.value!r:.80} names no folder, as in my_package.pack; uninstall it")
    folder = _folder(dist, parts)
    if not folder.is_dir():
        raise BadInput(f"{whose}: there is no folder {'/'.join(parts)!r} in it; repair or uninstall it")
    return Pack(point.name, "installed", folder, package)


def _folder(dist: "Distribution | None", parts: Sequence[str]) -> Path:
    """Folder of a part of an installed package, which is not imported; it need not be there."""
    from importlib.util import find_spec

    folder = Path(str(dist.locate_file("/".join(parts)))) if dist else Path(*parts)
    if folder.is_dir():
        return folder
    try:  # of the first part alone: finding a part of a package would run the package
        spec = find_spec(parts[0])
    except (ImportError, ValueError, AttributeError):
        return folder
    top = list(spec.submodule_search_locations or ()) if spec else []
    return Path(top[0]).joinpath(*parts[1:]) if top else folder


def find(kind: Kind, name: str, folder: Path | None = None) -> File:
    """The file that a name stands for.

    Parameters
    ----------
    kind : str
        Of the file.
    name : str
        As a design has it.
    folder : Path, optional
        Of the design's own file; the working folder if not given.

    Raises
    ------
    UnknownName
        No pack has it; the nearest name is offered, and how to make one.
    BadInput
        Several packs have it, or one beside the design hides what ships; or a pack requires what is not there.
    """
    here = beside(folder or Path())
    pack = shipped_names(kind).get(name)
    if pack:
        if here.path(kind, name).is_file() and here.place(kind).resolve() != pack.place(kind).resolve():
            raise BadInput(
                f"{here.path(kind, name)}: a {SINGULAR[kind]} {name!r} ships with sensorgen (pack {pack.name}); "
                "rename the file"
            )
        return File(kind, name, pack)
    if is_name(kind, name) and (packs := _having(kind, name, here)):
        if len(packs) > 1:
            paths_of = " and ".join(str(pack.path(kind, name)) for pack in packs)
            raise BadInput(f"{SINGULAR[kind]} {name!r} is in {len(packs)} packs: {paths_of}; rename or remove one")
        check_requires(packs[0])
        return File(kind, name, packs[0])
    built_in = ["array"] if kind == "shapes" else []  # crossing tracks: the one shape that is no file
    raise unknown(kind, name, (*(file.name for file in files(kind, folder)), *built_in))


def _having(kind: Kind, name: str, here: Pack) -> list[Pack]:
    """Packs with a file of that name: the one beside the design, else those of the user's, else installed ones."""

    def having(packs: Iterable[Pack]) -> list[Pack]:
        return [pack for pack in packs if os.path.lexists(pack.path(kind, name))]

    return having([here]) or having(own()) or having(installed())


def unknown(kind: Kind, name: str, known: Iterable[str]) -> UnknownName:
    """An error for a name that no pack has, with how to make one."""
    error = UnknownName(SINGULAR[kind], name, known)
    if is_name(kind, name) and kind != "sources":
        error.args = (f"{error}; your own: sensorgen new {SINGULAR[kind]} {name}",)
    return error


def files(kind: Kind, folder: Path | None = None) -> list[File]:
    """All files of one kind: shipped, beside a design, the user's, installed; in this order, and by name."""
    packs = everywhere(folder)
    places = dict[Path, Pack]()
    for pack in packs:
        places.setdefault(pack.place(kind).resolve(), pack)
    return [File(kind, name, pack) for pack in places.values() for name in pack.names(kind)]


def everywhere(folder: Path | None = None) -> list[Pack]:
    """All packs: shipped, beside a design, the user's, installed."""
    return [*shipped(), beside(folder or Path()), *own(), *installed()]


def names(kind: Kind, folder: Path | None = None) -> list[str]:
    """Names of all files of one kind."""
    return sorted({file.name for file in files(kind, folder)})


def source_names() -> list[str]:
    """Names of the user's own sources."""
    return sorted({name for pack in own() for name in pack.names("sources")})


def check_requires(pack: Pack, path: tuple[str, ...] = ()) -> None:
    """Raise BadInput where a pack requires one that is not there, or itself through others."""
    path = (*path, pack.name)
    if not pack.manifest.requires:
        return
    known = {each.name: each for each in (*shipped(), *own(), *installed())}
    for name in pack.manifest.requires:
        manifest = pack.folder / MANIFEST
        if name in path:
            raise BadInput(f"{manifest}: packs require each other in a circle: {' -> '.join((*path, name))}")
        if name not in known:
            raise BadInput(
                f"{manifest}: requires pack {name!r}, which is not there; install it, or copy it to {place()}"
            )
        check_requires(known[name], path)


def with_files(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's data with the text of every file that it needs of packs that do not ship.

    Parameters
    ----------
    data : dict
        Of a design, not validated yet; what is not well formed is left for the validation to refuse.
    folder : Path
        Of the design's file: where files are relative to, and its own pack.

    Raises
    ------
    SensorgenError
        A name that no pack has, or a file that cannot be read.
    """
    given = data.get("own", {})
    if not isinstance(given, dict) or not all(isinstance(texts, dict) for texts in given.values()):
        return data
    files = _OwnFiles({kind: dict(given.get(kind, {})) for kind in SINGULAR}, folder)
    complete = data | dict(files.of_parts(data))
    for name in _other_materials(data):
        files.add_other(name)
    used = {kind: dict(sorted(content.items())) for kind, content in files.texts.items() if content}
    return complete | ({"own": given | used} if used or "own" in data else {})


def slots(materials: Mapping[str, Any]) -> dict[str, Any]:
    """Materials by part, where ``electrode`` is both electrodes.

    >>> slots({"electrode": "eel", "top_electrode": "etpu"})
    {'top_electrode': 'etpu', 'bottom_electrode': 'eel'}
    """
    if "electrode" not in materials:
        return dict(materials)
    both = {f"{end}_electrode": materials["electrode"] for end in ("top", "bottom")}
    return both | {part: word for part, word in materials.items() if part != "electrode"}


def _other_materials(data: Mapping[str, Any]) -> Iterator[Any]:
    """Materials that a design names besides those of its parts."""
    profile, tip = (given if isinstance(given := data.get(key), dict) else {} for key in ("profile", "tip"))
    tables = [*map(data.get, ("tools", "infill", "material_values"))]
    tables += map(profile.get, ("wall_lines", "line_mm", "infill_angle_deg"))
    yield from (name for table in tables if isinstance(table, dict) for name in table)
    if tip.get("block", "even") not in ("even", "stiff"):
        yield tip["block"]


@dataclass(frozen=True)
class _OwnFiles:
    """Files that a design needs of packs that do not ship.

    Attributes
    ----------
    texts : dict
        Their content by kind and name; grows.
    folder : Path
        Of the design's file.
    """

    texts: dict[Kind, dict[str, Any]]
    folder: Path

    def of_parts(self, data: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
        """Keys of a design's data whose files are taken over, each with the names of these files in place of paths."""
        yield from self.shape_and_machine(data)
        cell, materials, bodies = (data.get(key) for key in ("cell", "materials", "bodies"))
        if isinstance(cell, dict) and isinstance(cell.get("shape"), str) and cell["shape"] != "array":  # no file
            yield "cell", cell | {"shape": self.add("shapes", cell["shape"])}
        if isinstance(materials, dict):
            yield "materials", {part: self.slot(word) for part, word in slots(materials).items()}
        if isinstance(bodies, dict):
            yield "bodies", {name: self.body(body) for name, body in bodies.items()}

    def shape_and_machine(self, data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        """Shape, printer and quality, where they are given; a shape's file by its name."""
        kinds: tuple[tuple[str, Kind], ...] = (("shape", "shapes"), ("printer", "printers"), ("quality", "qualities"))
        for key, kind in kinds:
            word = data.get(key)
            no_file = key == "shape" and ("geometry" in data or word == "array")
            if isinstance(word, str) and not no_file:
                yield key, self.add(kind, word)

    def body(self, body: Any) -> Any:
        """An imported body, its material's file by its name."""
        return body | {"material": self.slot(body.get("material"))} if isinstance(body, dict) else body

    def slot(self, word: Any) -> Any:
        """A slot's material and source, a material's file by its name."""
        if not isinstance(word, str):
            return word
        name, mark, source = word.partition("@")
        if is_name("materials", name) or is_path("materials", name):
            name = self.add("materials", name)
        if is_name("sources", source) and source not in self.texts["sources"]:
            here = (beside(self.folder), *own())
            file = next((pack for pack in here if os.path.lexists(pack.path("sources", source))), None)
            if file:
                self.texts["sources"][source] = File("sources", source, file).text()
        return f"{name}{mark}{source}"

    def add_other(self, name: Any) -> None:
        """Keep the text of a material that does not ship; what is no name is left for the validation to refuse."""
        if isinstance(name, str) and is_name("materials", name) and name not in shipped_names("materials"):
            self.add("materials", name)

    def add(self, kind: Kind, word: str) -> str:
        """Keep the text of what a word stands for, unless it ships or is there already; its name in the design."""
        texts = self.texts[kind]
        if word in texts:
            return word
        if not is_path(kind, word):
            file = find(kind, word, self.folder)
            if file.pack.where != "shipped":
                texts[word] = file.text()
            return word
        path = self.folder / word if (self.folder / word).exists() else Path(word)
        text = yamlfile.text(path)
        if kind in ("printers", "qualities"):  # whose files may be changed copies of those that ship
            texts[word] = text
            return word
        name = path.name.removesuffix(suffix(kind))
        if not is_name(kind, name):
            raise BadInput(
                f"{path}: {name!r} cannot be a {SINGULAR[kind]}'s name; expected small letters, digits and '-'"
            )
        texts[name] = text
        return name


def check_texts(own_texts: Mapping[Kind, Mapping[str, str]]) -> None:
    """Raise BadInput where a design brings a material or shape by the name of one that ships."""
    for kind in ("materials", "shapes"):
        for name in own_texts.get(kind, {}):
            if pack := shipped_names(kind).get(name):
                raise BadInput(
                    f"a {SINGULAR[kind]} {name!r} ships with sensorgen (pack {pack.name}); rename the file of yours"
                )
