"""Check of a pack's files: values with sources, valid scenes, profiles, code that runs."""

import ast
import dataclasses
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from sensorgen.core import yamlfile
from sensorgen.core.document import Part, comma_separated
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName, nearest
from sensorgen.core.findings import Finding, counted, counts, listed, table
from sensorgen.design import design as designs
from sensorgen.design import materials, packs, printer, shape_files
from sensorgen.design.packs import File, Kind, Pack
from sensorgen.export import machine
from sensorgen.export.slicers.loads import ToolLoad
from sensorgen.measure import accuracy
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Envelope, Fill, Scene

_SMALL = {"length_mm": 12.0, "width_mm": 5.0}  # of a test's sensor, where the shape's ranges hold it
_IMPORTS = ("sensorgen.scene", "sensorgen.core.errors")
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?")
Step = Callable[[str], None]


@dataclass(frozen=True)
class PackReport:
    """Faults of a pack.

    Attributes
    ----------
    pack : str
        Its name, or the file.
    files : int
        How many were tested.
    counts : dict of str to int
        Findings of each severity.
    findings : tuple of Finding
        All of them.
    """

    pack: str
    files: int
    counts: dict[str, int]
    findings: tuple[Finding, ...]

    def document(self) -> Iterator[Part]:
        """The findings, then their number."""
        yield from listed(self.findings)
        yield f"{self.pack}: {self.files} file{'s' if self.files > 1 else ''}, {counted(self.counts)}"

    def csv(self) -> Iterator[str]:
        """The findings as a table."""
        yield comma_separated(table(self.findings))


def chosen(word: str) -> list[File]:
    """Files of a pack by its name, of a folder, or one file.

    Raises
    ------
    BadInput
        There is no such pack or folder, nothing in it, or the file is in no folder of a kind.
    UnknownName
        No pack goes by that name.
    """
    if Path(word).is_file():
        return [_one(word)]
    files = _files(_pack(word))
    if not files:
        raise _nothing(word)
    return files


def _one(word: str) -> File:
    path = Path(word)
    own = [file for pack in packs.own() for file in _files(pack) if file.path.resolve() == path.resolve()]
    if own:  # of a pack whose folder is elsewhere
        return own[0]
    kind = next((kind for kind in packs.SINGULAR if path.absolute().parent.name == kind), None)
    if kind is None or path.suffix != packs.suffix(kind) or not packs.is_name(kind, path.stem):
        folders = ", ".join(packs.SINGULAR)
        raise BadInput(
            f"{word}: expected a file in a folder of its kind ({folders}), named by small letters, digits and '-', "
            "ending in .yaml (shapes: .py)"
        )
    return File(kind, path.stem, packs.beside(path.parent.parent))


def _pack(word: str) -> Pack:
    """A pack by its folder or its name."""
    if Path(word).is_dir():
        return packs.beside(Path(word))
    known = {pack.name: pack for pack in [*packs.installed(), *packs.own(), *packs.shipped()]}
    if word not in known:
        raise UnknownName("pack", word, known)
    return known[word]


def _files(pack: Pack) -> list[File]:
    return [File(kind, name, pack) for kind in packs.SINGULAR for name in pack.names(kind)]


def _nothing(word: str) -> BadInput:
    return BadInput(f"{word}: no files of a pack; expected folders as {', '.join(packs.SINGULAR)}")


def trust(word: str) -> list[str]:
    """Trust the shapes of a pack, a folder, one file, or a design's file that contains theirs; where each is.

    Raises
    ------
    BadInput
        There are none.
    """
    texts = _shape_texts(word)
    if not texts:
        raise BadInput(f"{word}: has no shapes; expected a pack with shapes, a shape's file, or a design that has one")
    for _, name, text in texts:
        shape_files.trust(name, text)
    return [where for where, _, _ in texts]


def _shape_texts(word: str) -> list[tuple[str, str, str]]:
    """Place, name and text of each shape."""
    path = Path(word)
    if path.suffix in (".yaml", ".yml") and path.absolute().parent.name not in packs.SINGULAR:
        match yamlfile.read(path):
            case {"own": {"shapes": {**shapes}}}:
                return [(f"{word}: {name}", str(name), text) for name, text in shapes.items() if isinstance(text, str)]
        return []
    files = [file for file in chosen(word) if file.kind == "shapes" and file.pack.where != "shipped"]
    return [(str(file.path), file.name, file.text()) for file in files]


def conformance(word: str, step: Step = lambda _: None) -> PackReport:
    """Test the files of a pack; ``word`` as of :func:`chosen`, ``step`` gets the name of each file."""
    pack = None if Path(word).is_file() else _pack(word)
    files = _files(pack) if pack else [_one(word)]
    findings = list(_of_pack(pack, files) if pack else _requirements(files[0].pack))
    if not files and not findings:
        raise _nothing(word)
    for file in files:
        step(file.name)
        findings += _of_file(file, step)
    return PackReport(word, len(files), counts(findings), tuple(findings))


