"""What there is to choose from, and what a design file may hold."""

import json
from collections.abc import Iterator
from dataclasses import Field, asdict, dataclass
from typing import Any

from sensorgen import models as model_files
from sensorgen.core import plugins as registry
from sensorgen.core.document import Facts, Part
from sensorgen.design import design, printer
from sensorgen.design import materials as material_files
from sensorgen.design import shapes as shape_files


@dataclass(frozen=True)
class Entry:
    """What goes by a name: in one sentence, and its parameters or values, a line each."""

    about: str
    values: tuple[str, ...] = ()


@dataclass(frozen=True)
class Catalogue:
    """Names of one kind, with what they stand for."""

    entries: dict[str, Entry]

    def to_json(self) -> str:
        """The entries by their names."""
        return json.dumps({k: asdict(v) for k, v in self.entries.items()}, indent=2, ensure_ascii=False) + "\n"

    def document(self) -> Iterator[Part]:
        """Each name, then its values."""
        wide = max(map(len, self.entries))
        for name, entry in self.entries.items():
            yield Facts(((f"{name:{wide}}", entry.about),))
            if entry.values:
                yield Facts(tuple(("  ", value) for value in entry.values), hang=4)


def shapes() -> Catalogue:
    """Shapes with their parameters."""
    return Catalogue({
        name: Entry(
            _first_line(design.shape(name).__doc__), tuple(f"{k}: {_said(f)}" for k, f in design.fields(name).items())
        )
        for name in registry.names(shape_files)
    })  # fmt: skip


def _said(field: Field[Any]) -> str:
    choices = field.metadata.get("choices")
    limits = "one of " + ", ".join(choices) if choices else "{:g} to {:g} mm".format(*field.metadata["range"])
    default = field.default if choices else f"{field.default:g}"
    return f"{field.metadata['help']} ({limits}; default {default})"


def materials() -> Catalogue:
    """Materials with every value of every source."""
    found = {name: material_files.load(name, material_files.own.names()) for name in material_files.names()}
    return Catalogue({k: Entry(f"{m.title}: {m.about}", tuple(_values(m))) for k, m in found.items()})


def _values(material: material_files.Material) -> Iterator[str]:
    for quantity, values in (*material.properties.items(), *material.print.items()):
        for v in values:
            spread = f" ({v.low:g} to {v.high:g})" if v.low is not None and v.high is not None else ""
            mark = (" (default)" if v.default else "") + (" IMPLAUSIBLE, never a default" if v.implausible else "")
            yield f"{quantity}: {v.value:.7g}  [{v.source}]{spread}{mark}" + (f"  {v.note}" if v.note else "")


def printers() -> Catalogue:
    """Printers with bed, tools and nozzle."""
    return Catalogue({name: _printer(printer.load_printer(name)) for name in printer.printer_names()})


def _printer(p: printer.Printer) -> Entry:
    bed = f"bed {p.bed_mm[0]:g} x {p.bed_mm[1]:g} mm, height {p.height_mm:g} mm, nozzle {p.nozzle_mm:g} mm"
    tools = ", ".join(f"{material} on {tool}" for material, tool in p.default_tools.items())
    return Entry(
        p.title,
        (
            bed,
            f"tools {list(p.tool_numbers)}: {tools}",
            f"heights of two tools equal to {p.tool_height_error_mm:g} mm",
            f"source: {p.source}",
        ),
    )


def qualities() -> Catalogue:
    """Print qualities with their layers."""
    found = (printer.load_quality(name) for name in printer.quality_names())
    return Catalogue({
        q.name: Entry(q.title, (f"layers {q.layer_mm:g} mm, first {q.first_layer_mm:g} mm",)) for q in found
    })  # fmt: skip


def models() -> Catalogue:
    """Models with their cost and source."""
    found = {name: registry.load(model_files, name) for name in model_files.names()}
    return Catalogue({k: Entry(_first_line(m.__doc__), (f"cost {m.COST}; {m.SOURCE}",)) for k, m in found.items()})


def sources() -> Catalogue:
    """What the names of the sources stand for."""
    return Catalogue({name: Entry(where) for name, where in material_files.citations().items()})


def _first_line(doc: str | None) -> str:
    return (doc or "").strip().partition("\n")[0]


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of the design file; the parameters depend on the shape."""
    made = design.Design.model_json_schema()
    names = registry.names(shape_files)
    made["properties"]["shape"] |= {"enum": names}
    made["properties"]["parameters"] = {"type": "object"}
    made["allOf"] = [
        {"if": {"properties": {"shape": {"const": n}}}, "then": {"properties": {"parameters": _parameters(n)}}}
        for n in names
    ]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made, "title": "sensorgen design"}


def _parameters(name: str) -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "properties": {k: _property(f) for k, f in design.fields(name).items()},
    }


def _property(field: Field[Any]) -> dict[str, Any]:
    about = {"description": field.metadata["help"], "default": field.default}
    if "choices" in field.metadata:
        return about | {"enum": list(field.metadata["choices"])}
    low, high = field.metadata["range"]
    return about | {"type": "number", "minimum": low, "maximum": high}
