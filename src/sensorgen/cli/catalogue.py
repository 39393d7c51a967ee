"""Lists of all that can be chosen, and the content of a design file."""

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import Field, asdict, dataclass, fields, replace
from typing import Any

from sensorgen import models as model_files
from sensorgen.core import lazy as registry
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design, packs, printer, shape_files
from sensorgen.design import materials as material_files
from sensorgen.design.packs import Kind
from sensorgen.scene.scene import Envelope


@dataclass(frozen=True)
class ListEntry:
    """Entry of a list: in one sentence, its parameters or values, a line each, and where it comes from."""

    about: str
    values: tuple[str, ...] = ()
    pack: str = ""
    version: str = ""
    where: str = ""
    file: str = ""

    @property
    def origin(self) -> str:
        """Where it comes from, in words; "" for what ships."""
        if self.where in ("", "shipped"):
            return f"pack {self.pack}" if self.pack else "shipped" if self.where else ""
        version = f" {self.version}" if self.version else ""
        return f"pack {self.pack}{version}, {self.where}: {self.file}"


@dataclass(frozen=True)
class Catalogue:
    """Names of one kind, with what they stand for."""

    entries: dict[str, ListEntry]

    def to_json(self) -> str:
        """The entries by their names."""
        return json.dumps({k: asdict(v) for k, v in self.entries.items()}, indent=2, ensure_ascii=False) + "\n"

    def document(self) -> Iterator[Part]:
        """Each name and its origin, then its values."""
        wide = max(map(len, self.entries), default=0)
        for name, entry in self.entries.items():
            about = f"{entry.about} [{entry.origin}]" if entry.origin else entry.about
            yield Facts(((f"{name:{wide}}", about),))
            if entry.values:
                yield Facts(tuple(("  ", value) for value in entry.values), hang=4)


def _of_packs(kind: Kind, entry: Callable[[packs.File], ListEntry]) -> Catalogue:
    """Every file of a kind by its name; one that is damaged says so, and hides no other."""
    entries: dict[str, ListEntry] = {}
    for file in packs.files(kind):
        try:
            listed = entry(file)
        except SensorgenError as error:
            listed = ListEntry(f"cannot be used: {error}")
        version = ""
        with suppress(SensorgenError):
            version = file.pack.version
        pack, path = file.pack, str(file.path)
        entries.setdefault(file.name, replace(listed, pack=pack.name, version=version, where=pack.where, file=path))
    return Catalogue(dict(sorted(entries.items())))


def shapes() -> Catalogue:
    """Shapes with their parameters."""
    return _of_packs("shapes", _shape)


def _form(file: packs.File) -> shape_files.Shape:
    text = file.own_text
    return design.shape(file.name) if text is None else shape_files.load(file.name, text)


def _shape(file: packs.File) -> ListEntry:
    if file.pack.where != "shipped" and not shape_files.is_trusted(file.text()):
        return ListEntry(f"not trusted: did not run; read it, then: sensorgen pack trust {file.path}")
    module = _form(file)
    return ListEntry(_first_line(module.__doc__), tuple(f"{f.name}: {_said(f)}" for f in fields(module.Params)))


def _said(field: Field[Any]) -> str:
    choices = field.metadata.get("choices")
    low, high = field.metadata.get("range", (0.0, 0.0))
    limits = f"one of {', '.join(choices)}" if choices else f"{low:g} to {high:g} {design.unit_of(field)}"
    default = field.default if choices else f"{field.default:g}"
    return f"{field.metadata['help']} ({limits}; default {default})"


def materials() -> Catalogue:
    """Materials with every value of every source."""
    return _of_packs("materials", _material)


def _material(file: packs.File) -> ListEntry:
    text = file.own_text
    texts: material_files.Texts = {} if text is None else {"materials": {file.name: text}}
    m = material_files.load(file.name, packs.source_names(), texts)
    return ListEntry(f"{m.title}: {m.about}", tuple(_values(m)))


def _values(material: material_files.Material) -> Iterator[str]:
    for quantity, values in (*material.properties.items(), *material.print.items()):
        for v in values:
            spread = f" ({v.low:g} to {v.high:g})" if v.low is not None and v.high is not None else ""
            mark = (" (default)" if v.default else "") + (" IMPLAUSIBLE, never a default" if v.implausible else "")
            yield f"{quantity}: {v.value:.7g}  [{v.source}]{spread}{mark}" + (f"  {v.note}" if v.note else "")


