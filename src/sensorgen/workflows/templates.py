"""New files of a user's own, from commented templates that pass their checks as they are."""

import os
from dataclasses import dataclass
from pathlib import Path

from sensorgen.core import files, yamlfile
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.design import packs
from sensorgen.design.packs import Kind

_KINDS: dict[str, Kind] = {singular: kind for kind, singular in packs.SINGULAR.items()}
_NEXT = {
    "material": "replace its numbers; then sensorgen pack test {file}, and --material electrode={name} in any command",
    "shape": "change it; then sensorgen pack trust {file}, sensorgen pack test {file}, and sensorgen check {name}",
    "printer": "replace its numbers; then sensorgen pack test {file}, and --printer {name} in any command",
    "quality": "replace its numbers; then sensorgen pack test {file}, and --quality {name} in any command",
    "instrument": "replace its numbers; then sensorgen pack test {file}",
    "design": "change it; then sensorgen check {file}",
    "target": "change it; then sensorgen optimise {file}",
    "experiment": "change it; then sensorgen bench run {file} --simulate",
}


@dataclass(frozen=True)
class NewFile:
    """A new file.

    Attributes
    ----------
    file : str
        Where it is.
    next : str
        What to do with it.
    """

    file: str
    next: str

    def document(self) -> tuple[Part, ...]:
        """Both, a line each."""
        return self.file, f"next: {self.next}"


def new(what: str, name: str, pack: str = "") -> NewFile:
    """Write a template.

    Parameters
    ----------
    what : str
        A kind of file, as of ``sensorgen new``.
    name : str
        Of the material, shape ...
    pack : str
        The user's pack that it goes to; the working folder if not given.

    Raises
    ------
    BadInput
        The name cannot be one, is that of something that ships, or the file exists.
    Unwritable
        The file cannot be written.
    """
    kind = _KINDS.get(what)
    _refuse_name(what, name, pack)
    home = packs.Pack(pack, "own", packs.place() / pack) if pack else packs.beside(Path())
    file = home.path(kind, name) if kind else home.folder / f"{name}.yaml"
    if os.path.lexists(file):
        raise BadInput(f"{str(file)!r} exists; choose another name, or delete it first")
    template = Path(packs.__file__).parent / "templates" / f"{what}{packs.suffix(kind) if kind else '.yaml'}"
    files.replace(file, yamlfile.text(template).replace("NAME", name).encode())
    return NewFile(str(file), _NEXT[what].format(name=name, file=file))


def _refuse_name(what: str, name: str, pack: str) -> None:
    """Refuse what cannot be a name, and a name that ships."""
    kind = _KINDS.get(what)
    if not packs.is_name(kind or "shapes", name):
        example = {"shape": "block_tip"}.get(what, "lab-eel")
        raise BadInput(f"{name!r:.60} cannot be a {what}'s name; expected small letters and digits, as {example}")
    if pack and not packs.NAME.fullmatch(pack):
        raise BadInput(f"--pack {pack!r:.60}; expected small letters, digits and '-', as lab-filaments")
    if kind and (ships := packs.shipped_names(kind).get(name)):
        raise BadInput(f"a {what} {name!r} ships with sensorgen (pack {ships.name}); choose another name")