def _of_pack(pack: Pack, files: Sequence[File]) -> Iterator[Finding]:
    """Findings about a pack as a whole."""
    yield from _requirements(pack)
    if pack.where != "shipped":
        yield from (_finding("place", *words) for words in _misplaced(pack))
        yield from (_finding("name", *words) for words in _twice(pack, files))


def _requirements(pack: Pack) -> Iterator[Finding]:
    """Requirements of a pack that are not met."""
    try:
        packs.check_requires(pack)
    except SensorgenError as error:
        yield _finding("requires", packs.MANIFEST, str(error), "install it, or correct 'requires'")


def _of_file(file: File, step: Step) -> list[Finding]:
    """Findings about one file."""
    where = f"{file.kind}/{file.path.name}"
    try:
        if file.pack.where != "shipped" and file.name in packs.shipped_names(file.kind):
            return [_finding("name", where, f"a {packs.SINGULAR[file.kind]} of that name ships", "rename it")]
        faults = _shape(file, step) if file.kind == "shapes" else _TESTS[file.kind](file)
        return [_finding(rule, where, *words) for rule, *words in faults]
    except SensorgenError as error:
        kind = _kind_of(file.path)
        advice = f"it holds a {packs.SINGULAR[kind]}: move it to {kind}" if kind and kind != file.kind else ""
        return [_finding("read", where, str(error), advice or "correct the file")]


def _finding(rule: str, where: str, message: str, advice: str) -> Finding:
    return Finding(rule, "error", where, message, advice)


Faults = Iterator[tuple[str, str, str]]  # rule, message, advice; or file, message, advice

_KEYS: dict[Kind, set[str]] = {
    "materials": {"conductor", "properties"}, "sources": {"about", "materials"}, "qualities": {"layer_mm"},
    "printers": {"tool_numbers", "bed_mm"}, "instruments": {"least_ohm", "most_ohm"},
}  # fmt: skip


def _kind_of(path: Path) -> Kind | Literal[""]:
    """The kind of a file by its content; "" where that does not say."""
    if path.suffix == ".py":
        return "shapes"
    try:
        keys = yamlfile.read(path).keys()
    except SensorgenError:
        return ""
    return next((kind for kind, needed in _KEYS.items() if needed <= keys), "")


def _misplaced(pack: Pack) -> Faults:
    """Files that nothing reads: of another ending or name than those of their folder, or in no folder of a kind."""
    yield from _unread(pack)
    for folder in _listed(pack.folder):
        near = nearest(folder.name, packs.SINGULAR)
        if near and folder.is_dir() and folder.name not in packs.SINGULAR:
            yield f"{folder.name}/", "nothing reads this folder", f"rename it to {near}"
    if (pack.folder / packs.MANIFEST).exists():  # else a folder with designs, whose files are named by their paths
        for path in _listed(pack.folder, (".yaml", ".yml")):
            if path.name != packs.MANIFEST and (own := _kind_of(path)):
                yield path.name, f"nothing reads this {packs.SINGULAR[own]} here", f"move it to {own}"


def _unread(pack: Pack) -> Faults:
    """Files of another ending or name than those of their folder."""
    for kind in packs.SINGULAR:
        read = {f"{name}{packs.suffix(kind)}" for name in pack.names(kind)} | {"__init__.py"}
        for path in _listed(pack.place(kind), (".yaml", ".yml", ".py")):
            if path.name not in read:
                yield f"{kind}/{path.name}", "nothing reads this file", _where_to(path, kind)


def _listed(folder: Path, endings: str | tuple[str, ...] = "") -> list[Path]:
    try:
        return sorted(
            path for path in folder.iterdir() if not path.name.startswith(".") and path.name.endswith(endings)
        )
    except OSError:
        return []


def _where_to(path: Path, kind: Kind) -> str:
    """Advice on a file that nothing reads."""
    right = _kind_of(path) or kind
    name = re.sub("[^a-z0-9]+", "-", path.stem.lower()).strip("-") or "own"
    folder = "" if right == kind else f"move it to {right}, as "
    return f"{folder or 'rename it to '}{name}{packs.suffix(right)}"


def _twice(pack: Pack, files: Sequence[File]) -> Faults:
    """Names that another pack of the same rank has, too: a design that uses one of them is refused."""
    ranks = {"own": packs.own(), "installed": packs.installed()}
    rank = next(
        (rank for rank, known in ranks.items() if pack.folder.resolve() in {p.folder.resolve() for p in known}), ""
    )
    for other in ranks.get(rank, ()):
        if other.folder.resolve() != pack.folder.resolve():
            for file in files:
                if file.name in other.names(file.kind):
                    what = f"pack {other.name} has a {packs.SINGULAR[file.kind]} {file.name!r} too: "
                    where = f"{file.kind}/{file.path.name}"
                    yield where, f"{what}{other.path(file.kind, file.name)}", "rename or remove one of them"


