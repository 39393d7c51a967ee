"""What there is to choose from, and what a design file may hold, as plain data."""

import dataclasses
from typing import Any

from sensorgen import models as model_files
from sensorgen.core import plugins as registry
from sensorgen.design import design, printer
from sensorgen.design import materials as material_files
from sensorgen.design import shapes as shape_files

Entries = dict[str, dict[str, Any]]


def shapes() -> Entries:
    """Shapes with their parameters."""
    return {name: _shape(name) for name in registry.names(shape_files)}


def _shape(name: str) -> dict[str, Any]:
    fields = design.fields(name)
    return {"about": _first_line(design.shape(name).__doc__), "values": [f"{k}: {_said(f)}" for k, f in fields.items()]}


def _said(field: dataclasses.Field[Any]) -> str:
    choices = field.metadata.get("choices")
    limits = "one of " + ", ".join(choices) if choices else "{:g} to {:g} mm".format(*field.metadata["range"])
    default = field.default if choices else f"{field.default:g}"
    return f"{field.metadata['help']} ({limits}; default {default})"


def materials() -> Entries:
    """Materials with every value of every source."""
    return {name: _material(name) for name in material_files.names()}


def models() -> Entries:
    """Models with their cost and source."""
    return {name: _model(name) for name in model_files.names()}


def sources() -> Entries:
    """What the names of the sources stand for."""
    return {name: {"about": where} for name, where in material_files.citations().items()}


def _materials_values(material: material_files.Material) -> list[str]:
    return [
        f"{quantity}: {v.value:.7g}  [{v.source}]"
        + (f" ({v.low:g} to {v.high:g})" if v.low is not None and v.high is not None else "")
        + (" (default)" if v.default else "")
        + (" IMPLAUSIBLE, never a default" if v.implausible else "")
        + (f"  {v.note}" if v.note else "")
        for group in (material.properties, material.print)
        for quantity, values in group.items()
        for v in values
    ]


def _material(name: str) -> dict[str, Any]:
    found = material_files.load(name, material_files.own.names())
    return {"about": f"{found.title}: {found.about}", "values": _materials_values(found)}


def printers() -> Entries:
    """Printers with bed, tools and nozzle."""
    return {name: _printer(printer.load_printer(name)) for name in printer.printer_names()}


def _printer(p: printer.Printer) -> dict[str, Any]:
    bed = f"bed {p.bed_mm[0]:g} x {p.bed_mm[1]:g} mm, height {p.height_mm:g} mm, nozzle {p.nozzle_mm:g} mm"
    tools = ", ".join(f"{material} on {tool}" for material, tool in p.default_tools.items())
    return {"about": p.title, "values": [bed, f"tools {list(p.tool_numbers)}: {tools}", f"source: {p.source}"]}


def qualities() -> Entries:
    """Print qualities with their layers."""
    found = (printer.load_quality(name) for name in printer.quality_names())
    return {
        q.name: {"about": q.title, "values": [f"layers {q.layer_mm:g} mm, first {q.first_layer_mm:g} mm"]}
        for q in found
    }


def _model(name: str) -> dict[str, Any]:
    module = registry.load(model_files, name)
    return {"about": _first_line(module.__doc__), "values": [f"cost {module.COST}; {module.SOURCE}"]}


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


def _property(field: dataclasses.Field[Any]) -> dict[str, Any]:
    about = {"description": field.metadata["help"], "default": field.default}
    if "choices" in field.metadata:
        return about | {"enum": list(field.metadata["choices"])}
    low, high = field.metadata["range"]
    return about | {"type": "number", "minimum": low, "maximum": high}