def printers() -> Catalogue:
    """Printers with bed, tools and nozzle."""
    return _of_packs("printers", lambda file: _printer(printer.load_printer(file.name, file.own_text)))


def _printer(p: printer.Printer) -> ListEntry:
    bed = f"bed {p.bed_mm[0]:g} x {p.bed_mm[1]:g} mm, height {p.height_mm:g} mm, nozzle {p.nozzle_mm:g} mm"
    tools = ", ".join(f"{material} on {tool}" for material, tool in p.default_tools.items())
    equal = f"heights of two tools equal to {p.tool_height_error_mm:g} mm"
    return ListEntry(p.title, (bed, f"tools {list(p.tool_numbers)}: {tools}", equal, f"source: {p.source}"))


def qualities() -> Catalogue:
    """Print qualities with their layers."""

    def entry(file: packs.File) -> ListEntry:
        q = printer.load_quality(file.name, file.own_text)
        return ListEntry(q.title, (f"layers {q.layer_mm:g} mm, first {q.first_layer_mm:g} mm",))

    return _of_packs("qualities", entry)


def instruments() -> Catalogue:
    """Instruments with the source of their accuracy."""
    from sensorgen.measure import accuracy

    def entry(file: packs.File) -> ListEntry:
        instrument = accuracy.parse(file.text(), f"{file.name}.yaml")
        return ListEntry(instrument.name, (f"source: {instrument.source}",))

    return _of_packs("instruments", entry)


def devices() -> Catalogue:
    """Kinds of devices that a run drives, those of other packages and of PyMeasure included."""
    from sensorgen.measure.lab import catalogue

    return Catalogue({name: ListEntry(about) for name, about in catalogue.listed().items()})


def all_packs() -> Catalogue:
    """Packs with the number of files of each kind."""
    entries: dict[str, ListEntry] = {}
    for pack in packs.everywhere():
        counts = {kind: len(pack.names(kind)) for kind in packs.SINGULAR}
        files = ", ".join(f"{n} {packs.SINGULAR[kind] if n == 1 else kind}" for kind, n in counts.items() if n)
        if files:
            name = pack.name if pack.name not in entries else f"{pack.name} ({pack.where})"
            entries[name] = _pack(pack, files)
    return Catalogue(entries)


def _pack(pack: packs.Pack, files: str) -> ListEntry:
    try:
        about, version = pack.manifest.about, pack.version
    except SensorgenError as error:
        about, version = f"cannot be used: {error}", ""
    values = (files,) if about else ()
    return ListEntry(about or files, values, pack.name, version, pack.where, str(pack.folder))


def models() -> Catalogue:
    """Models with their cost and source."""
    entries = {name: registry.load(model_files, name) for name in model_files.names()}
    return Catalogue(
        {k: ListEntry(_first_line(m.__doc__), (f"cost {m.COST}; {m.SOURCE}",)) for k, m in entries.items()}
    )


def sources() -> Catalogue:
    """References behind the names of the sources."""
    return Catalogue({name: ListEntry(where) for name, where in material_files.citations().items()})


def _first_line(doc: str | None) -> str:
    return (doc or "").strip().partition("\n")[0]


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of the design file; the parameters depend on the shape."""
    schema = design.Design.model_json_schema()
    shapes = dict[str, type[Envelope]]()
    for file in packs.files("shapes"):
        with suppress(SensorgenError):  # not trusted, or damaged: the list of shapes says so
            shapes[file.name] = _form(file).Params
    schema["properties"]["shape"] |= {"anyOf": [{"enum": list(shapes)}, {"pattern": r"\.py$"}]}
    slots = schema["$defs"]["Slots"]["properties"]
    slots["electrode"] = slots["top_electrode"] | {"description": "Both electrodes.", "default": None}
    schema["properties"]["parameters"] = {"type": "object"}
    schema["allOf"] = [
        {"if": {"properties": {"shape": {"const": n}}}, "then": {"properties": {"parameters": {
            "type": "object", "additionalProperties": False, "properties": {f.name: _property(f) for f in fields(p)},
        }}}}
        for n, p in shapes.items()
    ]  # fmt: skip
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "sensorgen design"}


def _property(field: Field[Any]) -> dict[str, Any]:
    about = {"description": field.metadata["help"], "default": field.default}
    if "choices" in field.metadata:
        return about | {"enum": list(field.metadata["choices"])}
    low, high = field.metadata["range"]
    return about | {"type": "number", "minimum": low, "maximum": high}