def _material(file: File) -> Faults:
    material = materials.parse(file.name, file.text())
    cited = {*material.citations, *materials.shipped_citations()}
    known = {*materials.quantities(), *materials.print_quantities()}
    for quantity, values in (*material.properties.items(), *material.print.items()):
        if quantity not in known:
            yield "quantity", str(UnknownName("quantity", quantity, known)), "take a name that sensorgen reads"
        yield from _default(quantity, values)
        for value in values:
            if value.source not in cited:
                where = "say under 'citations' where it is published"
                yield "source", f"{quantity}: source {value.source!r} is not explained", where
            if value.default and value.implausible:
                yield "default", f"{quantity} of {value.source} is implausible and a default", "remove one of them"
    if not material.properties and not material.print:
        yield "values", "no values", "add at least one quantity"


def _default(quantity: str, values: Sequence[materials.Value]) -> Faults:
    """Lack of a default among the values of one quantity."""
    usable = [value.source for value in values if not value.implausible and math.isfinite(value.value)]
    if usable and not any(value.default for value in values):
        yield "default", f"{quantity} has no default value", f"add 'default: true' to that of {usable[0]}"


def _program(file: File, text: str) -> Faults:
    """Faults of a shape's file as a program: what keeps it from being tried comes last."""
    for name in _imported(text, file):
        if not name.startswith(_IMPORTS) and name.partition(".")[0] not in sys.stdlib_module_names:
            yield "imports", f"imports {name}", "a shape imports sensorgen.scene and the standard library only"
    if file.pack.where == "shipped":
        return
    if not shape_files.is_trusted(text):
        yield "trust", "not trusted: did not run", f"read it, then: sensorgen pack trust {file.path}"
    elif shape_files.varies(file.name, text, dataclasses.asdict(Fill())):
        message = "the same parameters give different bodies from run to run"
        yield "random", message, "compute from the parameters alone: no random numbers, no time, no order of a set"


def _shape(file: File, step: Step) -> Faults:
    """Faults of its scenes at the ends of its parameters, each once with how many sensors have it."""
    text, rule = file.text(), ""
    for rule, message, advice in _program(file, text):
        yield rule, message, advice
    if rule in ("trust", "random"):
        return
    form = shape_files.load(file.name, text) if file.pack.where != "shipped" else designs.shape(file.name)
    if not (form.__doc__ or "").strip():
        yield "about", "the file does not say what the shape is", "begin with a docstring: one sentence, and a picture"
    usual = {f.name: f.default for f in fields(form.Params)} | {
        name: value for f in fields(form.Params) if (name := f.name) in _SMALL
        for value in (min(max(_SMALL[name], f.metadata["range"][0]), f.metadata["range"][1]),)
    }  # fmt: skip
    yield from _of_scenes(form, list(_cases(form.Params, usual)), lambda about: step(f"{file.name}: {about}"))


def _of_scenes(form: Any, cases: Sequence[tuple[str, dict[str, Any]]], step: Step) -> Faults:
    """Faults of the scenes of some sets of parameters, alike ones once."""
    alike = dict[tuple[str, str], tuple[str, str, set[str]]]()
    for about, changed in cases:
        step(about or "defaults")
        for rule, message, advice in _tried(form, changed, about):
            alike.setdefault((rule, _NUMBER.sub("", message)), (about + message, advice, set()))[2].add(about)
    for (rule, _), (message, advice, where) in alike.items():
        yield rule, message + (f" (in {len(where)} of {len(cases)} sensors tried)" if len(where) > 1 else ""), advice


def _tried(form: Any, changed: dict[str, Any], about: str) -> Faults:
    """Faults of the scenes of one set of parameters: of two materials, of three, and with a support."""
    try:
        params = form.Params(**changed)
        if 0 < params.cells() < designs.MAX_CELLS:
            for fill in (Fill(), Fill(support="bvoh"), Fill(film="pla")):
                yield from _scene_faults(form.scene(params, fill), fill)
    except OutOfRange:
        if not about:
            raise


def _imported(text: str, file: File) -> Iterator[str]:
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise BadInput(f"{file.path.name}, line {error.lineno}: {error.msg}") from None
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or "."


def _cases(params: type[Envelope], usual: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Defaults, then each parameter at the ends of its range, or at each of its choices."""
    yield "", usual
    for f in fields(params):
        for value in f.metadata.get("choices") or f.metadata["range"]:
            if not (f.name in _SMALL and value == f.metadata["range"][1]):  # a metre of a fine pattern takes long
                yield f"{f.name} {value}: ", usual | {f.name: value}


def _scene_faults(scene: Scene, fill: Fill) -> Faults:
    terminals = sorted(body.terminal for body in scene.bodies if body.terminal)
    if terminals not in (["bottom", "top"], ["bottom", "middle", "top"]):
        yield "terminals", f"terminals are {terminals}", "give one body 'top', and one 'bottom'"
    by_body = {body.name: meshes.mesh(body) for body in scene.bodies}
    for body, fault in meshes.faults(scene, by_body):
        yield "scene", f"{body}: {fault}", "correct scene()"
    yield from _volume_faults(scene, fill)


def _volume_faults(scene: Scene, fill: Fill) -> Faults:
    """Bodies that overlap or leave their box, and air that a support does not fill."""
    volume, box = sum(body.volume_mm3() for body in scene.bodies), math.prod(scene.size_mm)
    is_round = any(piece.is_round() for body in scene.bodies for piece in body.pieces)
    within = 1e-3 if is_round else 1e-9  # beside a circle, a support has chords
    if volume > box * (1 + within):
        yield "volume", f"bodies have {volume:.6g} mm3, their box {box:.6g} mm3", "correct scene()"
    if fill.support and abs(volume - box) > within * box:
        missing = f"with a support, {box - volume:.3g} mm3 of {box:.6g} mm3 are left empty"
        yield "support", missing, "fill all air with a body 'support' where fill.support is given"


def _printer(file: File) -> Faults:
    machine_, quality = printer.load_printer(file.name, file.own_text), printer.load_quality("fine")
    layer_mm = max(quality.layer_mm, machine_.min_layer_mm)
    quality = quality.model_copy(update={"layer_mm": layer_mm, "first_layer_mm": layer_mm})
    loads = dict(zip(machine_.tool_numbers, map(ToolLoad, map(materials.load, ("etpu", "x60"))), strict=False))
    yield from machine.faults(machine_, quality, loads)
    try:
        machine_.check_tools(file.pack.folder)
    except SensorgenError as error:
        yield "tools", str(error), "correct the name, or leave it out"


def _quality(file: File) -> Faults:
    quality = printer.load_quality(file.name, file.own_text)
    errors = []
    for name in printer.printer_names():
        machine_ = printer.load_printer(name)
        loads = {machine_.tool_numbers[0]: ToolLoad(materials.load("etpu"))}
        errors += [message for rule, message, _ in machine.faults(machine_, quality, loads) if rule == "profile"][:1]
    if len(errors) == len(printer.printer_names()):
        yield "profile", f"no printer that ships can print it: {errors[0]}", "correct layers and speeds"


def _instrument(file: File) -> Faults:
    instrument = accuracy.parse(file.text(), file.path.name)
    type_ = instrument.name.split()[-1]
    if not instrument.ranges and not instrument.bands:
        yield "limits", "neither ranges nor bands", "add the maker's limits of error"
    if not accuracy.is_of(instrument, f"MAKER,{type_},0,1.0"):
        yield "name", f"a reading of {type_!r} would not name it", "end 'name' with the type"
    for one in instrument.ranges:
        error_ohm = instrument.dc_ohm(one.ohm / 2, 4)
        yield from _limit(error_ohm, one.ohm, f"{one.ohm / 2:g} ohm is", "range")
    z_ohm = complex(0, -math.sqrt(instrument.least_ohm * min(instrument.most_ohm, 1e12)) or -1.0)
    for band in instrument.bands:
        middle = math.sqrt(band.from_hz * band.to_hz)
        error_ohm = instrument.ac("X", z_ohm.imag, middle, z_ohm)
        yield from _limit(error_ohm, abs(z_ohm), f"{abs(z_ohm):g} ohm at {middle:g} Hz are", "band")


def _limit(error_ohm: float | None, most_ohm: float, reading: str, part: str) -> Faults:
    """Refuse an error that is unknown, none, or no less than a resistance."""
    if error_ohm is None or not 0 < error_ohm < most_ohm:
        yield "limits", f"{reading} known to {error_ohm} ohm", f"correct the {part}"


def _source(file: File) -> Faults:
    source = materials.own_source(file.name, file.text())
    for name, values in source.materials.items():
        for quantity, value in values.items():
            given, advised = materials.Value(source=file.name, **dict(value)), quantity in materials.print_quantities()
            if wrong := materials.fault(quantity, given, advised=advised):
                yield "value", f"{quantity} of {name} {wrong}", "correct the number or its unit"


_TESTS: dict[Kind, Callable[[File], Faults]] = {
    "materials": _material, "sources": _source, "printers": _printer, "qualities": _quality,
    "instruments": _instrument,
}  # fmt: skip
